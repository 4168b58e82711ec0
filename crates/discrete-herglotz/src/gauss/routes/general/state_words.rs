//! Saving and restoring the state of the general route.

use crate::gauss::routes::general::General;
use crate::gauss::stages::simplified_newton::StageNewton;
use crate::numbers::state_words::{load_option, save_option, saved};

saved!([L, P, const N: usize] General<'_, L, P, N> {
    v, l_v, moved, force, l, rate, one_minus_rho_stages, z_stages, x, extension, mass, q, p, z, one_minus_rho, warm, age, defect, solved, known, evaluations,
} and save_newton, load_newton);

impl<L, P, const N: usize> General<'_, L, P, N> {
    fn save_newton(&self, to: &mut Vec<u64>) {
        save_option(self.newton.as_deref(), to);
    }

    fn load_newton(&mut self, from: &mut &[u64]) -> Option<()> {
        self.newton = load_option(from, || StageNewton::new(&self.table))?.map(Box::new);
        Some(())
    }
}
