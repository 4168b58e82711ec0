//! The solution of the stage equations by iteration, compiled for each contact Hamiltonian.

use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::hamiltonian::iteration::Iteration;
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::system::Typed;
use crate::numbers::instructions::Instructions;
use contact_geom::Lagrangian;
use pulp::{Simd, WithSimd};

/// From what the iteration starts.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum IterationStart {
    /// The stages of a motion at rest.
    AtRest,
    /// Extrapolated right-hand sides.
    Extrapolated,
    /// Right-hand sides that solve the stage equations.
    Solution,
    /// The right-hand sides of the last iteration.
    LastIterate,
}

/// The part of a step that evaluates the contact Hamiltonian. The default is for systems that take other routes.
pub(crate) trait HamiltonianKernel {
    /// Solves the stage equations of a step from the time `t` by fixed-point iteration or simplified Newton iteration,
    /// to convergence or failure.
    fn solve_hamiltonian_stages(
        &self,
        arch: Instructions,
        t: f64,
        start: IterationStart,
        stages: &mut HamiltonianStages,
    ) -> (IterationOutcome, FixedPointIteration) {
        let _ = (arch, t, start, stages);
        (IterationOutcome::NonFinite, FixedPointIteration::default())
    }
}

impl<L: Lagrangian<N>, const N: usize> HamiltonianKernel for Typed<'_, L, N> {
    fn solve_hamiltonian_stages(
        &self,
        arch: Instructions,
        t: f64,
        start: IterationStart,
        stages: &mut HamiltonianStages,
    ) -> (IterationOutcome, FixedPointIteration) {
        if const { L::HINTS.hamiltonian } {
            arch.dispatch(SolveStages::<L, N> { lagrangian: self.0, t, start, stages })
        } else {
            // Such a Lagrangian has other routes.
            (IterationOutcome::NonFinite, FixedPointIteration::default())
        }
    }
}

/// The iteration of one step.
struct SolveStages<'b, L, const N: usize> {
    lagrangian: &'b L,
    t: f64,
    start: IterationStart,
    stages: &'b mut HamiltonianStages,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for SolveStages<'_, L, N> {
    type Output = (IterationOutcome, FixedPointIteration);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let SolveStages { lagrangian, t, start, stages } = self;
        let mut iteration = FixedPointIteration::until(1.0, 0.25).with_tolerance(stages.tolerance);
        let HamiltonianStages { table, rows, newton, q, p, z, pp, least, evaluations, .. } = stages;
        let (Some(rows), Some(q), Some(p)) = (rows.for_dimension::<N>(), q.first_chunk(), p.first_chunk()) else {
            return (IterationOutcome::NonFinite, iteration);
        };
        let mut stages = Iteration { lagrangian, table, rows, q, p, z: z.value, pp: &pp[..N * N], least: *least };
        let mut first = start != IterationStart::LastIterate;
        // H is evaluated at one place in the code, so that it is inlined into this loop and compiled for its instruction
        // set.
        loop {
            let mut by_newton = false;
            if !first && let Some(newton) = newton.as_deref_mut() {
                by_newton = true;
                let rows = &mut stages.rows;
                newton.correct([rows.moved, rows.force], [rows.l, rows.rate]);
            }
            let change = if first && start == IterationStart::AtRest {
                f64::INFINITY
            } else {
                stages.move_stages::<S>(!first && !by_newton)
            };
            stages.evaluate::<S>(t);
            *evaluations += stages.table.s as u64;
            if start == IterationStart::Solution {
                return (IterationOutcome::Done, iteration);
            }
            if first {
                first = false;
                continue;
            }
            match iteration.assess(change, 1.0) {
                IterationOutcome::Continue => {}
                outcome => return (outcome, iteration),
            }
        }
    }
}
