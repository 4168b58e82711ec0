//! The exact discrete Lagrangian is a discrete Lagrangian: every statement of section 3 holds for it, by the functions
//! that evaluate the statements for the methods.

use crate::common::{TOLERANCE, around, on_some, step_from};
use contact_examples::systems::{System, SystemVisitor, visit_catalogue};
use discrete_herglotz::statements;
use exact_lagrangian::ExactLagrangian;

#[test]
fn statements_on_every_system() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let symmetries = system.symmetries();
            let name = format!("L_h^e of {}", system.name());
            on_some(if N > 2 { 1 } else { 4 }, &name, 2 * N + 3, |u| {
                let ((t, x), h) = (system.sample(&u[1..]), step_from(u[0]));
                let ld = ExactLagrangian::<_, N>::new(system, h).map_err(|e| e.to_string())?;
                for statement in statements::STATEMENTS {
                    let residual = statements::residual(statement, &ld, &symmetries, t, &around(&x, h));
                    let residual = residual.map_err(|e| format!("statement {statement}: {e}"))?;
                    if residual.is_some_and(|r| r.is_nan() || r > TOLERANCE) {
                        return Err(format!("statement {statement}: residual {residual:?}"));
                    }
                }
                Ok(())
            });
        }
    }
    visit_catalogue(&mut Visitor);
}
