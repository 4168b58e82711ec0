//! Errors of a request.

use contact_geom::GeometryError;
use discrete_herglotz::constraints::ConstraintError;
use discrete_herglotz::{
    CheckpointError, InputError, StepError, UnknownIntegrator, ensemble::EnsembleError, sensitivity::SensitivityError,
};
use formula_lagrangian::{Formula, FormulaError};
use sparse_herglotz::SparseError;
use thiserror::Error;

/// Invalid input to a system that is defined at run time.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RuntimeError {
    /// A formula, a column or the function of an event.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// A name that belongs to no integrator.
    #[error(transparent)]
    UnknownIntegrator(#[from] UnknownIntegrator),
    /// The start, the span, the integrator or the steps.
    #[error("{}", in_words(.0))]
    Input(#[from] InputError),
    /// An error that concerns all members of an ensemble, or one of them.
    #[error("{}", of_ensemble(.0))]
    Ensemble(#[from] EnsembleError),
    /// A point at which the geometry is not defined.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A step of a map that is checked could not be taken.
    #[error("a step fails: {0}")]
    Step(#[from] StepError),
    /// An error of a checkpoint.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A thread could not be started.
    #[error("a thread could not be started: {0}; end other programs and try again")]
    Thread(#[from] std::io::Error),
    /// The length of a vector differs from the number of coordinates.
    #[error("`{what}` has {found} numbers, but the system has {expected} coordinates")]
    Length {
        /// Which vector.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of coordinates.
        expected: usize,
    },
    /// A vector or number is not finite.
    #[error("`{what}` is {value}; it must be a finite number")]
    NotFinite {
        /// The name of the vector component or number.
        what: String,
        /// Its value.
        value: f64,
    },
    /// What was requested is not compiled without the feature `full`.
    #[error("{what} are not part of this build; use one with the feature `full` of herglotz-runtime")]
    NotCompiled {
        /// What is left out.
        what: &'static str,
    },
    /// A formula with many coordinates was used where kernels are compiled for few.
    #[error(
        "a formula with more than {most} coordinates has no {what}: it runs by contact Gauss collocation; use a lattice or bodies for sums of local terms"
    )]
    OfFewCoordinates {
        /// What there is none for it.
        what: &'static str,
        /// The number of coordinates up to which there is.
        most: usize,
    },
    /// A force has no finite value at the start.
    #[error("the force on `{coordinate}` is {value} at the start; choose a start or a force where it is finite")]
    ForceUndefined {
        /// The coordinate.
        coordinate: String,
        /// The force.
        value: f64,
    },
    /// L is linear in some velocities, so that it is not regular.
    #[error(
        "the Lagrangian is not regular at the start: it is linear in {velocities}, so that it does not determine the \
         acceleration; add a kinetic term"
    )]
    NotRegular {
        /// The velocities, by name.
        velocities: String,
    },
    /// A Hamiltonian has more coordinates than are compiled.
    #[error(
        "the Hamiltonian has {found} coordinates; it can have from 1 to {most}. Give a Lagrangian, or run a type that \
         implements `ContactHamiltonian` in Rust"
    )]
    HamiltonianDimension {
        /// The number of coordinates.
        found: usize,
        /// The largest number.
        most: usize,
    },
    /// Something that is computed for Lagrangians only was requested of a Hamiltonian.
    #[error("{what} are not computed for a Hamiltonian; give a Lagrangian, or use the library in Rust")]
    OfLagrangians {
        /// What was requested.
        what: &'static str,
    },
    /// A formula with constraints has more coordinates than are compiled.
    #[error(
        "the system has constraints on {found} coordinates; it can have up to {most}. Choose coordinates in which some \
         constraints are solved, or use `Constraint` in Rust"
    )]
    ConstrainedDimension {
        /// The number of coordinates.
        found: usize,
        /// The largest number.
        most: usize,
    },
    /// Something that is not computed under constraints was requested of a formula with constraints.
    #[error(
        "{what} are not computed with constraints; motions, their rows, events, plans, checkpoints, derivatives and fits, \
         and ensembles are. Choose coordinates in which the constraints are solved"
    )]
    WithConstraints {
        /// What was requested.
        what: &'static str,
    },
    /// A constraint that is not satisfied at the start, or follows from the others there.
    #[error("{}", of_constraint(.error, .text))]
    Constraint {
        /// The error, with the index of the constraint.
        error: ConstraintError,
        /// The text of the constraint.
        text: String,
    },
    /// H is not defined at the start.
    #[error("the Hamiltonian or one of its derivatives is not finite at the start; choose a start inside its domain")]
    HamiltonianUndefined,
    /// An event, or a column of one, contains the conformal factor, and the rate `L_z` of the motion is not constant, or
    /// an impact changes the factor.
    #[error(
        "an event or one of its columns contains `sigma` or `log_factor`, which are known within a step only if L_z \
         is constant and no impact is conformal; use them in a column of rows, or use an event of time and state"
    )]
    FactorInEvent,
    /// A parameter is used in no formula.
    #[error("the parameter `{name}` is not used in the Lagrangian, an event or a column: {hint}")]
    UnusedParameter {
        /// The parameter.
        name: String,
        /// The nearest name that is used, or all names that are used.
        hint: String,
    },
    /// A system of many coordinates, or its integrator.
    #[error(transparent)]
    Assembly(#[from] SparseError),
    /// A motion that cannot be differentiated.
    #[error("{}", crate::sensitivity::in_words(.0))]
    Sensitivity(SensitivityError),
    /// The data, the unknowns or the options of a fit, or a motion that cannot be computed.
    #[error(transparent)]
    Fit(#[from] herglotz_fit::FitError),
    /// A name that is not that of a variable with respect to which a motion can be differentiated.
    #[error("there is no variable `{name}`{}", match nearest {
        Some(nearest) => format!("; did you mean `{nearest}`?"),
        None => format!("; the variables are {known}"),
    })]
    UnknownVariable {
        /// The name.
        name: String,
        /// The nearest name of a variable, if it is close enough to be intended.
        nearest: Option<String>,
        /// The names of all variables.
        known: String,
    },
    /// The formula of a part of a system.
    #[error("`{part}`: {error}")]
    Part {
        /// Which part.
        part: &'static str,
        /// The error of the formula.
        error: Box<FormulaError>,
    },
    /// An invalid argument of a system of many coordinates.
    #[error("`{argument}` {why}")]
    Argument {
        /// Its name.
        argument: &'static str,
        /// What is wrong with it, and what is needed.
        why: String,
    },
    /// There is no system of this name in the catalogue.
    #[error("the catalogue has no system {name:?}{}; its systems are {known}", nearest.as_ref().map(|n| format!(" (did you mean {n:?}?)")).unwrap_or_default())]
    UnknownSystem {
        /// The name.
        name: String,
        /// The nearest known one.
        nearest: Option<String>,
        /// All known names.
        known: String,
    },
}

/// Invalid input is the same error as for a run.
impl From<SensitivityError> for RuntimeError {
    fn from(error: SensitivityError) -> Self {
        match error {
            SensitivityError::Input(error) => RuntimeError::Input(error),
            error => RuntimeError::Sensitivity(error),
        }
    }
}

impl RuntimeError {
    /// The error with the text of the constraint that it concerns, if the formula has it.
    pub(crate) fn with_constraint_of(self, formula: &Formula) -> Self {
        let RuntimeError::Input(InputError::Constraint(
            error @ (ConstraintError::OffConstraint { index, .. } | ConstraintError::RankDeficient { index, .. }),
        )) = self
        else {
            return self;
        };
        match formula.constraint_text(index) {
            Some(text) => RuntimeError::Constraint { error, text: format!("{text:?}") },
            None => self,
        }
    }

    /// The error of an invalid argument: its name, and what is wrong with it.
    pub(crate) fn argument(argument: &'static str, why: impl Into<String>) -> Self {
        RuntimeError::Argument { argument, why: why.into() }
    }
}

/// Error message for users who wrote a formula or a function. The structure of such a Lagrangian is proved and cannot
/// be claimed, it has no time transformation, and the message has no Rust names.
pub fn in_words(error: &InputError) -> String {
    match error {
        InputError::Unclaimed { claim } => {
            let claim = match *claim {
                "separable" => {
                    "separable (the sum of a kinetic energy of the velocities and a potential of the positions)"
                }
                "quadratic" => "quadratic (with a linear equation of motion)",
                "z_affine" => "affine in z (with a drag that is proportional to z)",
                "constant_rate" => "of constant rate (with a constant derivative with respect to z)",
                "constant_mass" => "of constant mass (with constant coefficients of the kinetic energy)",
                "autonomous" => "autonomous (independent of t)",
                "z_free" => "independent of z",
                other => other,
            };
            format!("the Lagrangian is not {claim}, which this integrator requires; choose another integrator")
        }
        InputError::NoTimeTransformation => {
            "the integrator requires a time transformation, which is not available for a formula or a function; \
             choose another integrator"
                .to_owned()
        }
        InputError::Hypothesis { hypothesis } => {
            format!("the integrator requires {hypothesis}; choose another integrator")
        }
        InputError::Constraint(
            error @ (ConstraintError::OffConstraint { index, .. } | ConstraintError::RankDeficient { index, .. }),
        ) => of_constraint(error, &index.to_string()),
        InputError::Constraint(ConstraintError::OffVelocity { distance }) => format!(
            "the initial velocity violates the constraints by the velocity {distance:e}; give a velocity that is \
             tangent to them, or request its projection with `project`"
        ),
        InputError::Unsaved => "this integrator does not support checkpoints; choose another integrator".to_owned(),
        InputError::Forced { method } => format!(
            "there is a force that {method} does not take; choose a Gauss method such as \"gauss_4\", or write the force \
             into the Lagrangian"
        ),
        InputError::NoIntegrator => "steps are given without an integrator; give one".to_owned(),
        InputError::NoSteps => "neither steps nor an accuracy is given; give one of them".to_owned(),
        error => error.to_string(),
    }
}

/// The error of a constraint with its text or its index.
fn of_constraint(error: &ConstraintError, constraint: &str) -> String {
    match error {
        ConstraintError::OffConstraint { distance, value, .. } => format!(
            "the start is off the constraints by the distance {distance:e}: constraint {constraint} has the value \
             {value:e}; give a start on the constraints, or request its projection with `project`"
        ),
        ConstraintError::RankDeficient { rank, expected, .. } => format!(
            "the constraints are dependent at the start: {rank} of {expected} are independent, and constraint \
             {constraint} follows from the others there or does not depend on the position; remove it, or start at \
             another position"
        ),
        error => error.to_string(),
    }
}

/// The same for an ensemble.
fn of_ensemble(error: &EnsembleError) -> String {
    match error {
        EnsembleError::Member { index, cause } => format!("member {index}: {}", in_words(cause)),
        error => error.to_string(),
    }
}
