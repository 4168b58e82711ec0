//! Saving and restoring the state of a motion by contact Gauss collocation.

use crate::UnresolvedStep;
use crate::gauss::steps::sequence::Sequence;
use crate::gauss::steps::{GaussSteps, Solution};
use crate::numbers::state_words::{Saved, load_option, save_option};

impl Saved for GaussSteps {
    fn save(&self, to: &mut Vec<u64>) {
        self.route.save(to);
        self.k.save(to);
        self.from.save(to);
        self.solved.save(to);
        (self.solution as u32).save(to);
        [self.pause, self.pauses].save(to);
        self.newton_steps.save(to);
        save_option(self.sequence.as_deref(), to);
        save_option(self.monitor.first.as_ref(), to);
        let suspect = &self.suspect;
        suspect.is_new.save(to);
        if suspect.is_new {
            [suspect.step, 2].save(to);
            suspect.t.save(to);
            suspect.from.save(to);
            suspect.to.save(to);
        }
        [self.monitor.sharpest, self.monitor.floor].save(to);
    }

    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.route.load(from)?;
        self.k.load(from)?;
        self.from.load(from)?;
        self.solved.load(from)?;
        let mut solution = 0u32;
        solution.load(from)?;
        self.solution =
            [Solution::FixedPointIteration, Solution::Simplified, Solution::Newton].get(solution as usize).copied()?;
        self.pause.load(from)?;
        self.pauses.load(from)?;
        self.newton_steps.load(from)?;
        let start = &self.from;
        self.sequence = load_option(from, || Sequence::new(start))?.map(Box::new);
        self.monitor.first = load_option(from, || UnresolvedStep { step: 0, defect: 0.0 })?;
        let suspect = &mut self.suspect;
        suspect.is_new.load(from)?;
        if suspect.is_new {
            let mut steps = 0usize;
            suspect.step.load(from)?;
            steps.load(from)?;
            suspect.t.load(from)?;
            suspect.from.load(from)?;
            suspect.to.load(from)?;
        }
        self.monitor.sharpest.load(from)?;
        self.monitor.floor.load(from)
    }
}
