//! Local constraints: the code that a user writes for one element.

use crate::potential::vector;
use contact_geom::nalgebra::SVector;
use contact_geom::{Dual, Scalar};

/// A holonomic constraint `c(q; c_e) = 0` on `K` unknowns with `P` parameters: that of a rod, a joint or a slider.
///
/// The function is written once for any number of elements; each element has its own unknowns and parameters. It must
/// be smooth near its zeros, with a gradient that does not vanish there: a distance is given by its square. A
/// [`FIXED`](crate::FIXED) unknown is 0.
///
/// ```
/// use sparse_herglotz::LocalConstraint;
/// use contact_geom::{Scalar, nalgebra::SVector};
/// /// A point of a plane on the parabola `y = c x^2`.
/// struct Parabola;
/// impl LocalConstraint<2, 1> for Parabola {
///     fn value<T: Scalar>(&self, q: &SVector<T, 2>, c: &[T; 1]) -> T {
///         q[1] - q[0] * q[0] * c[0]
///     }
/// }
/// assert_eq!(Parabola.value(&[2.0, 12.0].into(), &[3.0]), 0.0);
/// assert_eq!(Parabola.gradient(&[2.0, 12.0].into(), &[3.0]).as_slice(), [-12.0, 1.0]);
/// ```
pub trait LocalConstraint<const K: usize, const P: usize = 0>: Send + Sync + 'static {
    /// The value `c(q; c_e)`.
    fn value<T: Scalar>(&self, q: &SVector<T, K>, c: &[T; P]) -> T;

    /// The gradient `c_q`, by dual numbers unless the constraint provides it in closed form.
    fn gradient(&self, q: &SVector<f64, K>, c: &[f64; P]) -> SVector<f64, K> {
        let lifted = std::array::from_fn(|i| {
            let mut x = Dual::<f64, SVector<f64, K>>::constant(q[i]);
            x.d[i] = 1.0;
            x
        });
        self.value(&vector(lifted), &c.map(Dual::constant)).d
    }

    /// The second derivative along a velocity, `v.c_qq v`, by dual numbers unless the constraint provides it.
    fn curvature(&self, q: &SVector<f64, K>, v: &SVector<f64, K>, c: &[f64; P]) -> f64 {
        type Once = Dual<f64, SVector<f64, 1>>;
        type Twice = Dual<Once, SVector<Once, 1>>;
        let along = std::array::from_fn(|i| Twice {
            re: Once { re: q[i], d: [v[i]].into() },
            d: [Once::constant(v[i])].into(),
        });
        self.value(&vector(along), &c.map(|c| Twice::constant(Once::constant(c)))).d[0].d[0]
    }
}
