//! Modified Hamiltonians of the steps of motions.

use crate::{Motion, RuntimeError, System};
use discrete_herglotz::hamiltonian::ModifiedDefect;

impl System {
    /// How far the steps of a motion are from the flow of their modified Hamiltonians: the defects
    /// `H~_k(x1) - sigma_d H~_k(x0)` for the orders k from 1 to `most`, at most 8, and for the step size of the motion and a
    /// half and a quarter of it, largest step first. They decrease as `h^(k+1)` until round-off; theory, section 11.7.
    ///
    /// The steps are those of the first 256 steps of the motion.
    ///
    /// ```
    /// use herglotz_runtime::{AnyIntegrator, Motion, Start, StepControl, Steps, System};
    /// let pendulum = System::parse("x'^2/2 + cos(x) - z/4", &["x"], &[])?;
    /// let by = AnyIntegrator::Gauss { stages: 1 };
    /// let motion = Motion::new(Start::new(0.0, [0.5], [0.1], 0.0), 5.0, StepControl::Steps { by, steps: Steps::Size(0.05) });
    /// let found = pendulum.modified_defects(&motion, 3)?;
    /// let of_order = |k: usize| found.iter().filter(move |of| of.k == k).map(|of| of.defect).collect::<Vec<_>>();
    /// let order = (of_order(3)[1] / of_order(3)[2]).log2();
    /// assert!((order - 4.0).abs() < 0.15);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`plan`](Self::plan); [`InputError::Unclaimed`](crate::InputError::Unclaimed) where the system
    /// depends on time, since the modified Hamiltonian then does too; [`InputError::Count`](crate::InputError::Count)
    /// for an order of 0 or above 8.
    pub fn modified_defects(&self, motion: &Motion, most: usize) -> Result<Vec<ModifiedDefect>, RuntimeError> {
        self.kernel.modified_defects(motion, most)
    }
}
