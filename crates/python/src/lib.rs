//! The extension module of the Python package `herglotz`, imported there as `_core`. The Python files of the package
//! check and document its functions.

mod arrays;
mod body;
mod checks;
mod condition;
mod contact;
mod dense;
mod ensemble;
mod events;
mod exact;
mod fit;
mod member_derivatives;
mod method;
mod motion;
mod operators;
mod path;
mod run;
mod sensitivity;
mod signals;
mod sparse;
mod symbol;
mod system;
mod table;
mod text;
mod watch;

use herglotz_runtime::{AnyIntegrator, CATALOGUE};
use pyo3::prelude::*;

/// The extension module.
#[pymodule]
mod _core {
    #[pymodule_export]
    use crate::body::{
        BodyRecord, check_rigid_body, plan_rigid_body, rigid_body_between, rigid_body_expression,
        rigid_body_parameters, rigid_body_sensitivity, run_rigid_bodies, run_rigid_body,
    };
    #[pymodule_export]
    use crate::checks::{check, compare, geometry, hamiltonian_geometry};
    #[pymodule_export]
    use crate::condition::Condition;
    #[pymodule_export]
    use crate::contact::conformality;
    #[pymodule_export]
    use crate::dense::{Dense, nodes};
    #[pymodule_export]
    use crate::ensemble::{EnsembleRecord, run_ensemble};
    #[pymodule_export]
    use crate::events::coordinates_of;
    #[pymodule_export]
    use crate::exact::{exact_lagrangian, exponential, retract};
    #[pymodule_export]
    use crate::fit::{FitRecord, fit_motion};
    #[pymodule_export]
    use crate::member_derivatives::{ensemble_pullback, ensemble_sensitivity, ensemble_value_and_gradient};
    #[pymodule_export]
    use crate::method::{Method, lagrangian_at};
    #[pymodule_export]
    use crate::motion::Motion;
    #[pymodule_export]
    use crate::operators::symbols;
    #[pymodule_export]
    use crate::path::{PathRecord, search_path};
    #[pymodule_export]
    use crate::run::{Record, resume, run};
    #[pymodule_export]
    use crate::sensitivity::{lyapunov_exponents, pullback, sensitivity, value_and_gradient};
    #[pymodule_export]
    use crate::sparse::{bodies_terms, lattice_terms, run_bodies, run_lattice};
    #[pymodule_export]
    use crate::symbol::Symbol;
    #[pymodule_export]
    use crate::system::{System, momentum_names, velocity_names};
    #[pymodule_export]
    use crate::table::Table;
    #[pymodule_export]
    use crate::{catalogue, integrators};
    use pyo3::prelude::*;

    /// Initialises the NumPy C API, as every extension module that creates arrays must.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        numpy::PyArray1::<f64>::zeros(module.py(), 0, false);
        Ok(())
    }
}

/// An entry of the catalogue: name, about, coordinates, Lagrangian, parameters, position and velocity of the start.
type Entry =
    (&'static str, &'static str, Vec<&'static str>, &'static str, Vec<(&'static str, f64)>, Vec<f64>, Vec<f64>);

/// The systems of the catalogue.
#[pyfunction]
fn catalogue() -> Vec<Entry> {
    let entry = |e: &herglotz_runtime::CatalogueEntry| {
        (e.name, e.about, e.coordinates.to_vec(), e.lagrangian, e.parameters.to_vec(), e.q.to_vec(), e.v.to_vec())
    };
    CATALOGUE.iter().map(entry).collect()
}

/// The names of all integrators that apply to formulas, with their orders; those that need a time transformation are
/// excluded.
#[pyfunction]
fn integrators() -> Vec<(String, u32)> {
    let all = AnyIntegrator::all()
        .into_iter()
        .filter(|integrator| !matches!(integrator, AnyIntegrator::TransformedGauss { .. }));
    all.map(|integrator| (integrator.to_string(), integrator.order())).collect()
}
