//! Discrete Lagrangians as integrators.

use crate::{
    Composition, DiscreteLagrangian, Discretised, Facts, Flow, InputError, Integrator, Method, Problem, Quadrature,
    Rule, SplittingScheme, Stepper, Wants,
};
use contact_geom::Lagrangian;
use std::borrow::Cow;
use std::marker::PhantomData;

/// What makes a discrete Lagrangian for each time step: a rule. Of a user's own, [`Discrete`] is one.
pub trait Discretisation<'a, L, const N: usize> {
    /// The discrete Lagrangian.
    type Discrete: DiscreteLagrangian<N> + 'a;

    /// What is known of its flow.
    fn facts(&self) -> Facts;

    /// Whether a Lagrangian meets its hypotheses. By default all do.
    ///
    /// # Errors
    /// Those of [`Integrator::check`].
    fn check(&self, _lagrangian: &L) -> Result<(), InputError> {
        Ok(())
    }

    /// The discrete Lagrangian of the time step h, negative to go back.
    ///
    /// # Errors
    /// An [`InputError`] where there is none.
    fn discretise(&self, problem: &Problem<'a, L, N>, h: f64) -> Result<Self::Discrete, InputError>;
}

/// An integrator by its discretisation. (For all of them at once another crate could make a second implementation.)
macro_rules! integrates {
    (<$($parameter:ident: $bound:path),*> $rule:ty) => {
        impl<'a, L: Lagrangian<N> + 'a, $($parameter: $bound,)* const N: usize> Integrator<'a, L, N> for $rule
        where
            Self: Discretisation<'a, L, N>,
        {
            fn facts(&self) -> Facts {
                Discretisation::<'a, L, N>::facts(self)
            }

            fn check(&self, lagrangian: &L) -> Result<(), InputError> {
                Discretisation::<'a, L, N>::check(self, lagrangian)
            }

            fn stepper(
                &self,
                problem: &Problem<'a, L, N>,
                h: f64,
                _: Wants,
            ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
                let ld = Discretisation::<'a, L, N>::discretise(self, problem, h)?;
                Ok(Box::new(Flow::with_guess(ld, problem.t0, problem.state, problem.start.v)?))
            }
        }
    };
}

integrates!(<> Method);
integrates!(<R: Rule> ByRule<R>);
integrates!(<F: Sized> Discrete<F>);

/// A quadrature rule as an integrator: `ByRule::<MidpointRule>::default()`. A program that names it compiles no other rule.
#[derive(Clone, Copy, Debug)]
pub struct ByRule<R>(PhantomData<R>);

impl<R> Default for ByRule<R> {
    fn default() -> Self {
        ByRule(PhantomData)
    }
}

impl<'a, L: Lagrangian<N> + 'a, R: Rule, const N: usize> Discretisation<'a, L, N> for ByRule<R> {
    type Discrete = Quadrature<&'a L, R>;

    fn facts(&self) -> Facts {
        Facts { symmetric: R::is_symmetric(), ..Facts::of_discrete::<N>(R::NAME, R::ORDER) }
    }

    fn discretise(&self, problem: &Problem<'a, L, N>, h: f64) -> Result<Self::Discrete, InputError> {
        Quadrature::new(problem.lagrangian, h)
    }
}

impl<'a, L: Lagrangian<N> + 'a, const N: usize> Discretisation<'a, L, N> for Method {
    type Discrete = Discretised<&'a L, N>;

    fn facts(&self) -> Facts {
        Facts {
            symmetric: self.symmetric(),
            explicit: *self == Method::Strang,
            exact_rate: self.exact_rate(),
            ..Facts::of_discrete::<N>(self.name(), self.order())
        }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        Method::check(*self, &lagrangian.structure())
    }

    fn discretise(&self, problem: &Problem<'a, L, N>, h: f64) -> Result<Self::Discrete, InputError> {
        Method::discretise(*self, problem.lagrangian, h, problem.t0, &problem.state)
    }
}

/// A user's own discrete Lagrangian as an integrator: what makes one for each time step, with a name and the order of its flow.
///
/// ```
/// use contact_geom::{VelocityPoint, systems::Pendulum};
/// use discrete_herglotz::{Discrete, Midpoint, Problem, Steps, Until};
/// let pendulum = Pendulum { gamma: -0.1 };
/// let mine = Discrete::new("mine", 2, |h| Midpoint::new(&pendulum, h));
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
/// let outcome = problem.by(mine).steps(Steps::Size(0.1)).run(Until::Time(10.0))?;
/// println!("q = {}", outcome.q[0]);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Discrete<F> {
    name: Cow<'static, str>,
    order: u32,
    symmetric: bool,
    make: F,
}

impl<F> Discrete<F> {
    /// With a name, the order of its flow, and what makes it for a time step.
    pub fn new(name: impl Into<Cow<'static, str>>, order: u32, make: F) -> Self {
        Discrete { name: name.into(), order, symmetric: false, make }
    }

    /// The same, known to be its own adjoint.
    pub fn symmetric(self) -> Self {
        Discrete { symmetric: true, ..self }
    }
}

impl<'a, L, D, F, const N: usize> Discretisation<'a, L, N> for Discrete<F>
where
    D: DiscreteLagrangian<N> + 'a,
    F: Fn(f64) -> Result<D, InputError>,
{
    type Discrete = D;

    fn facts(&self) -> Facts {
        Facts { symmetric: self.symmetric, ..Facts::of_discrete::<N>(self.name.clone(), self.order) }
    }

    fn discretise(&self, _: &Problem<'a, L, N>, h: f64) -> Result<D, InputError> {
        (self.make)(h)
    }
}

/// A symmetric [`Composition`] of a rule that is symmetric and of order 2, as an integrator.
#[derive(Clone, Copy, Debug)]
pub struct Composed<D> {
    rule: D,
    scheme: SplittingScheme,
}

impl<D> Composed<D> {
    /// The composition of this rule by the substeps of a scheme.
    pub fn new(rule: D, scheme: SplittingScheme) -> Self {
        Composed { rule, scheme }
    }
}

impl<'a, L: Lagrangian<N>, D: Discretisation<'a, L, N>, const N: usize> Integrator<'a, L, N> for Composed<D> {
    fn facts(&self) -> Facts {
        let rule = self.rule.facts();
        Facts {
            name: format!("{}_by_{}", rule.name, self.scheme.name()).into(),
            order: self.scheme.order(),
            symmetric: true,
            substeps: true,
            source: Cow::Borrowed(self.scheme.source()),
            ..rule
        }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        let rule = self.rule.facts();
        if !rule.symmetric || rule.order != 2 || self.scheme.is_nystrom() {
            return Err(InputError::Hypothesis { hypothesis: "a composition of a symmetric rule of order 2" });
        }
        self.rule.check(lagrangian)
    }

    fn stepper(&self, problem: &Problem<'a, L, N>, h: f64, _: Wants) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
        let rule = |h| self.rule.discretise(problem, h);
        Ok(Box::new(Composition::new(rule, &self.scheme, h, problem.t0, problem.state)?))
    }
}
