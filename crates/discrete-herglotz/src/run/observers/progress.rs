//! The progress of a run.

use crate::InputError;
use crate::run::{Observer, OutputRequest, RunInfo, StepView, Stop};
use std::ops::ControlFlow;

/// The number of steps between two reports, if the total number of steps is not known: below a millisecond of short
/// steps, so that a bar moves smoothly.
const DEFAULT_STRIDE: usize = 1 << 10;

/// Reports the completed fraction of the span of a run, from 0 to 1, at each hundredth: for a progress bar.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{GaussCollocation, Problem, Progress, Steps, Until};
/// let pendulum = Pendulum { gamma: -0.1 };
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
/// let mut bar = Progress::new(|part| print!("\r{:3.0} %", 100.0 * part));
/// problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.1)).observe(&mut bar).run(Until::Time(1e4))?;
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub struct Progress<F> {
    report: F,
    run: RunInfo,
}

impl<F: FnMut(f64)> Progress<F> {
    /// Reports to this function.
    pub fn new(report: F) -> Self {
        Progress { report, run: RunInfo::NONE }
    }

    fn stride(&self) -> usize {
        self.run.count.map_or(DEFAULT_STRIDE, |count| count.div_ceil(100))
    }
}

impl<F: FnMut(f64)> Observer for Progress<F> {
    fn needs(&self) -> OutputRequest {
        OutputRequest::default()
    }

    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        self.run = *info;
        Ok(())
    }

    fn next(&self, taken: usize) -> usize {
        (taken / self.stride() + 1).saturating_mul(self.stride())
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.step(at)
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if at.last || at.at_rest.is_some() || at.k.is_multiple_of(self.stride()) {
            let RunInfo { t0, t_end, .. } = self.run;
            (self.report)(if at.last { 1.0 } else { (at.t - t0) / (t_end - t0) });
        }
        ControlFlow::Continue(())
    }
}
