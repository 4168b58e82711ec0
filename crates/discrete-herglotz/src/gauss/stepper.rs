//! Stepper of contact Gauss collocation with equal steps in physical time.

use crate::gauss::checks::check_step;
use crate::gauss::choice::{Start, route_of};
use crate::gauss::dense::{Solved, StepStart, curve_through};
use crate::gauss::resolution::defect_sample::DefectSample;
use crate::gauss::routes::RouteState;
use crate::gauss::steps::{GaussSteps, Setup};
use crate::gauss::system::{Typed, vector_of};
use crate::gauss::tables::coefficients::Coefficients;
use crate::gauss::work_summary::{GaussRoute, work_summary};
use crate::integration::{SolvedStages, SuspectInterval, depends_on_action, is_separable};
use crate::numbers::array::from_fn;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::{restored_from, words_of};
use crate::{DenseStep, InputError, PlanEntry, Problem, StepFailure, Stepper, StepperOptions, UnresolvedStep};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint};

/// A stepper of contact Gauss collocation.
///
/// The stages are evaluated in SIMD lanes. Their initial guess is extrapolated from the step before, the fixed-point
/// iteration runs to round-off, and the state is advanced by compensated sums. If the fixed-point iteration does not
/// converge, simplified Newton iteration is used, with a Jacobian that is kept as long as the iteration converges fast;
/// if that does not converge either, Newton's method is used, in the stage positions alone if the mass matrix and the
/// rate are constant. The step fails if none of them converges.
pub struct GaussStepper<'a, L, const N: usize> {
    system: Typed<'a, L, N>,
    steps: GaussSteps,
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
        options: StepperOptions,
    ) -> Result<Self, InputError> {
        check_step(stages, h)?;
        let Problem { lagrangian, t0, state, start, structure, .. } = *problem;
        let system = Typed(lagrangian);
        let start = Start {
            t: t0,
            q: start.q.as_slice(),
            v: start.v.as_slice(),
            p: state.p.as_slice(),
            z: start.z,
            structure,
            is_hamiltonian: L::HINTS.hamiltonian,
            is_separable: is_separable(lagrangian, &structure),
            depends_on_action: depends_on_action(lagrangian, &structure),
        };
        let (route, mass, of_sigma) = route_of(&system, &start, stages, h, options.action)?;
        let (q, v, check_resolution) = (start.q, start.v, options.check_resolution);
        let steps = GaussSteps::new(Setup { s: stages, h, t0, route, mass, of_sigma, q, v, check_resolution });
        Ok(GaussStepper { system, steps })
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
        self.steps.sample_defect(&self.system, sets)
    }

    /// The compensation terms of the state's compensated sums.
    pub(crate) fn compensation(&self) -> StepStart<N> {
        let RouteState { q, y, z } = self.steps.route.state();
        StepStart { q: from_fn(|d| q[d].rest), y: from_fn(|d| y[d].rest), z: z.rest }
    }

    /// Takes over the compensation terms of a stepper of the same problem that has reached this stepper's start.
    pub(crate) fn set_compensation(&mut self, terms: &StepStart<N>) {
        let state = self.steps.route.state_mut();
        state.q.iter_mut().zip(&terms.q).for_each(|(q, rest)| q.rest = *rest);
        state.y.iter_mut().zip(&terms.y).for_each(|(y, rest)| y.rest = *rest);
        state.z.rest = terms.z;
    }

    /// The stages of the last step, with the values of L if they are requested or known.
    fn solved(&self, wants_l: bool) -> Option<SolvedStages<N>> {
        let (mut v, mut force) = ([Stages::ZERO; N], [Stages::ZERO; N]);
        let (mut rate, mut l) = (Stages::ZERO, Stages::ZERO);
        let to = Solved { v: &mut v, force: &mut force, rate: &mut rate, l: &mut l };
        let (knows_l, t, from) = self.steps.solved(&self.system, wants_l, to)?;
        let (s, h, start) = (self.steps.s, self.steps.h, self.phase(&from.q, &from.y, from.z));
        Some(SolvedStages { s, t, h, start, v, force, rate, l, knows_l })
    }

    /// The phase point of a state in the variables of the route.
    fn phase(&self, q: &[f64], y: &[f64], z: f64) -> PhasePoint<N> {
        let mut p: SVector<f64, N> = SVector::zeros();
        GaussSteps::momenta(self.steps.mass.as_ref(), y, p.as_mut_slice());
        PhasePoint { q: vector_of(q), p, z }
    }
}

impl<L: Lagrangian<N>, const N: usize> Stepper<N> for GaussStepper<'_, L, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        self.steps.advance(&self.system, steps)
    }

    fn state(&self) -> PhasePoint<N> {
        let RouteState { q, y, z } = self.steps.route.state();
        let [q, y]: [[f64; N]; 2] = [from_fn(|d| q[d].value), from_fn(|d| y[d].value)];
        self.phase(&q, &y, z.value)
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

    fn has_constant_rate(&self) -> bool {
        matches!(self.route(), GaussRoute::Linear | GaussRoute::Condensed)
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        let lagrangian = self.system.0;
        work_summary(self.route(), depends_on_action(lagrangian, &lagrangian.structure()))
    }

    /// The collocation polynomial of the last step; computed only when it is requested.
    fn dense(&self) -> Option<DenseStep<N>> {
        Some(curve_through(&self.solved(true)?))
    }

    fn solved_stages(&self) -> Option<SolvedStages<N>> {
        self.solved(false)
    }

    fn last_velocity(&self) -> Option<SVector<f64, N>> {
        if self.steps.k == 0 { None } else { self.steps.route.last_velocity().map(vector_of) }
    }

    fn guess(&mut self, longer: &DenseStep<N>) {
        let part = self.steps.h / longer.length();
        let nodes = &Coefficients::of(self.steps.s).c;
        self.steps.route.predict_stages(&mut |i, velocity| {
            let (v, l, rho) = longer.stage(part * nodes[i].0);
            velocity.copy_from_slice(v.as_slice());
            // L is not finite where the collocation polynomial of the action has a pole.
            (if l.is_finite() { l } else { 0.0 }, rho)
        });
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
        self.steps.find_unresolved(&self.system)
    }

    fn suspect_interval(&mut self) -> Option<SuspectInterval<N>> {
        let suspect = &mut self.steps.suspect;
        if !std::mem::take(&mut suspect.is_new) {
            return None;
        }
        let [from, to] =
            [&suspect.from, &suspect.to].map(|of| PhasePoint { q: vector_of(&of.q), p: vector_of(&of.y), z: of.z });
        Some(SuspectInterval { step: suspect.step, steps: 2, t: suspect.t, from, to })
    }
}

#[cfg(test)]
mod tests;
