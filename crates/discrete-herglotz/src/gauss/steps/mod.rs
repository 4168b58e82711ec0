//! Steps of contact Gauss collocation of equal length in physical time, for any number of coordinates.

mod resolution;
mod retries;
mod sequence;
mod state_words;

use crate::gauss::dense::{Solved, SolvedStep, StepStart};
use crate::gauss::limits::FIRST_NEWTON_PAUSE;
use crate::gauss::routes::{RouteState, RouteStateMut, StageRoute};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::steps::sequence::Sequence;
use crate::gauss::system::{CollocationSystem, PointGradient};
use crate::numbers::compensated::{CompensatedSum, copy_values};
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::forget_branches;
use crate::resolution::monitor::StepMonitor;
use crate::resolution::thresholds::FEW_STAGES;
use crate::{State, StepError, StepFailure};
use contact_geom::nalgebra::DMatrix;
use retries::Tried;

/// How the stage equations of a step are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Solution {
    /// Fixed-point iteration.
    FixedPointIteration,
    /// Simplified Newton iteration.
    Simplified,
    /// Damped Newton iteration with the derivatives at each stage.
    Newton,
}

/// A suspect interval: two steps that may not have resolved the motion, with the states at their ends, whose y are momenta.
pub(crate) struct Suspect {
    /// Whether there is one that was not asked for yet.
    pub is_new: bool,
    pub step: usize,
    pub t: f64,
    pub from: StepStart,
    pub to: StepStart,
}

/// A motion by collocation: the route with its state, and the selection of the method of solution. The system is the same
/// in all calls.
///
/// The stages are evaluated in SIMD lanes. Their initial guess is extrapolated from the step before, the fixed-point
/// iteration runs to the tolerance of the route, and the state is advanced by compensated sums. If the fixed-point
/// iteration does not converge, simplified Newton iteration is used, with a Jacobian that is kept as long as the iteration
/// converges fast; if that does not converge either, Newton's method is used, in the stage positions alone if the mass
/// matrix and the rate are constant. The step fails if none of them converges.
pub(crate) struct GaussSteps {
    pub s: usize,
    pub h: f64,
    pub route: Box<dyn StageRoute>,
    /// The mass matrix of the condensed routes, whose states have velocities.
    pub mass: Option<DMatrix<f64>>,
    pub arch: Instructions,
    pub t0: f64,
    pub k: usize,
    /// The state at the start of the last step.
    from: StepStart,
    /// Whether the stages of the last step are in the route's workspace.
    solved: bool,
    /// Whether the Newton methods may be used.
    pub newton: bool,
    solution: Solution,
    /// Steps until the less expensive method of solution is tried again, and their number the next time (doubled at
    /// each change to a more expensive one).
    pause: usize,
    pauses: usize,
    pub newton_steps: u64,
    /// The defect of a constant conformal factor, see [`of_sigma`](crate::gauss::resolution::tail::of_sigma).
    of_sigma: f64,
    /// The last mean velocities: present for few stages, where the defect between the nodes is no measure of
    /// resolution, and when suspect intervals are requested.
    sequence: Option<Box<Sequence>>,
    /// The first unresolved step, the threshold for the next suspect interval, and the round-off of the positions.
    monitor: StepMonitor,
    pub suspect: Suspect,
    /// The end of the last step; a velocity, momenta and a gradient.
    end: StepStart,
    v: Vec<f64>,
    p: Vec<f64>,
    gradient: PointGradient,
    /// The velocity 0, from which velocities are found where nothing nearer is known.
    near: Vec<f64>,
}

/// The start of a motion, with the route of its steps.
pub(crate) struct Setup<'r> {
    pub s: usize,
    pub h: f64,
    pub t0: f64,
    pub route: Box<dyn StageRoute>,
    pub mass: Option<DMatrix<f64>>,
    /// The defect of a constant conformal factor.
    pub of_sigma: f64,
    /// The position and the velocity at the start.
    pub q: &'r [f64],
    pub v: &'r [f64],
    pub check_resolution: bool,
}

impl GaussSteps {
    pub fn new(Setup { s, h, t0, route, mass, of_sigma, q, v, check_resolution }: Setup<'_>) -> Self {
        let zeros = || StepStart::zeros(q.len());
        let start = StepStart { q: q.into(), ..zeros() };
        GaussSteps {
            s,
            h,
            route,
            mass,
            arch: Instructions::new(),
            t0,
            k: 0,
            from: zeros(),
            solved: false,
            newton: true,
            solution: Solution::FixedPointIteration,
            pause: 0,
            pauses: FIRST_NEWTON_PAUSE,
            newton_steps: 0,
            of_sigma,
            sequence: (s <= FEW_STAGES || check_resolution).then(|| Box::new(Sequence::new(&start))),
            monitor: StepMonitor::new(q, v, h),
            suspect: Suspect { is_new: false, step: 0, t: 0.0, from: zeros(), to: zeros() },
            end: zeros(),
            v: vec![0.0; q.len()],
            p: vec![0.0; q.len()],
            gradient: PointGradient::zeros(q.len()),
            near: vec![0.0; q.len()],
        }
    }

    /// The time of the state.
    pub fn time(&self) -> f64 {
        self.t0 + self.k as f64 * self.h
    }

    /// Takes a time, a state and its velocity as the start of the next step, which is then that of new steps; `false` if the
    /// steps so far may have changed how they are taken.
    pub fn restart(&mut self, t: f64, state: &State, v: &[f64]) -> bool {
        if self.solution != Solution::FixedPointIteration || self.newton_steps > 0 || !self.route.restart(v) {
            return false;
        }
        // The condensed routes have velocities.
        let y = if self.mass.is_some() { v } else { &state.p };
        let set = |to: &mut [CompensatedSum], x: &[f64]| to.iter_mut().zip(x).for_each(|(to, x)| *to = (*x).into());
        let RouteStateMut { q, y: of_y, z } = self.route.state_mut();
        set(q, &state.q);
        set(of_y, y);
        *z = state.z.into();
        (self.t0, self.k, self.solved) = (t, 0, false);
        true
    }

    /// The last step, if its stages are known.
    fn last_step(&self) -> Option<SolvedStep<'_>> {
        let t = self.t0 + self.k.checked_sub(1)? as f64 * self.h;
        self.solved.then_some(SolvedStep { mass: self.mass.as_ref(), t, from: &self.from })
    }

    /// Writes the stages of the last step, with their values of L if they are requested or known. Returns whether they are,
    /// the time, and the state in the variables of the route at its start.
    pub fn solved(
        &self,
        system: &dyn CollocationSystem,
        wants_l: bool,
        to: Solved<'_>,
    ) -> Option<(bool, f64, &StepStart)> {
        let step = self.last_step()?;
        Some((self.route.solved(system, &step, wants_l, to), step.t, &self.from))
    }

    /// The momenta of a state in the variables of the route: the velocities of the condensed routes are multiplied by the
    /// mass matrix.
    pub fn momenta(mass: Option<&DMatrix<f64>>, y: &[f64], p: &mut [f64]) {
        let Some(mass) = mass else { return p.copy_from_slice(y) };
        p.fill(0.0);
        for (column, y) in mass.column_iter().zip(y) {
            for (p, entry) in p.iter_mut().zip(column.iter()) {
                *p += entry * y;
            }
        }
    }

    /// Takes steps without observation between them.
    ///
    /// # Errors
    /// [`StepFailure`] where a step fails: the state is then that before the failed step.
    pub fn advance(&mut self, system: &dyn CollocationSystem, steps: usize) -> Result<(), StepFailure> {
        let (mut done, mut tried) = (0, Tried::default());
        while done < steps {
            self.resume();
            let left = steps - done;
            let (taken, refused) = match self.solution {
                Solution::FixedPointIteration => self.take_steps(system, left),
                Solution::Simplified => self.take_steps(system, self.pause.min(left)),
                Solution::Newton => {
                    tried.newton = true;
                    match self.solve_stages(system) {
                        Err(cause) => (0, Some(cause)),
                        Ok(()) => self.take_steps(system, 1),
                    }
                }
            };
            done += taken;
            if taken > 0 {
                tried = Tried::default();
            }
            let Some(refused) = refused else { continue };
            // These do not depend on how the stage equations are solved.
            let final_cause = matches!(
                refused,
                StepError::SigmaVanished { .. } | StepError::StageFactor { .. } | StepError::Branched
            );
            if !final_cause && self.try_again(system, &mut tried, refused).is_ok() {
                continue;
            }
            // The first error is reported: that of Newton's method is less informative, unless it is about the
            // integrating factor.
            let cause = if final_cause { refused } else { tried.refused.unwrap_or(refused) };
            return Err(StepFailure { taken: done, cause });
        }
        Ok(())
    }

    /// Takes steps by the present method of solution. Returns the number of steps taken, and the error if they are fewer
    /// than requested.
    fn take_steps(&mut self, system: &dyn CollocationSystem, steps: usize) -> (usize, Option<StepError>) {
        forget_branches();
        let (taken, refused) = match self.route.take_steps(steps, &mut self.from) {
            Some(taken) => {
                self.k += taken;
                (taken, (taken < steps).then_some(IterationOutcome::NonFinite))
            }
            None => self.iterate_steps(system, steps),
        };
        if self.solution != Solution::FixedPointIteration {
            self.newton_steps += taken as u64;
            self.pause = self.pause.saturating_sub(taken);
        }
        self.solved = refused.is_none();
        (taken, refused.map(StepError::from))
    }

    /// The same for routes that solve equations in each step.
    fn iterate_steps(&mut self, system: &dyn CollocationSystem, steps: usize) -> (usize, Option<IterationOutcome>) {
        for taken in 0..steps {
            // Dense output covers the last step.
            if taken + 1 == steps {
                copy_state(&*self.route, &mut self.from);
            }
            let t = self.t0 + self.k as f64 * self.h;
            let outcome = self.route.step(system, t);
            if outcome != IterationOutcome::Done {
                return (taken, Some(outcome));
            }
            let defect = self.route.defect();
            if defect > 1.0 && !self.is_at_rest(system, t + self.h) {
                self.monitor.note(self.k, defect);
            }
            if self.sequence.is_some() {
                self.update_sequence();
            }
            self.k += 1;
        }
        (steps, None)
    }
}

/// The state in the variables of a route.
fn copy_state(route: &dyn StageRoute, to: &mut StepStart) {
    let RouteState { q, y, z } = route.state();
    copy_values(q, &mut to.q);
    copy_values(y, &mut to.y);
    to.z = z.value;
}
