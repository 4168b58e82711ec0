//! Splittings with a drag of the velocity, an applied force.

use super::motion::{CompensatedState, Reached, SplittingRun};
use super::separable::SeparableForm;
use super::velocity_drag_flow::{DragFlow, DragLaw};
use crate::integration::plan_entry::DECOUPLED;
use crate::numbers::state_words::Saved;
use crate::splitting::linear_drag::{Stage, SubstepTable};
use crate::{
    InputError, PlanEntry, RunSupport, SplittingScheme, State, StepFailure, Stepper, UnresolvedStep,
    integration::SuspectInterval, splitting::drag::Drift,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{ForceStructure, Lagrangian, PhasePoint, VelocityPoint};

/// The stepper of a splitting scheme for `L = v.Mv/2 - V(t, q) + gamma z` with an applied force of the form
/// `f_i(t, q) - c_i v_i - k |v| v_i` ([`ForceStructure::Drag`]).
///
/// The part f(t, q) is added to the kicks. The drag is combined with the kinetic part and with the drag `gamma z`, whose
/// common flow has a closed form: for a diagonal M if k = 0, and otherwise for a multiple of the identity and equal
/// `c_i`. With `a = c/m - gamma`, `b = k/m^2` and `d(s) = (1 - e^(-a s))/a` it is
///
/// `p(s) = p e^(-a s) / (1 + b |p| d)`, `q(s) = q + p/m ln(1 + b |p| d)/(b |p|)`.
///
/// The action of the quadratic drag is computed by a Gauss formula of order 12. For k = 0 the flow is linear in the
/// momentum, which is the hypothesis of Runge-Kutta-Nyström schemes; they are refused otherwise. The steps have
/// `sigma_d = e^(gamma h)`, the factor of L, and the virtual work of the force as their contact defect. Sums are
/// compensated.
#[derive(Clone, Debug)]
pub struct DragSplitting<'a, L, const N: usize> {
    form: SeparableForm<&'a L, N>,
    gamma: f64,
    table: [Vec<(Stage, DragFlow<N>)>; 3],
    progress: SplittingRun<N>,
    action: bool,
    check_resolution: bool,
}

// The parts of a table: the stages of the first step, those of a later one, and the end of a step.
const FIRST: usize = 0;
const JOINED: usize = 1;
const CLOSING: usize = 2;

/// Checks that the structure of a Lagrangian and of its force allows a splitting scheme, apart from the mass matrix.
///
/// # Errors
/// [`InputError::Forced`].
pub(super) fn check_force<L: Lagrangian<N>, const N: usize>(lagrangian: &L, nystrom: bool) -> Result<(), InputError> {
    if const { !L::HINTS.forced } {
        return Ok(());
    }
    let refused = |method| Err(InputError::Forced { method });
    let force = lagrangian.force_structure();
    if force.is_of_positions() {
        return Ok(());
    }
    let ForceStructure::Drag { linear, quadratic } = force else { return refused("a splitting") };
    if !lagrangian.structure().has_constant_rate() {
        return refused("a splitting with a rate L_z that is not constant");
    }
    if quadratic != 0.0 && nystrom {
        return refused("a Runge-Kutta-Nyström splitting");
    }
    if quadratic != 0.0 && linear.iter().any(|c| *c != linear[0]) {
        return refused("a splitting with different linear drags beside a quadratic one");
    }
    Ok(())
}

impl<'a, L: Lagrangian<N>, const N: usize> DragSplitting<'a, L, N> {
    /// A splitting from the state `(q, p, z)` at time `t0`, with the action.
    ///
    /// # Errors
    /// Those of [`Splitting::new`](crate::splitting::Splitting::new); [`InputError::Forced`] for a force or a mass
    /// matrix of another form, and for a Runge-Kutta-Nyström scheme with a quadratic drag.
    pub fn new(
        lagrangian: &'a L,
        scheme: &SplittingScheme,
        h: f64,
        t0: f64,
        state: PhasePoint<N>,
    ) -> Result<Self, InputError> {
        Self::of(SeparableForm::read_of(lagrangian, h, t0, &state, false)?, scheme, h, t0, state)
    }

    /// The same for a separable form that has already been read.
    pub(crate) fn of(
        form: SeparableForm<&'a L, N>,
        scheme: &SplittingScheme,
        h: f64,
        t0: f64,
        state: PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let structure = form.lagrangian.structure();
        if !structure.is_affine_in_z() {
            return Err(InputError::Unclaimed { claim: "z_affine" });
        }
        if !structure.has_constant_rate() {
            return Err(InputError::Unclaimed { claim: "constant_rate" });
        }
        check_force(form.lagrangian, scheme.is_nystrom())?;
        let rest = VelocityPoint { q: state.q, v: SVector::zeros(), z: state.z };
        let law = DragLaw::of(&form, t0, &rest)?;
        let gamma = law.gamma;
        let kick = form.first_kick(t0, &state.q, 0.0)?;
        let SubstepTable { first, joined, closing } = SubstepTable::new(scheme, h, |s| Drift::constant(gamma, s));
        let with_flow = |stages: Vec<Stage>| stages.into_iter().map(|stage| (stage, law.over(stage.span))).collect();
        let table = [with_flow(first), with_flow(joined), with_flow(vec![closing])];
        let progress = SplittingRun::new(h, t0, scheme.stages(), state, kick);
        Ok(DragSplitting { form, gamma, table, progress, action: true, check_resolution: false })
    }

    /// The same without the action: z keeps its initial value and is not computed.
    pub fn without_action(self) -> Self {
        DragSplitting { action: false, ..self }
    }

    /// The same with a check of each drift whether it resolves the motion, for [`unresolved`](RunSupport::unresolved).
    pub fn with_resolution_check(self) -> Self {
        DragSplitting { check_resolution: true, ..self }
    }
}

impl<L: Lagrangian<N>, const N: usize> Stepper for DragSplitting<'_, L, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        let DragSplitting { form, table, progress, action, check_resolution, .. } = self;
        match (*action, *check_resolution) {
            (false, false) => progress.advance(steps, &|at, n| run::<L, N, false, false>(form, table, at, n)),
            (false, true) => progress.advance(steps, &|at, n| run::<L, N, false, true>(form, table, at, n)),
            (true, false) => progress.advance(steps, &|at, n| run::<L, N, true, false>(form, table, at, n)),
            (true, true) => progress.advance(steps, &|at, n| run::<L, N, true, true>(form, table, at, n)),
        }
    }

    fn state(&self) -> State {
        self.progress.state.into()
    }

    fn time(&self) -> f64 {
        self.progress.time_after(0)
    }

    fn sigma(&self) -> f64 {
        if self.progress.taken == 0 { 1.0 } else { (self.gamma * self.progress.h).exp() }
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

impl<L: Lagrangian<N>, const N: usize> RunSupport for DragSplitting<'_, L, N> {
    fn has_constant_rate(&self) -> bool {
        true
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

/// The motion after this number of further steps, and its completed state.
#[inline(never)]
fn run<L: Lagrangian<N>, const N: usize, const ACTION: bool, const CHECKED: bool>(
    form: &SeparableForm<&L, N>,
    table: &[Vec<(Stage, DragFlow<N>)>; 3],
    from: &SplittingRun<N>,
    steps: usize,
) -> Reached<N> {
    let (mut m, mut checks) = (from.motion, from.checks());
    let first = usize::from(from.taken == 0);
    for (stages, range) in [(&table[FIRST], 0..first), (&table[JOINED], first..steps)] {
        for k in range {
            let t = from.time_after(k);
            for (stage, flow) in stages {
                let (momentum, force) = (m.p.value, m.force);
                kick_and_drift::<N, ACTION>(&mut m, stage, flow);
                if ACTION {
                    (m.value, m.force) = form.kick(t + stage.time, &m.q.value, 0.0);
                } else {
                    m.force = form.force(t + stage.time, &m.q.value, 0.0);
                }
                if CHECKED {
                    m.check_drift::<true>(&momentum, &force, stage.span, &mut checks);
                }
            }
        }
    }
    let mut end = m;
    for (stage, flow) in &table[CLOSING] {
        kick_and_drift::<N, ACTION>(&mut end, stage, flow);
    }
    Reached { motion: m, state: end.state(), checks }
}

#[inline(always)]
fn kick_and_drift<const N: usize, const ACTION: bool>(m: &mut CompensatedState<N>, stage: &Stage, flow: &DragFlow<N>) {
    m.kick::<ACTION, true>(stage.kick);
    let p = m.p.value;
    if ACTION {
        let lift = flow.lift(&p);
        m.z.add::<true>(|_, z| flow.growth() * z + lift);
    }
    let [shift, change] = flow.changes(&p);
    m.q.add::<true>(|i, _| shift[i]);
    m.p.add::<true>(|i, _| change[i]);
}
