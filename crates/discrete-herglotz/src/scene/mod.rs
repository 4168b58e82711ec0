//! Scenes: what is to be computed, and nothing else.

mod accuracy;
#[cfg(test)]
mod accuracy_tests;
mod integrator;
mod pilot;
mod plan;

pub use integrator::{Integrator, UnknownIntegrator};
pub use plan::{Item, Outcome, Plan, Row};

use crate::run::check_time;
use crate::verified::{verified, verified_over};
use crate::{InputError, StepError};
use accuracy::Choice;
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{Lagrangian, PhasePoint, Regularity, Symmetry, VelocityPoint, largest};

/// The time step of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steps {
    /// Steps of this length, made a little shorter so that a whole number of them fills the span; of an integrator by a clock, steps
    /// of this length in the clock's time, the last one shorter.
    Size(f64),
    /// This many steps; not by a clock, which counts them itself.
    Count(usize),
    /// One length for the whole run, of time or of the time of the Lagrangian's clock, chosen by pilot runs so that the error of (q, p),
    /// relative to its size at the time or at the end, is at most this at every tenth of the span. The pilot runs cost a small multiple of the run; what is narrower than the
    /// distance of their nodes, about the step divided by four times the stages, may go unseen.
    Accuracy(f64),
}

/// What is wanted of a scene beside its final (q, p).
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted<const N: usize> {
    /// The action z. Where z does not act back on the motion, leaving it out saves its computation.
    pub action: bool,
    /// The conformal factor of the whole motion, the product of the `sigma_d`.
    pub conformal_factor: bool,
    /// Rows of the motion: the state after each so many steps.
    pub rows: Option<usize>,
    /// The momentum of this group in each row.
    pub momentum: Option<Symmetry<N>>,
}

/// The final state with its action.
impl<const N: usize> Default for Wanted<N> {
    fn default() -> Self {
        Wanted { action: true, conformal_factor: false, rows: None, momentum: None }
    }
}

/// A system with its initial state, a method, a span of time and the outputs that are wanted.
///
/// From these and the declared structure of the Lagrangian (probed when the plan is made: a false claim is an error) a
/// [`Plan`] takes the cheapest route, and says in words what will be computed and what not.
///
/// ```
/// use contact_geom::{VelocityPoint, systems::Pendulum};
/// use discrete_herglotz::{Integrator, Scene, Steps, Wanted};
///
/// let pendulum = Pendulum { gamma: -0.01 };
/// let scene = Scene::new(&pendulum, VelocityPoint::new([1.0], [1.0], 0.0), 1000.0)
///     .by(Integrator::Gauss { stages: 16 })
///     .steps(Steps::Accuracy(1e-9))
///     .wanting(Wanted { action: false, ..Wanted::default() });
/// let plan = scene.plan()?;
/// println!("{plan}");
/// let outcome = plan.run()?;
/// println!("{}: q = {} after {} steps", outcome.status, outcome.q[0], outcome.steps);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Debug)]
pub struct Scene<'a, L, const N: usize> {
    lagrangian: &'a L,
    start: VelocityPoint<N>,
    t0: f64,
    span: f64,
    integrator: Option<Integrator>,
    steps: Steps,
    wanted: Wanted<N>,
}

impl<'a, L: Lagrangian<N>, const N: usize> Scene<'a, L, N> {
    /// The motion of a Lagrangian from a point of TQ x R over a span of time: at first from t = 0, by an integrator that is chosen
    /// for it, to a relative error of 1e-9, for the final state with its action.
    pub fn new(lagrangian: &'a L, start: VelocityPoint<N>, span: f64) -> Self {
        Scene {
            lagrangian,
            start,
            t0: 0.0,
            span,
            integrator: None,
            steps: Steps::Accuracy(1e-9),
            wanted: Wanted::default(),
        }
    }

    /// The same from another time.
    pub fn from_time(self, t0: f64) -> Self {
        Scene { t0, ..self }
    }

    /// The same by this integrator. Where none is named, it is contact Gauss collocation: with stages for the wanted accuracy, and by
    /// the clock that the Lagrangian states where that takes much fewer steps; or with eight stages where steps are given.
    pub fn by(self, integrator: Integrator) -> Self {
        Scene { integrator: Some(integrator), ..self }
    }

    /// The same with other steps.
    pub fn steps(self, steps: Steps) -> Self {
        Scene { steps, ..self }
    }

    /// The same with other outputs.
    pub fn wanting(self, wanted: Wanted<N>) -> Self {
        Scene { wanted, ..self }
    }

    /// The outputs that are wanted.
    pub fn wanted(&self) -> &Wanted<N> {
        &self.wanted
    }

    /// Checks everything, chooses the step and the route.
    ///
    /// # Errors
    /// [`InputError`]: a span or step that is not positive and finite, a state that is not finite, a false or a missing claim of
    /// structure, a method whose hypothesis the Lagrangian does not meet, an accuracy that the method does not reach.
    pub fn plan(&self) -> Result<Plan<'a, L, N>, InputError> {
        if !(self.span > 0.0 && self.span.is_finite()) {
            return Err(InputError::Span { span: self.span });
        }
        if let Some(0) = self.wanted.rows {
            return Err(InputError::Count { what: "the steps between two rows", least: 1, found: 0 });
        }
        if let Some(integrator) = self.integrator {
            integrator.check(self.lagrangian)?;
        }
        self.check_start()?;
        let structure = verified(self.lagrangian, self.t0, &self.start)?;
        // Pilot runs look at the equations of motion along the whole span.
        let times = if matches!(self.steps, Steps::Accuracy(_)) { 4 } else { 16 };
        verified_over(self.lagrangian, self.t0, self.span, &self.start, times)?;
        let given = |count: usize| {
            let h = self.span / count as f64;
            Choice { integrator: self.integrator.unwrap_or(DEFAULT), count, h, error: None }
        };
        let rate = self.clock_rate()?;
        let choice = match (self.steps, rate) {
            (Steps::Count(0), _) => {
                return Err(InputError::Count { what: "the number of steps", least: 1, found: 0 });
            }
            (Steps::Count(_), Some(_)) => return Err(InputError::Hypothesis { hypothesis: SIZED }),
            (Steps::Count(count), None) => given(count),
            (Steps::Size(h), _) if !(h > 0.0 && h.is_finite()) => return Err(InputError::Step { h }),
            // A step that fits the span up to rounding is not made shorter.
            (Steps::Size(h), _) => {
                let count = (self.span / (h * rate.unwrap_or(1.0)) * (1.0 - 4.0 * f64::EPSILON)).ceil().max(1.0);
                check_count(count)?;
                let choice = given(count as usize);
                if rate.is_some() { Choice { h, ..choice } } else { choice }
            }
            (Steps::Accuracy(error), _) => accuracy::choose(self, structure, error)?,
        };
        check_count(choice.count as f64)?;
        let plan = Plan::new(self, structure, &choice)?;
        // Pilot runs have looked already.
        if plan.error().is_none() {
            plan.probe_first_steps()?;
        }
        Ok(plan)
    }

    /// Refuses a start that is not finite, at which L is not defined, or not regular.
    fn check_start(&self) -> Result<(), InputError> {
        let Scene { lagrangian, start, t0, .. } = self;
        check_time(*t0)?;
        if N == 0 {
            return Err(InputError::Dimension);
        }
        PhasePoint { q: start.q, p: start.v, z: start.z }.check()?;
        let (g, w) = (lagrangian.gradient(*t0, start), lagrangian.hessian(*t0, start).vv);
        let value = lagrangian.value(*t0, &start.q, &start.v, start.z);
        if !(value.is_finite() && g.is_finite() && w.iter().all(|e| e.is_finite())) {
            return Err(InputError::Undefined);
        }
        // In units of the coordinates in which its rows are of size one: masses may differ by any factor.
        let unit = SVector::<f64, N>::from_fn(|i, _| largest(w.row(i).iter().copied()).sqrt());
        let scaled = DMatrix::from_fn(N, N, |i, j| w[(i, j)] / (unit[i] * unit[j]));
        let Regularity { smallest, largest } = Regularity::of(scaled);
        // A matrix of zeros has no such units, and counts as singular.
        if smallest > 4.0 * N as f64 * f64::EPSILON * largest {
            return Ok(());
        }
        Err(InputError::FirstStep(StepError::Singular { pivot: smallest }))
    }

    /// The rate of the clock at the start, where an integrator by a clock is named.
    fn clock_rate(&self) -> Result<Option<f64>, InputError> {
        let Some(Integrator::Clocked { .. }) = self.integrator else { return Ok(None) };
        let rate = self.lagrangian.clock_rate(&self.start.q);
        if rate > 0.0 && rate.is_finite() { Ok(Some(rate)) } else { Err(InputError::Clock { rate }) }
    }

    /// The same for the final (q, p) alone.
    fn bare(&self) -> Self {
        Scene { wanted: Wanted { action: false, ..Wanted::default() }, ..*self }
    }
}

/// The integrator where none is named and steps are given.
const DEFAULT: Integrator = Integrator::Gauss { stages: 8 };

/// What an integrator by a clock needs.
const SIZED: &str =
    "steps of a given size in the time of its clock, or for a wanted accuracy, since it counts them itself";

/// The largest number of steps: `t0 + k h` then still tells times a thousandth of a step apart.
const MOST_STEPS: f64 = (1u64 << 42) as f64;

fn check_count(count: f64) -> Result<(), InputError> {
    if count <= MOST_STEPS {
        return Ok(());
    }
    let remedy = "take longer steps, or a shorter span";
    Err(InputError::TooMany { what: "the number of steps", found: count, most: MOST_STEPS, remedy })
}
