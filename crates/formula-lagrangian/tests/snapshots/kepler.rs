//! A Lagrangian of the coordinates x, y, made from its formula by formula-lagrangian.

use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Lagrangian, Scalar, Structure, VelocityPoint};

/// The Lagrangian with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DampedKepler {
    /// The parameter mu, 1 in the formula.
    pub mu: f64,
    /// The parameter gamma, -0.01 in the formula.
    pub gamma: f64,
}

impl Lagrangian<2> for DampedKepler {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let a2: T = v[0] * v[0];
        let a4: T = v[1] * v[1];
        let a5: T = a2 + a4;
        let a7: T = a5 * 0.5;
        let a10: T = q[0] * q[0];
        let a12: T = q[1] * q[1];
        let a13: T = a10 + a12;
        let a14: T = Scalar::sqrt(a13);
        let a15: T = T::from(self.mu) / a14;
        let a16: T = a7 + a15;
        let a19: T = z * self.gamma;
        let a20: T = a16 + a19;
        a20
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<2, T>) -> Option<ChartVector<2, T>> {
        let a10: T = x.q[0] * x.q[0];
        let a12: T = x.q[1] * x.q[1];
        let a13: T = a10 + a12;
        let a14: T = Scalar::sqrt(a13);
        let a22: T = Scalar::recip(a14);
        let a23: f64 = -self.mu;
        let a24: T = a22 * a23;
        let a25: T = a22 * a24;
        let a27: T = a22 * a25;
        let a29: T = x.q[1] * a27;
        let a31: T = x.q[0] * a27;
        let (l_q, l_v) = (SVector::from([a31, a29]), SVector::from([x.v[0], x.v[1]]));
        Some(ChartVector { x: l_q, y: l_v, z: T::from(self.gamma) })
    }

    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            z_affine: true,
            constant_rate: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}
