//! The variables with respect to which a run is differentiated.

use crate::sensitivity::SensitivityError;
use crate::sensitivity::columns::Column;
use crate::sensitivity::parametric_system::{Differentiable, DifferentiableProblem, Quantity};
use crate::system::products::{times, transposed_times};
use crate::{SecondDerivatives, SystemProblem, Vector};
use std::fmt::{Display, Formatter};

/// A variable on which a run depends.
///
/// The start is that of the [`Problem`](crate::Problem) as it was given: by a velocity, `(q, v, z)`, or by a momentum,
/// `(q, p, z)`; derivatives with respect to one of these are for fixed others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Variable {
    /// A coordinate of the start.
    Position(usize),
    /// A velocity of the start, for a start that was given by its velocity.
    Velocity(usize),
    /// A momentum of the start, for a start that was given by its momentum.
    Momentum(usize),
    /// The action at the start.
    Action,
    /// A parameter of the Lagrangian or of the force.
    Parameter(String),
    /// The time of the start, for a fixed end time and a fixed number of steps.
    StartTime,
    /// The time of the end, for a fixed number of steps.
    EndTime,
}

impl Display for Variable {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            Variable::Position(i) => write!(f, "position {i}"),
            Variable::Velocity(i) => write!(f, "velocity {i}"),
            Variable::Momentum(i) => write!(f, "momentum {i}"),
            Variable::Action => write!(f, "the action"),
            Variable::Parameter(name) => write!(f, "the parameter `{name}`"),
            Variable::StartTime => write!(f, "the time of the start"),
            Variable::EndTime => write!(f, "the time of the end"),
        }
    }
}

impl Variable {
    /// All variables of a problem: the start in the order q, v or p, z; the parameters; the times.
    pub fn all<'p>(problem: &'p impl DifferentiableProblem<'p>) -> Vec<Variable> {
        let problem = problem.differentiable();
        let n = problem.dimension();
        let rate = if problem.problem.from_momentum { Variable::Momentum } else { Variable::Velocity };
        let start = (0..n).map(Variable::Position).chain((0..n).map(rate)).chain([Variable::Action]);
        let parameters = problem.of.parameter_names().into_iter().map(Variable::Parameter);
        start.chain(parameters).chain([Variable::StartTime, Variable::EndTime]).collect()
    }

    /// Whether it is a component of the initial state.
    pub(crate) fn is_of_start(&self) -> bool {
        !matches!(self, Variable::Parameter(_) | Variable::StartTime | Variable::EndTime)
    }

    /// The tangent of the start along the variable, for a run of this number of steps.
    pub(crate) fn column(&self, problem: &Differentiable<'_>, steps: usize) -> Result<Column, SensitivityError> {
        let n = problem.dimension();
        let unit = |index: usize| {
            if index < n {
                Ok(Vector::from_fn(n, |i| f64::from(u8::from(i == index))))
            } else {
                Err(SensitivityError::Coordinate { index, count: n })
            }
        };
        let zero = || Vector::zeros(n);
        let SystemProblem { ref system, t0, start: ref x, ref state, from_momentum, .. } = problem.problem;
        // The derivatives of `p = L_v(t, q, v, z; theta)` for a given velocity.
        let with = |q: Vector, v: Vector, z: f64| {
            let SecondDerivatives { qv, vv, vz, .. } = system.hessian(t0, x);
            let p = transposed_times(&qv, &q) + times(&vv, &v) + vz * z;
            Column::new(q, p, z)
        };
        let moved = |quantity: Quantity| {
            if from_momentum {
                return zero();
            }
            problem.stages.quantities().of_momentum(quantity, t0, (x, &state.p))
        };
        let [velocity, momentum] = ["velocity", "momentum"];
        Ok(match self {
            Variable::Position(i) if from_momentum => Column::new(unit(*i)?, zero(), 0.0),
            Variable::Position(i) => with(unit(*i)?, zero(), 0.0),
            Variable::Velocity(_) if from_momentum => {
                return Err(SensitivityError::Start { given: momentum, other: velocity });
            }
            Variable::Velocity(i) => with(zero(), unit(*i)?, 0.0),
            Variable::Momentum(i) if from_momentum => Column::new(zero(), unit(*i)?, 0.0),
            Variable::Momentum(_) => return Err(SensitivityError::Start { given: velocity, other: momentum }),
            Variable::Action if from_momentum => Column::new(zero(), zero(), 1.0),
            Variable::Action => with(zero(), zero(), 1.0),
            Variable::Parameter(name) => {
                let index = problem.of.parameter_index(name)?;
                Column::new(zero(), moved(Quantity::Parameter(index)), 0.0).of_parameter(index)
            }
            Variable::StartTime => {
                Column::new(zero(), moved(Quantity::Time), 0.0).of_times(1.0, -1.0 / steps.max(1) as f64)
            }
            Variable::EndTime => Column::new(zero(), zero(), 0.0).of_times(0.0, 1.0 / steps.max(1) as f64),
        })
    }
}
