//! Generating functions as integrators.

use super::stepper::partial_step;
use super::{Adjoint, Arrangement, Euler, GeneratingStepper, TypeTwo};
use crate::hamiltonian::increment::jacobian;
use crate::integration::StepFormula;
use crate::{InputError, Integrator, MethodInfo, Problem, StepError, Stepper, StepperOptions};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{ContactHamiltonian, OfHamiltonian, PhasePoint};
use std::borrow::Cow;

/// Contact symplectic Euler, its adjoint, and symmetric compositions of both, for every contact Hamiltonian, whatever
/// the rank of `H_pp`. Each step is conformally contact; orders 1, 2 and those of the compositions, to 10. See
/// [`Euler`].
///
/// ```
/// use discrete_herglotz::{SplittingScheme, hamiltonian::{Arrangement, ContactEuler}};
/// let method = ContactEuler { arrangement: Arrangement::Symmetric(SplittingScheme::STRANG) };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEuler {
    /// The maps of a step.
    pub arrangement: Arrangement,
}

/// An integrator by a generating function of the user's, such as an exact one, in an [`Arrangement`]. It is a method
/// for the contact Hamiltonian of which the increment S is `h H + O(h^2)`.
///
/// ```
/// use contact_geom::nalgebra::SMatrix;
/// use discrete_herglotz::hamiltonian::{Arrangement, ExactTypeTwo, GeneratingFunction, Quadratic};
/// let one = SMatrix::<f64, 1, 1>::identity();
/// let function = ExactTypeTwo(Quadratic::new(one, one * 0.0, one, -0.1));
/// let method = GeneratingFunction { function, order: 64, arrangement: Arrangement::TypeTwo };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeneratingFunction<G> {
    /// The function of type II.
    pub function: G,
    /// Its order.
    pub order: u32,
    /// The maps of a step.
    pub arrangement: Arrangement,
}

const SOURCE: &str =
    "Lall and West, J. Phys. A 39 (2006) 5509-5519; Leok and Zhang, IMA J. Numer. Anal. 31 (2011) 1497-1532";

/// The properties of an arrangement of a function of this order.
fn info(name: &str, order: u32, arrangement: &Arrangement, dimension: usize) -> MethodInfo {
    let (suffix, order, symmetric, substeps) = match arrangement {
        Arrangement::TypeTwo => ("type_2", order, false, false),
        Arrangement::TypeThree => ("type_3", order, false, false),
        Arrangement::Symmetric(scheme) => (scheme.name(), order.max(scheme.order()), true, scheme.stages() > 1),
    };
    MethodInfo {
        symmetric,
        substeps,
        source: Cow::Borrowed(SOURCE),
        // First and second derivatives, of which the latter take longer with the dimension.
        cost_per_evaluation: 2 + 2 * dimension as u64,
        ..MethodInfo::of_discrete::<1>(format!("{name}_{suffix}"), order)
    }
}

/// The derivative of a step.
fn step_jacobian<G: TypeTwo<N>, const N: usize>(
    function: &Adjoint<G>,
    arrangement: &Arrangement,
    (t, h): (f64, f64),
    from: &PhasePoint<N>,
) -> Result<Option<DMatrix<f64>>, StepError> {
    let Ok(maps) = arrangement.maps() else { return Ok(None) };
    let step = |x: &_| {
        let mut x = *x;
        for map in &maps {
            x = partial_step(function, map, (t, h), &x, &mut 0)?.after(&x);
        }
        Ok(x)
    };
    jacobian(from, step).map(Some)
}

impl<'a, H: ContactHamiltonian<N>, const N: usize> Integrator<'a, OfHamiltonian<H>, N> for ContactEuler {
    fn info(&self) -> MethodInfo {
        info("contact_euler", 1, &self.arrangement, N)
    }

    fn check(&self, _hamiltonian: &OfHamiltonian<H>) -> Result<(), InputError> {
        self.arrangement.maps().map(|_| ())
    }

    fn stepper(
        &self,
        problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        _options: StepperOptions,
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
        let function = Euler(&problem.lagrangian.0);
        Ok(Box::new(GeneratingStepper::new(function, self.arrangement, h, problem.t0, problem.state)?))
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Jacobian)
    }

    fn step_jacobian(
        &self,
        problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        (t, from, _to): (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        step_jacobian(&Adjoint(Euler(&problem.lagrangian.0)), &self.arrangement, (t, h), from)
    }
}

impl<'a, H, G, const N: usize> Integrator<'a, OfHamiltonian<H>, N> for GeneratingFunction<G>
where
    H: ContactHamiltonian<N>,
    G: TypeTwo<N> + Clone + 'a,
{
    fn info(&self) -> MethodInfo {
        info("generating_function", self.order, &self.arrangement, N)
    }

    fn check(&self, _hamiltonian: &OfHamiltonian<H>) -> Result<(), InputError> {
        self.arrangement.maps().map(|_| ())
    }

    fn stepper(
        &self,
        problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        _options: StepperOptions,
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
        self.check_consistent(&problem.lagrangian.0, problem.t0, &problem.state)?;
        let function = self.function.clone();
        Ok(Box::new(GeneratingStepper::new(function, self.arrangement, h, problem.t0, problem.state)?))
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Jacobian)
    }

    fn step_jacobian(
        &self,
        _problem: &Problem<'a, OfHamiltonian<H>, N>,
        h: f64,
        (t, from, _to): (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        step_jacobian(&Adjoint(self.function.clone()), &self.arrangement, (t, h), from)
    }
}

impl<G> GeneratingFunction<G> {
    /// Returns an error unless `S/h` tends to H: the mean of `S/h` for a short h of both signs.
    fn check_consistent<H: ContactHamiltonian<N>, const N: usize>(
        &self,
        hamiltonian: &H,
        t: f64,
        x: &PhasePoint<N>,
    ) -> Result<(), InputError>
    where
        G: TypeTwo<N>,
    {
        const SHORT: f64 = 1e-5;
        let value = hamiltonian.value(t, &x.q, &x.p, x.z);
        let s = |h: f64| self.function.increment(t, h, &x.q, &x.p, x.z);
        let mean = (s(SHORT) - s(-SHORT)) / (2.0 * SHORT);
        if !value.is_finite() {
            return Err(InputError::Undefined);
        }
        // Rounding of S over h, and the error of the mean, of second order in h.
        if (mean - value).abs() <= 1e-6 * (1.0 + value.abs() + x.p.dot(&x.q).abs()) {
            return Ok(());
        }
        Err(InputError::Hypothesis { hypothesis: "a generating function whose increment is h H + O(h^2)" })
    }
}
