//! Integrators for formulas with holonomic constraints.

use crate::full::FULL;
use crate::{Motion, RuntimeError};
use contact_geom::constraints::{Constraint, ConstraintDerivatives, Redundancy, constrained_motion};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{ChartVector, Lagrangian, PhasePoint, Scalar, VelocityPoint};
use discrete_herglotz::constraints::{Constrained, ConstrainedMethod, ConstrainedStart, OffConstraint};
use discrete_herglotz::rules::Method;
use discrete_herglotz::{
    AnyIntegrator, InputError, Integrator, MethodInfo, Problem, SplittingScheme, StartProjection, StepError,
    StepFormula, Stepper, StepperOptions, Vector,
};
use formula_lagrangian::{Formula, FormulaLagrangian};

/// The largest number of coordinates with constraints.
pub(super) const MAX_CONSTRAINED_COORDINATES: usize = 8;

/// Whether motions under constraints are compiled for this number of coordinates, without the feature `full` for one alone. A formula with
/// constraints has a kernel of the next of these sizes.
pub(super) const fn is_compiled(coordinates: usize) -> bool {
    coordinates == MAX_CONSTRAINED_COORDINATES || FULL && matches!(coordinates, 2 | 4)
}

/// The number of stages of contact Lobatto methods where none is named: order 8.
const DEFAULT_STAGES: usize = 5;

/// What is required of the name of an integrator.
const METHODS: &str = "a motion without constraints; with constraints there are \"gauss_1\" to \"gauss_7\", which stand \
                       for contact Lobatto methods of the same orders, and splittings such as \"kahan_li_8\", which \
                       stand for RATTLE composed by their schemes";

/// The integrator of a formula with constraints: a method for the constraints of the Lagrangian of the problem, which
/// may have parameters of its own in an ensemble.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfConstraints(ConstrainedMethod);

impl OfConstraints {
    /// The method of the integrator of this name for a Lagrangian, or the default one for its structure.
    ///
    /// # Errors
    /// [`InputError::Hypothesis`] where none of this name takes constraints.
    pub fn named<const N: usize>(
        lagrangian: &FormulaLagrangian<N>,
        by: Option<AnyIntegrator>,
    ) -> Result<Self, InputError> {
        Ok(OfConstraints(match by {
            Some(AnyIntegrator::Gauss { stages: stages @ 1..=7 }) => ConstrainedMethod::Lobatto { stages: stages + 1 },
            Some(AnyIntegrator::Splitting(scheme)) => ConstrainedMethod::Rattle(scheme),
            Some(AnyIntegrator::Discrete(Method::Strang)) => ConstrainedMethod::Rattle(SplittingScheme::STRANG),
            Some(_) => return Err(InputError::Hypothesis { hypothesis: METHODS }),
            None => {
                let structure = lagrangian.proved();
                match structure.separable && structure.has_constant_rate() && !Lagrangian::has_force(lagrangian) {
                    true => ConstrainedMethod::Rattle(SplittingScheme::KAHAN_LI_8),
                    false => ConstrainedMethod::Lobatto { stages: DEFAULT_STAGES },
                }
            }
        }))
    }

    fn with<C, const N: usize>(self, constraint: C) -> Constrained<C, N> {
        Constrained::new(constraint, self.0)
    }
}

/// No constraint, in whose place the properties of a method are known.
#[derive(Clone, Copy, Debug)]
struct Unconstrained;

impl<const N: usize> Constraint<N, N> for Unconstrained {
    fn value<T: Scalar>(&self, _q: &SVector<T, N>) -> SVector<T, N> {
        SVector::from_fn(|_, _| T::zero())
    }

    fn count(&self) -> usize {
        0
    }
}

/// The error for a size that is not compiled, which has no kernel with constraints.
fn not_compiled<T>() -> Result<T, InputError> {
    Err(InputError::Hypothesis { hypothesis: METHODS })
}

impl<'a, const N: usize> Integrator<'a, FormulaLagrangian<N>, N> for OfConstraints {
    fn info(&self) -> MethodInfo {
        Integrator::<'a, FormulaLagrangian<N>, N>::info(&self.with::<_, N>(Unconstrained))
    }

    fn check(&self, lagrangian: &FormulaLagrangian<N>) -> Result<(), InputError> {
        if const { is_compiled(N) } { self.with::<_, N>(lagrangian.clone()).check(lagrangian) } else { not_compiled() }
    }

    fn stepper(
        &self,
        problem: &Problem<'a, FormulaLagrangian<N>, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        if const { is_compiled(N) } {
            self.with::<_, N>(problem.lagrangian().clone()).stepper(problem, h, options)
        } else {
            not_compiled()
        }
    }

    fn constraint_force(
        &self,
        lagrangian: &FormulaLagrangian<N>,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> Result<SVector<f64, N>, StepError> {
        if const { is_compiled(N) } {
            self.with::<_, N>(lagrangian.clone()).constraint_force(lagrangian, t, x)
        } else {
            Err(StepError::NonFinite)
        }
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Derivatives)
    }

    fn step_jacobian(
        &self,
        problem: &Problem<'a, FormulaLagrangian<N>, N>,
        h: f64,
        step: (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        if const { is_compiled(N) } {
            self.with::<_, N>(problem.lagrangian()).step_jacobian(problem, h, step)
        } else {
            Ok(None)
        }
    }

    fn step_variation(
        &self,
        problem: &Problem<'a, FormulaLagrangian<N>, N>,
        h: f64,
        step: (f64, &PhasePoint<N>, &PhasePoint<N>),
        parameter: Option<usize>,
        variation: &mut dyn FnMut(f64, &VelocityPoint<N>) -> (f64, ChartVector<N>),
    ) -> Result<Option<ChartVector<N>>, StepError> {
        if const { is_compiled(N) } {
            self.with::<_, N>(problem.lagrangian()).step_variation(problem, h, step, parameter, variation)
        } else {
            Ok(None)
        }
    }

    fn start_projection(
        &self,
        problem: &Problem<'a, FormulaLagrangian<N>, N>,
        parameters: usize,
    ) -> Result<Option<StartProjection>, StepError> {
        if const { is_compiled(N) } {
            self.with::<_, N>(problem.lagrangian()).start_projection(problem, parameters)
        } else {
            Ok(None)
        }
    }
}

/// The multipliers of the constraint force at a point of a motion; `None` where they are not determined.
pub(super) fn multipliers<const N: usize>(
    lagrangian: &FormulaLagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Option<SVector<f64, N>> {
    if const { is_compiled(N) } {
        constrained_motion::<N, N>(lagrangian, lagrangian, t, x, Redundancy::Refuse).ok().map(|found| found.multipliers)
    } else {
        None
    }
}

/// The force of the constraints at a point of a motion.
pub(super) fn force<const N: usize>(lagrangian: &FormulaLagrangian<N>, t: f64, x: &VelocityPoint<N>) -> Option<Vector> {
    let multipliers = multipliers(lagrangian, t, x)?;
    Some((lagrangian.with_jacobian(&x.q).1.transpose() * multipliers).into())
}

/// The start of a motion, moved to the constraints.
pub(super) fn projected<const N: usize>(
    lagrangian: &FormulaLagrangian<N>,
    t: f64,
    at: VelocityPoint<N>,
) -> Result<VelocityPoint<N>, InputError> {
    if const { is_compiled(N) } {
        let start = ConstrainedStart { t, off_constraint: OffConstraint::Project, ..ConstrainedStart::new(at) };
        start.resolved::<N>(lagrangian, lagrangian)
    } else {
        Ok(at)
    }
}

/// Refuses what is not computed with constraints.
pub(crate) fn refuse_constraints(formula: &Formula, what: &'static str) -> Result<(), RuntimeError> {
    if formula.constraints() == 0 { Ok(()) } else { Err(RuntimeError::WithConstraints { what }) }
}

/// Refuses the projection of the start of a motion without constraints.
pub(super) fn check_projection(formula: &Formula, motion: &Motion) -> Result<(), RuntimeError> {
    if motion.project && formula.constraints() == 0 {
        let why = "is requested of a start, but the system has no constraints; give them, or remove it";
        return Err(RuntimeError::argument("project", why));
    }
    Ok(())
}
