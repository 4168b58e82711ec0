//! A step of the motions of some packs.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::ensemble::convergence::ConvergenceTest;
use crate::ensemble::gauss::pack::Pack;
use crate::ensemble::gauss::table::Table;
use crate::ensemble::gauss::{GaussPacks, PACKS_IN_FLIGHT};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::compensated_batch::CompensatedBatch;
use crate::numbers::simd_batch::SimdBatch;
use crate::resolution::thresholds::{
    FEW_STAGES, MAX_LAST_COEFFICIENT_IN_LANES, MAX_TURN_IN_LANES, POSITION_ROUND_OFF, STAGE_ROUND_OFF,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, Scalar, VelocityPoint, vector};
use num_traits::Zero;
use pulp::Simd;

/// The factor by which the largest velocity for this comparison decreases from step to step; a single run compares with
/// the largest velocity of three steps.
const VELOCITY_MEMORY: f64 = 0.5;

impl<L: Lagrangian<N>, const N: usize> GaussPacks<'_, L, N> {
    #[inline(always)]
    pub(super) fn step<S: Simd, const K: usize, const ACTION: bool>(
        &self,
        in_flight: &mut [Pack<S, K, N>],
        t: f64,
        warm: bool,
    ) {
        let s = self.table.s.min(MAX_STAGES);
        let [zero, one] = [0.0, 1.0].map(SimdBatch::splat);
        let mut last = [[zero; N]; PACKS_IN_FLIGHT];
        for (m, last) in in_flight.iter_mut().zip(&mut last) {
            *last = m.a[0];
            if !warm {
                m.a = [[zero; N]; MAX_STAGES];
            }
            self.begin(m, s, false);
            (m.continuing, m.convergence) = (one - m.failed, ConvergenceTest::new());
            (m.open, m.whole) = (m.continuing.any(), !m.failed.any());
        }
        let mut rows = if warm { &self.table.first } else { &self.table.b };
        // The first iteration begins from the step before, and is not tested.
        let (mut tested, mut open) = (false, true);
        while open {
            self.iterate_stages::<S, K, ACTION>(in_flight, rows, tested, t);
            open = false;
            for m in in_flight.iter_mut() {
                if !tested {
                    self.begin(m, s, true);
                } else if m.open {
                    let [continuing, failing] = m.convergence.test(m.change, m.size);
                    m.failed += failing * m.continuing;
                    m.continuing = m.continuing * continuing * (one - failing);
                    (m.open, m.whole) = (m.continuing.any(), !(one - m.continuing).any());
                }
                (m.change, m.size) = (zero, zero);
                open |= m.open;
            }
            (rows, tested) = (&self.table.b, true);
        }
        for (m, last) in in_flight.iter_mut().zip(&last) {
            self.check_resolution(m, warm.then_some(last), s);
            self.finish::<S, K, ACTION>(m, t, s);
        }
    }

    /// Computes the accelerations of all stages in their order; the matrix `rows` maps accelerations to positions.
    #[inline(always)]
    fn iterate_stages<S: Simd, const K: usize, const ACTION: bool>(
        &self,
        in_flight: &mut [Pack<S, K, N>],
        rows: &[[f64; MAX_STAGES]; MAX_STAGES],
        tested: bool,
        t: f64,
    ) {
        for (i, row) in rows[..self.table.s].iter().enumerate() {
            for m in in_flight.iter_mut() {
                if m.open {
                    self.stage::<S, K, ACTION>(m, t, (i, row), tested);
                }
            }
        }
    }

    /// The acceleration of one stage, from the newest accelerations of the others.
    #[inline(always)]
    fn stage<S: Simd, const K: usize, const ACTION: bool>(
        &self,
        m: &mut Pack<S, K, N>,
        t: f64,
        (i, row): (usize, &[f64; MAX_STAGES]),
        tested: bool,
    ) {
        let zero = SimdBatch::zero();
        let sum = combined(row, &m.a, self.table.s);
        let x = vector!(|d| m.base[i][d] + sum[d]);
        let a = self.accelerations(t + self.table.times[i], &x);
        for d in 0..N {
            let before = m.a[i][d];
            if tested {
                m.change = m.change.max((a[d] - before).abs());
                m.size = m.size.max(a[d].abs());
            }
            // A converged lane keeps its values, whatever the other lanes do.
            m.a[i][d] = if m.whole { a[d] } else { m.continuing.at_most(zero, before, a[d]) };
            if ACTION {
                m.x[i][d] = if m.whole { x[d] } else { m.continuing.at_most(zero, m.x[i][d], x[d]) };
            }
        }
    }

    /// Checks whether a step resolves the motion, before it is taken: by its accelerations, and by the first
    /// acceleration of the step before.
    #[inline(always)]
    fn check_resolution<S: Simd, const K: usize>(
        &self,
        m: &mut Pack<S, K, N>,
        last: Option<&[SimdBatch<S, K>; N]>,
        s: usize,
    ) {
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
    fn begin<S: Simd, const K: usize>(&self, m: &mut Pack<S, K, N>, s: usize, tails: bool) {
        for i in 0..s {
            let [u, u_tail] = self.table.u[i];
            let (u, u_tail) = (SimdBatch::splat(u), SimdBatch::splat(u_tail));
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
    fn accelerations<S: Simd, const K: usize>(
        &self,
        t: f64,
        x: &SVector<SimdBatch<S, K>, N>,
    ) -> SVector<SimdBatch<S, K>, N> {
        let zero = SimdBatch::zero();
        let at = VelocityPoint { q: *x, v: vector!(|_| zero), z: zero };
        let (_, force) = self.form.lagrangian.with_force(SimdBatch::splat(t), &at);
        crate::ensemble::splitting::velocity(&self.form, &force)
    }

    /// The end of the step, from its accelerations.
    #[inline(always)]
    fn finish<S: Simd, const K: usize, const ACTION: bool>(&self, m: &mut Pack<S, K, N>, t: f64, s: usize) {
        let Table { end_u, end_b, grow, end_v, d: velocities, inverse_rho, times, .. } = &*self.table;
        if ACTION {
            let mut dz = CompensatedBatch::product(*grow, m.z);
            for i in 0..s {
                let sum = combined(&velocities[i], &m.a, s);
                let rho = SimdBatch::splat(inverse_rho[i]);
                let v = vector!(|d| rho.mul_add(m.v[d].value, sum[d]));
                let q = vector!(|d| m.x[i][d]);
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

/// The sum over the stages of a row of coefficients times the values there, as two independent partial sums that can be
/// computed in parallel.
#[inline(always)]
fn combined<S: Simd, const K: usize, const N: usize>(
    row: &[f64; MAX_STAGES],
    values: &[[SimdBatch<S, K>; N]; MAX_STAGES],
    s: usize,
) -> [SimdBatch<S, K>; N] {
    let (mut sum, mut odd) = ([SimdBatch::zero(); N], [SimdBatch::zero(); N]);
    let (row, values) = (&row[..s], &values[..s]);
    if s % 2 == 1 {
        for d in 0..N {
            odd[d] = SimdBatch::splat(row[s - 1]) * values[s - 1][d];
        }
    }
    for pair in 0..s / 2 {
        let (i, j) = (2 * pair, 2 * pair + 1);
        for d in 0..N {
            sum[d] = SimdBatch::splat(row[i]).mul_add(values[i][d], sum[d]);
            odd[d] = SimdBatch::splat(row[j]).mul_add(values[j][d], odd[d]);
        }
    }
    for d in 0..N {
        sum[d] += odd[d];
    }
    sum
}
