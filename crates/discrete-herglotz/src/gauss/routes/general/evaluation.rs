//! L and its gradient at the stages of a general step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::routes::general::iteration::Iteration;
use crate::gauss::routes::general::vectors::Vectors;
use crate::numbers::lanes::Lanes;
use crate::numbers::pair::{Registers, over_registers, register};
use crate::numbers::registers::{Stages, blocks};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{ChartVector, Derivatives, Lagrangian, VelocityPoint, support::KernelDual, vector};
use pulp::Simd;

impl Vectors<'_> {
    /// The point of TQ x R at a block of stages.
    #[inline(always)]
    pub(crate) fn point<S: Simd, const N: usize>(&self, z: &Stages, r: usize) -> VelocityPoint<N, Lanes<S>> {
        VelocityPoint { q: vector!(|d| self.x[d].block(r)), v: vector!(|d| self.v[d].block(r)), z: z.block(r) }
    }
}

impl<const N: usize, const TRANSFORMED: bool> Iteration<'_, N, TRANSFORMED> {
    /// Evaluates L and its gradient at the stages. Returns the largest change of the rates dt/dtau relative to the
    /// largest rate, or 0 in physical time.
    #[inline(always)]
    pub(crate) fn evaluate<S: Simd, L: Lagrangian<N>>(&mut self, lagrangian: &L, t: f64) -> f64 {
        let m = blocks::<S>(self.table.s);
        if const { TRANSFORMED } {
            return self.evaluate_transformed::<S, L>(lagrangian, t);
        }
        let mut r = 0;
        while r < m {
            r = over_registers!(self.take_gradients(lagrangian, t, r); L::HINTS.interpreted, S, m - r);
        }
        0.0
    }

    /// The same in transformed time.
    #[inline(always)]
    fn evaluate_transformed<S: Simd, L: Lagrangian<N>>(&mut self, lagrangian: &L, t: f64) -> f64 {
        let (mut dg, mut sg) = (Lanes::<S>::splat(0.0), Lanes::<S>::splat(0.0));
        for r in 0..blocks::<S>(self.table.s) {
            let at = self.table.times.block::<S>(r) + t;
            let point = self.vectors.point::<S, N>(self.z_stages, r);
            let (re, d) = lagrangian.with_gradient(at, &point);
            let (mut weight, one_minus_rho_stages) =
                (self.table.weights.block::<S>(r), -self.one_minus_rho_stages.block::<S>(r));
            let q: SVector<_, N> = vector!(|i| {
                let mut q = KernelDual::<Lanes<S>, SVector<Lanes<S>, N>>::constant(point.q[i]);
                q.d[i] = Lanes::splat(1.0);
                q
            });
            let KernelDual { re: g, d: slope } = lagrangian.dt_dtau(&q);
            let energy = dot(point.v, d.y) - re;
            let extended = energy.mul_add(one_minus_rho_stages, energy + self.p_t);
            let of_transformed: SVector<_, N> = vector!(|i| slope[i] * extended * -weight);
            weight *= g;
            dg = dg.max((g - self.g.block(r)).abs());
            sg = sg.max(g.abs());
            self.g.set(r, g);
            self.l.set(r, weight * re);
            self.rate.set(r, weight * d.z.mul_add(one_minus_rho_stages, d.z));
            for i in 0..N {
                let push = d.x[i].mul_add(one_minus_rho_stages, d.x[i]);
                self.vectors.force[i].set(r, push.mul_add(weight, of_transformed[i]));
                self.vectors.l_v[i].set(r, d.y[i]);
            }
        }
        dg.reduce_max() / sg.reduce_max()
    }

    /// Evaluates L and its gradient at the blocks of stages that T holds, from the r-th on, in physical time; returns
    /// the index of the next block.
    #[inline(always)]
    fn take_gradients<S: Simd, T: Registers<S>>(&mut self, lagrangian: &impl Lagrangian<N>, t: f64, r: usize) -> usize {
        let point = VelocityPoint {
            q: vector!(|d| T::of(&self.vectors.x[d], r)),
            v: vector!(|d| T::of(&self.vectors.v[d], r)),
            z: T::of(self.z_stages, r),
        };
        let (l, d) = lagrangian.with_gradient_and_force(T::of(&self.table.times, r) + t, &point);
        for i in 0..T::COUNT {
            self.weigh(
                r + i,
                l.register(i),
                &ChartVector { x: register(&d.x, i), y: register(&d.y, i), z: d.z.register(i) },
            );
        }
        r + T::COUNT
    }

    /// Stores L and its gradient at one block of stages, multiplied by the weights of physical time.
    #[inline(always)]
    fn weigh<S: Simd>(&mut self, r: usize, l: Lanes<S>, d: &ChartVector<N, Lanes<S>>) {
        let (weight, one_minus_rho_stages) =
            (self.table.weights.block::<S>(r), -self.one_minus_rho_stages.block::<S>(r));
        self.l.set(r, weight * l);
        self.rate.set(r, weight * d.z.mul_add(one_minus_rho_stages, d.z));
        for i in 0..N {
            self.vectors.force[i].set(r, weight * d.x[i].mul_add(one_minus_rho_stages, d.x[i]));
            self.vectors.l_v[i].set(r, d.y[i]);
        }
    }
}
