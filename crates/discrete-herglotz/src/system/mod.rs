//! Mechanical systems as runs, checks and searches see them: values and derivatives in `f64`, behind one interface
//! without the Lagrangian and without the number of coordinates. All that stands above it is compiled once.

pub(crate) mod applied_force;
mod defaults;
mod guarded;
mod kernels;
pub(crate) mod mass_matrix;
mod points;
pub(crate) mod products;
mod quantity;
pub(crate) mod ridders;
mod typed;
mod vector;

pub(crate) use guarded::{Guarded, caught};
pub use kernels::Kernels;
pub use points::{Components, Point, SecondDerivatives, State};

pub use quantity::{ExplicitDerivatives, Quantity};
pub use typed::TypedSystem;
pub use vector::Vector;

use crate::StepError;
use contact_geom::nalgebra::DMatrix;
use contact_geom::switching::BreakRate;
use contact_geom::{Defect, Defects, GeometryError, Hints, Structure};
use std::rc::Rc;

/// The velocity, and L with its derivatives, at a state.
#[derive(Clone, Debug, PartialEq)]
pub struct AtState {
    /// The state with its velocity.
    pub x: Point,
    /// The value of L.
    pub l: f64,
    /// `L_q + f`, with the applied force f.
    pub force: Vector,
    /// `L_z`.
    pub rate: f64,
}

/// What happens where a motion reaches the zero of a switching function; see
/// [`Control`](contact_geom::switching::Control).
#[derive(Clone, Debug, PartialEq)]
pub enum AtSwitch {
    /// The motion continues.
    Continue,
    /// The state is replaced, by a map that is conformally contact if a factor is given.
    Replace {
        /// The state after it.
        to: Point,
        /// The factor by which the contact form is multiplied.
        factor: Option<f64>,
    },
}

/// What is known about an applied force; see [`ForceStructure`](contact_geom::ForceStructure).
#[derive(Clone, Debug, PartialEq)]
pub enum ForceKind {
    /// There is no force.
    None,
    /// A function of time and positions.
    OfPositions,
    /// A function of time and positions, with the drag `-linear_i v_i - quadratic |v| v_i` of the velocity.
    Drag {
        /// The coefficients of the linear drag of each velocity.
        linear: Vector,
        /// The coefficient of the quadratic drag of the velocity.
        quadratic: f64,
    },
    /// Nothing is known.
    General,
}

/// An applied force at a point, with its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceDerivatives {
    /// The force.
    pub value: Vector,
    /// Its derivatives in q: the rows belong to the components of the force.
    pub q: DMatrix<f64>,
    /// Its derivatives in v.
    pub v: DMatrix<f64>,
    /// Its derivatives in z.
    pub z: Vector,
}

/// A mechanical system: its Lagrangian `L(t, q, v, z)` in n coordinates, the derivatives of L at points in `f64`, and its
/// switching functions. Vectors have length n.
///
/// A system of a user's own has the functions without a default: the number of coordinates, the value and its first and
/// second derivatives; see [`SystemProblem`](crate::SystemProblem). Of the others, [`structure`](Self::structure) may claim
/// that W is constant, and [`hints`](Self::hints) may state that the whole structure is proved. An applied force is
/// [`has_force`](Self::has_force) with [`applied_force`](Self::applied_force) and
/// [`force_derivatives`](Self::force_derivatives).
///
/// The kernels of integrators are compiled for each Lagrangian. All else takes a `&dyn System`: the plan and the loop of
/// a run, its checks, the search of the steps for an accuracy, and steps that end on kinks and jumps.
pub trait System {
    /// The number n of coordinates.
    fn dimension(&self) -> usize;

    /// What is known of the Lagrangian at compile time.
    fn hints(&self) -> Hints {
        Hints::NONE
    }

    /// The declared structure of the Lagrangian.
    fn structure(&self) -> Structure {
        Structure::default()
    }

    /// What may be relied on about the applied force.
    fn force_kind(&self) -> ForceKind {
        if self.has_force() { ForceKind::General } else { ForceKind::None }
    }

    /// Whether there is an applied force.
    fn has_force(&self) -> bool {
        false
    }

    /// The value `L(t, q, v, z)`.
    fn value(&self, t: f64, x: &Point) -> f64;

    /// The partial derivatives `(L_q, L_v, L_z)`.
    fn gradient(&self, t: f64, x: &Point) -> Components;

    /// The second partial derivatives in `(q, v, z)`.
    fn hessian(&self, t: f64, x: &Point) -> SecondDerivatives;

    /// The applied force `f(t, q, v, z)`; 0 by default.
    fn applied_force(&self, t: f64, x: &Point) -> Vector {
        let _ = t;
        Vector::zeros(x.q.len())
    }

    /// The applied force with its derivatives; `None`, the default, for a system without a force.
    fn force_derivatives(&self, t: f64, x: &Point) -> Option<ForceDerivatives> {
        let _ = (t, x);
        None
    }

    /// The names of the parameters; by default there are none.
    fn parameter_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Their values, in the order of the names.
    fn parameters(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The same system with other values of the parameters; `None` where there is none, and by default.
    fn with_parameters(&self, theta: &[f64]) -> Option<Rc<dyn System>> {
        let _ = theta;
        None
    }

    /// The derivatives with respect to a quantity, at a fixed point. By default they are found by differences, to about ten
    /// digits, those in parameters from [`with_parameters`](Self::with_parameters).
    fn in_quantity(&self, of: Quantity, t: f64, x: &Point) -> ExplicitDerivatives {
        defaults::in_quantity(self, of, t, x)
    }

    /// Kernels of collocation, which evaluate the system at several stages at once in SIMD registers;
    /// [`Kernels::of`](crate::Kernels::of) makes them for a system that is written over scalars. `None`, the default:
    /// the system is evaluated at one stage after another.
    fn kernels(&self) -> Option<Kernels> {
        None
    }

    /// `W = L_vv` alone.
    fn mass_matrix(&self, t: f64, x: &Point) -> DMatrix<f64> {
        self.hessian(t, x).vv
    }

    /// The Herglotz vector field `(v, a, L)` with the rate `L_z` of the conformal factor.
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where `W = L_vv` is singular; [`GeometryError::Undefined`] for a Lagrangian that is
    /// given by a contact Hamiltonian, whose rates are those of `(q, p, z)`.
    fn rates(&self, t: f64, x: &Point) -> Result<(Components, f64), GeometryError> {
        defaults::rates(self, t, x)
    }

    /// The inverse Legendre transformation of a state, from a guess of the velocity; see
    /// [`legendre_inverse`](crate::theory::legendre_inverse).
    ///
    /// # Errors
    /// Those of the function.
    fn legendre_inverse(&self, t: f64, state: &State, guess: &[f64]) -> Result<Point, StepError> {
        defaults::legendre_inverse(self, t, state, guess)
    }

    /// L and its derivatives at a state. For a Lagrangian that is given by a contact Hamiltonian they are those of the
    /// Hamiltonian, whatever the rank of `H_pp`; for all others the velocity is found from the momentum, starting from a
    /// guess.
    ///
    /// # Errors
    /// Those of [`legendre_inverse`](Self::legendre_inverse).
    fn at_state(&self, t: f64, state: &State, guess: &[f64]) -> Result<AtState, StepError> {
        defaults::at_state(self, t, state, guess)
    }

    /// First-order bounds of the rounding errors of the value and of the gradient; NaN for a Lagrangian that is given by a
    /// contact Hamiltonian.
    fn rounding(&self, t: f64, x: &Point) -> (f64, Components) {
        defaults::rounding(self, t, x)
    }

    /// The same at a state with its velocity, for a Lagrangian that is given by a contact Hamiltonian from the
    /// derivatives of the Hamiltonian.
    fn rounding_at_state(&self, t: f64, x: &Point, state: &State) -> (f64, Components) {
        let _ = state;
        self.rounding(t, x)
    }

    /// The defects at a point of the claims of the [structure](Self::structure); `None` where they cannot be judged, and
    /// where they are proved.
    fn claim_defects(&self, t: f64, x: &Point) -> Option<Defects> {
        defaults::claim_defects(self, t, x)
    }

    /// The defect of the declared structure of the applied force, if it is false at a point.
    fn force_defect(&self, t: f64, x: &Point) -> Option<Defect> {
        let _ = (t, x);
        None
    }

    /// The contact Hamiltonian with its derivatives `(H_q, H_p, H_z)` at a state, where the Lagrangian is given by one.
    fn hamiltonian_with_gradient(&self, t: f64, x: &State) -> Option<(f64, Components)> {
        let _ = (t, x);
        None
    }

    /// The second derivatives of that contact Hamiltonian, with p in the place of v.
    fn hamiltonian_hessian(&self, t: f64, x: &State) -> Option<SecondDerivatives> {
        let _ = (t, x);
        None
    }

    /// The first claim on that contact Hamiltonian that is false at a state.
    fn hamiltonian_defect(&self, t: f64, x: &State) -> Option<Defect> {
        let _ = (t, x);
        None
    }

    /// Appends the values of the switching functions at a point `(q, v, z)`; for a Lagrangian that is given by a contact
    /// Hamiltonian, at a point `(q, p, z)`, with the momentum in the place of the velocity.
    fn switching_functions(&self, t: f64, x: &Point, values: &mut Vec<f64>) {
        let _ = (t, x, values);
    }

    /// What happens at a zero of a switching function.
    fn at_switch(&self, index: usize, t: f64, x: &Point, rising: bool) -> AtSwitch {
        let _ = (index, t, x, rising);
        AtSwitch::Continue
    }

    /// What happens where replacements at the zero of a switching function accumulate.
    fn at_accumulation(&self, index: usize, t: f64, x: &Point) -> AtSwitch {
        let _ = (index, t, x);
        AtSwitch::Continue
    }

    /// The times at which L or the applied force has a kink or a jump in time.
    fn breaks(&self) -> &[f64] {
        &[]
    }

    /// The same times with their derivatives in the parameter with this index. A time at which there are several kinks or
    /// jumps that move differently occurs once for each of their rates. `None`, the default: the derivatives are found by
    /// differences of the times for nearby values of the parameter.
    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>> {
        let _ = parameter;
        None
    }

    /// Whether L or the applied force contains a norm, or another root, that may vanish along the motion, where its
    /// derivative jumps; see [`has_cones`](contact_geom::Lagrangian::has_cones).
    fn has_cones(&self) -> bool {
        false
    }

    /// The rate `dt/dtau` of the time transformation.
    fn dt_dtau(&self, q: &Vector) -> f64 {
        let _ = q;
        1.0
    }
}
