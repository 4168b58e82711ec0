//! The solution of the stage equations for any number of coordinates: of a system that is evaluated at one point at a time,
//! for which it is compiled once, and of systems over scalars.

use crate::gauss::limits::MAX_DIMENSION_IN_LANES;
use crate::gauss::routes::general::General;
use crate::gauss::routes::general::kernel::{GeneralKernel, GivenStages, MovingStages, solve};
use crate::gauss::routes::general::vectors::Vectors;
use crate::gauss::stages::changes::Changes;
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::stages::mass_matrix::{InverseMass, Mass};
use crate::gauss::stages::stage_newton::StagesInIteration;
use crate::gauss::system::{ByPoints, Coordinates, InRegisters, add_force, few_coordinates, zeros};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::pair::{Registers, over_registers};
use crate::numbers::registers::{StageMap, Stages, blocks};
use crate::system::caught;
use crate::{Point, System};
use contact_geom::{Scalar, ScalarSystem, Slopes};
use pulp::{Simd, WithSimd};

impl GeneralKernel for ByPoints<'_> {
    fn solve_general_stages(
        &self,
        arch: Instructions,
        t: f64,
        given: GivenStages,
        general: &mut General,
    ) -> (IterationOutcome, FixedPointIteration) {
        match &self.kernels {
            Some(kernels) => caught(
                || kernels.solve_general_stages(arch, t, given, &mut *general),
                || (IterationOutcome::NonFinite, FixedPointIteration::default()),
            ),
            None => arch.dispatch(SolveStages { system: &*self.system, t, given, general }),
        }
    }
}

impl<F: ScalarSystem> GeneralKernel for InRegisters<F> {
    fn solve_general_stages(
        &self,
        arch: Instructions,
        t: f64,
        given: GivenStages,
        general: &mut General,
    ) -> (IterationOutcome, FixedPointIteration) {
        few_coordinates!(self, general.q.len(), few => few.solve_general_stages(arch, t, given, general), {
            arch.dispatch(SolveStages { system: self, t, given, general })
        })
    }
}

/// The iteration of one step.
struct SolveStages<'b, E: ?Sized> {
    system: &'b E,
    t: f64,
    given: GivenStages,
    general: &'b mut General,
}

impl<E: StageGradients + ?Sized> WithSimd for SolveStages<'_, E> {
    type Output = (IterationOutcome, FixedPointIteration);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let SolveStages { system, t, given, general } = self;
        if !system.invert_mass::<S>(general, t) {
            return (IterationOutcome::NonFinite, FixedPointIteration::default());
        }
        let General { newton, arch, evaluations, tolerance, .. } = general;
        let n = general.q.len();
        let stages = StagesInMotion {
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
        solve::<S, _>(stages, newton.as_deref_mut(), (*arch, *tolerance), evaluations, t, given)
    }
}

/// The evaluation of a system at the stages of a step.
trait StageGradients {
    /// Evaluates L and its gradient at the stages from the time t, and stores them with the weights of the step.
    fn evaluate<S: Simd>(&self, t: f64, stages: &mut StageValues<'_>);

    /// Inverts W at the stages, if it is not constant and is inverted in SIMD lanes; `false` if it is singular.
    fn invert_mass<S: Simd>(&self, _general: &mut General, _t: f64) -> bool {
        true
    }
}

/// What an evaluation reads and writes: the fields of [`General`] of the same names.
struct StageValues<'k> {
    table: &'k StageTable,
    vectors: Vectors<'k>,
    l: &'k mut Stages,
    rate: &'k mut Stages,
    one_minus_rho_stages: &'k Stages,
    z_stages: &'k Stages,
}

impl StageGradients for dyn System + '_ {
    /// The values at the last stage are repeated in the padding, where the weights are 0.
    fn evaluate<S: Simd>(&self, t: f64, stages: &mut StageValues<'_>) {
        let StageValues { table, vectors, l, rate, one_minus_rho_stages, z_stages } = stages;
        let Vectors { v, l_v, force, x, .. } = vectors;
        let last = table.s - 1;
        let forced = self.hints().forced;
        for i in 0..table.s {
            let of = |stages: &[Stages]| stages.iter().map(|x| x.0[i]).collect();
            let at = Point { q: of(x), v: of(v), z: z_stages.0[i] };
            let time = t + table.times.0[i];
            let (value, mut g) = (self.value(time, &at), self.gradient(time, &at));
            if forced {
                g.x += self.applied_force(time, &at);
            }
            let (rho, lanes) = (1.0 - one_minus_rho_stages.0[i], i..if i == last { MAX_STAGES } else { i + 1 });
            for k in lanes {
                let weight = table.weights.0[k];
                l.0[k] = weight * value;
                rate.0[k] = weight * (rho * g.z);
                for d in 0..x.len() {
                    force[d].0[k] = weight * (rho * g.x[d]);
                    l_v[d].0[k] = g.y[d];
                }
            }
        }
    }
}

impl<F: ScalarSystem> StageGradients for InRegisters<F> {
    #[inline(always)]
    fn evaluate<S: Simd>(&self, t: f64, stages: &mut StageValues<'_>) {
        let (mut r, m) = (0, blocks::<S>(stages.table.s));
        while r < m {
            r = over_registers!(stages.take_gradients(&*self.0, t, r); true, S, m - r);
        }
    }

    #[inline(always)]
    fn invert_mass<S: Simd>(&self, general: &mut General, t: f64) -> bool {
        if matches!(general.mass, Mass::Constant(_)) {
            return true;
        }
        let n = general.q.len();
        if n > MAX_DIMENSION_IN_LANES {
            // One by one, before.
            return true;
        }
        let General { table, vectors, z_stages, mass, .. } = general;
        let Vectors { v, x, .. } = vectors.split();
        for r in 0..blocks::<S>(table.s) {
            let (mut q, mut u) = (Coordinates::<Lanes<S>>::new(), Coordinates::<Lanes<S>>::new());
            for d in 0..n {
                q.push(x[d].block(r));
                u.push(v[d].block(r));
            }
            let at = table.times.block::<S>(r) + t;
            let mut w = [Lanes::<S>::splat(0.0); MAX_DIMENSION_IN_LANES * MAX_DIMENSION_IN_LANES];
            let w = &mut w[..n * n];
            self.0.mass_matrix::<_, 0>(at, &q, &u, z_stages.block(r), w);
            if !mass.invert_slice(r, n, w) {
                return false;
            }
        }
        true
    }
}

impl StageValues<'_> {
    /// Evaluates L and its gradient at the blocks of stages that T holds, from the r-th on; returns the index of the next
    /// block.
    #[inline(always)]
    fn take_gradients<S: Simd, T: Registers<S>>(&mut self, system: &impl ScalarSystem, t: f64, r: usize) -> usize {
        let n = self.vectors.x.len();
        let (mut q, mut v) = (Coordinates::<T>::new(), Coordinates::<T>::new());
        for d in 0..n {
            q.push(T::of(&self.vectors.x[d], r));
            v.push(T::of(&self.vectors.v[d], r));
        }
        let (mut force, mut momentum, mut rate) = (zeros::<T>(n), zeros::<T>(n), T::zero());
        let to = Slopes { q: &mut force, v: &mut momentum, z: &mut rate };
        let at = T::of(&self.table.times, r) + t;
        let l = system.with_gradient::<T, 0>(at, &q, &v, T::of(self.z_stages, r), to);
        if system.has_force() {
            add_force(system, at, (&q, &v, T::of(self.z_stages, r)), &mut force);
        }
        for i in 0..T::COUNT {
            let r = r + i;
            let (weight, one_minus_rho_stages) =
                (self.table.weights.block::<S>(r), -self.one_minus_rho_stages.block::<S>(r));
            self.l.set(r, weight * l.register(i));
            let rate = rate.register(i);
            self.rate.set(r, weight * rate.mul_add(one_minus_rho_stages, rate));
            for d in 0..n {
                let push = force[d].register(i);
                self.vectors.force[d].set(r, weight * push.mul_add(one_minus_rho_stages, push));
                self.vectors.l_v[d].set(r, momentum[d].register(i));
            }
        }
        r + T::COUNT
    }
}

/// The stages of a step: the fields of [`General`] of the same names.
struct StagesInMotion<'k, E: ?Sized> {
    system: &'k E,
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

impl<E: StageGradients + ?Sized> MovingStages for StagesInMotion<'_, E> {
    #[inline(always)]
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

    #[inline(always)]
    fn evaluate<S: Simd>(&mut self, t: f64) -> f64 {
        let Vectors { v, l_v, moved, force, x } = &mut self.vectors;
        let vectors = Vectors { v, l_v, moved, force, x };
        let StagesInMotion { table, l, rate, one_minus_rho_stages, z_stages, .. } = self;
        self.system.evaluate::<S>(t, &mut StageValues { table, vectors, l, rate, one_minus_rho_stages, z_stages });
        0.0
    }

    #[inline(always)]
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

impl<E: ?Sized> StagesInMotion<'_, E> {
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
            let inverse = (one - self.one_minus_rho_stages.block::<S>(r)).recip();
            let weight = self.table.weights.block::<S>(r);
            for i in 0..n {
                let mut change = zero;
                for j in 0..n {
                    let entry = self.inverse.entry::<S>(n, i, j, r) * inverse;
                    change = entry.mul_add(force[j].block(r), change);
                }
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
