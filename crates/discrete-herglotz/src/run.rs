//! Runs: many steps of a discrete Hamiltonian flow, recording only what is asked for.

use crate::legendre::{discrete_regularity, legendre_minus};
use crate::watch::{Watch, at_rest, sharper};
use crate::{DiscreteLagrangian, Doubt, Halt, InputError, Solver, Status, StepError, Stepper, Suspicion, Transition};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, GeometryError, PhasePoint};
use std::ops::ControlFlow;

/// One step of a run, as an observer sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<const N: usize> {
    /// The number of steps taken, this one included: the state `to` is that of index `k`.
    pub k: usize,
    /// The time at the step's end, `t0 + k h`.
    pub t: f64,
    /// The state before.
    pub from: PhasePoint<N>,
    /// The state after.
    pub to: PhasePoint<N>,
    /// The mean velocity `(q_k - q_{k-1}) / h`, to full precision.
    pub velocity: SVector<f64, N>,
    /// `sigma_d` of the step: the factor by which it contracts the contact form, and every momentum of a symmetry.
    pub sigma: f64,
    /// Newton iterations taken.
    pub iterations: u32,
}

/// What a run does with its states. Closures of [`Step`] observe too, and pairs of observers observe one after the other.
pub trait Observer<const N: usize> {
    /// Sees the initial state.
    fn start(&mut self, _t: f64, _state: &PhasePoint<N>) {}
    /// Sees a step; `Break` ends the run.
    fn step(&mut self, step: &Step<N>) -> ControlFlow<()>;
}

impl<const N: usize, F: FnMut(&Step<N>) -> ControlFlow<()>> Observer<N> for F {
    #[inline]
    fn step(&mut self, step: &Step<N>) -> ControlFlow<()> {
        self(step)
    }
}

impl<const N: usize, A: Observer<N>, B: Observer<N>> Observer<N> for (A, B) {
    fn start(&mut self, t: f64, state: &PhasePoint<N>) {
        self.0.start(t, state);
        self.1.start(t, state);
    }
    #[inline]
    fn step(&mut self, step: &Step<N>) -> ControlFlow<()> {
        self.0.step(step)?;
        self.1.step(step)
    }
}

/// Records nothing: for runs of which only the final state is wanted.
#[derive(Clone, Copy, Debug)]
pub struct FinalOnly;

impl<const N: usize> Observer<N> for FinalOnly {
    #[inline]
    fn step(&mut self, _step: &Step<N>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Passes the initial state and every `stride`-th step on to another observer; for rows, and for a progress callback.
#[derive(Clone, Copy, Debug)]
pub struct Every<O> {
    stride: usize,
    observer: O,
}

impl<O> Every<O> {
    /// Every `stride`-th step to this observer.
    ///
    /// # Errors
    /// [`InputError::Count`] if the stride is 0.
    pub fn new(stride: usize, observer: O) -> Result<Self, InputError> {
        if stride == 0 {
            return Err(InputError::Count { what: "the stride of the record", least: 1, found: 0 });
        }
        Ok(Every { stride, observer })
    }

    /// The observer.
    pub fn into_inner(self) -> O {
        self.observer
    }
}

impl<const N: usize, O: Observer<N>> Observer<N> for Every<O> {
    fn start(&mut self, t: f64, state: &PhasePoint<N>) {
        self.observer.start(t, state);
    }
    #[inline]
    fn step(&mut self, step: &Step<N>) -> ControlFlow<()> {
        if step.k.is_multiple_of(self.stride) { self.observer.step(step) } else { ControlFlow::Continue(()) }
    }
}

/// Records times and states, the initial one included.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record<const N: usize> {
    /// The rows so far: time and state.
    pub rows: Vec<(f64, PhasePoint<N>)>,
}

impl<const N: usize> Observer<N> for Record<N> {
    fn start(&mut self, t: f64, state: &PhasePoint<N>) {
        self.rows.push((t, *state));
    }
    fn step(&mut self, step: &Step<N>) -> ControlFlow<()> {
        self.rows.push((step.t, step.to));
        ControlFlow::Continue(())
    }
}

/// A discrete Hamiltonian flow with its current state: the working object of a simulation.
///
/// The state is `(q, p, z)`; there is a second door for those who start, as the paper does, from `(q0, q1, z0)`.
///
/// ```
/// use contact_geom::{PhasePoint, systems::Pendulum};
/// use discrete_herglotz::{Flow, Midpoint, FinalOnly, Status};
/// let ld = Midpoint::new(Pendulum { gamma: -0.1 }, 0.1)?;
/// let mut flow = Flow::new(&ld, 0.0, PhasePoint::new([1.0], [1.0], 0.0))?;
/// assert_eq!(flow.run(100, &mut FinalOnly)?, Status::Completed);
/// println!("q(10) = {}", flow.state().q[0]);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub struct Flow<'a, D, const N: usize> {
    ld: &'a D,
    t0: f64,
    k: usize,
    state: PhasePoint<N>,
    /// The mean velocities of the last steps, the latest first: the start of Newton's method is extrapolated from them.
    velocities: [SVector<f64, N>; 3],
    solver: Solver<N>,
    /// `sigma_d` of the last step.
    sigma: f64,
    evaluations: u64,
    /// The state before the last step.
    before: PhasePoint<N>,
    watch: Watch<N>,
}

impl<'a, D: DiscreteLagrangian<N>, const N: usize> Flow<'a, D, N> {
    /// A flow from the state `(q, p, z)` at time `t0`.
    ///
    /// # Errors
    /// [`InputError`] where the state is not finite, `sigma_d <= 0`, the discrete Lagrangian is not regular there, or the
    /// first step cannot be solved.
    pub fn new(ld: &'a D, t0: f64, state: PhasePoint<N>) -> Result<Self, InputError> {
        Self::with_guess(ld, t0, state, SVector::zeros())
    }

    /// Like [`new`](Self::new), with a guess of the velocity from which the first step is solved; needed where several
    /// velocities have the same momentum.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn with_guess(ld: &'a D, t0: f64, state: PhasePoint<N>, guess: SVector<f64, N>) -> Result<Self, InputError> {
        check_time(t0)?;
        state.check()?;
        let mut solver = Solver::default();
        let first = ld.forward(t0, &state, &guess, &mut solver);
        // A singular Lagrangian is the reason of what goes wrong, where something does.
        ld.check_start(t0, &state, &first.map_or(guess, |step| step.velocity))?;
        let first = first.map_err(InputError::first_step)?;
        let (velocities, watch) = ([first.velocity; 3], Watch::new(&state.q, &first.velocity, ld.step_size()));
        Ok(Flow { ld, t0, k: 0, state, velocities, solver, sigma: 1.0, evaluations: 0, before: state, watch })
    }

    /// A flow from the two positions `q0, q1` and the action `z0`: its state at `t0` is `F-L_d (q0, q1, z0)`.
    ///
    /// # Errors
    /// [`InputError`] where a coordinate is not finite, `sigma_d <= 0`, or the discrete Lagrangian is not regular at the
    /// point; [`InputError::EqualPoints`] where that is because `q0 = q1`.
    pub fn from_points(ld: &'a D, t0: f64, x: DiscretePoint<N>) -> Result<Self, InputError> {
        check_time(t0)?;
        x.check()?;
        let bad = |cause| if x.q0 == x.q1 { InputError::EqualPoints } else { InputError::FirstStep(cause) };
        let regularity = discrete_regularity(ld, t0, &x).map_err(bad)?;
        let sigma = regularity.sigma;
        if sigma <= 0.0 {
            return Err(InputError::Sigma { sigma });
        }
        // Not `condition() >= 1/eps`: that would let a NaN pass.
        let regular = regularity.fibre.condition() < 1.0 / f64::EPSILON;
        if !(sigma.is_finite() && regular) {
            return Err(bad(StepError::Singular { pivot: regularity.fibre.smallest }));
        }
        let state = legendre_minus(ld, t0, &x).map_err(bad)?;
        Self::with_guess(ld, t0, state, (x.q1 - x.q0) / ld.step_size())
    }

    /// The first step so far that cannot have resolved the motion, where one was seen: as fewer than six steps in a period of
    /// the velocity, or a conformal factor beyond three.
    pub fn suspicion(&self) -> Option<Suspicion> {
        self.watch.first
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
    /// A [`StepError`]; the state is then the one before.
    #[inline(always)]
    pub fn step(&mut self) -> Result<Step<N>, StepError> {
        let t = self.time();
        let [latest, before, earlier] = self.velocities;
        let next = self.ld.forward(t, &self.state, &(latest * 2.0 - before), &mut self.solver)?;
        self.k += 1;
        let step = Step {
            k: self.k,
            t: self.time(),
            from: self.state,
            to: next.end,
            velocity: next.velocity,
            sigma: next.sigma,
            iterations: next.iterations,
        };
        let velocities = [&earlier, &before, &latest, &next.velocity];
        if let Some(misfit) = self.ld.misfit(velocities, &next.end, next.sigma) {
            self.suspect(misfit, velocities, &next);
        }
        // The first velocity has none before it.
        let (turn, h) = (next.velocity - latest * 2.0 + before, self.ld.step_size());
        if let Some(sharpness) = sharper([&turn, &latest, &next.end.q], h, self.watch.floor, self.watch.sharpest)
            && let Some(step) = self.k.checked_sub(2).filter(|step| *step > 0)
        {
            // What turns mean velocities lies in this step or the last.
            let doubt = Doubt { step, steps: 2, t: self.t0 + step as f64 * h, from: self.before, to: next.end };
            self.watch.doubt(sharpness, doubt);
        }
        // Before the first step velocities changed as they do in the second, for all that is known.
        self.velocities = match self.k {
            1 => [next.velocity; 3],
            2 => [next.velocity, latest, latest * 2.0 - next.velocity],
            _ => [next.velocity, latest, before],
        };
        self.before = self.state;
        self.state = next.end;
        self.sigma = next.sigma;
        // A second jet an iteration, and the jet that makes the next momentum.
        self.evaluations += u64::from(next.iterations) + 1;
        Ok(step)
    }

    /// Notes the misfit of a step. What is at rest turns by its rounding, and has a misfit by its factor alone.
    #[cold]
    #[inline(never)]
    fn suspect(&mut self, misfit: f64, velocities: [&SVector<f64, N>; 4], next: &Transition<N>) {
        let still = at_rest(velocities, self.ld.step_size(), self.watch.floor);
        let of_factor = || self.ld.misfit([&SVector::zeros(); 4], &next.end, next.sigma);
        if let Some(misfit) = if still { of_factor() } else { Some(misfit) } {
            self.watch.note(self.k - 1, misfit);
        }
    }

    /// Takes up to `steps` steps, showing each to the observer. The flow stays at the last state reached, and can go on.
    ///
    /// # Errors
    /// [`InputError::Count`] if `steps` is 0. Bad luck in mid-run is a [`Status`], not an error: what was recorded is kept.
    pub fn run(&mut self, steps: usize, observer: &mut impl Observer<N>) -> Result<Status, InputError> {
        if steps == 0 {
            return Err(InputError::Count { what: "the number of steps", least: 1, found: 0 });
        }
        if self.k == 0 {
            observer.start(self.t0, &self.state);
        }
        for _ in 0..steps {
            match self.step() {
                Ok(step) => {
                    if observer.step(&step).is_break() {
                        return Ok(Status::Stopped { step: step.k });
                    }
                }
                Err(cause) => return Ok(Status::Failed { step: self.k, cause }),
            }
        }
        Ok(Status::Completed)
    }

    /// Takes one step back by the inverse flow `F-L_d o (F+L_d)^-1`.
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

impl<D: DiscreteLagrangian<N>, const N: usize> Stepper<N> for Flow<'_, D, N> {
    fn advance(&mut self, steps: usize) -> Result<(), Halt> {
        for taken in 0..steps {
            self.step().map_err(|cause| Halt { taken, cause })?;
        }
        Ok(())
    }

    fn state(&self) -> PhasePoint<N> {
        self.state
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

    fn suspicion(&self) -> Option<Suspicion> {
        self.watch.first
    }

    fn doubt(&mut self) -> Option<Doubt<N>> {
        self.watch.doubt.take()
    }
}

/// Refuses a time that is not finite.
pub(crate) fn check_time(t0: f64) -> Result<(), GeometryError> {
    if t0.is_finite() { Ok(()) } else { Err(GeometryError::NonFinite { what: "t0", index: 0, value: t0 }) }
}
