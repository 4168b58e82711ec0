//! A kink of the force, written in several ways.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// How the Lagrangian of a spring that acts only for `q > 0` is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum How {
    /// `max(0, q)^2`.
    Max,
    /// `if_less` with two values.
    Select,
    /// `(q + |q|)^2 / 4`.
    Abs,
    /// `if` on the value of q.
    Branch,
}

/// `v^2/2 - 2 max(0, q)^2 + 0.3 q - 0.1 z`: a mass that falls onto a spring. The force is continuous with a kink.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OneSided {
    pub how: How,
    pub claims: Structure,
}

impl Lagrangian<1> for OneSided {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let (q, zero) = (q[0], T::zero());
        let square = match self.how {
            How::Max => q.max(zero).powi(2),
            How::Select => zero.if_less(q, q * q, zero),
            How::Abs => (q + q.abs()).powi(2) * 0.25,
            How::Branch => {
                if q.re() > 0.0 {
                    q * q
                } else {
                    zero
                }
            }
        };
        v[0] * v[0] * 0.5 - square * 2.0 + q * 0.3 - z * 0.1
    }
    fn structure(&self) -> Structure {
        self.claims
    }
}
