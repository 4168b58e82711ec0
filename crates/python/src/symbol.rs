//! Values of a traced function: nodes of a graph in place of numbers. Their operators are in `operators`.

use formula_lagrangian::{Graph, Id};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyFloat, PyInt};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The maximal number of nodes of a traced function, above the limit of a formula.
const MAX_NODES: usize = 100_000;

/// The graph of one trace.
#[derive(Clone, Default)]
pub struct Shared(Arc<Mutex<Graph>>);

impl Shared {
    pub fn graph(&self) -> MutexGuard<'_, Graph> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The address of the graph, which is the same for all values of one trace.
    pub fn address(&self) -> *const Mutex<Graph> {
        Arc::as_ptr(&self.0)
    }
}

/// A value of a traced function.
#[pyclass(frozen, module = "herglotz")]
#[derive(Clone)]
pub struct Symbol {
    pub shared: Shared,
    pub id: Id,
}

/// An operand: a node, or an object whose operators Python tries next.
pub enum Operand {
    Node(Id),
    Other,
}

pub fn no_number() -> PyErr {
    PyTypeError::new_err(
        "control flow on a traced value: the function is called once, with symbols in place of numbers, so that `if`, \
         `and`, `while`, `min`, `float`, the functions of `math` and splines of SciPy have no value to work with; use \
         np.where(a < b, x, y) or hz.where, np.minimum, np.maximum and functions of NumPy, and write a spline as \
         pieces with hz.where, np.polyval or np.interp",
    )
}

impl Symbol {
    /// The node of another operand in the same graph.
    pub fn operand(&self, other: &Bound<'_, PyAny>) -> PyResult<Operand> {
        if let Ok(symbol) = other.cast::<Symbol>() {
            let symbol = symbol.get();
            if !Arc::ptr_eq(&symbol.shared.0, &self.shared.0) {
                return Err(PyValueError::new_err(
                    "a traced value was kept from another call: a function must compute all its values from its own \
                     arguments",
                ));
            }
            return Ok(Operand::Node(symbol.id));
        }
        let is_number = other.is_instance_of::<PyFloat>() || other.is_instance_of::<PyInt>() || is_scalar(other);
        if !is_number {
            return Ok(Operand::Other);
        }
        let x: f64 = other.extract()?;
        if !x.is_finite() {
            return Err(PyValueError::new_err(format!(
                "a traced function contains the number {x}, which is not finite: use finite numbers"
            )));
        }
        Ok(Operand::Node(self.shared.graph().number(x)))
    }

    pub fn with(&self, node: impl FnOnce(&mut Graph) -> Id) -> PyResult<Symbol> {
        let mut graph = self.shared.graph();
        let id = node(&mut graph);
        if graph.len() > MAX_NODES {
            return Err(PyValueError::new_err(format!(
                "the traced function has more than {MAX_NODES} operations: write it in Rust, or take a smaller one"
            )));
        }
        Ok(Symbol { shared: self.shared.clone(), id })
    }
}

/// Whether the object is a NumPy scalar, not an array.
fn is_scalar(other: &Bound<'_, PyAny>) -> bool {
    let py = other.py();
    let Ok(dtype) = other.getattr(pyo3::intern!(py, "dtype")) else { return false };
    let dimensions = other.getattr("ndim").and_then(|n| n.extract::<usize>());
    let kind = dtype.getattr("kind").and_then(|kind| kind.extract::<char>());
    dimensions.is_ok_and(|n| n == 0) && kind.is_ok_and(|kind| "fiu".contains(kind))
}

/// A function of the Python module `herglotz._trace`.
pub(crate) fn tracer<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    static TRACE: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let module = TRACE.get_or_try_init(py, || py.import("herglotz._trace").map(|module| module.into_any().unbind()))?;
    module.bind(py).getattr(name)
}
