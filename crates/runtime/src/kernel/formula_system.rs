//! What the kernels use of a formula: a Lagrangian, or a contact Hamiltonian in its place.

use super::constrained::{OfConstraints, force, multipliers, projected};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{Lagrangian, OfHamiltonian, PhasePoint, Symmetry, VelocityPoint};
use discrete_herglotz::hamiltonian::SeparableSplitting;
use discrete_herglotz::rules::Method;
use discrete_herglotz::{
    AnyIntegrator, DividedGauss, GaussCollocation, InputError, Integrator, MethodInfo, Point, Problem, SplittingScheme,
    State, StepError, StepFormula, Stepper, StepperOptions, Vector, theory::legendre_inverse,
};
use formula_lagrangian::{Formula, FormulaError, FormulaHamiltonian, FormulaLagrangian};

/// What observers of a motion use. It is not generic, so that observers are compiled once for each dimension.
pub(super) trait Observed {
    fn formula(&self) -> &Formula;
    /// `L_z` if it is proved to be constant.
    fn constant_rate(&self) -> Option<f64>;
    /// The number of resets.
    fn resets(&self) -> usize;
    /// The number of the reset to which a switching function belongs.
    fn reset_of(&self, index: usize) -> Option<usize>;
    /// What expressions contain beside the position and the action: the velocity, found from a guess, or the momentum
    /// for a Hamiltonian. `None` where there is none.
    fn velocity_or_momentum(&self, t: f64, state: &State, guess: &[f64]) -> Option<Vector>;
    /// The velocity at a state, found from a guess.
    fn velocity(&self, t: f64, state: &State, guess: &[f64]) -> Option<Vector> {
        self.velocity_or_momentum(t, state, guess)
    }
    /// The energy at a state with its velocity.
    fn energy(&self, t: f64, state: &State, v: Option<&Vector>) -> Option<f64>;
    /// The multiplier of the constraint with this index; NaN where it is not determined.
    fn multiplier(&self, _t: f64, _x: &Point, _index: usize) -> f64 {
        f64::NAN
    }
    /// The force of the constraints; `None`, the default, without constraints.
    fn constraint_force(&self, _t: f64, _x: &Point) -> Option<Vector> {
        None
    }
}

/// A formula that is run.
pub(super) trait FormulaSystem<const N: usize>:
    Lagrangian<N> + Observed + Clone + Send + Sync + 'static
{
    /// Whether motions without constraints are compiled.
    const IS_FREE: bool = true;

    /// The integrators for it, which are compiled.
    type By: for<'a> Integrator<'a, Self, N> + Copy + Sync;
    /// The integrators for it where it has constraints.
    type Constrained: for<'a> Integrator<'a, Self, N> + Copy + Sync + 'static;

    /// An integrator by its name.
    ///
    /// # Errors
    /// [`InputError::Hypothesis`] where there is none of this name for it.
    fn by(integrator: AnyIntegrator) -> Result<Self::By, InputError>;
    /// The integrator for the constraints, by its name or chosen by the structure; `None` without constraints.
    ///
    /// # Errors
    /// [`InputError::Hypothesis`] where none of this name takes constraints.
    fn constrained(&self, _by: Option<AnyIntegrator>) -> Result<Option<Self::Constrained>, InputError> {
        Ok(None)
    }
    /// The point of the constraints next to the start of a motion.
    ///
    /// # Errors
    /// [`InputError::Constraint`] where it is not found.
    fn projected(&self, _t: f64, at: VelocityPoint<N>) -> Result<VelocityPoint<N>, InputError> {
        Ok(at)
    }
    /// Sets the value of a parameter.
    fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError>;
    /// The recognised symmetries.
    fn symmetries(&self) -> Vec<Symmetry<N>>;
}

/// The hypothesis of an integrator on a motion with constraints that splittings do not take, since a force acts or the
/// Lagrangian is not separable.
const METHODS_OF_ANY_MOTION: &str = "a motion without constraints; for this one there are \"gauss_1\" to \"gauss_7\", \
                                     which stand for contact Lobatto methods of the same orders";

impl<const N: usize> Observed for FormulaLagrangian<N> {
    fn formula(&self) -> &Formula {
        self.formula()
    }

    fn constant_rate(&self) -> Option<f64> {
        self.constant_rate()
    }

    fn resets(&self) -> usize {
        self.resets()
    }

    fn reset_of(&self, index: usize) -> Option<usize> {
        self.reset_of(index)
    }

    fn velocity_or_momentum(&self, t: f64, state: &State, guess: &[f64]) -> Option<Vector> {
        // Coordinates that the formula does not have are at rest.
        let guess = SVector::from_fn(|i, _| guess.get(i).copied().unwrap_or(0.0));
        legendre_inverse(self, t, &state.fixed(), &guess).ok().map(|x| x.v.into())
    }

    fn energy(&self, t: f64, state: &State, v: Option<&Vector>) -> Option<f64> {
        let (PhasePoint { q, p, z }, v): (_, SVector<f64, N>) = (state.fixed(), v?.fixed());
        Some(v.dot(&p) - Lagrangian::value(self, t, &q, &v, z))
    }

    fn multiplier(&self, t: f64, x: &Point, index: usize) -> f64 {
        multipliers(self, t, &x.fixed()).and_then(|all| all.get(index).copied()).unwrap_or(f64::NAN)
    }

    fn constraint_force(&self, t: f64, x: &Point) -> Option<Vector> {
        if self.formula().constraints() > 0 { force(self, t, &x.fixed()) } else { None }
    }
}

impl<const N: usize> FormulaSystem<N> for FormulaLagrangian<N> {
    const IS_FREE: bool = super::has_kernel(N);

    type By = AnyIntegrator;
    type Constrained = OfConstraints;

    fn by(integrator: AnyIntegrator) -> Result<AnyIntegrator, InputError> {
        Ok(integrator)
    }

    fn constrained(&self, by: Option<AnyIntegrator>) -> Result<Option<OfConstraints>, InputError> {
        if self.formula().constraints() == 0 {
            return Ok(None);
        }
        // Before the integrator: none of them takes these.
        let (mut switches, nowhere) = (Vec::new(), VelocityPoint::new([0.0; N], [0.0; N], 0.0));
        Lagrangian::switching_functions(self, 0.0, &nowhere, &mut switches);
        if !(switches.is_empty() && Lagrangian::breaks(self).is_empty()) {
            return Err(InputError::KinksUnderConstraints);
        }
        match by {
            None | Some(AnyIntegrator::Gauss { stages: 1..=7 } | AnyIntegrator::Splitting(_)) => {}
            Some(_) if self.proved().separable && !Lagrangian::has_force(self) => {}
            Some(_) => return Err(InputError::Hypothesis { hypothesis: METHODS_OF_ANY_MOTION }),
        }
        OfConstraints::named(self, by).map(Some)
    }

    fn projected(&self, t: f64, at: VelocityPoint<N>) -> Result<VelocityPoint<N>, InputError> {
        projected(self, t, at)
    }

    fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError> {
        self.set(parameter, value)
    }

    fn symmetries(&self) -> Vec<Symmetry<N>> {
        self.symmetries()
    }
}

impl<const N: usize> Observed for OfHamiltonian<FormulaHamiltonian<N>> {
    fn formula(&self) -> &Formula {
        self.0.formula()
    }

    fn constant_rate(&self) -> Option<f64> {
        self.0.constant_rate()
    }

    fn resets(&self) -> usize {
        0
    }

    fn reset_of(&self, _index: usize) -> Option<usize> {
        None
    }

    fn velocity_or_momentum(&self, _t: f64, state: &State, _: &[f64]) -> Option<Vector> {
        Some(state.p.clone())
    }

    fn velocity(&self, t: f64, state: &State, guess: &[f64]) -> Option<Vector> {
        legendre_inverse(self, t, &state.fixed(), &Vector::from(guess).fixed()).ok().map(|x| x.v.into())
    }

    fn energy(&self, t: f64, state: &State, _v: Option<&Vector>) -> Option<f64> {
        Lagrangian::hamiltonian_with_gradient(self, t, &state.fixed()).map(|(h, _)| h)
    }
}

/// The integrators of contact Hamiltonians; the other ones are those of Lagrangians.
#[derive(Clone, Copy, Debug)]
pub(super) enum OfHamiltonians {
    /// Contact Gauss collocation on rho H.
    Gauss(GaussCollocation),
    /// Contact Gauss collocation with steps that are divided where they do not resolve the motion, as
    /// [`Run::accuracy`](discrete_herglotz::Run::accuracy) selects it.
    Divided(DividedGauss),
    /// The splitting of a separable H.
    Splitting(SeparableSplitting),
}

/// Evaluates an expression with the integrator of a variant.
macro_rules! each {
    ($any:expr, $integrator:ident => $result:expr) => {
        match $any {
            OfHamiltonians::Gauss($integrator) => $result,
            OfHamiltonians::Divided($integrator) => $result,
            OfHamiltonians::Splitting($integrator) => $result,
        }
    };
}

impl<'a, const N: usize> Integrator<'a, OfHamiltonian<FormulaHamiltonian<N>>, N> for OfHamiltonians {
    fn info(&self) -> MethodInfo {
        each!(self, by => Integrator::<OfHamiltonian<FormulaHamiltonian<N>>, N>::info(by))
    }

    fn check(&self, hamiltonian: &OfHamiltonian<FormulaHamiltonian<N>>) -> Result<(), InputError> {
        each!(self, by => by.check(hamiltonian))
    }

    fn stepper(
        &self,
        problem: &Problem<'a, OfHamiltonian<FormulaHamiltonian<N>>, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        each!(self, by => by.stepper(problem, h, options))
    }

    fn step_formula(&self) -> Option<StepFormula> {
        each!(self, by => Integrator::<OfHamiltonian<FormulaHamiltonian<N>>, N>::step_formula(by))
    }

    fn step_jacobian(
        &self,
        problem: &Problem<'a, OfHamiltonian<FormulaHamiltonian<N>>, N>,
        h: f64,
        step: (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        each!(self, by => by.step_jacobian(problem, h, step))
    }
}

impl<const N: usize> FormulaSystem<N> for OfHamiltonian<FormulaHamiltonian<N>> {
    type By = OfHamiltonians;
    type Constrained = OfHamiltonians;

    fn by(integrator: AnyIntegrator) -> Result<OfHamiltonians, InputError> {
        match integrator {
            AnyIntegrator::Gauss { stages } => Ok(OfHamiltonians::Gauss(GaussCollocation { stages })),
            AnyIntegrator::Divided(divided) => Ok(OfHamiltonians::Divided(divided)),
            AnyIntegrator::Splitting(scheme) => Ok(OfHamiltonians::Splitting(SeparableSplitting { scheme })),
            AnyIntegrator::Discrete(Method::Strang) => {
                Ok(OfHamiltonians::Splitting(SeparableSplitting { scheme: SplittingScheme::STRANG }))
            }
            _ => Err(InputError::Hypothesis {
                hypothesis: "a Lagrangian; a Hamiltonian runs by `gauss_1` to `gauss_16`, and by the splittings where it \
                             is T(p) + V(t, q) + a*z + b*z^2",
            }),
        }
    }

    fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError> {
        self.0.set(parameter, value)
    }

    /// The translations along coordinates on which H does not depend.
    fn symmetries(&self) -> Vec<Symmetry<N>> {
        let along = |i: usize| Symmetry::Translation(SVector::from_fn(|j, _| f64::from(u8::from(i == j))));
        self.0.cyclic().into_iter().map(along).collect()
    }
}
