//! Discrete Lagrangians as integrators.

use crate::error::step_error;
use crate::integration::StepFormula;
use crate::{
    DiscreteLagrangian, InputError, Integrator, MethodInfo, Problem, SplittingScheme, StepError, Stepper,
    StepperOptions,
    rules::{AnyDiscreteLagrangian, Composition, Flow, Method, Quadrature, Rule},
    theory::hamiltonian_flow_jacobian,
};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{DiscretePoint, Lagrangian, PhasePoint};
use std::borrow::Cow;

/// A discretisation method: it constructs the discrete Lagrangian of a problem for a time step. [`CustomMethod`] makes
/// one from a closure.
pub trait DiscretizationMethod<'a, L, const N: usize> {
    /// The discrete Lagrangian.
    type DiscreteLagrangian: DiscreteLagrangian<N> + 'a;

    /// The properties of its flow.
    fn info(&self) -> MethodInfo;

    /// Checks the hypotheses of the method for a Lagrangian. By default every Lagrangian is accepted.
    ///
    /// # Errors
    /// Those of [`Integrator::check`].
    fn check(&self, _lagrangian: &L) -> Result<(), InputError> {
        Ok(())
    }

    /// The discrete Lagrangian for the time step h, which is negative for a run backward in time.
    ///
    /// # Errors
    /// An [`InputError`] where the method cannot construct it.
    fn discretise(&self, problem: &Problem<'a, L, N>, h: f64) -> Result<Self::DiscreteLagrangian, InputError>;

    /// The formula of its step, from which the tangent is computed; `None`, the default, where it is not implemented.
    fn step_formula(&self) -> Option<StepFormula> {
        None
    }

    /// The derivative of a step in the state at its start; see [`Integrator::step_jacobian`].
    ///
    /// # Errors
    /// Those of [`Integrator::step_jacobian`].
    fn step_jacobian(
        &self,
        _problem: &Problem<'a, L, N>,
        _h: f64,
        _step: (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        Ok(None)
    }
}

/// Implements [`Integrator`] for a discretisation method. (A blanket implementation would overlap with implementations
/// in other crates.)
macro_rules! integrates {
    (<$($parameter:ident: $bound:path),*> $rule:ty) => {
        impl<'a, L: Lagrangian<N> + 'a, $($parameter: $bound,)* const N: usize> Integrator<'a, L, N> for $rule
        where
            Self: DiscretizationMethod<'a, L, N>,
        {
            fn info(&self) -> MethodInfo {
                DiscretizationMethod::<'a, L, N>::info(self)
            }

            fn check(&self, lagrangian: &L) -> Result<(), InputError> {
                DiscretizationMethod::<'a, L, N>::check(self, lagrangian)
            }

            fn stepper(
                &self,
                problem: &Problem<'a, L, N>,
                h: f64,
                _: StepperOptions,
            ) -> Result<Box<dyn Stepper + 'a>, InputError> {
                let ld = DiscretizationMethod::<'a, L, N>::discretise(self, problem, h)?;
                Ok(Box::new(Flow::with_guess(ld, problem.t0, problem.state, problem.start.v)?))
            }

            fn step_formula(&self) -> Option<StepFormula> {
                DiscretizationMethod::<'a, L, N>::step_formula(self)
            }

            fn step_jacobian(
                &self,
                problem: &Problem<'a, L, N>,
                h: f64,
                step: (f64, &PhasePoint<N>, &PhasePoint<N>),
            ) -> Result<Option<DMatrix<f64>>, StepError> {
                DiscretizationMethod::<'a, L, N>::step_jacobian(self, problem, h, step)
            }
        }
    };
}

integrates!(<> Method);
integrates!(<> Rule);
integrates!(<F: Sized> CustomMethod<F>);

impl<'a, L: Lagrangian<N> + 'a, const N: usize> DiscretizationMethod<'a, L, N> for Rule {
    type DiscreteLagrangian = Quadrature<&'a L>;

    fn info(&self) -> MethodInfo {
        MethodInfo { symmetric: self.is_symmetric(), ..MethodInfo::of_discrete::<N>(self.name, self.order) }
    }

    fn discretise(&self, problem: &Problem<'a, L, N>, h: f64) -> Result<Self::DiscreteLagrangian, InputError> {
        self.of(problem.lagrangian, h)
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Rule(self.nodes))
    }
}

impl<'a, L: Lagrangian<N> + 'a, const N: usize> DiscretizationMethod<'a, L, N> for Method {
    type DiscreteLagrangian = AnyDiscreteLagrangian<&'a L, N>;

    fn info(&self) -> MethodInfo {
        MethodInfo {
            symmetric: self.symmetric(),
            explicit: *self == Method::Strang,
            exact_rate: self.exact_rate(),
            ..MethodInfo::of_discrete::<N>(self.name(), self.order())
        }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        Method::check(*self, &lagrangian.structure())
    }

    fn discretise(&self, problem: &Problem<'a, L, N>, h: f64) -> Result<Self::DiscreteLagrangian, InputError> {
        Method::discretise(*self, problem.lagrangian, h, problem.t0, &problem.state)
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(self.rule().map_or(StepFormula::Splitting(SplittingScheme::STRANG), |rule| StepFormula::Rule(rule.nodes)))
    }
}

/// A custom discrete Lagrangian as an integrator: a closure that constructs it for a time step, with a name and the
/// order of its flow.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{CustomMethod, Problem, Steps, Until, rules::Rule};
/// let pendulum = Pendulum { gamma: -0.1 };
/// let mine = CustomMethod::new("mine", 2, |h| Rule::MIDPOINT.of(&pendulum, h));
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
/// let outcome = problem.by(mine).steps(Steps::Size(0.1)).run(Until::Time(10.0))?;
/// println!("q = {}", outcome.q[0]);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CustomMethod<F> {
    name: Cow<'static, str>,
    order: u32,
    symmetric: bool,
    make: F,
}

impl<F> CustomMethod<F> {
    /// A method with a name, the order of its flow, and a closure that constructs the discrete Lagrangian for a time
    /// step.
    pub fn new(name: impl Into<Cow<'static, str>>, order: u32, make: F) -> Self {
        CustomMethod { name: name.into(), order, symmetric: false, make }
    }

    /// The same method, declared to be symmetric (equal to its adjoint).
    pub fn symmetric(self) -> Self {
        CustomMethod { symmetric: true, ..self }
    }
}

impl<'a, L, D, F, const N: usize> DiscretizationMethod<'a, L, N> for CustomMethod<F>
where
    D: DiscreteLagrangian<N> + 'a,
    F: Fn(f64) -> Result<D, InputError>,
{
    type DiscreteLagrangian = D;

    fn info(&self) -> MethodInfo {
        MethodInfo { symmetric: self.symmetric, ..MethodInfo::of_discrete::<N>(self.name.clone(), self.order) }
    }

    fn discretise(&self, _: &Problem<'a, L, N>, h: f64) -> Result<D, InputError> {
        (self.make)(h)
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Jacobian)
    }

    fn step_jacobian(
        &self,
        _: &Problem<'a, L, N>,
        h: f64,
        (t, start, end): (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        let ld = (self.make)(h).map_err(step_error)?;
        hamiltonian_flow_jacobian(&ld, t, &DiscretePoint { q0: start.q, q1: end.q, z0: start.z }).map(Some)
    }
}

/// A symmetric [`Composition`] of a symmetric rule of order 2 as an integrator.
#[derive(Clone, Copy, Debug)]
pub struct CompositionMethod<D> {
    rule: D,
    scheme: SplittingScheme,
}

impl<D> CompositionMethod<D> {
    /// The composition of this rule with the substeps of a scheme.
    pub fn new(rule: D, scheme: SplittingScheme) -> Self {
        CompositionMethod { rule, scheme }
    }
}

impl<'a, L: Lagrangian<N>, D: DiscretizationMethod<'a, L, N>, const N: usize> Integrator<'a, L, N>
    for CompositionMethod<D>
{
    fn info(&self) -> MethodInfo {
        let rule = self.rule.info();
        MethodInfo {
            name: format!("{}_by_{}", rule.name, self.scheme.name()).into(),
            order: self.scheme.order(),
            symmetric: true,
            substeps: true,
            source: Cow::Borrowed(self.scheme.source()),
            ..rule
        }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        let rule = self.rule.info();
        if !rule.symmetric || rule.order != 2 || self.scheme.is_nystrom() {
            return Err(InputError::Hypothesis { hypothesis: "a composition of a symmetric rule of order 2" });
        }
        self.rule.check(lagrangian)
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        _: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        let rule = |h| self.rule.discretise(problem, h);
        Ok(Box::new(Composition::new(rule, &self.scheme, h, problem.t0, problem.state)?))
    }

    fn step_formula(&self) -> Option<StepFormula> {
        match self.rule.step_formula()? {
            StepFormula::Rule(nodes) => Some(StepFormula::Composition(nodes, self.scheme)),
            // A composition of kick, drift, kick is the splitting of the scheme.
            StepFormula::Splitting(rule) if rule == SplittingScheme::STRANG => {
                Some(StepFormula::Splitting(self.scheme))
            }
            _ => None,
        }
    }
}
