//! Splittings for a drag that is nonlinear in the action.

use super::action_flow::{ActionFlow, ActionMap, Riccati, check_flow, with_slope};
use super::motion::{CompensatedState, Reached, SplittingRun};
use super::separable::SeparableForm;
use crate::numbers::state_words::Saved;
use crate::{
    InputError, PlanEntry, RunSupport, SplittingScheme, State, StepFailure, Stepper, UnresolvedStep,
    integration::SuspectInterval,
};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{Lagrangian, PhasePoint};

/// The stepper of a splitting scheme for `L = v.Mv/2 - V(t, q) + f(z)`, with three exact flows: the kinetic part `A`,
/// the kick `B` of `-V`, and the flow `C` of f, an [`ActionFlow`]. A substep is the symmetric `C B A B C`, each but A
/// over half its length; steps are compositions of it.
///
/// `sigma_d` is the product of the factors `phi'(z)` of C, exact for the step taken. The action is always computed,
/// since it acts on the momentum. A substep has one force evaluation, and consecutive flows C of two substeps are
/// combined.
#[derive(Clone, Debug)]
pub struct ActionSplitting<'a, L, F: ActionFlow, const N: usize> {
    form: SeparableForm<&'a L, N>,
    table: DragTable<F::Map>,
    progress: SplittingRun<N>,
    compensated: bool,
    with_suspects: bool,
}

/// The substeps of a step.
#[derive(Clone, Debug)]
struct DragTable<C> {
    stages: Vec<ActionStage<C>>,
    /// The last map of a step.
    closing: C,
    /// The action at which L is evaluated for the potential, and the value of f there.
    rest: (f64, f64),
}

/// A map of the action, and the `B A B` that follows.
#[derive(Clone, Copy, Debug)]
struct ActionStage<C> {
    action: C,
    half: f64,
    length: f64,
    /// The time of the second kick, relative to the start of the step.
    time: f64,
}

impl<'a, L: Lagrangian<N>, const N: usize> ActionSplitting<'a, L, Riccati, N> {
    /// A splitting from the state `(q, p, z)` at time `t0`, where f is a polynomial of degree two, determined from L.
    ///
    /// # Errors
    /// Those of [`with_flow`](Self::with_flow); [`InputError::Hypothesis`] also where f is not such a polynomial.
    pub fn new(
        lagrangian: &'a L,
        scheme: &SplittingScheme,
        h: f64,
        t0: f64,
        state: PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let flow = Riccati::of(&SeparableForm::read(lagrangian, h, t0, &state)?.lagrangian, t0, &state)?;
        Self::with_flow(lagrangian, &flow, scheme, h, t0, state)
    }
}

impl<'a, L: Lagrangian<N>, F: ActionFlow, const N: usize> ActionSplitting<'a, L, F, N> {
    /// A splitting from the state `(q, p, z)` at time `t0`, with the given flow of f.
    ///
    /// # Errors
    /// [`InputError::Step`] unless h is finite and not 0; [`InputError::Unclaimed`] and [`InputError::FalseClaim`]
    /// where L is not separable; [`InputError::Hypothesis`] where `L_z` depends on time or is not `f'`, where the maps
    /// are not the flow of f, and for a Runge-Kutta-Nyström scheme; [`InputError::Geometry`] where the state is not
    /// finite or M singular; [`InputError::FirstStep`] where V is not defined at the start.
    pub fn with_flow(
        lagrangian: &'a L,
        flow: &F,
        scheme: &SplittingScheme,
        h: f64,
        t0: f64,
        state: PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let form = SeparableForm::read(lagrangian, h, t0, &state)?;
        form.check_steady_drag(t0, &state)?;
        let Some(substeps) = scheme.substeps() else {
            return Err(InputError::Hypothesis {
                hypothesis: "a linear drag gamma z for a Runge-Kutta-Nyström scheme",
            });
        };
        check_flow(flow, &lagrangian, t0, &state)?;
        let mut time = 0.0;
        let mut before = 0.0;
        let stages = substeps.iter().map(|g| {
            time += g;
            let action = flow.over(0.5 * (before + g) * h);
            before = *g;
            ActionStage { action, half: 0.5 * g * h, length: g * h, time: time * h }
        });
        let stages = stages.collect();
        let table = DragTable { stages, closing: flow.over(0.5 * before * h), rest: (state.z, flow.rate(state.z)) };
        let (value, force) = form.first_kick(t0, &state.q, state.z)?;
        let progress = SplittingRun::new(h, t0, scheme.stages(), state, (value - table.rest.1, force));
        Ok(ActionSplitting { form, table, progress, compensated: false, with_suspects: false })
    }

    /// The same with compensated summation (Kahan), as in
    /// [`Splitting::compensated`](crate::splitting::Splitting::compensated).
    pub fn compensated(self) -> Self {
        ActionSplitting { compensated: true, ..self }
    }

    /// The same with compensated summation if the first steps change the state by very little.
    pub(crate) fn compensated_where_tiny(self) -> Self {
        let SplittingRun { h, state, motion, .. } = &self.progress;
        if self.form.has_tiny_steps(*h, state, &motion.force) { self.compensated() } else { self }
    }

    /// The same with the detection of suspect intervals, which takes a tenth of the time.
    pub(crate) fn with_suspects(self) -> Self {
        ActionSplitting { with_suspects: true, ..self }
    }
}

impl<L: Lagrangian<N>, F: ActionFlow, const N: usize> Stepper for ActionSplitting<'_, L, F, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        let ActionSplitting { form, table, progress, compensated, with_suspects } = self;
        match (*compensated, *with_suspects) {
            (false, false) => progress.advance(steps, &|at, n| run::<L, F::Map, N, false, false>(form, table, at, n)),
            (false, true) => progress.advance(steps, &|at, n| run::<L, F::Map, N, false, true>(form, table, at, n)),
            (true, false) => progress.advance(steps, &|at, n| run::<L, F::Map, N, true, false>(form, table, at, n)),
            (true, true) => progress.advance(steps, &|at, n| run::<L, F::Map, N, true, true>(form, table, at, n)),
        }
    }

    fn state(&self) -> State {
        self.progress.state.into()
    }

    fn time(&self) -> f64 {
        self.progress.time_after(0)
    }

    fn sigma(&self) -> f64 {
        self.progress.motion.sigma
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

impl<L: Lagrangian<N>, F: ActionFlow, const N: usize> RunSupport for ActionSplitting<'_, L, F, N> {
    fn work_summary(&self) -> Vec<PlanEntry> {
        super::work_summary(PlanEntry::computed("action z", "the motion depends on it"))
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

/// The motion after this number of further steps, and its state.
#[inline(never)]
fn run<L: Lagrangian<N>, C: ActionMap, const N: usize, const COMPENSATED: bool, const SUSPECTS: bool>(
    form: &SeparableForm<&L, N>,
    table: &DragTable<C>,
    from: &SplittingRun<N>,
    steps: usize,
) -> Reached<N> {
    let (mut m, mut checks, (z, constant)) = (from.motion, from.checks(), table.rest);
    for k in 0..steps {
        let t = from.time_after(k);
        m.sigma = 1.0;
        for stage in &table.stages {
            let momentum = m.p.value;
            apply::<C, N, COMPENSATED>(&mut m, &stage.action);
            m.kick::<true, COMPENSATED>(stage.half);
            let p = m.p.value;
            let v: SVector<f64, N> = form.velocity(&p);
            m.z.add::<COMPENSATED>(|_, _| stage.half * dot(p, v));
            m.q.add::<COMPENSATED>(|i, _| stage.length * v[i]);
            let force = m.force;
            (m.value, m.force) = form.kick(t + stage.time, &m.q.value, z);
            m.check_drift::<SUSPECTS>(&momentum, &force, stage.length, &mut checks);
            m.value -= constant;
            m.kick::<true, COMPENSATED>(stage.half);
        }
        apply::<C, N, COMPENSATED>(&mut m, &table.closing);
    }
    Reached { motion: m, state: m.state(), checks }
}

/// Applies a map of the flow of f, and multiplies `sigma` by its factor.
#[inline(always)]
fn apply<C: ActionMap, const N: usize, const COMPENSATED: bool>(m: &mut CompensatedState<N>, map: &C) {
    let (change, rate) = with_slope(|z| map.change(z), m.z.value[0]);
    m.z.add::<COMPENSATED>(|_, _| change);
    // Always compensated, as for a linear drag.
    m.p.add::<true>(|_, p| rate * p);
    m.sigma *= 1.0 + rate;
}
