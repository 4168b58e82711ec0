//! Saving and restoring the state of a run of contact Gauss collocation.

use crate::gauss::stepper::{GaussStepper, Route, Sequence, Solution, with_route};
use crate::numbers::state_words::{Saved, load_option, save_option};
use contact_geom::Lagrangian;

impl<L: Lagrangian<N>, const N: usize> GaussStepper<'_, L, N> {
    /// The data that change from step to step, as 64-bit words.
    pub(crate) fn words(&self) -> Vec<u64> {
        let mut to = Vec::new();
        with_route!(&*self.route, run => run.save(&mut to));
        self.k.save(&mut to);
        self.from.save(&mut to);
        self.solved.save(&mut to);
        (self.solution as u32).save(&mut to);
        [self.pause, self.pauses].save(&mut to);
        self.newton_steps.save(&mut to);
        save_option(self.sequence.as_deref(), &mut to);
        self.monitor.save(&mut to);
        to
    }

    /// Reads back what [`words`](Self::words) has written; `None` if the words do not fit.
    pub(crate) fn read(&mut self, from: &mut &[u64]) -> Option<()> {
        with_route!(&mut *self.route, run => run.load(from))?;
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
        let start = self.from;
        self.sequence = load_option(from, || *Sequence::new(start))?.map(Box::new);
        self.monitor.load(from)
    }
}
