//! What observers, and the outcome, request of a run.

/// What an observer asks of a run beside times, positions and momenta. What no observer asks for, and the outcome does not want either, is
/// not computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputRequest {
    /// The action z.
    pub action: bool,
    /// The conformal factor of the motion, the product of the `sigma_d`.
    pub conformal_factor: bool,
    /// That the stepper can be [saved](Stepper::save).
    pub saved: bool,
}

impl OutputRequest {
    /// The action alone.
    pub const ACTION: OutputRequest = OutputRequest { action: true, conformal_factor: false, saved: false };

    /// What either asks for.
    pub fn and(self, other: Self) -> Self {
        OutputRequest {
            action: self.action || other.action,
            conformal_factor: self.conformal_factor || other.conformal_factor,
            saved: self.saved || other.saved,
        }
    }
}

/// What a run will be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunInfo {
    /// The time of its start.
    pub t0: f64,
    /// The time of its end; before that of the start where the run goes back.
    pub t_end: f64,
    /// The length of its steps, where all are equal; negative where the run goes back.
    pub h: Option<f64>,
    /// The number of its steps, where that is known before: of a time transformation it shows at the end.
    pub count: Option<usize>,
}

impl RunInfo {
    /// Of an observer that has not been told its own.
    pub(crate) const NONE: RunInfo = RunInfo { t0: 0.0, t_end: 0.0, h: None, count: None };
}
