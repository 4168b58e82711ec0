//! Motions of a double pendulum as data, and the network's motions as the model of a fit.

use contact_examples::Failure;
use contact_geom::nalgebra::{DMatrix, DVector, SVector};
use contact_geom::systems::DoublePendulum;
use contact_geom::{Derivatives, Parametric, VelocityPoint};
use discrete_herglotz::sensitivity::{EndCovector, EndState, SensitivityError, Tangent, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Status, Steps, Until};
use formula_lagrangian::FormulaLagrangian;
use herglotz_fit::{Fit, FitError, LeastSquares, Model, ModelFailure};
use std::fmt::Display;

/// The pendulum that is measured: `M_11 = 1` where it hangs, as for the network.
pub const TRUTH: DoublePendulum = DoublePendulum { masses: [0.6, 0.4], lengths: [1.0, 0.8], gamma: -0.1 };

/// Steps of the network's motions, whose error is below that of the fit.
pub const STEP: f64 = 0.2;
/// Their number of stages.
pub const STAGES: usize = 4;

/// Steps of the data, exact to round-off.
const TRUE_STEP: f64 = 0.1;
const TRUE_STAGES: usize = 8;

/// What is measured, and how long it is fitted.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// The number of motions.
    pub motions: usize,
    /// The number of times at which their angles are measured.
    pub times: usize,
    /// The largest number of evaluations of the motions.
    pub evaluations: usize,
}

/// The time between two measurements: a step, so that none has to be shortened.
pub const INTERVAL: f64 = STEP;

/// The times from one interval to the end.
pub fn times(count: usize) -> Vec<f64> {
    (1..=count).map(|k| INTERVAL * k as f64).collect()
}

/// The states of the pendulum at times.
pub fn true_states(start: VelocityPoint<2>, times: &[f64]) -> Result<Vec<EndState<2>>, Failure> {
    completed("the double pendulum", states(&TRUTH, start, times, &[], (TRUE_STAGES, TRUE_STEP))?)
}

/// The states of a motion at times, with their derivatives in variables.
fn states<L: Parametric<2>>(
    lagrangian: &L,
    start: VelocityPoint<2>,
    times: &[f64],
    variables: &[Variable],
    (stages, step): (usize, f64),
) -> Result<Tangent<2>, SensitivityError> {
    let problem = Problem::new(lagrangian, 0.0, start)?;
    let end = Until::Time(times.last().copied().unwrap_or(0.0));
    problem.by(GaussCollocation { stages }).steps(Steps::Size(step)).tangent_at(variables, times, end)
}

/// The states of the network's motion at times.
pub fn network_states(
    network: &FormulaLagrangian<2>,
    start: VelocityPoint<2>,
    times: &[f64],
) -> Result<Vec<EndState<2>>, Failure> {
    completed("the network", states(network, start, times, &[], (STAGES, STEP))?)
}

/// The states of a run that has reached its end.
fn completed(what: &'static str, tangent: Tangent<2>) -> Result<Vec<EndState<2>>, Failure> {
    match tangent.outcome.status {
        Status::Completed => Ok(tangent.rows.into_iter().map(|row| row.state).collect()),
        status => Err(Failure::Run { what, status }),
    }
}

/// Measured motions, and the network that is to have them.
pub struct Training {
    network: FormulaLagrangian<2>,
    weights: Vec<Variable>,
    starts: Vec<VelocityPoint<2>>,
    times: Vec<f64>,
    /// The angles of all motions, at all times.
    data: Vec<f64>,
    evaluations: usize,
}

impl Training {
    /// Measures motions of the pendulum.
    pub fn new(network: FormulaLagrangian<2>, stage: Stage) -> Result<Self, Failure> {
        let mut spread = super::network::spread();
        let mut next = |size: f64| size * spread.next().unwrap_or(0.0);
        let mut start = |_| VelocityPoint::new([next(1.2), next(1.5)], [next(1.0), next(1.0)], 0.0);
        let starts: Vec<VelocityPoint<2>> = (0..stage.motions).map(&mut start).collect();
        let times = times(stage.times);
        let mut data = Vec::new();
        for start in &starts {
            data.extend(true_states(*start, &times)?.iter().flat_map(|state| [state.q[0], state.q[1]]));
        }
        let weights = network.parameter_names().into_iter().map(Variable::Parameter).collect();
        Ok(Training { network, weights, starts, times, data, evaluations: stage.evaluations })
    }

    /// The network with other weights.
    pub fn network_with(&self, theta: &[f64]) -> Result<FormulaLagrangian<2>, Failure> {
        let found = theta.len();
        let expected = self.weights.len();
        let wrong = || FitError::Count { what: "weights", found, expected };
        Ok(self.network.with_parameters(theta).ok_or_else(wrong)?)
    }

    /// The duration of a motion.
    pub fn duration(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// Fits the weights to the angles, from those that the network has.
    pub fn fit(&self) -> Result<Fit, Failure> {
        // Longer first steps lead to motions far from the data.
        let fit = LeastSquares::new(self, &self.data)?.max_evaluations(self.evaluations).step_bound(1.0)?;
        Ok(fit.solve(&self.network.parameters())?)
    }

    /// The loss with the present weights, half the sum of the squares of the residuals, and its gradient in them, by the
    /// adjoint.
    pub fn loss(&self) -> Result<(f64, Vec<f64>), Failure> {
        let (mut sum, mut gradient) = (0.0, vec![0.0; self.weights.len()]);
        let angles_of_motion = 2 * self.times.len();
        for (start, measured) in self.starts.iter().zip(self.data.chunks(angles_of_motion)) {
            let problem = Problem::new(&self.network, 0.0, *start)?;
            let run = problem.by(GaussCollocation { stages: STAGES }).steps(Steps::Size(STEP));
            let loss = |states: &[EndState<2>]| {
                let residuals: Vec<SVector<f64, 2>> = states
                    .iter()
                    .zip(measured.chunks(2))
                    .map(|(state, angles)| SVector::from_fn(|i, _| state.q[i] - angles[i]))
                    .collect();
                let covectors = residuals.iter().map(|r| EndCovector { q: *r, ..EndCovector::zero() });
                (0.5 * residuals.iter().map(SVector::norm_squared).sum::<f64>(), covectors.collect())
            };
            let end = Until::Time(self.duration());
            let found = run.gradient_at(&self.times, loss, end)?;
            let status = found.outcome.status;
            let (value, slopes) = found.loss.ok_or(Failure::Run { what: "the network", status })?;
            sum += value;
            gradient.iter_mut().zip(&slopes.parameters).for_each(|(sum, slope)| *sum += slope);
        }
        Ok((sum, gradient))
    }

    /// The same gradient from the residuals and their Jacobian, by the tangents of the motions.
    pub fn gradient_by_tangents(&self) -> Result<Vec<f64>, Failure> {
        let theta = self.network.parameters();
        let (mut values, mut jacobian) = (vec![0.0; self.data.len()], DMatrix::zeros(self.data.len(), theta.len()));
        let failed = |failure| FitError::Model { names: self.parameter_names(), parameters: theta.clone(), failure };
        self.evaluate(&theta, &mut values, Some(&mut jacobian)).map_err(failed)?;
        let residuals = DVector::from_fn(values.len(), |i, _| values[i] - self.data[i]);
        Ok(jacobian.tr_mul(&residuals).iter().copied().collect())
    }
}

/// The angles of all motions as functions of the weights.
impl Model for Training {
    fn parameter_names(&self) -> Vec<String> {
        self.network.parameter_names()
    }

    fn value_count(&self) -> usize {
        self.data.len()
    }

    fn evaluate(
        &self,
        theta: &[f64],
        values: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), ModelFailure> {
        let network = self.network.with_parameters(theta).ok_or_else(|| undefined("a weight is not finite"))?;
        let variables: &[Variable] = if jacobian.is_some() { &self.weights } else { &[] };
        let mut index = 0;
        for start in &self.starts {
            let tangent = states(&network, *start, &self.times, variables, (STAGES, STEP)).map_err(undefined)?;
            if tangent.outcome.status != Status::Completed {
                return Err(undefined(tangent.outcome.status));
            }
            if let Some(unresolved) = tangent.outcome.unresolved {
                return Err(undefined(unresolved));
            }
            for row in &tangent.rows {
                if smallest_mass(&network, &row.state).is_none() {
                    return Err(undefined(format!("the mass matrix is not positive definite at t = {}", row.state.t)));
                }
                for i in 0..2 {
                    values[index] = row.state.q[i];
                    if let Some(jacobian) = &mut jacobian {
                        for (j, column) in row.columns.iter().enumerate() {
                            jacobian[(index, j)] = column.q[i];
                        }
                    }
                    index += 1;
                }
            }
        }
        Ok(())
    }
}

fn undefined(cause: impl Display) -> ModelFailure {
    ModelFailure::Undefined(cause.to_string())
}

/// The smallest eigenvalue of the mass matrix `L_vv`; `None` unless it is positive.
pub fn smallest_mass(network: &FormulaLagrangian<2>, at: &EndState<2>) -> Option<f64> {
    let x = VelocityPoint { q: at.q, v: at.v, z: at.z };
    let smallest = network.hessian(at.t, &x).vv.symmetric_eigenvalues().iter().copied().fold(f64::INFINITY, |m, x| {
        // A NaN stays.
        if m < x { m } else { x }
    });
    (smallest > 0.0).then_some(smallest)
}
