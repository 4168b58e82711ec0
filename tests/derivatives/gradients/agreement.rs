//! Tangents, gradients and differences agree, on every system of the catalogue.

use crate::gradients::runs::{Case, weyl};
use contact_examples::systems::{System, SystemVisitor, visit_catalogue};
use discrete_herglotz::GaussCollocation;

/// Every system, from sampled states, with 1 to 16 stages, forward and backward in
/// time, from velocities and momenta.
///
/// Forward and backward derivatives differ by round-off, which the linear systems of the stages and the run itself
/// amplify by less than 1e3. Differences are limited by the round-off of the run, 2048 units of it, and by their order.
#[test]
fn forward_backward_and_differences_agree() {
    struct Visit(u32, usize);
    impl SystemVisitor for Visit {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for draw in 0..8 {
                self.0 += 1;
                let (mut t0, start) = system.sample(&weyl(self.0, 2 * N + 2));
                t0 += system.initial_time();
                let stages = 1 + (self.0 as usize * 5) % 16;
                let span = if draw % 4 == 3 { -0.3 } else { 0.4 };
                let case = Case {
                    lagrangian: system,
                    t0,
                    start,
                    from_momentum: draw % 2 == 1,
                    t_end: t0 + span,
                    steps: 3 + draw as usize % 3,
                    method: GaussCollocation { stages },
                };
                // An orbit that meets a centre has no derivatives.
                if !case.is_resolved() {
                    self.1 += 1;
                    continue;
                }
                case.compare(&format!("{}, {stages} stages, from {start:?}", system.name()), 3e-13, 1e-8);
            }
        }
    }
    let mut visitor = Visit(0, 0);
    visit_catalogue(&mut visitor);
    assert!(visitor.1 <= 2, "{} motions are not resolved", visitor.1);
}
