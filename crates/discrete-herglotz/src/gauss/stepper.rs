//! Stepper of contact Gauss collocation with equal steps in physical time.

use crate::gauss::checks::check_step;
use crate::gauss::choice::{Start, route_of};
use crate::gauss::dense::{Solved, StepStart, curve_through};
use crate::gauss::resolution::defect_sample::DefectSample;
use crate::gauss::routes::RouteState;
use crate::gauss::steps::{GaussSteps, Setup};
use crate::gauss::system::{ByPoints, CollocationSystem, KernelsOf, Typed};
use crate::gauss::tables::coefficients::Coefficients;
use crate::gauss::work_summary::{GaussRoute, work_summary};
use crate::integration::OfTyped;
use crate::integration::{SolvedStages, StageVectors, SuspectInterval, SystemProblem, depends_on_action, is_separable};
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::{restored_from, words_of};
use crate::{
    DenseStep, InputError, PlanEntry, Problem, RunSupport, State, StepDetails, StepFailure, Stepper, StepperOptions,
    UnresolvedStep, Vector,
};
use contact_geom::Lagrangian;
use std::rc::Rc;

/// A stepper of contact Gauss collocation.
///
/// The stages are evaluated in SIMD lanes. Their initial guess is extrapolated from the step before, the fixed-point
/// iteration runs to round-off, or to the requested [tolerance](StepperOptions::tolerance), and the state is advanced by
/// compensated sums. If the fixed-point iteration does not converge, simplified Newton iteration is used, with a Jacobian
/// that is kept as long as the iteration converges fast; if that does not converge either, Newton's method is used, in the
/// stage positions alone if the mass matrix and the rate are constant. The step fails if none of them converges.
pub struct GaussStepper<'a> {
    system: Box<dyn CollocationSystem + 'a>,
    depends_on_action: bool,
    /// Whether its iterations end at round-off.
    to_round_off: bool,
    steps: GaussSteps,
}

impl<'a> GaussStepper<'a> {
    /// A stepper at the start of a problem with `stages` from 1 to 16 and the time step `h`, negative for a motion
    /// backward in time, by the least expensive route that the structure of the Lagrangian allows.
    ///
    /// # Errors
    /// [`InputError::Stages`], [`InputError::Step`]; [`InputError::FirstStep`] if the mass matrix at the start is
    /// singular; [`InputError::Sigma`] and [`InputError::FirstStep`] if the step is too long for a constant rate.
    pub fn new<L: Lagrangian<N>, const N: usize>(
        problem: &Problem<'a, L, N>,
        stages: usize,
        h: f64,
        options: StepperOptions,
    ) -> Result<Self, InputError> {
        let stages = options.stages.unwrap_or(stages);
        check_step(stages, h)?;
        let Problem { lagrangian, t0, state, start, structure, .. } = *problem;
        let start = Start {
            t: t0,
            q: start.q.as_slice(),
            v: start.v.as_slice(),
            p: state.p.as_slice(),
            z: start.z,
            structure,
            is_hamiltonian: L::HINTS.hamiltonian,
            by_points: false,
            is_separable: is_separable(&OfTyped(lagrangian), &structure),
            depends_on_action: depends_on_action(&OfTyped(lagrangian), &structure),
        };
        let system: Box<dyn CollocationSystem + 'a> = if const { L::HINTS.over_slices } {
            let (system, kernels) = (Rc::new(OfTyped(lagrangian)), lagrangian.over_slices(KernelsOf));
            Box::new(ByPoints { system, kernels })
        } else {
            Box::new(Typed(lagrangian))
        };
        Self::of(system, &start, stages, h, options)
    }

    /// A stepper at the start of a problem whose system is evaluated at one point at a time.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub(crate) fn by_points(
        problem: &SystemProblem<'a>,
        stages: usize,
        h: f64,
        options: StepperOptions,
    ) -> Result<Self, InputError> {
        let stages = options.stages.unwrap_or(stages);
        check_step(stages, h)?;
        let SystemProblem { system, t0, start, state, structure, .. } = problem;
        let points = ByPoints::new(system.clone());
        let in_registers = points.kernels.is_some();
        let start = Start {
            t: *t0,
            q: &start.q,
            v: &start.v,
            p: &state.p,
            z: start.z,
            structure: *structure,
            is_hamiltonian: false,
            by_points: !in_registers,
            is_separable: in_registers && is_separable(&**system, structure),
            depends_on_action: depends_on_action(&**system, structure),
        };
        Self::of(Box::new(points), &start, stages, h, options)
    }

    /// A stepper of a system from its start, with a valid number of stages and a valid step.
    fn of(
        system: Box<dyn CollocationSystem + 'a>,
        start: &Start<'_>,
        stages: usize,
        h: f64,
        options: StepperOptions,
    ) -> Result<Self, InputError> {
        let (mut route, mass, of_sigma) = route_of(&*system, start, stages, h, options.action)?;
        route.set_tolerance(options.tolerance);
        let (t0, q, v, check_resolution) = (start.t, start.q, start.v, options.check_resolution);
        let steps = GaussSteps::new(Setup { s: stages, h, t0, route, mass, of_sigma, q, v, check_resolution });
        let to_round_off = options.tolerance == 0.0;
        Ok(GaussStepper { system, depends_on_action: start.depends_on_action, to_round_off, steps })
    }

    /// Without Newton's method: a step whose fixed-point iteration does not converge fails with
    /// [`StepError::NotConverged`](crate::StepError::NotConverged).
    pub fn without_newton(mut self) -> Self {
        self.steps.newton = false;
        self
    }

    /// How the steps are computed.
    pub fn route(&self) -> GaussRoute {
        self.steps.route.route()
    }

    /// The number of steps that were solved by simplified Newton iteration or Newton's method, since the fixed-point
    /// iteration did not converge.
    pub fn newton_steps(&self) -> u64 {
        self.steps.newton_steps
    }

    /// The largest defect of the last step over a number of sets of sample points between its nodes. `None` if there is
    /// no solved step.
    pub(crate) fn sample_defect(&self, sets: usize) -> Option<DefectSample> {
        self.steps.sample_defect(&*self.system, sets)
    }

    /// The compensation terms of the state's compensated sums.
    pub(crate) fn compensation(&self) -> StepStart {
        let RouteState { q, y, z } = self.steps.route.state();
        let rests = |of: &[CompensatedSum]| of.iter().map(|x| x.rest).collect();
        StepStart { q: rests(q), y: rests(y), z: z.rest }
    }

    /// Takes over the compensation terms of a stepper of the same problem that has reached this stepper's start.
    pub(crate) fn set_compensation(&mut self, terms: &StepStart) {
        let state = self.steps.route.state_mut();
        state.q.iter_mut().zip(&terms.q).for_each(|(q, rest)| q.rest = *rest);
        state.y.iter_mut().zip(&terms.y).for_each(|(y, rest)| y.rest = *rest);
        state.z.rest = terms.z;
    }

    /// The stages of the last step, with the values of L if they are requested or known.
    fn solved(&self, wants_l: bool) -> Option<SolvedStages> {
        let zeros = || StageVectors::from_elem(Stages::ZERO, self.system.dimension());
        // Written in place: stages are long to move.
        let mut solved = SolvedStages {
            s: self.steps.s,
            t: 0.0,
            h: self.steps.h,
            start: State::default(),
            v: zeros(),
            force: zeros(),
            rate: Stages::ZERO,
            l: Stages::ZERO,
            knows_l: false,
        };
        let SolvedStages { v, force, rate, l, .. } = &mut solved;
        let (knows_l, t, from) = self.steps.solved(&*self.system, wants_l, Solved { v, force, rate, l })?;
        (solved.knows_l, solved.t, solved.start) = (knows_l, t, self.phase(&from.q, &from.y, from.z));
        Some(solved)
    }

    /// The phase point of a state in the variables of the route.
    fn phase(&self, q: &[f64], y: &[f64], z: f64) -> State {
        let mut p = Vector::zeros(y.len());
        GaussSteps::momenta(self.steps.mass.as_ref(), y, &mut p);
        State { q: q.into(), p, z }
    }
}

impl Stepper for GaussStepper<'_> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        self.steps.advance(&*self.system, steps)
    }

    fn state(&self) -> State {
        let RouteState { q, y, z } = self.steps.route.state();
        let values = |of: &[CompensatedSum]| of.iter().map(|x| x.value).collect::<Vector>();
        self.phase(&values(q), &values(y), z.value)
    }

    fn time(&self) -> f64 {
        self.steps.time()
    }

    fn sigma(&self) -> f64 {
        self.steps.sigma()
    }

    fn evaluations(&self) -> u64 {
        self.steps.route.evaluations()
    }

    fn last_step(&self) -> Option<&dyn StepDetails> {
        Some(self)
    }

    fn run_support(&self) -> Option<&dyn RunSupport> {
        Some(self)
    }

    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        Some(self)
    }
}

impl StepDetails for GaussStepper<'_> {
    /// The collocation polynomial of the last step; computed only when it is requested.
    fn dense(&self) -> Option<DenseStep> {
        Some(curve_through(self.solved(true)?))
    }

    fn solved_stages(&self) -> Option<SolvedStages> {
        self.solved(false)
    }

    fn last_velocity(&self) -> Option<Vector> {
        if self.steps.k == 0 { None } else { self.steps.route.last_velocity().map(Vector::from) }
    }
}

impl RunSupport for GaussStepper<'_> {
    fn has_constant_rate(&self) -> bool {
        matches!(self.route(), GaussRoute::Linear | GaussRoute::Condensed)
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        work_summary(self.route(), self.depends_on_action, self.to_round_off)
    }

    fn guess(&mut self, longer: &DenseStep) {
        let part = self.steps.h / longer.length();
        let nodes = &Coefficients::of(self.steps.s).c;
        self.steps.route.predict_stages(&mut |i, velocity| {
            let (v, l, rho) = longer.stage(part * nodes[i].0);
            velocity.copy_from_slice(&v);
            // L is not finite where the collocation polynomial of the action has a pole.
            (if l.is_finite() { l } else { 0.0 }, rho)
        });
    }

    fn restart(&mut self, t: f64, state: &State, v: &Vector) -> bool {
        self.steps.restart(t, state, v)
    }

    fn save(&self) -> Option<Vec<u64>> {
        Some(words_of(&self.steps))
    }

    fn restore(&mut self, words: &[u64]) -> bool {
        restored_from(&mut self.steps, words)
    }

    /// The first unresolved step that was recorded in the run; if there is none, the result of a defect sample of the
    /// last step alone. Further steps are sampled only if this is called more often.
    fn unresolved(&self) -> Option<UnresolvedStep> {
        self.steps.find_unresolved(&*self.system)
    }

    fn suspect_interval(&mut self) -> Option<SuspectInterval> {
        let suspect = &mut self.steps.suspect;
        if !std::mem::take(&mut suspect.is_new) {
            return None;
        }
        let [from, to] = [&suspect.from, &suspect.to].map(|of| State { q: of.q.clone(), p: of.y.clone(), z: of.z });
        Some(SuspectInterval { step: suspect.step, steps: 2, t: suspect.t, from, to })
    }
}

#[cfg(test)]
mod tests;
