//! A Lagrangian of the coordinates x, y, made from its formula by formula-lagrangian.

use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, ForceStructure, Hints, Lagrangian, Scalar, Structure, VelocityPoint};

/// The Lagrangian with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForcedSpring {
    /// The parameter c, 0.5 in the formula.
    pub c: f64,
    /// The parameter k, 0.25 in the formula.
    pub k: f64,
}

impl Lagrangian<2> for ForcedSpring {
    const HINTS: Hints = Hints { forced: true, ..Hints::NONE };

    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let a19: T = v[1] * v[1];
        let a25: T = v[0] * v[0];
        let a26: T = a19 + a25;
        let a27: T = a26 * 0.5;
        let a29: T = q[0] * q[0];
        let a30: T = a29 * 0.5;
        let a31: T = a27 - a30;
        let a33: T = z * self.c;
        let a34: T = a31 - a33;
        a34
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<2, T>) -> Option<ChartVector<2, T>> {
        let a1: f64 = -self.c;
        let a43: T = -x.q[0];
        let (l_q, l_v) = (SVector::from([a43, T::from(0.0)]), SVector::from([x.v[0], x.v[1]]));
        Some(ChartVector { x: l_q, y: l_v, z: T::from(a1) })
    }

    fn structure(&self) -> Structure {
        Structure {
            z_affine: true,
            constant_rate: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        }
    }

    #[inline(always)]
    fn applied_force<T: Scalar>(&self, t: T, x: &VelocityPoint<2, T>) -> SVector<T, 2> {
        let a1: f64 = -self.c;
        let a3: T = x.v[0] * a1;
        let a5: T = x.v[0] * self.k;
        let a7: T = hypot(x.v[0], x.v[1]);
        let a8: T = a5 * a7;
        let a9: T = a3 - a8;
        let a11: T = Scalar::cos(t);
        let a13: T = a11 * x.q[1];
        let a14: T = a9 + a13;
        let a15: f64 = self.c * self.k;
        let a22: f64 = -self.k;
        let a23: T = x.v[1] * a22;
        let a24: T = a7 * a23;
        let a37: T = x.v[1] * a15;
        let a39: T = a24 - a37;
        SVector::from([a14, a39])
    }

    fn force_structure(&self) -> ForceStructure<2> {
        let a15: f64 = self.c * self.k;
        ForceStructure::Drag { linear: SVector::from([self.c, a15]), quadratic: self.k }
    }
}

/// `sqrt(x^2 + y^2)` without overflow.
#[inline(always)]
fn hypot<T: Scalar>(x: T, y: T) -> T {
    let (x, y) = (Scalar::abs(x), Scalar::abs(y));
    let (large, small) = (Scalar::max(x, y), Scalar::min(y, x));
    let ratio = small / large;
    let length = large * (ratio * ratio + 1.0).sqrt();
    T::zero().if_less(large, length, large)
}
