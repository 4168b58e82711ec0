//! Van der Pol's oscillator as a contact Hamiltonian that is linear in p, and as a lifted vector field.

use super::systems::{One, Two, end, run};
use contact_examples::systems::VanDerPol;
use contact_geom::{Lifted, OfHamiltonian, PhasePoint};
use discrete_herglotz::{Event, Events, GaussCollocation, Problem, Status, Steps, Until};

/// The period 6.66328685932313 and the amplitude 2.00861986087484 of the limit cycle for `mu = 1`, from the tables of
/// Amore, "High order analysis of the limit cycle of the van der Pol oscillator" (2018). The start decays to the cycle by
/// e^-7 in each period, and steps of 1/20 with 8 stages are exact to round-off.
#[test]
fn the_limit_cycle() {
    let of = OfHamiltonian(Two::from(Lifted(VanDerPol::default())));
    let start = PhasePoint::new([2.0, 0.0], [0.0, 0.0], 0.0);
    let mut turns = Events::new([Event::new(|_, x| x.q[1]).falling()]);
    let problem = Problem::of_hamiltonian(&of, 0.0, start).unwrap();
    let method = GaussCollocation { stages: 8 };
    problem.by(method).steps(Steps::Size(0.05)).observe(&mut turns).run(Until::Time(60.0)).unwrap();
    let [.., before, last] = &turns.crossings[..] else { panic!("{:?}", turns.crossings) };
    // The times have the round-off of 60, and a thousand steps.
    assert!((last.t - before.t - 6.66328685932313).abs() < 1e-12, "{}", last.t - before.t);
    assert!((last.state.q[0] - 2.00861986087484).abs() < 1e-13, "{}", last.state.q[0]);
}

/// The contact Hamiltonian has the same q and z as the vector field has q and v, as long as its momentum is finite. Where that
/// blows up a run may end, with the state that was computed.
#[test]
fn the_action_is_the_velocity() {
    let system = VanDerPol { mu: 1.5, amplitude: 0.4, omega: 1.1 };
    let contact = |t| run(One::from(system), (0.0, PhasePoint::new([2.0], [0.3], 0.0)), (6, 0.02), t, |_, _, _| ());
    let (h, method) = (PhasePoint::new([2.0, 0.0], [0.0, 0.0], 0.0), (6, 0.02));
    let outcome = contact(0.4);
    assert_eq!(outcome.status, Status::Completed);
    let lifted = end(Two::from(Lifted(system)), (0.0, h), method, 0.4);
    assert!((outcome.q[0] - lifted.q[0]).abs() < 1e-14 && (outcome.z.unwrap() - lifted.q[1]).abs() < 1e-14);
    assert_eq!((lifted.p.norm(), lifted.z), (0.0, 0.0));
    let outcome = contact(40.0);
    assert!(outcome.t > 0.4 && outcome.state().check().is_ok(), "{outcome:?}");
}
