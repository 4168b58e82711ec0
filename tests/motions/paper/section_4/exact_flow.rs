//! Statement 36 (section 4.2, theorem): the exact discrete flow against the contact Hamiltonian flow of another
//! library, and over many steps.

use crate::common::oracle::hamiltonian_motion;
use crate::paper::table::{AlongMotion, EXACT_TOLERANCE, OverMotions};
use contact_examples::systems::{System, SystemVisitor, catalogue_size, visit_catalogue};
use contact_geom::{ChartVector, VelocityPoint, numbers::MaxAbsOrNan};
use discrete_herglotz::{
    Stepper,
    rules::Flow,
    theory::{legendre_minus, legendre_plus},
};
use exact_lagrangian::{ContactExponential, ExactError, ExactLagrangian, herglotz_flow, statements};
use std::collections::BTreeSet;

/// `phi_h^{X_H}` by an integrator of another library for the contact Hamiltonian equations, where H is known in closed
/// form.
#[test]
fn against_the_contact_hamiltonian_flow() {
    /// The names of the systems that were compared, and of those whose H is not known.
    #[derive(Default)]
    struct ByOracle {
        compared: BTreeSet<&'static str>,
        unknown: BTreeSet<&'static str>,
    }
    impl AlongMotion for ByOracle {
        fn residual<const N: usize, S: System<N>>(
            &mut self,
            system: &S,
            t: f64,
            x: &VelocityPoint<N>,
            h: f64,
        ) -> Result<f64, ExactError<N>> {
            let h = 0.3 * h;
            let exact = ExactLagrangian::new(system, h)?.near(x.v);
            let y = ContactExponential::new(system, h)?.at(t, x)?;
            let transforms = legendre_minus(&exact, t, &y).and_then(|m| Ok((m, legendre_plus(&exact, t, &y)?)));
            let Ok((minus, plus)) = transforms else { return Ok(f64::INFINITY) };
            let Some(end) = hamiltonian_motion(system, t, &minus, h) else {
                self.unknown.insert(system.name());
                return Ok(0.0);
            };
            self.compared.insert(system.name());
            let apart = ChartVector::from(end).minus(plus.into()).max_abs_or_nan();
            Ok(apart / ChartVector::from(plus).max_abs_or_nan())
        }
    }
    let name = "statement 36 against the contact Hamiltonian flow".into();
    let mut by_oracle = OverMotions { name, bound: EXACT_TOLERANCE, residual: ByOracle::default() };
    visit_catalogue(&mut by_oracle);
    let ByOracle { compared, unknown } = by_oracle.residual;
    assert_eq!(unknown.into_iter().collect::<Vec<_>>(), ["coupled_in_z", "coupled_plane"]);
    assert_eq!(compared.len(), catalogue_size() - 2);
}

/// Fifty steps of the discrete Herglotz equations from `(q(0), q(h), z(0))` stay on the motion: `q_k = q(kh)`, `z_k =
/// z(kh)`.
#[test]
fn fifty_steps() {
    struct Steps;
    impl SystemVisitor for Steps {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let residual = statements::follows_motion(system, system.initial_time(), &system.initial(), 0.05, 50);
            assert!(matches!(residual, Ok(r) if r < 1e-14), "{}: {residual:?}", system.name());
        }
    }
    visit_catalogue(&mut Steps);
}

/// A run of `Flow` ends where the motion does.
#[test]
fn a_run() {
    struct Run;
    impl SystemVisitor for Run {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let (t, x, h) = (system.initial_time(), system.initial(), 0.1);
            let ld = ExactLagrangian::<_, N>::new(system, h).unwrap();
            let start = contact_geom::legendre(system, t, &x);
            let end = Flow::new(&ld, t, start).map(|mut flow| {
                assert_eq!(flow.advance(20), Ok(()));
                *flow.state()
            });
            let truth = herglotz_flow(system, t, &x, 2.0).map(|m| contact_geom::legendre(system, t + 2.0, &m.end));
            let apart = match (end, truth) {
                (Ok(a), Ok(b)) => {
                    ChartVector::from(a).minus(b.into()).max_abs_or_nan() / ChartVector::from(b).max_abs_or_nan()
                }
                _ => f64::NAN,
            };
            // Twenty roundings of the state, magnified by the motion (by a few tens for the double pendulum and
            // Kepler).
            assert!(apart < 1e-13, "{}: {apart:e}", system.name());
        }
    }
    visit_catalogue(&mut Run);
}
