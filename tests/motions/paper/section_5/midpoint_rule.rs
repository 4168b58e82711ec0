//! Statement 39 (section 5): the equations of the midpoint rule for any potential, for steps small enough that sigma_d
//! does not vanish.

use crate::common::{on_random, step_from, within};
use contact_examples::systems::{Duffing, OneCoordinate, Pendulum, System};
use contact_geom::{DiscretePoint, PhasePoint, numbers::MaxOrNan};
use discrete_herglotz::{
    InputError,
    rules::{Flow, Rule},
    theory::discrete_flow,
};

/// `(q1 - q0)/h - h/2 V'((q0 + q1)/2) = ((q2 - q1)/h + h/2 V'((q1 + q2)/2)) / (1 + h gamma)` for a potential given by
/// V'.
fn any_potential<S: System<1>>(system: &S, gamma: f64, slope: impl Fn(f64) -> f64) {
    on_random(system.name(), 5, |u| {
        let (t, v) = system.sample(&u[1..]);
        let h = step_from(u[0]);
        let (q0, q1) = (v.q[0], v.q[0] + h * v.v[0]);
        let ld = Rule::LEFT_MIDPOINT.of(system, h).map_err(|e| e.to_string())?;
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
    any_potential(&OneCoordinate::from(pendulum), pendulum.gamma, f64::sin);
    let duffing = Duffing::default();
    any_potential(&OneCoordinate::from(duffing), duffing.gamma, |q| duffing.alpha * q + duffing.beta * q.powi(3));
}

/// At `h gamma <= -1` sigma_d is not positive, and the flow is refused before its first step with the value of sigma_d.
#[test]
fn sigma_vanishes_for_large_steps() {
    for (gamma, sigma) in [(-2.0, 0.0), (-3.0, -0.5)] {
        let ld = Rule::LEFT_MIDPOINT.of(OneCoordinate::from(Pendulum { gamma }), 0.5).unwrap();
        let by_points = Flow::from_points(&ld, 0.0, DiscretePoint::new([0.0], [1.0], 0.0)).err();
        assert_eq!(by_points, Some(InputError::Sigma { sigma }));
        let by_state = Flow::new(&ld, 0.0, PhasePoint::new([0.0], [1.0], 0.0)).err();
        assert_eq!(by_state, Some(InputError::Sigma { sigma }));
    }
}
