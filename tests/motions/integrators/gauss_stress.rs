//! Difficult steps of contact Gauss collocation: stiff forces, ill-conditioned W, steps that do not resolve the motion;
//! each is accurate, refused, or flagged as unresolved.

use crate::common::gauss::GaussSteppers;
use crate::common::lagrangians::WithStructure;
use crate::lagrangians::{One, Two, one};
use contact_examples::systems::{HarmonicOscillator, Kepler, LaneEmden, OneCoordinate, Pendulum, QuadraticInZ, System};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::dot;
use contact_geom::{GeometryError, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint, legendre};
use discrete_herglotz::{InputError, RunSupport, StepError, Stepper, gauss::Gauss};

/// Four particles in a line, every second bond stiff and all of them nonlinear.
#[derive(Clone, Copy)]
struct StiffChain {
    k: f64,
}

impl Lagrangian<4> for StiffChain {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 4>, v: &SVector<T, 4>, z: T) -> T {
        let bond = |r: T| {
            let square = r * r;
            square * (square * 0.125 + 0.5)
        };
        let stiff = bond(q[1] - q[0]) + bond(q[3] - q[2]);
        dot(v, v) * 0.5 - bond(q[0]) - bond(q[2] - q[1]) - bond(q[3]) - stiff * self.k - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// A stiff chain by its two routes: solved by accelerated fixed-point iterations and not by Newton's method for all
/// equations, as 20 iterations a step show, and equal up to the round-off of the stiff forces, `k eps` times the number
/// of steps.
#[test]
fn stiff_chains_are_solved_by_fixed_point_iterations() {
    let start = PhasePoint::new([0.3, 0.3001, -0.2, -0.2001], [0.1, 0.1, -0.2, -0.2], 0.0);
    for (s, h) in [(2, 0.3), (8, 0.5), (16, 1.0)] {
        for k in [1e3, 1e5] {
            let chain = StiffChain { k };
            let ends = [chain.structure(), Structure::default()].map(|claims| {
                let gauss = Gauss::new(WithStructure(chain, claims), s, h).unwrap();
                let mut stepper = gauss.stepper(0.0, start, start.p).unwrap();
                stepper.advance(50).unwrap();
                let iterations = stepper.evaluations() as f64 / (50 * s) as f64;
                assert!(stepper.newton_steps() > 40, "s = {s}, k = {k}");
                assert!((3.0..20.0).contains(&iterations), "s = {s}, k = {k}: {iterations} iterations");
                stepper.state()
            });
            let off = (&ends[0].q - &ends[1].q).amax();
            assert!(off <= 50.0 * k * f64::EPSILON, "s = {s}, k = {k}: {off:e}");
        }
    }
}

/// Two particles, where one direction is heavy and has a force, and the other is lighter by a factor of up to 1e14 and
/// free.
#[derive(Clone, Copy, Debug)]
pub struct IllConditioned(f64);

impl IllConditioned {
    fn w(&self) -> SMatrix<f64, 2, 2> {
        SMatrix::from([[1.0 + self.0, 1.0 - self.0], [1.0 - self.0, 1.0 + self.0]])
    }
}

impl Lagrangian<2> for IllConditioned {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let w = self.w();
        let kinetic = v[0] * v[0] * w[(0, 0)] + v[0] * v[1] * (2.0 * w[(0, 1)]) + v[1] * v[1] * w[(1, 1)];
        let sum = q[0] + q[1];
        kinetic * 0.5 - sum * sum * 0.5 - z * 0.1
    }
}

/// W with a condition from 1e2 to 1e14: the momentum is accurate to round-off, the velocity to what the condition
/// allows. The heavy direction is a damped oscillator, `4 Q'' = -4 Q + ..` for the half sum Q.
#[test]
fn ill_conditioned_w_is_accepted() {
    for exponent in [2, 4, 6, 8, 10, 12, 14] {
        let condition = 10f64.powi(exponent);
        let system = IllConditioned(1.0 / condition);
        let p = system.w() * SVector::from([0.5, 0.25]);
        let start = PhasePoint { q: SVector::from([1.0, 0.5]), p, z: 0.0 };
        let gauss = Gauss::new(Two::from(system), 4, 0.1).unwrap();
        let mut stepper = gauss.stepper(0.0, start, [0.0; 2].into()).unwrap();
        stepper.advance(10).unwrap();
        // 2 Q'' + 0.2 Q' = -2 Q with Q = q0 + q1: w^2 = 1 - 0.05^2.
        let (t, a) = (1.0f64, 0.05f64);
        let w = (1.0 - a * a).sqrt();
        let (q0, v0) = (1.5, 0.75);
        let q = (-a * t).exp() * (q0 * (w * t).cos() + (v0 + a * q0) / w * (w * t).sin());
        let off = (stepper.state().q.iter().sum::<f64>() - q).abs();
        // The error of order 8, and the cancellation of the velocities in their sum: each has an error of the condition
        // times round-off.
        let bound = 1e-9 + 100.0 * condition * f64::EPSILON;
        assert!(off <= bound, "condition 1e{exponent}: {off:e}");
    }
    // Singular to round-off, and exactly singular.
    for light in [1e-17, 0.0] {
        let gauss = Gauss::new(Two::from(IllConditioned(light)), 4, 0.1).unwrap();
        let refused = gauss.stepper(0.0, PhasePoint::new([1.0, 0.5], [1.0, 1.0], 0.0), [0.0; 2].into()).err();
        assert!(matches!(refused, Some(InputError::FirstStep(StepError::Singular { .. }))), "{refused:?}");
    }
}

/// Two oscillators with masses of 1 and 1e-14.
#[derive(Clone, Copy, Debug)]
pub struct Masses;

impl Lagrangian<2> for Masses {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        (v[0] * v[0] - q[0] * q[0]) * 0.5 + (v[1] * v[1] - q[1] * q[1]) * 0.5e-14
    }
}

/// Masses of 1 and 1e-14 side by side do not make W ill-conditioned.
#[test]
fn light_particles_are_no_singularity() {
    let gauss = Gauss::new(Two::from(Masses), 8, 0.5).unwrap();
    let mut stepper = gauss.stepper(0.0, PhasePoint::new([1.0, 1.0], [0.0, 0.0], 0.0), [0.0; 2].into()).unwrap();
    stepper.advance(20).unwrap();
    let q = stepper.state().q;
    assert!((q[0] - 10f64.cos()).abs() < 1e-13 && (q[1] - 10f64.cos()).abs() < 1e-13, "{q:?}");
}

#[test]
fn times_that_are_not_finite_are_refused() {
    let kepler = Kepler::<2>::default();
    let x = kepler.initial();
    let start = legendre(&kepler, 0.0, &x);
    let gauss = Gauss::new(kepler, 4, 0.1).unwrap();
    for t0 in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let refused = [gauss.stepper(t0, start, x.v).err(), gauss.transformed_stepper(t0, start, x.v).err()];
        for error in refused {
            assert!(
                matches!(error, Some(InputError::Geometry(GeometryError::NonFinite { what: "t0", .. }))),
                "{error:?}"
            );
        }
    }
}

/// Damping that the step does not resolve is refused by the route of a constant rate and by the general one for the
/// same reason.
#[test]
fn strong_damping_is_refused_by_all_routes() {
    for (s, gamma) in [(1, -30.0), (2, -1000.0), (3, -1000.0)] {
        let system = OneCoordinate::from(HarmonicOscillator { gamma });
        let x = VelocityPoint::new([1.0], [0.0], 0.0);
        let start = legendre(&system, 0.0, &x);
        let claimed = Gauss::new(one(system), s, 0.1).unwrap();
        let refused = claimed.stepper(0.0, start, x.v).err().unwrap();
        assert!(refused.to_string().contains("integrating factor of a stage"), "{refused}");
        let gauss = Gauss::new(One::from(WithStructure(system, Structure::default())), s, 0.1).unwrap();
        let mut general = gauss.stepper(0.0, start, x.v).unwrap();
        let halt = general.advance(1).unwrap_err();
        assert!(matches!(halt.cause, StepError::StageFactor { rho } if rho < 0.0), "s = {s}: {halt:?}");
    }
    // A drag that is singular at t = 0.
    let star = LaneEmden::default();
    let system = OneCoordinate::from(star);
    let x = VelocityPoint::new([1.0], [0.0], 0.0);
    for s in 1..=16 {
        let gauss = Gauss::new(one(system), s, 0.3).unwrap();
        let mut stepper = gauss.stepper(0.01, legendre(&system, 0.01, &x), x.v).unwrap();
        let outcome = stepper.advance(1);
        let error = (stepper.state().q[0] - star.solution(0.31).unwrap().q[0]).abs();
        assert!(outcome.is_err() || stepper.unresolved().is_some() || error < 1e-3, "s = {s}: {error:e}");
    }
}

/// Unresolved steps are flagged, and resolved ones are not.
#[test]
fn unresolved_steps_are_flagged() {
    let flagged = |h: f64, s: usize| {
        let system = Kepler::<2>::default();
        // A fall from rest that misses the centre by a hundredth.
        let x = VelocityPoint::new([1.0, 0.0], [0.0, 0.1], 0.0);
        let gauss = Gauss::new(system, s, h).unwrap();
        let mut stepper = gauss.stepper(0.0, legendre(&system, 0.0, &x), x.v).unwrap();
        let outcome = stepper.advance((2.0 / h) as usize);
        (outcome.is_err(), stepper.unresolved())
    };
    for s in [4, 8, 16] {
        let (refused, unresolved) = flagged(0.25, s);
        assert!(refused || unresolved.is_some(), "s = {s}");
        let (refused, unresolved) = flagged(1e-4, s);
        assert!(!refused && unresolved.is_none(), "s = {s}: {unresolved:?}");
    }
    let unflagged = |mut stepper: Box<dyn RunSupport + '_>, steps: usize| {
        stepper.advance(steps).unwrap();
        assert_eq!(stepper.unresolved(), None);
    };
    for s in 1..=16 {
        for h in [0.1, 0.5] {
            let x = VelocityPoint::new([1.0], [1.0], 0.0);
            let pendulum = Gauss::new(one(Pendulum::default()), s, h).unwrap();
            unflagged(Box::new(pendulum.stepper(0.0, PhasePoint::new([1.0], [1.0], 0.0), x.v).unwrap()), 1000);
            let square = Gauss::new(one(QuadraticInZ { c: 0.1 }), s, h).unwrap();
            unflagged(Box::new(square.stepper(0.0, PhasePoint::new([1.0], [0.0], 1.0), [0.0].into()).unwrap()), 1000);
        }
    }
}
