//! A system compiled for a number of coordinates.

use super::constrained::check_projection;
use super::formula_system::FormulaSystem;
use crate::{InitialVelocity, Motion, RuntimeError, Start};
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, VelocityPoint};
use discrete_herglotz::{InitialState, InputError, Point, Problem, State, StepError, Vector};
use formula_lagrangian::Formula;

/// A system compiled for N coordinates, at least as many as its formula has. The additional coordinates are at rest and
/// are not visible from outside.
pub(super) struct Sized<L, const N: usize>(pub L);

/// The first n coordinates of a vector.
pub(super) fn coordinates(x: &[f64], n: usize) -> &[f64] {
    x.get(..n).unwrap_or(&[])
}

/// A vector with 0 for the coordinates beyond those of a formula.
fn padded<const N: usize>(x: &[f64]) -> SVector<f64, N> {
    SVector::from_fn(|i, _| x.get(i).copied().unwrap_or(0.0))
}

/// A vector with one finite number per coordinate of a formula.
pub(super) fn checked(formula: &Formula, what: &'static str, numbers: &[f64]) -> Result<Vector, RuntimeError> {
    let expected = formula.dimension();
    if numbers.len() != expected {
        return Err(RuntimeError::Length { what, found: numbers.len(), expected });
    }
    match numbers.iter().enumerate().find(|(_, x)| !x.is_finite()) {
        Some((i, value)) => Err(RuntimeError::NotFinite { what: format!("{what}[{i}]"), value: *value }),
        None => Ok(numbers.into()),
    }
}

/// A start with the modes of friction and of resting contact, from one without them.
fn completed(formula: &Formula, start: &Start) -> Option<Start> {
    let v = match &start.velocity {
        InitialVelocity::Velocity(v) => v,
        // Whether a coordinate sticks depends on its velocity; without friction the modes are those of free coordinates.
        InitialVelocity::Momentum(p)
            if !formula.has_friction() && [start.q.len(), p.len()] == [formula.given_dimension(); 2] =>
        {
            let (mut p, mut q) = (p.clone(), start.q.clone());
            [&mut q, &mut p].into_iter().for_each(|x| x.resize(formula.dimension(), 0.0));
            return Some(Start { q, velocity: InitialVelocity::Momentum(p), ..start.clone() });
        }
        _ => return None,
    };
    if !start.q.iter().chain(v).chain([&start.t, &start.z]).all(|x| x.is_finite()) {
        return None;
    }
    let [q, v] = formula.completed(start.t, &start.q, v, start.z)?;
    Some(Start { q, velocity: InitialVelocity::Velocity(v), ..start.clone() })
}

/// Refuses motions backward in time with friction and resting contact, where the time at which a coordinate came to stick or
/// to rest is lost.
pub(crate) fn check_direction(formula: &Formula, start: f64, end: f64) -> Result<(), RuntimeError> {
    if end < start {
        let what = match (formula.has_friction(), formula.has_resting_contact()) {
            (true, _) => "friction that sticks",
            (_, true) => "a contact that comes to rest",
            (false, false) => return Ok(()),
        };
        let why = format!("runs backward, but a motion with {what} has no unique past; give a later time");
        return Err(RuntimeError::argument("t", why));
    }
    Ok(())
}

/// The start of a motion of a formula, validated.
pub(super) fn initial_state(formula: &Formula, start: &Start) -> Result<InitialState, RuntimeError> {
    let with_modes = completed(formula, start);
    let start = with_modes.as_ref().unwrap_or(start);
    for (what, value) in [("t", start.t), ("z", start.z)] {
        if !value.is_finite() {
            return Err(RuntimeError::NotFinite { what: what.into(), value });
        }
    }
    let of = |what, numbers: &[f64]| checked(formula, what, numbers);
    let (q, z) = (of("q", &start.q)?, start.z);
    Ok(match &start.velocity {
        InitialVelocity::Velocity(v) => Point { q, v: of("v", v)?, z }.into(),
        InitialVelocity::MomentumNear { p, v } => InitialState::Momentum(State { q, p: of("p", p)?, z }, of("v", v)?),
        InitialVelocity::Momentum(p) => State { q, p: of("p", p)?, z }.into(),
    })
}

impl<L: FormulaSystem<N>, const N: usize> Sized<L, N> {
    /// A vector with one finite number per coordinate.
    pub fn vector(&self, what: &'static str, numbers: &[f64]) -> Result<SVector<f64, N>, RuntimeError> {
        Ok(padded(&checked(self.0.formula(), what, numbers)?))
    }

    /// The start of a motion, validated.
    pub fn start(&self, start: &Start) -> Result<discrete_herglotz::Start<N>, RuntimeError> {
        Ok(match initial_state(self.0.formula(), start)? {
            InitialState::Velocity(Point { q, v, z }) => VelocityPoint { q: padded(&q), v: padded(&v), z }.into(),
            InitialState::Momentum(State { q, p, z }, v) => {
                discrete_herglotz::Start::Momentum(PhasePoint { q: padded(&q), p: padded(&p), z }, padded(&v))
            }
        })
    }

    /// The problem of a start, validated.
    pub fn problem(&self, start: &Start) -> Result<Problem<'_, L, N>, RuntimeError> {
        let at = self.start(start)?;
        let problem = Problem::new(&self.0, start.t, at).map_err(|error| self.explained(error, start.t, &at))?;
        let force = self.0.applied_force(start.t, problem.start());
        let names = self.0.formula().coordinates();
        match names.into_iter().zip(force.iter().copied()).find(|(_, value)| !value.is_finite()) {
            Some((coordinate, value)) => Err(RuntimeError::ForceUndefined { coordinate, value }),
            None => Ok(problem),
        }
    }

    /// The problem of a motion, with the interrupt of the motion for its trial runs.
    pub fn problem_of<'m>(&'m self, motion: &'m Motion) -> Result<Problem<'m, L, N>, RuntimeError> {
        check_projection(self.0.formula(), motion)?;
        check_direction(self.0.formula(), motion.start.t, motion.end)?;
        let problem = self.problem(&motion.start)?;
        let problem = match motion.project {
            true => Problem::new(&self.0, motion.start.t, self.0.projected(motion.start.t, *problem.start())?)?,
            false => problem,
        };
        Ok(match &motion.interrupt {
            Some(interrupt) => problem.with_interrupt(interrupt.for_integrators()),
            None => problem,
        })
    }

    /// Replaces the error of a singular start by one that names the velocities in which L is linear, if there are any.
    fn explained(&self, error: InputError, t: f64, at: &discrete_herglotz::Start<N>) -> RuntimeError {
        if let (InputError::FirstStep(StepError::Singular { .. }), discrete_herglotz::Start::Velocity(x)) = (&error, at)
            && const { !L::HINTS.hamiltonian }
        {
            let w = self.0.closed_hessian(t, x).map(|h| h.vv);
            let names = self.0.formula().coordinates();
            let flat = |i: &usize| w.is_some_and(|w| w.row(*i).iter().all(|e| *e == 0.0));
            let flat: Vec<String> = (0..names.len()).filter(flat).map(|i| crate::velocity_name(&names[i])).collect();
            if !flat.is_empty() {
                return RuntimeError::NotRegular { velocities: flat.join(", ") };
            }
        }
        match error {
            InputError::Undefined if const { L::HINTS.hamiltonian } => RuntimeError::HamiltonianUndefined,
            error => error.into(),
        }
    }
}
