//! Splittings with forces: kicks, drags of the velocity, orders, and what is refused.

use crate::common::forces::{AnyForce, Drag, Fall, G, Swirl};
use crate::common::{relative_distance, slope};
use crate::forces::Applied;
use crate::lagrangians::{One, Two, kepler, one};
use contact_examples::systems::{Kepler, Pendulum, QuadraticInZ};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{Force, ForceStructure, Forced, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};
use discrete_herglotz::{Ensemble, GaussCollocation, InputError, Integrator, Problem, SplittingScheme, Steps, Until};

/// The state after a time by an integrator.
fn run<L: Lagrangian<N>, I: for<'a> Integrator<'a, L, N> + 'static, const N: usize>(
    lagrangian: &L,
    x: VelocityPoint<N>,
    by: I,
    span: f64,
    steps: usize,
) -> PhasePoint<N> {
    let problem = Problem::new(lagrangian, 0.0, x).unwrap();
    let outcome = problem.by(by).steps(Steps::Count(steps)).run(Until::Time(span)).unwrap();
    outcome.state().fixed()
}

/// A force of positions with a drag of the velocity.
#[derive(Clone, Copy, Debug)]
pub struct SwirlAndDrag(pub Drag);

impl<const N: usize> Force<N> for SwirlAndDrag {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let (swirl, drag) = (Swirl.value(t, x), self.0.value(t, x));
        SVector::from_fn(|i, _| swirl[i] + drag[i])
    }
    fn structure(&self) -> ForceStructure<N> {
        self.0.structure()
    }
}

/// The order of a scheme on a problem, in q, p and z together. The motion is twice as long with a scheme of order 10,
/// whose error would be that of rounding before its slope is asymptotic.
fn assert_order<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    x: VelocityPoint<N>,
    scheme: SplittingScheme,
    counts: &[usize],
) {
    let span = if scheme.order() == 10 { 4.0 } else { 2.0 };
    let truth = run(lagrangian, x, GaussCollocation { stages: 12 }, span, 64);
    let error = |n: usize| relative_distance(run(lagrangian, x, scheme, span, n), truth);
    let points: Vec<_> = counts.iter().map(|n| (span / *n as f64, error(*n))).collect();
    let (observed, order) = (slope(&points), f64::from(scheme.order()));
    assert!((observed - order).abs() < 0.15, "{}: {observed:.3} {points:?}", scheme.name());
}

/// Schemes keep their orders with kicks by a force of time and positions, with linear and with quadratic drag, and with
/// all of them; those of Runge-Kutta-Nyström type with linear drag. The speed of the orbit does not vanish; that of the
/// pendulum does, where a quadratic drag has no second derivative, so that no method has a higher order.
#[test]
fn schemes_keep_their_orders() {
    let pendulum = || one(Pendulum { gamma: -0.2 });
    let x = VelocityPoint::new([1.0], [1.5], 0.1);
    let kepler = kepler(Kepler { gamma: -0.1, mu: 1.0 });
    let orbit = VelocityPoint::new([1.0, 0.2], [-0.1, 0.9], 0.1);
    for (scheme, counts) in [
        (SplittingScheme::STRANG, &[32, 48, 64, 96][..]),
        (SplittingScheme::YOSHIDA_6, &[32, 40, 48, 64]),
        (SplittingScheme::KAHAN_LI_8, &[12, 16, 20]),
        (SplittingScheme::SOFRONIOU_SPALETTA_10, &[14, 16, 18]),
        (SplittingScheme::BLANES_MOAN_4, &[24, 32, 48, 64]),
        (SplittingScheme::BLANES_MOAN_6, &[12, 16, 20, 24]),
        (SplittingScheme::BLANES_CASAS_8, &[8, 12, 16]),
    ] {
        for (c, k) in [(0.0, 0.0), (0.4, 0.0), (0.0, 0.3), (0.4, 0.3)] {
            if k != 0.0 && scheme.is_nystrom() {
                continue;
            }
            // With a linear drag the orbit falls towards the centre in the longer time, where no steps are short enough for
            // a slope above round-off.
            if c != 0.0 && scheme.order() == 10 {
                continue;
            }
            let force = Applied::from(SwirlAndDrag(Drag { c, k }));
            assert_order(&Forced { lagrangian: kepler, force }, orbit, scheme, counts);
            if k == 0.0 && scheme.order() < 10 {
                assert_order(&Forced { lagrangian: pendulum(), force }, x, scheme, counts);
            }
        }
    }
    let nonlinear = Forced { lagrangian: one(QuadraticInZ { c: 1.0 }), force: Applied::from(Swirl) };
    assert_order(&nonlinear, VelocityPoint::new([0.5], [0.8], 0.1), SplittingScheme::STRANG, &[128, 180, 256, 360]);
}

/// A body of mass 2 without a field.
#[derive(Clone, Copy, Debug)]
pub struct Free;

impl Lagrangian<2> for Free {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        dot(v, v)
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, separable: true, quadratic: true, ..Structure::default() }
    }
}

/// A fall with drag, linear, quadratic and both, has a closed form; its error is that of the splitting. Without gravity
/// the splitting is exact: the distance is `(1/k) ln(1 + k v t)`.
#[test]
fn drag_without_a_field_is_exact() {
    // The mass is 2.
    let (k, t) = (0.6, 3.0);
    let x = VelocityPoint::new([0.0, 0.0], [1.2, -1.6], 0.0);
    let free = |drag| Forced { lagrangian: Two::from(Free), force: Applied::Drag(drag) };
    let forced = free(Drag { c: 0.0, k });
    let end = run(&forced, x, SplittingScheme::STRANG, t, 10);
    let (path, speed) = ((1.0 + 0.5 * k * 2.0 * t).ln() * 2.0 / k, 2.0 / (1.0 + 0.5 * k * 2.0 * t));
    let expected = [x.v * (path / 2.0), x.v * speed];
    assert!((end.q - expected[0]).norm() <= 8.0 * f64::EPSILON * path, "{:?} {:?}", end.q, expected[0]);
    assert!((end.p - expected[1]).norm() <= 8.0 * f64::EPSILON * speed, "{:?} {:?}", end.p, expected[1]);
    let linear = free(Drag { c: k, k: 0.0 });
    let end = run(&linear, x, SplittingScheme::BLANES_MOAN_6, t, 10);
    let expected = x.v * (2.0 * (-0.5 * k * t).exp());
    assert!((end.p - expected).norm() <= 8.0 * f64::EPSILON * expected.norm(), "{:?} {expected:?}", end.p);
    // With a field the terminal speed is kept.
    let falling = Forced { lagrangian: One::from(Fall), force: Applied::Drag(Drag { c: 0.0, k: 0.2 }) };
    let end = run(&falling, VelocityPoint::new([0.0], [0.0], 0.0), SplittingScheme::KAHAN_LI_8, 10.0, 400);
    assert!((end.p[0] + (G / 0.2).sqrt()).abs() <= 1e-6, "{}", end.p[0]);
}

/// Members of an ensemble end where single runs end: with a force of positions in lanes, with drag by a stepper each.
#[test]
fn ensembles_take_forces() {
    fn of<L: Lagrangian<1> + Sync, I>(lagrangian: &L, by: I, bound: f64)
    where
        I: Copy + for<'a> Integrator<'a, L, 1> + Sync + 'static,
    {
        let start = |i: usize| VelocityPoint::new([0.3 + 0.1 * i as f64], [1.0 - 0.05 * i as f64], 0.1);
        let mut seen = 0;
        let ensemble = Ensemble::new(lagrangian, 0.0, 19, start).by(by).steps(Steps::Count(200));
        ensemble
            .run(Until::Time(10.0), |member| {
                let end = member.ending.as_ref().unwrap().state.clone();
                let single = run(lagrangian, start(member.index), by, 10.0, 200);
                let off = (end.q - single.q).norm() + (end.p - single.p).norm();
                assert!(off <= bound, "{}: {off:e}", member.index);
                seen += 1;
            })
            .unwrap();
        assert_eq!(seen, 19);
    }
    let pendulum = |force| Forced { lagrangian: one(Pendulum { gamma: -0.1 }), force };
    let dragged = Applied::from(SwirlAndDrag(Drag { c: 0.2, k: 0.1 }));
    // Lanes add in another order: a hundred units of round-off in 200 steps.
    let bound = 100.0 * f64::EPSILON;
    of(&pendulum(Applied::from(Swirl)), SplittingScheme::BLANES_MOAN_6, bound);
    of(&pendulum(Applied::from(Swirl)), GaussCollocation { stages: 6 }, bound);
    of(&pendulum(dragged), SplittingScheme::YOSHIDA_4, 0.0);
    of(&pendulum(dragged), GaussCollocation { stages: 4 }, 0.0);
}

/// A Lagrangian `v.Mv/2` with a mass matrix.
#[derive(Clone, Copy, Debug)]
pub struct Massive([[f64; 2]; 2]);

impl Lagrangian<2> for Massive {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        let m = self.0;
        (v[0] * v[0] * m[0][0] + v[0] * v[1] * (2.0 * m[0][1]) + v[1] * v[1] * m[1][1]) * 0.5 - q[0] * q[0] * 0.5
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, separable: true, quadratic: true, ..Structure::default() }
    }
}

/// A force of another form than it declares.
#[derive(Clone, Copy, Debug)]
pub struct FalseForce;

impl<const N: usize> Force<N> for FalseForce {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        AnyForce.value(t, x)
    }
    fn structure(&self) -> ForceStructure<N> {
        ForceStructure::of_positions()
    }
}

/// Other forces and masses are refused with an error that names the integrator that takes them; a false structure is an
/// error when the problem is made.
#[test]
fn other_forces_are_refused() {
    let (x, start) = (VelocityPoint::new([1.0, 0.5], [0.4, 0.2], 0.0), VelocityPoint::new([1.0], [0.5], 0.1));
    fn refused<L: Lagrangian<N>, const N: usize>(lagrangian: &L, x: VelocityPoint<N>, scheme: SplittingScheme) {
        let problem = Problem::new(lagrangian, 0.0, x).unwrap();
        let found = problem.by(scheme).steps(Steps::Count(4)).run(Until::Time(1.0)).err();
        let named = found.as_ref().is_some_and(|e| e.to_string().contains("GaussCollocation"));
        assert!(matches!(found, Some(InputError::Forced { .. })) && named, "{found:?}");
    }
    let (strang, nystrom) = (SplittingScheme::STRANG, SplittingScheme::BLANES_MOAN_6);
    let (linear, quadratic) = (Applied::Drag(Drag { c: 0.1, k: 0.0 }), Applied::Drag(Drag { c: 0.1, k: 0.2 }));
    let fall = |force| Forced { lagrangian: Two::from(Fall), force };
    let massive = |masses, force| Forced { lagrangian: Two::from(Massive(masses)), force };
    refused(&fall(Applied::from(AnyForce)), x, strang);
    refused(&fall(quadratic), x, nystrom);
    refused(&massive([[1.0, 0.2], [0.2, 1.0]], linear), x, strang);
    refused(&massive([[1.0, 0.0], [0.0, 2.0]], quadratic), x, strang);
    refused(&Forced { lagrangian: one(QuadraticInZ { c: 1.0 }), force: quadratic }, start, strang);
    let found = Problem::new(&fall(Applied::from(FalseForce)), 0.0, x).err();
    assert!(matches!(found, Some(InputError::FalseClaim { claim: "force_structure", .. })), "{found:?}");
}
