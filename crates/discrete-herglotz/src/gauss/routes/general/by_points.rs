//! The solution of the stage equations of a system that is evaluated at one point at a time, whatever its number of
//! coordinates. It is compiled once.

use crate::gauss::routes::general::General;
use crate::gauss::routes::general::kernel::{GeneralKernel, GivenStages, MovingStages, solve};
use crate::gauss::routes::general::vectors::Vectors;
use crate::gauss::stages::changes::Changes;
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::stages::mass_matrix::InverseMass;
use crate::gauss::stages::stage_newton::StagesInIteration;
use crate::gauss::system::ByPoints;
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{StageMap, Stages, blocks};
use crate::{Point, System};
use pulp::{Simd, WithSimd};

impl GeneralKernel for ByPoints<'_> {
    fn solve_general_stages(
        &self,
        arch: Instructions,
        t: f64,
        given: GivenStages,
        general: &mut General,
    ) -> (IterationOutcome, FixedPointIteration) {
        arch.dispatch(SolveStages { system: &*self.0, t, given, general })
    }
}

/// The iteration of one step.
struct SolveStages<'b> {
    system: &'b dyn System,
    t: f64,
    given: GivenStages,
    general: &'b mut General,
}

impl WithSimd for SolveStages<'_> {
    type Output = (IterationOutcome, FixedPointIteration);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let SolveStages { system, t, given, general } = self;
        let General { newton, arch, evaluations, .. } = general;
        let n = general.q.len();
        let stages = StagesByPoints {
            system,
            m: &general.m,
            table: &general.table,
            vectors: general.vectors.split(),
            l: &mut general.l,
            rate: &mut general.rate,
            one_minus_rho_stages: &mut general.one_minus_rho_stages,
            z_stages: &mut general.z_stages,
            inverse: general.mass.inverse(n),
            follows: general.follows,
            q: &general.q,
            p: &general.p,
            z: general.z.value,
        };
        solve::<S, _>(stages, newton.as_deref_mut(), *arch, evaluations, t, given)
    }
}

/// The stages of a step: the fields of [`General`] of the same names.
struct StagesByPoints<'k> {
    system: &'k dyn System,
    m: &'k StageMap,
    table: &'k StageTable,
    vectors: Vectors<'k>,
    l: &'k mut Stages,
    rate: &'k mut Stages,
    one_minus_rho_stages: &'k mut Stages,
    z_stages: &'k mut Stages,
    inverse: InverseMass<'k>,
    follows: bool,
    q: &'k [CompensatedSum],
    p: &'k [CompensatedSum],
    z: f64,
}

/// The kinds of variables whose changes are compared: velocities, integrating factors and actions.
const KINDS: usize = 3;

impl MovingStages for StagesByPoints<'_> {
    fn count(&self) -> usize {
        self.table.s
    }

    #[inline(always)]
    fn iterate<S: Simd>(&mut self) -> f64 {
        let (zero, one) = (Lanes::<S>::splat(0.0), Lanes::splat(1.0));
        let mut seen = Changes::compared_with([zero, one, zero]);
        self.push::<S>(&mut seen);
        self.move_stages::<S>(&mut seen);
        seen.largest()
    }

    /// The values at the last stage are repeated in the padding, where the weights are 0.
    fn evaluate<S: Simd>(&mut self, t: f64) -> f64 {
        let StagesByPoints { table, vectors, .. } = self;
        let Vectors { v, l_v, force, x, .. } = vectors;
        let last = table.s - 1;
        for i in 0..table.s {
            let of = |stages: &[Stages]| stages.iter().map(|x| x.0[i]).collect();
            let at = Point { q: of(x), v: of(v), z: self.z_stages.0[i] };
            let time = t + table.times.0[i];
            let (l, g) = (self.system.value(time, &at), self.system.gradient(time, &at));
            let (rho, lanes) = (1.0 - self.one_minus_rho_stages.0[i], i..if i == last { MAX_STAGES } else { i + 1 });
            for k in lanes {
                let weight = table.weights.0[k];
                self.l.0[k] = weight * l;
                self.rate.0[k] = weight * (rho * g.z);
                for d in 0..x.len() {
                    force[d].0[k] = weight * (rho * g.x[d]);
                    l_v[d].0[k] = g.y[d];
                }
            }
        }
        0.0
    }

    fn in_newton(&mut self) -> StagesInIteration<'_> {
        StagesInIteration {
            table: self.table,
            start: (self.q, self.p, self.z),
            l_v: self.vectors.l_v,
            l: self.l,
            force: self.vectors.force,
            rate: self.rate,
            v: self.vectors.v,
            z: self.z_stages,
            one_minus_rho_stages: self.one_minus_rho_stages,
            moved: self.vectors.moved,
            x: self.vectors.x,
        }
    }
}

impl StagesByPoints<'_> {
    /// Computes the factors and velocities of the stages. The forces are replaced by the residuals of the momenta: the
    /// next evaluation sets them again.
    #[inline(always)]
    fn push<S: Simd>(&mut self, seen: &mut Changes<S, KINDS>) {
        let Vectors { v, l_v, moved, force, .. } = &mut self.vectors;
        let (n, s, zero, one) = (v.len(), self.table.s, Lanes::<S>::splat(0.0), Lanes::<S>::splat(1.0));
        for r in 0..blocks::<S>(s) {
            let [[factor]] = self.m.rows([&*self.rate], s, [[zero]], r);
            seen.see(1, factor - self.one_minus_rho_stages.block::<S>(r), one - factor);
            self.one_minus_rho_stages.set(r, factor);
        }
        for d in 0..n {
            let mut residual = Stages::ZERO;
            for r in 0..blocks::<S>(s) {
                let l_v = l_v[d].block::<S>(r);
                let [[pushed]] = self.m.rows([&force[d]], s, [[Lanes::splat(self.p[d].value) - l_v]], r);
                residual.set(r, l_v.mul_add(self.one_minus_rho_stages.block(r), pushed));
            }
            force[d] = residual;
        }
        for r in 0..blocks::<S>(s) {
            let inverse = one / (one - self.one_minus_rho_stages.block::<S>(r));
            let weight = self.table.weights.block::<S>(r);
            for i in 0..n {
                let mut change = zero;
                for j in 0..n {
                    change = self.inverse.entry::<S>(n, i, j, r).mul_add(force[j].block(r), change);
                }
                let change = change * inverse;
                let to = v[i].block::<S>(r) + change;
                seen.see(0, change, to);
                v[i].set(r, to);
                moved[i].set(r, weight * to);
            }
        }
    }

    /// Computes the positions and actions of the stages.
    #[inline(always)]
    fn move_stages<S: Simd>(&mut self, seen: &mut Changes<S, KINDS>) {
        let Vectors { l_v, moved, x, .. } = &mut self.vectors;
        let s = self.table.s;
        for r in 0..blocks::<S>(s) {
            let [[mut z]] = self.m.rows([&*self.l], s, [[Lanes::<S>::splat(self.z)]], r);
            for d in 0..x.len() {
                let [[to]] = self.m.rows([&moved[d]], s, [[Lanes::splat(self.q[d].value)]], r);
                if self.follows {
                    z = l_v[d].block::<S>(r).mul_add(to - x[d].block(r), z);
                }
                x[d].set(r, to);
            }
            seen.see(2, z - self.z_stages.block(r), z);
            self.z_stages.set(r, z);
        }
    }
}
