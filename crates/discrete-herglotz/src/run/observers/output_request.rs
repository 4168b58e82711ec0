//! The quantities that observers, and the outcome, request of a run.

/// The quantities that an observer requests of a run, in addition to times, positions and momenta. Quantities that
/// neither an observer nor the outcome requests are not computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputRequest {
    /// The action z.
    pub action: bool,
    /// The conformal factor of the motion, the product of the `sigma_d`.
    pub conformal_factor: bool,
    /// Whether the stepper must support [saving](crate::RunSupport::save).
    pub saved: bool,
    /// Whether the run is differentiated, so that an integrator with derivatives is selected for an accuracy, and the stages
    /// of the parts of divided steps are kept.
    pub derivatives: bool,
    /// Whether states between the ends of a step are computed by steps of the integrator that end there, which are contact
    /// like all others, and not from polynomials.
    pub exact: bool,
}

impl OutputRequest {
    /// The action alone.
    pub const ACTION: OutputRequest =
        OutputRequest { action: true, conformal_factor: false, saved: false, derivatives: false, exact: false };

    /// The quantities of both requests.
    pub fn and(self, other: Self) -> Self {
        OutputRequest {
            action: self.action || other.action,
            conformal_factor: self.conformal_factor || other.conformal_factor,
            saved: self.saved || other.saved,
            derivatives: self.derivatives || other.derivatives,
            exact: self.exact || other.exact,
        }
    }
}

/// The data of a run before it starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunInfo {
    /// The number of coordinates.
    pub dimension: usize,
    /// The start time.
    pub t0: f64,
    /// The end time; before the start time if the run goes backward in time.
    pub t_end: f64,
    /// The step size, if all steps are equal; negative if the run goes backward in time.
    pub h: Option<f64>,
    /// The number of steps, if it is known in advance; in transformed time it results from the integration.
    pub count: Option<usize>,
}

impl RunInfo {
    /// The value before an observer has been prepared.
    pub(crate) const NONE: RunInfo = RunInfo { dimension: 0, t0: 0.0, t_end: 0.0, h: None, count: None };
}
