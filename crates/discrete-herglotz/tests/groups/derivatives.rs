//! Derivatives of motions in the start and in parameters, forces, and states at any time.

use super::{EPS, General, distance, start, tilted};
use contact_geom::groups::{
    GroupError, GroupForce, GroupForced, GroupLagrangian, LieGroup, ParametricGroupLagrangian, RigidBody, Rotation,
    Rotations, UniformGravity,
};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::numbers::{MaxAbsOrNan, max_abs_or_nan};
use contact_geom::{ChartVector, Scalar};
use discrete_herglotz::SplittingScheme;
use discrete_herglotz::groups::{
    DenseGroupMotion, GroupDerivatives, GroupGauss, GroupIntegrator, GroupMotion, GroupState, RigidBodySplitting,
};

/// The state `(g exp(eta), Pi + dPi, z + dz)` with the tangent vector as `x, y, z`.
fn moved(at: &GroupState<Rotations, 3>, by: ChartVector<3>) -> GroupState<Rotations, 3> {
    GroupState { g: Rotations::compose(&at.g, &Rotations::exp(&by.x)), momentum: at.momentum + by.y, z: at.z + by.z }
}

/// The tangent vector from one state to another that is near.
fn between(a: &GroupState<Rotations, 3>, b: &GroupState<Rotations, 3>) -> ChartVector<3> {
    let turn = Rotations::log(&Rotations::compose(&Rotations::inverse(&a.g), &b.g));
    ChartVector { x: turn, y: b.momentum - a.momentum, z: b.z - a.z }
}

fn end_by<I: GroupIntegrator<Rotations, 3>>(
    method: &I,
    from: GroupState<Rotations, 3>,
    steps: usize,
) -> GroupState<Rotations, 3> {
    let mut motion = GroupMotion::new(0.2, from).unwrap();
    motion.advance(method, steps).unwrap();
    motion.state()
}

/// The step of central differences: their error is of the size of its square and of round-off divided by it.
const D: f64 = 1e-5;

/// The bound of the error of a central difference of numbers of order one over a motion of 20 steps: `D^2` times third
/// derivatives of a few tens, and a hundred `EPS / D`.
const DIFFERENCE: f64 = 100.0 * (D * D + EPS / D);

fn assert_close(found: &DMatrix<f64>, column: usize, ahead: ChartVector<3>, behind: ChartVector<3>, what: &str) {
    for i in 0..7 {
        let difference = (ahead.component(i) - behind.component(i)) / (2.0 * D);
        let apart = (found[(i, column)] - difference).abs();
        assert!(apart < DIFFERENCE, "{what}: ({i}, {column}): {} {difference}", found[(i, column)]);
    }
}

/// The derivatives of any method in the start are those of central differences.
fn in_the_start<I: GroupIntegrator<Rotations, 3>>(method: &I, what: &str) -> GroupDerivatives<Rotations, 3> {
    let found = GroupDerivatives::new(method, 0.2, &start(), 20).unwrap();
    assert!(distance(&found.end, &end_by(method, start(), 20)) < 200.0 * EPS);
    for k in 0..7 {
        let end = |d: f64| {
            let by = ChartVector::from_fn(|i| if i == k { d } else { 0.0 });
            between(&found.end, &end_by(method, moved(&start(), by), 20))
        };
        assert_close(&found.in_start, k, end(D), end(-D), what);
    }
    found
}

/// In the start, by collocation with any rate and by a splitting; the motion of 20 steps is conformally contact.
#[test]
fn derivatives_in_the_start() {
    let splitting = RigidBodySplitting::new(tilted(-0.3), SplittingScheme::SUZUKI_4, 0.05).unwrap();
    let found = [
        in_the_start(&GroupGauss::new::<Rotations, 3>(General, 3, 0.05).unwrap(), "general"),
        in_the_start(&GroupGauss::new::<Rotations, 3>(tilted(-0.3), 2, 0.05).unwrap(), "body"),
        in_the_start(&splitting, "splitting"),
    ];
    for found in found {
        // The round-off of twenty steps.
        assert!(found.contact_defect() < 20.0 * 64.0 * EPS, "{:e}", found.contact_defect());
        let gradient = ChartVector::from_fn(|i| i as f64 - 2.5);
        let (of_start, _) = found.gradients(&gradient);
        let along = ChartVector::from_fn(|i| (i as f64).cos());
        let pushed = ChartVector::from_fn(|i| (0..7).map(|k| found.in_start[(i, k)] * along.component(k)).sum());
        let (forward, backward) = (gradient.dot(&pushed), of_start.dot(&along));
        assert!((forward - backward).abs() < 64.0 * EPS * found.in_start.iter().map(|x| x.abs()).sum::<f64>() * 10.0);
    }
}

/// In all thirteen parameters of a body: the inertia, the weight, the centre of mass and the rate.
#[test]
fn derivatives_in_the_parameters() {
    let body = tilted(-0.3);
    let gauss = GroupGauss::new::<Rotations, 3>(body, 3, 0.05).unwrap();
    let found = GroupDerivatives::with_parameters(&gauss, 0.2, &start(), 20).unwrap();
    let theta = ParametricGroupLagrangian::<Rotations, 3>::parameters(&body);
    let names = ParametricGroupLagrangian::<Rotations, 3>::parameter_names(&body);
    assert_eq!(names.len(), 13);
    assert_eq!([&names[1], &names[6], &names[11], &names[12]], ["M[0][1]", "weight[0]", "centre[2]", "gamma"]);
    let with = |theta: &[f64]| {
        let [a, b, c, d, e, f] = theta[..6].try_into().unwrap();
        let inertia = SMatrix::from([[a, b, c], [b, d, e], [c, e, f]]);
        let [weight, centre] = [6, 9].map(|k| std::array::from_fn(|i| theta[k + i]));
        RigidBody::new(inertia, UniformGravity { weight, centre }, theta[12]).unwrap()
    };
    for (k, name) in names.iter().enumerate() {
        let end = |d: f64| {
            let mut theta = theta.clone();
            theta[k] += d;
            let gauss = GroupGauss::new::<Rotations, 3>(with(&theta), 3, 0.05).unwrap();
            between(&found.end, &end_by(&gauss, start(), 20))
        };
        assert_close(&found.in_parameters, k, end(D), end(-D), name);
    }
}

/// A brake of the first axis and a thrust that turns with the body and with time.
#[derive(Clone, Copy)]
struct BrakeAndThrust;

impl GroupForce<Rotations, 3> for BrakeAndThrust {
    fn value<T: Scalar>(&self, t: T, g: &Rotation<T>, xi: &SVector<T, 3>, z: T) -> SVector<T, 3> {
        let up = g.apply_inverse(&SVector::from([T::zero(), T::zero(), T::one()]));
        SVector::from([xi[0] * -0.4, t.cos() * up[1] * 0.3, z * 0.1])
    }
}

/// The right sides of the equations with a force, for the classical method of Runge and Kutta with small steps: an
/// oracle that has nothing in common with collocation in charts.
fn field(t: f64, x: &GroupState<Rotations, 3>) -> ChartVector<3> {
    let body = tilted(-0.3);
    let omega = body.velocity(&x.momentum);
    let partials = GroupLagrangian::<Rotations, 3>::partials(&body, t, &x.g, &omega, x.z);
    let force = BrakeAndThrust.value(t, &x.g, &omega, x.z);
    let momentum = Rotations::cobracket(&omega, &x.momentum) + partials.force + force + x.momentum * partials.rate;
    ChartVector { x: omega, y: momentum, z: partials.value }
}

fn by_runge_kutta(span: f64, steps: usize) -> GroupState<Rotations, 3> {
    let h = span / steps as f64;
    let mut x = start();
    for k in 0..steps {
        let t = 0.2 + k as f64 * h;
        // In the chart at x; the derivative of the exponential map is inverted at each stage.
        let rate = |t: f64, by: ChartVector<3>| {
            let f = field(t, &moved(&x, by));
            ChartVector { x: Rotations::dexp_inverse(&by.x, &f.x), ..f }
        };
        let zero = ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 0.0 };
        let a = rate(t, zero);
        let b = rate(t + 0.5 * h, a.scale(0.5 * h));
        let c = rate(t + 0.5 * h, b.scale(0.5 * h));
        let d = rate(t + h, c.scale(h));
        x = moved(&x, a.plus(b.scale(2.0)).plus(c.scale(2.0)).plus(d).scale(h / 6.0));
    }
    x
}

/// Forces: the motion is that of the equations of Lagrange, d'Alembert and Herglotz, with the order of the method, and
/// it is not contact.
#[test]
fn forced_bodies() {
    let forced = GroupForced { lagrangian: tilted(-0.3), force: BrakeAndThrust };
    let end = |stages: usize, steps: usize| {
        end_by(&GroupGauss::new::<Rotations, 3>(forced, stages, 1.5 / steps as f64).unwrap(), start(), steps)
    };
    let reference = end(6, 15);
    // The error of the oracle, of order 4, falls sixteenfold from a run with half as many steps.
    let oracle = [400, 800].map(|steps| distance(&by_runge_kutta(1.5, steps), &reference));
    assert!(oracle[1] < 1e-10 && oracle[0] / oracle[1] > 12.0, "{oracle:?}");
    for (stages, counts) in [(1, [48, 96]), (2, [12, 24]), (3, [6, 12])] {
        let errors = counts.map(|steps| distance(&end(stages, steps), &reference));
        let slope = (errors[0] / errors[1]).log2();
        assert!((slope - 2.0 * stages as f64).abs() < 0.15, "{stages} stages: {slope}, {errors:?}");
    }
    let gauss = GroupGauss::new::<Rotations, 3>(forced, 3, 0.05).unwrap();
    let found = in_the_start(&gauss, "forced");
    assert!(found.contact_defect() > 1e-2, "{:e}", found.contact_defect());
    // The defect of a step is the virtual work of the force.
    for h in [0.3, -0.1] {
        let gauss = GroupGauss::new::<Rotations, 3>(forced, 2, h).unwrap();
        let step = GroupDerivatives::new(&gauss, 0.2, &start(), 1).unwrap();
        let work = gauss.virtual_work(0.2, &start()).unwrap();
        assert!(work.max_abs_or_nan() > 1e-3 && step.contact_defect() > 1e-3, "{work:?}");
        let defect = step.contact_defect_beside(&work);
        assert!(defect < 64.0 * EPS, "{defect:e} {work:?}");
    }
    let free = GroupGauss::new::<Rotations, 3>(General, 2, 0.3).unwrap();
    assert_eq!(free.virtual_work(0.2, &start()).unwrap().max_abs_or_nan(), 0.0);
    let parameters = GroupDerivatives::with_parameters(&gauss, 0.2, &start(), 20).unwrap();
    assert_eq!(parameters.in_parameters.ncols(), 13);
    assert!(max_abs_or_nan(parameters.in_parameters.iter().copied()) > 1e-2);
}

/// States between steps have the order of the method, those at steps are the steps; backward in time too.
#[test]
fn states_at_any_time() {
    for h in [0.1, -0.1] {
        let gauss = GroupGauss::new::<Rotations, 3>(General, 4, h).unwrap();
        let fine = GroupGauss::new::<Rotations, 3>(General, 8, h / 2.0).unwrap();
        let dense = DenseGroupMotion::new(gauss, 0.2, &start(), 10).unwrap();
        assert!((dense.span()[1] - (0.2 + 10.0 * h)).abs() < 4.0 * EPS);
        let gauss = GroupGauss::new::<Rotations, 3>(General, 4, h).unwrap();
        assert_eq!(dense.at(0.2).unwrap(), start());
        assert!(distance(&dense.at(0.2 + 7.0 * h).unwrap(), &end_by(&gauss, start(), 7)) < 32.0 * EPS);
        // The error of order 8 of seven steps of 0.1, and not more between them.
        let at = dense.at(0.2 + 7.5 * h).unwrap();
        assert!(distance(&at, &end_by(&fine, start(), 15)) < 1e-10);
        for t in [0.2 - 0.1 * h, 0.2 + 10.1 * h, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(matches!(dense.at(t), Err(GroupError::OutsideSpan { .. })), "{t}");
        }
    }
    let gauss = GroupGauss::new::<Rotations, 3>(General, 4, 0.1).unwrap();
    let none = GroupState { momentum: SVector::from([f64::NAN; 3]), ..start() };
    assert!(matches!(GroupDerivatives::new(&gauss, 0.0, &none, 3), Err(GroupError::NonFinite { .. })));
    assert!(matches!(GroupDerivatives::new(&gauss, f64::NAN, &start(), 3), Err(GroupError::NonFinite { .. })));
}
