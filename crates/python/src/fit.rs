//! Fits of motions to data.

use crate::arrays::{matrix, value_error, vector};
use crate::motion::Motion;
use crate::sensitivity::detached;
use contact_geom::nalgebra::DMatrix;
use herglotz_runtime::{
    Bound as HeldAt, FittedMotion, FittedSeries, InitialVelocity, MotionFit, ResidualLoss, Series, SignChanges,
    StepControl, Steps, Unknown,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// A fitted motion.
#[pyclass(frozen, get_all, module = "herglotz._core")]
pub struct FitRecord {
    /// The fitted parameters of the system.
    parameters: Vec<(String, f64)>,
    /// The start: position, velocity or momentum, whether it is the momentum, and the action.
    start: (Vec<f64>, Vec<f64>, bool, f64),
    status: String,
    converged: bool,
    table: String,
    names: Vec<String>,
    values: Vec<f64>,
    /// The standard errors, NaN where there are none.
    errors: Vec<f64>,
    /// The bound at which each unknown is held.
    bounds: Vec<Option<&'static str>>,
    covariance: Option<Py<PyArray2<f64>>>,
    correlation: Option<Py<PyArray2<f64>>>,
    jacobian: Py<PyArray2<f64>>,
    cost: f64,
    residual_variance: Option<f64>,
    degrees_of_freedom: usize,
    rank: usize,
    iterations: usize,
    evaluations: usize,
    /// The times, the data, the fitted values and the residuals of each quantity.
    series: Vec<[Py<PyArray1<f64>>; 4]>,
    /// The cost from each start, NaN where it has no fit.
    costs: Vec<f64>,
    best_start: usize,
    largest_defect: Option<f64>,
    step: f64,
}

/// The loss with this name.
fn loss_of(name: Option<(String, f64)>) -> PyResult<ResidualLoss> {
    let Some((name, scale)) = name else { return Ok(ResidualLoss::Linear) };
    match name.as_str() {
        "huber" => Ok(ResidualLoss::Huber { scale }),
        "soft_l1" => Ok(ResidualLoss::SoftL1 { scale }),
        "cauchy" => Ok(ResidualLoss::Cauchy { scale }),
        _ => {
            let known = "\"huber\", \"soft_l1\" and \"cauchy\"";
            Err(value_error(format!("`loss` is {name:?}; the losses are {known}, each with its scale")))
        }
    }
}

/// A quantity with the times, the values and the standard deviations of its data; for times of an event, its index and the
/// numbers of the sign changes.
type GivenSeries = (String, Vec<f64>, Vec<f64>, Option<Vec<f64>>, Option<(usize, Vec<usize>)>);

/// Fits a motion to data. The unknowns are given with their bounds.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "they are those of `fit`, which names them")]
pub fn fit_motion(
    py: Python<'_>,
    motion: &Motion,
    unknowns: Vec<(String, f64, f64)>,
    series: Vec<GivenSeries>,
    loss: Option<(String, f64)>,
    nodes: Vec<f64>,
    starts: Vec<Vec<f64>>,
    max_evaluations: Option<usize>,
    absolute_deviations: bool,
) -> PyResult<FitRecord> {
    let unknowns = unknowns.into_iter().map(|(name, lower, upper)| Unknown { name, lower, upper });
    let series = series.into_iter().map(|(quantity, times, values, deviations, event)| {
        let event = event.map(|(event, numbers)| SignChanges { event, numbers });
        Series { quantity, times, values, deviations, event }
    });
    let request = MotionFit {
        loss: loss_of(loss)?,
        absolute_deviations,
        nodes,
        starts,
        max_evaluations,
        ..MotionFit::new(motion.motion.clone(), unknowns.collect::<Vec<_>>(), series.collect::<Vec<_>>())
    };
    let found = detached(py, motion, |monitor| motion.system.fit(&request, monitor))?;
    record(py, found)
}

fn record(py: Python<'_>, found: FittedMotion) -> PyResult<FitRecord> {
    let fit = &found.fit;

    let square = |of: &DMatrix<f64>| matrix(py, of.transpose().as_slice().to_vec(), of.ncols());
    let start = &found.motion.start;
    let (rate, is_momentum) = match &start.velocity {
        InitialVelocity::Velocity(v) => (v, false),
        InitialVelocity::Momentum(p) | InitialVelocity::MomentumNear { p, .. } => (p, true),
    };
    let of_series = |series: &FittedSeries| {
        [&series.times, &series.values, &series.fitted, &series.residuals].map(|x| vector(py, x.clone()))
    };
    let StepControl::Steps { steps: Steps::Size(step), .. } = found.motion.step_control else {
        return Err(value_error("the motion was fitted without steps of one length"));
    };
    let errors = fit.standard_errors().into_iter().map(|error| error.unwrap_or(f64::NAN));
    let held = |bound: &Option<HeldAt>| {
        bound.map(|bound| match bound {
            HeldAt::Lower => "lower",
            HeldAt::Upper => "upper",
            HeldAt::Fixed => "fixed",
        })
    };

    Ok(FitRecord {
        parameters: found.parameters,
        start: (start.q.clone(), rate.clone(), is_momentum, start.z),
        status: fit.status.to_string(),
        converged: fit.status.is_converged(),
        table: fit.to_string(),
        names: fit.names.clone(),
        values: fit.parameters.clone(),
        errors: errors.collect(),
        bounds: fit.at_bounds.iter().map(held).collect(),
        covariance: fit.covariance().as_ref().map(square).transpose()?,
        correlation: fit.correlation().as_ref().map(square).transpose()?,
        jacobian: square(&fit.jacobian)?,
        cost: fit.cost,
        residual_variance: fit.residual_variance,
        degrees_of_freedom: fit.degrees_of_freedom,
        rank: fit.rank,
        iterations: fit.iterations,
        evaluations: fit.evaluations,
        series: found.series.iter().map(of_series).collect(),
        costs: found.starts.iter().map(|start| start.as_ref().map_or(f64::NAN, |fit| fit.cost)).collect(),
        best_start: found.best_start,
        largest_defect: found.largest_defect,
        step,
    })
}
