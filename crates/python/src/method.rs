//! Discrete Lagrangians of the user as integrators.

use crate::arrays::value_error;
use crate::symbol::{Operand, Symbol};
use crate::system::System;
use formula_lagrangian::{Id, Inputs};
use herglotz_runtime::FormulaMethod;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// A discrete Lagrangian as an integrator.
#[pyclass(frozen, module = "herglotz._core")]
pub struct Method {
    pub inner: FormulaMethod,
    of: Py<System>,
    step: String,
    symmetric: bool,
}

/// The arguments of a method.
type Arguments = (Py<System>, String, String, u32, bool);

#[pymethods]
impl Method {
    /// That of a system whose coordinates are `q0`, whose velocities are `q1`, and whose parameter `step` is h.
    #[new]
    fn new(of: Py<System>, step: String, name: String, order: u32, symmetric: bool) -> PyResult<Self> {
        let inner = FormulaMethod::new(name, order, &of.get().formula, &step).map_err(value_error)?;
        let inner = if symmetric { inner.symmetric() } else { inner };
        Ok(Method { inner, of, step, symmetric })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> (Bound<'py, PyType>, Arguments) {
        let name = self.inner.name().to_owned();
        let given = (self.of.clone_ref(py), self.step.clone(), name, self.inner.order(), self.symmetric);
        (py.get_type::<Method>(), given)
    }
}

/// The Lagrangian of a system at traced values: t, q, v, z and the parameters, of which `beside` is any traced value.
#[pyfunction]
pub fn lagrangian_at(
    system: &System,
    beside: &Symbol,
    t: Bound<'_, PyAny>,
    q: Vec<Bound<'_, PyAny>>,
    v: Vec<Bound<'_, PyAny>>,
    z: Bound<'_, PyAny>,
    parameters: Vec<Bound<'_, PyAny>>,
) -> PyResult<Symbol> {
    let node = |x: &Bound<'_, PyAny>| match beside.operand(x)? {
        Operand::Node(id) => Ok(id),
        Operand::Other => Err(value_error(format!("L is called with {x}, which is no number; give t, q, v, z"))),
    };
    let nodes = |all: &[Bound<'_, PyAny>]| all.iter().map(node).collect::<PyResult<Vec<Id>>>();
    let (q, v, parameters) = (nodes(&q)?, nodes(&v)?, nodes(&parameters)?);
    let expected = system.formula.dimension();
    for (what, found) in [("q", q.len()), ("v", v.len())] {
        if found != expected {
            return Err(value_error(format!(
                "L is called with {found} numbers as {what}, but the system has {expected} coordinates"
            )));
        }
    }
    let inputs = Inputs { t: node(&t)?, q: &q, v: &v, z: node(&z)?, parameters: &parameters };
    let mut found = None;
    let symbol = beside.with(|graph| {
        found = graph.composed(&system.formula, inputs);
        found.unwrap_or(beside.id)
    })?;
    match found {
        Some(_) => Ok(symbol),
        None => Err(value_error("a method of your own takes no system with tables; write the samples as a formula")),
    }
}
