//! The discrete Lagrangian of a formula, for a number of coordinates that is known at compile time.

use super::formula_system::FormulaSystem;
use crate::full::{FULL, not_compiled};
use crate::{FormulaMethod, RuntimeError};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Arguments, DiscreteJet, DiscretePoint, Scalar, ScalarSystem, SecondDiscreteJet, Slopes};
use discrete_herglotz::{CustomMethod, DiscreteLagrangian, InputError, StepError};
use formula_lagrangian::FormulaDerivatives;
use std::sync::Arc;

/// A discrete Lagrangian in the first n of N coordinates; the others are those of free particles, `h ((q1 - q0)/h)^2/2`.
pub(super) struct FormulaStep<const N: usize> {
    of: Arc<FormulaDerivatives>,
    n: usize,
    h: f64,
}

/// The integrator of a method.
pub(super) type Custom<const N: usize> =
    CustomMethod<Box<dyn Fn(f64) -> Result<FormulaStep<N>, InputError> + Send + Sync>>;

/// The integrator of a method for a system.
///
/// # Errors
/// [`RuntimeError::Argument`] for a method of another number of coordinates, and for a system with forces, constraints or
/// resets, and a Hamiltonian, whose motions are not those of a discrete Lagrangian.
pub(super) fn custom<L: FormulaSystem<N>, const N: usize>(
    of: &FormulaMethod,
    system: &L,
) -> Result<Custom<N>, RuntimeError> {
    let (formula, n) = (system.formula(), of.dimension());
    let refused = |why: String| Err(RuntimeError::argument("method", why));
    if n != formula.dimension() {
        return refused(format!("has {n} coordinates, but the system has {}", formula.dimension()));
    }
    if formula.is_hamiltonian() || system.has_force() || formula.constraints() > 0 || formula.resets() > 0 {
        let why = "is a discrete Lagrangian, for a Lagrangian without forces, constraints and resets; choose an integrator by \
                   its name, such as \"gauss_4\"";
        return refused(why.to_owned());
    }
    let method = of.clone();
    let make = move |h: f64| FormulaStep::new(&method, h);
    let boxed: Box<dyn Fn(f64) -> Result<FormulaStep<N>, InputError> + Send + Sync> = Box::new(make);
    let custom = CustomMethod::new(of.name.clone(), of.order, boxed);
    Ok(if of.symmetric { custom.symmetric() } else { custom })
}

/// Whether methods of one's own are compiled for a system: not for a Hamiltonian, which has no discrete Lagrangian.
pub(super) const fn has_custom<L: FormulaSystem<N>, const N: usize>() -> bool {
    FULL && !L::HINTS.hamiltonian
}

/// The error for a system for which they are not.
pub(super) fn no_custom() -> RuntimeError {
    let what = "discrete Lagrangians";
    if FULL { RuntimeError::OfLagrangians { what } } else { not_compiled(what) }
}

impl<const N: usize> FormulaStep<N> {
    /// That of a method for steps of one length.
    ///
    /// # Errors
    /// [`InputError::Undefined`] for a length that is not finite.
    pub fn new(method: &FormulaMethod, h: f64) -> Result<Self, InputError> {
        let of = method.with_step(h).map_err(|_| InputError::Undefined)?;
        Ok(FormulaStep { of, n: method.dimension(), h })
    }

    /// The jet with the terms of the free particles.
    fn with_free(
        &self,
        x: &DiscretePoint<N>,
        (mut value, mut d1, mut d2, dz): (f64, SVector<f64, N>, SVector<f64, N>, f64),
    ) -> Result<DiscreteJet<N>, StepError> {
        for i in self.n..N {
            let u = (x.q1[i] - x.q0[i]) / self.h;
            value += self.h * u * u / 2.0;
            (d1[i], d2[i]) = (-u, u);
        }
        let is_finite = value.is_finite() && dz.is_finite() && d1.iter().chain(&d2).all(|x| x.is_finite());
        Self::checked(DiscreteJet::new(value, d1, d2, dz), is_finite)
    }

    /// Fails where a number is not finite.
    fn checked<T>(found: T, is_finite: bool) -> Result<T, StepError> {
        if is_finite { Ok(found) } else { Err(StepError::NonFinite) }
    }
}

impl<const N: usize> DiscreteLagrangian<N> for FormulaStep<N> {
    fn step_size(&self) -> f64 {
        self.h
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        let (q0, q1) = (x.q0.as_slice(), x.q1.as_slice());
        let mut value = self.of.value::<T, 0>(T::from(t), &q0[..self.n], &q1[..self.n], x.z0);
        for i in self.n..N {
            let d = x.q1[i] - x.q0[i];
            value += d * d * T::from(0.5 / self.h);
        }
        Self::checked(value, value.re().is_finite())
    }

    fn jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<DiscreteJet<N>, StepError> {
        let (mut d1, mut d2, mut dz) = (SVector::<f64, N>::zeros(), SVector::<f64, N>::zeros(), 0.0);
        let n = self.n;
        let (q0, q1) = (&x.q0.as_slice()[..n], &x.q1.as_slice()[..n]);
        let slopes = Slopes { q: &mut d1.as_mut_slice()[..n], v: &mut d2.as_mut_slice()[..n], z: &mut dz };
        let value = self.of.with_gradient::<f64, 0>(t, q0, q1, x.z0, slopes);
        self.with_free(x, (value, d1, d2, dz))
    }

    fn second_jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, StepError> {
        let n = self.n;
        // Matrices of n x n entries by columns, without the coordinates beyond.
        let square = || SMatrix::<f64, N, N>::zeros();
        let (mut d11, mut d12, mut d22) = (square(), square(), square());
        let (mut d1z, mut d2z, mut dzz) = (SVector::<f64, N>::zeros(), SVector::<f64, N>::zeros(), 0.0);
        let (mut d1, mut d2, mut dz) = (SVector::<f64, N>::zeros(), SVector::<f64, N>::zeros(), 0.0);
        let at = Arguments { t, q: &x.q0.as_slice()[..n], v: &x.q1.as_slice()[..n], z: x.z0 };
        let second = [
            &mut d11.as_mut_slice()[..n * n],
            &mut d12.as_mut_slice()[..n * n],
            &mut d22.as_mut_slice()[..n * n],
            &mut d1z.as_mut_slice()[..n],
            &mut d2z.as_mut_slice()[..n],
            std::slice::from_mut(&mut dzz),
        ];
        let slopes = Slopes { q: &mut d1.as_mut_slice()[..n], v: &mut d2.as_mut_slice()[..n], z: &mut dz };
        let value = self.of.with_second_derivatives::<f64, 0>(at, slopes, second);
        let matrix = |of: &SMatrix<f64, N, N>, of_free: f64| {
            SMatrix::from_fn(|i, j| match (i < n && j < n, i == j) {
                (true, _) => of.as_slice()[i + n * j],
                (false, true) => of_free / self.h,
                (false, false) => 0.0,
            })
        };
        let found = SecondDiscreteJet {
            first: self.with_free(x, (value, d1, d2, dz))?,
            d11: matrix(&d11, 1.0),
            d12: matrix(&d12, -1.0),
            d22: matrix(&d22, 1.0),
            d1z,
            d2z,
            dzz,
        };
        let all = found.d11.iter().chain(&found.d12).chain(&found.d22).chain(&found.d1z).chain(&found.d2z);
        let is_finite = all.chain([&found.dzz]).all(|x| x.is_finite());
        Self::checked(found, is_finite)
    }
}
