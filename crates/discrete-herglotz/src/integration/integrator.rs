//! Integrators: the trait, the properties of a method and the options of its stepper.

use crate::integration::{Node, StartProjection};
use crate::{InputError, Problem, SplittingScheme, StepError, Stepper};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{ChartVector, PhasePoint, VelocityPoint};
use std::borrow::Cow;

/// The properties of an integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodInfo {
    /// The name in tables, in lower case with underscores.
    pub name: Cow<'static, str>,
    /// The order of the flow; for a method in transformed time, in the steps of that time.
    pub order: u32,
    /// Whether it is symmetric (equal to its adjoint): a step with `-h` is the inverse of a step with `h`.
    pub symmetric: bool,
    /// Whether its steps are explicit: they evaluate forces and solve no equation.
    pub explicit: bool,
    /// Whether `sigma_d = e^(gamma h)` for a Lagrangian with the linear drag `gamma z`, as for the exact flow.
    pub exact_rate: bool,
    /// Whether its steps have equal length in the transformed time of the Lagrangian; the last one ends at the end of
    /// the span.
    pub in_transformed_time: bool,
    /// The number of stages, for contact Gauss collocation.
    pub collocation: Option<usize>,
    /// Whether a step is a composition of substeps, some of them backward in time.
    pub substeps: bool,
    /// Whether the motion is under constraints, so that it is not the free motion of the Lagrangian.
    pub constrained: bool,
    /// Whether its steps are conformally contact, `Phi^* eta = sigma_d eta`, for a Lagrangian without forces. They are
    /// not where the exact flow is not, under constraints on velocities: `sigma_d` multiplies the energy and some
    /// momenta then, but not the contact form.
    pub contact: bool,
    /// Whether it subdivides its steps where the motion is fast, and at kinks and jumps of the Lagrangian.
    pub divides: bool,
    /// The cost of one of its [evaluations](Stepper::evaluations), in units of an evaluation of L at a stage of Gauss
    /// collocation.
    pub cost_per_evaluation: u64,
    /// The reference: authors, journal, year.
    pub source: Cow<'static, str>,
}

impl MethodInfo {
    /// The properties of an implicit method that is not known to be symmetric: the defaults for a discrete Lagrangian
    /// in N coordinates.
    pub fn of_discrete<const N: usize>(name: impl Into<Cow<'static, str>>, order: u32) -> Self {
        MethodInfo {
            name: name.into(),
            order,
            symmetric: false,
            explicit: false,
            exact_rate: false,
            in_transformed_time: false,
            collocation: None,
            substeps: false,
            constrained: false,
            contact: true,
            divides: false,
            // Newton's method evaluates second derivatives.
            cost_per_evaluation: 32 * N as u64,
            source: Cow::Borrowed(""),
        }
    }
}

/// The options of a stepper.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepperOptions {
    /// Whether the action is computed even where it does not act back on the motion.
    pub action: bool,
    /// Whether the stepper checks that its steps resolve the motion, if the check takes time; see
    /// [`RunSupport::unresolved`](crate::RunSupport::unresolved) and
    /// [`RunSupport::suspect_interval`](crate::RunSupport::suspect_interval).
    pub check_resolution: bool,
    /// Whether the stages of the parts of divided steps are kept, for
    /// [`StepDetails::solved_parts`](crate::StepDetails::solved_parts).
    pub parts: bool,
    /// Whether the steps are known to need no division: they are parts of steps of an integrator that
    /// [divides](MethodInfo::divides) its steps.
    pub undivided: bool,
    /// In place of the steps of a [collocation](MethodInfo::collocation) method those of contact Gauss collocation with
    /// this number of stages, in physical time, for the states between the ends of a step.
    pub stages: Option<usize>,
    /// The largest relative error of the solution of the stage equations at which the iteration of a step of contact Gauss
    /// collocation ends; 0, the default, for round-off.
    pub tolerance: f64,
}

/// An integrator for Lagrangians L in N coordinates: the rules, splittings, compositions and collocation methods of
/// this crate, the exact flow, and those of a user.
///
/// For a [`DiscreteLagrangian`](crate::DiscreteLagrangian), [`CustomMethod`](crate::CustomMethod) is an implementation.
pub trait Integrator<'a, L: ?Sized, const N: usize> {
    /// The properties of the method.
    fn info(&self) -> MethodInfo;

    /// Checks that a Lagrangian satisfies the hypotheses of the method.
    ///
    /// # Errors
    /// [`InputError::Unclaimed`] with the claim that is missing, [`InputError::Hypothesis`],
    /// [`InputError::NoTimeTransformation`], [`InputError::Stages`].
    fn check(&self, lagrangian: &L) -> Result<(), InputError>;

    /// A stepper at the initial state of a problem, with steps of length h, which are negative for a run backward in
    /// time.
    ///
    /// # Errors
    /// [`InputError`] where the problem does not satisfy the hypotheses of the method, or the first step fails.
    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError>;

    /// The force of the constraints, `G^T lambda` or `omega^T mu`, at a point of the motion, for an integrator that is
    /// [constrained](MethodInfo::constrained). The default is 0.
    ///
    /// # Errors
    /// [`StepError`] where the constraints are dependent.
    fn constraint_force(&self, _lagrangian: &L, _t: f64, _x: &VelocityPoint<N>) -> Result<SVector<f64, N>, StepError> {
        Ok(SVector::zeros())
    }

    /// The kernel with which an [`Ensemble`](crate::Ensemble) takes these steps for many motions at once; `None` where
    /// each member has its own stepper.
    fn batch_kernel(&self) -> Option<BatchKernel> {
        None
    }

    /// The sub-flows of which a step consists, from which the tangent of the step is computed; `None` where the tangent is
    /// not implemented, and for collocation, whose tangent is computed from its stages.
    fn step_formula(&self) -> Option<StepFormula> {
        None
    }

    /// The derivative of the state `(q, p, z)` at the end of a step in that at its start, as a matrix with the coordinates in
    /// this order; for an integrator whose tangent is computed neither from stages nor from sub-flows. The step has length
    /// h, and is given by its time and state at the start and by its end. [`hamiltonian_flow_jacobian`](crate::theory::hamiltonian_flow_jacobian) is the matrix of a
    /// discrete Lagrangian. The default is `None`.
    ///
    /// # Errors
    /// [`StepError`] where the step is not differentiable.
    fn step_jacobian(
        &self,
        _problem: &Problem<'a, L, N>,
        _h: f64,
        _step: (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        Ok(None)
    }

    /// The derivative of the state `(q, p, z)` at the end of a step, for a fixed start, along a variation `delta L` of
    /// the Lagrangian, which is given by its value and its partial derivatives in `(q, v, z)` at points; those in q
    /// contain the variation of an applied force. Constraints vary with the parameter, if it is the variation in one. The step
    /// is given as in [`step_jacobian`](Self::step_jacobian). Derivatives in
    /// parameters follow, `delta L = L_theta`; in the time, `delta L = L_t`; and in the step size h, since a step with
    /// `(1 + e) h` is one with h of `L + e (L - v . L_v + (s - t) L_t)` at the times s. The default is `None`.
    ///
    /// # Errors
    /// [`StepError`] where the step is not differentiable.
    fn step_variation(
        &self,
        _problem: &Problem<'a, L, N>,
        _h: f64,
        _step: (f64, &PhasePoint<N>, &PhasePoint<N>),
        _parameter: Option<usize>,
        _variation: &mut dyn FnMut(f64, &VelocityPoint<N>) -> (f64, ChartVector<N>),
    ) -> Result<Option<ChartVector<N>>, StepError> {
        Ok(None)
    }

    /// The derivative of the projection of a start to constraints, in the start and in this number of parameters; `None`, the
    /// default, without constraints.
    ///
    /// # Errors
    /// [`StepError`] where the constraints are dependent or L is not regular.
    fn start_projection(
        &self,
        _problem: &Problem<'a, L, N>,
        _parameters: usize,
    ) -> Result<Option<StartProjection>, StepError> {
        Ok(None)
    }
}

/// The sub-flows of which a step consists.
#[derive(Clone, Debug, PartialEq)]
pub enum StepFormula {
    /// The exact flows of a splitting scheme.
    Splitting(SplittingScheme),
    /// One step of the quadrature rule with these nodes.
    Rule(&'static [Node]),
    /// Steps of the symmetric rule with these nodes, over the fractions of a step that are the substeps of a scheme.
    Composition(&'static [Node], SplittingScheme),
    /// Contact Gauss collocation on the contact Hamiltonian by which the Lagrangian is given.
    Collocation {
        /// The number of stages.
        stages: usize,
    },
    /// A step whose derivative in the state is the matrix [`Integrator::step_jacobian`]; that in parameters and in the step
    /// size is not known.
    Jacobian,
    /// A step whose derivative in the state is the matrix [`Integrator::step_jacobian`], and along variations of the
    /// Lagrangian, from which those in parameters, time and step size follow, [`Integrator::step_variation`].
    Derivatives,
}

/// A kernel that takes the steps of an [`Integrator`] for many motions at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BatchKernel {
    /// The steps of a splitting with linear drag.
    Splitting(SplittingScheme),
    /// The steps of contact Gauss collocation, for a constant mass matrix and a constant rate of the conformal factor.
    Gauss {
        /// The number of stages.
        stages: usize,
    },
}

impl BatchKernel {
    /// The least number of motions that it takes in less time than runs of their own: a step of all lanes takes as long as
    /// three steps of a splitting, and as twelve of a Gauss method (measured for the pendulum, by 2 to 16 stages).
    pub(crate) fn fewest(self) -> usize {
        match self {
            BatchKernel::Splitting(_) => 3,
            BatchKernel::Gauss { .. } => 12,
        }
    }
}
