//! Three parallel cranks on one bar: a closed chain with a redundant constraint.

use super::{length, point, rod};
use contact_geom::constraints::Constraint;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// Three uniform cranks of unit mass and length in a vertical plane, from `(0, 0)`, `(1, 0)` and `(2, 0)` to the pivots
/// `(q0, q1)`, `(q2, q3)` and `(q4, q5)` of one rigid bar, with linear drag. Like the Bricard linkage in space it is
/// overconstrained: six constraints on six coordinates leave one degree of freedom, since two cranks alone determine
/// the motion of the bar. The rank of `c_q` is 5 along the motion in which the cranks are parallel, and falls to 4
/// where they are in line with the bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParallelCranks {
    /// The acceleration of gravity.
    pub gravity: f64,
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl ParallelCranks {
    /// The positions of the pivots for an angle of the cranks.
    pub fn at(angle: f64) -> SVector<f64, 6> {
        let (s, c) = angle.sin_cos();
        SVector::from([c, s, 1.0 + c, s, 2.0 + c, s])
    }
}

impl Lagrangian<6> for ParallelCranks {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 6>, v: &SVector<T, 6>, z: T) -> T {
        let zero = [T::zero(); 2];
        let mut l = z * self.gamma;
        for i in 0..3 {
            l += rod([T::from(i as f64), T::zero()], point(q, i), zero, point(v, i), self.gravity);
        }
        l + rod(point(q, 0), point(q, 2), point(v, 0), point(v, 2), self.gravity)
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

impl Constraint<6, 6> for ParallelCranks {
    fn value<T: Scalar>(&self, q: &SVector<T, 6>) -> SVector<T, 6> {
        let crank = |i: usize| length(point(q, i), [T::from(i as f64), T::zero()], 1.0);
        // The middle pivot is the midpoint of the bar.
        let middle = |k: usize| q[2 + k] - (q[k] + q[4 + k]) * 0.5;
        SVector::from([crank(0), crank(1), crank(2), length(point(q, 0), point(q, 2), 2.0), middle(0), middle(1)])
    }
}
