//! Bad input, found before the first step.

use discrete_herglotz::InputError;
use thiserror::Error;

/// Bad input to an assembled system or to an integrator of one, found before the first step.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum AssemblyError {
    /// A system has no unknowns, or more than indices can count.
    #[error("a system of {found} unknowns; it must have from 1 to {most}")]
    Unknowns {
        /// The number that was asked for.
        found: usize,
        /// The most that are possible.
        most: usize,
    },
    /// An element names an unknown that there is none of.
    #[error(
        "element {element} of list {list} has the unknown {unknown}; the system has the unknowns 0 to {last} (and FIXED)"
    )]
    OutOfRange {
        /// The list of elements, counted from 0 in the order in which they were added.
        list: usize,
        /// The element in the list.
        element: usize,
        /// The unknown that was named.
        unknown: usize,
        /// The last unknown of the system.
        last: usize,
    },
    /// An element names an unknown twice.
    #[error("element {element} of list {list} has the unknown {unknown} twice; an element's unknowns must differ")]
    Repeated {
        /// The list of elements.
        list: usize,
        /// The element in the list.
        element: usize,
        /// The unknown that was named twice.
        unknown: usize,
    },
    /// A parameter of an element is not finite.
    #[error("element {element} of list {list} has a parameter {value}; parameters must be finite")]
    Parameter {
        /// The list of elements.
        list: usize,
        /// The element in the list.
        element: usize,
        /// The parameter.
        value: f64,
    },
    /// An unknown has no mass, or one that is no mass.
    #[error("the unknown {unknown} has the mass {mass}; the method needs a positive finite mass of each unknown")]
    Mass {
        /// The first such unknown.
        unknown: usize,
        /// Its mass.
        mass: f64,
    },
    /// A vector is not as long as the system is large.
    #[error("{what} has {found} components; the system has {expected} unknowns")]
    Length {
        /// The vector.
        what: &'static str,
        /// The number of its components.
        found: usize,
        /// The number of unknowns.
        expected: usize,
    },
    /// A number is infinite or not a number.
    #[error("component {index} of {what} is {value}; it must be finite")]
    NonFinite {
        /// The vector or number.
        what: &'static str,
        /// The component, 0 for a number.
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
    /// A method for separable systems is asked of one with general local terms.
    #[error(
        "the system has general local terms; splittings and `AssembledMidpoint` take potentials only: use `AssembledGauss`"
    )]
    NotSeparable,
    /// What needs the action is asked of a state without it.
    #[error(
        "the Lagrangian depends on the action z, which the state does not have; start the motion with one, as `z: Some(0.0)`"
    )]
    NoAction,
    /// The matrix `L_vv` is singular at the start.
    #[error("the matrix L_vv is singular at the start: the Lagrangian is not regular; give each unknown a mass")]
    SingularMass,
    /// The factors of the step's matrix need more memory than the limit.
    #[error(
        "the factors of the step's matrix need {needed} bytes, and the limit is {limit}; raise it if it was set, or take an explicit method"
    )]
    Memory {
        /// The estimate from the symbolic analysis.
        needed: usize,
        /// The limit that was set, or the memory that is available.
        limit: usize,
    },
    /// A catalogue system has bad dimensions or parameters.
    #[error("{what} = {value}; {remedy}")]
    Parameters {
        /// The parameter.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What would be accepted.
        remedy: &'static str,
    },
    /// What the integrators of small systems refuse as well.
    #[error(transparent)]
    Input(#[from] InputError),
}
