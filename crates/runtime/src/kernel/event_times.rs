//! Derivatives of the times of events, from those of the states at these times.

use super::formula_system::Observed;
use super::recorder::ROUND_OFF_OF_TIMES;
use super::sensitivity::{covector, sensitivity_of};
use crate::{EndCovector, Event, EventAt, Motion, MotionState, RuntimeError, Sensitivity};
use discrete_herglotz::sensitivity::{Differentiable, SwitchTime, Tangent, TangentRow, Variable};
use discrete_herglotz::{Point, Status, Vector};
use formula_lagrangian::{Expression, ExpressionGradient};

/// The distance of the time of a reset in two runs, whose roots may have other guesses, relative to the largest time.
const SAME_RESET: f64 = 1e-10;

/// What is to be differentiated: the states at some times, and the times of sign changes of events.
#[derive(Clone, Copy)]
pub(crate) struct Differentiated<'r> {
    pub variables: &'r [Variable],
    pub times: &'r [f64],
    pub crossings: &'r [EventAt],
}

impl Differentiated<'_> {
    /// The times at which the tangent has rows: those of rows and of sign changes, each once, in the order of the motion.
    pub(super) fn row_times(&self, motion: &Motion) -> Vec<f64> {
        if self.crossings.is_empty() {
            return self.times.to_vec();
        }
        let mut all: Vec<f64> = self.times.iter().copied().chain(self.crossings.iter().map(|at| at.t)).collect();
        all.sort_by(|a, b| if motion.end < motion.start.t { b.total_cmp(a) } else { a.total_cmp(b) });
        all.dedup();
        all
    }

    /// The derivatives that a tangent with rows at [these times](Self::row_times) has.
    pub(super) fn of(
        &self,
        found: &Tangent,
        motion: &Motion,
        (observed, problem): (&dyn Observed, &Differentiable<'_>),
    ) -> Result<Sensitivity, RuntimeError> {
        let n = observed.formula().dimension();
        let (mut sensitivity, all) = (sensitivity_of(found, n), self.row_times(motion));
        if sensitivity.rows.len() == all.len() && matches!(sensitivity.status, Status::Stopped { .. }) {
            // It was ended where nothing more was wanted of it, or by an event.
            sensitivity.status = Status::Completed;
        }
        if self.crossings.is_empty() {
            return Ok(sensitivity);
        }
        let index = |t: f64| all.iter().position(|at| *at == t).unwrap_or(usize::MAX);
        for at in self.crossings {
            let event = motion.events.get(at.event).ok_or_else(|| {
                let count = motion.events.len();
                RuntimeError::argument("crossings", format!("name the event {}; there are {count}", at.event))
            })?;
            let row = found.rows.get(index(at.t)).ok_or_else(|| {
                let why = format!(
                    "have a sign change at t = {}, which is in a step that cannot be taken as a whole, so that its time has no \
                     derivatives; take shorter steps",
                    at.t
                );
                RuntimeError::argument("crossings", why)
            })?;
            let derivatives = match switch_at(found, at.t, event, motion, observed) {
                Some(switch) => switch.derivatives.clone(),
                None if event.reset.is_some() => {
                    let why = format!("have no occurrence of the reset of the event {} at t = {}", at.event, at.t);
                    return Err(RuntimeError::argument("crossings", why));
                }
                None => self.of_row(row, event, (observed, problem))?,
            };
            if event.terminal
                && let Some(columns) = sensitivity.rows.get_mut(index(at.t))
            {
                // The end of the motion moves with the event.
                let rates = row.state.rates(problem, force_at(&row.state, observed).as_ref())?;
                let moved = row.columns.iter().zip(&derivatives).map(|(column, dt)| column.at_moving_time(&rates, *dt));
                *columns = moved.map(|column| super::sensitivity::derivative(&column, n)).collect();
            }
            sensitivity.event_times.push(derivatives);
        }
        let wanted: Vec<usize> = self.times.iter().map(|t| index(*t)).filter(|i| *i < sensitivity.rows.len()).collect();
        sensitivity.states = wanted.iter().map(|i| sensitivity.states[*i].clone()).collect();
        sensitivity.rows = wanted.iter().map(|i| std::mem::take(&mut sensitivity.rows[*i])).collect();
        Ok(sensitivity)
    }

    /// The derivatives of the time of a sign change, from the row there.
    fn of_row(
        &self,
        row: &TangentRow,
        event: &Event,
        (observed, problem): (&dyn Observed, &Differentiable<'_>),
    ) -> Result<Vec<f64>, RuntimeError> {
        let (state, names) = (&row.state, observed.formula());
        let (_, slopes, parameters) = of_expression(&event.function, state);
        let force = force_at(state, observed);
        let time = state.event_time((problem, force.as_ref()), &covector(&slopes, names.dimension(), state.q.len()))?;
        let explicit = |variable: &Variable| match variable {
            Variable::Parameter(name) => {
                let k = names.parameters().position(|(known, _)| known == name);
                k.and_then(|k| parameters.get(k)).copied().unwrap_or(0.0)
            }
            _ => 0.0,
        };
        let all = row.columns.iter().zip(self.variables);
        Ok(all.map(|(column, variable)| time.along(column, explicit(variable))).collect())
    }
}

/// The force of the constraints at a state.
fn force_at(at: &MotionState, observed: &dyn Observed) -> Option<Vector> {
    observed.constraint_force(at.t, &Point::new(at.q.clone(), at.v.clone(), at.z))
}

/// The reset at the time of a sign change: that of the event itself, or, for an event without one, any, since the state jumps
/// there.
fn switch_at<'t>(
    found: &'t Tangent,
    t: f64,
    event: &Event,
    motion: &Motion,
    observed: &dyn Observed,
) -> Option<&'t SwitchTime> {
    let distance = if event.reset.is_some() { SAME_RESET } else { ROUND_OFF_OF_TIMES };
    let round_off = distance * motion.start.t.abs().max(motion.end.abs());
    let is_of_event = |switch: &&SwitchTime| match observed.reset_of(switch.index) {
        Some(reset) => event.reset.is_none_or(|of_event| of_event == reset),
        None => false,
    };
    let near = found.switches.iter().filter(is_of_event).filter(|switch| (switch.t - t).abs() <= round_off);
    near.min_by(|a, b| (a.t - t).abs().total_cmp(&(b.t - t).abs()))
}

/// The value of an expression of a state, its partial derivatives in the state, and those in the parameters.
pub(crate) fn of_expression(expression: &Expression, at: &MotionState) -> (f64, EndCovector, Vec<f64>) {
    // Expressions of a Hamiltonian contain the momentum in the place of the velocity.
    let of_momentum = expression.is_of_hamiltonian();
    let rate = if of_momentum { &at.p } else { &at.v };
    let ExpressionGradient { value, t, q, v, z, parameters, .. } = expression.gradient_at(at.t, &at.q, rate, at.z);
    let zero = EndCovector::zero(at.q.len());
    // An expression of a conformal factor has no value here; it is reported as a loss that is not finite.
    let covector = match (value.is_nan(), of_momentum) {
        (true, _) => zero,
        (false, true) => EndCovector { t, q: q.into(), p: v.into(), z, ..zero },
        (false, false) => EndCovector { t, q: q.into(), v: v.into(), z, ..zero },
    };
    (value, covector, parameters)
}
