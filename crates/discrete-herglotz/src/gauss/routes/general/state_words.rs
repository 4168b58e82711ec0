//! Saving and restoring the state of the general route.

use crate::gauss::routes::general::{Extension, General};
use crate::gauss::stages::stage_newton::StageNewton;
use crate::numbers::state_words::{Saved, load_option, save_option, saved};

saved!([] Extension { t, p_t, g });

impl Saved for General {
    fn save(&self, to: &mut Vec<u64>) {
        let (moving, positions) = self.vectors.moving_and_positions();
        moving.save(to);
        [self.l, self.rate, self.one_minus_rho_stages, self.z_stages].save(to);
        positions.save(to);
        self.extension.save(to);
        self.mass.save(to);
        self.q.save(to);
        self.p.save(to);
        self.z.save(to);
        self.one_minus_rho.save(to);
        self.warm.save(to);
        self.age.save(to);
        self.defect.save(to);
        self.solved.save(to);
        self.known.save(to);
        self.evaluations.save(to);
        save_option(self.newton.as_deref(), to);
    }

    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        let (moving, positions) = self.vectors.moving_and_positions_mut();
        moving.load(from)?;
        for stages in [&mut self.l, &mut self.rate, &mut self.one_minus_rho_stages, &mut self.z_stages] {
            stages.load(from)?;
        }
        positions.load(from)?;
        self.extension.load(from)?;
        self.mass.load(from)?;
        self.q.load(from)?;
        self.p.load(from)?;
        self.z.load(from)?;
        self.one_minus_rho.load(from)?;
        self.warm.load(from)?;
        self.age.load(from)?;
        self.defect.load(from)?;
        self.solved.load(from)?;
        self.known.load(from)?;
        self.evaluations.load(from)?;
        let n = self.q.len();
        self.newton = load_option(from, || StageNewton::new(n, &self.table))?.map(Box::new);
        Some(())
    }
}
