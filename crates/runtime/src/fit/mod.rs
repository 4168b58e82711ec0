//! Fits of motions to data.

mod event_series;
mod model;
mod result;

pub use result::{FittedMotion, FittedSeries};

use crate::{AnyIntegrator, Motion, RunMonitor, RuntimeError, System};
use herglotz_fit::{Fit, FitError, LeastSquares, Loss, MultiStart};
use model::FitModel;

/// The method of a motion that names none: with 8 stages few steps are needed, and its tangents are exact.
const METHOD: AnyIntegrator = AnyIntegrator::Gauss { stages: 8 };

/// The same under constraints, where it stands for the contact Lobatto method of order 8.
const UNDER_CONSTRAINTS: AnyIntegrator = AnyIntegrator::Gauss { stages: 4 };

/// An unknown of a fit, with its bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Its name: a parameter, or a coordinate, velocity, momentum or `z` of the start, which may be written `start.x`.
    pub name: String,
    /// The lower bound; infinite where there is none.
    pub lower: f64,
    /// The upper bound; infinite where there is none.
    pub upper: f64,
}

impl Unknown {
    /// An unknown without bounds.
    pub fn free(name: impl Into<String>) -> Self {
        Unknown { name: name.into(), lower: f64::NEG_INFINITY, upper: f64::INFINITY }
    }
}

/// Measured values of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The quantity, as in a [column](crate::Column::parse): `x`, `x'`, `p_x`, `z`, or an expression of the state, with or
    /// without a name.
    pub quantity: String,
    /// The times, in any order, not before the start.
    pub times: Vec<f64>,
    /// The values, as many as there are times.
    pub values: Vec<f64>,
    /// The standard deviations of the values; without them all values have weight 1.
    pub deviations: Option<Vec<f64>>,
    /// Where the values are the times of sign changes of an event: which ones. The quantity is then a name of the series, and
    /// `times` are the values.
    pub event: Option<SignChanges>,
}

/// Sign changes of an event of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct SignChanges {
    /// The index of the event.
    pub event: usize,
    /// The number of each of them in the order of the motion, from 0, in ascending order.
    pub numbers: Vec<usize>,
}

impl Series {
    /// Measured times of the first sign changes of an event, with a name.
    pub fn of_event(name: impl Into<String>, event: usize, times: impl Into<Vec<f64>>) -> Self {
        let times = times.into();
        let event = Some(SignChanges { event, numbers: (0..times.len()).collect() });
        Series { quantity: name.into(), values: times.clone(), times, deviations: None, event }
    }
}

/// A fit of a motion to data; see [`System::fit`].
#[derive(Clone, Debug)]
pub struct MotionFit {
    /// The motion whose start, with the parameters of the system, is the start of the fit. Its rows are not used, and its
    /// end is that of the data; its events are those of series of times.
    pub motion: Motion,
    /// What is fitted.
    pub unknowns: Vec<Unknown>,
    /// The data.
    pub series: Vec<Series>,
    /// What a residual contributes to the cost.
    pub loss: Loss,
    /// Whether the standard deviations are known in size: standard errors are then not scaled by that of the residuals.
    pub absolute_deviations: bool,
    /// Times at which the motion is cut for multiple shooting; none without it.
    pub nodes: Vec<f64>,
    /// Other starts: values of all unknowns. Without any, the fit starts from the motion.
    pub starts: Vec<Vec<f64>>,
    /// The largest number of evaluations from each start.
    pub max_evaluations: Option<usize>,
}

impl MotionFit {
    /// A fit by least squares, from the motion.
    pub fn new(motion: Motion, unknowns: impl Into<Vec<Unknown>>, series: impl Into<Vec<Series>>) -> Self {
        MotionFit {
            motion,
            unknowns: unknowns.into(),
            series: series.into(),
            loss: Loss::Linear,
            absolute_deviations: false,
            nodes: Vec::new(),
            starts: Vec::new(),
            max_evaluations: None,
        }
    }
}

impl System {
    /// Fits parameters and the start of a motion to data: the method of Levenberg and Marquardt with the exact Jacobian
    /// of the computed motion. Steps that are chosen for an accuracy are chosen once, from the start of the fit, since a
    /// cost whose steps change with the parameters has no derivative.
    ///
    /// ```
    /// use herglotz_runtime::{Motion, MotionFit, Series, Start, StepControl, System, Unknown};
    /// let spring = System::parse("x'^2/2 - k*x^2/2 - c*z", &["x"], &[("k", 1.2), ("c", 0.1)])?;
    /// let start = Start::new(0.0, [1.0], [0.0], 0.0);
    /// let motion = Motion::new(start, 3.0, StepControl::Accuracy { error: 1e-9, by: None });
    /// let data = Series {
    ///     quantity: "x".to_owned(),
    ///     times: vec![0.5, 1.0, 1.5, 2.0, 2.5, 3.0],
    ///     values: vec![0.886, 0.579, 0.152, -0.294, -0.657, -0.850],
    ///     deviations: None,
    ///     event: None,
    /// };
    /// let fitted = spring.fit(&MotionFit::new(motion, ["k", "c"].map(Unknown::free), [data]), &mut ())?;
    /// println!("{}", fitted.fit);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`plan`](Self::plan); [`RuntimeError::UnknownVariable`]; [`RuntimeError::Fit`] for invalid data, and for
    /// motions that cannot be computed or differentiated.
    pub fn fit(&self, request: &MotionFit, monitor: &mut dyn RunMonitor) -> Result<FittedMotion, RuntimeError> {
        let model = FitModel::new(self, request, monitor)?;
        let data: Vec<f64> = request.series.iter().flat_map(|series| &series.values).copied().collect();
        let mut problem = LeastSquares::new(&model, &data)?.loss(request.loss)?;
        if request.series.iter().any(|series| series.deviations.is_some()) {
            let of = |series: &Series| series.deviations.clone().unwrap_or_else(|| vec![1.0; series.values.len()]);
            problem = problem.standard_deviations(&request.series.iter().flat_map(of).collect::<Vec<_>>())?;
        }
        if request.absolute_deviations {
            if let Some(series) = request.series.iter().find(|series| series.deviations.is_none()) {
                let why = format!("are absolute, but `{}` has none; give them for all data", series.quantity);
                return Err(RuntimeError::argument("deviations", why));
            }
            problem = problem.absolute_deviations(true);
        }
        for unknown in &request.unknowns {
            problem = problem.bounds(&unknown.name, unknown.lower, unknown.upper)?;
        }
        if let Some(count) = request.max_evaluations {
            problem = problem.max_evaluations(count);
        }
        let of_motion = [model.start()];
        let starts = if request.starts.is_empty() { &of_motion[..] } else { &request.starts };
        if request.nodes.is_empty() {
            let fits = problem.solve_from(starts);
            let best = fits.best().map_err(|error| model.reason(error))?.clone();
            return Ok(model.result(request, best, fits, None));
        }
        let shooting = problem.multiple_shooting(&request.nodes)?;
        let mut all: Vec<_> = starts.iter().map(|start| shooting.solve(start)).collect();
        let fits = all.iter().map(|found| found.as_ref().map(|found| found.fit.clone()).map_err(Clone::clone));
        let fits = MultiStart { fits: fits.collect() };
        let best = fits.best().map_err(|error| model.reason(error))?.clone();
        let of_best = fits.best_index().map(|index| all.swap_remove(index)).and_then(Result::ok);
        Ok(model.result(request, best, fits, of_best))
    }
}
