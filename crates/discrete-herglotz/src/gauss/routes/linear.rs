//! Steps of contact Gauss collocation for a linear motion: one precomputed matrix.

mod coefficients;
mod step;

use crate::StepError;
use crate::gauss::curve::Curve;
use crate::gauss::dense::{Solved, SolvedStep, StepStart};
use crate::gauss::resolution::defect_sample::SAMPLE_SETS;
use crate::gauss::routes::linear::coefficients::{LinearStages, StepMap};
use crate::gauss::routes::linear::step::Advance;
use crate::gauss::routes::{RouteState, RouteStateMut, StageRoute};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::system::{CollocationSystem, PointRef};
use crate::gauss::tables::condensed::Condensed;
use crate::gauss::work_summary::GaussRoute;
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{MAX_STAGES, Stages};
use crate::numbers::state_words::saved;
use contact_geom::nalgebra::DMatrix;
use std::sync::Arc;

/// The number of coordinates up to which the stages of a step are computed on the stack.
const FEW: usize = 4;

/// The state of a linear motion, and the affine map to its changes in a step, `q1 - q0` and `v1 - v0`.
pub(crate) struct Linear {
    /// The instruction set of the kernels.
    pub arch: Instructions,
    table: Arc<Condensed>,
    map: StepMap,
    /// The accelerations of the stages as affine functions of (q0, v0), in row `i n + d`; for dense output.
    stages: Vec<Vec<f64>>,
    q: Vec<CompensatedSum>,
    v: Vec<CompensatedSum>,
    z: CompensatedSum,
    /// q and v of a trial, and those at the start of its last step; for many coordinates.
    trial: [Vec<CompensatedSum>; 4],
    /// The start of a step that is taken alone.
    start: StepStart,
}

impl Linear {
    /// The step for `a = M^-1 L_q = -K q + f`; `None` if the stage equations are singular.
    #[inline(never)]
    pub fn new(
        system: &dyn CollocationSystem,
        table: &Arc<Condensed>,
        inverse_mass: &DMatrix<f64>,
        t: f64,
        start: PointRef<'_>,
        wants_z: bool,
    ) -> Option<Self> {
        let LinearStages { map, accelerations } = LinearStages::new(system, table, inverse_mass, t, start, wants_z)?;
        let sums = |x: &[f64]| -> Vec<CompensatedSum> { x.iter().map(|x| CompensatedSum::from(*x)).collect() };
        let trial = || sums(start.q);
        Some(Linear {
            arch: Instructions::new(),
            table: table.clone(),
            map,
            stages: accelerations,
            q: sums(start.q),
            v: sums(start.v),
            z: start.z.into(),
            trial: [trial(), trial(), trial(), trial()],
            start: StepStart::zeros(start.q.len()),
        })
    }

    /// Takes steps until the state is not finite; the state is then that before the failed step. Returns the number of
    /// steps; the start of the last one is written.
    ///
    /// The state is checked at the end of all steps; only if it is not finite they are repeated from the start with a
    /// check after each step.
    fn advance(&mut self, steps: usize, last: &mut StepStart) -> usize {
        if self.try_steps(steps, last) {
            return steps;
        }
        (0..steps).take_while(|_| self.try_steps(1, last)).count()
    }

    /// Takes steps and writes the start of the last one; `false`, without a change of the state, if its end is not
    /// finite.
    fn try_steps(&mut self, steps: usize, last: &mut StepStart) -> bool {
        let Linear { arch, map, q, v, z, trial, .. } = self;
        arch.dispatch(Advance { map, q, v, z, trial, last, steps })
    }

    /// Gives the accelerations and the positions of the stages of a step to a function. For few coordinates they are on the
    /// stack, so that nothing is allocated.
    fn with_stages(&self, step: &SolvedStep<'_>, then: &mut dyn FnMut([&[Stages]; 2])) {
        let n = self.q.len();
        let (mut few, mut many) = ([Stages::ZERO; 2 * FEW], Vec::new());
        let both = if n <= FEW {
            &mut few[..2 * n]
        } else {
            many.resize(2 * n, Stages::ZERO);
            &mut many[..]
        };
        let (a, x) = both.split_at_mut(n);
        self.set_stages(step, a, x);
        then([a, x]);
    }

    /// Computes the accelerations and the positions of the stages of a step.
    fn set_stages(&self, step: &SolvedStep<'_>, a: &mut [Stages], positions: &mut [Stages]) {
        let StepStart { q, y: v, .. } = step.from;
        let (n, s, table) = (q.len(), self.table.s, &self.table);
        for (d, a) in a.iter_mut().enumerate() {
            for i in 0..s {
                let sides = q.iter().chain(v).chain(&[1.0]);
                a.0[i] = self.stages[i * n + d].iter().zip(sides).map(|(e, side)| e * side).sum();
            }
        }
        for (d, positions) in positions.iter_mut().enumerate() {
            for i in 0..MAX_STAGES {
                // The last stage is repeated in the padding.
                let i_or_last = i.min(s - 1);
                let mut x = q[d] + table.u[i_or_last].0 * v[d];
                for (b, a) in table.b[i_or_last].iter().zip(&a[d].0).take(s) {
                    x += b.0 * a;
                }
                positions.0[i] = x;
            }
        }
    }
}

saved!([] Linear { q, v, z });

/// Its steps solve no equations: no iteration, and no Newton method.
impl StageRoute for Linear {
    fn route(&self) -> GaussRoute {
        GaussRoute::Linear
    }

    fn state(&self) -> RouteState<'_> {
        RouteState { q: &self.q, y: &self.v, z: self.z }
    }

    fn state_mut(&mut self) -> RouteStateMut<'_> {
        RouteStateMut { q: &mut self.q, y: &mut self.v, z: &mut self.z }
    }

    fn step(&mut self, _system: &dyn CollocationSystem, _t: f64) -> IterationOutcome {
        let Linear { arch, map, q, v, z, trial, start, .. } = self;
        let finite = arch.dispatch(Advance { map, q, v, z, trial, last: start, steps: 1 });
        if finite { IterationOutcome::Done } else { IterationOutcome::NonFinite }
    }

    fn take_steps(&mut self, steps: usize, last: &mut StepStart) -> Option<usize> {
        Some(self.advance(steps, last))
    }

    fn defect(&self) -> f64 {
        0.0
    }

    /// A linear motion that is not resolved is unresolved in every step, and no step was sampled during the run.
    fn sample_sets(&self) -> usize {
        SAMPLE_SETS
    }

    fn sigma(&self) -> f64 {
        1.0 + self.table.grow.head
    }

    fn evaluations(&self) -> u64 {
        0
    }

    fn restart(&mut self, _v: &[f64]) -> bool {
        true
    }

    fn reserve_newton(&mut self, _system: &dyn CollocationSystem) {}

    fn linearise_at_state(&mut self, _system: &dyn CollocationSystem, _t: f64) -> bool {
        false
    }

    fn suspend_newton(&mut self) {}

    fn solve_stages(&mut self, _system: &dyn CollocationSystem, _t: f64) -> Result<(), StepError> {
        Ok(())
    }

    /// The values of L are known if z is advanced.
    fn solved(&self, system: &dyn CollocationSystem, step: &SolvedStep<'_>, wants_l: bool, to: Solved<'_>) -> bool {
        let (knows_l, mut to) = (wants_l && self.map.action.is_some(), Some(to));
        self.with_stages(step, &mut |stages| {
            if let Some(to) = to.take() {
                to.set_accelerations(system, step, &self.table, stages, knows_l);
            }
        });
        knows_l
    }

    fn collect(&self, system: &dyn CollocationSystem, step: &SolvedStep<'_>, curve: &mut Curve) {
        self.with_stages(step, &mut |stages| curve.of_accelerations(system, step, &self.table, stages));
    }

    #[cfg(test)]
    fn set_instructions(&mut self, arch: Instructions) {
        self.arch = arch;
    }
}
