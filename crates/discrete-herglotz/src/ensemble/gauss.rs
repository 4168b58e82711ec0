//! Contact Gauss collocation for many motions in SIMD lanes; the stages of a step are computed in a loop.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::ensemble::judge::Judge;
use crate::ensemble::lane::{Lane, LaneOptions, interrupted};
use crate::gauss::resolution::tail::of_sigma;
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::gauss::tables::condensed::Condensed;
use crate::integration::interrupt::STEPS_BETWEEN_QUERIES;
use crate::numbers::compensated_batch::{CompensatedBatch, Pair};
use crate::numbers::instructions::Instructions;
use crate::numbers::simd_batch::SimdBatch;
use crate::resolution::thresholds::{
    FEW_STAGES, MAX_LAST_COEFFICIENT_IN_LANES, MAX_TURN_IN_LANES, POSITION_ROUND_OFF, STAGE_ROUND_OFF,
};
use crate::splitting::separable::SeparableForm;
use crate::{InputError, Interrupt, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, Scalar, VelocityPoint};
use num_traits::{One, Zero};
use pulp::{Simd, WithSimd};
use qd::Quad;

/// The steps of contact Gauss collocation condensed to the positions, for many motions of one Lagrangian; the equations
/// are those of [`Condensed`].
///
/// An iteration computes the stages in their order, each from the newest accelerations of the others (Gauss-Seidel
/// iteration). In the first iteration of a step the predictor of a stage is the polynomial through the newest
/// accelerations, which include those of the step before. The iteration ends in each lane separately, by the rules of
/// `gauss/stages/fixed_point.rs`; converged lanes keep their values while others continue.
pub(crate) struct GaussPacks<'a, L, const N: usize> {
    form: SeparableForm<&'a L, N>,
    table: Box<Table>,
    t0: f64,
    h: f64,
    steps: usize,
    interrupt: Option<Interrupt<'a>>,
}

/// The coefficients of a step, with high and low parts where their round-off would act in the same direction in every
/// step.
struct Table {
    s: usize,
    b: [[f64; MAX_STAGES]; MAX_STAGES],
    b_tail: [[f64; MAX_STAGES]; MAX_STAGES],
    u: [Pair; MAX_STAGES],
    d: [[f64; MAX_STAGES]; MAX_STAGES],
    inverse_rho: [f64; MAX_STAGES],
    times: [f64; MAX_STAGES],
    first: [[f64; MAX_STAGES]; MAX_STAGES],
    end_u: Pair,
    end_b: [Pair; MAX_STAGES],
    grow: Pair,
    end_v: [Pair; MAX_STAGES],
    /// The weights of the last Legendre coefficient of the accelerations.
    last: [f64; MAX_STAGES],
}

/// The factor by which the largest velocity for this comparison decreases from step to step; a single run compares with
/// the largest velocity of three steps.
const VELOCITY_MEMORY: f64 = 0.5;

impl Table {
    fn new(condensed: &Condensed) -> Self {
        let pair = |x: Quad| [x.0, x.1];
        let exact = &condensed.exact;
        Table {
            s: condensed.s,
            b: condensed.b.map(|row| row.map(|e| e.0)),
            b_tail: condensed.b.map(|row| row.map(|e| e.1)),
            u: condensed.u.map(pair),
            d: exact.d.map(|row| row.map(|e| e.0)),
            inverse_rho: condensed.inverse_rho.0,
            times: condensed.times.0,
            first: first_sweep(condensed),
            end_u: pair(exact.end_u),
            end_b: exact.end_b.map(pair),
            grow: pair(exact.grow),
            end_v: exact.end_v.map(pair),
            last: Coefficients::of(condensed.s).last[0],
        }
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> GaussPacks<'a, L, N> {
    /// The kernel for a Lagrangian, whose constants are read at a start.
    pub fn new(
        lagrangian: &'a L,
        stages: usize,
        (h, steps): (f64, usize),
        t0: f64,
        state: &PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let form = SeparableForm::read(lagrangian, h, t0, state)?;
        let x = VelocityPoint { q: state.q, v: form.velocity(&state.p), z: state.z };
        let gamma = lagrangian.gradient(t0, &x).z;
        if !gamma.is_finite() {
            return Err(InputError::FirstStep(StepError::NonFinite));
        }
        let condensed = Condensed::new(stages, h, gamma)?;
        // The steps do not resolve the drag: each member has a run of its own, which reports this.
        if of_sigma(1.0 + condensed.grow.head, gamma * h) > 1.0 {
            return Err(InputError::Step { h });
        }
        let table = Box::new(Table::new(&condensed));
        Ok(GaussPacks { form, table, t0, h, steps, interrupt: None })
    }

    /// Takes all steps of some motions in place, and records a state after every `rows` steps. The final state is not
    /// finite if the equations of a step could not be solved, or if the motion is not finite.
    pub fn run(&self, instructions: Instructions, lanes: &mut [Lane<N>], action: bool, options: LaneOptions) {
        let stride = options.rows.unwrap_or(self.steps);
        if action {
            instructions.dispatch(All::<_, N, true> { packs: self, lanes, stride });
        } else {
            instructions.dispatch(All::<_, N, false> { packs: self, lanes, stride });
        }
    }
}

/// All motions of a slice in the lanes of one instruction set.
struct All<'s, 'a, L, const N: usize, const ACTION: bool> {
    packs: &'s GaussPacks<'a, L, N>,
    lanes: &'s mut [Lane<N>],
    /// The number of steps from one recorded state to the next.
    stride: usize,
}

impl<L: Lagrangian<N>, const N: usize, const ACTION: bool> WithSimd for All<'_, '_, L, N, ACTION> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let All { packs, lanes, stride } = self;
        // The widths of the packs are those for splittings.
        if const { N == 1 } {
            packs.all::<S, 4, ACTION>(lanes, stride);
        } else {
            packs.all::<S, 2, ACTION>(lanes, stride);
        }
    }
}

/// The largest number of packs that compute a stage one after the other: while one waits for its results, the work of
/// the next ones fills the pipeline. Their data fit into the first-level cache.
const PACKS_IN_FLIGHT: usize = 2;

/// The state and the workspace of the motions of a pack.
struct Moving<S: Simd, const K: usize, const N: usize> {
    q: [CompensatedBatch<S, K>; N],
    v: [CompensatedBatch<S, K>; N],
    z: CompensatedBatch<S, K>,
    /// The accelerations of the stages, and their positions.
    a: [[SimdBatch<S, K>; N]; MAX_STAGES],
    x: [[SimdBatch<S, K>; N]; MAX_STAGES],
    /// The part of the positions that is the same in all iterations: the contributions of the state, and of the low
    /// parts of the coefficients.
    base: [[SimdBatch<S, K>; N]; MAX_STAGES],
    /// 1 in lanes whose iteration continues, and 1 in lanes that have failed.
    going: SimdBatch<S, K>,
    failed: SimdBatch<S, K>,
    /// Whether the iteration continues in some lane, and whether it continues in all lanes; the largest change and the
    /// largest term of the last iteration.
    open: bool,
    whole: bool,
    change: SimdBatch<S, K>,
    size: SimdBatch<S, K>,
    judge: Judge<S, K>,
    /// The largest velocity of the last steps, and 1 in lanes with a suspect step.
    fast: SimdBatch<S, K>,
    suspect: SimdBatch<S, K>,
}

impl<'a, L: Lagrangian<N>, const N: usize> GaussPacks<'a, L, N> {
    /// Sets an interrupt that is polled during the steps; members that it ends count as not completed.
    pub fn with_interrupt(self, interrupt: Option<Interrupt<'a>>) -> Self {
        Self { interrupt, ..self }
    }

    #[inline(always)]
    fn all<S: Simd, const K: usize, const ACTION: bool>(&self, lanes: &mut [Lane<N>], stride: usize) {
        let width = SimdBatch::<S, K>::COUNT;
        let mut moving = Vec::with_capacity(PACKS_IN_FLIGHT);
        for some in lanes.chunks_mut(PACKS_IN_FLIGHT * width) {
            moving.clear();
            for own in some.chunks(width) {
                moving.push(self.start::<S, K>(own));
            }
            for k in 0..self.steps {
                if k % STEPS_BETWEEN_QUERIES == 0 && self.interrupt.is_some_and(Interrupt::is_requested) {
                    interrupted(some);
                    break;
                }
                self.step::<S, K, ACTION>(&mut moving, self.t0 + k as f64 * self.h, k > 0);
                let taken = k + 1;
                if taken % stride == 0 || taken == self.steps {
                    for (own, m) in some.chunks_mut(width).zip(&moving) {
                        for (i, lane) in own.iter_mut().enumerate() {
                            lane.reach(self.t0 + taken as f64 * self.h, self.state(m, i));
                            lane.suspect = m.suspect.lanes()[i] != 0.0;
                        }
                    }
                }
            }
        }
    }

    /// The pack of some motions; lanes beyond the last motion repeat it.
    #[inline(always)]
    fn start<S: Simd, const K: usize>(&self, some: &[Lane<N>]) -> Moving<S, K, N> {
        let zero = SimdBatch::zero();
        let of = |f: &dyn Fn(&PhasePoint<N>) -> f64| {
            CompensatedBatch::from(SimdBatch::from_lanes(|i| {
                some.get(i).or(some.last()).map_or(0.0, |lane| f(&lane.state))
            }))
        };
        Moving {
            q: std::array::from_fn(|d| of(&|state| state.q[d])),
            v: std::array::from_fn(|d| of(&|state| self.form.velocity(&state.p)[d])),
            z: of(&|state| state.z),
            a: [[zero; N]; MAX_STAGES],
            x: [[zero; N]; MAX_STAGES],
            base: [[zero; N]; MAX_STAGES],
            going: zero,
            failed: zero,
            open: false,
            whole: true,
            change: zero,
            size: zero,
            judge: Judge::new(),
            fast: zero,
            suspect: zero,
        }
    }

    /// The state in a lane; not finite if the lane has failed.
    fn state<S: Simd, const K: usize>(&self, m: &Moving<S, K, N>, i: usize) -> PhasePoint<N> {
        let v = SVector::from_fn(|d, _| m.v[d].value.lanes()[i]);
        PhasePoint {
            q: SVector::from_fn(|d, _| m.q[d].value.lanes()[i]),
            p: self.form.momentum(&v),
            z: if m.failed.lanes()[i] == 0.0 { m.z.value.lanes()[i] } else { f64::NAN },
        }
    }

    #[inline(always)]
    fn step<S: Simd, const K: usize, const ACTION: bool>(&self, moving: &mut [Moving<S, K, N>], t: f64, warm: bool) {
        let s = self.table.s.min(MAX_STAGES);
        let [zero, one] = [0.0, 1.0].map(SimdBatch::splat);
        let mut last = [[zero; N]; PACKS_IN_FLIGHT];
        for (m, last) in moving.iter_mut().zip(&mut last) {
            *last = m.a[0];
            if !warm {
                m.a = [[zero; N]; MAX_STAGES];
            }
            self.begin(m, s, false);
            (m.going, m.judge) = (one - m.failed, Judge::new());
            (m.open, m.whole) = (m.going.any(), !m.failed.any());
        }
        self.sweep::<S, K, ACTION>(moving, if warm { &self.table.first } else { &self.table.b }, false, t);
        let mut open = false;
        for m in moving.iter_mut() {
            self.begin(m, s, true);
            (m.change, m.size) = (zero, zero);
            open |= m.open;
        }
        while open {
            self.sweep::<S, K, ACTION>(moving, &self.table.b, true, t);
            open = false;
            for m in moving.iter_mut() {
                if !m.open {
                    continue;
                }
                let [going, given_up] = m.judge.judge(m.change, m.size);
                m.failed += given_up * m.going;
                m.going = m.going * going * (one - given_up);
                (m.change, m.size) = (zero, zero);
                (m.open, m.whole) = (m.going.any(), !(one - m.going).any());
                open |= m.open;
            }
        }
        for (m, last) in moving.iter_mut().zip(&last) {
            self.look(m, warm.then_some(last), s);
            self.finish::<S, K, ACTION>(m, t, s);
        }
    }

    /// Computes the accelerations of all stages in their order; the matrix `rows` maps accelerations to positions.
    #[inline(always)]
    fn sweep<S: Simd, const K: usize, const ACTION: bool>(
        &self,
        moving: &mut [Moving<S, K, N>],
        rows: &[[f64; MAX_STAGES]; MAX_STAGES],
        judged: bool,
        t: f64,
    ) {
        for (i, row) in rows[..self.table.s].iter().enumerate() {
            for m in moving.iter_mut() {
                if m.open {
                    self.stage::<S, K, ACTION>(m, t, (i, row), judged);
                }
            }
        }
    }

    /// The acceleration of one stage, from the newest accelerations of the others.
    #[inline(always)]
    fn stage<S: Simd, const K: usize, const ACTION: bool>(
        &self,
        m: &mut Moving<S, K, N>,
        t: f64,
        (i, row): (usize, &[f64; MAX_STAGES]),
        judged: bool,
    ) {
        let zero = SimdBatch::zero();
        let sum = combined(row, &m.a, self.table.s);
        let x: [SimdBatch<S, K>; N] = std::array::from_fn(|d| m.base[i][d] + sum[d]);
        let a = self.accelerations(t + self.table.times[i], &x);
        for d in 0..N {
            let before = m.a[i][d];
            if judged {
                m.change = m.change.max((a[d] - before).abs());
                m.size = m.size.max(a[d].abs());
            }
            // A converged lane keeps its values, whatever the other lanes do.
            m.a[i][d] = if m.whole { a[d] } else { m.going.at_most(zero, before, a[d]) };
            if ACTION {
                m.x[i][d] = if m.whole { x[d] } else { m.going.at_most(zero, m.x[i][d], x[d]) };
            }
        }
    }

    /// Checks whether a step resolves the motion, before it is taken: by its accelerations, and by the first
    /// acceleration of the step before.
    #[inline(always)]
    fn look<S: Simd, const K: usize>(&self, m: &mut Moving<S, K, N>, last: Option<&[SimdBatch<S, K>; N]>, s: usize) {
        let (zero, one) = (SimdBatch::<S, K>::zero(), SimdBatch::splat(1.0));
        let mut wide = zero;
        for d in 0..N {
            wide = wide.max(m.q[d].value.abs());
        }
        let h = self.h.abs();
        if s > FEW_STAGES {
            let tails = combined(&self.table.last, &m.a, s);
            let (mut tail, mut size) = (zero, zero);
            for d in 0..N {
                tail = tail.max(tails[d].abs());
                for a in &m.a[..s] {
                    size = size.max(a[d].abs());
                }
            }
            let moves = (tail * (h * h)).at_most(wide * STAGE_ROUND_OFF, m.suspect, one);
            m.suspect = tail.at_most(size * MAX_LAST_COEFFICIENT_IN_LANES, m.suspect, moves);
            return;
        }
        let (mut turn, mut fast) = (zero, m.fast * VELOCITY_MEMORY);
        for d in 0..N {
            fast = fast.max(m.v[d].value.abs());
            if let Some(last) = last {
                turn = turn.max((m.a[0][d] - last[d]).abs());
            }
        }
        m.fast = fast;
        let moves = (turn * (h * h)).at_most(wide * POSITION_ROUND_OFF, m.suspect, one);
        m.suspect = (turn * h).at_most(fast * MAX_TURN_IN_LANES, m.suspect, moves);
    }

    /// The terms that all iterations of a step have in common; with `tails` including those of the low parts of the
    /// coefficients, once the accelerations are approximately known.
    #[inline(always)]
    fn begin<S: Simd, const K: usize>(&self, m: &mut Moving<S, K, N>, s: usize, tails: bool) {
        for i in 0..s {
            let [u, u_tail] = self.table.u[i].map(SimdBatch::splat);
            let of_tails = if tails { combined(&self.table.b_tail[i], &m.a, s) } else { [SimdBatch::zero(); N] };
            for d in 0..N {
                let (q, v) = (m.q[d], m.v[d]);
                // The small terms are added first, so that they are not lost in the round-off of the large ones.
                let small = u.mul_add(v.rest, q.rest) + u_tail.mul_add(v.value, of_tails[d]);
                m.base[i][d] = q.value + u.mul_add(v.value, small);
            }
        }
    }

    /// `M^-1 L_q` at a stage.
    #[inline(always)]
    fn accelerations<S: Simd, const K: usize>(&self, t: f64, x: &[SimdBatch<S, K>; N]) -> SVector<SimdBatch<S, K>, N> {
        let zero = SimdBatch::zero();
        let at = VelocityPoint { q: SVector::from_fn(|d, _| x[d]), v: SVector::from_fn(|_, _| zero), z: zero };
        let (_, force) = self.form.lagrangian.with_force(SimdBatch::splat(t), &at);
        crate::ensemble::splitting::velocity(&self.form, &force)
    }

    /// The end of the step, from its accelerations.
    #[inline(always)]
    fn finish<S: Simd, const K: usize, const ACTION: bool>(&self, m: &mut Moving<S, K, N>, t: f64, s: usize) {
        let Table { end_u, end_b, grow, end_v, d: velocities, inverse_rho, times, .. } = &*self.table;
        if ACTION {
            let mut dz = CompensatedBatch::product(*grow, m.z);
            for i in 0..s {
                let sum = combined(&velocities[i], &m.a, s);
                let rho = SimdBatch::splat(inverse_rho[i]);
                let v = SVector::from_fn(|d, _| rho.mul_add(m.v[d].value, sum[d]));
                let q = SVector::from_fn(|d, _| m.x[i][d]);
                let action = self.form.lagrangian.value(SimdBatch::splat(t + times[i]), &q, &v, SimdBatch::zero());
                dz = dz.plus(end_v[i], action);
            }
            m.z = m.z.add(dz);
        }
        for d in 0..N {
            let (mut dq, mut dv) = (CompensatedBatch::zero(), CompensatedBatch::zero());
            for i in 0..s {
                dq = dq.plus(end_b[i], m.a[i][d]);
                dv = dv.plus(end_v[i], m.a[i][d]);
            }
            let (of_u, of_v) = (CompensatedBatch::product(*end_u, m.v[d]), CompensatedBatch::product(*grow, m.v[d]));
            m.q[d] = m.q[d].add(dq.with(of_u));
            m.v[d] = m.v[d].add(dv.with(of_v));
        }
    }
}

/// The matrix `B` of the first iteration of a step: row i maps the newest known accelerations, those of the stages
/// before i in this step and those from i on in the step before, to the position that the polynomial through them
/// predicts.
fn first_sweep(condensed: &Condensed) -> [[f64; MAX_STAGES]; MAX_STAGES] {
    let (s, c) = (condensed.s, &Coefficients::of(condensed.s).c);
    let zero = Quad::zero();
    // The distances from the nodes of a step to the nodes of the same step and of the step before, and their
    // reciprocals.
    let (mut apart, mut inverse) = ([[[zero; MAX_STAGES]; MAX_STAGES]; 2], [[[zero; MAX_STAGES]; MAX_STAGES]; 2]);
    for (j, k, before) in (0..2 * s * s).map(|at| (at / 2 % s, at / 2 / s, at % 2)) {
        let distance = c[j] - c[k] + Quad::from(before as f64);
        apart[before][j][k] = distance;
        inverse[before][j][k] = if distance.0 == 0.0 { zero } else { distance.recip() };
    }
    let mut rows = [[0.0; MAX_STAGES]; MAX_STAGES];
    for i in 0..s {
        let before = |k: usize| usize::from(k >= i);
        let mut row = condensed.b[i];
        row[i..].fill(zero);
        let scale: [Quad; MAX_STAGES] = std::array::from_fn(|k| {
            let others = (0..s).filter(|m| *m != k);
            others.fold(Quad::one(), |product, m| match (before(k), before(m)) {
                (0, 1) => product * inverse[1][k][m],
                (1, 0) => -product * inverse[1][m][k],
                _ => product * inverse[0][k][m],
            })
        });
        // The Lagrange polynomials of the nodes k at the nodes j: the product of the distances of j to all nodes except
        // k, divided by the product of those of k to the others.
        for j in i..s {
            let all = (0..s).fold(condensed.b[i][j], |all, m| all * apart[before(m)][j][m]);
            for k in 0..s {
                row[k] += all * inverse[before(k)][j][k] * scale[k];
            }
        }
        rows[i] = row.map(|e| e.0);
    }
    rows
}

/// The sum over the stages of a row of coefficients times the values there, as two independent partial sums that can be
/// computed in parallel.
#[inline(always)]
fn combined<S: Simd, const K: usize, const N: usize>(
    row: &[f64; MAX_STAGES],
    values: &[[SimdBatch<S, K>; N]; MAX_STAGES],
    s: usize,
) -> [SimdBatch<S, K>; N] {
    let (mut sum, mut odd) = ([SimdBatch::zero(); N], [SimdBatch::zero(); N]);
    let (coefficients, values) = (row[..s].chunks_exact(2), values[..s].chunks_exact(2));
    if let ([c], [value]) = (coefficients.remainder(), values.remainder()) {
        for d in 0..N {
            odd[d] = SimdBatch::splat(*c) * value[d];
        }
    }
    for (c, value) in coefficients.zip(values) {
        for d in 0..N {
            sum[d] = SimdBatch::splat(c[0]).mul_add(value[0][d], sum[d]);
            odd[d] = SimdBatch::splat(c[1]).mul_add(value[1][d], odd[d]);
        }
    }
    std::array::from_fn(|d| sum[d] + odd[d])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// If the accelerations of two consecutive steps lie on one polynomial that the stages of a single step determine,
    /// the first iteration gives the positions to which the iteration converges, up to the round-off of its sums of s
    /// terms and of the coefficients.
    #[test]
    fn first_sweeps_foretell_polynomials() {
        for (s, h, gamma) in [(1, 0.3, -0.1), (2, 0.7, 0.0), (5, 1.1, -0.2), (10, 1.1, 0.1), (16, 2.0, -1.0)] {
            let condensed = Condensed::new(s, h, gamma).unwrap();
            let (rows, c) = (first_sweep(&condensed), &Coefficients::of(s).c);
            // The Chebyshev polynomial of degree s - 1 over the two steps, of size one.
            let a = |x: f64| ((s - 1) as f64 * x.acos()).cos();
            for i in 0..s {
                let before = |j: usize| a(if j < i { c[j].0 } else { c[j].0 - 1.0 });
                let (mut foretold, mut position, mut size) = (0.0, 0.0, 0.0);
                for j in 0..s {
                    foretold += rows[i][j] * before(j);
                    position += condensed.b[i][j].0 * a(c[j].0);
                    size += rows[i][j].abs() + condensed.b[i][j].0.abs();
                }
                // The error of the values of the polynomial is `eps s^2`, since its slope is up to s^2.
                let bound = ((s * s) as f64 + 4.0) * f64::EPSILON * size;
                assert!((foretold - position).abs() <= bound, "{s} stages, {i}: {foretold:e} {position:e}");
            }
        }
    }
}
