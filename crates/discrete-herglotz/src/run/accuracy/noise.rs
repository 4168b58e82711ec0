//! What rounding keeps in motion at an equilibrium.

use crate::run::request::Request;
use crate::theory::legendre_inverse;
use contact_geom::nalgebra::SVector;
use contact_geom::{
    Derivatives, Lagrangian, PhasePoint, VelocityPoint, numbers::max_abs_or_nan, support::gradient_rounding,
};

/// The displacement of a motion at an equilibrium by the rounding of its forces alone. Forces that cancel there are rounded like the terms
/// that cancel, as in `1 - exp(-x)` beside `x = 0`: however small the motion would become, this much is left of it.
pub(crate) struct Noise {
    /// The displacement of (q, p), in the 2-norm: of each coordinate the rounding of its force over its stiffness, and of each
    /// momentum the same over the frequency.
    pub displacement: f64,
    /// The rounding of the forces themselves.
    pub force: f64,
    /// The energy of the displacement, a square of rounding that is not in the rounding of the energy to first order.
    pub energy: f64,
}

impl Noise {
    /// At a point.
    pub fn at<L: Lagrangian<N>, const N: usize>(lagrangian: &L, t: f64, x: &VelocityPoint<N>) -> Self {
        let (_, of_gradient) = gradient_rounding(lagrangian, t, x);
        let h = lagrangian.hessian(t, x);
        let (mut squares, mut energy) = (0.0, 0.0);
        for i in 0..N {
            let (force, stiffness, mass) = (of_gradient.x[i], h.qq[(i, i)].abs(), h.vv[(i, i)].abs());
            // A force without stiffness, or a mass of nothing, says nothing.
            if stiffness > 0.0 && mass > 0.0 {
                let squared = force * force / stiffness;
                squares += squared / stiffness + squared * mass;
                energy += squared;
            }
        }
        Noise { displacement: squares.sqrt(), force: max_abs_or_nan(of_gradient.x.iter().copied()), energy }
    }
}

/// The part of its largest size so far below which a motion may be at the rounding of its forces.
pub(crate) const DECAYED: f64 = 1e-3;

/// How many times the noise of one force those of all steps may be: they add up at random, and are damped.
pub(crate) fn all_together(steps: usize) -> f64 {
    (64.0 + steps as f64).sqrt() * 8.0
}

impl<L: Lagrangian<N>, const N: usize> Request<'_, L, N> {
    /// At a state of the motion.
    #[cold]
    #[inline(never)]
    pub(crate) fn noise(&self, t: f64, state: &PhasePoint<N>) -> Noise {
        let lagrangian = self.problem.lagrangian;
        let still = VelocityPoint { q: state.q, v: SVector::zeros(), z: state.z };
        Noise::at(lagrangian, t, &legendre_inverse(lagrangian, t, state, &still.v).unwrap_or(still))
    }
}
