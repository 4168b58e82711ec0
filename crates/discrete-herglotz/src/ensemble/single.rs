//! A member by a run of its own.

use super::member::Ending;
use crate::{Facts, InLanes, InputError, Integrator, Plan, Problem, Run, Start, Stepper, Steps, Until, Wants};
use contact_geom::Lagrangian;

/// The integrator of an ensemble, for as long as a run of one member lasts.
pub(super) struct OfMember<'i, 'a, L, const N: usize> {
    pub integrator: &'i (dyn Integrator<'a, L, N> + Sync + 'a),
    pub lagrangian: &'a L,
}

impl<'p, 'i: 'p, 'a: 'p, L: Lagrangian<N>, const N: usize> Integrator<'p, L, N> for OfMember<'i, 'a, L, N> {
    fn facts(&self) -> Facts {
        self.integrator.facts()
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        self.integrator.check(lagrangian)
    }

    fn stepper(
        &self,
        problem: &Problem<'p, L, N>,
        h: f64,
        wants: Wants,
    ) -> Result<Box<dyn Stepper<N> + 'p>, InputError> {
        let Problem { t0, start, state, structure, .. } = *problem;
        self.integrator.stepper(&Problem { lagrangian: self.lagrangian, t0, start, state, structure }, h, wants)
    }

    fn in_lanes(&self) -> Option<InLanes> {
        self.integrator.in_lanes()
    }
}

/// What all members have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Common {
    pub t0: f64,
    pub steps: Steps,
    pub until: Until,
    pub action: bool,
}

impl Common {
    /// Does something with the run of a member.
    pub fn with<'a, L: Lagrangian<N>, R, const N: usize>(
        &self,
        integrator: &(dyn Integrator<'a, L, N> + Sync + 'a),
        lagrangian: &'a L,
        start: Start<N>,
        then: impl FnOnce(Run<'_, '_, L, N>) -> Result<R, InputError>,
    ) -> Result<R, InputError> {
        let problem = Problem::new(lagrangian, self.t0, start)?;
        let run = problem.by(OfMember { integrator, lagrangian }).steps(self.steps);
        then(if self.action { run } else { run.without_action() })
    }

    /// Runs a member, with all checks of a run.
    pub fn run<'a, L: Lagrangian<N>, const N: usize>(
        &self,
        integrator: &(dyn Integrator<'a, L, N> + Sync + 'a),
        lagrangian: &'a L,
        start: Start<N>,
    ) -> Result<Ending<N>, InputError> {
        let outcome = self.with(integrator, lagrangian, start, |run| run.run(self.until))?;
        Ok(Ending {
            status: outcome.status,
            suspicion: outcome.suspicion,
            steps: outcome.steps,
            t: outcome.t,
            state: outcome.state(),
        })
    }

    /// The step and the number of steps of a member's run, after all checks of a plan.
    pub fn plan<'a, L: Lagrangian<N>, const N: usize>(
        &self,
        integrator: &(dyn Integrator<'a, L, N> + Sync + 'a),
        lagrangian: &'a L,
        start: Start<N>,
    ) -> Result<(f64, usize), InputError> {
        self.with(integrator, lagrangian, start, |run| {
            let plan: Plan<'_, L, N> = run.plan(self.until)?;
            Ok((plan.step_size(), plan.count()))
        })
    }
}
