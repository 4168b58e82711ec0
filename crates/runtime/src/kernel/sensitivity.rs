//! Derivatives of motions.

use super::formula_system::FormulaSystem;
use super::recorder::Recorder;
use super::run;
use super::sized::{Sized, coordinates};
use crate::{
    Gradient, Loss, LossGradient, LyapunovExponents, Motion, MotionState, RunMonitor, RuntimeError, Sensitivity,
    StateCovector,
};
use contact_geom::Parametric;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::Until;
use discrete_herglotz::sensitivity::{EndCovector, EndState, StateDerivative, Tangent, Variable};

/// The motion without rows and events, which its derivatives do not need.
fn unobserved(motion: &Motion) -> Motion {
    Motion { rows: None, columns: Vec::new(), events: Vec::new(), estimate: false, nodes: false, ..motion.clone() }
}

pub(super) fn state<const N: usize>(of: &EndState<N>, n: usize) -> MotionState {
    let [q, v, p] = [&of.q, &of.v, &of.p].map(|x| coordinates(x.as_slice(), n).to_vec());
    MotionState { t: of.t, q, v, p, z: of.z }
}

fn derivative<const N: usize>(of: &StateDerivative<N>, n: usize) -> MotionState {
    state(&EndState { t: 0.0, q: of.q, v: of.v, p: of.p, z: of.z }, n)
}

/// The partial derivatives of a number in a state, for the first n coordinates.
pub(super) fn covector<const N: usize>(of: &StateCovector, n: usize) -> EndCovector<N> {
    let vector =
        |x: &[f64]| SVector::<f64, N>::from_fn(|i, _| if i < n { x.get(i).copied().unwrap_or(0.0) } else { 0.0 });
    EndCovector { t: of.t, q: vector(&of.q), v: vector(&of.v), p: vector(&of.p), z: of.z }
}

pub(super) fn loss_gradient<const N: usize>(
    found: discrete_herglotz::sensitivity::LossGradient<N>,
    n: usize,
) -> LossGradient {
    let of = |gradient: discrete_herglotz::sensitivity::Gradient<N>| Gradient {
        q: coordinates(gradient.q.as_slice(), n).to_vec(),
        velocity: coordinates(gradient.rate.as_slice(), n).to_vec(),
        z: gradient.z,
        parameters: gradient.parameters,
        t0: gradient.t0,
        t_end: gradient.t_end,
        growth: gradient.growth,
    };
    LossGradient { status: found.outcome.status, loss: found.loss.map(|(value, gradient)| (value, of(gradient))) }
}

pub(super) fn sensitivity_of<const N: usize>(found: &Tangent<N>, n: usize) -> Sensitivity {
    Sensitivity {
        status: found.outcome.status,
        unresolved: found.outcome.unresolved,
        states: found.rows.iter().map(|row| state(&row.state, n)).collect(),
        rows: found.rows.iter().map(|row| row.columns.iter().map(|column| derivative(column, n)).collect()).collect(),
        growth: found.growth,
    }
}

pub(super) fn tangent<L: FormulaSystem<N> + Parametric<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    variables: &[Variable],
    times: &[f64],
    monitor: &mut dyn RunMonitor,
) -> Result<Sensitivity, RuntimeError> {
    let motion = &unobserved(motion);
    let (problem, n) = (system.problem_of(motion)?, system.0.formula().dimension());
    let mut recorder = Recorder::new(&system.0, motion, monitor)?;
    let run = run::of(system, &problem, motion)?.observe(&mut recorder);
    let found = run.tangent_at(variables, times, Until::Time(motion.end))?;
    Ok(sensitivity_of(&found, n))
}

pub(super) fn lyapunov_exponents<L: FormulaSystem<N> + Parametric<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    monitor: &mut dyn RunMonitor,
) -> Result<LyapunovExponents, RuntimeError> {
    let motion = &unobserved(motion);
    let (problem, n) = (system.problem_of(motion)?, system.0.formula().dimension());
    let mut recorder = Recorder::new(&system.0, motion, monitor)?;
    let run = run::of(system, &problem, motion)?.observe(&mut recorder);
    let found = run.lyapunov_exponents_within(n, Until::Time(motion.end))?;
    let is_paired = system.0.structure().has_constant_rate() && !system.0.has_force();
    Ok(LyapunovExponents {
        status: found.outcome.status,
        t: found.outcome.t,
        steps: found.outcome.steps,
        pairing_defect: is_paired.then(|| found.pairing_defect()),
        volume_defect: (!system.0.has_force()).then(|| found.volume_defect()),
        exponents: found.exponents,
        of_second_half: found.of_second_half,
        pairs: found.pairs,
        rate: found.rate,
    })
}

pub(super) fn gradient<L: FormulaSystem<N> + Parametric<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    times: &[f64],
    loss: &mut Loss<'_>,
    monitor: &mut dyn RunMonitor,
) -> Result<LossGradient, RuntimeError> {
    let motion = &unobserved(motion);
    let (problem, n) = (system.problem_of(motion)?, system.0.formula().dimension());
    let mut recorder = Recorder::new(&system.0, motion, monitor)?;
    let run = run::of(system, &problem, motion)?.observe(&mut recorder);
    let of_states = |states: &[EndState<N>]| {
        let states: Vec<MotionState> = states.iter().map(|of| state(of, n)).collect();
        let (value, covectors) = loss(&states);
        (value, covectors.iter().map(|of| covector(of, n)).collect())
    };
    let found = run.gradient_at(times, of_states, Until::Time(motion.end))?;
    Ok(loss_gradient(found, n))
}
