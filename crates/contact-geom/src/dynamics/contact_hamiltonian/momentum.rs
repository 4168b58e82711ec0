//! The momentum of a velocity: the inverse of `v = H_p`.

use crate::support::linear;
use crate::{ContactHamiltonian, HamiltonianDerivatives, PhasePoint, Scalar, VelocityPoint, numbers::max_abs_or_nan};
use nalgebra::{SMatrix, SVector};
use thiserror::Error;

/// The largest number of iterations of Newton's method over real numbers.
const MAX_ITERATIONS: usize = 64;
/// The largest number of corrections of the differentials: each corrects one order of them.
const MAX_CORRECTIONS: usize = 8;

/// The reason why a velocity has no momentum.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum NoMomentum {
    /// `H_pp` is singular: H has no Lagrangian there.
    #[error("H_pp is singular (pivot {pivot:e}), so that the velocity does not determine the momentum")]
    Singular {
        /// The size of the pivot at which elimination stopped.
        pivot: f64,
    },
    /// The iteration did not converge: the velocity may not be in the range of `H_p`.
    #[error("no momentum was found with H_p = v, to {residual:e}")]
    NotConverged {
        /// The largest component of `H_p - v`.
        residual: f64,
    },
}

/// The momentum p with `H_p(t, q, p, z) = v`, by Newton's method from p = 0 with corrections that are shortened until the
/// residual decreases. Over a scalar with differentials, p has the differentials of the solution.
///
/// # Errors
/// [`NoMomentum`].
pub fn momentum<H: ContactHamiltonian<N> + ?Sized, T: Scalar, const N: usize>(
    hamiltonian: &H,
    t: T,
    x: &VelocityPoint<N, T>,
) -> Result<SVector<T, N>, NoMomentum> {
    let time = t.re();
    let real = VelocityPoint { q: x.q.map(|e| e.re()), v: x.v.map(|e| e.re()), z: x.z.re() };
    let at = real_momentum(hamiltonian, time, &real)?;
    lift(hamiltonian, time, &at, |p| hamiltonian.with_gradient(t, &PhasePoint { q: x.q, p: *p, z: x.z }).1.y - x.v)
}

/// The same over real numbers: the code is compiled once, and not for each type of scalar.
fn real_momentum<H: ContactHamiltonian<N> + ?Sized, const N: usize>(
    hamiltonian: &H,
    time: f64,
    x: &VelocityPoint<N>,
) -> Result<PhasePoint<N>, NoMomentum> {
    let VelocityPoint { q, v, z } = *x;
    let off = |p: &SVector<f64, N>| hamiltonian.with_gradient(time, &PhasePoint { q, p: *p, z }).1.y - v;
    let size = |x: &SVector<f64, N>| max_abs_or_nan(x.iter().copied());
    let matrix = |p: &SVector<f64, N>| hamiltonian.hessian(time, &PhasePoint { q, p: *p, z }).vv;
    let solve = |p: &SVector<f64, N>, mut b: SVector<f64, N>| {
        linear::solve(&mut matrix(p), &mut b).map_err(|e| NoMomentum::Singular { pivot: e.pivot })?;
        Ok(b)
    };
    let mut p = SVector::<f64, N>::zeros();
    let mut residual = off(&p);
    let mut converged = size(&residual) == 0.0;
    for _ in 0..MAX_ITERATIONS {
        if converged {
            break;
        }
        let before = size(&residual);
        if !before.is_finite() {
            return Err(NoMomentum::NotConverged { residual: before });
        }
        let mut change = solve(&p, residual)?;
        let from = p;
        p = from - change;
        residual = off(&p);
        // Written so that a NaN shortens the correction.
        for _ in 0..f64::MANTISSA_DIGITS {
            if size(&residual) < before || size(&change) <= 4.0 * f64::EPSILON * size(&from) {
                break;
            }
            change *= 0.5;
            p = from - change;
            residual = off(&p);
        }
        let round_off = 4.0 * f64::EPSILON * size(&p);
        converged = size(&change) <= round_off || size(&residual) == 0.0;
    }
    if !converged {
        return Err(NoMomentum::NotConverged { residual: size(&residual) });
    }
    Ok(PhasePoint { q, p, z })
}

/// The momentum over a scalar with differentials, from its real part: corrections by `H_pp^-1` until the residual
/// `H_p - v`, given as a function of the momentum, vanishes with its differentials.
pub(super) fn lift<H: ContactHamiltonian<N> + ?Sized, T: Scalar, const N: usize>(
    hamiltonian: &H,
    t: f64,
    at: &PhasePoint<N>,
    residual: impl Fn(&SVector<T, N>) -> SVector<T, N>,
) -> Result<SVector<T, N>, NoMomentum> {
    let inverse = inverse(hamiltonian, t, at)?;
    let mut lifted = at.p.map(T::from);
    for _ in 0..MAX_CORRECTIONS {
        let residual = residual(&lifted);
        let change =
            SVector::<T, N>::from_fn(|i, _| (0..N).fold(T::zero(), |sum, j| sum + residual[j] * inverse[(i, j)]));
        let largest = max_abs_or_nan(change.iter().map(|e| e.extent()));
        lifted -= change;
        if largest <= 4.0 * f64::EPSILON * max_abs_or_nan(lifted.iter().map(|e| e.extent())) {
            break;
        }
    }
    Ok(lifted)
}

/// The inverse of `H_pp`.
fn inverse<H: ContactHamiltonian<N> + ?Sized, const N: usize>(
    hamiltonian: &H,
    t: f64,
    at: &PhasePoint<N>,
) -> Result<SMatrix<f64, N, N>, NoMomentum> {
    let w = hamiltonian.hessian(t, at).vv;
    let mut inverse = SMatrix::<f64, N, N>::zeros();
    for j in 0..N {
        let mut unit = SVector::<f64, N>::from_fn(|i, _| f64::from(u8::from(i == j)));
        linear::solve(&mut w.clone_owned(), &mut unit).map_err(|e| NoMomentum::Singular { pivot: e.pivot })?;
        inverse.set_column(j, &unit);
    }
    Ok(inverse)
}
