//! The condensed step of a system over scalars, with any number of coordinates.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::routes::separable::Separable;
use crate::gauss::routes::separable::kernel::{
    ForceSystem, Iterate, Iterated, IterationStart, SeparableKernel, Solution, StageForces,
};
use crate::gauss::stages::stage_values::CondensedStages;
use crate::gauss::system::{Coordinates, InRegisters, add_force, few_coordinates, zeros};
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::pair::{Registers, over_registers};
use crate::numbers::registers::{Scaled, Stages, blocks};
use contact_geom::ScalarSystem;
use pulp::{Simd, WithSimd};
use smallvec::{SmallVec, smallvec};

impl<F: ScalarSystem> SeparableKernel for InRegisters<F> {
    fn iterate(&self, arch: Instructions, run: &mut Separable, start: IterationStart) -> Iterated {
        few_coordinates!(self, self.0.dimension(), few => few.iterate(arch, run, start), {
            arch.dispatch(Iterate { system: self, run, start })
        })
    }

    fn stage_values(&self, arch: Instructions, solved: CondensedStages<'_>) -> Stages {
        few_coordinates!(self, self.0.dimension(), few => few.stage_values(arch, solved), {
            arch.dispatch(StageValues { system: &*self.0, solved })
        })
    }
}

impl<F: ScalarSystem> ForceSystem for InRegisters<F> {
    #[inline(always)]
    fn coordinates(&self) -> usize {
        self.0.dimension()
    }

    #[inline(always)]
    fn take_all_forces<S: Simd>(&self, stages: &mut StageForces<'_>, m: usize) -> [Lanes<S>; 2] {
        let mut most = [Lanes::<S>::splat(0.0); 2];
        let mut r = 0;
        while r < m {
            r = over_registers!(stages.take_forces_in(&*self.0, r, &mut most); true, S, m - r);
        }
        most
    }

    #[inline(always)]
    fn solved_values<S: Simd>(&self, solved: Solution<'_>, v: &[CompensatedSum]) -> Stages {
        let Solution { table, t, a, x } = solved;
        let mut v0: SmallVec<[f64; 16]> = SmallVec::new();
        v0.extend(v.iter().map(|v| v.value));
        let mut velocities: SmallVec<[Stages; 16]> = smallvec![Stages::ZERO; v.len()];
        let solved = CondensedStages { table, t, v0: &v0, a, x, v: &mut velocities };
        StageValues { system: &*self.0, solved }.values::<S>()
    }
}

impl StageForces<'_> {
    /// Evaluates the forces at the blocks of stages that T holds, from the r-th on; returns the index of the next
    /// block.
    #[inline(always)]
    fn take_forces_in<S: Simd, T: Registers<S>>(
        &mut self,
        system: &impl ScalarSystem,
        r: usize,
        most: &mut [Lanes<S>; 2],
    ) -> usize {
        let n = self.x.len();
        let mut q = Coordinates::<T>::new();
        for x in self.x.iter() {
            q.push(T::of(x, r));
        }
        let mut force = zeros::<T>(n);
        let at = T::of(self.times, r) + self.t;
        system.force::<T, 0>(at, &q, &mut force);
        if system.has_force() {
            add_force(system, at, (&q, &zeros::<T>(n), T::zero()), &mut force);
        }
        for i in 0..T::COUNT {
            for d in 0..n {
                let a = match self.inverse_mass() {
                    None => force[d].register(i),
                    Some(inverse) => {
                        let mut a = Lanes::<S>::splat(0.0);
                        for j in 0..n {
                            a += force[j].register(i) * inverse[d + n * j];
                        }
                        a
                    }
                };
                self.store(r + i, d, a, most);
            }
        }
        r + T::COUNT
    }
}

/// The kernel that computes the velocities at the stages of a step, and evaluates `L(t, q, v, 0)` there.
struct StageValues<'a, F> {
    system: &'a F,
    solved: CondensedStages<'a>,
}

impl<F: ScalarSystem> WithSimd for StageValues<'_, F> {
    type Output = Stages;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Stages {
        self.values::<S>()
    }
}

impl<F: ScalarSystem> StageValues<'_, F> {
    #[inline(always)]
    fn values<S: Simd>(self) -> Stages {
        let StageValues { system, solved: CondensedStages { table, t, v0, a, x, v } } = self;
        let s = table.s;
        for ((v, a), v0) in v.iter_mut().zip(a).zip(v0) {
            table.d.apply(a, s, v, Scaled(&table.inverse_rho, Lanes::<S>::splat(*v0)));
        }
        let stages = At { system, t, times: &table.times, x, v };
        let (mut values, mut r, m) = (Stages::ZERO, 0, blocks::<S>(s));
        while r < m {
            r = over_registers!(stages.take(r, &mut values); true, S, m - r);
        }
        values
    }
}

/// The points at which L is evaluated.
struct At<'a, F> {
    system: &'a F,
    t: f64,
    times: &'a Stages,
    x: &'a [Stages],
    v: &'a [Stages],
}

impl<F: ScalarSystem> At<'_, F> {
    /// Evaluates the blocks of stages that T holds, from the r-th on; returns the index of the next block.
    #[inline(always)]
    fn take<S: Simd, T: Registers<S>>(&self, r: usize, values: &mut Stages) -> usize {
        let (mut q, mut v) = (Coordinates::<T>::new(), Coordinates::<T>::new());
        for d in 0..self.x.len() {
            q.push(T::of(&self.x[d], r));
            v.push(T::of(&self.v[d], r));
        }
        let l = self.system.value::<T, 0>(T::of(self.times, r) + self.t, &q, &v, T::zero());
        for i in 0..T::COUNT {
            values.set(r + i, l.register(i));
        }
        r + T::COUNT
    }
}
