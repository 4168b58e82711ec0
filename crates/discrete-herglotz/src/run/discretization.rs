//! A problem with the integrator and the steps of a run.

use crate::error::step_error;
use crate::integration::motion::{Motion, NearbyVelocity};
use crate::integration::{Piece, SharedIntegrator, StepEnds, SystemProblem, WholeStep};
use crate::numbers::state_words::digest;
use crate::resolution::thresholds::FEW_STAGES;
use crate::run::observers::output_request::OutputRequest;
use crate::run::request::{Request, StepSelection};
use crate::run::resolved_step::ResolvedStep;
use crate::switching::Collocation;
use crate::switching::has_switching_functions;
use crate::switching::stepper::of_integrator::of_integrator;
use crate::system::{AtState, mass_matrix};
use crate::{DenseStep, InputError, MethodInfo, Point, State, StepError, Stepper, StepperOptions, Vector};
use contact_geom::Structure;
use contact_geom::nalgebra::DMatrix;
use std::cell::{OnceCell, RefCell};

/// The largest number of unknowns of a step for which the matrix of a linear motion is always computed. A collocation
/// step is then multiplication by this matrix, which is computed in double-double precision.
const MAX_UNKNOWNS_OF_SMALL_MATRIX: usize = 32;

/// For more unknowns, the ratio of the cube of their number to the smallest number of steps for which the matrix is
/// computed: it costs as much as so many steps.
const CUBED_UNKNOWNS_PER_STEP: usize = 1024;

/// Makes a stepper for a problem and a step size.
type MakeStepper<'f, 'p> = dyn Fn(&SystemProblem<'p>, f64) -> Result<Box<dyn Stepper + 'p>, InputError> + 'f;

/// A problem with the integrator and the steps that are selected for it.
pub(crate) struct Discretization<'p> {
    pub problem: SystemProblem<'p>,
    pub t_end: f64,
    /// The step size; negative if the run goes backward in time.
    pub h: f64,
    pub count: usize,
    /// The error found by the trial runs, if an accuracy was requested.
    pub error: Option<f64>,
    /// The relative error of the stages at which the iterations of collocation steps end; 0 for round-off.
    tolerance: f64,
    pub integrator: SharedIntegrator<'p>,
    pub info: MethodInfo,
    pub needs: OutputRequest,
    /// The scales of the coordinates for errors, if they are given.
    pub scales: Option<Vector>,
    /// Whether the Lagrangian states switching functions.
    pub switches: bool,
    /// The collocation steppers of a Lagrangian with switching functions, for parts of steps.
    parts: Option<Collocation<'p>>,
    /// Steppers of the parts of steps, each for a number of parts.
    pub(super) of_parts: RefCell<Vec<(usize, Box<dyn Stepper + 'p>)>>,
    /// `M^-1` of a separable Lagrangian, `p = M v`, computed on demand.
    inverse_mass: OnceCell<Option<DMatrix<f64>>>,
}

impl<'p> Discretization<'p> {
    /// The problem of a request with the selected steps.
    pub fn new(request: &Request<'p>, selection: &StepSelection<'p>) -> Result<Self, InputError> {
        let Request { problem, t_end, needs, scales, parts, .. } = request.clone();
        let (integrator, &StepSelection { count, h, error, tolerance, .. }) = (selection.integrator.clone(), selection);
        let switches = has_switching_functions(&*problem.system, problem.t0, &problem.start)?;
        let info = integrator.info();
        if switches && info.in_transformed_time {
            let hypothesis = "a Lagrangian without kinks and jumps, since the steps are equal in transformed time";
            return Err(InputError::Hypothesis { hypothesis });
        }
        if switches && info.constrained {
            return Err(InputError::KinksUnderConstraints);
        }
        let (of_parts, inverse_mass) = (RefCell::new(Vec::new()), OnceCell::new());
        Ok(Discretization {
            problem,
            t_end,
            h,
            count,
            error,
            tolerance,
            integrator,
            info,
            needs,
            scales,
            switches,
            parts,
            of_parts,
            inverse_mass,
        })
    }

    /// The problem with the structure that the steps use: for few steps a linear motion is solved like a nonlinear one,
    /// since the matrix of a step would cost more than the iterations.
    pub fn problem_for_steps(&self) -> SystemProblem<'p> {
        let structure = self.problem.structure;
        let quadratic = structure.quadratic && self.pays_for_a_matrix(self.info.collocation.unwrap_or(0));
        SystemProblem { structure: Structure { quadratic, ..structure }, ..self.problem.clone() }
    }

    /// Whether there are enough steps for the matrix of a linear motion, by collocation with this number of stages.
    pub(super) fn pays_for_a_matrix(&self, stages: usize) -> bool {
        let unknowns = stages * self.problem.system.dimension();
        unknowns <= MAX_UNKNOWNS_OF_SMALL_MATRIX || unknowns.pow(3) / CUBED_UNKNOWNS_PER_STEP <= self.count
    }

    /// A stepper at the start of the run.
    pub fn stepper(&self, check_resolution: bool) -> Result<Box<dyn Stepper + 'p>, InputError> {
        self.stepper_of(&self.problem_for_steps(), self.h, check_resolution)
    }

    /// A stepper at the start of a problem, with step size h. If the Lagrangian has switching functions, steps end on
    /// its kinks and jumps.
    pub fn stepper_of(
        &self,
        problem: &SystemProblem<'p>,
        h: f64,
        check_resolution: bool,
    ) -> Result<Box<dyn Stepper + 'p>, InputError> {
        let options = self.options(check_resolution);
        if let Some(collocation) = self.parts.as_ref().filter(|_| self.switches && !self.info.divides) {
            return of_integrator(self.integrator.clone(), collocation.clone(), problem, h, options);
        }
        self.integrator.stepper(problem, h, options)
    }

    pub(super) fn options(&self, check_resolution: bool) -> StepperOptions {
        let OutputRequest { action, derivatives, .. } = self.needs;
        let tolerance = self.tolerance;
        StepperOptions { action, check_resolution, parts: derivatives, tolerance, ..StepperOptions::default() }
    }

    /// A stepper that starts at a state with its velocity and has taken steps of size h: a given number of them, or
    /// until the time `t_end`. In transformed time the step size is the run's, and the last step ends at `t_end`.
    ///
    /// For these few steps the matrix of a linear motion is computed only if the stage equations cannot be solved
    /// without it, as with an ill-conditioned mass matrix.
    pub fn advanced(
        &self,
        (t, from): (f64, &State),
        v: &Vector,
        h: f64,
        (steps, t_end): (usize, f64),
        guess: impl Fn(&mut dyn Stepper),
    ) -> Result<Box<dyn Stepper + 'p>, StepError> {
        let make = |problem: &SystemProblem<'p>, h: f64| self.stepper_of(problem, h, false);
        self.advanced_by(&make, (t, from), v, h, (steps, t_end), guess)
    }

    /// The same with a stepper that is made by a function.
    fn advanced_by(
        &self,
        make: &MakeStepper<'_, 'p>,
        (t, from): (f64, &State),
        v: &Vector,
        h: f64,
        (steps, t_end): (usize, f64),
        guess: impl Fn(&mut dyn Stepper),
    ) -> Result<Box<dyn Stepper + 'p>, StepError> {
        let claimed = &self.problem.structure;
        let by = |quadratic: bool| {
            // The double-double tables of the separable route depend on the step size: they are not computed for a few
            // steps.
            let separable = claimed.separable && (quadratic || self.info.collocation.is_none());
            let problem = self.problem_at((t, from), v, Structure { quadratic, separable, ..*claimed });
            let h = if self.info.in_transformed_time { self.h } else { h };
            let mut stepper = make(&problem, h).map_err(step_error)?;
            guess(&mut *stepper);
            stepper.advance_until(steps, t_end).map_err(|failure| failure.cause)?;
            Ok(stepper)
        };
        by(false).or_else(|cause| if claimed.quadratic { by(true) } else { Err(cause) })
    }

    /// The problem from a state with its velocity.
    pub(super) fn problem_at(&self, (t, from): (f64, &State), v: &Vector, structure: Structure) -> SystemProblem<'p> {
        let start = Point { q: from.q.clone(), v: v.clone(), z: from.z };
        SystemProblem { t0: t, start, state: from.clone(), structure, ..self.problem.clone() }
    }

    /// A stepper after one step from a time and a state to another time. The iteration starts from the curve of a
    /// longer step, if one is given.
    pub fn step_to(
        &self,
        (t0, from): &(f64, State),
        t: f64,
        near: NearbyVelocity<'_>,
        curve: Option<&DenseStep>,
    ) -> Result<Box<dyn Stepper + 'p>, StepError> {
        let v = self.velocity(*t0, from, near)?;
        let guess = |run: &mut dyn Stepper| {
            if let (Some(curve), Some(run)) = (curve, run.run_support_mut()) {
                run.guess(curve);
            }
        };
        self.advanced((*t0, from), &v, t - t0, (1, t), guess)
    }

    /// The velocity `M^-1 p` of a momentum of a separable Lagrangian, and `None` for any other.
    fn velocity_of_separable(&self, p: &Vector) -> Option<Vector> {
        self.inverse_mass().map(|inverse| Vector::product(inverse, p))
    }

    /// The velocity at a state; if several velocities have its momentum, the one close to the guess.
    pub fn velocity_near(&self, t: f64, state: &State, guess: &Vector) -> Result<Vector, StepError> {
        if let Some(v) = self.velocity_of_separable(&state.p) {
            return if v.iter().all(|v| v.is_finite()) { Ok(v) } else { Err(StepError::NonFinite) };
        }
        self.problem.system.legendre_inverse(t, state, guess).map(|x| x.v)
    }

    /// A guess of the velocity. For a constant mass the velocity is unique.
    fn guess<'v>(&'v self, near: NearbyVelocity<'v>) -> &'v Vector {
        near.filter(|_| !self.problem.structure.constant_mass).unwrap_or(&self.problem.start.v)
    }

    /// The number of stages of a Gauss method, otherwise 1.
    pub fn stages(&self) -> usize {
        self.info.collocation.unwrap_or(1)
    }

    /// The step from the start of a step to a time within it, with the state there and its velocity. Nothing interrupts the
    /// step, and nothing is looked for in its first part: at its start the motion may be on a surface, whose side it has
    /// from the part of the step before.
    pub fn shortened(&self, step: &WholeStep, t: f64) -> Result<(WholeStep, State, Vector), StepError> {
        let (t0, start) = step.start();
        let at_start = self.velocity(t0, start, Some(&step.velocity()))?;
        let make = |problem: &SystemProblem<'p>, h: f64| match step {
            WholeStep::Collocation(_) => {
                self.integrator.stepper(problem, h, StepperOptions { undivided: true, ..self.options(false) })
            }
            WholeStep::Flow(_) => self.stepper_of(problem, h, false),
        };
        let stepper = self.advanced_by(&make, (t0, start), &at_start, t - t0, (1, t), |_| ())?;
        let end = stepper.state();
        let v = self.velocity(t, &end, stepper.last_velocity().as_ref())?;
        let short = match step {
            WholeStep::Collocation(_) => WholeStep::Collocation(stepper.solved_stages().ok_or(StepError::NonFinite)?),
            WholeStep::Flow(_) => {
                WholeStep::Flow(StepEnds { t: t0, h: t - t0, start: start.clone(), end: end.clone() })
            }
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

impl Motion for Discretization<'_> {
    fn velocity(&self, t: f64, state: &State, near: NearbyVelocity<'_>) -> Result<Vector, StepError> {
        self.velocity_near(t, state, self.guess(near))
    }

    fn inverse_mass(&self) -> Option<&DMatrix<f64>> {
        let SystemProblem { system, t0, start, structure, .. } = &self.problem;
        let inverse_mass = self.inverse_mass.get_or_init(|| {
            let mass = || system.mass_matrix(*t0, start);
            if structure.separable { mass_matrix::inverse(&mass()).ok() } else { None }
        });
        inverse_mass.as_ref()
    }

    fn velocity_and_energy(&self, t: f64, state: &State, near: NearbyVelocity<'_>) -> Result<(Vector, f64), StepError> {
        let system = &self.problem.system;
        let (v, l) = match self.velocity_of_separable(&state.p) {
            Some(v) => {
                let x = Point { q: state.q.clone(), v, z: state.z };
                let l = system.value(t, &x);
                (x.v, l)
            }
            None => {
                let AtState { x, l, .. } = system.at_state(t, state, self.guess(near))?;
                (x.v, l)
            }
        };
        let energy = v.dot(&state.p) - l;
        if energy.is_finite() { Ok((v, energy)) } else { Err(StepError::NonFinite) }
    }

    fn rates(&self, t: f64, state: &State, near: NearbyVelocity<'_>) -> Result<State, StepError> {
        let AtState { x, l, mut force, rate } = self.problem.system.at_state(t, state, self.guess(near))?;
        if self.info.constrained {
            force += self.integrator.constraint_force(t, &x)?;
        }
        Ok(State { q: x.v, p: force + &state.p * rate, z: l })
    }

    /// A digest of the start, of L there, of the steps, and of the requests.
    fn fingerprint(&self) -> u64 {
        let SystemProblem { system, t0, start, state, .. } = &self.problem;
        let n = system.dimension();
        let ([value, rate], force) = match system.at_state(*t0, state, &start.v) {
            Ok(at) => ([at.l, at.rate], at.force),
            Err(_) => ([f64::NAN; 2], Vector::zeros(n)),
        };
        let of_constraints = self.integrator.constraint_force(*t0, start).unwrap_or_else(|_| Vector::zeros(n));
        let force = force + of_constraints;
        let numbers = [*t0, self.t_end, self.h, start.z, value, rate];
        let vectors = [&start.q, &start.v, &state.p, &force];
        let numbers = numbers.iter().chain(vectors.into_iter().flat_map(|x| x.iter())).map(|x| x.to_bits());
        let name = self.info.name.bytes().map(u64::from);
        let OutputRequest { action, conformal_factor, .. } = self.needs;
        let counts = [n as u64, self.count as u64, action.into(), conformal_factor.into()];
        let tolerance = (self.tolerance > 0.0).then(|| self.tolerance.to_bits());
        digest(&numbers.chain(name).chain(counts).chain(tolerance).collect::<Vec<u64>>())
    }

    fn state_within_step(
        &self,
        from: &(f64, State),
        t: f64,
        near: NearbyVelocity<'_>,
        curve: Option<&DenseStep>,
    ) -> Result<(State, f64), StepError> {
        let run = self.step_to(from, t, near, curve)?;
        Ok((run.state(), run.sigma()))
    }

    fn curve(&self, ends: (&(f64, State), &(f64, State)), stepper: &dyn Stepper) -> Option<DenseStep> {
        Discretization::curve(self, ends, stepper)
    }

    fn resolve(
        &self,
        ends: (&(f64, State), &(f64, State)),
        step: (&dyn Stepper, Option<&DenseStep>),
        near: NearbyVelocity<'_>,
    ) -> Option<ResolvedStep> {
        Discretization::resolve(self, ends, step, near)
    }

    fn resolve_piece(&self, piece: &Piece, near: NearbyVelocity<'_>) -> Option<ResolvedStep> {
        Discretization::resolve_piece(self, piece, near)
    }
}
