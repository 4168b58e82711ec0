//! Derivatives of motions.

use super::DERIVATIVES;
use super::event_times::Differentiated;
use super::formula_system::FormulaSystem;
use super::moved_start::{self, MovedStart};
use super::recorder::Recorder;
use super::run;
use super::sized::{Sized, coordinates};
use crate::full::{FULL, not_compiled};
use crate::{
    EndCovector, Gradient, Loss, LossGradient, LyapunovExponents, Motion, MotionState, RunMonitor, RuntimeError,
    Sensitivity, StateDerivative,
};
use contact_geom::{Parametric, Structure};
use discrete_herglotz::sensitivity::{DifferentiableProblem, Tangent};
use discrete_herglotz::{Until, Vector};

/// The motion without rows and without the events that do not end it, which its derivatives do not need.
pub(super) fn unobserved(motion: &Motion) -> Motion {
    let events = motion.events.iter().filter(|event| event.terminal).cloned().collect();
    Motion { rows: None, columns: Vec::new(), events, estimate: false, nodes: false, ..motion.clone() }
}

/// The first n components of a vector.
fn first(x: &Vector, n: usize) -> Vector {
    coordinates(x, n).into()
}

/// The first n components of a vector, with 0 for those beyond, of `all` coordinates.
fn padded(x: &Vector, n: usize, all: usize) -> Vector {
    Vector::from_fn(all, |i| if i < n { x.get(i).copied().unwrap_or(f64::NAN) } else { 0.0 })
}

/// A state in the first n coordinates.
pub(super) fn state(of: &MotionState, n: usize) -> MotionState {
    MotionState { t: of.t, q: first(&of.q, n), v: first(&of.v, n), p: first(&of.p, n), z: of.z }
}

pub(super) fn derivative(of: &StateDerivative, n: usize) -> StateDerivative {
    StateDerivative { q: first(&of.q, n), v: first(&of.v, n), p: first(&of.p, n), z: of.z }
}

/// The partial derivatives of a number in a state of n coordinates, for `all` coordinates.
pub(super) fn covector(of: &EndCovector, n: usize, all: usize) -> EndCovector {
    let [q, v, p] = [&of.q, &of.v, &of.p].map(|x| padded(x, n, all));
    EndCovector { t: of.t, q, v, p, z: of.z }
}

pub(super) fn loss_gradient(found: discrete_herglotz::sensitivity::LossGradient, n: usize) -> LossGradient {
    let of = |gradient: Gradient| Gradient { q: first(&gradient.q, n), rate: first(&gradient.rate, n), ..gradient };
    let (status, unresolved) = (found.outcome.status, found.outcome.unresolved);
    LossGradient { status, unresolved, loss: found.loss.map(|(value, gradient)| (value, of(gradient))) }
}

pub(super) fn sensitivity_of(found: &Tangent, n: usize) -> Sensitivity {
    Sensitivity {
        status: found.outcome.status,
        unresolved: found.outcome.unresolved,
        states: found.rows.iter().map(|row| state(&row.state, n)).collect(),
        rows: found.rows.iter().map(|row| row.columns.iter().map(|column| derivative(column, n)).collect()).collect(),
        event_times: Vec::new(),
        growth: found.growth,
    }
}

pub(super) fn tangent<L: FormulaSystem<N> + Parametric<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    of: Differentiated<'_>,
    monitor: &mut dyn RunMonitor,
) -> Result<Sensitivity, RuntimeError> {
    if const { !FULL } {
        return Err(not_compiled(DERIVATIVES));
    }
    let requested = motion;
    let motion = &unobserved(motion);
    let problem = system.problem_of(motion)?;
    moved_start::check(motion)?;
    let (moved, times) = (MovedStart::of(system, motion)?, of.row_times(motion));
    let mut recorder = Recorder::new(&system.0, motion, monitor)?.until(times.last().copied());
    let run = run::of(system, &problem, motion)?.observe(&mut recorder);
    let until = Until::Time(motion.end);
    let found = match &moved {
        None => run.tangent_at(of.variables, &times, until)?,
        Some(start) => {
            let found = run.tangent_at(&start.variables(of.variables), &times, until)?;
            start.push(found, of.variables, &system.0.parameter_names())
        }
    };
    of.of(&found, requested, (&system.0, &problem.differentiable()))
}

pub(super) fn lyapunov_exponents<L: FormulaSystem<N> + Parametric<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    monitor: &mut dyn RunMonitor,
) -> Result<LyapunovExponents, RuntimeError> {
    if const { !FULL } {
        return Err(not_compiled(DERIVATIVES));
    }
    let motion = &unobserved(motion);
    let (problem, n) = (system.problem_of(motion)?, system.0.formula().dimension());
    let mut recorder = Recorder::new(&system.0, motion, monitor)?;
    let run = run::of(system, &problem, motion)?.observe(&mut recorder);
    let found = run.lyapunov_exponents_within(n, Until::Time(motion.end))?;
    let formula = system.0.formula();
    let is_of_contact = !system.0.has_force() && !formula.has_noncontact_resets() && formula.constraints() == 0;
    Ok(exponents_of(found, &system.0.structure(), is_of_contact))
}

/// The exponents of a system with this structure, and whether their sums are known to round-off.
pub(super) fn exponents_of(
    found: discrete_herglotz::sensitivity::LyapunovExponents,
    structure: &Structure,
    is_of_contact: bool,
) -> LyapunovExponents {
    let is_paired = structure.has_constant_rate() && is_of_contact;
    LyapunovExponents {
        status: found.outcome.status,
        t: found.outcome.t,
        steps: found.outcome.steps,
        pairing_defect: is_paired.then(|| found.pairing_defect()),
        volume_defect: is_of_contact.then(|| found.volume_defect()),
        exponents: found.exponents,
        of_second_half: found.of_second_half,
        pairs: found.pairs,
        rate: found.rate,
    }
}

pub(super) fn gradient<L: FormulaSystem<N> + Parametric<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    times: &[f64],
    loss: &mut Loss<'_>,
    monitor: &mut dyn RunMonitor,
) -> Result<LossGradient, RuntimeError> {
    if const { !FULL } {
        return Err(not_compiled(DERIVATIVES));
    }
    moved_start::check(motion)?;
    let motion = &unobserved(motion);
    let moved = MovedStart::of(system, motion)?;
    let (problem, n) = (system.problem_of(motion)?, system.0.formula().dimension());
    let mut recorder = Recorder::new(&system.0, motion, monitor)?;
    let run = run::of(system, &problem, motion)?.observe(&mut recorder);
    let of_states = |states: &[MotionState]| {
        let states: Vec<MotionState> = states.iter().map(|of| state(of, n)).collect();
        let (value, covectors) = loss(&states);
        (value, covectors.iter().map(|of| covector(of, n, N)).collect())
    };
    let found = run.gradient_at(times, of_states, Until::Time(motion.end))?;
    let mut found = loss_gradient(found, n);
    if let Some(start) = &moved {
        found.loss = found.loss.map(|(value, gradient)| (value, start.pull(gradient)));
    }
    Ok(found)
}
