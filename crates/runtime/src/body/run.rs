//! Runs of rigid bodies.

use super::integrator::{BodyIntegrator, DEFAULT};
use super::{Body, BodyMotion};
use crate::outcome::KeptRows;
use crate::{Crossing, Direction, OutputTimes, RunMonitor, RuntimeError, StepControl};
use contact_geom::groups::{GroupError, RigidBody, Rotation, Rotations, UniformGravity};
use contact_geom::nalgebra::SVector;
use discrete_herglotz::groups::{
    GroupEvent, GroupMotion, GroupObserver, GroupRows, GroupRun, GroupState, GroupStatus, group_steps,
};
use discrete_herglotz::{AnyIntegrator, InputError, Steps};
use std::ops::ControlFlow;

/// The number of steps between two polls of the monitor.
const STEPS_BETWEEN_POLLS: usize = 64;

/// The number of steps of the first trial run for an accuracy.
const FIRST_STEPS: usize = 8;

/// The result of a motion of a rigid body. Where the motion was ended early, it describes the part that was computed.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyOutcome {
    /// How it ended.
    pub status: GroupStatus,
    /// The integrator.
    pub by: AnyIntegrator,
    /// The length of a step, negative where the motion runs backward.
    pub step_size: f64,
    /// The steps taken.
    pub steps: usize,
    /// The time reached.
    pub t: f64,
    /// The attitude there, a unit quaternion with the real part first.
    pub attitude: [f64; 4],
    /// The momentum in the body there.
    pub momentum: [f64; 3],
    /// The angular velocity in the body there.
    pub omega: [f64; 3],
    /// The momentum in space there.
    pub spatial_momentum: [f64; 3],
    /// The [tip](Body::tip) in space there.
    pub tip: [f64; 3],
    /// The energy there.
    pub energy: f64,
    /// The action there.
    pub z: f64,
    /// A bound of the error of the attitude (in radians) and of the momentum (relative), where an accuracy was
    /// requested.
    pub error_estimate: Option<f64>,
}

impl BodyOutcome {
    /// The [columns](Body::COLUMNS) of the state that was reached.
    pub fn row(&self) -> [f64; 19] {
        let ([w, x, y, z], [p1, p2, p3], [o1, o2, o3]) = (self.attitude, self.momentum, self.omega);
        let ([m1, m2, m3], [tx, ty, tz]) = (self.spatial_momentum, self.tip);
        [self.t, w, x, y, z, p1, p2, p3, o1, o2, o3, m1, m2, m3, tx, ty, tz, self.energy, self.z]
    }
}

/// A state of a rigid body as a row of the columns.
#[derive(Clone, Copy)]
struct Rows {
    lagrangian: RigidBody<UniformGravity, 3>,
    tip: [f64; 3],
}

impl Rows {
    fn row(&self, t: f64, state: &GroupState<Rotations, 3>) -> [f64; 19] {
        let [w, x, y, zz] = state.g.quaternion();
        let [p1, p2, p3] = state.momentum.into();
        let [o1, o2, o3] = self.lagrangian.velocity(&state.momentum).into();
        let [m1, m2, m3] = state.spatial_momentum().into();
        let [tx, ty, tz] = state.g.apply(&SVector::from(self.tip)).into();
        let energy = self.lagrangian.energy::<Rotations>(&state.g, &state.momentum, state.z);
        [t, w, x, y, zz, p1, p2, p3, o1, o2, o3, m1, m2, m3, tx, ty, tz, energy, state.z]
    }
}

/// Passes rows and sign changes on to a monitor.
struct Observer<'m> {
    rows: Rows,
    /// The number of steps.
    count: usize,
    /// The steps taken.
    taken: usize,
    monitor: &'m mut dyn RunMonitor,
}

impl GroupObserver<Rotations, 3> for Observer<'_> {
    fn row(&mut self, t: f64, state: &GroupState<Rotations, 3>) -> ControlFlow<()> {
        self.monitor.row(&self.rows.row(t, state))
    }

    fn crossing(&mut self, event: usize, t: f64, state: &GroupState<Rotations, 3>) -> ControlFlow<()> {
        let columns = self.rows.row(t, state).to_vec();
        let [q, p] = [state.g.quaternion().to_vec(), state.momentum.as_slice().to_vec()];
        let v = self.rows.lagrangian.velocity(&state.momentum).as_slice().to_vec();
        self.monitor.crossing(&Crossing { t, event, q, v, p, z: state.z, columns, after: None })
    }

    fn poll(&mut self, taken: usize) -> ControlFlow<()> {
        self.taken = taken;
        if taken.is_multiple_of(STEPS_BETWEEN_POLLS) {
            self.monitor.poll(taken as f64 / self.count as f64)
        } else {
            ControlFlow::Continue(())
        }
    }
}

impl BodyMotion {
    /// The number of steps and the integrator; for an accuracy, by trial runs, with the bound of the error.
    fn steps(
        &self,
        lagrangian: &RigidBody<UniformGravity, 3>,
        start: &GroupMotion<Rotations, 3>,
    ) -> Result<(AnyIntegrator, usize, Option<f64>), RuntimeError> {
        let span = self.end - self.t;
        if !(span != 0.0 && span.is_finite()) {
            let why = format!(
                "ends at {}, and the motion starts at {}; give a finite end that is later or earlier than the start",
                self.end, self.t
            );
            return Err(RuntimeError::argument("t", why));
        }
        match self.step_control {
            StepControl::Accuracy { error, by } => {
                let by = by.unwrap_or(DEFAULT);
                BodyIntegrator::check(by)?;
                if !(error > 0.0 && error.is_finite()) {
                    return Err(RuntimeError::argument(
                        "accuracy",
                        format!("is {error}; it must be a positive number"),
                    ));
                }
                let method = |h: f64| BodyIntegrator::new(*lagrangian, by, h);
                let found = group_steps(start, span, error, FIRST_STEPS, method);
                let found = found.map_err(|error| match error {
                    GroupError::Accuracy { .. } => RuntimeError::argument("accuracy", format!("is refused: {error}")),
                    error => of_integrator(&error),
                })?;
                Ok((by, found.steps, Some(found.error)))
            }
            StepControl::Steps { steps: Steps::Count(0), .. } => Err(InputError::NoSteps.into()),
            StepControl::Steps { by, steps } => {
                BodyIntegrator::check(by)?;
                let count = match steps {
                    Steps::Count(count) => count as f64,
                    Steps::Size(h) if h > 0.0 && h.is_finite() => {
                        // A quotient that differs from an integer by rounding only is taken for that integer.
                        (span.abs() / h * (1.0 - 4.0 * f64::EPSILON)).ceil().max(1.0)
                    }
                    Steps::Size(h) => {
                        let why = format!("is {h}; it must be a positive number, since the end gives the direction");
                        return Err(RuntimeError::argument("step", why));
                    }
                };
                // Integers up to here are exact in floating point.
                if count > 9e15 {
                    let why = format!("gives {count:.1e} steps, more than can be counted; take a longer step");
                    return Err(RuntimeError::argument("step", why));
                }
                Ok((by, count as usize, None))
            }
        }
    }

    /// The start, validated.
    fn start(&self, lagrangian: &RigidBody<UniformGravity, 3>) -> Result<GroupMotion<Rotations, 3>, RuntimeError> {
        if !self.t.is_finite() {
            return Err(RuntimeError::NotFinite { what: "t".into(), value: self.t });
        }
        if !self.z.is_finite() {
            return Err(RuntimeError::NotFinite { what: "z".into(), value: self.z });
        }
        if let Some((i, value)) = self.omega.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            return Err(RuntimeError::NotFinite { what: format!("omega[{i}]"), value: *value });
        }
        let of_attitude = |error: GroupError| RuntimeError::argument("attitude", format!("is refused: {error}"));
        let g = Rotation::from_quaternion(self.attitude).map_err(of_attitude)?;
        let momentum = lagrangian.momentum(&SVector::from(self.omega));
        GroupMotion::new(self.t, GroupState { g, momentum, z: self.z }).map_err(of_attitude)
    }
}

/// The error of an integrator or of its step.
fn of_integrator(error: &GroupError) -> RuntimeError {
    let argument = match error {
        GroupError::NeedsComposition { .. } | GroupError::Stages { .. } => "integrator",
        _ => "step",
    };
    RuntimeError::argument(argument, format!("is refused: {error}"))
}

impl Body {
    /// Runs a motion. Each row has the [columns](Self::COLUMNS), and a crossing has them too, with the quaternion, the
    /// angular velocity and the momentum in the body as position, velocity and momentum. A failure of a step is reported
    /// in the status of the outcome.
    ///
    /// # Errors
    /// [`RuntimeError::Argument`] and [`RuntimeError::NotFinite`] with the argument: a quaternion that is not a unit
    /// quaternion, an inertia that violates the triangle inequality, a first step that turns the body beyond the chart
    /// of the exponential map (with the largest step), an accuracy below round-off, an integrator that rigid bodies do
    /// not have; [`RuntimeError::Input`] for times of rows that are not in order.
    pub fn run(&self, motion: &BodyMotion, monitor: &mut dyn RunMonitor) -> Result<BodyOutcome, RuntimeError> {
        let lagrangian = self.lagrangian()?;
        let rows = Rows { lagrangian, tip: self.tip() };
        let mut state = motion.start(&lagrangian)?;
        let (by, steps, error_estimate) = motion.steps(&lagrangian, &state)?;
        let step_size = (motion.end - motion.t) / steps as f64;
        let integrator = BodyIntegrator::new(lagrangian, by, step_size).map_err(|error| of_integrator(&error))?;
        // A step that turns the body beyond the chart is refused before work starts.
        if let Err(error @ GroupError::BeyondChart { .. }) = state.clone().advance(&integrator, 1) {
            return Err(of_integrator(&error));
        }
        let event = |event: &'_ crate::BodyEvent| -> GroupEvent<'static, Rotations, 3> {
            let own = event.clone();
            let of = GroupEvent::new(move |t, state: &GroupState<Rotations, 3>| own.value(&rows.row(t, state)));
            let of = match event.direction {
                Direction::Rising => of.rising(),
                Direction::Falling => of.falling(),
                Direction::Both => of,
            };
            if event.terminal { of.terminal() } else { of }
        };
        let run = GroupRun {
            steps,
            rows: match &motion.rows {
                None => GroupRows::Never,
                Some(OutputTimes::Every(0)) => {
                    return Err(RuntimeError::argument("every", "is 0; it must be at least 1"));
                }
                Some(OutputTimes::Every(every)) => GroupRows::Every(*every),
                Some(OutputTimes::At(times)) => GroupRows::At(times.clone()),
            },
            events: motion.events.iter().map(event).collect(),
        };
        let mut observer = Observer { rows, count: steps, taken: 0, monitor };
        let status = run.run(&mut state, &integrator, &mut observer).map_err(|error| match error {
            GroupError::Times { index, t, .. } => InputError::Times { index, t }.into(),
            error => of_integrator(&error),
        })?;
        let t = if status == GroupStatus::Completed { motion.end } else { state.t() };
        let at = state.state();
        let [_, w, x, y, zz, p1, p2, p3, o1, o2, o3, m1, m2, m3, tx, ty, tz, energy, z] = rows.row(t, &at);
        Ok(BodyOutcome {
            status,
            by,
            step_size,
            steps: observer.taken,
            t,
            attitude: [w, x, y, zz],
            momentum: [p1, p2, p3],
            omega: [o1, o2, o3],
            spatial_momentum: [m1, m2, m3],
            tip: [tx, ty, tz],
            energy,
            z,
            error_estimate,
        })
    }

    /// Runs a motion and keeps its rows.
    ///
    /// # Errors
    /// Those of [`run`](Self::run).
    pub fn record(&self, motion: &BodyMotion) -> Result<(BodyOutcome, Vec<Vec<f64>>), RuntimeError> {
        let mut kept = KeptRows::default();
        let outcome = self.run(motion, &mut kept)?;
        Ok((outcome, kept.0))
    }
}
