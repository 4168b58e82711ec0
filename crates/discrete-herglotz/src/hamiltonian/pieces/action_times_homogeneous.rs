//! Pieces z T(p) with a homogeneous T.

use super::ContactPiece;
use crate::hamiltonian::ContactIncrement;
use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, HamiltonianDerivatives, PhasePoint, Scalar};

/// The piece `H = z T(p)`, where T is homogeneous of degree k: `p . T_p = k T`. It is given as a contact Hamiltonian
/// `T(p)` with its degree.
///
/// Along the flow `p' = -T p`, hence `T' = -k T^2`, `T = T0/u` with `u = 1 + k T0 tau`, and `z T_p` is constant:
///
/// `q1 = q0 + tau z0 T_p(p0)`, `p1 = u^(-1/k) p0`, `z1 = u^(1 - 1/k) z0`, `sigma = u^(-1/k)`, as long as u is positive.
///
/// For `k = 0` the powers are `p1 = e^(-T0 tau) p0`, `z1 = e^(-T0 tau) z0`. For `k = 1` it is a prolonged flow, and z
/// is constant.
#[derive(Clone, Copy, Debug)]
pub struct ActionTimesHomogeneous<H> {
    /// T, which depends on p alone.
    pub momentum_function: H,
    /// k.
    pub degree: f64,
}

impl<H: ContactHamiltonian<N>, const N: usize> ContactHamiltonian<N> for ActionTimesHomogeneous<H> {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        z * self.momentum_function.value(t, q, p, z)
    }
}

impl<H: ContactHamiltonian<N>, const N: usize> ContactPiece<N> for ActionTimesHomogeneous<H> {
    type Map = f64;

    fn over(&self, tau: f64) -> f64 {
        tau
    }

    fn change<T: Scalar>(&self, tau: &f64, t: f64, x: &PhasePoint<N, T>) -> ContactIncrement<N, T> {
        let (value, d) = self.momentum_function.with_gradient(T::from(t), x);
        let (k, advance) = (self.degree, value * *tau);
        if (advance * k).re() <= -1.0 {
            return ContactIncrement::undefined();
        }
        // `ln(u)/k`.
        let log = if k == 0.0 { advance } else { (advance * k).ln_1p() / k };
        let decay = (-log).exp_m1();
        ContactIncrement {
            q: d.y.map(|e| e * x.z * *tau),
            p: x.p.map(|e| e * decay),
            z: x.z * (log * (k - 1.0)).exp_m1(),
            sigma_minus_one: decay,
        }
    }
}
