//! An observer that ends a run when an interrupt requests it.

use crate::integration::interrupt::STEPS_BETWEEN_QUERIES;
use crate::{INTERRUPTION, Interrupt, Observer, OutputRequest, StepView, Stop};
use std::ops::ControlFlow;

/// Ends a run when its [`Interrupt`] requests it.
pub(crate) struct Interruption<'a>(pub Interrupt<'a>);

impl Observer for Interruption<'_> {
    fn needs(&self) -> OutputRequest {
        OutputRequest::default()
    }

    fn next(&self, taken: usize) -> usize {
        (taken / STEPS_BETWEEN_QUERIES + 1) * STEPS_BETWEEN_QUERIES
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.step(at)
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        // A run that has reached its end is complete.
        if !at.last && self.0.is_requested() {
            return ControlFlow::Break(Stop::here(INTERRUPTION));
        }
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_lagrangians::OnLine;
    use crate::{AnyIntegrator, Ensemble, InputError, Problem, Status, Steps, Until};
    use contact_examples::systems::Pendulum;
    use contact_geom::VelocityPoint;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Trial runs end at the first interrupt request, whatever other search would follow.
    #[test]
    fn a_plan_is_interrupted() {
        let pendulum = OnLine::from(Pendulum { gamma: -0.01 });
        for by in [None, Some("gauss_8"), Some("strang"), Some("gauss_2")] {
            for yes in [0, 1, 5] {
                let asked = AtomicUsize::new(0);
                let question = || asked.fetch_add(1, Ordering::Relaxed) >= yes;
                let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0)).unwrap();
                let problem = problem.with_interrupt(Interrupt::when(&question));
                let run = problem.accuracy(1e-9);
                let run = match by {
                    Some(by) => run.by(by.parse::<AnyIntegrator>().unwrap()),
                    None => run,
                };
                // A run of several thousand steps.
                let refused = run.plan(Until::Time(3000.0)).err();
                assert_eq!(refused, Some(InputError::Interrupted), "{by:?}, {yes}");
                assert_eq!(asked.load(Ordering::Relaxed), yes + 1, "{by:?}");
            }
        }
    }

    /// Members in lanes and members with their own runs end at their current state: complete runs would take hours.
    #[test]
    fn long_members_are_interrupted() {
        let pendulum = OnLine::from(Pendulum { gamma: -1e-9 });
        let start = |i: usize| VelocityPoint::new([0.5 + 0.01 * i as f64], [0.0], 0.0);
        for by in ["strang", "gauss_2", "midpoint"] {
            let asked = AtomicUsize::new(0);
            let question = || asked.fetch_add(1, Ordering::Relaxed) >= 20;
            let ensemble = Ensemble::new(&pendulum, 0.0, 50, start).by(by.parse::<AnyIntegrator>().unwrap());
            let ensemble = ensemble.steps(Steps::Size(1e-3)).with_interrupt(Interrupt::when(&question)).threads(2);
            let mut members = 0;
            let tally = ensemble.run(Until::Time(1e7), |member| {
                let status = member.ending.as_ref().unwrap().status;
                assert!(matches!(status, Status::Stopped { by: INTERRUPTION, t, .. } if t < 1e3), "{by}: {status}");
                members += 1;
            });
            assert_eq!((members, tally.unwrap().stopped), (50, 50), "{by}");
        }
    }

    /// An interrupt that never requests the end leaves the results bitwise unchanged.
    #[test]
    fn a_question_changes_nothing() {
        let pendulum = OnLine::from(Pendulum { gamma: -0.01 });
        let start = |i: usize| VelocityPoint::new([0.5 + 0.01 * i as f64], [0.0], 0.0);
        for by in ["strang", "gauss_2", "midpoint"] {
            let ends = |interrupt: Option<Interrupt<'_>>| {
                let ensemble = Ensemble::new(&pendulum, 0.0, 20, start).by(by.parse::<AnyIntegrator>().unwrap());
                let ensemble = ensemble.steps(Steps::Size(0.01));
                let ensemble = if let Some(i) = interrupt { ensemble.with_interrupt(i) } else { ensemble };
                let mut ends = Vec::new();
                ensemble
                    .run(Until::Time(10.0), |member| ends.push(member.ending.as_ref().unwrap().state.clone()))
                    .unwrap();
                ends
            };
            assert_eq!(ends(Some(Interrupt::when(&|| false))), ends(None), "{by}");
        }
    }
}
