//! Stepper of contact Gauss collocation with equal steps in physical time.

mod resolution;
mod retries;
mod state_words;

use crate::gauss::checks::check_step;
use crate::gauss::dense::{SolvedStep, StepStart};
use crate::gauss::initial_mass::InitialMass;
use crate::gauss::limits::{FIRST_NEWTON_PAUSE, MAX_LINEAR_DIMENSION};
use crate::gauss::resolution::sequence::Sequence;
use crate::gauss::resolution::tail;
use crate::gauss::routes::general::General;
use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::linear::Linear;
use crate::gauss::routes::separable::SeparableStages;
use crate::gauss::routes::{RouteState, StageRoute};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::stages::parametrization::{Extension, Physical};
use crate::gauss::tables::coefficients::Coefficients;
use crate::gauss::tables::condensed::Condensed;
use crate::gauss::tables::stage_table::StageTable;
use crate::gauss::work_summary::GaussRoute;
use crate::gauss::work_summary::work_summary;
use crate::integration::SolvedStages;
use crate::numbers::compensated::values;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::forget_branches;
use crate::resolution::monitor::ResolutionMonitor;
use crate::resolution::thresholds::FEW_STAGES;
use crate::solve::mass_matrix::is_identity;
use crate::{
    DenseStep, InputError, PlanEntry, Problem, StepError, StepFailure, Stepper, StepperOptions, UnresolvedStep,
    integration::SuspectInterval,
    integration::{depends_on_action, is_separable},
};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Derivatives, Lagrangian, PhasePoint};
use pulp::{Simd, WithSimd};
use retries::Tried;

/// The route of a run.
#[allow(clippy::large_enum_variant)] // A run has one, in a box.
enum Route<'a, L, const N: usize> {
    /// Boxed, since its matrices are larger than the data of the other variants.
    Linear(Box<Linear<'a, L, N>>),
    Condensed(SeparableStages<'a, L, N>),
    General(General<'a, L, Physical, N>),
    /// For a Lagrangian that is given by a contact Hamiltonian.
    Hamiltonian(HamiltonianStages<'a, L, N>),
}

/// A route, the mass matrix of a condensed one, and the defect of its conformal factor.
type SelectedRoute<'a, L, const N: usize> = (Route<'a, L, N>, Option<Box<SMatrix<f64, N, N>>>, f64);

/// Evaluates an expression for the [`StageRoute`] of a run, compiled for each route that the Lagrangian can have: a
/// Lagrangian that is given by a contact Hamiltonian has one of its own, and all others have the other three.
macro_rules! with_route {
    ($route:expr, $run:ident => $value:expr) => {
        match $route {
            Route::Hamiltonian($run) if const { L::HINTS.hamiltonian } => $value,
            Route::Linear($run) if const { !L::HINTS.hamiltonian } => $value,
            Route::Condensed($run) if const { !L::HINTS.hamiltonian } => $value,
            Route::General($run) if const { !L::HINTS.hamiltonian } => $value,
            _ => unreachable!("the route is selected by the same constant"),
        }
    };
}
use with_route;

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
    newton_steps: u64,
    /// The defect of a constant conformal factor, see [`tail::of_sigma`].
    of_sigma: f64,
    /// The last mean velocities: present for few stages, where the defect between the nodes is no measure of
    /// resolution, and when suspect intervals are requested.
    sequence: Option<Box<Sequence<N>>>,
    monitor: ResolutionMonitor<N>,
}

impl<'a, L: Lagrangian<N>, const N: usize> GaussStepper<'a, L, N> {
    /// A stepper at the start of a problem with `stages` from 1 to 16 and the time step `h`, negative for a motion
    /// backward in time, by the least expensive route that the structure of the Lagrangian allows.
    ///
    /// # Errors
    /// [`InputError::Stages`], [`InputError::Step`]; [`InputError::FirstStep`] if the mass matrix at the start is
    /// singular; [`InputError::Sigma`] and [`InputError::FirstStep`] if the step is too long for a constant rate.
    pub fn new(
        problem: &Problem<'a, L, N>,
        stages: usize,
        h: f64,
        StepperOptions { action, check_resolution }: StepperOptions,
    ) -> Result<Self, InputError> {
        check_step(stages, h)?;
        let Problem { lagrangian, t0, state, .. } = *problem;
        let s = stages;
        let (route, mass, of_sigma) = if const { L::HINTS.hamiltonian } {
            let stages = HamiltonianStages::new(lagrangian, StageTable::new(s, h), &state, &problem.start.v);
            (Route::Hamiltonian(stages), None, 0.0)
        } else {
            Self::route_of_lagrangian(problem, s, h, action)?
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
            pauses: FIRST_NEWTON_PAUSE,
            newton_steps: 0,
            of_sigma,
            sequence: (s <= FEW_STAGES || check_resolution)
                .then(|| Sequence::new(StepStart { q: state.q.into(), ..from })),
            monitor: ResolutionMonitor::new(&state.q, &problem.start.v, h),
        })
    }

    /// The least expensive route that the structure of L allows, with the mass matrix of a condensed route and the defect
    /// of its conformal factor.
    fn route_of_lagrangian(
        problem: &Problem<'a, L, N>,
        s: usize,
        h: f64,
        wants_z: bool,
    ) -> Result<SelectedRoute<'a, L, N>, InputError> {
        let Problem { lagrangian, t0, start, state, structure, .. } = *problem;
        let InitialMass { w, inverse } = InitialMass::of(problem)?;
        let condensed = is_separable(lagrangian, &structure) && structure.has_constant_rate();
        let (mut mass, mut of_sigma) = (None, 0.0);
        let route = if condensed {
            let table = Condensed::of(s, h, lagrangian.gradient(t0, &start).z)?;
            let unit = is_identity(&w);
            mass = Some(w);
            of_sigma = tail::of_sigma(1.0 + table.grow.head, table.gamma * h);
            let linear = if structure.quadratic && structure.autonomous && const { N <= MAX_LINEAR_DIMENSION } {
                Linear::new(lagrangian, &table, &inverse, t0, &start, wants_z)
            } else {
                None
            };
            match linear {
                Some(linear) => Route::Linear(linear),
                None => {
                    let left = table.preconditioned(0.0).ok_or(InputError::Step { h })?;
                    let inverse = (!unit).then_some(inverse);
                    Route::Condensed(SeparableStages::new(lagrangian, table, left, inverse, &start, wants_z))
                }
            }
        } else {
            let mass = Mass::new(&structure, inverse);
            let (physical, z_drives) = (Extension::new(Physical, t0, 0.0), depends_on_action(lagrangian, &structure));
            Route::General(General::new(lagrangian, physical, StageTable::new(s, h), mass, z_drives, &state, &start.v))
        };
        Ok((route, mass, of_sigma))
    }

    /// Without Newton's method: a step whose fixed-point iteration does not converge fails with
    /// [`StepError::NotConverged`].
    pub fn without_newton(mut self) -> Self {
        self.newton = false;
        self
    }

    /// How the steps are computed.
    pub fn route(&self) -> GaussRoute {
        with_route!(&*self.route, run => run.route())
    }

    /// The number of steps that were solved by simplified Newton iteration or Newton's method, since the fixed-point
    /// iteration did not converge.
    pub fn newton_steps(&self) -> u64 {
        self.newton_steps
    }

    /// The last step, if its stages are known.
    fn last_step(&self) -> Option<SolvedStep<'_, N>> {
        let t = self.t0 + self.k.checked_sub(1)? as f64 * self.h;
        self.solved.then_some(SolvedStep { mass: self.mass.as_deref(), t, from: &self.from })
    }

    /// The state in the variables of the route: velocities in the condensed routes, momenta in the general one.
    #[inline(always)]
    fn values(&self) -> StepStart<N> {
        let RouteState { q, y, z } = with_route!(&*self.route, run => run.state());
        StepStart { q: values(q), y: values(y), z: z.value }
    }

    /// The compensation terms of the state's compensated sums.
    pub(crate) fn compensation(&self) -> StepStart<N> {
        let RouteState { q, y, z } = with_route!(&*self.route, run => run.state());
        StepStart { q: q.map(|q| q.rest), y: y.map(|y| y.rest), z: z.rest }
    }

    /// Takes over the compensation terms of a stepper of the same problem that has reached this stepper's start.
    pub(crate) fn set_compensation(&mut self, terms: &StepStart<N>) {
        with_route!(&mut *self.route, run => run.set_compensation(terms));
    }

    /// The phase point of a state of the route; the velocities of the condensed routes are turned into momenta.
    fn phase(&self, x: &StepStart<N>) -> PhasePoint<N> {
        let y = SVector::from(x.y);
        PhasePoint { q: SVector::from(x.q), p: self.mass.as_ref().map_or(y, |mass| **mass * y), z: x.z }
    }

    /// Takes steps by fixed-point or simplified Newton iteration. Returns the number of steps taken, and the error if
    /// they are fewer than requested.
    fn take_steps(&mut self, steps: usize) -> (usize, Option<StepError>) {
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
        if let Some((taken, from)) = with_route!(&mut *run.route, route => route.take_steps(steps)) {
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
            let progress = with_route!(&mut *run.route, route => route.step::<S>(t));
            if progress != IterationOutcome::Done {
                return Err((taken, progress));
            }
            let defect = with_route!(&*run.route, route => route.defect());
            if defect > 1.0 && !run.is_at_rest(t + h) {
                run.monitor.steps.note(run.k, defect);
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
                Solution::FixedPointIteration => self.take_steps(left),
                Solution::Simplified => self.take_steps(self.pause.min(left)),
                Solution::Newton => {
                    tried.newton = true;
                    self.solve_stages().map_or_else(|cause| (0, Some(cause)), |()| self.take_steps(1))
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
        if self.k == 0 { 1.0 } else { with_route!(&*self.route, run => run.sigma()) }
    }

    fn evaluations(&self) -> u64 {
        with_route!(&*self.route, run => run.evaluations())
    }

    fn has_constant_rate(&self) -> bool {
        matches!(self.route(), GaussRoute::Linear | GaussRoute::Condensed)
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        work_summary(self.route(), depends_on_action(self.lagrangian, &self.lagrangian.structure()))
    }

    /// The collocation polynomial of the last step; computed only when it is requested.
    fn dense(&self) -> Option<DenseStep<N>> {
        let step = self.last_step()?;
        let solved = with_route!(&*self.route, run => StageRoute::solved(run, &step));
        Some(solved.curve(self.s, step.t, self.h, self.phase(step.from)))
    }

    fn solved_stages(&self) -> Option<SolvedStages<N>> {
        let step = self.last_step()?;
        let without_action = with_route!(&*self.route, run => StageRoute::solved_without_action(run, &step));
        let knows_l = without_action.is_none();
        let solved = without_action.unwrap_or_else(|| with_route!(&*self.route, run => StageRoute::solved(run, &step)));
        let stages = solved.stages(self.s, (step.t, self.h), self.phase(step.from));
        Some(SolvedStages { knows_l, ..stages })
    }

    fn last_velocity(&self) -> Option<SVector<f64, N>> {
        if self.k == 0 { None } else { with_route!(&*self.route, run => StageRoute::last_velocity(run)) }
    }

    fn guess(&mut self, longer: &DenseStep<N>) {
        let part = self.h / longer.length();
        // L is not finite where the collocation polynomial of the action has a pole.
        let stages = Coefficients::of(self.s).c.iter().take(self.s).map(|c| longer.stage(part * c.0));
        let stages = stages.map(|(v, l, rho)| (v, if l.is_finite() { l } else { 0.0 }, rho));
        with_route!(&mut *self.route, run => run.predict_stages(stages));
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
