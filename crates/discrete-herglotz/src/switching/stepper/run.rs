//! The stepper as seen by a run: its steps, its state, and its words for a resumed run.

use crate::gauss::{CollocationStepper, DefectSample};
use crate::integration::{SolvedPart, SolvedStages};
use crate::numbers::state_words::{Saved, load_option, save_option, saved};
use crate::status::first;
use crate::switching::step_curve::TimedState;
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::part_stepper::PartStepper;
use crate::{
    DenseStep, PlanEntry, RunSupport, State, StepDetails, StepFailure, Stepper, UnresolvedStep, Vector,
    integration::{Piece, Reset, SuspectInterval},
};

impl Stepper for SwitchingStepper<'_> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        self.resets.clear();
        for taken in 0..steps {
            self.step().map_err(|cause| StepFailure { taken, cause })?;
            self.k += 1;
        }
        Ok(())
    }

    fn state(&self) -> State {
        self.here.state.clone()
    }

    fn time(&self) -> f64 {
        self.problem.t0 + self.k as f64 * self.h
    }

    fn sigma(&self) -> f64 {
        self.sigma
    }

    fn evaluations(&self) -> u64 {
        self.spent + self.base.stepper().evaluations()
    }

    fn last_step(&self) -> Option<&dyn StepDetails> {
        Some(self)
    }

    fn run_support(&self) -> Option<&dyn RunSupport> {
        Some(self)
    }

    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        Some(self)
    }
}

impl StepDetails for SwitchingStepper<'_> {
    fn last_velocity(&self) -> Option<Vector> {
        (self.k > 0).then(|| self.here.v.clone())
    }

    fn dense(&self) -> Option<DenseStep> {
        if self.switched { None } else { self.base.stepper().dense() }
    }

    fn solved_stages(&self) -> Option<SolvedStages> {
        if self.switched { None } else { self.base.stepper().solved_stages() }
    }

    fn solved_parts(&self) -> Vec<SolvedPart> {
        self.parts_with_stages()
    }

    fn resets(&self) -> &[Reset] {
        &self.resets
    }

    fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    fn has_changed_energy(&self) -> bool {
        self.changed_energy
    }
}

impl RunSupport for SwitchingStepper<'_> {
    fn work_summary(&self) -> Vec<PlanEntry> {
        let mut items = self.base.stepper().work_summary();
        items.push(PlanEntry::computed(
            "switching functions",
            "steps end at kinks and jumps, at resets, and at named times",
        ));
        items
    }

    fn save(&self) -> Option<Vec<u64>> {
        let mut words = Vec::new();
        [self.k, self.before].save(&mut words);
        self.origin.save(&mut words);
        self.here.save(&mut words);
        self.surfaces.sides.save(&mut words);
        self.accumulation.save(&mut words);
        u64::from(self.changed_energy).save(&mut words);
        (self.sigma, self.spent).save(&mut words);
        save_option(self.unresolved.as_ref(), &mut words);
        words.extend(self.base.stepper().save()?);
        Some(words)
    }

    fn restore(&mut self, mut words: &[u64]) -> bool {
        self.load(&mut words).is_some() && self.base.stepper_mut().restore(words)
    }

    fn unresolved(&self) -> Option<UnresolvedStep> {
        let of_base = self.base.stepper().unresolved().map(|s| UnresolvedStep { step: s.step + self.before, ..s });
        first(self.unresolved, of_base)
    }

    fn suspect_interval(&mut self) -> Option<SuspectInterval> {
        let suspect = self.base.stepper_mut().suspect_interval()?;
        Some(SuspectInterval { step: suspect.step + self.before, ..suspect })
    }
}

impl CollocationStepper for SwitchingStepper<'_> {
    /// That of all its parts, if the last step had some.
    fn sample_defect(&self, sets: usize) -> Option<DefectSample> {
        let samples = self.last_step().iter().map(|part| part.sample_defect(sets));
        let sample = samples.reduce(|a, b| Some(a?.joined(b?))).flatten()?;
        Some(if self.switched { sample.after_a_jump() } else { sample })
    }

    fn newton_steps(&self) -> u64 {
        self.last_step().iter().map(PartStepper::newton_steps).sum()
    }
}

saved!([] TimedState { t, state, v, rests });

impl SwitchingStepper<'_> {
    /// Loads everything except the words of `base`, which is constructed again at its origin.
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        let mut counts = [self.k, self.before];
        counts.load(from)?;
        let mut states = [self.origin.clone(), self.here.clone()];
        states.load(from)?;
        self.surfaces.sides.load(from)?;
        self.accumulation.load(from)?;
        let mut changed_energy = 0u64;
        changed_energy.load(from)?;
        self.changed_energy = changed_energy != 0;
        let mut numbers = (self.sigma, self.spent);
        numbers.load(from)?;
        self.unresolved = load_option(from, || UnresolvedStep { step: 0, defect: 0.0 })?;
        self.base = self.stepper_at(&states[0], self.h, false).ok()?;
        ([self.k, self.before], [self.origin, self.here], (self.sigma, self.spent)) = (counts, states, numbers);
        Some(())
    }
}
