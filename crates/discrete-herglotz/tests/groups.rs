//! Contact Gauss collocation and splittings on Lie groups: the heavy top to its published numbers, conformal contact by
//! the pullback on T\*G x R in body coordinates, orders, momenta of symmetries, and invalid input.

// A failed `unwrap` is a failure of the test.
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

#[path = "groups/boundary.rs"]
mod boundary;

#[path = "groups/derivatives.rs"]
mod derivatives;

use contact_geom::groups::{
    GroupError, GroupLagrangian, Inertia, LieGroup, RigidBody, RigidMotion, RigidMotions, Rotation, Rotations,
    UniformGravity,
};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{MaxAbsOrNan, MaxOrNan};
use contact_geom::{ChartVector, Dual, Scalar};
use discrete_herglotz::SplittingScheme;
use discrete_herglotz::groups::{GroupGauss, GroupIntegrator, GroupMotion, GroupState, RigidBodySplitting};

#[path = "groups/runs.rs"]
mod runs;

const EPS: f64 = f64::EPSILON;

/// The heavy top of the numerical literature (Brüls and Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002), with drag.
fn heavy_top(gamma: f64) -> RigidBody<UniformGravity, 3> {
    let (mass, centre) = (15.0, [0.0, 1.0, 0.0]);
    let inertia = Inertia::principal([0.234375, 0.46875, 0.234375]).unwrap().about(mass, centre).unwrap();
    let gravity = UniformGravity { weight: [0.0, 0.0, -9.81 * mass], centre };
    RigidBody::rotating(&inertia, gravity, gamma).unwrap()
}

fn heavy_top_start(top: &RigidBody<UniformGravity, 3>) -> GroupState<Rotations, 3> {
    let momentum = top.momentum(&SVector::from([0.0, 150.0, -4.61538]));
    GroupState { g: Rotations::identity(), momentum, z: 0.0 }
}

/// The displacement of the centre of mass at t = 2.
const DISPLACEMENTS: [(f64, [f64; 3]); 3] = [
    (0.0, [-0.150416822746, -1.724165591637, -0.673022269560]),
    (-0.1, [0.0374345758, -1.0896201362, -0.9952722661]),
    (-1.0, [0.3400708520, -1.5218687466, -0.7823073737]),
];

/// Runs the heavy top to t = 2 and returns its displacement, its action and the relative defects of its two momenta.
fn run_heavy_top(
    gamma: f64,
    steps: usize,
    method: impl Fn(&RigidBody<UniformGravity, 3>, f64) -> Box<dyn Fn(&mut GroupMotion<Rotations, 3>, usize)>,
) -> (SVector<f64, 3>, f64, [f64; 2]) {
    let top = heavy_top(gamma);
    let start = heavy_top_start(&top);
    let mut motion = GroupMotion::new(0.0, start).unwrap();
    method(&top, 2.0 / steps as f64)(&mut motion, steps);
    let end = motion.state();
    let x = SVector::from([0.0, 1.0, 0.0]);
    let factor = (2.0 * gamma).exp();
    let body = end.momentum[1] / (factor * start.momentum[1]) - 1.0;
    let spatial = motion.spatial_momentum()[2] / (factor * start.momentum[2]) - 1.0;
    (end.g.apply(&x) - x, end.z, [body, spatial])
}

/// Advances a motion by a number of steps.
type Advance = Box<dyn Fn(&mut GroupMotion<Rotations, 3>, usize)>;

fn gauss(stages: usize) -> impl Fn(&RigidBody<UniformGravity, 3>, f64) -> Advance {
    move |top, h| {
        let method = GroupGauss::new(*top, stages, h).unwrap();
        Box::new(move |motion, steps| motion.advance(&method, steps).unwrap())
    }
}

/// Gauss collocation of order 16 with 400 steps; the numbers have twelve and ten decimals.
#[test]
fn the_heavy_top_by_gauss_collocation() {
    for (gamma, expected) in DISPLACEMENTS {
        let (u, z, momenta) = run_heavy_top(gamma, 400, gauss(8));
        let bound = if gamma == 0.0 { 1e-11 } else { 1e-10 };
        assert!((u - SVector::from(expected)).max_abs_or_nan() < bound, "gamma = {gamma}: {u:?}");
        if gamma == -0.1 {
            assert!((z / 8312.8010121552 - 1.0).abs() < 1e-13, "z = {z}");
        }
        println!("{gamma}: {u:?} {z} {momenta:?}");
        assert!(momenta.iter().all(|m| m.abs() < 1e-14), "gamma = {gamma}: {momenta:?}");
    }
}

/// The momentum about the vertical and that about the axis of the symmetric body scale by `e^(gamma t)` at every step
/// size and every order, although the motion itself is wrong at the largest steps.
#[test]
fn momenta_of_the_heavy_top_decay_at_every_step_size() {
    for gamma in [-0.1, -1.0] {
        for (stages, steps) in [(1, 3200), (1, 400), (2, 800), (2, 200), (3, 200), (6, 200)] {
            let (_, _, momenta) = run_heavy_top(gamma, steps, gauss(stages));
            println!("{gamma} {stages} {steps} {momenta:?}");
            assert!(momenta.iter().all(|m| m.abs() < 1e-14), "gamma = {gamma}, {stages} stages, {steps}: {momenta:?}");
        }
    }
}

/// A top whose kinetic energy depends on g, on z and on time, and is not quadratic in xi: nothing is assumed.
#[derive(Clone, Copy)]
struct General;

impl GroupLagrangian<Rotations, 3> for General {
    fn value<T: Scalar>(&self, t: T, g: &Rotation<T>, xi: &SVector<T, 3>, z: T) -> T {
        let up = g.apply_inverse(&SVector::from([T::zero(), T::zero(), T::one()]));
        let kinetic = (xi[0] * xi[0] + xi[1] * xi[1] * 2.0 + xi[2] * xi[2] * 2.5) * 0.5;
        let along = up.dot(xi);
        kinetic * (up[0] * 0.2 + 1.0) + along * along * along * along * 0.02 - up[1] * 1.3 + up[0] * up[2] * 0.7
            - z * (z * 0.1 + 0.3)
            + t.sin() * up[2] * 0.4
    }
}

/// The Lagrangians of the tests, as one type.
#[derive(Clone, Copy)]
enum Top {
    General,
    Body(RigidBody<UniformGravity, 3>),
}

impl GroupLagrangian<Rotations, 3> for Top {
    fn value<T: Scalar>(&self, t: T, g: &Rotation<T>, xi: &SVector<T, 3>, z: T) -> T {
        match self {
            Top::General => General.value(t, g, xi, z),
            Top::Body(body) => GroupLagrangian::<Rotations, 3>::value(body, t, g, xi, z),
        }
    }
    fn constant_rate(&self) -> Option<f64> {
        match self {
            Top::General => None,
            Top::Body(body) => Some(body.gamma()),
        }
    }
}

fn tilted(gamma: f64) -> RigidBody<UniformGravity, 3> {
    let gravity = UniformGravity { weight: [0.3, -0.5, -1.2], centre: [0.4, 0.8, -0.3] };
    RigidBody::rotating(&Inertia::principal([1.0, 2.0, 2.5]).unwrap(), gravity, gamma).unwrap()
}

fn start() -> GroupState<Rotations, 3> {
    let g = Rotations::exp(&SVector::from([0.4, -1.1, 0.8]));
    GroupState { g, momentum: SVector::from([0.7, -0.6, 0.9]), z: 0.4 }
}

/// The largest component of `Phi* eta - sigma eta` relative to that of `Phi* eta`, and sigma, at a state: the step is
/// evaluated on dual numbers along body coordinates `(eta, dPi, dz)`, `g = g0 exp(eta)`.
fn conformality<G: LieGroup<N>, const N: usize>(
    method: &impl GroupIntegrator<G, N>,
    t: f64,
    from: &GroupState<G, N>,
    h_velocity: &SVector<f64, N>,
) -> (f64, f64) {
    type D<const N: usize> = Dual<f64, ChartVector<N>>;
    let mut eta = SVector::<D<N>, N>::zeros();
    let mut momentum = from.momentum.map(D::<N>::constant);
    for i in 0..N {
        eta[i].d.x[i] = 1.0;
        momentum[i].d.y[i] = 1.0;
    }
    let mut z = D::<N>::constant(from.z);
    z.d.z = 1.0;
    let lift = |g: &G::Element<f64>| G::lift(g, D::<N>::constant);
    let seeded: GroupState<G, N, D<N>> = GroupState { g: G::compose(&lift(&from.g), &G::exp(&eta)), momentum, z };
    let end = seeded.after(&method.step(t, &seeded, &h_velocity.map(D::<N>::constant)).unwrap());
    let plain = G::lift(&end.g, |x: D<N>| x.re);
    let moved = G::log(&G::compose(&G::inverse(&lift(&plain)), &end.g));
    let mut pullback = end.z.d;
    for i in 0..N {
        pullback = pullback.minus(moved[i].d.scale(end.momentum[i].re));
    }
    let sigma = pullback.z;
    let source = ChartVector { x: -from.momentum, y: SVector::zeros(), z: 1.0 };
    (pullback.minus(source.scale(sigma)).max_abs_or_nan() / pullback.max_abs_or_nan(), sigma)
}

/// Contact for every number of stages, a potential that depends on g, and steps as large as 0.4.
#[test]
fn gauss_steps_are_conformally_contact() {
    for (top, exact) in [(Top::Body(tilted(-0.3)), true), (Top::General, false)] {
        for stages in [1, 2, 3, 5] {
            for h in [0.4, 0.1, -0.2] {
                let method = GroupGauss::new(top, stages, h).unwrap();
                let velocity = method.velocity(0.2, &start()).unwrap();
                let (defect, sigma) = conformality(&method, 0.2, &start(), &velocity);
                println!("{exact} {stages} {h} {defect:e} {sigma}");
                assert!(defect < 64.0 * EPS, "{stages} stages, h = {h}: {defect:e}");
                if exact {
                    assert!((sigma - (-0.3 * h).exp()).abs() < 8.0 * EPS);
                }
            }
        }
    }
}

/// The distance of two states.
fn distance(a: &GroupState<Rotations, 3>, b: &GroupState<Rotations, 3>) -> f64 {
    let turn = Rotations::log(&Rotations::compose(&Rotations::inverse(&a.g), &b.g));
    turn.max_abs_or_nan().max_or_nan((a.momentum - b.momentum).max_abs_or_nan()).max_or_nan((a.z - b.z).abs())
}

fn end_of(top: Top, stages: usize, steps: usize) -> GroupState<Rotations, 3> {
    let mut motion = GroupMotion::new(0.2, start()).unwrap();
    motion.advance(&GroupGauss::new(top, stages, 1.5 / steps as f64).unwrap(), steps).unwrap();
    motion.state()
}

/// The order is 2s: measured slopes between steps whose ratio is 3/2, for a Lagrangian that is nonlinear in g, xi and
/// z.
#[test]
fn the_order_of_gauss_collocation_is_twice_the_number_of_stages() {
    for top in [Top::General, Top::Body(tilted(-0.3))] {
        let reference = end_of(top, 8, 12);
        for (stages, counts) in [(1, [48, 72, 108]), (2, [12, 18, 27]), (3, [6, 9, 13])] {
            let errors = counts.map(|n| distance(&end_of(top, stages, n), &reference));
            for i in 0..2 {
                let slope = (errors[i] / errors[i + 1]).ln() / (counts[i + 1] as f64 / counts[i] as f64).ln();
                println!("{stages}: {slope} {errors:?}");
                assert!((slope - 2.0 * stages as f64).abs() < 0.15, "{stages} stages: {slope}, {errors:?}");
            }
        }
    }
}

/// Splittings of order 8 and 10: the spin of 150 rad/s is integrated exactly, so that 60 and 40 steps suffice.
#[test]
fn the_heavy_top_by_splittings() {
    for (gamma, expected) in DISPLACEMENTS {
        for (scheme, steps) in [(SplittingScheme::BLANES_CASAS_8, 100), (SplittingScheme::SOFRONIOU_SPALETTA_10, 60)] {
            let (u, z, momenta) = run_heavy_top(gamma, steps, |top, h| {
                let method = RigidBodySplitting::new(*top, scheme, h).unwrap();
                Box::new(move |motion, steps| motion.advance(&method, steps).unwrap())
            });
            println!("{} {gamma}: {u:?} {z} {momenta:?}", scheme.name());
            let bound = if gamma == 0.0 { 1e-11 } else { 1e-10 };
            assert!(
                (u - SVector::from(expected)).max_abs_or_nan() < bound,
                "{}, gamma = {gamma}: {u:?}",
                scheme.name()
            );
            if gamma == -0.1 {
                assert!((z / 8312.8010121552 - 1.0).abs() < 1e-13, "z = {z}");
            }
            assert!(momenta.iter().all(|m| m.abs() < 1e-14), "{}, gamma = {gamma}: {momenta:?}", scheme.name());
        }
    }
}

/// A symmetric body about an axis that is not an axis of the coordinates, off its centre of mass.
fn symmetric(gamma: f64) -> RigidBody<UniformGravity, 3> {
    let gravity = UniformGravity { weight: [0.3, -0.5, -1.2], centre: [0.4, 0.8, -0.3] };
    RigidBody::rotating(&Inertia::principal([1.4, 2.0, 1.4]).unwrap(), gravity, gamma).unwrap()
}

/// Splittings are conformally contact with `sigma_d = e^(gamma h)`, and have the order of their scheme.
#[test]
fn splittings_are_contact_and_have_their_order() {
    let (strang, fourth) = (SplittingScheme::STRANG, SplittingScheme::SUZUKI_4);
    let nystrom = SplittingScheme::BLANES_MOAN_6;
    for (body, schemes) in [(tilted(-0.3), [strang, fourth]), (symmetric(-0.3), [fourth, nystrom])] {
        let reference = end_of(Top::Body(body), 8, 12);
        for scheme in schemes {
            for h in [0.4, -0.2] {
                let method = RigidBodySplitting::new(body, scheme, h).unwrap();
                let (defect, sigma) = conformality(&method, 0.2, &start(), &SVector::zeros());
                assert!(defect < 64.0 * EPS, "{}, h = {h}: {defect:e}", scheme.name());
                assert!((sigma - (-0.3 * h).exp()).abs() < 8.0 * EPS);
            }
            let order = f64::from(scheme.order());
            let counts = match scheme.order() {
                2 => [60, 90, 135],
                4 => [16, 24, 36],
                _ => [8, 12, 18],
            };
            let errors = counts.map(|n| {
                let method = RigidBodySplitting::new(body, scheme, 1.5 / n as f64).unwrap();
                let mut motion = GroupMotion::new(0.2, start()).unwrap();
                motion.advance(&method, n).unwrap();
                distance(&motion.state(), &reference)
            });
            for i in 0..2 {
                let slope = (errors[i] / errors[i + 1]).ln() / 1.5_f64.ln();
                println!("{} {slope} {errors:?}", scheme.name());
                assert!((slope - order).abs() < 0.15, "{}: {slope}, {errors:?}", scheme.name());
            }
        }
    }
    let refused = RigidBodySplitting::new(tilted(0.0), nystrom, 0.1);
    assert!(matches!(refused, Err(GroupError::NeedsComposition { scheme: "blanes_moan_6" })));
}

/// A body in space whose potential depends on its height and its attitude; nonlinear in z.
struct Falling;

impl GroupLagrangian<RigidMotions, 6> for Falling {
    fn value<T: Scalar>(&self, t: T, g: &RigidMotion<T>, xi: &SVector<T, 6>, z: T) -> T {
        let up = g.attitude.apply_inverse(&SVector::from([T::zero(), T::zero(), T::one()]));
        let turn = xi[0] * xi[0] + xi[1] * xi[1] * 2.0 + xi[2] * xi[2] * 2.5;
        let along = xi[3] * xi[3] + xi[4] * xi[4] + xi[5] * xi[5] * 1.5;
        let height = g.position[2];
        (turn + along) * 0.5 + xi[0] * xi[4] * 0.2
            - height * (up[0] * 0.4 + 1.1)
            - height * height * 0.3
            - z * (z * 0.1 + 0.3)
            + t.sin() * up[1] * 0.2
    }
}

/// Steps on a group are conformally contact, and of order 2s.
fn contact_and_of_order_2s<G: LieGroup<N>, const N: usize>(
    name: &str,
    lagrangian: &impl GroupLagrangian<G, N>,
    start: GroupState<G, N>,
) {
    for stages in [1, 2, 3] {
        for h in [0.3, -0.2] {
            let method = GroupGauss::new(lagrangian, stages, h).unwrap();
            let velocity = method.velocity(0.2, &start).unwrap();
            let (defect, _) = conformality(&method, 0.2, &start, &velocity);
            assert!(defect < 128.0 * EPS, "{name}, {stages} stages, h = {h}: {defect:e}");
        }
    }
    let end = |stages: usize, steps: usize| {
        let mut motion = GroupMotion::new(0.2, start).unwrap();
        motion.advance(&GroupGauss::new(lagrangian, stages, 1.0 / steps as f64).unwrap(), steps).unwrap();
        motion.state()
    };
    let reference = end(8, 10);
    for (stages, counts) in [(1, [32, 48, 72]), (2, [8, 12, 18])] {
        let errors = counts.map(|n| {
            let found = end(stages, n);
            let turn = G::log(&G::compose(&G::inverse(&reference.g), &found.g));
            turn.norm() + (found.momentum - reference.momentum).norm() + (found.z - reference.z).abs()
        });
        for i in 0..2 {
            let slope = (errors[i] / errors[i + 1]).ln() / 1.5f64.ln();
            assert!((slope - 2.0 * stages as f64).abs() < 0.15, "{name}, {stages} stages: {slope}, {errors:?}");
        }
    }
}

#[test]
fn bodies_in_space() {
    let g = RigidMotions::exp(&SVector::from([0.4, -1.1, 0.8, 0.3, 0.2, -0.5]));
    let momentum = SVector::from([0.7, -0.6, 0.9, 0.4, -0.3, 0.5]);
    let start = GroupState::<RigidMotions, 6> { g, momentum, z: 0.4 };
    contact_and_of_order_2s("SE(3)", &Falling, start);

    // Horizontal translations of the body in space are symmetries: their momenta scale with the conformal factor. Each
    // step rounds an impulse whose largest entry is that of the falling body, in the vertical momentum and its moment.
    let steps = 20;
    let mut motion = GroupMotion::new(0.0, start).unwrap();
    let before = *motion.spatial_momentum();
    motion.advance(&GroupGauss::new(&Falling, 2, 0.1).unwrap(), steps).unwrap();
    let (after, factor) = (*motion.spatial_momentum(), motion.log_factor().exp());
    let bound = steps as f64 * 4.0 * EPS * after.max_abs_or_nan();
    for k in [3, 4] {
        let off = (after[k] - before[k] * factor).abs();
        assert!(off <= bound && bound < 1e-3 * before[k].abs(), "momentum {k}: {off:e} of {bound:e}");
    }
    // The vertical one is none.
    assert!((after[5] - before[5] * factor).abs() > 0.1);
}

/// Invalid input is a typed error that names the remedy.
#[test]
fn invalid_input() {
    let top = heavy_top(0.0);
    assert!(matches!(GroupGauss::new(top, 0, 0.1), Err(GroupError::Stages { found: 0 })));
    assert!(matches!(GroupGauss::new(top, 2, f64::NAN), Err(GroupError::Step { .. })));
    let mut motion = GroupMotion::new(0.0, heavy_top_start(&top)).unwrap();
    let before = motion.state();
    // 150 rad/s: a step of 0.1 would turn the top by 15 rad.
    let Err(GroupError::BeyondChart { largest, .. }) = motion.advance(&GroupGauss::new(top, 2, 0.1).unwrap(), 1) else {
        panic!("a step beyond the chart was taken")
    };
    assert!((largest - std::f64::consts::PI / 150.07).abs() < 1e-3, "{largest}");
    assert_eq!(motion.state(), before);
    let stretched = GroupState { g: Rotation { w: 1.1, u: SVector::zeros() }, ..before };
    assert!(matches!(GroupMotion::new(0.0, stretched), Err(GroupError::NonUnitQuaternion { .. })));
    let lost = GroupState { z: f64::NAN, ..before };
    assert!(matches!(GroupMotion::new(0.0, lost), Err(GroupError::NonFinite { .. })));
    assert!(matches!(Inertia::principal([1.0, 1.0, 2.5]), Err(GroupError::TriangleInequality { .. })));
    assert!(matches!(Inertia::principal([1.0, -1.0, 1.0]), Err(GroupError::NotPositive { .. })));
}
