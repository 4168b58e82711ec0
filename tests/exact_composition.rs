//! Composition: `L_{h1+h2}^e(q0, q2, z0) = L_{h1}^e(q0, q1, z0) + L_{h2}^e(q1, q2, z1)` at the critical `q1`, and only there.

use crate::common::{AlongMotion, OverMotions};
use contact_geom::VelocityPoint;
use contact_geom::systems::{System, visit_catalogue};
use exact_lagrangian::{ExactError, statements};

/// Along random motions of every system, with unequal steps.
#[test]
fn on_every_system() {
    struct Composition;
    impl AlongMotion for Composition {
        fn residual<const N: usize, S: System<N>>(
            &mut self,
            system: &S,
            t: f64,
            x: &VelocityPoint<N>,
            h: f64,
        ) -> Result<f64, ExactError<N>> {
            statements::composition(system, t, x, (0.12 * h, 0.18 * h))
        }
    }
    visit_catalogue(&mut OverMotions(Composition));
}
