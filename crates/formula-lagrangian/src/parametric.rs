//! Formulas as Lagrangians and as contact Hamiltonians with named parameters.

use crate::evaluation::At;
use crate::{FormulaHamiltonian, FormulaLagrangian};
use contact_geom::nalgebra::SVector;
use contact_geom::switching::BreakRate;
use contact_geom::{Parametric, ParametricHamiltonian, Scalar, VelocityPoint, vector};

/// The parameters of the formula in their order, also those that it does not use.
///
/// ```
/// use contact_geom::{Parametric, nalgebra::SVector};
/// use formula_lagrangian::Formula;
/// let spring = Formula::parse("x'^2/2 - k*x^2/2", &["x"], &[("k", 1.0)])?.lagrangian::<1>()?;
/// let (q, v) = (SVector::from([2.0]), SVector::from([0.0]));
/// assert_eq!(spring.value_at(&[3.0], 0.0, &q, &v, 0.0), -6.0);
/// assert_eq!(spring.parameter_index("K").unwrap_err().to_string(), "there is no parameter `K`; did you mean `k`?");
/// # Ok::<(), formula_lagrangian::FormulaError>(())
/// ```
impl<const N: usize> Parametric<N> for FormulaLagrangian<N> {
    fn parameter_names(&self) -> Vec<String> {
        self.derived().formula.names.parameters.clone()
    }

    fn parameters(&self) -> Vec<f64> {
        self.derived().formula.values.clone()
    }

    #[inline(always)]
    fn parameter_count(&self) -> usize {
        self.derived().formula.values.len()
    }

    /// `None` also where a value is not finite.
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        if theta.len() != self.parameter_count() || !theta.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut other = self.clone();
        other.derived_mut().set_all(theta);
        Some(other)
    }

    /// Where the base of a power is not positive, its derivative with respect to a parameter in the exponent is taken to
    /// be 0; so are those of jumps.
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let mut value = T::zero();
        let at = At { q: q.as_slice(), v: v.as_slice(), z, t };
        self.derived().parametric_value.evaluate(theta, at, std::slice::from_mut(&mut value));
        value
    }

    #[inline(always)]
    fn force_at<T: Scalar>(&self, theta: &[T], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let mut force: SVector<T, N> = vector!(|_| T::zero());
        if self.derived().parametric_force.len() > 0 {
            let at = At { q: x.q.as_slice(), v: x.v.as_slice(), z: x.z, t };
            self.derived().parametric_force.evaluate(theta, at, force.as_mut_slice());
        }
        force
    }

    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>> {
        Some(self.derived().break_rates(parameter))
    }
}

/// As for a [`FormulaLagrangian`].
impl<const N: usize> ParametricHamiltonian<N> for FormulaHamiltonian<N> {
    fn parameter_names(&self) -> Vec<String> {
        self.derived.formula.names.parameters.clone()
    }

    fn parameters(&self) -> Vec<f64> {
        self.derived.formula.values.clone()
    }

    /// `None` also where a value is not finite.
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        if theta.len() != self.derived.formula.values.len() || !theta.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut other = self.clone();
        other.derived.set_all(theta);
        Some(other)
    }

    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        let mut value = T::zero();
        let at = At { q: q.as_slice(), v: p.as_slice(), z, t };
        self.derived.parametric_value.evaluate(theta, at, std::slice::from_mut(&mut value));
        value
    }
}
