//! Errors for invalid input, detected before the first step.

use discrete_herglotz::InputError;
use thiserror::Error;

/// Invalid input to a sparse system or to one of its integrators, detected before the first step.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SparseError {
    /// The number of unknowns is 0 or exceeds the range of the indices.
    #[error("the system has {found} unknowns; it must have from 1 to {most}")]
    Unknowns {
        /// The requested number.
        found: usize,
        /// The largest possible number.
        most: usize,
    },
    /// An element refers to an unknown that does not exist.
    #[error(
        "element {element} of list {list} refers to the unknown {unknown}; the unknowns of the system are 0 to \
         {last} (and FIXED)"
    )]
    OutOfRange {
        /// The list of elements, counted from 0 in the order in which they were added.
        list: usize,
        /// The element in the list.
        element: usize,
        /// The unknown that the element refers to.
        unknown: usize,
        /// The last unknown of the system.
        last: usize,
    },
    /// An element contains an unknown twice.
    #[error("element {element} of list {list} has the unknown {unknown} twice; the unknowns of an element must differ")]
    Repeated {
        /// The list of elements.
        list: usize,
        /// The element in the list.
        element: usize,
        /// The repeated unknown.
        unknown: usize,
    },
    /// A parameter of an element is not finite.
    #[error("element {element} of list {list} has the parameter {value}; parameters must be finite")]
    Parameter {
        /// The list of elements.
        list: usize,
        /// The element in the list.
        element: usize,
        /// The parameter.
        value: f64,
    },
    /// The mass of an unknown is missing, or is not positive and finite.
    #[error("the unknown {unknown} has the mass {mass}; the method requires a positive finite mass for each unknown")]
    Mass {
        /// The first such unknown.
        unknown: usize,
        /// Its mass.
        mass: f64,
    },
    /// The length of a vector differs from the number of unknowns.
    #[error("{what} has {found} components; the system has {expected} unknowns")]
    Length {
        /// The name of the vector.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of unknowns.
        expected: usize,
    },
    /// A value is infinite or NaN.
    #[error("component {index} of {what} is {value}; it must be finite")]
    NonFinite {
        /// The name of the vector or number.
        what: &'static str,
        /// The index of the component; 0 for a number.
        index: usize,
        /// The value.
        value: f64,
    },
    /// The force is not finite at the start.
    #[error(
        "the force on the unknown {unknown} is not finite at the start; choose a start inside the domain of the terms"
    )]
    Undefined {
        /// The first such unknown.
        unknown: usize,
    },
    /// A method for separable systems was applied to a system with general local terms.
    #[error(
        "the system has general local terms, but splittings and `SparseMidpoint` accept only potentials; use `SparseGauss`"
    )]
    NotSeparable,
    /// A method for systems without friction was applied to a system with friction.
    #[error(
        "the system has friction, which {method} does not take; use `SparseSplitting`, with a drag gamma z of constant \
         rate"
    )]
    Friction {
        /// The method.
        method: &'static str,
    },
    /// A method for systems without constraints was applied to a system with constraints.
    #[error("the system has constraints, which {method} does not take; use `SparseRattle`")]
    Constrained {
        /// The method.
        method: &'static str,
    },
    /// A method for systems with constraints was applied to a system without them.
    #[error("the system has no constraints; add some by `with_constraint`, or use `SparseSplitting`")]
    Unconstrained,
    /// The start is not on the constraint of an element.
    #[error(
        "element {element} of list {list} is off its constraint by the distance {distance:e}; give a start with \
         c(q) = 0, or request the projection with `OffConstraint::Project`"
    )]
    OffConstraint {
        /// The list of elements.
        list: usize,
        /// The element that is farthest from its constraint.
        element: usize,
        /// Its distance to first order, `|c|/|c_q|`.
        distance: f64,
    },
    /// The initial velocity is not tangent to the constraint of an element.
    #[error(
        "the initial velocity of element {element} of list {list} leaves its constraint at the speed {speed:e}; give a \
         velocity with c_q v = 0, or request the projection with `OffConstraint::Project`"
    )]
    OffVelocity {
        /// The list of elements.
        list: usize,
        /// The element with the largest such speed.
        element: usize,
        /// The speed `|c_q v|/|c_q|`.
        speed: f64,
    },
    /// The projection of the start onto the constraints does not converge.
    #[error("the start could not be projected onto the constraints; give a start nearer to c(q) = 0")]
    NotProjected,
    /// The constraint of an element follows from others at the start.
    #[error(
        "the constraint of element {element} of list {list} depends on others at the start; remove constraints that \
         follow from others, or start at another position"
    )]
    Dependent {
        /// The list of elements.
        list: usize,
        /// An element with a dependent constraint.
        element: usize,
    },
    /// A constraint or its derivative is not finite at the start.
    #[error(
        "the constraint of element {element} of list {list} is not finite at the start; choose a start inside the \
         domain of the constraints"
    )]
    UndefinedConstraint {
        /// The list of elements.
        list: usize,
        /// The first such element.
        element: usize,
    },
    /// An operation needs the action, which the state does not have.
    #[error("the Lagrangian depends on the action z, which the initial state lacks; give it, as in `z: Some(0.0)`")]
    NoAction,
    /// The matrix `L_vv` is singular at the start.
    #[error("the matrix L_vv is singular at the start: the Lagrangian is not regular; give each unknown a mass")]
    SingularMass,
    /// The factors of the step's matrix need more memory than the limit.
    #[error(
        "the factors of the matrix of a step need {needed} bytes, but the limit is {limit}; raise the limit if it \
         was set, or use an explicit method"
    )]
    Memory {
        /// The estimate from the symbolic analysis.
        needed: usize,
        /// The limit that was set, or the memory that is available.
        limit: usize,
    },
    /// A system of the catalogue has invalid dimensions or parameters.
    #[error("{what} = {value}; {remedy}")]
    Parameters {
        /// The parameter.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The accepted values.
        remedy: &'static str,
    },
    /// Input that the integrators of small systems reject as well.
    #[error(transparent)]
    Input(#[from] InputError),
}
