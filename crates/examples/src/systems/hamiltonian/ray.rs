//! Rays of light.

use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar};

/// A medium by its index of refraction n, with rays in closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Medium<const N: usize> {
    /// `n^2 = constant + gradient . q`: the rays are parabolas.
    LinearSquare {
        /// The square of the index at the origin.
        constant: f64,
        /// The gradient of the square.
        gradient: SVector<f64, N>,
    },
    /// `n = 1/(slope q_N)` for `q_N > 0`, a speed of light that is linear in the last coordinate: the rays are circles,
    /// the geodesics of the hyperbolic half-space.
    LinearSpeed {
        /// The slope of the speed.
        slope: f64,
    },
    /// `n^2 = axis^2 (1 - alpha^2 r^2)` with the distance r from the first axis, a lens with a graded index: the rays
    /// oscillate about the axis, as functions of the parameter tau with `dq/dtau = p`.
    Graded {
        /// The index on the axis.
        axis: f64,
        /// The constant alpha.
        alpha: f64,
    },
    /// `n = centre/(1 + |q|^2/radius^2)`, Maxwell's fish eye: the rays are circles, and those from q all meet at
    /// `-radius^2 q/|q|^2`.
    FishEye {
        /// The index at the origin.
        centre: f64,
        /// The radius.
        radius: f64,
    },
}

impl<const N: usize> Medium<N> {
    /// The index of refraction.
    #[inline(always)]
    pub fn index<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        match self {
            Medium::LinearSquare { constant, gradient } => {
                (0..N).fold(T::from(*constant), |sum, i| sum + q[i] * gradient[i]).sqrt()
            }
            Medium::LinearSpeed { slope } => (q[N - 1] * *slope).recip(),
            Medium::Graded { axis, alpha } => {
                let r = (1..N).fold(T::zero(), |sum, i| sum + q[i] * q[i]);
                (-r * (alpha * alpha) + 1.0).sqrt() * *axis
            }
            Medium::FishEye { centre, radius } => (dot(q, q) / (radius * radius) + 1.0).recip() * *centre,
        }
    }
}

/// A ray of light in a medium of index n(q): the contact Hamiltonian `H = |p|/n(q)`, homogeneous of degree one in the
/// momentum, the direction of the wave front. Time is the optical length, in units of the length.
///
/// `q' = p/(|p| n)`, `p' = |p| grad n/n^2`, `z' = p . H_p - H = 0`: Hamilton's equations of a front, whose contact
/// elements `(q, [p])` move by a contact flow (Huygens' principle), with z as a constant phase. `H_pp` has the rank
/// N - 1, so there is no regular Lagrangian. The momentum must not be 0; [`start`](Self::start) has `|p| = n`, so that
/// `H = 1`. Born and Wolf, "Principles of Optics", 3.2 and 4.2; Arnold, "Mathematical Methods of Classical Mechanics",
/// appendix 4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray<const N: usize> {
    /// The medium.
    pub medium: Medium<N>,
}

impl<const N: usize> Ray<N> {
    /// The state at a point with a direction, which need not have the length 1 but must not be 0: `|p| = n`.
    pub fn start(&self, q: SVector<f64, N>, direction: SVector<f64, N>) -> PhasePoint<N> {
        let p = direction * (self.medium.index(&q) / direction.norm());
        PhasePoint { q, p, z: 0.0 }
    }
}

impl<const N: usize> ContactHamiltonian<N> for Ray<N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, p: &SVector<T, N>, _z: T) -> T {
        dot(p, p).sqrt() / self.medium.index(q)
    }

    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure {
            autonomous: true,
            z_free: true,
            z_affine: true,
            constant_rate: true,
            separable: false,
            degree: None,
            homogeneous: true,
        }
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<const N: usize> contact_geom::ParametricHamiltonian<N> for Ray<N> {}
