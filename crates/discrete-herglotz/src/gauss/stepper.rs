//! Stepper of contact Gauss collocation with equal steps in physical time.

mod resolution;
mod retries;
mod state_words;

use crate::gauss::consistent_start::ConsistentStart;
use crate::gauss::dense::{Solved, StepStart};
use crate::gauss::resolution::sequence::Sequence;
use crate::gauss::resolution::tail;
use crate::gauss::routes::general::General;
use crate::gauss::routes::linear::Linear;
use crate::gauss::routes::separable::SeparableStages;
use crate::gauss::stages::equations::{Products, Workspace};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::stages::parametrization::{Extension, Physical};
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::gauss::tables::condensed::Condensed;
use crate::gauss::tables::stage_table::StageTable;
use crate::gauss::work_summary::GaussRoute;
use crate::gauss::work_summary::work_summary;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::forget_branches;
use crate::resolution::monitor::ResolutionMonitor;
use crate::resolution::thresholds::FEW_STAGES;
use crate::solve::mass_matrix::is_identity;
use crate::{
    DenseStep, InputError, PlanEntry, StepError, StepFailure, Stepper, UnresolvedStep, integration::SuspectInterval,
};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Derivatives, Lagrangian, PhasePoint, Structure};
use pulp::{Simd, WithSimd};
use retries::{PAUSE, Tried};
use std::sync::Arc;

/// The largest dimension for which a linear motion is advanced by one precomputed matrix.
const MOST_LINEAR: usize = 32;

/// The state and the workspace of a route.
#[allow(clippy::large_enum_variant)] // A run has one, in a box.
enum Route<'a, L, const N: usize> {
    /// Boxed, since its matrices are larger than the data of the other variants.
    Linear(Box<Linear<N>>, Arc<Condensed>),
    Condensed(SeparableStages<'a, L, N>),
    General(General<'a, L, Physical, N>),
}

/// How the stage equations of a step are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Solution {
    /// Fixed-point iteration.
    FixedPointIteration,
    /// Simplified Newton iteration.
    Simplified,
    /// Damped Newton iteration with the derivatives at each stage.
    Newton,
}

/// A stepper of contact Gauss collocation.
///
/// The stages are evaluated in SIMD lanes. Their initial guess is extrapolated from the step before, the fixed-point
/// iteration runs to round-off, and the state is advanced by compensated sums. If the fixed-point iteration does not
/// converge, simplified Newton iteration is used, with a Jacobian that is kept as long as the iteration converges fast;
/// if that does not converge either, Newton's method is used, in the stage positions alone if the mass matrix and the
/// rate are constant. The step fails if none of them converges.
pub struct GaussStepper<'a, L, const N: usize> {
    lagrangian: &'a L,
    s: usize,
    h: f64,
    route: Box<Route<'a, L, N>>,
    mass: Option<Box<SMatrix<f64, N, N>>>,
    arch: Instructions,
    t0: f64,
    k: usize,
    /// The state at the start of the last step.
    from: StepStart<N>,
    /// Whether the stages of the last step are in the route's workspace.
    solved: bool,
    newton: bool,
    solution: Solution,
    /// Steps until the less expensive method of solution is tried again, and their number the next time (doubled at
    /// each change to a more expensive one).
    pause: usize,
    pauses: usize,
    /// The workspace of Newton's method in the general route; made for the first step in which the fixed-point
    /// iteration does not converge.
    by_newton: Option<Box<(Products, Workspace<N>)>>,
    newton_steps: u64,
    /// The defect of a constant conformal factor, see [`tail::of_sigma`].
    of_sigma: f64,
    /// The last mean velocities: present for few stages, where the defect between the nodes is no measure of
    /// resolution, and when suspect intervals are requested.
    sequence: Option<Box<Sequence<N>>>,
    monitor: ResolutionMonitor<N>,
}

impl<'a, L: Lagrangian<N>, const N: usize> GaussStepper<'a, L, N> {
    pub(crate) fn new(
        lagrangian: &'a L,
        (s, h): (usize, f64),
        probed: Option<Structure>,
        t0: f64,
        state: PhasePoint<N>,
        guess: SVector<f64, N>,
        wants_z: bool,
    ) -> Result<Self, InputError> {
        let ConsistentStart { start, structure, w, inverse } =
            ConsistentStart::of(lagrangian, probed, t0, &state, guess)?;
        let condensed = structure.separable && structure.has_constant_rate();
        let (mut mass, mut of_sigma) = (None, 0.0);
        let route = if condensed {
            let table = Condensed::of(s, h, lagrangian.gradient(t0, &start).z)?;
            let unit = is_identity(&w);
            mass = Some(w);
            of_sigma = tail::of_sigma(1.0 + table.grow.head, table.gamma * h);
            // For many coordinates the matrix costs more than the iterations that it saves, and does not fit on the
            // stack.
            let linear = if structure.quadratic && structure.autonomous && const { N <= MOST_LINEAR } {
                Linear::new(lagrangian, &table, &inverse, t0, &start, wants_z)
            } else {
                None
            };
            match linear {
                Some(linear) => Route::Linear(linear, table),
                None => {
                    let left = table.preconditioned(0.0).ok_or(InputError::Step { h })?;
                    let inverse = (!unit).then_some(inverse);
                    Route::Condensed(SeparableStages::new(lagrangian, table, left, inverse, &start, wants_z))
                }
            }
        } else {
            let mass = Mass::new(&structure, inverse);
            let (physical, driven) = (Extension::new(Physical, t0, 0.0), !structure.is_affine_in_z());
            Route::General(General::new(lagrangian, physical, StageTable::new(s, h), mass, driven, &state, &start.v))
        };
        let from = StepStart { q: [0.0; N], y: [0.0; N], z: 0.0 };
        Ok(GaussStepper {
            lagrangian,
            s,
            h,
            route: Box::new(route),
            mass,
            arch: Instructions::new(),
            t0,
            k: 0,
            from,
            solved: false,
            newton: true,
            solution: Solution::FixedPointIteration,
            pause: 0,
            pauses: PAUSE,
            by_newton: None,
            newton_steps: 0,
            of_sigma,
            sequence: (s <= FEW_STAGES).then(|| Sequence::new(StepStart { q: state.q.into(), ..from })),
            monitor: ResolutionMonitor::new(&state.q, &start.v, h),
        })
    }

    /// Records [`SuspectInterval`]s for any number of stages.
    pub(crate) fn with_suspects(mut self) -> Self {
        if self.sequence.is_none() {
            self.sequence = Some(Sequence::new(self.values()));
        }
        self
    }

    /// Without Newton's method: a step whose fixed-point iteration does not converge fails with
    /// [`StepError::NotConverged`].
    pub fn without_newton(mut self) -> Self {
        self.newton = false;
        self
    }

    /// How the steps are computed.
    pub fn route(&self) -> GaussRoute {
        match &*self.route {
            Route::Linear(..) => GaussRoute::Linear,
            Route::Condensed(_) => GaussRoute::Condensed,
            Route::General(General { mass: Mass::Constant(_), .. }) => GaussRoute::ConstantMass,
            Route::General(_) => GaussRoute::General,
        }
    }

    /// The number of steps that were solved by simplified Newton iteration or Newton's method, since the fixed-point
    /// iteration did not converge.
    pub fn newton_steps(&self) -> u64 {
        self.newton_steps
    }

    /// The dense output of the last step.
    fn curve(&self) -> Option<DenseStep<N>> {
        let (s, h) = (self.s, self.h);
        let t = self.t0 + self.k.checked_sub(1)? as f64 * h;
        let condensed = |table: &Condensed, stages: [&[[f64; MAX_STAGES]; N]; 2], wants_z| {
            let mass = self.mass.as_deref().copied().unwrap_or_else(SMatrix::identity);
            Solved::from_accelerations(self.lagrangian, table, &mass, (t, &self.from), stages, wants_z)
        };
        if !self.solved {
            return None;
        }
        let start = self.phase(&self.from);
        let solved = match &*self.route {
            Route::Linear(run, table) => {
                let a = run.accelerations(&self.from.q, &self.from.y);
                condensed(table, [&a, &table.positions(&self.from.q, &self.from.y, &a)], run.wants_z())
            }
            Route::Condensed(run) => condensed(&run.table, [&run.a.map(|a| a.0), &run.x.map(|x| x.0)], run.wants_z),
            Route::General(run) => run.solved(),
        };
        Some(solved.curve(s, t, h, start))
    }

    /// The state in the variables of the route: velocities in the condensed routes, momenta in the general one.
    #[inline(always)]
    fn values(&self) -> StepStart<N> {
        let (q, y, z) = match &*self.route {
            Route::Linear(run, _) => (&run.q, &run.v, run.z),
            Route::Condensed(run) => (&run.q, &run.v, run.z),
            Route::General(run) => (&run.q, &run.p, run.z),
        };
        StepStart { q: q.map(|q| q.value), y: y.map(|y| y.value), z: z.value }
    }

    /// The compensation terms of the state's compensated sums.
    pub(crate) fn rests(&self) -> StepStart<N> {
        let (q, y, z) = match &*self.route {
            Route::Linear(run, _) => (&run.q, &run.v, run.z),
            Route::Condensed(run) => (&run.q, &run.v, run.z),
            Route::General(run) => (&run.q, &run.p, run.z),
        };
        StepStart { q: q.map(|q| q.rest), y: y.map(|y| y.rest), z: z.rest }
    }

    /// Takes over the compensation terms of a stepper of the same problem that has reached this stepper's start.
    pub(crate) fn add_rests(&mut self, rests: &StepStart<N>) {
        let (q, y, z) = match &mut *self.route {
            Route::Linear(run, _) => (&mut run.q, &mut run.v, &mut run.z),
            Route::Condensed(run) => (&mut run.q, &mut run.v, &mut run.z),
            Route::General(run) => (&mut run.q, &mut run.p, &mut run.z),
        };
        for d in 0..N {
            (q[d].rest, y[d].rest) = (rests.q[d], rests.y[d]);
        }
        z.rest = rests.z;
    }

    /// The phase point of a state of the route; the velocities of the condensed routes are turned into momenta.
    fn phase(&self, x: &StepStart<N>) -> PhasePoint<N> {
        let y = SVector::from(x.y);
        PhasePoint { q: SVector::from(x.q), p: self.mass.as_ref().map_or(y, |mass| **mass * y), z: x.z }
    }

    /// Takes steps by fixed-point or simplified Newton iteration. Returns the number of steps taken, and the error if
    /// they are fewer than requested.
    fn sweep(&mut self, steps: usize) -> (usize, Option<StepError>) {
        let (taken, refused) = match self.arch.dispatch(AdvanceGauss { run: self, steps }) {
            Ok(()) => (steps, None),
            Err((taken, progress)) => (taken, Some(progress)),
        };
        if self.solution != Solution::FixedPointIteration {
            self.newton_steps += taken as u64;
            self.pause = self.pause.saturating_sub(taken);
        }
        self.solved = refused.is_none();
        (taken, refused.map(StepError::from))
    }
}

/// A number of steps, compiled for one instruction set; ends at the first step that fails.
struct AdvanceGauss<'b, 'a, L, const N: usize> {
    run: &'b mut GaussStepper<'a, L, N>,
    steps: usize,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for AdvanceGauss<'_, '_, L, N> {
    type Output = Result<(), (usize, IterationOutcome)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let AdvanceGauss { run, steps } = self;
        forget_branches();
        let (t0, h) = (run.t0, run.h);
        if let Route::Linear(linear, _) = &mut *run.route {
            let (taken, from) = linear.advance(steps);
            run.k += taken;
            run.from = from;
            return if taken == steps { Ok(()) } else { Err((taken, IterationOutcome::NonFinite)) };
        }
        for taken in 0..steps {
            // Dense output covers the last step.
            if taken + 1 == steps {
                run.from = run.values();
            }
            let t = t0 + run.k as f64 * h;
            let progress = match &mut *run.route {
                Route::Linear(..) => IterationOutcome::Done,
                Route::Condensed(condensed) => condensed.step::<S>(t),
                Route::General(general) => general.step::<S>(t),
            };
            if progress != IterationOutcome::Done {
                return Err((taken, progress));
            }
            let defect = match &*run.route {
                Route::Linear(..) => 0.0,
                Route::Condensed(condensed) => condensed.defect,
                Route::General(general) => general.defect,
            };
            if defect > 1.0 && !run.is_at_rest(t + h) {
                run.monitor.note(run.k, defect);
            }
            if run.sequence.is_some() {
                run.update_sequence();
            }
            run.k += 1;
        }
        Ok(())
    }
}

impl<L: Lagrangian<N>, const N: usize> Stepper<N> for GaussStepper<'_, L, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        let (mut done, mut tried) = (0, Tried::default());
        while done < steps {
            self.resume();
            let left = steps - done;
            let (taken, refused) = match self.solution {
                Solution::FixedPointIteration => self.sweep(left),
                Solution::Simplified => self.sweep(self.pause.min(left)),
                Solution::Newton => {
                    tried.newton = true;
                    self.solve_stages().map_or_else(|cause| (0, Some(cause)), |()| self.sweep(1))
                }
            };
            done += taken;
            if taken > 0 {
                tried = Tried::default();
            }
            let Some(refused) = refused else { continue };
            // These do not depend on how the stage equations are solved.
            let final_cause = matches!(
                refused,
                StepError::SigmaVanished { .. } | StepError::StageFactor { .. } | StepError::Branched
            );
            if !final_cause && self.try_again(&mut tried, refused).is_ok() {
                continue;
            }
            // The first error is reported: that of Newton's method is less informative, unless it is about the
            // integrating factor.
            let cause = if final_cause { refused } else { tried.refused.unwrap_or(refused) };
            return Err(StepFailure { taken: done, cause });
        }
        Ok(())
    }

    fn state(&self) -> PhasePoint<N> {
        self.phase(&self.values())
    }

    fn time(&self) -> f64 {
        self.t0 + self.k as f64 * self.h
    }

    fn sigma(&self) -> f64 {
        match &*self.route {
            _ if self.k == 0 => 1.0,
            Route::Linear(_, table) => 1.0 + table.grow.head,
            Route::Condensed(run) => 1.0 + run.table.grow.head,
            Route::General(run) => 1.0 / (1.0 - run.one_minus_rho),
        }
    }

    fn evaluations(&self) -> u64 {
        match &*self.route {
            Route::Linear(..) => 0,
            Route::Condensed(run) => run.evaluations,
            Route::General(run) => run.evaluations,
        }
    }

    fn has_constant_rate(&self) -> bool {
        !matches!(&*self.route, Route::General(_))
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        work_summary(self.route(), &self.lagrangian.structure())
    }

    /// The collocation polynomial of the last step; computed only when it is requested.
    fn dense(&self) -> Option<DenseStep<N>> {
        self.curve()
    }

    fn last_velocity(&self) -> Option<SVector<f64, N>> {
        match &*self.route {
            Route::General(run) if self.k > 0 => Some(run.last_velocity()),
            _ => None,
        }
    }

    fn guess(&mut self, longer: &DenseStep<N>) {
        let (s, h) = (self.s, self.h);
        if let Route::General(run) = &mut *self.route {
            let part = h / longer.length();
            // L is not finite where the collocation polynomial of the action has a pole.
            let stages = Coefficients::of(s).c.iter().take(s).map(|c| longer.stage(part * c.0));
            run.predict(stages.map(|(v, l, rho)| (v, if l.is_finite() { l } else { 0.0 }, rho)));
        }
    }

    fn save(&self) -> Option<Vec<u64>> {
        Some(self.words())
    }

    fn restore(&mut self, mut words: &[u64]) -> bool {
        self.read(&mut words).is_some() && words.is_empty()
    }

    /// The first unresolved step that was recorded in the run; if there is none, the result of a defect sample of the
    /// last step alone. Further steps are sampled only if this is called more often.
    fn unresolved(&self) -> Option<UnresolvedStep> {
        self.find_unresolved()
    }

    fn suspect_interval(&mut self) -> Option<SuspectInterval<N>> {
        self.monitor.suspect.take()
    }
}

#[cfg(test)]
mod tests;
