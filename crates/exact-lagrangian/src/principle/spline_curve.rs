//! A curve through given nodes.

use crate::principle::Curve;
use contact_geom::GeometryError;
use contact_geom::nalgebra::SVector;
use cubic_splines::{BoundaryCondition, Spline};
use discrete_herglotz::InputError;

/// The cubic spline through points of Q at given times, counted from the curve's start: a [`Curve`] from measured or
/// computed nodes, twice continuously differentiable. Defined between the first time and the last.
#[derive(Clone, Debug)]
pub struct SplineCurve<const N: usize> {
    times: Vec<f64>,
    coordinates: Vec<Spline<f64>>,
}

impl<const N: usize> SplineCurve<N> {
    /// The spline through these points. With the velocities at both ends its error is of order four in the spacing of
    /// the times; without them (`None`) the second derivative is zero at the ends, which reduces the order there by
    /// two.
    ///
    /// # Errors
    /// [`InputError::Count`] for fewer than three nodes; [`InputError::Geometry`] where the numbers of times and points
    /// differ, a number is not finite, or the times do not increase.
    pub fn new(
        times: &[f64],
        points: &[SVector<f64, N>],
        velocities: Option<[SVector<f64, N>; 2]>,
    ) -> Result<Self, InputError> {
        let count = |what, least, found| Err(InputError::Count { what, least, found });
        if times.len() < 3 {
            return count("the number of nodes of a spline", 3, times.len());
        }
        if points.len() != times.len() {
            let (expected, found) = (times.len(), points.len());
            return Err(GeometryError::WrongSize { what: "the list of points", expected, found }.into());
        }
        let finite = |what, index, value: f64| match value.is_finite() {
            true => Ok(()),
            false => Err(GeometryError::NonFinite { what, index, value }),
        };
        for (k, (t, q)) in times.iter().zip(points).enumerate() {
            finite("times", k, *t)?;
            q.iter().try_for_each(|c| finite("points", k, *c))?;
        }
        for velocity in velocities.iter().flatten() {
            velocity.iter().enumerate().try_for_each(|(i, c)| finite("velocities", i, *c))?;
        }
        if times.windows(2).any(|pair| pair[1] <= pair[0]) {
            return Err(GeometryError::Undefined { what: "a spline whose times do not increase" }.into());
        }
        let coordinate = |i: usize| {
            let nodes = times.iter().zip(points).map(|(t, q)| (*t, q[i])).collect();
            let ends = match &velocities {
                Some([first, last]) => BoundaryCondition::Derivatives(first[i], last[i]),
                None => BoundaryCondition::Natural,
            };
            Spline::new(nodes, ends)
        };
        Ok(SplineCurve { times: times.to_vec(), coordinates: (0..N).map(coordinate).collect() })
    }
}

impl<const N: usize> Curve<N> for SplineCurve<N> {
    fn at(&self, s: f64) -> Result<(SVector<f64, N>, SVector<f64, N>), GeometryError> {
        let inside = matches!((self.times.first(), self.times.last()), (Some(a), Some(b)) if (*a..=*b).contains(&s));
        if !inside {
            return Err(GeometryError::Undefined { what: "the spline" });
        }
        let each = |of: fn(&Spline<f64>, f64) -> f64| {
            SVector::<f64, N>::from_iterator(self.coordinates.iter().map(|c| of(c, s)))
        };
        let (q, v) = (each(Spline::eval), each(Spline::eval_derivative));
        // Between nodes near the largest number the spline overflows.
        if !q.iter().chain(v.iter()).all(|c| c.is_finite()) {
            return Err(GeometryError::Undefined { what: "the spline" });
        }
        Ok((q, v))
    }

    fn breaks(&self) -> &[f64] {
        &self.times
    }
}
