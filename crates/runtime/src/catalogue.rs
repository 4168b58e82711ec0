//! Named systems, given as formulas.

use crate::RuntimeError;
use formula_lagrangian::{Formula, nearest_name};

/// A named system: a formula with values of its parameters, and an initial state with a typical motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CatalogueEntry {
    /// The name, in lower case with underscores.
    pub name: &'static str,
    /// A short description.
    pub about: &'static str,
    /// The coordinates.
    pub coordinates: &'static [&'static str],
    /// The Lagrangian.
    pub lagrangian: &'static str,
    /// The parameters with their values.
    pub parameters: &'static [(&'static str, f64)],
    /// The time of the start.
    pub t: f64,
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
        t: 0.0,
        q: &[0.0],
        v: &[1.0],
    },
    CatalogueEntry {
        name: "uniform_field",
        about: "a body thrown in the plane, under gravity and linear drag",
        coordinates: &["x", "y"],
        lagrangian: "(x'^2 + y'^2)/2 - g*y + gamma*z",
        parameters: &[("g", 1.0), ("gamma", -0.1)],
        t: 0.0,
        q: &[0.0, 0.0],
        v: &[1.0, 2.0],
    },
    CatalogueEntry {
        name: "harmonic_oscillator",
        about: "an oscillator under linear drag",
        coordinates: &["x"],
        lagrangian: "(x'^2 - x^2)/2 + gamma*z",
        parameters: &[("gamma", -0.1)],
        t: 0.0,
        q: &[1.0],
        v: &[0.0],
    },
    CatalogueEntry {
        name: "pendulum",
        about: "a pendulum under linear drag",
        coordinates: &["theta"],
        lagrangian: "theta'^2/2 - versine(theta) + gamma*z",
        parameters: &[("gamma", -0.1)],
        t: 0.0,
        q: &[1.0],
        v: &[0.0],
    },
    CatalogueEntry {
        name: "duffing",
        about: "Duffing's oscillator with two wells, driven in time, under linear drag",
        coordinates: &["x"],
        lagrangian: "x'^2/2 - alpha*x^2/2 - beta*x^4/4 + force*cos(omega*t)*x + gamma*z",
        parameters: &[("alpha", -1.0), ("beta", 1.0), ("force", 0.3), ("omega", 1.2), ("gamma", -0.3)],
        t: 0.0,
        q: &[1.0],
        v: &[0.0],
    },
    CatalogueEntry {
        name: "quadratic_in_z",
        about: "an oscillator whose drag is proportional to the action",
        coordinates: &["x"],
        lagrangian: "(x'^2 - x^2 - c*z^2)/2",
        parameters: &[("c", 0.1)],
        t: 0.0,
        q: &[1.0],
        v: &[0.0],
    },
    CatalogueEntry {
        name: "coupled_in_z",
        about: "a pendulum whose inertia depends on angle, velocity and action",
        coordinates: &["theta"],
        lagrangian: "theta'^2*((1 + a*cos(theta)*cos(z))/2 + b*theta'^2/4) - versine(theta) + gamma*z",
        parameters: &[("a", 0.5), ("b", 0.1), ("gamma", -0.1)],
        t: 0.0,
        q: &[1.0],
        v: &[0.0],
    },
    CatalogueEntry {
        name: "relativistic",
        about: "a relativistic oscillator under linear drag; the speed of light is 1",
        coordinates: &["x"],
        lagrangian: "gamma*z - x^2/2 - sqrt((1 - x')*(1 + x'))",
        parameters: &[("gamma", -0.1)],
        t: 0.0,
        q: &[1.0],
        v: &[0.0],
    },
    CatalogueEntry {
        name: "lane_emden",
        about: "the Lane-Emden equation of a polytrope of index 5, whose solution is 1/sqrt(1 + t^2/3); t is the distance from the centre, and not 0",
        coordinates: &["theta"],
        lagrangian: "theta'^2/2 - theta^6/6 - 2*z/t",
        parameters: &[],
        t: 1.0,
        q: &[0.8660254037844386],
        v: &[-0.21650635094610965],
    },
    CatalogueEntry {
        name: "kepler",
        about: "Kepler's problem in the plane under linear drag",
        coordinates: &["x", "y"],
        lagrangian: "(x'^2 + y'^2)/2 + mu/sqrt(x^2 + y^2) + gamma*z",
        parameters: &[("mu", 1.0), ("gamma", -0.01)],
        t: 0.0,
        q: &[1.0, 0.0],
        v: &[0.0, 1.1],
    },
    CatalogueEntry {
        name: "kepler_in_space",
        about: "Kepler's problem in space under linear drag",
        coordinates: &["x", "y", "w"],
        lagrangian: "(x'^2 + y'^2 + w'^2)/2 + mu/sqrt(x^2 + y^2 + w^2) + gamma*z",
        parameters: &[("mu", 1.0), ("gamma", -0.01)],
        t: 0.0,
        q: &[1.0, 0.0, 0.0],
        v: &[0.0, 1.0, 0.4],
    },
    CatalogueEntry {
        name: "perturbed_kepler",
        about: "Kepler's problem in the plane with a drag that changes its sign in time",
        coordinates: &["x", "y"],
        lagrangian: "(x'^2 + y'^2)/2 + mu/sqrt(x^2 + y^2) + alpha*sin(omega*t)*z",
        parameters: &[("mu", 1.0), ("alpha", 0.01), ("omega", std::f64::consts::PI)],
        t: 0.0,
        q: &[1.0, 0.0],
        v: &[0.0, 1.1],
    },
    CatalogueEntry {
        name: "charged_particle",
        about: "a charged particle in a magnetic field and a harmonic trap, under linear drag",
        coordinates: &["x", "y"],
        lagrangian: "(x'^2 + y'^2)/2 + b*(x*y' - y*x')/2 - k*(x^2 + y^2)/2 + gamma*z",
        parameters: &[("b", 1.0), ("k", 0.5), ("gamma", -0.1)],
        t: 0.0,
        q: &[1.0, 0.0],
        v: &[0.0, 0.5],
    },
    CatalogueEntry {
        name: "double_pendulum",
        about: "a double pendulum under linear drag",
        coordinates: &["alpha", "beta"],
        lagrangian: "(m1 + m2)*l1^2*alpha'^2/2 + m2*l2^2*beta'^2/2 + m2*l1*l2*cos(alpha - beta)*alpha'*beta' \
            - (m1 + m2)*l1*versine(alpha) - m2*l2*versine(beta) + gamma*z",
        parameters: &[("m1", 1.0), ("m2", 1.0), ("l1", 1.0), ("l2", 1.0), ("gamma", -0.1)],
        t: 0.0,
        q: &[1.0, 0.5],
        v: &[0.0, 0.0],
    },
    CatalogueEntry {
        name: "spherical_pendulum",
        about: "a spherical pendulum under linear drag: polar angle and azimuth",
        coordinates: &["theta", "phi"],
        lagrangian: "(theta'^2 + (sin(theta)*phi')^2)/2 - versine(theta) + gamma*z",
        parameters: &[("gamma", -0.1)],
        t: 0.0,
        q: &[1.0, 0.0],
        v: &[0.0, 0.8],
    },
    CatalogueEntry {
        name: "coupled_plane",
        about: "a plane in which z acts on masses and as a magnetic field, and whose drag is nonlinear in z",
        coordinates: &["x", "y"],
        lagrangian: "(x'^2*(1 + a*cos(x)) + y'^2*(1 + a*sin(y)*cos(z)))/2 + b*z*(x*y' - y*x') - x^2/2 - y^2 \
            - x^2*y/3 - c*z^2/2",
        parameters: &[("a", 0.3), ("b", 0.4), ("c", 0.3)],
        t: 0.0,
        q: &[0.5, 0.2],
        v: &[0.0, 0.3],
    },
    CatalogueEntry {
        name: "chain",
        about: "a chain of six masses between walls, by Fermi, Pasta, Ulam and Tsingou, under linear drag",
        coordinates: &["q[6]"],
        lagrangian: "sum(i, 0, n-1, v[i]^2)/2 - q[0]^2*(1/2 + beta*q[0]^2/4) - q[n-1]^2*(1/2 + beta*q[n-1]^2/4) \
            - sum(i, 1, n-1, (q[i] - q[i-1])^2*(1/2 + beta*(q[i] - q[i-1])^2/4)) + gamma*z",
        parameters: &[("beta", 0.5), ("gamma", -0.1)],
        t: 0.0,
        q: &[0.4, 0.8, 1.0, 1.0, 0.8, 0.4],
        v: &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    },
];

impl CatalogueEntry {
    /// The entry with this name.
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
