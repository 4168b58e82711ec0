//! Checks: the geometry at a point, whether steps are contact transformations, and comparisons of integrators.

use crate::arrays::{number, numbers, value_error, whole};
use crate::motion::Motion;
use crate::signals::{no_report, with_signals};
use crate::system::System;
use herglotz_runtime::{InitialVelocity, Interrupt, Start};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::Ordering;

/// The contact geometry of a Lagrangian at a time and a point, by name.
#[pyfunction]
pub fn geometry<'py>(
    py: Python<'py>,
    system: &System,
    at: (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>),
) -> PyResult<Bound<'py, PyDict>> {
    let start = Start::new(number("t", &at.0)?, numbers("q", &at.1)?, numbers("v", &at.2)?, number("z", &at.3)?);
    let found = system.inner.geometry(&start).map_err(value_error)?;
    let all = PyDict::new(py);
    all.set_item("lagrangian", found.lagrangian)?;
    all.set_item("momentum", found.momentum)?;
    all.set_item("energy", found.energy)?;
    all.set_item("rate", found.rate)?;
    all.set_item("mass", found.mass)?;
    all.set_item("condition", found.condition)?;
    all.set_item("eta", found.eta)?;
    all.set_item("reeb", found.reeb)?;
    all.set_item("volume", found.volume)?;
    all.set_item("herglotz_field", found.herglotz_field)?;
    Ok(all)
}

/// The contact geometry of a Hamiltonian at a time and a point, by name.
#[pyfunction]
pub fn hamiltonian_geometry<'py>(
    py: Python<'py>,
    system: &System,
    at: (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>),
) -> PyResult<Bound<'py, PyDict>> {
    let velocity = InitialVelocity::Momentum(numbers("p", &at.2)?);
    let start = Start { t: number("t", &at.0)?, q: numbers("q", &at.1)?, velocity, z: number("z", &at.3)? };
    let found = system.inner.hamiltonian_geometry(&start).map_err(value_error)?;
    let all = PyDict::new(py);
    all.set_item("hamiltonian", found.hamiltonian)?;
    all.set_item("velocity", found.velocity)?;
    all.set_item("rate", found.rate)?;
    all.set_item("hessian", found.hessian)?;
    all.set_item("condition", found.condition)?;
    all.set_item("eta", found.eta)?;
    all.set_item("reeb", found.reeb)?;
    all.set_item("field", found.field)?;
    all.set_item("lie_derivative", found.lie_derivative)?;
    all.set_item("brackets", found.brackets)?;
    Ok(all)
}

/// A sample of a check: t, sigma, the logarithm of the conformal factor, the two defects, and the momenta with their
/// predictions.
type Sample = (f64, f64, f64, f64, f64, Vec<(f64, f64)>);

/// A check: the integrator, the step, the samples, the theorems, whether every step is a contact transformation, and the
/// reason why it is not to be expected.
pub type Checked = (String, f64, Vec<Sample>, Vec<(String, String, f64)>, bool, Option<String>);

/// Whether the steps of a motion are contact transformations, and the residuals of the theorems of the discrete theory
/// along it.
#[pyfunction]
pub fn check(py: Python<'_>, motion: &Motion, places: Bound<'_, PyAny>) -> PyResult<Checked> {
    let count = whole("places", &places, 1)?;
    // A check runs on threads of its own, on which Python does not handle signals.
    let (found, raised) = with_signals(py, no_report, |ended| {
        let ended = ended.clone();
        let interrupt = Some(Interrupt::when(move || ended.load(Ordering::Relaxed)));
        let request = herglotz_runtime::Motion { interrupt, ..motion.motion.clone() };
        motion.system.check(&request, count)
    })?;
    if let Some(raised) = raised {
        return Err(raised);
    }
    Ok(checked(found.map_err(value_error)?))
}

/// The numbers of a check.
pub fn checked(found: herglotz_runtime::Check) -> Checked {
    let is_contact = found.is_contact();
    let sample = |sample: herglotz_runtime::Sample| {
        let momenta = sample.momenta.iter().map(|m| (m.momentum, m.predicted)).collect();
        (sample.t, sample.sigma, sample.log_factor, sample.contact_defect, sample.herglotz_defect, momenta)
    };
    let samples = found.samples.into_iter().map(sample).collect();
    let stated = |s: herglotz_runtime::StatementResidual| (s.statement.to_string(), s.method, s.residual);
    let statements = found.statements.into_iter().map(stated).collect();
    let reason = found.not_contact.map(|reason| reason.to_string());
    (found.integrator, found.step_size, samples, statements, is_contact, reason)
}

/// A run of a comparison: integrator, order, step, steps, evaluations, error and seconds.
type Work = (String, u32, f64, usize, u64, f64, f64);

/// A comparison: the runs, how the reference was computed, and the integrators that do not apply with the reason.
type Compared = (Vec<Work>, String, Vec<(String, String)>);

/// Run time against error for all integrators that apply.
#[pyfunction]
pub fn compare(py: Python<'_>, motion: &Motion) -> PyResult<Compared> {
    let mut is_continued = |_: f64| motion.signals.check().is_continue();
    let found = py.detach(|| motion.system.compare(&motion.motion, &[], &mut is_continued));
    if let Some(raised) = motion.signals.take() {
        return Err(raised);
    }
    let found = found.map_err(value_error)?;
    let row =
        |w: herglotz_runtime::Work| (w.integrator, w.order, w.step_size, w.steps, w.evaluations, w.error, w.seconds);
    Ok((found.rows.into_iter().map(row).collect(), found.reference, found.left_out))
}
