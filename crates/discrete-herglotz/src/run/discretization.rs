//! A problem with the integrator and the steps of a run.

use crate::error::step_error;
use crate::integration::motion::{Motion, NearbyVelocity};
use crate::integration::{AtState, at_state};
use crate::integration::{SharedIntegrator, StepEnds, SystemProblem, WholeStep};
use crate::numbers::state_words::digest;
use crate::resolution::thresholds::FEW_STAGES;
use crate::run::observers::output_request::OutputRequest;
use crate::run::request::{Request, StepSelection};
use crate::switching::Collocation;
use crate::switching::has_switching_functions;
use crate::switching::stepper::of_integrator::of_integrator;
use crate::{DenseStep, InputError, MethodInfo, Problem, StepError, Stepper, StepperOptions, theory::legendre_inverse};
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, Structure, VelocityPoint};

/// The largest number of unknowns of a step for which the matrix of a linear motion is always computed. A collocation
/// step is then multiplication by this matrix, which is computed in double-double precision.
const MAX_UNKNOWNS_OF_SMALL_MATRIX: usize = 32;

/// For more unknowns, the ratio of the cube of their number to the smallest number of steps for which the matrix is
/// computed: it costs as much as so many steps.
const CUBED_UNKNOWNS_PER_STEP: usize = 1024;

/// A problem with the integrator and the steps that are selected for it.
pub(crate) struct Discretization<'p, const N: usize> {
    pub problem: SystemProblem<'p, N>,
    pub t_end: f64,
    /// The step size; negative if the run goes backward in time.
    pub h: f64,
    pub count: usize,
    /// The error found by the trial runs, if an accuracy was requested.
    pub error: Option<f64>,
    pub integrator: SharedIntegrator<'p, N>,
    pub info: MethodInfo,
    pub needs: OutputRequest,
    /// The scales of the coordinates for errors, if they are given.
    pub scales: Option<SVector<f64, N>>,
    /// Whether the Lagrangian states switching functions.
    pub switches: bool,
    /// The collocation steppers of a Lagrangian with switching functions, for parts of steps.
    parts: Option<Collocation<'p, N>>,
}

impl<'p, const N: usize> Discretization<'p, N> {
    /// The problem of a request with the selected steps.
    pub fn new(request: &Request<'p, N>, selection: &StepSelection<'p, N>) -> Result<Self, InputError> {
        let Request { problem, t_end, needs, scales, parts, .. } = *request;
        let StepSelection { integrator, count, h, error, .. } = selection.clone();
        let switches = has_switching_functions(problem.lagrangian, problem.t0, &problem.start)?;
        let info = integrator.info();
        if switches && info.in_transformed_time {
            let hypothesis = "a Lagrangian without kinks and jumps, since the steps are equal in transformed time";
            return Err(InputError::Hypothesis { hypothesis });
        }
        if switches && info.constrained {
            let hypothesis = "a Lagrangian without kinks and jumps, since steps under constraints do not end on them";
            return Err(InputError::Hypothesis { hypothesis });
        }
        Ok(Discretization { problem, t_end, h, count, error, integrator, info, needs, scales, switches, parts })
    }

    /// The problem with the structure that the steps use: for few steps a linear motion is solved like a nonlinear one,
    /// since the matrix of a step would cost more than the iterations.
    pub fn problem_for_steps(&self) -> SystemProblem<'p, N> {
        let unknowns = self.info.collocation.unwrap_or(0) * N;
        let by_matrix =
            unknowns <= MAX_UNKNOWNS_OF_SMALL_MATRIX || unknowns.pow(3) / CUBED_UNKNOWNS_PER_STEP <= self.count;
        let structure = self.problem.structure;
        Problem { structure: Structure { quadratic: structure.quadratic && by_matrix, ..structure }, ..self.problem }
    }

    /// A stepper at the start of the run.
    pub fn stepper(&self, check_resolution: bool) -> Result<Box<dyn Stepper<N> + 'p>, InputError> {
        self.stepper_of(&self.problem_for_steps(), self.h, check_resolution)
    }

    /// A stepper at the start of a problem, with step size h. If the Lagrangian has switching functions, steps end on
    /// its kinks and jumps.
    pub fn stepper_of(
        &self,
        problem: &SystemProblem<'p, N>,
        h: f64,
        check_resolution: bool,
    ) -> Result<Box<dyn Stepper<N> + 'p>, InputError> {
        let options = StepperOptions { action: self.needs.action, check_resolution };
        if let Some(collocation) = self.parts.filter(|_| self.switches && !self.info.divides) {
            return of_integrator(self.integrator.clone(), collocation, problem, h, options);
        }
        self.integrator.stepper(problem, h, options)
    }

    /// A stepper that starts at a state with its velocity and has taken steps of size h: a given number of them, or
    /// until the time `t_end`. In transformed time the step size is the run's, and the last step ends at `t_end`.
    ///
    /// For these few steps the matrix of a linear motion is computed only if the stage equations cannot be solved
    /// without it, as with an ill-conditioned mass matrix.
    pub fn advanced(
        &self,
        (t, from): (f64, &PhasePoint<N>),
        v: &SVector<f64, N>,
        h: f64,
        (steps, t_end): (usize, f64),
        guess: impl Fn(&mut dyn Stepper<N>),
    ) -> Result<Box<dyn Stepper<N> + 'p>, StepError> {
        let Structure { quadratic: linear, separable, .. } = self.problem.structure;
        let by = |quadratic: bool| {
            let start = VelocityPoint { q: from.q, v: *v, z: from.z };
            // The double-double tables of the separable route depend on the step size: they are not computed for a few
            // steps.
            let separable = separable && (quadratic || self.info.collocation.is_none());
            let structure = Structure { quadratic, separable, ..self.problem.structure };
            let problem = Problem { t0: t, start, state: *from, structure, ..self.problem };
            let h = if self.info.in_transformed_time { self.h } else { h };
            let mut stepper = self.stepper_of(&problem, h, false).map_err(step_error)?;
            guess(&mut *stepper);
            stepper.advance_until(steps, t_end).map_err(|failure| failure.cause)?;
            Ok(stepper)
        };
        by(false).or_else(|cause| if linear { by(true) } else { Err(cause) })
    }

    /// A stepper after one step from a time and a state to another time. The iteration starts from the curve of a
    /// longer step, if one is given.
    pub fn step_to(
        &self,
        (t0, from): &(f64, PhasePoint<N>),
        t: f64,
        near: NearbyVelocity<N>,
        curve: Option<&DenseStep<N>>,
    ) -> Result<Box<dyn Stepper<N> + 'p>, StepError> {
        let v = self.velocity(*t0, from, near)?;
        let guess = |run: &mut dyn Stepper<N>| {
            if let Some(curve) = curve {
                run.guess(curve);
            }
        };
        self.advanced((*t0, from), &v, t - t0, (1, t), guess)
    }

    /// A guess of the velocity. For a constant mass the velocity is unique.
    fn guess(&self, near: NearbyVelocity<N>) -> SVector<f64, N> {
        near.filter(|_| !self.problem.structure.constant_mass).unwrap_or(self.problem.start.v)
    }

    /// The number of stages of a Gauss method, otherwise 1.
    pub fn stages(&self) -> usize {
        self.info.collocation.unwrap_or(1)
    }

    /// The step from the start of a step to a time within it, with the state there and its velocity.
    pub fn shortened(
        &self,
        step: &WholeStep<N>,
        t: f64,
    ) -> Result<(WholeStep<N>, PhasePoint<N>, SVector<f64, N>), StepError> {
        let (t0, start) = step.start();
        let stepper = self.step_to(&(t0, *start), t, Some(step.velocity()), None)?;
        let end = stepper.state();
        let v = self.velocity(t, &end, stepper.last_velocity())?;
        let short = match step {
            WholeStep::Collocation(_) => WholeStep::Collocation(stepper.solved_stages().ok_or(StepError::NonFinite)?),
            WholeStep::Flow(_) => WholeStep::Flow(StepEnds { t: t0, h: t - t0, start: *start, end }),
        };
        Ok((short, end, v))
    }

    /// Whether the steps of a Gauss method have enough stages for defect samples between the nodes.
    pub fn many_stages(&self) -> bool {
        self.info.collocation.is_some_and(|stages| stages > FEW_STAGES)
    }

    /// The largest number of steps of the run.
    pub fn most(&self) -> usize {
        if self.info.in_transformed_time { usize::MAX } else { self.count }
    }

    /// Whether the run has reached its end after this number of steps, at this time.
    pub fn is_over(&self, taken: usize, t: f64) -> bool {
        let passed = if self.h < 0.0 { t <= self.t_end } else { t >= self.t_end };
        taken == self.most() || self.info.in_transformed_time && passed
    }
}

impl<const N: usize> Motion<N> for Discretization<'_, N> {
    fn velocity(&self, t: f64, state: &PhasePoint<N>, near: NearbyVelocity<N>) -> Result<SVector<f64, N>, StepError> {
        legendre_inverse(self.problem.lagrangian, t, state, &self.guess(near)).map(|x| x.v)
    }

    fn energy(&self, t: f64, state: &PhasePoint<N>, near: NearbyVelocity<N>) -> Result<f64, StepError> {
        let AtState { x, l, .. } = at_state(self.problem.lagrangian, t, state, &self.guess(near))?;
        let energy = x.v.dot(&state.p) - l;
        if energy.is_finite() { Ok(energy) } else { Err(StepError::NonFinite) }
    }

    fn rates(&self, t: f64, state: &PhasePoint<N>, near: NearbyVelocity<N>) -> Result<PhasePoint<N>, StepError> {
        let AtState { x, l, mut force, rate } = at_state(self.problem.lagrangian, t, state, &self.guess(near))?;
        if self.info.constrained {
            force += self.integrator.constraint_force(self.problem.lagrangian, t, &x)?;
        }
        Ok(PhasePoint { q: x.v, p: force + state.p * rate, z: l })
    }

    /// A digest of the start, of L there, of the steps, and of the requests.
    fn fingerprint(&self) -> u64 {
        let Problem { lagrangian, t0, start, state, .. } = &self.problem;
        let none = ([f64::NAN; 2], SVector::zeros());
        let ([value, rate], force) =
            at_state(*lagrangian, *t0, state, &start.v).map_or(none, |at| ([at.l, at.rate], at.force));
        let of_constraints = self.integrator.constraint_force(*lagrangian, *t0, start).unwrap_or(none.1);
        let force = force + of_constraints;
        let numbers = [*t0, self.t_end, self.h, start.z, value, rate];
        let vectors = [&start.q, &start.v, &state.p, &force];
        let numbers = numbers.iter().chain(vectors.into_iter().flat_map(|x| x.iter())).map(|x| x.to_bits());
        let name = self.info.name.bytes().map(u64::from);
        let OutputRequest { action, conformal_factor, .. } = self.needs;
        let counts = [N as u64, self.count as u64, action.into(), conformal_factor.into()];
        digest(&numbers.chain(name).chain(counts).collect::<Vec<u64>>())
    }

    fn state_within_step(
        &self,
        from: &(f64, PhasePoint<N>),
        t: f64,
        near: NearbyVelocity<N>,
        curve: Option<&DenseStep<N>>,
    ) -> Result<(PhasePoint<N>, f64), StepError> {
        let run = self.step_to(from, t, near, curve)?;
        Ok((run.state(), run.sigma()))
    }
}
