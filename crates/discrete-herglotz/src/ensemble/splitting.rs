//! Splittings for many motions in SIMD lanes.

use crate::ensemble::lane::{Lane, LaneOptions, interrupt};
use crate::ensemble::members::LaneKernel;
use crate::integration::interrupt::STEPS_BETWEEN_QUERIES;
use crate::numbers::instructions::Instructions;
use crate::numbers::simd_batch::SimdBatch;
use crate::resolution::thresholds::{DRIFT_MARGIN_IN_LANES, POSITION_ROUND_OFF};
use crate::splitting::drag::{Drag, Drift};
use crate::splitting::linear_drag::{Stage, SubstepTable};
use crate::splitting::separable::SeparableForm;
use crate::{InputError, Interrupt, SplittingScheme, State, Vector};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, VelocityPoint, numbers::max_abs_or_nan, vector};
use pulp::{Simd, WithSimd};
use std::borrow::Cow;

/// The steps of a [`Splitting`](crate::splitting::Splitting), for many motions of one Lagrangian.
pub(crate) struct SplittingPacks<'a, L, const N: usize> {
    form: SeparableForm<&'a L, N>,
    drag: Drag<N>,
    table: SubstepTable,
    check: DriftCheck,
    h: f64,
    t0: f64,
    steps: usize,
    interrupt: Option<Interrupt<'a>>,
}

/// The check whether a step resolves the motion, at its longest drift.
///
/// A single run monitors all drifts, which takes a third of its time. Two consecutive drifts of lengths s1, s2 that it
/// flags as unresolved satisfy `omega^2 (s1^2 + s2^2) > 1` for an oscillation of frequency omega (see
/// `resolution/monitor.rs`). In the longest drift, of length s, the change of the force times s then exceeds the
/// fraction `s^2/(s1^2+s2^2)` of the momentum. A member for which this holds has a run of its own, which decides.
struct DriftCheck {
    /// The index of the drift, and its length.
    stage: usize,
    span: f64,
    /// The square of this change, relative to the momentum, above which a step is suspect.
    turn: f64,
}

/// The factor by which the square of the largest momentum for this comparison decreases from step to step: a force that
/// acts near a turning point is compared with the momenta of neighbouring steps.
const MOMENTUM_MEMORY: f64 = 0.9;

impl DriftCheck {
    fn new(table: &SubstepTable) -> Self {
        let squares = || table.joined.iter().map(|stage| stage.span * stage.span);
        let (mut stage, mut longest) = (0, 0.0);
        for (i, square) in squares().enumerate() {
            if square > longest {
                (stage, longest) = (i, square);
            }
        }
        let pairs = squares().zip(squares().cycle().skip(1)).map(|(a, b)| a + b);
        let turn = DRIFT_MARGIN_IN_LANES * longest / max_abs_or_nan(pairs);
        DriftCheck { stage, span: longest.sqrt(), turn: turn * turn }
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> SplittingPacks<'a, L, N> {
    /// The kernel for a Lagrangian, whose constants are read at a start.
    pub fn new(
        lagrangian: &'a L,
        scheme: &SplittingScheme,
        (h, steps): (f64, usize),
        t0: f64,
        state: &PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let form = SeparableForm::read(lagrangian, h, t0, state)?;
        let drag = Drag::of(&form, t0, state)?;
        let table = SubstepTable::new(scheme, h, |s| drag.drift(&lagrangian, t0, s));
        let check = DriftCheck::new(&table);
        Ok(SplittingPacks { form, drag, table, check, h, t0, steps, interrupt: None })
    }
}

impl<L: Lagrangian<N> + Sync, const N: usize> LaneKernel for SplittingPacks<'_, L, N> {
    /// Whether a single run would use compensated sums for a motion.
    fn needs_single_run(&self, state: &State) -> bool {
        let state: PhasePoint<N> = state.fixed();
        self.form.has_tiny_steps(self.h, &state, &self.form.force(self.t0, &state.q, state.z))
    }

    /// Takes all steps of some motions in place, and records a state after every `rows` steps. If a motion is not
    /// finite at its start or at its end, its final state is not finite.
    fn run(&self, instructions: Instructions, lanes: &mut [Lane], action: bool, options: LaneOptions) {
        let stride = options.rows.unwrap_or(self.steps);
        let checked = options.check_resolution.then_some(self.check.stage);
        match action {
            true => instructions.dispatch(All::<_, N, true> { packs: self, lanes, stride, checked }),
            false => instructions.dispatch(All::<_, N, false> { packs: self, lanes, stride, checked }),
        }
    }
}

/// The largest number of packs that compute a stage one after the other: while one waits for its results, the work of
/// the next ones fills the pipeline. Their data fit into the first-level cache.
const PACKS_IN_FLIGHT: usize = 4;

/// All motions of a slice in the lanes of one instruction set.
struct All<'s, 'a, L, const N: usize, const ACTION: bool> {
    packs: &'s SplittingPacks<'a, L, N>,
    lanes: &'s mut [Lane],
    /// The number of steps from one recorded state to the next.
    stride: usize,
    /// The stage whose drift is checked, if one is.
    checked: Option<usize>,
}

impl<L: Lagrangian<N>, const N: usize, const ACTION: bool> WithSimd for All<'_, '_, L, N, ACTION> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let All { packs, lanes, stride, checked } = self;
        // The registers of a pack share the constants that a stage reads; if a pack had more registers than the
        // processor, they would be spilled to memory.
        if const { N == 1 } {
            packs.all::<S, 4, ACTION>(lanes, stride, checked);
        } else {
            packs.all::<S, 2, ACTION>(lanes, stride, checked);
        }
    }
}

/// The state that a step advances, as [`Motion`](crate::splitting) for a single motion.
#[derive(Clone, Copy)]
struct Pack<S: Simd, const K: usize, const N: usize> {
    q: SVector<SimdBatch<S, K>, N>,
    p: SVector<SimdBatch<S, K>, N>,
    /// The accumulated round-off of the damping of p.
    carry: SVector<SimdBatch<S, K>, N>,
    z: SimdBatch<S, K>,
    force: SVector<SimdBatch<S, K>, N>,
    value: SimdBatch<S, K>,
    /// The square of the largest momentum of the last steps, and 1 in lanes with a suspect step.
    fast: SimdBatch<S, K>,
    suspect: SimdBatch<S, K>,
}

impl<S: Simd, const K: usize, const N: usize> Pack<S, K, N> {
    /// The pack of some motions; lanes beyond the last motion repeat it. Not inlined: it is called once for many steps.
    #[inline(never)]
    fn from_lanes(members: &[Lane]) -> Self {
        let of = |f: &dyn Fn(&State) -> f64| {
            SimdBatch::from_lanes(|i| members.get(i).or(members.last()).map_or(0.0, |lane| f(&lane.state)))
        };
        let (q, p) = (SVector::from_fn(|d, _| of(&|at| at.q[d])), SVector::from_fn(|d, _| of(&|at| at.p[d])));
        Pack { q, p, z: of(&|at| at.z), ..Self::zero() }
    }

    #[inline(always)]
    fn zero() -> Self {
        let (zero, still) = (SimdBatch::splat(0.0), vector!(|_| SimdBatch::splat(0.0)));
        Pack { q: still, p: still, carry: still, z: zero, force: still, value: zero, fast: zero, suspect: zero }
    }

    /// The state in a lane. Not inlined: it is called for rows alone.
    #[inline(never)]
    fn state(&self, i: usize) -> State {
        let of = |x: &SVector<SimdBatch<S, K>, N>| Vector::from_fn(N, |d| x[d].lanes()[i]);
        State { q: of(&self.q), p: of(&self.p), z: self.z.lanes()[i] }
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> SplittingPacks<'a, L, N> {
    /// Sets an interrupt that is polled during the steps; members that it ends count as not completed.
    pub fn with_interrupt(self, interrupt: Option<Interrupt<'a>>) -> Self {
        Self { interrupt, ..self }
    }

    #[inline(always)]
    fn all<S: Simd, const K: usize, const ACTION: bool>(
        &self,
        lanes: &mut [Lane],
        stride: usize,
        checked: Option<usize>,
    ) {
        let width = SimdBatch::<S, K>::COUNT;
        for members in lanes.chunks_mut(PACKS_IN_FLIGHT * width) {
            let mut in_flight = [Pack::zero(); PACKS_IN_FLIGHT];
            let in_flight = &mut in_flight[..members.len().div_ceil(width)];
            for (own, m) in members.chunks(width).zip(in_flight.iter_mut()) {
                *m = Pack::from_lanes(own);
            }
            let whole = self.take_steps::<S, K, ACTION>(in_flight, stride, checked, |t, w, at| {
                for (i, lane) in members.iter_mut().skip(w * width).take(width).enumerate() {
                    lane.record(t, at.state(i));
                    lane.suspect = at.suspect.lanes()[i] != 0.0;
                }
            });
            if !whole {
                interrupt(members);
            }
        }
    }

    /// Takes all steps, with the operations of a single run in the same order. `record` is called after each stride and
    /// at the end. Returns false if it was interrupted.
    #[inline(always)]
    fn take_steps<S: Simd, const K: usize, const ACTION: bool>(
        &self,
        in_flight: &mut [Pack<S, K, N>],
        stride: usize,
        checked: Option<usize>,
        mut record: impl FnMut(f64, usize, &Pack<S, K, N>),
    ) -> bool {
        let SplittingPacks { t0, h, steps, .. } = self;
        let mut table = Cow::Borrowed(&self.table);
        for m in in_flight.iter_mut() {
            self.take_force::<S, K, ACTION>(m, *t0);
        }
        let mut taken = 0;
        while taken < *steps {
            let next = taken.saturating_add(stride).min(*steps);
            for k in taken..next {
                if k % STEPS_BETWEEN_QUERIES == 0 && self.interrupt.is_some_and(Interrupt::is_requested) {
                    return false;
                }
                let t = t0 + k as f64 * h;
                self.set_time(&mut table, t);
                let stages = if k == 0 { &table.first } else { &table.joined };
                for (i, stage) in stages.iter().enumerate() {
                    let time = t + stage.time;
                    if checked == Some(i) {
                        for m in in_flight.iter_mut() {
                            let before = m.force;
                            self.kick_and_drift::<S, K, ACTION>(m, stage);
                            self.take_force::<S, K, ACTION>(m, time);
                            self.check_drift(m, &before);
                        }
                        continue;
                    }
                    for m in in_flight.iter_mut() {
                        self.kick_and_drift::<S, K, ACTION>(m, stage);
                        self.take_force::<S, K, ACTION>(m, time);
                    }
                }
            }
            taken = next;
            for (w, m) in in_flight.iter().enumerate() {
                // The step is completed on a copy, since the next step continues from the stage that it shares with
                // this one.
                let mut at = *m;
                self.kick_and_drift::<S, K, ACTION>(&mut at, &table.closing);
                record(t0 + taken as f64 * h, w, &at);
            }
        }
        true
    }

    /// Checks the drift, by the change from the force `before` it.
    #[inline(always)]
    fn check_drift<S: Simd, const K: usize>(&self, m: &mut Pack<S, K, N>, before: &SVector<SimdBatch<S, K>, N>) {
        let zero = SimdBatch::splat(0.0);
        let (mut turn, mut fast, mut wide) = (zero, zero, zero);
        for d in 0..N {
            let change = (m.force[d] - before[d]) * self.check.span;
            turn = change.mul_add(change, turn);
            fast = m.p[d].mul_add(m.p[d], fast);
            wide = m.q[d].mul_add(m.q[d], wide);
        }
        m.fast = fast.max(m.fast * MOMENTUM_MEMORY);
        // A change that moves the position by less than its round-off does not count.
        let moves = (turn * (self.h * self.h)).at_most(
            wide * (POSITION_ROUND_OFF * POSITION_ROUND_OFF),
            m.suspect,
            SimdBatch::splat(1.0),
        );
        m.suspect = turn.at_most(m.fast * self.check.turn, m.suspect, moves);
    }

    #[inline(always)]
    fn take_force<S: Simd, const K: usize, const ACTION: bool>(&self, m: &mut Pack<S, K, N>, t: f64) {
        let zero = SimdBatch::splat(0.0);
        let rest = VelocityPoint { q: m.q, v: vector!(|_| zero), z: zero };
        let (value, force) = self.form.lagrangian.with_force(SimdBatch::splat(t), &rest);
        m.force = force;
        // A stored value is always computed: it is stored only if it is used.
        if ACTION {
            m.value = value;
        }
    }

    #[inline(always)]
    fn kick_and_drift<S: Simd, const K: usize, const ACTION: bool>(&self, m: &mut Pack<S, K, N>, stage: &Stage) {
        let kick = SimdBatch::splat(stage.kick);
        if ACTION {
            m.z += kick * m.value;
        }
        for d in 0..N {
            m.p[d] += kick * m.force[d];
        }
        let Drift { length, damping, lift } = stage.drift;
        let v = velocity(&self.form, &m.p);
        if ACTION {
            m.z = m.z + (SimdBatch::splat(damping) * m.z + SimdBatch::splat(lift) * m.p.dot(&v));
        }
        for d in 0..N {
            m.q[d] += SimdBatch::splat(length) * v[d];
            let before = m.p[d];
            let change = SimdBatch::splat(damping) * before + m.carry[d];
            m.p[d] = before + change;
            m.carry[d] = change - (m.p[d] - before);
        }
    }

    /// The drifts of the step from the time t, where they depend on it.
    fn set_time(&self, table: &mut Cow<'_, SubstepTable>, t: f64) {
        if let Drag::Timed { .. } = self.drag {
            let SubstepTable { first, joined, closing } = table.to_mut();
            for stage in first.iter_mut().chain(joined).chain([closing]) {
                stage.drift = self.drag.drift(&self.form.lagrangian, t + (stage.time - stage.span), stage.span);
            }
        }
    }
}

/// `M^-1 p`, by the operations of a matrix-vector product, in their order.
#[inline(always)]
pub(crate) fn velocity<L, S: Simd, const K: usize, const N: usize>(
    form: &SeparableForm<L, N>,
    p: &SVector<SimdBatch<S, K>, N>,
) -> SVector<SimdBatch<S, K>, N> {
    let Some(inverse) = &form.inverse else { return *p };
    vector!(|i| {
        let mut sum = p[0] * inverse[(i, 0)];
        for j in 1..N {
            sum += p[j] * inverse[(i, j)];
        }
        sum
    })
}
