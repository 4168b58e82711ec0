//! The Herglotz vector field of systems over slices, compiled once for any number of coordinates.

use super::mass_matrix::BLOCK;
use contact_geom::nalgebra::{DMatrix, DVectorViewMut, SVector};
use contact_geom::support::{irregular, linear};
use contact_geom::{Arguments, Dual, GeometryError, Scalar, ScalarSystem, SlicesVisitor, Slopes};
use std::sync::Arc;

/// A number with its derivative along one direction.
type Along = Dual<f64, SVector<f64, 1>>;

/// Writes the acceleration at a point, and returns L and `L_z`: the same numbers, by the same operations, as
/// [`herglotz_rates`](contact_geom::support::herglotz_rates) of a Lagrangian with a closed gradient.
pub(super) struct RatesAt<'x> {
    pub at: Arguments<'x, f64>,
    pub to: &'x mut [f64],
}

impl SlicesVisitor for RatesAt<'_> {
    type Output = Result<(f64, f64), GeometryError>;

    fn visit<F: ScalarSystem + 'static>(self, slices: Arc<F>) -> Self::Output {
        rates(&*slices, self.at, self.to)
    }
}

fn rates(slices: &impl ScalarSystem, at: Arguments<'_, f64>, a: &mut [f64]) -> Result<(f64, f64), GeometryError> {
    let Arguments { t, q, v, z } = at;
    let n = q.len();
    let mut gradient = Gradient::<f64>::new(n);
    let l = gradient.evaluate(slices, at);
    let rate = gradient.component(2 * n);
    // `L_v` with its derivative along the drift `(v, 0, L, 1)`, then with those along the velocities.
    let along = |re: f64, d: f64| Along { re, d: SVector::from([d]) };
    let mut x: Vec<Along> = q.iter().zip(v).map(|(q, v)| along(*q, *v)).collect();
    x.extend(v.iter().map(|v| along(*v, 0.0)));
    let mut moving = Gradient::<Along>::new(n);
    moving.evaluate(slices, Arguments { t: along(t, 1.0), q: &x[..n], v: &x[n..], z: along(z, l) });
    for (i, a) in a.iter_mut().enumerate() {
        let p = moving.component(n + i);
        *a = gradient.component(i) + p.re * rate - p.d[0];
    }
    let mut w = DMatrix::zeros(n, n);
    if n > BLOCK {
        slices.mass_matrix::<f64, 0>(t, q, v, z, w.as_mut_slice());
    } else {
        x.iter_mut().for_each(|x| x.d[0] = 0.0);
        for j in 0..n {
            x[n + j].d[0] = 1.0;
            moving.evaluate(slices, Arguments { t: t.into(), q: &x[..n], v: &x[n..], z: z.into() });
            x[n + j].d[0] = 0.0;
            for i in 0..n {
                w[(i, j)] = moving.component(n + i).d[0];
            }
        }
    }
    let mut force = vec![0.0; n];
    slices.applied_force::<f64, 0>(t, q, v, z, &mut force);
    a.iter_mut().zip(force).for_each(|(a, force)| *a += force);
    linear::solve(&mut w, &mut DVectorViewMut::from_slice(a, n)).map_err(irregular)?;
    Ok((l, rate))
}

/// The gradient of a system over slices, in the order `L_q`, `L_v`, `L_z`.
struct Gradient<T> {
    n: usize,
    all: Vec<T>,
}

impl<T: Scalar> Gradient<T> {
    fn new(n: usize) -> Self {
        Gradient { n, all: vec![T::zero(); 2 * n + 1] }
    }

    /// Evaluates it, and returns L.
    fn evaluate(&mut self, slices: &impl ScalarSystem, Arguments { t, q, v, z }: Arguments<'_, T>) -> T {
        let (of_q, rest) = self.all.split_at_mut(self.n);
        let (of_v, of_z) = rest.split_at_mut(self.n);
        slices.with_gradient::<T, 0>(t, q, v, z, Slopes { q: of_q, v: of_v, z: &mut of_z[0] })
    }

    /// A component. For few coordinates it is the differential along the coordinate, a sum over all components: NaN where
    /// one of them is not finite.
    fn component(&self, along: usize) -> T {
        let n = self.n;
        if n > BLOCK {
            return self.all[along];
        }
        let term = |k: usize| (if k == along { T::one() } else { T::zero() }) * self.all[k];
        (0..n).fold(term(2 * n), |sum, i| sum + term(i) + term(n + i))
    }
}
