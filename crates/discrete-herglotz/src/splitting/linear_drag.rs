//! Splittings for a linear drag.

use super::drag::{Drag, Drift};
use super::motion::{CompensatedState, Reached, SplittingRun};
use super::separable::SeparableForm;
use crate::integration::plan_entry::DECOUPLED;
use crate::numbers::state_words::Saved;
use crate::{
    InputError, PlanEntry, RunSupport, SplittingScheme, State, StepFailure, Stepper, UnresolvedStep,
    integration::SuspectInterval,
};
use contact_geom::numbers::dot;
use contact_geom::{Lagrangian, PhasePoint};

/// The stepper of a splitting scheme for `L = v.Mv/2 - V(t, q) + gamma(t) z`.
///
/// For a constant gamma, the flow of the kinetic part with the drag over a time s is
/// `q += (e^(gamma s) - 1)/gamma M^-1 p`, `p = e^(gamma s) p`; that of `-V` is the kick `p += s L_q`. Each flow is
/// exact, including the action, and is a conformal contact map, with the factors `e^(gamma s)` and 1, so that every
/// step has `sigma_d = e^(gamma h)`. The drag is combined with the kinetic part because this preserves the hypothesis
/// of Runge-Kutta-Nyström schemes. Time advances with the drifts: a kick evaluates V at the time reached by the drifts
/// before it.
///
/// Where L does not claim that its rate is constant, the factor of a drift is `e^g` with the integral g of `L_z` over
/// the drift. Both integrals are computed by a Gauss formula of order 12, and `sigma_d` is the product of these
/// factors.
///
/// The steps are explicit, with [`stages`](SplittingScheme::stages) force evaluations each. The last kick (or drift) of
/// a step and the first of the next are combined: the motion is stored before that kick, and the state is completed on
/// a copy. The results therefore do not depend on what is observed nor on how many steps are taken at once.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::PhasePoint;
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
    check_resolution: bool,
}

/// The stages of a step, scaled to the length of the step and with the drifts for the drag.
#[derive(Clone, Debug)]
pub(crate) struct SubstepTable {
    /// The stages of the first step.
    pub(crate) first: Vec<Stage>,
    /// The stages of a later step: the first kick or drift includes the last one of the previous step.
    pub(crate) joined: Vec<Stage>,
    /// The end of a step: the last kick, and the last drift of a scheme that begins with a drift.
    pub(crate) closing: Stage,
}

/// A kick with the stored force, followed by a drift, after which the force is evaluated again.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    pub(crate) kick: f64,
    pub(crate) drift: Drift,
    /// The duration of the drift.
    pub(crate) span: f64,
    /// The time of the end of the drift, relative to the start of the step.
    pub(crate) time: f64,
}

impl<'a, L: Lagrangian<N>, const N: usize> Splitting<'a, L, N> {
    /// A splitting from the state `(q, p, z)` at time `t0`, with the action.
    ///
    /// # Errors
    /// [`InputError::Step`] unless h is finite and not 0; [`InputError::Unclaimed`] and [`InputError::FalseClaim`]
    /// where L is not separable and affine in z; [`InputError::Geometry`] where the state is not finite or M singular;
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

    /// The same for a separable form that has already been read.
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
        Ok(Splitting { form, drag, table, progress, action: true, compensated: false, check_resolution: false })
    }

    /// The same without the action: z keeps its initial value and is not computed.
    pub fn without_action(self) -> Self {
        Splitting { action: false, ..self }
    }

    /// The same with compensated summation (Kahan): the round-off of each step is carried to the next, so that it does
    /// not grow with the number of steps. It adds about 10% to the time for the pendulum, and pays off in long runs
    /// with errors near round-off.
    pub fn compensated(self) -> Self {
        Splitting { compensated: true, ..self }
    }

    /// The same with compensated summation if the first steps change the state by very little.
    pub(crate) fn compensated_where_tiny(self) -> Self {
        let SplittingRun { h, state, motion, .. } = &self.progress;
        if self.form.has_tiny_steps(*h, state, &motion.force) { self.compensated() } else { self }
    }

    /// The same with a check of each drift whether it resolves the motion, for [`unresolved`](RunSupport::unresolved). The
    /// check adds a sixth to the time of a Kepler orbit, a third to that of a pendulum and up to twice the time of an
    /// oscillator; it is intended for motions that are not known in advance.
    pub fn with_resolution_check(self) -> Self {
        Splitting { check_resolution: true, ..self }
    }
}

impl SubstepTable {
    /// The stages of a scheme for steps of length h. For a time-dependent drag the drifts stored here are those from
    /// `t0`, and each step computes its own.
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
        // A scheme ends with a drift if and only if it begins with one.
        let (last_kick, last_drift) = (kicks[stages], drifts.get(stages).copied().unwrap_or(0.0));
        let mut joined = first.clone();
        joined[0] = stage(last_kick + kicks[0], last_drift + drifts[0], first[0].time);
        SubstepTable { first, joined, closing: stage(last_kick, last_drift, h) }
    }
}

impl<L: Lagrangian<N>, const N: usize> Stepper for Splitting<'_, L, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        let Splitting { form, drag, table, progress, action, compensated, check_resolution } = self;
        let maps = StepMaps { form, drag, table, checked: *check_resolution };
        match (*action, *compensated) {
            (false, false) => maps.advance::<false, false>(progress, steps),
            (false, true) => maps.advance::<false, true>(progress, steps),
            (true, false) => maps.advance::<true, false>(progress, steps),
            (true, true) => maps.advance::<true, true>(progress, steps),
        }
    }

    fn state(&self) -> State {
        self.progress.state.into()
    }

    fn time(&self) -> f64 {
        self.progress.time_after(0)
    }

    fn sigma(&self) -> f64 {
        let SplittingRun { taken, t0, h, .. } = self.progress;
        let Some(before) = taken.checked_sub(1) else { return 1.0 };
        StepMaps { form: &self.form, drag: &self.drag, table: &self.table, checked: false }
            .sigma(t0 + before as f64 * h, h)
    }

    fn evaluations(&self) -> u64 {
        self.progress.evaluations()
    }

    fn run_support(&self) -> Option<&dyn RunSupport> {
        Some(self)
    }

    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        Some(self)
    }
}

impl<L: Lagrangian<N>, const N: usize> RunSupport for Splitting<'_, L, N> {
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
        self.progress.monitor.steps.first
    }

    fn suspect_interval(&mut self) -> Option<SuspectInterval> {
        self.progress.monitor.suspect.take()
    }
}

/// The maps that a step consists of.
struct StepMaps<'s, 'a, L, const N: usize> {
    form: &'s SeparableForm<&'a L, N>,
    drag: &'s Drag<N>,
    table: &'s SubstepTable,
    /// Whether each drift is checked.
    checked: bool,
}

impl<L: Lagrangian<N>, const N: usize> StepMaps<'_, '_, L, N> {
    fn advance<const ACTION: bool, const COMPENSATED: bool>(
        &self,
        progress: &mut SplittingRun<N>,
        steps: usize,
    ) -> Result<(), StepFailure> {
        match self.drag {
            Drag::Constant(_) if self.checked => {
                progress.advance(steps, &|at, n| self.run::<ACTION, COMPENSATED, false, true>(at, n))
            }
            Drag::Constant(_) => progress.advance(steps, &|at, n| self.run::<ACTION, COMPENSATED, false, false>(at, n)),
            Drag::Timed { .. } => progress.advance(steps, &|at, n| self.run::<ACTION, COMPENSATED, true, true>(at, n)),
        }
    }

    /// The motion after this number of further steps, and its completed state. `CHECKED` is whether drifts may be checked; it
    /// is a constant, since the check of a drift costs as much as the drift, but for a drag in time, whose drifts cost more.
    #[inline(never)]
    fn run<const ACTION: bool, const COMPENSATED: bool, const TIMED: bool, const CHECKED: bool>(
        &self,
        from: &SplittingRun<N>,
        steps: usize,
    ) -> Reached<N> {
        let StepMaps { form, table, .. } = self;
        let (mut m, mut checks) = (from.motion, from.checks());
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
                    if CHECKED && self.checked {
                        m.check_drift::<true>(&momentum, &force, stage.span, &mut checks);
                    }
                }
            }
        }
        let mut end = m;
        self.kick_and_drift::<ACTION, COMPENSATED, TIMED>(&mut end, from.time_after(steps - 1), &table.closing);
        Reached { motion: m, state: end.state(), checks }
    }

    /// `sigma_d` of the step from the time t. It is computed on request, since for a time-dependent drag it costs as
    /// much as the drifts.
    fn sigma(&self, t: f64, h: f64) -> f64 {
        if let Drag::Constant(gamma) = self.drag {
            return (gamma * h).exp();
        }
        let stages = self.table.first.iter().chain([&self.table.closing]);
        stages.map(|stage| 1.0 + self.drift_of::<true>(t, stage).damping).product()
    }

    /// The drift of a stage of the step from the time t. `TIMED` is a constant, because a branch on the drag in each
    /// stage would cost a fifth of a Strang step.
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
            m.z.add::<COMPENSATED>(|_, z| drift.damping * z + drift.lift * dot(p, v));
        }
        m.q.add::<COMPENSATED>(|i, _| drift.length * v[i]);
        // Always compensated: the round-off of the drag is the same function of p in all steps and would accumulate.
        m.p.add::<true>(|_, p| drift.damping * p);
    }
}
