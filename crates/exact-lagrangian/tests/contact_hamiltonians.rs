//! Exact motions of contact Hamiltonians: the flow, the generating functions of types II and III, and the equation of
//! Hamilton and Jacobi.

// In a test a missing value is a failure, and a maximum that loses a NaN is none.
#![allow(clippy::unwrap_used)]
#![deny(clippy::disallowed_methods)]

use contact_examples::systems::{HarmonicOscillator, Pendulum};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::MaxAbsOrNan;
use contact_geom::{ChartVector, ContactHamiltonian, DiscretePoint, PhasePoint, Scalar, VelocityPoint, support::seed};
use exact_lagrangian::{
    ContactFlowError, ExactError, ExactLagrangian, ExactLeftHamiltonian, ExactRightHamiltonian, FromFunction,
    FromPoint, HamiltonJacobi, InitialAction, contact_flow, herglotz_flow,
};
use std::f64::consts::{FRAC_PI_2, PI};

/// Contact Hamiltonians with one coordinate.
#[derive(Clone, Copy, Debug)]
enum One {
    /// `p^2/2 + q^2/2 - gamma z`.
    Oscillator(f64),
    /// `p^2/2 + 1 - cos q - gamma z`.
    Pendulum(f64),
    /// Nonlinear in q, p and z, and dependent on time.
    Nonlinear,
    /// Linear in p.
    Linear,
    /// `p q^2`, whose motion from q = 1 ends at t = 1.
    BlowUp,
}

impl ContactHamiltonian<1> for One {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        let (x, y) = (q[0], p[0]);
        match self {
            One::Oscillator(gamma) => (y * y + x * x) * 0.5 - z * *gamma,
            One::Pendulum(gamma) => y * y * 0.5 + x.versine() - z * *gamma,
            One::Nonlinear => {
                y * y * 0.5 + y.powi(4) * 0.05 + x.sin() * (z * 0.3 + t.cos()) + z * z * 0.1 + y * z * 0.2
            }
            One::Linear => y * (x.cos() + z * 0.2) + (x * x * 0.5 + z * 0.1) * z,
            One::BlowUp => y * x * x,
        }
    }
}

/// The largest difference of the components.
fn distance(a: impl Into<ChartVector<1>>, b: impl Into<ChartVector<1>>) -> f64 {
    a.into().minus(b.into()).amax()
}

/// The motions of a Lagrangian are those of its contact Hamiltonian: two programs that share only the coefficients of
/// the collocation.
#[test]
fn the_flow_is_that_of_the_lagrangian() {
    let (gamma, x) = (-0.3, VelocityPoint::new([1.0], [0.7], 0.2));
    for h in [1e-3, 1.0, 10.0, -2.0] {
        let herglotz = herglotz_flow(&Pendulum { gamma }, 0.0, &x, h).unwrap();
        let motion = contact_flow(&One::Pendulum(gamma), 0.0, &PhasePoint::new([1.0], [0.7], 0.2), h).unwrap();
        // Momenta are velocities. The motion is of size one, and its condition number below 10.
        let end = PhasePoint { q: herglotz.end.q, p: herglotz.end.v, z: herglotz.end.z };
        assert!(distance(motion.end, end) < 2e-14, "{h}: {motion:?} {herglotz:?}");
        assert!((motion.ln_sigma - gamma * h).abs() < 4.0 * f64::EPSILON * h.abs());
        assert!((motion.displacement.z - herglotz.action).abs() < 2e-14 * herglotz.action.abs());
    }
}

#[test]
fn the_way_back_is_the_inverse() {
    let x = PhasePoint::new([0.4], [0.6], 0.3);
    for one in [One::Nonlinear, One::Linear] {
        let there = contact_flow(&one, 0.3, &x, 1.5).unwrap();
        let back = contact_flow(&one, 1.8, &there.end, -1.5).unwrap();
        assert!(distance(back.end, x) < 1e-14 && (back.ln_sigma + there.ln_sigma).abs() < 1e-14, "{one:?}: {back:?}");
    }
}

/// The derivatives of both generating functions by dual numbers through flow and shooting are those by the motion, and
/// the steps that they determine end where they must.
#[test]
fn generating_functions_generate_the_flow() {
    for one in [One::Nonlinear, One::Linear, One::Oscillator(-0.2)] {
        for h in [0.01, 0.7] {
            let x0 = PhasePoint::new([0.4], [0.6], 0.3);
            let motion = contact_flow(&one, 0.3, &x0, h).unwrap();
            let (x1, sigma) = (motion.end, motion.sigma());
            let right = ExactRightHamiltonian::new(one, h);
            let at = PhasePoint { q: x0.q, p: x1.p, z: x0.z };
            let (value, gradient) = right.with_gradient(0.3, &at).unwrap();
            let expected = ChartVector { x: x0.p * sigma, y: x1.q, z: 1.0 - sigma };
            assert!(distance(gradient, expected) < 1e-14, "{one:?}, {h}: {gradient:?} {expected:?}");
            let by_duals = right.value(0.3, &seed(&at.into()).into()).unwrap();
            assert!(distance(by_duals.d, expected) < 1e-13, "{one:?}, {h}: {by_duals:?} {expected:?}");
            assert!((value - (x1.p.dot(&x1.q) - (x1.z - x0.z))).abs() < 1e-14 && (by_duals.re - value).abs() < 1e-15);

            let left = ExactLeftHamiltonian::new(one, h);
            let at = PhasePoint { q: x1.q, p: x0.p, z: x1.z };
            let (value, gradient) = left.with_gradient(0.3, &at).unwrap();
            let expected = ChartVector { x: x1.p * (-1.0 / sigma), y: -x0.q, z: 1.0 / sigma - 1.0 };
            assert!(distance(gradient, expected) < 1e-14, "{one:?}, {h}: {gradient:?} {expected:?}");
            let by_duals = left.value(0.3, &seed(&at.into()).into()).unwrap();
            assert!(distance(by_duals.d, expected) < 1e-13, "{one:?}, {h}: {by_duals:?} {expected:?}");
            assert!((value - (-x0.p.dot(&x0.q) - (x1.z - x0.z))).abs() < 1e-14);
        }
    }
}

/// At conjugate points of the oscillator, h = pi without drag, there is no exact discrete Lagrangian, but H+; a quarter
/// of a period later it is the other way round.
#[test]
fn they_exist_at_conjugate_points() {
    let at = PhasePoint::new([0.8], [0.5], 0.2);
    for gamma in [0.0, -0.4] {
        let frequency = (1.0 - 0.25 * gamma * gamma).sqrt();
        let h = PI / frequency;
        let lagrangian = ExactLagrangian::<_, 1>::new(HarmonicOscillator { gamma }, h).unwrap();
        let none = lagrangian.retract(0.0, &DiscretePoint::new([0.8], [0.5], 0.2));
        assert!(matches!(none, Err(ExactError::ConjugatePoint { .. } | ExactError::NotConverged { .. })), "{none:?}");
        let (value, gradient) = ExactRightHamiltonian::new(One::Oscillator(gamma), h).with_gradient(0.0, &at).unwrap();
        // The flow multiplies (q, p) by -sqrt(sigma), so that H+ = -sqrt(sigma) p1 q0 + (1 - sigma) z0.
        let sigma = (gamma * h).exp();
        let closed = -sigma.sqrt() * at.p.dot(&at.q) + (1.0 - sigma) * at.z;
        assert!((value - closed).abs() < 1e-14, "{gamma}: {value} {closed}");
        let expected = ChartVector { x: at.p * -sigma.sqrt(), y: at.q * -sigma.sqrt(), z: 1.0 - sigma };
        assert!(distance(gradient, expected) < 1e-14, "{gamma}: {gradient:?} {expected:?}");
    }
    let quarter = ExactRightHamiltonian::new(One::Oscillator(0.0), FRAC_PI_2).step(0.0, &at);
    assert!(matches!(quarter, Err(ContactFlowError::Conjugate { .. })), "{quarter:?}");
}

/// A nonlinear initial value of S.
struct Wave;

impl InitialAction<1> for Wave {
    fn value<T: Scalar>(&self, q: &SVector<T, 1>) -> T {
        q[0].sin() * 0.5 + q[0] * q[0] * 0.2
    }
}

/// `S_t + H(t, q, S_q, S) = 0`, with derivatives of S by dual numbers through flow and shooting, from a point and from
/// a function; and S_q is the momentum.
#[test]
fn the_action_solves_the_equation_of_hamilton_and_jacobi() {
    for t in [0.3, 0.9, 1.4] {
        let datum = FromPoint { q: [0.4].into(), z: 0.3 };
        let equation = HamiltonJacobi { hamiltonian: One::Nonlinear, datum, t0: 0.1 };
        for q in [0.5, 0.9] {
            let residual = equation.residual(t, &[q].into(), &[1.0].into()).unwrap();
            // The derivative of the action is divided by the time.
            assert!(residual.abs() < 1e-13, "from a point, {t}, {q}: {residual:e}");
        }
        for one in [One::Nonlinear, One::Linear] {
            let equation = HamiltonJacobi { hamiltonian: one, datum: FromFunction(Wave), t0: 0.1 };
            let residual = equation.residual(t, &[0.7].into(), &[0.5].into()).unwrap();
            assert!(residual.abs() < 1e-13, "from a function, {one:?}, {t}: {residual:e}");
            // The solution at a time is the datum for later ones: along the motion from it they agree.
            let now: exact_lagrangian::PrincipalFunction<1> =
                equation.solution(t, &[0.7].into(), &[0.5].into()).unwrap();
            let x = PhasePoint { q: [0.7].into(), p: now.momentum, z: now.action };
            let later = contact_flow(&one, t, &x, 0.2).unwrap().end;
            let solved = equation.solution(t + 0.2, &later.q, &now.parameters).unwrap();
            assert!((solved.action - later.z).abs() < 1e-13 && (solved.momentum - later.p).max_abs_or_nan() < 1e-13);
        }
    }
}

#[test]
fn errors_name_what_is_wrong() {
    let x = PhasePoint::new([1.0], [0.5], 0.2);
    let flow = |one: One, x: &PhasePoint<1>, h: f64| contact_flow(&one, 0.0, x, h).unwrap_err();
    let nan = PhasePoint { z: f64::NAN, ..x };
    assert_eq!(flow(One::Linear, &nan, 1.0), ContactFlowError::NonFinite { what: "start" });
    assert_eq!(flow(One::Linear, &x, f64::INFINITY), ContactFlowError::NonFinite { what: "duration" });
    let huge = PhasePoint::new([1e200], [1.0], 0.0);
    assert_eq!(flow(One::BlowUp, &huge, 1.0), ContactFlowError::Undefined { t: 0.0 });
    let ContactFlowError::OutsideDomain { t, reached } = flow(One::BlowUp, &x, 2.0) else { panic!("not refused") };
    assert!((t - 1.0).abs() < 1e-6 && reached.q[0] > 1e6, "{t}: {reached:?}");
    let guess = ExactRightHamiltonian::new(One::Linear, 1.0).step_near(0.0, &x, &[f64::NAN].into()).unwrap_err();
    assert_eq!(guess, ContactFlowError::NonFinite { what: "guess" });
}
