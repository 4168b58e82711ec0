//! Statements 38 and 39 (section 5): the midpoint rule's equations for any potential, and the oscillator's explicit q2; h
//! small enough that sigma_d does not vanish.

use crate::common::{on_random, over_discretisations, pairs, step_from, within};
use contact_geom::systems::{Duffing, HarmonicOscillator, Pendulum, System};
use contact_geom::{DiscretePoint, MaxOrNan, PhasePoint, Statement, VelocityPoint};
use discrete_herglotz::{DiscreteLagrangian, Flow, InputError, LeftMidpoint, discrete_flow};
use exact_lagrangian::QuadraticExact;

/// `q2 = -((h^3 g + 4 h g + h^2 + 4) q0 + (h^3 g - 4 h g + 2 h^2 - 8) q1) / (h^2 + 4)`, and z1.
#[test]
fn oscillator() {
    on_random("harmonic oscillator", 5, |u| {
        let (q0, q1, z0) = (4.0 * u[0] - 2.0, 4.0 * u[1] - 2.0, u[2] - 0.5);
        let (g, h) = (-1.0 + 1.5 * u[3], 0.05 + 0.5 * u[4]);
        let ld = LeftMidpoint::new(HarmonicOscillator { gamma: g }, h).map_err(|e| e.to_string())?;
        let next = discrete_flow(&ld, 0.0, &DiscretePoint::new([q0], [q1], z0)).map_err(|e| e.to_string())?;
        let h3 = h.powi(3);
        let q2 = -((h3 * g + 4.0 * h * g + h * h + 4.0) * q0 + (h3 * g - 4.0 * h * g + 2.0 * h * h - 8.0) * q1)
            / (h * h + 4.0);
        let z1 = (q1 - q0).powi(2) / (2.0 * h) - h / 8.0 * (q1 + q0).powi(2) + (h * g + 1.0) * z0;
        let residual = (next.q1[0] - q2).abs().max_or_nan((next.z0 - z1).abs()) / (1.0 + q2.abs() + z1.abs());
        within(residual)
    });
}

/// The exact discrete Lagrangian of the oscillator steps along the true motion, under-, critically and overdamped, and its
/// `sigma_d` is `e^(gamma h)`; at a conjugate point there is none.
#[test]
fn exact_dynamics() {
    on_random("exact oscillator", 4, |u| {
        let x = DiscretePoint::new([4.0 * u[0] - 2.0], [4.0 * u[1] - 2.0], u[2] - 0.5);
        for gamma in [-0.05, -2.0, -2.5, 0.3] {
            let (system, h) = (HarmonicOscillator { gamma }, 0.1 + u[3]);
            let ld = QuadraticExact::new(&HarmonicOscillator { gamma }, h).map_err(|e| e.to_string())?;
            let v0 = system.velocity_through(x.q0[0], x.q1[0], h).ok_or("conjugate")?;
            let at = |t| system.solution(t, &VelocityPoint::new(x.q0, [v0], x.z0));
            let next = discrete_flow(&ld, 0.0, &x).map_err(|e| e.to_string())?;
            let sigma = ld.jet(0.0, &x).map_err(|e| e.to_string())?.sigma();
            let size = 1.0 + v0.abs() + at(2.0 * h).q[0].abs() + at(h).z.abs();
            let flow = (next.q1[0] - at(2.0 * h).q[0]).abs().max_or_nan((next.z0 - at(h).z).abs()) / size;
            let residual = flow.max_or_nan((sigma - (gamma * h).exp()).abs());
            within(residual).map_err(|e| format!("gamma {gamma}: {e}"))?;
        }
        Ok(())
    });
    assert!(QuadraticExact::new(&HarmonicOscillator { gamma: 0.0 }, std::f64::consts::PI).is_err());
}

/// `(q1 - q0)/h - h/2 V'((q0 + q1)/2) = ((q2 - q1)/h + h/2 V'((q1 + q2)/2)) / (1 + h gamma)` for a potential given by V'.
fn any_potential<S: System<1>>(system: &S, gamma: f64, slope: impl Fn(f64) -> f64) {
    on_random(system.name(), 5, |u| {
        let (t, v) = system.sample(&u[1..]);
        let h = step_from(u[0]);
        let (q0, q1) = (v.q[0], v.q[0] + h * v.v[0]);
        let ld = LeftMidpoint::new(system, h).map_err(|e| e.to_string())?;
        let next = discrete_flow(&ld, t, &DiscretePoint::new([q0], [q1], v.z)).map_err(|e| e.to_string())?;
        let q2 = next.q1[0];
        let left = (q1 - q0) / h - h / 2.0 * slope((q0 + q1) / 2.0);
        let right = ((q2 - q1) / h + h / 2.0 * slope((q1 + q2) / 2.0)) / (1.0 + h * gamma);
        // A rounded position changes either side by its rounding over h.
        let size = left.abs().max_or_nan(q2.abs() / h);
        let residual = (left - right).abs() / size;
        within(residual)
    });
}

/// Statement 39 for a pendulum and for Duffing's oscillator.
#[test]
fn midpoint_equations() {
    let pendulum = Pendulum::default();
    any_potential(&pendulum, pendulum.gamma, f64::sin);
    let duffing = Duffing::default();
    any_potential(&duffing, duffing.gamma, |q| duffing.alpha * q + duffing.beta * q.powi(3));
}

/// On the samples sigma_d is positive.
#[test]
fn sigma_is_positive() {
    assert_eq!(over_discretisations(Statement::MidpointRule), pairs().all);
}

/// At `h gamma <= -1` it is not, and the flow is refused before its first step, with the value.
#[test]
fn sigma_vanishes_for_large_steps() {
    for (gamma, sigma) in [(-2.0, 0.0), (-3.0, -0.5)] {
        let ld = LeftMidpoint::new(Pendulum { gamma }, 0.5).unwrap();
        let by_points = Flow::from_points(&ld, 0.0, DiscretePoint::new([0.0], [1.0], 0.0)).err();
        assert_eq!(by_points, Some(InputError::Sigma { sigma }));
        let by_state = Flow::new(&ld, 0.0, PhasePoint::new([0.0], [1.0], 0.0)).err();
        assert_eq!(by_state, Some(InputError::Sigma { sigma }));
    }
}
