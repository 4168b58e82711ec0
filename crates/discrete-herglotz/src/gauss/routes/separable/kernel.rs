//! The evaluation of the forces at the stages of a condensed step, compiled for each Lagrangian.

use crate::gauss::limits::MAX_CHANGE_FOR_TAILS;
use crate::gauss::routes::separable::Separable;
use crate::gauss::routes::separable::slope::store_values;
use crate::gauss::routes::separable::vectors::Parts;
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::stages::stage_values::{CondensedStages, StageValues};
use crate::gauss::system::Typed;
use crate::gauss::tables::condensed::{Condensed, Preconditioned};
use crate::numbers::compensated::{CompensatedSum, copy_values};
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::{Lanes, token};
use crate::numbers::pair::{Registers, over_registers};
use crate::numbers::registers::{Stages, blocks};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{Derivatives, Lagrangian, VelocityPoint, vector};
use pulp::{Simd, WithSimd};

/// The part of a condensed step that evaluates L.
pub(crate) trait SeparableKernel {
    /// Solves the stage equations of a step by fixed-point iteration, or by simplified Newton iteration, and evaluates
    /// `L - gamma z` at the solution if z is advanced.
    fn iterate(&self, arch: Instructions, run: &mut Separable, start: IterationStart) -> Iterated;

    /// `L(t, q, v, 0)` at the stages of a solved step, and the velocities there.
    fn stage_values(&self, arch: Instructions, solved: CondensedStages<'_>) -> Stages;
}

/// The start of an iteration; its initial guess is `rest`, or is extrapolated from it.
#[derive(Clone, Copy)]
pub(crate) struct IterationStart {
    /// The time at the start of the step.
    pub t: f64,
    /// Whether `rest` is the solution.
    pub solved: bool,
    /// Whether `rest` is the solution of the step before, from which it is extrapolated.
    pub predicts: bool,
    /// The weight of the terms with the tails of the matrices.
    pub weight: f64,
}

/// The result of an iteration.
pub(crate) struct Iterated {
    /// [`Done`](IterationOutcome::Done), or the cause of failure.
    pub outcome: IterationOutcome,
    /// The convergence test after the last iteration.
    pub iteration: FixedPointIteration,
    /// The last change of the accelerations.
    pub change: f64,
}

impl Iterated {
    /// The result for a system that takes other routes.
    pub fn failed() -> Self {
        let (outcome, iteration) = (IterationOutcome::NonFinite, FixedPointIteration::default());
        Iterated { outcome, iteration, change: f64::NAN }
    }
}

/// A Lagrangian that is given by a contact Hamiltonian has a route of its own, so that nothing is compiled for it here.
impl<L: Lagrangian<N>, const N: usize> SeparableKernel for Typed<'_, L, N> {
    fn iterate(&self, arch: Instructions, run: &mut Separable, start: IterationStart) -> Iterated {
        if const { L::HINTS.hamiltonian } {
            return Iterated::failed();
        }
        arch.dispatch(Iterate { system: self, run, start })
    }

    fn stage_values(&self, arch: Instructions, solved: CondensedStages<'_>) -> Stages {
        if const { L::HINTS.hamiltonian } {
            return Stages::ZERO;
        }
        arch.dispatch(StageValues::<L, N> { lagrangian: self.0, solved })
    }
}

/// A system whose forces are evaluated at the stages of a condensed step.
pub(crate) trait ForceSystem {
    /// The number of coordinates.
    fn coordinates(&self) -> usize;

    /// Evaluates the forces at all stages, and stores the accelerations and `rest`. Returns the largest change of `rest` and
    /// the largest of its terms.
    fn take_all_forces<S: Simd>(&self, stages: &mut StageForces<'_>, m: usize) -> [Lanes<S>; 2];

    /// `L(t, q, v, 0)` at the stages of a solved step from the velocities `v`.
    fn solved_values<S: Simd>(&self, solved: Solution<'_>, v: &[CompensatedSum]) -> Stages;
}

/// A solved condensed step from the time t: its accelerations and positions.
pub(crate) struct Solution<'a> {
    pub table: &'a Condensed,
    pub t: f64,
    pub a: &'a [Stages],
    pub x: &'a [Stages],
}

/// The kernel of [`SeparableKernel::iterate`].
pub(super) struct Iterate<'a, F> {
    pub system: &'a F,
    pub run: &'a mut Separable,
    pub start: IterationStart,
}

impl<F: ForceSystem> WithSimd for Iterate<'_, F> {
    type Output = Iterated;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Iterated {
        let Iterate { system, run, start: IterationStart { t, solved, predicts, weight } } = self;
        let Separable {
            arch,
            table,
            vectors,
            inverse_mass,
            wants_z,
            q,
            v,
            far,
            newton,
            before,
            values,
            evaluations,
            tolerance,
            ..
        } = run;
        let n = system.coordinates();
        let (s, m, state) = (table.s, blocks::<S>(table.s), [&q[..n], &v[..n]]);
        let Parts { left, rest, x, a, base } = vectors.parts(n);
        let (times, inverse_mass, kappa) = (&table.times, inverse_mass.as_ref(), left.kappa);
        let mut stages = StageForces { times, t, kappa, inverse_mass, x, rest, a };
        let mut newton = newton.as_deref_mut();
        if predicts {
            for rest in stages.rest.iter_mut() {
                let before = *rest;
                table.extrapolation.apply(&before, s, rest, Lanes::<S>::splat(0.0));
            }
        }
        if let Some(newton) = &mut newton {
            newton.begin(stages.rest);
        }
        // Terms below round-off are added from the second iteration on; computed beside the forces of the first one
        // they cost little. If the initial guess is poor, the terms with the tails of the matrices use the values of a
        // later iteration.
        let at_once = solved || newton.is_some();
        let tails = !at_once && weight > 0.0;
        let mut due = tails && *far;
        let mut aside = !at_once && !due;
        let (mut small, mut again) = (at_once.then_some(weight), true);
        *far &= !tails;
        // With secant steps the changes decrease so fast that a smaller tolerance costs no further iteration.
        let mut iteration = FixedPointIteration::until(1.0 / 16.0, if n == 1 { 1.0 / 256.0 } else { 1.0 / 64.0 })
            .with_tolerance(*tolerance);
        let (outcome, change) = loop {
            if again {
                begin::<S>(left, s, state, stages.rest, base, small);
                // In simplified Newton iteration the terms with the tails are updated after each correction.
                (small, again) = (Some(weight), newton.is_some());
            }
            left.head.b.apply_to_each::<S>(stages.rest, s, stages.x, base);
            if aside {
                aside = false;
                begin::<S>(left, s, state, stages.rest, base, small);
            }
            let [change, size] = system.take_all_forces::<S>(&mut stages, m);
            *evaluations += s as u64;
            let (mut change, size) = (change.reduce_max(), size.reduce_max());
            if solved {
                break (IterationOutcome::Done, change);
            }
            if let Some(newton) = &mut newton {
                (change, iteration.still) = newton.correct(*arch, stages.rest, stages.x);
            }
            match iteration.assess(change, size) {
                IterationOutcome::Continue if tails && change > MAX_CHANGE_FOR_TAILS * size => {
                    (due, *far) = (true, true)
                }
                IterationOutcome::Continue => (again, due) = (again || due, false),
                outcome if n == 1 && iteration.ends_with_secant() => {
                    let iterate = [&mut stages.x[0], &mut stages.rest[0]];
                    store_values::<S>(left, s, &base[0], iterate, before, true);
                    let kappa = Lanes::<S>::splat(left.kappa);
                    for r in 0..m {
                        stages.a[0].set(r, stages.rest[0].block::<S>(r) - kappa * stages.x[0].block(r));
                    }
                    break (outcome, change);
                }
                outcome => break (outcome, change),
            }
            if n == 1 && newton.is_none() {
                let extrapolation = iteration.secant_step(change / size);
                let iterate = [&mut stages.x[0], &mut stages.rest[0]];
                store_values::<S>(left, s, &base[0], iterate, before, extrapolation);
            }
        };
        if outcome == IterationOutcome::Done && newton.is_some() {
            // Stiff forces magnify the round-off of the positions; the corrected accelerations do not contain it.
            for (a, rest) in stages.a.iter_mut().zip(stages.rest.iter()) {
                *a = *rest;
            }
        }
        if outcome == IterationOutcome::Done && *wants_z {
            *values = system.solved_values::<S>(Solution { table, t, a: stages.a, x: stages.x }, &v[..n]);
        }
        Iterated { outcome, iteration, change }
    }
}

/// The stages of a step from the time t, at the positions `x`.
pub(crate) struct StageForces<'a> {
    pub times: &'a Stages,
    pub t: f64,
    kappa: f64,
    inverse_mass: Option<&'a DMatrix<f64>>,
    pub x: &'a mut [Stages],
    rest: &'a mut [Stages],
    a: &'a mut [Stages],
}

impl<L: Lagrangian<N>, const N: usize> ForceSystem for Typed<'_, L, N> {
    #[inline(always)]
    fn coordinates(&self) -> usize {
        N
    }

    #[inline(always)]
    fn take_all_forces<S: Simd>(&self, stages: &mut StageForces<'_>, m: usize) -> [Lanes<S>; 2] {
        let mut most = [Lanes::<S>::splat(0.0); 2];
        let (mut forces, mut r) = (Forces { lagrangian: self.0, stages }, 0);
        while r < m {
            r = over_registers!(forces.take(r, &mut most); L::HINTS.interpreted, S, m - r);
        }
        most
    }

    #[inline(always)]
    fn solved_values<S: Simd>(&self, solved: Solution<'_>, v: &[CompensatedSum]) -> Stages {
        let mut v0 = [0.0; N];
        copy_values(v, &mut v0);
        // On the stack, which is faster than memory of the run.
        let mut velocities = [Stages::ZERO; N];
        let Solution { table, t, a, x } = solved;
        let solved = CondensedStages { table, t, v0: &v0, a, x, v: &mut velocities };
        StageValues::<L, N> { lagrangian: self.0, solved }.with_simd(token::<S>())
    }
}

/// The forces of a Lagrangian at the stages of a step.
struct Forces<'f, 'a, L, const N: usize> {
    lagrangian: &'f L,
    stages: &'f mut StageForces<'a>,
}

impl<L: Lagrangian<N>, const N: usize> Forces<'_, '_, L, N> {
    /// Evaluates the forces at the blocks of stages that T holds, from the r-th on; returns the index of the next
    /// block.
    #[inline(always)]
    fn take<S: Simd, T: Registers<S>>(&mut self, r: usize, most: &mut [Lanes<S>; 2]) -> usize {
        let StageForces { x, times, t, .. } = &*self.stages;
        let x = VelocityPoint { q: vector!(|d| T::of(&x[d], r)), v: vector!(|_| T::zero()), z: T::zero() };
        let force = self.lagrangian.force(T::of(times, r) + *t, &x);
        for i in 0..T::COUNT {
            let a = self.accelerations(vector!(|d| force[d].register(i)));
            for d in 0..N {
                self.stages.store(r + i, d, a[d], most);
            }
        }
        r + T::COUNT
    }

    /// The accelerations `M^-1` times the forces.
    #[inline(always)]
    fn accelerations<S: Simd>(&self, force: SVector<Lanes<S>, N>) -> SVector<Lanes<S>, N> {
        let zero = Lanes::<S>::splat(0.0);
        match self.stages.inverse_mass {
            None => force,
            Some(inverse) => {
                let (inverse, mut accelerations) = (&inverse.as_slice()[..N * N], vector!(|_| zero));
                for i in 0..N {
                    for j in 0..N {
                        accelerations[i] += force[j] * inverse[i + N * j];
                    }
                }
                accelerations
            }
        }
    }
}

impl StageForces<'_> {
    /// Stores an acceleration at one block of stages.
    #[inline(always)]
    pub fn store<S: Simd>(&mut self, r: usize, d: usize, a: Lanes<S>, [change, size]: &mut [Lanes<S>; 2]) {
        let linear = Lanes::<S>::splat(self.kappa) * self.x[d].block(r);
        let rest = a + linear;
        *change = change.max((rest - self.rest[d].block(r)).abs());
        *size = size.max(a.abs()).max(linear.abs());
        self.rest[d].set(r, rest);
        self.a[d].set(r, a);
    }

    /// The inverse mass matrix, by columns; `None` where it is the identity.
    pub fn inverse_mass(&self) -> Option<&[f64]> {
        self.inverse_mass.map(|inverse| inverse.as_slice())
    }
}

/// Computes `base`, the terms of the stage positions from the state. If a weight is given, terms below round-off are
/// included: those of the compensation terms of the state, whose direction is not random, and the weight times those of
/// the tails of the matrices.
#[inline(always)]
fn begin<S: Simd>(
    left: &Preconditioned,
    s: usize,
    [q, v]: [&[CompensatedSum]; 2],
    rest: &[Stages],
    base: &mut [Stages],
    small: Option<f64>,
) {
    let (head, m) = (&left.head, blocks::<S>(s));
    for ((base, rest), (q, v)) in base.iter_mut().zip(rest).zip(q.iter().zip(v)) {
        let (q_rest, v_rest) = (Lanes::<S>::splat(q.rest), Lanes::<S>::splat(v.rest));
        let (q, v) = (Lanes::<S>::splat(q.value), Lanes::<S>::splat(v.value));
        let Some(weight) = small else {
            for r in 0..m {
                base.set(r, head.of_state(q, v, r));
            }
            continue;
        };
        let tail = if weight > 0.0 { left.tail.as_ref() } else { None };
        if let Some(tail) = tail {
            for r in 0..m {
                base.set(r, tail.of_state(q, v, r));
            }
            tail.b.add::<S>(rest, s, base);
        }
        let weight = Lanes::<S>::splat(weight);
        for r in 0..m {
            let mut small = head.of_state(q_rest, v_rest, r);
            if tail.is_some() {
                small = weight.mul_add(base.block(r), small);
            }
            // The small terms are added first, since they are below the round-off of the full sum.
            base.set(r, head.q.block::<S>(r).mul_add(q, head.u.block::<S>(r).mul_add(v, small)));
        }
    }
}
