//! Systems by name, as formulas.

use crate::RuntimeError;
use formula_lagrangian::{Formula, nearest_name};

/// A system with a name: a formula with values of its parameters, and a start from which its motion shows what it is about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CatalogueEntry {
    /// The name, in lower case with underscores.
    pub name: &'static str,
    /// What it is, in a few words.
    pub about: &'static str,
    /// The coordinates.
    pub coordinates: &'static [&'static str],
    /// The Lagrangian.
    pub lagrangian: &'static str,
    /// The parameters with their values.
    pub parameters: &'static [(&'static str, f64)],
    /// The position of the start.
    pub q: &'static [f64],
    /// The velocity of the start.
    pub v: &'static [f64],
}

/// The catalogue.
pub const CATALOGUE: &[CatalogueEntry] = &[
    CatalogueEntry {
        name: "free_particle",
        about: "a particle under linear drag",
        coordinates: &["x"],
        lagrangian: "x'^2/2 + gamma*z",
        parameters: &[("gamma", -0.1)],
        q: &[0.0],
        v: &[1.0],
    },
    CatalogueEntry {
        name: "pendulum",
        about: "a pendulum under linear drag",
        coordinates: &["theta"],
        lagrangian: "theta'^2/2 + cos(theta) + gamma*z",
        parameters: &[("gamma", -0.1)],
        q: &[1.0],
        v: &[0.0],
    },
    CatalogueEntry {
        name: "kepler",
        about: "Kepler's problem in the plane under linear drag",
        coordinates: &["x", "y"],
        lagrangian: "(x'^2 + y'^2)/2 + mu/sqrt(x^2 + y^2) + gamma*z",
        parameters: &[("mu", 1.0), ("gamma", -0.01)],
        q: &[1.0, 0.0],
        v: &[0.0, 1.1],
    },
];

impl CatalogueEntry {
    /// The system of this name.
    ///
    /// # Errors
    /// [`RuntimeError::UnknownSystem`], with the nearest name.
    pub fn find(name: &str) -> Result<&'static CatalogueEntry, RuntimeError> {
        CATALOGUE.iter().find(|entry| entry.name == name).ok_or_else(|| {
            let names = || CATALOGUE.iter().map(|entry| entry.name);
            let nearest = nearest_name(name, names()).map(str::to_owned);
            let known = names().collect::<Vec<_>>().join(", ");
            RuntimeError::UnknownSystem { name: name.to_owned(), nearest, known }
        })
    }

    /// Its formula.
    ///
    /// # Errors
    /// None, for the entries of the [`CATALOGUE`].
    pub fn formula(&self) -> Result<Formula, RuntimeError> {
        Ok(Formula::parse(self.lagrangian, self.coordinates, self.parameters)?)
    }
}
