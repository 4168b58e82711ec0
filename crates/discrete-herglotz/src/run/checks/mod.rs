//! Checks along a run: whether its steps resolve the motion, and whether the claims of structure hold.
//!
//! [`crate::resolution`] lists the measures, with their thresholds, and contains the monitor of the steps.

pub(crate) mod acceleration_jump;
pub(crate) mod claims;
pub(crate) mod energy;
pub(crate) mod energy_drift;
pub(crate) mod half_steps;
pub(crate) mod rest;

use crate::integration::check_claims::violated_claim;
use crate::run::discretization::Discretization;
use crate::run::findings::Findings;
use crate::status::first;
use crate::{State, Status, Stepper, UnresolvedStep, integration::SuspectInterval};
use claims::ClaimMonitor;
use contact_geom::Defect;
use energy::EnergyMonitor;

/// The number of steps between two checks of all claims in long runs: a check then costs less than a hundredth of the
/// run.
const MAX_STEPS_BETWEEN_FULL_CHECKS: usize = 1 << 14;

/// The number of steps by which a run may pass the end found by its trial runs, which is known up to the errors of
/// both.
const MAX_STEPS_PAST_END: usize = 2;

/// The number of steps after which all claims are checked next: every power of two, and the multiples of
/// [`MAX_STEPS_BETWEEN_FULL_CHECKS`].
pub(crate) fn next_full_check(taken: usize) -> usize {
    (taken + 1)
        .checked_next_power_of_two()
        .unwrap_or(usize::MAX)
        .min((taken / MAX_STEPS_BETWEEN_FULL_CHECKS + 1) * MAX_STEPS_BETWEEN_FULL_CHECKS)
}

/// Steps that a run has just taken.
pub(crate) struct TakenSteps<'s> {
    pub stepper: &'s mut dyn Stepper,
    /// The time and the state before them, where a check or an observer needs them.
    pub before: Option<(f64, State)>,
    /// The number of steps before them, and with them.
    pub first: usize,
    pub taken: usize,
    /// Whether the run ends with them.
    pub over: bool,
}

impl TakenSteps<'_> {
    /// The time and the state at the start, if it is a single step.
    pub fn single(&self) -> Option<&(f64, State)> {
        self.before.as_ref().filter(|_| self.taken == self.first + 1)
    }

    /// The same, when the step is no longer needed.
    pub fn into_single(self) -> Option<(f64, State)> {
        self.before.filter(|_| self.taken == self.first + 1)
    }

    /// Whether all claims are checked after these steps.
    pub fn are_fully_checked(&self) -> bool {
        self.over || self.taken == next_full_check(self.taken - 1)
    }
}

/// The checks of a run.
pub(crate) struct Checks<'r, 'p> {
    steps: &'r Discretization<'p>,
    pub findings: Findings,
    /// Whether the conformal factor is a product along the run, and whether it is a power of one `sigma_d`.
    product: bool,
    power: bool,
    /// Whether steps are compared with two halves: those of few stages at powers of two, all where they are suspect.
    halves: bool,
    suspects: bool,
    /// Whether unresolved steps that the stepper reports count. For a requested accuracy they count only for
    /// collocation, since trial runs have compared the steps of other methods with a reference whose defect was
    /// sampled; and not for a motion that is proved to be linear, in which a transient within a step causes no error
    /// beyond that of the order.
    of_stepper: bool,
    claims: Option<ClaimMonitor>,
    energy: Option<EnergyMonitor>,
    ends_after: Option<usize>,
}

impl<'r, 'p> Checks<'r, 'p> {
    /// The checks of a run with these steps. `constant_rate`: whether every step has the same `sigma_d`. `ends_after`:
    /// the step at which an observer is expected to end the run.
    pub fn of(steps: &'r Discretization<'p>, constant_rate: bool, ends_after: Option<usize>) -> Self {
        let given = steps.error.is_none();
        let suspects = given && !steps.info.in_transformed_time;
        let linear = steps.problem.system.hints().proved && steps.problem.structure.quadratic;
        let energy = EnergyMonitor::of(steps, constant_rate);
        Checks {
            steps,
            findings: Findings {
                energy: energy.as_ref().map(|energy| energy.drift.sums).unwrap_or_default(),
                ..Findings::default()
            },
            product: steps.needs.conformal_factor && !constant_rate,
            power: constant_rate,
            halves: suspects && !steps.many_stages(),
            suspects,
            of_stepper: given || steps.info.collocation.is_some() && !linear,
            claims: ClaimMonitor::of(steps),
            energy,
            ends_after,
        }
    }

    /// Continues the checks of a run that was interrupted.
    pub fn resume(&mut self, findings: Findings) {
        self.findings = findings;
        if let Some(energy) = &mut self.energy {
            energy.drift.sums = findings.energy;
        }
    }

    /// The number of steps at the end of the next step that is compared with two halves: a power of two, or the last
    /// step.
    fn next_halves(&self, taken: usize) -> usize {
        if self.halves && self.findings.unresolved.is_none() {
            (taken + 1).checked_next_power_of_two().unwrap_or(usize::MAX).min(self.steps.most())
        } else {
            usize::MAX
        }
    }

    /// The number of steps after which a check is due, at the latest.
    pub fn next(&self, taken: usize) -> usize {
        if self.product {
            return taken + 1;
        }
        let claims = self.claims.as_ref().map_or(usize::MAX, |claims| claims.next(taken));
        let energy = self.energy.as_ref().map_or(usize::MAX, |energy| energy.next(taken));
        next_full_check(taken).min(single_step_stop(taken, self.next_halves(taken))).min(claims).min(energy)
    }

    /// Whether a check needs the state before the next step.
    pub fn needs_start(&self, taken: usize) -> bool {
        self.next_halves(taken) == taken + 1
            || self.claims.as_ref().is_some_and(|claims| claims.next(taken) == taken + 1)
    }

    /// Multiplies the conformal factor of the run by the factors of some steps.
    pub fn multiply(&mut self, taken: usize, done: usize, sigma: f64) {
        if self.power {
            self.findings.log_factor = taken as f64 * sigma.ln();
        } else if self.product {
            self.findings.log_factor += done as f64 * sigma.ln();
        }
    }

    /// Checks some steps; returns the status of the run if a claim is violated, which ends it.
    pub fn check(&mut self, step: &mut TakenSteps<'_>) -> Option<Status> {
        self.compare_with_halves(step);
        let next_claims = self.claims.as_ref().map_or(usize::MAX, |claims| claims.next(step.first));
        let next_energy = self.energy.as_ref().map_or(usize::MAX, |energy| energy.next(step.first));
        let status = |Defect { claim, size }| Status::FalseClaim { step: step.taken, claim, size };
        if step.are_fully_checked() {
            let (problem, near) = (&self.steps.problem, step.stepper.last_velocity());
            let guess = near.as_ref().unwrap_or(&problem.start.v);
            let (t, state) = (step.stepper.time(), step.stepper.state());
            if let Some(defect) = violated_claim(&*problem.system, t, &state, guess) {
                return Some(status(defect));
            }
            self.query_stepper(step.stepper);
        }
        if let Some(claims) = &mut self.claims
            && (step.taken >= next_claims || step.over)
            && let Some(defect) = claims.violated(self.steps, step.stepper, step.single())
        {
            return Some(status(defect));
        }
        if step.stepper.last_step().is_some_and(|last| last.has_changed_energy()) {
            self.energy = None;
        }
        if let Some(energy) = &mut self.energy
            && (step.taken >= next_energy || step.over)
        {
            let drift = energy.drift(self.steps, step.stepper, (self.findings.log_factor, step.taken));
            self.findings.energy = energy.drift.sums;
            self.note(drift.map(|defect| UnresolvedStep { step: step.taken - 1, defect }));
        }
        // The trial runs ended at an earlier step.
        if self.ends_after.is_some_and(|steps| step.taken > steps + MAX_STEPS_PAST_END) {
            self.note(Some(UnresolvedStep { step: step.taken - 1, defect: f64::INFINITY }));
        }
        None
    }

    /// Compares the step with two of half its length, where that is due.
    fn compare_with_halves(&mut self, step: &TakenSteps<'_>) {
        if self.next_halves(step.first) == step.first + 1
            && let Some((t, from)) = step.single()
        {
            let (t, from, to) = (*t, from.clone(), step.stepper.state());
            let interval = SuspectInterval { step: step.first, steps: 1, t, from, to };
            self.note(self.steps.unresolved_within(&interval));
        }
    }

    /// Checks the suspect interval of the stepper, and takes over its unresolved step.
    fn query_stepper(&mut self, stepper: &mut dyn Stepper) {
        let suspect = stepper.suspect_interval().filter(|_| self.suspects && self.findings.unresolved.is_none());
        self.note(suspect.and_then(|suspect| self.steps.unresolved_within(&suspect)));
        self.note(self.unresolved_by(stepper));
    }

    /// The first step that the stepper found unresolved.
    pub fn unresolved_by(&self, stepper: &dyn Stepper) -> Option<UnresolvedStep> {
        if self.of_stepper { stepper.unresolved() } else { None }
    }

    fn note(&mut self, unresolved: Option<UnresolvedStep>) {
        self.findings.unresolved = first(self.findings.unresolved, unresolved);
    }
}

/// The number of steps at which a run stops so that the step which ends at `due` is taken by itself.
pub(crate) fn single_step_stop(taken: usize, due: usize) -> usize {
    if due > taken + 1 { due - 1 } else { due }
}
