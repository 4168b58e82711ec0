//! Statement 38 (section 5): the oscillator's discrete equations have an explicit q2, and its exact motion a closed
//! form.

use crate::common::{on_random, within};
use contact_examples::systems::{HarmonicOscillator, OneCoordinate};
use contact_geom::{DiscretePoint, VelocityPoint, numbers::MaxOrNan};
use discrete_herglotz::{DiscreteLagrangian, rules::Rule, theory::discrete_flow};
use exact_lagrangian::QuadraticExact;

/// `q2 = -((h^3 g + 4 h g + h^2 + 4) q0 + (h^3 g - 4 h g + 2 h^2 - 8) q1) / (h^2 + 4)`, and z1.
#[test]
fn oscillator() {
    on_random("harmonic oscillator", 5, |u| {
        let (q0, q1, z0) = (4.0 * u[0] - 2.0, 4.0 * u[1] - 2.0, u[2] - 0.5);
        let (g, h) = (-1.0 + 1.5 * u[3], 0.05 + 0.5 * u[4]);
        let ld = Rule::LEFT_MIDPOINT
            .of(OneCoordinate::from(HarmonicOscillator { gamma: g }), h)
            .map_err(|e| e.to_string())?;
        let next = discrete_flow(&ld, 0.0, &DiscretePoint::new([q0], [q1], z0)).map_err(|e| e.to_string())?;
        let h3 = h.powi(3);
        let q2 = -((h3 * g + 4.0 * h * g + h * h + 4.0) * q0 + (h3 * g - 4.0 * h * g + 2.0 * h * h - 8.0) * q1)
            / (h * h + 4.0);
        let z1 = (q1 - q0).powi(2) / (2.0 * h) - h / 8.0 * (q1 + q0).powi(2) + (h * g + 1.0) * z0;
        let residual = (next.q1[0] - q2).abs().max_or_nan((next.z0 - z1).abs()) / (1.0 + q2.abs() + z1.abs());
        within(residual)
    });
}

/// The steps of the exact discrete Lagrangian of the oscillator are on the true motion, under-, critically and
/// overdamped, and its `sigma_d` is `e^(gamma h)`; at a conjugate point it does not exist.
#[test]
fn exact_dynamics() {
    on_random("exact oscillator", 4, |u| {
        let x = DiscretePoint::new([4.0 * u[0] - 2.0], [4.0 * u[1] - 2.0], u[2] - 0.5);
        for gamma in [-0.05, -2.0, -2.5, 0.3] {
            let (system, h) = (HarmonicOscillator { gamma }, 0.1 + u[3]);
            let ld = QuadraticExact::new(&OneCoordinate::from(system), h).map_err(|e| e.to_string())?;
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
    assert!(
        QuadraticExact::new(&OneCoordinate::from(HarmonicOscillator { gamma: 0.0 }), std::f64::consts::PI).is_err()
    );
}
