//! Systems given by a formula.

use crate::arrays::{of_formula, value_error};
use crate::table::Table;
use contact_geom::table::Table as Samples;
use formula_lagrangian::Friction;
use herglotz_runtime::{Formula, FormulaError, FormulaNames, FormulaSymmetry};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};

/// A Lagrangian, or a contact Hamiltonian, with all that integrators need.
#[pyclass(frozen, module = "herglotz")]
pub struct System {
    pub inner: herglotz_runtime::System,
    /// The formula before it is differentiated, to which resets are added.
    pub formula: Formula,
    additions: Additions,
    kind: Kind,
    /// The text of the formula.
    #[pyo3(get)]
    lagrangian: String,
    /// The coordinates as they were given, arrays with their length.
    #[pyo3(get)]
    given_coordinates: Vec<String>,
}

/// What a system has in addition to its Lagrangian.
#[derive(Clone)]
struct Additions {
    /// The tables with their names in texts.
    tables: Vec<(String, Samples)>,
    /// The forces, by coordinate.
    forces: Vec<(String, String)>,
    /// The terms of Rayleigh's function.
    rayleigh: Vec<String>,
    /// The times of jumps that are named by the user.
    breaks: Vec<f64>,
    /// The holonomic constraints.
    constraints: Vec<String>,
    /// The friction on coordinates: its size while they slide, the largest one while they stick, and the velocity of the
    /// surface.
    friction: Vec<GivenFriction>,
}

/// A coordinate with its friction.
type GivenFriction = (String, String, Option<String>, Option<String>);

/// Whether the formula is a Hamiltonian, the names of its momenta as they were given, and the name of the action.
#[derive(Clone)]
struct Kind {
    hamiltonian: bool,
    momenta: Vec<String>,
    action: String,
}

impl Kind {
    fn formula(&self, text: &str, names: FormulaNames<'_>) -> Result<Formula, FormulaError> {
        let momenta = texts(&self.momenta);
        let names = FormulaNames { momenta: &momenta, action: &self.action, ..names };
        if self.hamiltonian {
            Formula::parse_hamiltonian(text, &names)
        } else {
            Formula::parse_lagrangian(text, &names)
        }
    }
}

impl Additions {
    fn named_tables(&self) -> Vec<(String, Table)> {
        self.tables.iter().map(|(name, table)| (name.clone(), Table::from(table.clone()))).collect()
    }

    /// The formula of a text with them.
    fn formula(&self, kind: &Kind, text: &str, coordinates: &[&str], parameters: &[(&str, f64)]) -> PyResult<Formula> {
        let tables: Vec<(&str, Samples)> =
            self.tables.iter().map(|(name, table)| (name.as_str(), table.clone())).collect();
        let names = FormulaNames { tables: &tables, ..FormulaNames::new(coordinates, parameters) };
        let mut formula = kind.formula(text, names).map_err(|error| value_error(of_formula(error)))?;
        for (coordinate, text) in &self.forces {
            let with = formula.with_force(coordinate, text);
            formula =
                with.map_err(|error| value_error(format!("the force on {coordinate:?}: {}", of_formula(error))))?;
        }
        for text in &self.rayleigh {
            formula = formula
                .with_rayleigh(text)
                .map_err(|error| value_error(format!("`rayleigh`: {}", of_formula(error))))?;
        }
        for text in &self.constraints {
            let with = formula.with_constraints(&[text.as_str()]);
            formula = with.map_err(|error| value_error(format!("the constraint {text:?}: {}", of_formula(error))))?;
        }
        for (coordinate, sliding, sticking, surface) in &self.friction {
            let friction = Friction { sliding, sticking: sticking.as_deref(), surface: surface.as_deref() };
            let with = formula.with_friction(coordinate, friction);
            formula =
                with.map_err(|error| value_error(format!("the friction on {coordinate:?}: {}", of_formula(error))))?;
        }
        formula.with_breaks(&self.breaks).map_err(value_error)
    }
}

/// The class and the arguments from which pickle restores an object.
type Reduced<'py> = (Bound<'py, PyType>, Arguments<'py>);

/// The arguments of a system.
type Arguments<'py> = (
    String,
    Vec<String>,
    Bound<'py, PyDict>,
    Vec<(String, Table)>,
    Vec<(String, String)>,
    Vec<String>,
    Vec<f64>,
    Vec<String>,
    Vec<GivenFriction>,
    GivenKind,
);

/// Whether the text is a Hamiltonian, the names of the momenta, and that of the action.
type GivenKind = (bool, Vec<String>, String);

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
    #[pyo3(signature = (lagrangian, coordinates, parameters = None, tables = Vec::new(), forces = Vec::new(),
                        rayleigh = Vec::new(), breaks = Vec::new(), constraints = Vec::new(),
                        friction = Vec::new(), kind = None))]
    #[expect(clippy::too_many_arguments, reason = "they are those of `system`, which names them")]
    fn new(
        lagrangian: String,
        coordinates: Vec<String>,
        parameters: Option<&Bound<'_, PyDict>>,
        tables: Vec<(String, Bound<'_, Table>)>,
        forces: Vec<(String, String)>,
        rayleigh: Vec<String>,
        breaks: Vec<f64>,
        constraints: Vec<String>,
        friction: Vec<GivenFriction>,
        kind: Option<GivenKind>,
    ) -> PyResult<Self> {
        let (hamiltonian, momenta, action) = kind.unwrap_or_else(|| (false, Vec::new(), "z".to_owned()));
        let kind = Kind { hamiltonian, momenta, action };
        let parameters = values(parameters)?;
        let values: Vec<(&str, f64)> = parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let tables = tables.into_iter().map(|(name, table)| (name, table.get().inner.clone())).collect();
        let additions = Additions { tables, forces, rayleigh, breaks, constraints, friction };
        let formula = additions.formula(&kind, &lagrangian, &texts(&coordinates), &values)?;
        let inner = herglotz_runtime::System::new(&formula).map_err(value_error)?;
        Ok(System { inner, formula, additions, kind, lagrangian, given_coordinates: coordinates })
    }

    /// The tables with their names in texts.
    #[getter]
    fn tables(&self) -> Vec<(String, Table)> {
        self.additions.named_tables()
    }

    /// The forces with their coordinates; those in the text of the Lagrangian are not among them.
    #[getter]
    fn forces(&self) -> Vec<(String, String)> {
        self.additions.forces.clone()
    }

    /// The terms of Rayleigh's function.
    #[getter]
    fn rayleigh(&self) -> Vec<String> {
        self.additions.rayleigh.clone()
    }

    /// The times of jumps that are named by the user.
    #[getter]
    fn breaks(&self) -> Vec<f64> {
        self.additions.breaks.clone()
    }

    /// The holonomic constraints.
    #[getter]
    fn constraints(&self) -> Vec<String> {
        self.additions.constraints.clone()
    }

    /// The friction on coordinates: its size while they slide, the largest one while they stick, and the velocity of the
    /// surface.
    #[getter]
    fn friction(&self) -> Vec<GivenFriction> {
        self.additions.friction.clone()
    }

    /// What contact flows have and the motions of this system lose because of its forces, each with the reason.
    #[getter]
    fn losses(&self) -> Vec<String> {
        self.inner.losses().iter().map(|(what, why)| format!("{what}: {why}")).collect()
    }

    /// Whether it is a Hamiltonian, the names of the momenta as they were given, and that of the action.
    #[getter]
    fn kind(&self) -> GivenKind {
        let Kind { hamiltonian, momenta, action } = self.kind.clone();
        (hamiltonian, momenta, action)
    }

    /// The names of the momenta.
    #[getter]
    fn momenta(&self) -> Vec<String> {
        self.inner.formula().momenta()
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
        let Additions { forces, rayleigh, breaks, constraints, friction, .. } = this.additions.clone();
        let (text, coordinates) = (this.lagrangian.clone(), this.given_coordinates.clone());
        let tables = this.tables();
        let parameters = this.parameters(py)?;
        let arguments =
            (text, coordinates, parameters, tables, forces, rayleigh, breaks, constraints, friction, this.kind());
        Ok((slf.get_type(), arguments))
    }

    fn __repr__(&self) -> String {
        let parameters = self.inner.formula().parameters().map(|(name, value)| format!("{name:?}: {value:?}"));
        let parameters: Vec<String> = parameters.collect();
        let (l, coordinates) = (&self.lagrangian, &self.given_coordinates);
        let Additions { tables, forces, rayleigh, breaks, constraints, friction } = &self.additions;
        let mut text = format!("System({l:?}, {coordinates:?}, {{{}}}", parameters.join(", "));
        if !tables.is_empty() {
            text += &format!(", tables={:?}", tables.iter().map(|(name, _)| name).collect::<Vec<_>>());
        }
        if !forces.is_empty() {
            text += &format!(", forces={forces:?}");
        }
        if !rayleigh.is_empty() {
            text += &format!(", rayleigh={rayleigh:?}");
        }
        if !breaks.is_empty() {
            text += &format!(", breaks={breaks:?}");
        }
        if !constraints.is_empty() {
            text += &format!(", constraints={constraints:?}");
        }
        if !friction.is_empty() {
            text += &format!(", friction={friction:?}");
        }
        if self.kind.hamiltonian || self.kind.action != "z" {
            text += &format!(", kind={:?}", self.kind());
        }
        text + ")"
    }

    /// The same system with other values of some parameters.
    fn with_parameters(&self, parameters: &Bound<'_, PyDict>) -> PyResult<Self> {
        let parameters = values(Some(parameters))?;
        let values: Vec<(&str, f64)> = parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let inner = self.inner.with_parameters(&values).map_err(value_error)?;
        let mut formula = self.formula.clone();
        values.iter().try_for_each(|(name, value)| formula.set(name, *value)).map_err(value_error)?;
        let (lagrangian, given_coordinates) = (self.lagrangian.clone(), self.given_coordinates.clone());
        let (additions, kind) = (self.additions.clone(), self.kind.clone());
        Ok(System { inner, formula, additions, kind, lagrangian, given_coordinates })
    }

    /// The number of coordinates.
    #[getter]
    fn dimension(&self) -> usize {
        self.inner.dimension()
    }

    /// The properties that are proved from the formula, by name.
    #[getter]
    fn structure(&self) -> Vec<&'static str> {
        if let Some(s) = self.inner.hamiltonian_structure() {
            let all = [
                ("autonomous", s.autonomous),
                ("z_free", s.z_free),
                ("z_affine", s.z_affine),
                ("constant_rate", s.constant_rate),
                ("separable", s.separable),
                ("polynomial", s.degree.is_some()),
                ("homogeneous", s.homogeneous),
                ("smooth", self.inner.is_smooth()),
            ];
            return all.into_iter().filter(|(_, holds)| *holds).map(|(name, _)| name).collect();
        }
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
            ("forced", !self.inner.losses().is_empty()),
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
}

/// The names of all coordinates and of their velocities; arrays are expanded.
#[pyfunction]
pub fn velocity_names(coordinates: Vec<String>) -> PyResult<(Vec<String>, Vec<String>)> {
    // The names are expanded by parsing a formula.
    let coordinates = texts(&coordinates);
    // The action has a name that no user gives: its clash with a coordinate is found with the system.
    let names = FormulaNames { action: "_action", ..FormulaNames::new(&coordinates, &[]) };
    let formula = Formula::parse_lagrangian("0", &names).map_err(value_error)?;
    let names = formula.coordinates();
    let velocities = names.iter().map(|name| herglotz_runtime::velocity_name(name)).collect();
    Ok((names, velocities))
}

/// The names of all momenta of a Hamiltonian; arrays are expanded.
#[pyfunction]
pub fn momentum_names(coordinates: Vec<String>, momenta: Vec<String>) -> PyResult<Vec<String>> {
    let (coordinates, momenta) = (texts(&coordinates), texts(&momenta));
    // The action has a name that no user gives, so that it does not clash here.
    let names = FormulaNames { momenta: &momenta, action: "_action", ..FormulaNames::new(&coordinates, &[]) };
    Ok(Formula::parse_hamiltonian("0", &names).map_err(value_error)?.momenta())
}
