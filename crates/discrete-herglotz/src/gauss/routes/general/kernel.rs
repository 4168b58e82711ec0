//! The solution of the stage equations of a general step by iteration, compiled for each Lagrangian.

use crate::gauss::limits::MAX_DIMENSION_IN_LANES;
use crate::gauss::routes::general::General;
use crate::gauss::routes::general::iteration::Iteration;
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::stages::stage_newton::{StageNewton, StagesInIteration};
use crate::gauss::system::Typed;
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::blocks;
use contact_geom::{Derivatives, Lagrangian};
use pulp::{Simd, WithSimd};

/// The stages before the first iteration.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum GivenStages {
    /// They solve the stage equations; L is evaluated there.
    Solution,
    /// An extrapolation, together with L and its gradients.
    WithGradients,
    /// A guess, at which L is not known.
    Guess,
}

/// The part of a general step that evaluates L.
pub(crate) trait GeneralKernel {
    /// Solves the stage equations of a step from the time `t` by fixed-point iteration or simplified Newton iteration,
    /// to convergence or failure.
    fn solve_general_stages(
        &self,
        arch: Instructions,
        t: f64,
        given: GivenStages,
        general: &mut General,
    ) -> (IterationOutcome, FixedPointIteration);
}

/// In physical time.
impl<L: Lagrangian<N>, const N: usize> GeneralKernel for Typed<'_, L, N> {
    fn solve_general_stages(
        &self,
        arch: Instructions,
        t: f64,
        given: GivenStages,
        general: &mut General,
    ) -> (IterationOutcome, FixedPointIteration) {
        if const { L::HINTS.hamiltonian } {
            // Such a Lagrangian has a route of its own.
            return (IterationOutcome::NonFinite, FixedPointIteration::default());
        }
        arch.dispatch(SolveStages::<L, N, false> { lagrangian: self.0, t, given, general })
    }
}

/// The kernel of a Lagrangian in its transformed time. It is a type of its own, so that it is compiled only for
/// Lagrangians whose motions are computed in transformed time.
pub(crate) struct InTransformedTime<'a, L, const N: usize>(pub &'a L);

impl<L: Lagrangian<N>, const N: usize> GeneralKernel for InTransformedTime<'_, L, N> {
    fn solve_general_stages(
        &self,
        arch: Instructions,
        t: f64,
        given: GivenStages,
        general: &mut General,
    ) -> (IterationOutcome, FixedPointIteration) {
        arch.dispatch(SolveStages::<L, N, true> { lagrangian: self.0, t, given, general })
    }
}

/// The iteration of one step, in physical or in transformed time.
struct SolveStages<'b, L, const N: usize, const TRANSFORMED: bool> {
    lagrangian: &'b L,
    t: f64,
    given: GivenStages,
    general: &'b mut General,
}

impl<L: Lagrangian<N>, const N: usize, const TRANSFORMED: bool> WithSimd for SolveStages<'_, L, N, TRANSFORMED> {
    type Output = (IterationOutcome, FixedPointIteration);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let SolveStages { lagrangian, t, given, general } = self;
        if !invert_mass::<S, L, N>(general, lagrangian, t) {
            return (IterationOutcome::NonFinite, FixedPointIteration::default());
        }
        let General { newton, arch, evaluations, tolerance, .. } = general;
        let (newton, arch, tolerance) = (newton.as_deref_mut(), *arch, *tolerance);
        let stages = Iteration::<N, TRANSFORMED> {
            m: &general.m,
            table: &general.table,
            vectors: general.vectors.for_dimension(N),
            l: &mut general.l,
            rate: &mut general.rate,
            one_minus_rho_stages: &mut general.one_minus_rho_stages,
            z_stages: &mut general.z_stages,
            g: &mut general.extension.g,
            p_t: general.extension.p_t.value,
            inverse: general.mass.inverse(N),
            follows: general.follows,
            q: &general.q[..N],
            p: &general.p[..N],
            z: general.z.value,
        };
        solve::<S, _>(OfLagrangian { lagrangian, stages }, newton, (arch, tolerance), evaluations, t, given)
    }
}

/// The stages of a step, as the solution of their equations moves them.
pub(crate) trait MovingStages {
    /// The number of stages.
    fn count(&self) -> usize;

    /// One fixed-point iteration: moves the stages, and returns the largest relative change.
    fn iterate<S: Simd>(&mut self) -> f64;

    /// Evaluates L and its gradient at the stages. Returns the largest relative change of the rates dt/dtau, or 0 in
    /// physical time.
    fn evaluate<S: Simd>(&mut self, t: f64) -> f64;

    /// The stages for a correction by simplified Newton iteration.
    fn in_newton(&mut self) -> StagesInIteration<'_>;
}

/// Solves the stage equations of a step from the time t.
#[inline(always)]
pub(crate) fn solve<S: Simd, M: MovingStages>(
    mut stages: M,
    mut newton: Option<&mut StageNewton>,
    (arch, tolerance): (Instructions, f64),
    evaluations: &mut u64,
    t: f64,
    given: GivenStages,
) -> (IterationOutcome, FixedPointIteration) {
    let mut iteration = FixedPointIteration::until(1.0, 0.25).with_tolerance(tolerance);
    // The extrapolated L_v are not those of the extrapolated velocities. A small first change is then no sign
    // of convergence, and the convergence test starts again with the next iteration.
    let mut carried = given == GivenStages::WithGradients;
    let mut first = !carried;
    // L is evaluated at one place in the code, so that it is inlined into this loop and compiled for its
    // instruction set.
    loop {
        let change = if first {
            f64::INFINITY
        } else if let Some(newton) = &mut newton {
            let (change, moved) = newton.correct(arch, stages.in_newton());
            iteration.still = moved <= 4.0 * f64::EPSILON;
            change
        } else {
            stages.iterate::<S>()
        };
        let of_transformed = stages.evaluate::<S>(t);
        *evaluations += stages.count() as u64;
        if given == GivenStages::Solution {
            return (IterationOutcome::Done, iteration);
        }
        if first {
            first = false;
            continue;
        }
        // `f64::max` would hide a NaN.
        let larger = of_transformed > change || of_transformed.is_nan();
        let change = if larger { of_transformed } else { change };
        match iteration.assess(change, 1.0) {
            IterationOutcome::Continue => {}
            IterationOutcome::Done if carried => {
                iteration = FixedPointIteration::until(1.0, 0.25).with_tolerance(tolerance);
            }
            outcome => return (outcome, iteration),
        }
        carried = false;
    }
}

/// The stages of a step of a Lagrangian.
struct OfLagrangian<'k, L, const N: usize, const TRANSFORMED: bool> {
    lagrangian: &'k L,
    stages: Iteration<'k, N, TRANSFORMED>,
}

impl<L: Lagrangian<N>, const N: usize, const TRANSFORMED: bool> MovingStages for OfLagrangian<'_, L, N, TRANSFORMED> {
    #[inline(always)]
    fn count(&self) -> usize {
        self.stages.table.s
    }

    #[inline(always)]
    fn iterate<S: Simd>(&mut self) -> f64 {
        self.stages.iterate::<S>()
    }

    #[inline(always)]
    fn evaluate<S: Simd>(&mut self, t: f64) -> f64 {
        self.stages.evaluate::<S, L>(self.lagrangian, t)
    }

    #[inline(always)]
    fn in_newton(&mut self) -> StagesInIteration<'_> {
        let stages = &mut self.stages;
        StagesInIteration {
            table: stages.table,
            start: (stages.q, stages.p, stages.z),
            l_v: stages.vectors.l_v,
            l: stages.l,
            force: stages.vectors.force,
            rate: stages.rate,
            v: stages.vectors.v,
            z: stages.z_stages,
            one_minus_rho_stages: stages.one_minus_rho_stages,
            moved: stages.vectors.moved,
            x: stages.vectors.x,
        }
    }
}

/// Inverts W at the stages if it is not constant; `false` if it is singular. For many coordinates the inverses are
/// computed before.
#[inline(always)]
fn invert_mass<S: Simd, L: Lagrangian<N>, const N: usize>(general: &mut General, lagrangian: &L, t: f64) -> bool {
    if const { N > MAX_DIMENSION_IN_LANES } || matches!(general.mass, Mass::Constant(_)) {
        return true;
    }
    let General { table, vectors, z_stages, mass, .. } = general;
    let vectors = vectors.for_dimension(N);
    for r in 0..blocks::<S>(table.s) {
        let at = table.times.block::<S>(r) + t;
        let w = lagrangian.mass_matrix(at, &vectors.point::<S, N>(z_stages, r));
        if !mass.invert(r, &w) {
            return false;
        }
    }
    true
}
