//! Splittings where the drag is linear.

use super::drag::{Drag, Drift};
use super::motion::{CompensatedState, Reached, SplittingRun};
use super::separable::SeparableForm;
use crate::integration::plan_entry::DECOUPLED;
use crate::numbers::state_words::Saved;
use crate::{
    InputError, PlanEntry, SplittingScheme, StepFailure, Stepper, UnresolvedStep, integration::SuspectInterval,
};
use contact_geom::{Lagrangian, PhasePoint};

/// A splitting at work on `L = v.Mv/2 - V(t, q) + gamma(t) z`.
///
/// The flow of the kinetic part with the drag, over a time s, is `q += (e^(gamma s) - 1)/gamma M^-1 p`,
/// `p = e^(gamma s) p` for a constant gamma; that of `-V` is the kick `p += s L_q`; each is exact, with its action, and is a
/// conformal contact map, of rate `e^(gamma s)` and 1. So every step has `sigma_d = e^(gamma h)`. The drag goes with the
/// kinetic part because that keeps the hypothesis of Runge-Kutta-Nyström schemes. Time goes with it too: a kick takes V at
/// the time of the drifts before it.
///
/// Where L does not claim that its rate is constant, the rate of a drift is `e^g`, where g is the integral of `L_z` over it,
/// and both integrals are taken by a Gauss formula of order 12; `sigma_d` is the product of these rates.
///
/// Explicit, with [`stages`](SplittingScheme::stages) forces a step. The last kick of a step and the first of the next (or its
/// drifts) are one: the motion is kept before it, and a state that is asked for is completed on a copy. So the numbers do not
/// depend on what is observed, and on how many steps are taken at once.
///
/// ```
/// use contact_geom::{PhasePoint, systems::Pendulum};
/// use discrete_herglotz::{SplittingScheme, Stepper, splitting::Splitting};
/// let pendulum = Pendulum { gamma: -0.1 };
/// let start = PhasePoint::new([1.0], [1.0], 0.0);
/// let mut motion = Splitting::new(&pendulum, &SplittingScheme::BLANES_MOAN_6, 0.5, 0.0, start)?;
/// assert!(motion.advance(200).is_ok());
/// println!("q(100) = {}", motion.state().q[0]);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Splitting<'a, L, const N: usize> {
    form: SeparableForm<&'a L, N>,
    drag: Drag<N>,
    table: SubstepTable,
    progress: SplittingRun<N>,
    action: bool,
    compensated: bool,
    watched: bool,
}

/// The stages of a step, in the lengths of this step and this drag.
#[derive(Clone, Debug)]
pub(crate) struct SubstepTable {
    /// Those of the first step.
    pub(crate) first: Vec<Stage>,
    /// Those of a later one: its first kick, or its first drift, is one with the last of the step before.
    pub(crate) joined: Vec<Stage>,
    /// What completes a step: the last kick, and the last drift of a scheme that begins with one.
    pub(crate) closing: Stage,
}

/// A kick, with the force that the motion holds, and the drift that follows; there the force is taken anew.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    pub(crate) kick: f64,
    pub(crate) drift: Drift,
    /// The length of the drift in time.
    pub(crate) span: f64,
    /// The time of its end after the step's start.
    pub(crate) time: f64,
}

impl<'a, L: Lagrangian<N>, const N: usize> Splitting<'a, L, N> {
    /// A splitting from the state `(q, p, z)` at time `t0`, with the action.
    ///
    /// # Errors
    /// [`InputError::Step`] unless h is finite and not 0; [`InputError::Unclaimed`] and [`InputError::FalseClaim`] where L
    /// is not separable and affine in z; [`InputError::Geometry`] where the state is not finite or M singular;
    /// [`InputError::FirstStep`] where V is not defined at the start.
    pub fn new(
        lagrangian: &'a L,
        scheme: &SplittingScheme,
        h: f64,
        t0: f64,
        state: PhasePoint<N>,
    ) -> Result<Self, InputError> {
        Self::of(SeparableForm::read(lagrangian, h, t0, &state)?, scheme, h, t0, state)
    }

    /// The same of a form that was read.
    pub(crate) fn of(
        form: SeparableForm<&'a L, N>,
        scheme: &SplittingScheme,
        h: f64,
        t0: f64,
        state: PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let lagrangian = form.lagrangian;
        let drag = Drag::of(&form, t0, &state)?;
        let kick = form.first_kick(t0, &state.q, 0.0)?;
        let table = SubstepTable::new(scheme, h, |s| drag.drift(&lagrangian, t0, s));
        let progress = SplittingRun::new(h, t0, scheme.stages(), state, kick);
        Ok(Splitting { form, drag, table, progress, action: true, compensated: false, watched: false })
    }

    /// Without the action: z stays what it is at the start, and costs nothing.
    pub fn without_action(self) -> Self {
        Splitting { action: false, ..self }
    }

    /// With compensated sums (Kahan's): the rounding of each step is carried to the next, so that it no longer grows with
    /// the number of steps. Worth its cost, about a tenth of the pendulum's time, on long runs near round-off.
    pub fn compensated(self) -> Self {
        Splitting { compensated: true, ..self }
    }

    /// With compensated sums where the steps from the start are tiny.
    pub(crate) fn compensated_where_tiny(self) -> Self {
        let SplittingRun { h, state, motion, .. } = &self.progress;
        if self.form.has_tiny_steps(*h, state, &motion.force) { self.compensated() } else { self }
    }

    /// With a look at each drift whether it resolves the motion, for [`unresolved`](Stepper::unresolved). It costs a sixth of the
    /// time of a Kepler orbit, a third of a pendulum's and up to twice an oscillator's more, so it is for motions that are not known.
    pub fn watched(self) -> Self {
        Splitting { watched: true, ..self }
    }
}

impl SubstepTable {
    /// Of a drag that depends on time the drifts are those from `t0`; each step makes its own.
    pub(crate) fn new(scheme: &SplittingScheme, h: f64, drift: impl Fn(f64) -> Drift) -> Self {
        let (drifts, kicks) = scheme.coefficients();
        let stages = scheme.stages();
        let stage =
            |kick: f64, span: f64, time: f64| Stage { kick: kick * h, drift: drift(span * h), span: span * h, time };
        let mut time = 0.0;
        let first: Vec<Stage> = (0..stages)
            .map(|i| {
                time += drifts[i];
                stage(kicks[i], drifts[i], time * h)
            })
            .collect();
        // Only a scheme that begins with a drift ends with one.
        let (last_kick, last_drift) = (kicks[stages], drifts.get(stages).copied().unwrap_or(0.0));
        let mut joined = first.clone();
        joined[0] = stage(last_kick + kicks[0], last_drift + drifts[0], first[0].time);
        SubstepTable { first, joined, closing: stage(last_kick, last_drift, h) }
    }
}

impl<L: Lagrangian<N>, const N: usize> Stepper<N> for Splitting<'_, L, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        let Splitting { form, drag, table, progress, action, compensated, watched } = self;
        let maps = StepMaps { form, drag, table };
        match (*action, *compensated) {
            (false, false) => maps.advance::<false, false>(progress, steps, *watched),
            (false, true) => maps.advance::<false, true>(progress, steps, *watched),
            (true, false) => maps.advance::<true, false>(progress, steps, *watched),
            (true, true) => maps.advance::<true, true>(progress, steps, *watched),
        }
    }

    fn state(&self) -> PhasePoint<N> {
        self.progress.state
    }

    fn time(&self) -> f64 {
        self.progress.time_after(0)
    }

    fn sigma(&self) -> f64 {
        let SplittingRun { taken, t0, h, .. } = self.progress;
        let Some(before) = taken.checked_sub(1) else { return 1.0 };
        StepMaps { form: &self.form, drag: &self.drag, table: &self.table }.sigma(t0 + before as f64 * h, h)
    }

    fn evaluations(&self) -> u64 {
        self.progress.evaluations()
    }

    fn has_constant_rate(&self) -> bool {
        matches!(self.drag, Drag::Constant(_))
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        super::work_summary(PlanEntry::skipped("action z", DECOUPLED))
    }

    fn save(&self) -> Option<Vec<u64>> {
        let mut words = Vec::new();
        Saved::save(&self.progress, &mut words);
        Some(words)
    }

    fn restore(&mut self, mut words: &[u64]) -> bool {
        self.progress.load(&mut words).is_some() && words.is_empty()
    }

    fn unresolved(&self) -> Option<UnresolvedStep> {
        self.progress.watch.first
    }

    fn suspect_interval(&mut self) -> Option<SuspectInterval<N>> {
        self.progress.watch.doubt.take()
    }
}

/// What a step consists of.
struct StepMaps<'s, 'a, L, const N: usize> {
    form: &'s SeparableForm<&'a L, N>,
    drag: &'s Drag<N>,
    table: &'s SubstepTable,
}

impl<L: Lagrangian<N>, const N: usize> StepMaps<'_, '_, L, N> {
    fn advance<const ACTION: bool, const COMPENSATED: bool>(
        &self,
        progress: &mut SplittingRun<N>,
        steps: usize,
        watched: bool,
    ) -> Result<(), StepFailure> {
        match (self.drag, watched) {
            (Drag::Constant(_), false) => {
                progress.advance(steps, |at, n| self.run::<ACTION, COMPENSATED, false, false>(at, n))
            }
            (Drag::Constant(_), true) => {
                progress.advance(steps, |at, n| self.run::<ACTION, COMPENSATED, false, true>(at, n))
            }
            (Drag::Timed { .. }, false) => {
                progress.advance(steps, |at, n| self.run::<ACTION, COMPENSATED, true, false>(at, n))
            }
            (Drag::Timed { .. }, true) => {
                progress.advance(steps, |at, n| self.run::<ACTION, COMPENSATED, true, true>(at, n))
            }
        }
    }

    /// The motion after some steps more, and the state that it then stands for.
    #[inline(never)]
    fn run<const ACTION: bool, const COMPENSATED: bool, const TIMED: bool, const WATCHED: bool>(
        &self,
        from: &SplittingRun<N>,
        steps: usize,
    ) -> Reached<N> {
        let StepMaps { form, table, .. } = self;
        let (mut m, mut seen) = (from.motion, from.seen());
        let first = usize::from(from.taken == 0);
        for (stages, range) in [(&table.first, 0..first), (&table.joined, first..steps)] {
            for k in range {
                let t = from.time_after(k);
                for stage in stages {
                    let (momentum, force) = (m.p.value, m.force);
                    self.kick_and_drift::<ACTION, COMPENSATED, TIMED>(&mut m, t, stage);
                    if ACTION {
                        (m.value, m.force) = form.kick(t + stage.time, &m.q.value, 0.0);
                    } else {
                        m.force = form.force(t + stage.time, &m.q.value, 0.0);
                    }
                    if WATCHED {
                        m.look::<true>(&momentum, &force, stage.span, &mut seen);
                    }
                }
            }
        }
        let mut end = m;
        self.kick_and_drift::<ACTION, COMPENSATED, TIMED>(&mut end, from.time_after(steps - 1), &table.closing);
        Reached { motion: m, state: end.state(), seen }
    }

    /// `sigma_d` of the step from the time t. Found where it is asked for: of a drag in time it costs as much as the drifts.
    fn sigma(&self, t: f64, h: f64) -> f64 {
        if let Drag::Constant(gamma) = self.drag {
            return (gamma * h).exp();
        }
        let stages = self.table.first.iter().chain([&self.table.closing]);
        stages.map(|stage| 1.0 + self.drift_of::<true>(t, stage).damping).product()
    }

    /// The drift of a stage of the step from the time t. A look at the drag in each stage would cost a fifth of a Strang step.
    #[inline(always)]
    fn drift_of<const TIMED: bool>(&self, t: f64, stage: &Stage) -> Drift {
        if TIMED {
            self.drag.drift(&self.form.lagrangian, t + (stage.time - stage.span), stage.span)
        } else {
            stage.drift
        }
    }

    #[inline(always)]
    fn kick_and_drift<const ACTION: bool, const COMPENSATED: bool, const TIMED: bool>(
        &self,
        m: &mut CompensatedState<N>,
        t: f64,
        stage: &Stage,
    ) {
        m.kick::<ACTION, COMPENSATED>(stage.kick);
        let drift = self.drift_of::<TIMED>(t, stage);
        let p = m.p.value;
        let v = self.form.velocity(&p);
        if ACTION {
            m.z.add::<COMPENSATED>(|_, z| drift.damping * z + drift.lift * p.dot(&v));
        }
        m.q.add::<COMPENSATED>(|i, _| drift.length * v[i]);
        // What rounding takes from the drag is the same function of p in all steps, and piles up; it is carried on.
        m.p.add::<true>(|_, p| drift.damping * p);
    }
}
