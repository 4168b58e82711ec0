//! The discrete Hamiltonian flow with a current state.

use crate::integration::problem::start_of;
use crate::integration::system_problem::check_time;
use crate::numbers::state_words::{Saved, saved};
use crate::resolution::monitor::{ResolutionMonitor, at_rest, sharper};
use crate::{
    DiscreteLagrangian, DiscreteStep, InputError, PlanEntry, RunSupport, State, StepDetails, StepError, StepFailure,
    Stepper, UnresolvedStep, Vector, integration::SuspectInterval, solve::Solver,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, PhasePoint};

/// One step of a [`Flow`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowStep<const N: usize> {
    /// The number of steps taken, including this one: `to` is the state of index `k`.
    pub k: usize,
    /// The time at the end of the step, `t0 + k h`.
    pub t: f64,
    /// The state at the start of the step.
    pub from: PhasePoint<N>,
    /// The state at the end of the step.
    pub to: PhasePoint<N>,
    /// The mean velocity `(q_k - q_{k-1}) / h`, to full precision.
    pub velocity: SVector<f64, N>,
    /// `sigma_d` of the step, the factor by which it scales the contact form and the momentum of every symmetry.
    pub sigma: f64,
    /// Newton iterations taken.
    pub iterations: u32,
}

/// A discrete Hamiltonian flow with its current state `(q, p, z)`; the stepper of a run with a discrete Lagrangian.
///
/// [`from_points`](Self::from_points) is a second constructor, from `(q0, q1, z0)` as in the paper.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::PhasePoint;
/// use discrete_herglotz::{Stepper, rules::{Flow, Rule}};
/// let ld = Rule::MIDPOINT.of(Pendulum { gamma: -0.1 }, 0.1)?;
/// let mut flow = Flow::new(&ld, 0.0, PhasePoint::new([1.0], [1.0], 0.0))?;
/// flow.advance(100)?;
/// println!("q(10) = {}", flow.state().q[0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Flow<D, const N: usize> {
    ld: D,
    t0: f64,
    k: usize,
    state: PhasePoint<N>,
    /// The mean velocities of the last steps, the latest first; the initial guess of Newton's method is extrapolated
    /// from them.
    velocities: [SVector<f64, N>; 3],
    solver: Solver<N>,
    /// `sigma_d` of the last step.
    sigma: f64,
    evaluations: u64,
    /// The state before the last step.
    before: PhasePoint<N>,
    monitor: ResolutionMonitor,
}

impl<D: DiscreteLagrangian<N>, const N: usize> Flow<D, N> {
    /// A flow of a discrete Lagrangian, or of a reference to one, from the state `(q, p, z)` at time `t0`.
    ///
    /// # Errors
    /// [`InputError`] where the state is not finite, `sigma_d <= 0`, the discrete Lagrangian is not regular there, or
    /// the first step cannot be solved.
    pub fn new(ld: D, t0: f64, state: PhasePoint<N>) -> Result<Self, InputError> {
        Self::with_guess(ld, t0, state, SVector::zeros())
    }

    /// Like [`new`](Self::new), with an initial guess of the velocity for the first step; needed where several
    /// velocities have the same momentum.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn with_guess(ld: D, t0: f64, state: PhasePoint<N>, guess: SVector<f64, N>) -> Result<Self, InputError> {
        check_time(t0)?;
        state.check()?;
        let mut solver = Solver::default();
        let first = ld.forward(t0, &state, &guess, &mut solver);
        // Checked first, because a singular Lagrangian is the cause of a first step that fails.
        ld.check_start(t0, &state, &first.map_or(guess, |step| step.velocity))?;
        let first = first.map_err(InputError::first_step)?;
        let monitor = ResolutionMonitor::new(state.q.as_slice(), first.velocity.as_slice(), ld.step_size());
        let velocities = [first.velocity; 3];
        Ok(Flow { ld, t0, k: 0, state, velocities, solver, sigma: 1.0, evaluations: 0, before: state, monitor })
    }

    /// A flow from two positions `q0, q1` and the action `z0`: the state at `t0` is `F-L_d (q0, q1, z0)`.
    ///
    /// # Errors
    /// [`InputError`] where a coordinate is not finite, `sigma_d <= 0`, or the discrete Lagrangian is not regular at
    /// the point; [`InputError::EqualPoints`] where it is not regular because `q0 = q1`.
    pub fn from_points(ld: D, t0: f64, x: DiscretePoint<N>) -> Result<Self, InputError> {
        check_time(t0)?;
        let state = start_of(&ld, t0, &x)?;
        let velocity = (x.q1 - x.q0) / ld.step_size();
        Self::with_guess(ld, t0, state, velocity)
    }

    /// The first step so far that was flagged as unresolved: for example with fewer than six steps per period of the
    /// velocity, or a conformal factor outside of `[1/3, 3]`.
    pub fn unresolved(&self) -> Option<UnresolvedStep> {
        self.monitor.steps.first
    }

    /// The current state `(q, p, z)`.
    pub fn state(&self) -> &PhasePoint<N> {
        &self.state
    }

    /// The current time `t0 + k h`.
    pub fn time(&self) -> f64 {
        self.t0 + self.k as f64 * self.ld.step_size()
    }

    /// Takes one step.
    ///
    /// # Errors
    /// A [`StepError`]; the state is then unchanged.
    #[inline(always)]
    pub fn step(&mut self) -> Result<FlowStep<N>, StepError> {
        let t = self.time();
        let [latest, before, earlier] = self.velocities;
        let next = self.ld.forward(t, &self.state, &(latest * 2.0 - before), &mut self.solver)?;
        self.k += 1;
        let step = FlowStep {
            k: self.k,
            t: self.time(),
            from: self.state,
            to: next.end,
            velocity: next.velocity,
            sigma: next.sigma,
            iterations: next.iterations,
        };
        let velocities = [&earlier, &before, &latest, &next.velocity];
        if let Some(defect) = self.ld.defect(velocities, &next.end, next.sigma) {
            self.record_defect(defect, velocities, &next);
        }
        // The second difference is valid from the third step on.
        let (turn, h) = (next.velocity - latest * 2.0 + before, self.ld.step_size());
        if let Some(sharpness) =
            sharper([&turn, &latest, &next.end.q], h, self.monitor.steps.floor, self.monitor.steps.sharpest)
            && let Some(step) = self.k.checked_sub(2).filter(|step| *step > 0)
        {
            // The cause of a change of the mean velocities lies in this step or the previous one.
            let t = self.t0 + step as f64 * h;
            self.monitor.suspect(sharpness, (step, 2, t), [&self.before, &next.end]);
        }
        // After two steps, the velocity before the first is extrapolated linearly.
        self.velocities = match self.k {
            1 => [next.velocity; 3],
            2 => [next.velocity, latest, latest * 2.0 - next.velocity],
            _ => [next.velocity, latest, before],
        };
        self.before = self.state;
        self.state = next.end;
        self.sigma = next.sigma;
        // One second jet per iteration, and the jet for the momentum at the end.
        self.evaluations += u64::from(next.iterations) + 1;
        Ok(step)
    }

    /// Records the defect of a step. The velocities of a motion at rest are round-off, so that only the conformal
    /// factor counts there.
    #[cold]
    #[inline(never)]
    fn record_defect(&mut self, defect: f64, velocities: [&SVector<f64, N>; 4], next: &DiscreteStep<N>) {
        let still = at_rest(velocities, self.ld.step_size(), self.monitor.steps.floor);
        let of_factor = || self.ld.defect([&SVector::zeros(); 4], &next.end, next.sigma);
        if let Some(defect) = if still { of_factor() } else { Some(defect) } {
            self.monitor.steps.note(self.k - 1, defect);
        }
    }

    /// Takes one step backward, by the inverse flow `F-L_d o (F+L_d)^-1`.
    ///
    /// # Errors
    /// A [`StepError`]; the state is then unchanged.
    pub fn step_back(&mut self) -> Result<(), StepError> {
        let t = self.time() - self.ld.step_size();
        let back = self.ld.backward(t, &self.state, &self.velocities[0], &mut self.solver)?;
        self.state = back.end;
        self.velocities = [back.velocity; 3];
        match self.k.checked_sub(1) {
            Some(k) => self.k = k,
            None => self.t0 = t,
        }
        Ok(())
    }
}

impl<D: DiscreteLagrangian<N>, const N: usize> Stepper for Flow<D, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            self.step().map_err(|cause| StepFailure { taken, cause })?;
        }
        Ok(())
    }

    fn state(&self) -> State {
        self.state.into()
    }

    fn time(&self) -> f64 {
        Flow::time(self)
    }

    fn sigma(&self) -> f64 {
        self.sigma
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn last_step(&self) -> Option<&dyn StepDetails> {
        Some(self)
    }

    fn run_support(&self) -> Option<&dyn RunSupport> {
        Some(self)
    }

    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        Some(self)
    }
}

impl<D: DiscreteLagrangian<N>, const N: usize> StepDetails for Flow<D, N> {
    fn last_velocity(&self) -> Option<Vector> {
        (self.k > 0).then(|| self.velocities[0].into())
    }
}

impl<D: DiscreteLagrangian<N>, const N: usize> RunSupport for Flow<D, N> {
    fn has_constant_rate(&self) -> bool {
        self.ld.constant_rate()
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        work_summary_of(self.ld.is_explicit(), "step")
    }

    fn save(&self) -> Option<Vec<u64>> {
        let mut words = Vec::new();
        Saved::save(self, &mut words);
        Some(words)
    }

    fn restore(&mut self, mut words: &[u64]) -> bool {
        self.load(&mut words).is_some() && words.is_empty()
    }

    fn unresolved(&self) -> Option<UnresolvedStep> {
        self.monitor.steps.first
    }

    fn suspect_interval(&mut self) -> Option<SuspectInterval> {
        self.monitor.suspect.take()
    }
}

/// The work summary of the steps or substeps of discrete Lagrangians.
pub(crate) fn work_summary_of(explicit: bool, what: &str) -> Vec<PlanEntry> {
    let solved = if explicit {
        [
            PlanEntry::skipped("Newton's method", "each step is explicit and evaluates only forces"),
            PlanEntry::skipped("Jacobian", "each step is explicit"),
        ]
    } else {
        [
            PlanEntry::computed("Newton's method", format!("each {what} is implicit in q1")),
            PlanEntry::computed("Jacobian", "second derivatives of L at each iterate"),
        ]
    };
    let action = PlanEntry::computed("action z", "the state of a discrete Lagrangian flow includes it");
    solved.into_iter().chain([action]).collect()
}

saved!([D, const N: usize] Flow<D, N> { t0, k, state, velocities, sigma, evaluations, before, monitor });
