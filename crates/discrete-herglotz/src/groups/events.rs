//! Events of motions on Lie groups: functions of the state whose sign changes are located.

use super::{GroupIntegrator, GroupState};
use crate::solve::roots::bracketed_root;
use contact_geom::groups::{GroupError, LieGroup};
use contact_geom::nalgebra::SVector;

/// The sign changes that count, in the direction of the run.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Direction {
    Rising,
    Falling,
    Both,
}

/// `f(t, state)`.
type Function<'f, G, const N: usize> = Box<dyn Fn(f64, &GroupState<G, N>) -> f64 + 'f>;

/// A function of time and state whose sign changes are located to round-off.
///
/// The function is sampled four times in a step, and at least once in half a radian of turn; two sign changes between
/// two samples are not seen. A sign change is located by steps of the same integrator from the start of its step.
pub struct GroupEvent<'f, G: LieGroup<N>, const N: usize> {
    function: Function<'f, G, N>,
    direction: Direction,
    terminal: bool,
}

impl<'f, G: LieGroup<N>, const N: usize> GroupEvent<'f, G, N> {
    /// All sign changes of a function; they do not end the run.
    pub fn new(function: impl Fn(f64, &GroupState<G, N>) -> f64 + 'f) -> Self {
        GroupEvent { function: Box::new(function), direction: Direction::Both, terminal: false }
    }

    /// Restricts the event to sign changes from negative to positive, in the direction of the run.
    pub fn rising(self) -> Self {
        GroupEvent { direction: Direction::Rising, ..self }
    }

    /// Restricts the event to sign changes from positive to negative, in the direction of the run.
    pub fn falling(self) -> Self {
        GroupEvent { direction: Direction::Falling, ..self }
    }

    /// Ends the run at the first sign change that counts.
    pub fn terminal(self) -> Self {
        GroupEvent { terminal: true, ..self }
    }

    /// Whether the event ends the run.
    pub fn is_terminal(&self) -> bool {
        self.terminal
    }

    /// Whether a change to this sign counts.
    fn counts(&self, to: f64) -> bool {
        match self.direction {
            Direction::Rising => to > 0.0,
            Direction::Falling => to < 0.0,
            Direction::Both => true,
        }
    }

    fn value(&self, t: f64, state: &GroupState<G, N>) -> Result<f64, GroupError> {
        let value = (self.function)(t, state);
        if value.is_finite() {
            Ok(value)
        } else {
            Err(GroupError::NonFinite { what: "the function of an event", value })
        }
    }
}

/// A step that was taken, from which states within it are computed.
pub(super) struct Taken<'i, I, G: LieGroup<N>, const N: usize> {
    pub integrator: &'i I,
    pub h: f64,
    pub from: (f64, GroupState<G, N>),
    pub velocity: SVector<f64, N>,
    pub to: (f64, GroupState<G, N>),
    /// The largest angle by which the body turns in the step.
    pub angle: f64,
}

impl<I: GroupIntegrator<G, N>, G: LieGroup<N>, const N: usize> Taken<'_, I, G, N> {
    /// The state after a part of the step, by one step of the same integrator.
    pub fn after(&self, part: f64) -> Result<GroupState<G, N>, GroupError> {
        let (t, from) = &self.from;
        match part {
            0.0 => Ok(*from),
            1.0 => Ok(self.to.1),
            _ => Ok(from.after(&self.integrator.step_by(self.h * part, *t, from, &self.velocity)?)),
        }
    }

    /// The time after a part of the step.
    pub fn time(&self, part: f64) -> f64 {
        if part == 1.0 { self.to.0 } else { self.from.0 + part * self.h }
    }

    /// The part of the step before a time, above 1 for a time after the step; times that are those of an end up to round-off
    /// are that end.
    pub fn part(&self, t: f64) -> f64 {
        let rounding = 4.0 * f64::EPSILON * (t.abs() + self.h.abs());
        if (t - self.to.0).abs() <= rounding {
            1.0
        } else if (t - self.from.0).abs() <= rounding {
            0.0
        } else {
            (t - self.from.0) / self.h
        }
    }
}

/// A sign change within a step.
pub(super) struct Found<G: LieGroup<N>, const N: usize> {
    /// The part of the step before it.
    pub part: f64,
    pub event: usize,
    pub state: GroupState<G, N>,
}

/// The last nonzero sign of the function of an event.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LastSign {
    /// 0 before the first nonzero value.
    sign: f64,
    /// Whether a sign change was found at the end of the last step, where the function vanishes.
    counted: bool,
}

/// A value that is this much smaller than the others of the first step is a zero of its function at the start, as after
/// a run that a terminal event ended.
const ZERO_AT_START: f64 = 1e-12;

/// The number of samples in a step.
fn samples(angle: f64) -> usize {
    // The cast saturates.
    (2.0 * angle).ceil().clamp(4.0, 4096.0) as usize
}

/// The sign changes of all events in a step, added to `found` in the order of time. `states` is a workspace.
pub(super) fn in_step<I: GroupIntegrator<G, N>, G: LieGroup<N>, const N: usize>(
    step: &Taken<'_, I, G, N>,
    events: &[GroupEvent<'_, G, N>],
    signs: &mut [LastSign],
    is_first: bool,
    (states, found): (&mut Vec<GroupState<G, N>>, &mut Vec<Found<G, N>>),
) -> Result<(), GroupError> {
    let count = samples(step.angle);
    states.clear();
    for k in 0..=count {
        states.push(step.after(k as f64 / count as f64)?);
    }
    for (event, (of, last)) in events.iter().zip(signs).enumerate() {
        let mut before = (0.0, 0.0);
        if is_first {
            *last = first_sign(step, of, states)?;
        }
        for (k, state) in states.iter().enumerate() {
            let part = k as f64 / count as f64;
            let value = of.value(step.time(part), state)?;
            let sign = if value == 0.0 { 0.0 } else { value.signum() };
            if k == 0 {
                before = (part, value);
                continue;
            }
            let changes = last.sign != 0.0 && sign != last.sign;
            if changes && sign == 0.0 && !last.counted {
                // An exact zero at a sample is a sign change: that the function only touches zero there is exceptional.
                if of.counts(-last.sign) {
                    found.push(Found { part, event, state: *state });
                }
                last.counted = true;
            } else if changes && sign != 0.0 {
                if !last.counted && of.counts(sign) {
                    let (from, below) = before;
                    let at = |part: f64| of.value(step.time(part), &step.after(part)?);
                    let root = bracketed_root([from, part], [below, value], at)?;
                    found.push(Found { part: root, event, state: step.after(root)? });
                }
                last.counted = false;
            }
            if sign != 0.0 {
                (last.sign, last.counted) = (sign, false);
            }
            before = (part, value);
        }
    }
    found.sort_by(|a, b| a.part.total_cmp(&b.part));
    Ok(())
}

/// The sign at the start of a run.
fn first_sign<I: GroupIntegrator<G, N>, G: LieGroup<N>, const N: usize>(
    step: &Taken<'_, I, G, N>,
    event: &GroupEvent<'_, G, N>,
    states: &[GroupState<G, N>],
) -> Result<LastSign, GroupError> {
    let mut largest = 0.0_f64;
    let mut first = 0.0;
    for (k, state) in states.iter().enumerate() {
        let value = event.value(step.time(k as f64 / (states.len() - 1).max(1) as f64), state)?;
        if k == 0 {
            first = value;
        }
        if value.abs() > largest {
            largest = value.abs();
        }
    }
    let sign = if first.abs() <= ZERO_AT_START * largest { 0.0 } else { first.signum() };
    Ok(LastSign { sign, counted: false })
}
