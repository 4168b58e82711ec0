//! Tables: functions of one number that are given by samples.

use crate::arrays::{numbers, value_error, vector, word};
use crate::symbol::{Symbol, tracer};
use contact_geom::table::{Interpolation, Table as Samples};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyInt, PyType};

/// A table.
#[pyclass(frozen, eq, hash, module = "herglotz")]
#[derive(Clone, PartialEq)]
pub struct Table {
    pub inner: Samples,
    /// The name in the texts of traced functions, which depends on the samples alone.
    #[pyo3(get)]
    name: String,
}

/// Tables have the same name if they have the same samples.
impl std::hash::Hash for Table {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.name.hash(state);
    }
}

/// The class and the arguments from which pickle restores a table.
type Reduced<'py> = (Bound<'py, PyType>, (Vec<f64>, Vec<f64>, &'static str));

impl From<Samples> for Table {
    fn from(inner: Samples) -> Self {
        let name = name_of(&inner);
        Table { inner, name }
    }
}

/// The values at the knots, where the pieces of a table begin.
fn values(table: &Samples) -> Vec<f64> {
    table.knots().iter().map(|t| table.value(*t)).collect()
}

fn pieces_of(table: &Samples) -> &'static str {
    match table.interpolation() {
        Interpolation::Held => "held",
        Interpolation::Cubic => "cubic",
        _ => "linear",
    }
}

/// A name from a hash of the samples (64-bit FNV-1a).
pub fn name_of(table: &Samples) -> String {
    const START: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0100_0000_01b3;
    let kind = pieces_of(table).bytes();
    let samples = table.knots().iter().copied().chain(values(table));
    let bytes = kind.chain(samples.flat_map(|x| x.to_bits().to_le_bytes()));
    let hash = bytes.fold(START, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME));
    format!("table_{hash:016x}")
}

#[pymethods]
impl Table {
    #[new]
    #[pyo3(signature = (t, y, pieces = None))]
    fn new(t: &Bound<'_, PyAny>, y: &Bound<'_, PyAny>, pieces: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let pieces = pieces.map_or(Ok("linear".to_owned()), |pieces| word("pieces", pieces, "\"linear\""))?;
        let interpolation = match pieces.as_str() {
            "held" => Interpolation::Held,
            "linear" => Interpolation::Linear,
            "cubic" => Interpolation::Cubic,
            _ => {
                return Err(value_error(format!(
                    "`pieces` is {pieces:?}; it must be \"linear\", \"held\" or \"cubic\""
                )));
            }
        };
        Ok(Samples::new(&numbers("t", t)?, &numbers("y", y)?, interpolation).map_err(value_error)?.into())
    }

    /// The times of the samples.
    #[getter]
    fn t(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        vector(py, self.inner.knots().to_vec())
    }

    /// The values of the samples.
    #[getter]
    fn y(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        vector(py, values(&self.inner))
    }

    /// How the table continues between its samples.
    #[getter]
    fn pieces(&self) -> &'static str {
        pieces_of(&self.inner)
    }

    /// The value at a traced value, at a number, or at the numbers of an array.
    fn __call__<'py>(slf: &Bound<'py, Self>, t: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (table, py) = (&slf.get().inner, slf.py());
        if let Ok(symbol) = t.cast::<Symbol>() {
            let symbol = symbol.get();
            let found = symbol.with(|graph| graph.interpolate(table, symbol.id))?;
            return Ok(Bound::new(py, found)?.into_any());
        }
        if t.is_instance_of::<PyFloat>() || t.is_exact_instance_of::<PyInt>() {
            return Ok(PyFloat::new(py, table.value(t.extract()?)).into_any());
        }
        tracer(py, "tabulated")?.call1((slf, t))
    }

    /// The values at the numbers of an array with one dimension.
    fn values_at(&self, py: Python<'_>, t: Vec<f64>) -> Py<PyArray1<f64>> {
        vector(py, t.into_iter().map(|t| self.inner.value(t)).collect())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let table = &slf.get().inner;
        (slf.get_type(), (table.knots().to_vec(), values(table), pieces_of(table)))
    }

    fn __repr__(&self) -> String {
        let knots = self.inner.knots();
        let [first, last] = [knots.first(), knots.last()].map(|t| t.copied().unwrap_or(f64::NAN));
        format!("<Table: {} samples from t = {first} to {last}, {}>", knots.len(), self.pieces())
    }
}
