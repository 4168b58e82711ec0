//! Runs of motions on Lie groups, with rows and events.

use super::events::{Found, LastSign, Taken, in_step};
use super::{GroupEvent, GroupIntegrator, GroupMotion, GroupState};
use contact_geom::groups::{GroupError, LieGroup};
use std::fmt::{Display, Formatter};
use std::ops::ControlFlow;

/// Which states of a run are passed to [`GroupObserver::row`].
#[derive(Clone, Debug, PartialEq)]
pub enum GroupRows {
    /// None.
    Never,
    /// The start, the steps whose number is a multiple of this one, and the end; 0 is taken for 1.
    Every(usize),
    /// These times, in the order of the motion; a state within a step is computed by one shorter step of the same
    /// integrator.
    At(Vec<f64>),
}

/// What is done with the output of a run. Where a method returns `Break`, the run ends.
pub trait GroupObserver<G: LieGroup<N>, const N: usize> {
    /// A row.
    fn row(&mut self, _t: f64, _state: &GroupState<G, N>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// A sign change of the event with this number.
    fn crossing(&mut self, _event: usize, _t: f64, _state: &GroupState<G, N>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called after each step with the number of steps taken, the time, and the state, which is computed where it is asked
    /// for.
    fn poll(&mut self, _taken: usize, _t: f64, _state: &dyn Fn() -> GroupState<G, N>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Ignores everything.
impl<G: LieGroup<N>, const N: usize> GroupObserver<G, N> for () {}

/// How a run on a Lie group ended. All rows and sign changes before the end have been passed on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GroupStatus {
    /// All steps were taken.
    Completed,
    /// A terminal event ended the run; the motion is there.
    Event {
        /// The number of the event.
        event: usize,
        /// The time.
        t: f64,
    },
    /// The observer ended the run.
    Stopped {
        /// The time of the motion.
        t: f64,
    },
    /// A step failed; the motion is at its start.
    Failed {
        /// The number of the step, counted from 0.
        step: usize,
        /// The time that was reached.
        t: f64,
        /// The cause.
        cause: GroupError,
    },
}

impl Display for GroupStatus {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            GroupStatus::Completed => write!(f, "completed"),
            GroupStatus::Event { event, t } => write!(f, "ended by event {event} at t = {t}"),
            GroupStatus::Stopped { t } => write!(f, "stopped at t = {t}"),
            GroupStatus::Failed { step, t, cause } => write!(f, "step {step} at t = {t} failed: {cause}"),
        }
    }
}

/// A number of steps of a motion on a Lie group, with rows and events.
///
/// ```
/// use contact_geom::groups::{Inertia, LieGroup, NoPotential, RigidBody, Rotations};
/// use contact_geom::nalgebra::SVector;
/// use discrete_herglotz::groups::{GroupEvent, GroupGauss, GroupMotion, GroupRun, GroupState, GroupStatus};
/// let body = RigidBody::rotating(&Inertia::principal([1.0, 2.0, 3.0])?, NoPotential, -0.1)?;
/// let start = GroupState { g: Rotations::identity(), momentum: SVector::from([1.0, 1.0, 1.0]), z: 0.0 };
/// let mut motion = GroupMotion::<Rotations, 3>::new(0.0, start)?;
/// let turned = GroupEvent::new(|_, x: &GroupState<Rotations, 3>| x.momentum[1]).terminal();
/// let run = GroupRun { events: vec![turned], ..GroupRun::new(100) };
/// let status = run.run(&mut motion, &GroupGauss::new::<Rotations, 3>(&body, 3, 0.1)?, &mut ())?;
/// assert!(matches!(status, GroupStatus::Event { .. }) && motion.state().momentum[1].abs() < 1e-14);
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
pub struct GroupRun<'f, G: LieGroup<N>, const N: usize> {
    /// The number of steps.
    pub steps: usize,
    /// The rows.
    pub rows: GroupRows,
    /// The events.
    pub events: Vec<GroupEvent<'f, G, N>>,
}

/// Why a run ends early.
enum Ended {
    Stopped,
    Event { event: usize, t: f64 },
    Failed(GroupError),
}

impl From<GroupError> for Ended {
    fn from(error: GroupError) -> Self {
        Ended::Failed(error)
    }
}

/// The end of a run that its observer requests.
fn observed(flow: ControlFlow<()>) -> Result<(), Ended> {
    if flow.is_break() { Err(Ended::Stopped) } else { Ok(()) }
}

impl<G: LieGroup<N>, const N: usize> GroupRun<'_, G, N> {
    /// A number of steps without rows and events.
    pub fn new(steps: usize) -> Self {
        GroupRun { steps, rows: GroupRows::Never, events: Vec::new() }
    }

    /// Advances a motion by the steps of an integrator. A second run of the same motion continues it, with the same
    /// numbers to the last bit as one run of all steps.
    ///
    /// # Errors
    /// [`GroupError::Times`] for rows at times that the run does not reach, or that are not in the order of the motion.
    /// The failure of a step is reported in the status.
    pub fn run(
        &self,
        motion: &mut GroupMotion<G, N>,
        integrator: &impl GroupIntegrator<G, N>,
        observer: &mut dyn GroupObserver<G, N>,
    ) -> Result<GroupStatus, GroupError> {
        self.check(motion.t(), integrator.step_size())?;
        let mut taken = 0;
        Ok(match self.advance(motion, integrator, observer, &mut taken) {
            Ok(()) => GroupStatus::Completed,
            Err(Ended::Stopped) => GroupStatus::Stopped { t: motion.t() },
            Err(Ended::Event { event, t }) => GroupStatus::Event { event, t },
            Err(Ended::Failed(cause)) => GroupStatus::Failed { step: taken, t: motion.t(), cause },
        })
    }

    /// Checks the times of the rows.
    fn check(&self, t0: f64, h: f64) -> Result<(), GroupError> {
        let GroupRows::At(times) = &self.rows else { return Ok(()) };
        let end = t0 + self.steps as f64 * h;
        let rounding = 8.0 * f64::EPSILON * (t0.abs() + end.abs());
        let mut last = t0;
        for (index, &t) in times.iter().enumerate() {
            let ahead = (t - last) * h.signum();
            let beyond = (t - end) * h.signum();
            // Not true of a NaN.
            if !(ahead >= 0.0 && beyond <= rounding) {
                return Err(GroupError::Times { index, t, from: last, to: end });
            }
            last = t;
        }
        Ok(())
    }

    fn advance<I: GroupIntegrator<G, N>>(
        &self,
        motion: &mut GroupMotion<G, N>,
        integrator: &I,
        observer: &mut dyn GroupObserver<G, N>,
        taken: &mut usize,
    ) -> Result<(), Ended> {
        let h = integrator.step_size();
        let times: &[f64] = if let GroupRows::At(times) = &self.rows { times } else { &[] };
        let mut rows = times.iter().copied().peekable();
        while let Some(t) = rows.next_if(|t| *t == motion.t() || self.steps == 0) {
            observed(observer.row(t, &motion.state()))?;
        }
        if matches!(self.rows, GroupRows::Every(_)) {
            observed(observer.row(motion.t(), &motion.state()))?;
        }
        let mut signs = vec![LastSign::default(); self.events.len()];
        let (mut states, mut found): (Vec<GroupState<G, N>>, Vec<Found<G, N>>) = (Vec::new(), Vec::new());
        while *taken < self.steps {
            let before = motion.clone();
            let from = (before.t(), before.state());
            let velocity = match before.last_velocity() {
                Some(velocity) => velocity,
                None => integrator.velocity(from.0, &from.1)?,
            };
            motion.advance_by(integrator, h)?;
            let after = motion.last_velocity().unwrap_or(velocity);
            let turn = |v: &_| G::angle(v) * h.abs();
            let angle = if turn(&velocity) > turn(&after) { turn(&velocity) } else { turn(&after) };
            let step = Taken { integrator, h, from, velocity, to: (motion.t(), motion.state()), angle };
            found.clear();
            if !self.events.is_empty() {
                let searched = in_step(&step, &self.events, &mut signs, *taken == 0, (&mut states, &mut found));
                if let Err(error) = searched {
                    *motion = before;
                    return Err(error.into());
                }
            }
            let is_terminal = |found: &Found<G, N>| self.events.get(found.event).is_some_and(GroupEvent::is_terminal);
            for crossing in &found {
                let t = step.time(crossing.part);
                while let Some(time) = rows.next_if(|time| (time - t) * h < 0.0) {
                    observed(observer.row(time, &step.after(step.part(time))?))?;
                }
                observed(observer.crossing(crossing.event, t, &crossing.state))?;
                if is_terminal(crossing) {
                    if crossing.part < 1.0 {
                        *motion = before;
                        if crossing.part > 0.0 {
                            motion.advance_by(integrator, h * crossing.part)?;
                        }
                    }
                    if matches!(self.rows, GroupRows::Every(_)) {
                        observed(observer.row(t, &motion.state()))?;
                    }
                    return Err(Ended::Event { event: crossing.event, t });
                }
            }
            *taken += 1;
            let is_last = *taken == self.steps;
            while let Some(time) = rows.next_if(|time| is_last || step.part(*time) <= 1.0) {
                observed(observer.row(time, &step.after(step.part(time).min(1.0))?))?;
            }
            if let GroupRows::Every(every) = self.rows
                && (is_last || taken.is_multiple_of(every.max(1)))
            {
                observed(observer.row(motion.t(), &motion.state()))?;
            }
            observed(observer.poll(*taken, motion.t(), &|| motion.state()))?;
        }
        Ok(())
    }
}
