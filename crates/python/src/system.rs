//! Systems given by a formula.

use crate::arrays::value_error;
use herglotz::runtime::FormulaSymmetry;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};

/// A Lagrangian with all that integrators need.
#[pyclass(frozen, module = "herglotz")]
pub struct System {
    pub inner: herglotz::runtime::System,
    /// The text of the formula.
    #[pyo3(get)]
    lagrangian: String,
    /// The coordinates as they were given, arrays with their length.
    #[pyo3(get)]
    given_coordinates: Vec<String>,
}

/// The class and the arguments from which pickle restores an object.
type Reduced<'py> = (Bound<'py, PyType>, (String, Vec<String>, Bound<'py, PyDict>));

/// String slices of strings.
fn texts(of: &[String]) -> Vec<&str> {
    of.iter().map(String::as_str).collect()
}

/// The values of parameters, by name.
pub fn values(of: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, f64)>> {
    let Some(of) = of else { return Ok(Vec::new()) };
    let pair = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let name: String =
            name.extract().map_err(|_| value_error("a name in `parameters` is not a string: give names as strings"))?;
        let value = crate::arrays::number(&format!("parameters[{name:?}]"), &value)?;
        Ok((name, value))
    };
    of.iter().map(pair).collect()
}

#[pymethods]
impl System {
    #[new]
    #[pyo3(signature = (lagrangian, coordinates, parameters = None))]
    fn new(lagrangian: String, coordinates: Vec<String>, parameters: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let parameters = values(parameters)?;
        let values: Vec<(&str, f64)> = parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let inner =
            herglotz::runtime::System::parse(&lagrangian, &texts(&coordinates), &values).map_err(value_error)?;
        Ok(System { inner, lagrangian, given_coordinates: coordinates })
    }

    /// The names of the coordinates.
    #[getter]
    fn coordinates(&self) -> Vec<String> {
        self.inner.formula().coordinates()
    }

    /// The parameters with their values.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.inner.formula().parameters().try_for_each(|(name, value)| all.set_item(name, value))?;
        Ok(all)
    }

    /// The parameters on which the Lagrangian depends.
    #[getter]
    fn used_parameters(&self) -> Vec<String> {
        self.inner.formula().used_parameters().map(str::to_owned).collect()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        let (this, py) = (slf.get(), slf.py());
        Ok((slf.get_type(), (this.lagrangian.clone(), this.given_coordinates.clone(), this.parameters(py)?)))
    }

    fn __repr__(&self) -> String {
        let parameters = self.inner.formula().parameters().map(|(name, value)| format!("{name:?}: {value:?}"));
        let parameters: Vec<String> = parameters.collect();
        let (l, coordinates) = (&self.lagrangian, &self.given_coordinates);
        format!("System({l:?}, {coordinates:?}, {{{}}})", parameters.join(", "))
    }

    /// The same system with other values of some parameters.
    fn with_parameters(&self, parameters: &Bound<'_, PyDict>) -> PyResult<Self> {
        let parameters = values(Some(parameters))?;
        let values: Vec<(&str, f64)> = parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let inner = self.inner.with_parameters(&values).map_err(value_error)?;
        Ok(System { inner, lagrangian: self.lagrangian.clone(), given_coordinates: self.given_coordinates.clone() })
    }

    /// The number of coordinates.
    #[getter]
    fn dimension(&self) -> usize {
        self.inner.dimension()
    }

    /// The properties that are proved from the formula, by name.
    #[getter]
    fn structure(&self) -> Vec<&'static str> {
        let s = self.inner.structure();
        let all = [
            ("autonomous", s.autonomous),
            ("z_free", s.z_free),
            ("z_affine", s.z_affine),
            ("constant_rate", s.constant_rate),
            ("separable", s.separable),
            ("quadratic", s.quadratic),
            ("constant_mass", s.constant_mass),
            ("smooth", self.inner.is_smooth()),
        ];
        all.into_iter().filter(|(_, holds)| *holds).map(|(name, _)| name).collect()
    }

    /// The recognised symmetries: for a translation the indices of its coordinates, one in each list; for a rotation
    /// the pairs of its coordinates.
    #[getter]
    fn symmetries(&self) -> Vec<Vec<Vec<usize>>> {
        let of = |symmetry: FormulaSymmetry| match symmetry {
            FormulaSymmetry::Translation(moved) => moved.into_iter().map(|i| vec![i]).collect(),
            FormulaSymmetry::Rotation(pairs) => pairs.into_iter().map(|(i, j)| vec![i, j]).collect(),
        };
        self.inner.symmetries().into_iter().map(of).collect()
    }

    /// The Lagrangian as a Rust source file.
    fn to_rust(&self, name: &str) -> PyResult<String> {
        self.inner.to_rust(name).map_err(value_error)
    }
}

/// The names of all coordinates and of their velocities; arrays are expanded.
#[pyfunction]
pub fn velocity_names(coordinates: Vec<String>) -> PyResult<(Vec<String>, Vec<String>)> {
    // The names are expanded by parsing a formula.
    let formula = herglotz::runtime::Formula::parse("0", &texts(&coordinates), &[]).map_err(value_error)?;
    let names = formula.coordinates();
    let velocities = names.iter().map(|name| herglotz::runtime::velocity_name(name)).collect();
    Ok((names, velocities))
}
