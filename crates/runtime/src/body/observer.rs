//! What is observed of a run of a rigid body: rows, sign changes, and the steps at which it can be saved.

use crate::{BodyEvent, RunMonitor};
use contact_geom::groups::{RigidBody, Rotations, UniformGravity};
use contact_geom::nalgebra::SVector;
use discrete_herglotz::groups::{GroupEvent, GroupObserver, GroupState};
use std::cell::Cell;
use std::ops::ControlFlow;

/// The number of steps between two polls of the monitor.
const STEPS_BETWEEN_POLLS: usize = 64;

/// A run is saved only where the functions of its events are this far from zero, relative to their largest value in the
/// last step: the sign at the start of a run that continues it is then the one at the end of that step.
const CLEAR_OF_ZERO: f64 = 1e-6;

/// A state of a rigid body as a row of the columns.
#[derive(Clone, Copy)]
pub(super) struct Rows {
    pub lagrangian: RigidBody<UniformGravity, 3>,
    pub tip: [f64; 3],
}

impl Rows {
    pub fn row(&self, t: f64, state: &GroupState<Rotations, 3>) -> [f64; 19] {
        let [w, x, y, zz] = state.g.quaternion();
        let [p1, p2, p3] = state.momentum.into();
        let [o1, o2, o3] = self.lagrangian.velocity(&state.momentum).into();
        let [m1, m2, m3] = state.spatial_momentum().into();
        let [tx, ty, tz] = state.g.apply(&SVector::from(self.tip)).into();
        let energy = self.lagrangian.energy::<Rotations>(&state.g, &state.momentum, state.z);
        [t, w, x, y, zz, p1, p2, p3, o1, o2, o3, m1, m2, m3, tx, ty, tz, energy, state.z]
    }
}

/// The values of the function of an event in the last step.
pub(super) struct EventValues {
    /// The latest time, in the direction of the run, and the value there: at the end of the last step.
    last: Cell<(f64, f64)>,
    largest: Cell<f64>,
    /// 1 forward in time, -1 backward.
    sign: f64,
}

impl EventValues {
    /// No values yet, for steps of this sign.
    pub fn new(sign: f64) -> Self {
        EventValues { last: Cell::new((-f64::INFINITY * sign, 0.0)), largest: Cell::new(0.0), sign }
    }

    fn add(&self, t: f64, value: f64) {
        if (t - self.last.get().0) * self.sign >= 0.0 {
            self.last.set((t, value));
        }
        if value.abs() > self.largest.get() {
            self.largest.set(value.abs());
        }
    }

    /// Whether the value at the end of the step is clearly not zero; begins the next step.
    fn is_clear(&self) -> bool {
        let largest = self.largest.replace(0.0);
        // A function that vanishes everywhere has no sign changes.
        largest == 0.0 || self.last.get().1.abs() > CLEAR_OF_ZERO * largest
    }

    /// An event whose values are recorded here.
    pub fn event<'f>(&'f self, rows: Rows, event: &BodyEvent) -> GroupEvent<'f, Rotations, 3> {
        let own = event.clone();
        let of = GroupEvent::new(move |t, state: &GroupState<Rotations, 3>| {
            let value = own.value(&rows.row(t, state));
            self.add(t, value);
            value
        });
        let of = match event.direction {
            crate::Direction::Rising => of.rising(),
            crate::Direction::Falling => of.falling(),
            crate::Direction::Both => of,
        };
        if event.terminal { of.terminal() } else { of }
    }
}

/// Why a run is halted at a step where it can be saved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Halt {
    /// The monitor ends it.
    Interrupted,
    /// The monitor requests a checkpoint, and the run continues.
    Checkpoint,
}

/// Passes rows and sign changes on to a monitor.
pub(super) struct Observer<'m> {
    pub rows: Rows,
    pub monitor: &'m mut dyn RunMonitor,
    /// The initial time of the motion, and the step.
    pub t0: f64,
    pub h: f64,
    /// The number of steps of the motion.
    pub count: usize,
    /// The steps that were taken before this run, and up to now.
    pub before: usize,
    pub taken: usize,
    /// The number of steps between two rows, for rows given by steps.
    pub every: Option<usize>,
    /// The last time of the rows at given times, and the number of them that have been passed on.
    pub last_row: Option<f64>,
    pub passed: usize,
    /// Whether the next row is that at the start of this run.
    pub at_start: bool,
    /// Whether the next row is that of a terminal event.
    pub at_end: bool,
    pub events: &'m [EventValues],
    pub terminal: &'m [bool],
    /// What the monitor has requested, which is done at the next step at which the run can be saved.
    pub requested: Option<Halt>,
    pub halted: Option<Halt>,
}

impl Observer<'_> {
    /// Whether rows at the remaining times can be requested of a run that starts here: its end is that of the motion up
    /// to rounding.
    fn reaches_last_row(&self) -> bool {
        let Some(last) = self.last_row else { return true };
        let t = self.t0 + self.taken as f64 * self.h;
        let end = t + (self.count - self.taken) as f64 * self.h;
        (last - end) * self.h.signum() <= 4.0 * f64::EPSILON * (t.abs() + end.abs())
    }

    /// Whether a row at the end of a step is one of those that are given by steps.
    fn is_row(&mut self, every: usize) -> bool {
        if std::mem::take(&mut self.at_start) {
            return self.before == 0;
        }
        let step = self.taken + 1;
        self.at_end || step == self.count || step.is_multiple_of(every)
    }
}

impl GroupObserver<Rotations, 3> for Observer<'_> {
    fn row(&mut self, t: f64, state: &GroupState<Rotations, 3>) -> ControlFlow<()> {
        let every = self.every;
        if every.is_some_and(|every| !self.is_row(every)) {
            return ControlFlow::Continue(());
        }
        self.passed += 1;
        self.monitor.row(&self.rows.row(t, state))
    }

    fn crossing(&mut self, event: usize, t: f64, state: &GroupState<Rotations, 3>) -> ControlFlow<()> {
        self.at_end = self.terminal.get(event).copied().unwrap_or(false);
        let columns = self.rows.row(t, state).to_vec();
        let [q, p] = [state.g.quaternion().to_vec(), state.momentum.as_slice().to_vec()];
        let v = self.rows.lagrangian.velocity(&state.momentum).as_slice().to_vec();
        self.monitor.crossing(&crate::Crossing { t, event, q, v, p, z: state.z, columns, after: None })
    }

    fn poll(&mut self, taken: usize, t: f64, state: &dyn Fn() -> GroupState<Rotations, 3>) -> ControlFlow<()> {
        self.taken = self.before + taken;
        // All of them begin the next step.
        let is_clear = self.events.iter().filter(|values| !values.is_clear()).count() == 0;
        if self.taken.is_multiple_of(STEPS_BETWEEN_POLLS) {
            if self.monitor.wants_present() {
                self.monitor.present(&self.rows.row(t, &state()));
            }
            if self.monitor.poll(self.taken as f64 / self.count as f64).is_break() {
                // None of the steps since the last poll could be saved: the run ends without a state.
                if self.requested == Some(Halt::Interrupted) && self.taken < self.count {
                    return ControlFlow::Break(());
                }
                self.requested = Some(Halt::Interrupted);
            } else if self.requested.is_none() && self.monitor.wants_checkpoint() {
                self.requested = Some(Halt::Checkpoint);
            }
        }
        // After the last step there is nothing to continue.
        if self.requested.is_some() && self.taken < self.count && is_clear && self.reaches_last_row() {
            self.halted = self.requested.take();
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}
