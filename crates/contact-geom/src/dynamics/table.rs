//! Functions of time that are given by samples.

use crate::Scalar;
use std::sync::Arc;
use thiserror::Error;

/// How a [`Table`] continues between its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Interpolation {
    /// Each value holds until the time of the next one, where the function jumps. At that time it has the new value.
    Held,
    /// Straight lines between the samples: the function is continuous, and has kinks at the samples.
    Linear,
    /// The cubic spline through the samples whose third derivative is continuous at the second and at the last but one
    /// ("not a knot"): the parabola through three samples, the line through two. It is twice continuously
    /// differentiable between the first and the last sample, and of fourth order in the distance of the samples.
    Cubic,
}

/// Samples of which no [`Table`] can be made.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TableError {
    /// There are fewer than two samples.
    #[error("the table has {found} samples; it needs at least 2")]
    TooFew {
        /// The number of samples.
        found: usize,
    },
    /// The numbers of times and of values differ.
    #[error("the table has {times} times and {values} values; each time needs one value")]
    Lengths {
        /// The number of times.
        times: usize,
        /// The number of values.
        values: usize,
    },
    /// The times do not increase.
    #[error("the times of the table must increase, but sample {index} at {time} follows one at {before}")]
    Order {
        /// The index of the sample, from 0.
        index: usize,
        /// Its time.
        time: f64,
        /// The time of the sample before it.
        before: f64,
    },
    /// A time or a value is not finite.
    #[error("the {what} of sample {index} of the table is {value}; it must be a finite number")]
    NotFinite {
        /// A time or a value.
        what: &'static str,
        /// The index of the sample, from 0.
        index: usize,
        /// The number.
        value: f64,
    },
    /// The coefficients between two samples are too large for floating-point numbers.
    #[error("the table changes too much between samples {index} and {} for floating-point numbers", index + 1)]
    TooSteep {
        /// The index of the first of the two samples, from 0.
        index: usize,
    },
}

/// A function of time that is given by samples, for all scalars: a measured or a prescribed drive. Before the first
/// sample and after the last one it is constant, with the value of that sample, for every interpolation.
///
/// Steps should end at its [`knots`](Self::knots), where it has kinks or jumps: a Lagrangian or a force with a table
/// names them as its [`breaks`](crate::Lagrangian::breaks). Clones share their samples.
///
/// ```
/// use contact_geom::table::{Interpolation, Table};
/// let ramp = Table::new(&[0.0, 1.0, 3.0], &[0.0, 2.0, 2.0], Interpolation::Linear)?;
/// assert_eq!([-1.0, 0.5, 2.0, 9.0].map(|t: f64| ramp.value(t)), [0.0, 1.0, 2.0, 2.0]);
/// assert_eq!(ramp.derivative(1, 0.5), 2.0);
/// assert!(Table::new(&[0.0, 0.0], &[1.0, 2.0], Interpolation::Held).is_err());
/// # Ok::<(), contact_geom::table::TableError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    interpolation: Interpolation,
    knots: Arc<[f64]>,
    /// The coefficients of the powers of the time since the last knot: before the first knot, in each interval, and
    /// after the last knot.
    pieces: Arc<[[f64; 4]]>,
}

impl Table {
    /// A table of values at increasing times.
    ///
    /// # Errors
    /// See [`TableError`].
    pub fn new(times: &[f64], values: &[f64], interpolation: Interpolation) -> Result<Self, TableError> {
        if times.len() != values.len() {
            return Err(TableError::Lengths { times: times.len(), values: values.len() });
        }
        let ([_, .., last], [first, ..]) = (values, values) else {
            return Err(TableError::TooFew { found: times.len() });
        };
        for (what, numbers) in [("time", times), ("value", values)] {
            if let Some((index, value)) = numbers.iter().enumerate().find(|(_, x)| !x.is_finite()) {
                return Err(TableError::NotFinite { what, index, value: *value });
            }
        }
        for (i, pair) in times.windows(2).enumerate() {
            if let [before, time] = *pair
                && time <= before
            {
                return Err(TableError::Order { index: i + 1, time, before });
            }
        }
        let constant = |value: f64| [value, 0.0, 0.0, 0.0];
        let inner: Vec<[f64; 4]> = match interpolation {
            Interpolation::Held => values.iter().copied().map(constant).collect(),
            Interpolation::Linear => {
                intervals(times, values).map(|Interval { value, slope, .. }| [value, slope, 0.0, 0.0]).collect()
            }
            Interpolation::Cubic => spline(times, values),
        };
        let inner = inner.into_iter().take(times.len() - 1);
        let pieces: Arc<[_]> = std::iter::once(constant(*first)).chain(inner).chain([constant(*last)]).collect();
        if let Some(i) = pieces.iter().position(|piece| piece.iter().any(|c| !c.is_finite())) {
            return Err(TableError::TooSteep { index: i.saturating_sub(1) });
        }
        Ok(Table { interpolation, knots: times.into(), pieces })
    }

    /// The times of the samples, in ascending order.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// How the table continues between its samples.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// The degree of its pieces: the largest order of a derivative that is not 0 everywhere.
    pub fn degree(&self) -> usize {
        match self.interpolation {
            Interpolation::Held => 0,
            Interpolation::Linear => 1,
            Interpolation::Cubic => 3,
        }
    }

    /// The value at a time. At a knot it is that of the piece after it.
    #[inline(always)]
    pub fn value<T: Scalar>(&self, t: T) -> T {
        self.derivative(0, t)
    }

    /// A derivative of the given order at a time: that of the piece, without regard to jumps.
    #[inline(always)]
    pub fn derivative<T: Scalar>(&self, order: usize, t: T) -> T {
        match self.degree().checked_sub(order) {
            None | Some(0) => {
                let [value] = t.piecewise(
                    #[inline(always)]
                    |t| [self.piece(order, t).1[0]],
                );
                value
            }
            Some(1) => {
                let [knot, value, slope] = t.piecewise(
                    #[inline(always)]
                    |t| {
                        let (knot, [value, slope, ..]) = self.piece(order, t);
                        [knot, value, slope]
                    },
                );
                value + (t - knot) * slope
            }
            Some(_) => {
                let [knot, a, b, c, d] = t.piecewise(
                    #[inline(always)]
                    |t| {
                        let (knot, [a, b, c, d]) = self.piece(order, t);
                        [knot, a, b, c, d]
                    },
                );
                let s = t - knot;
                a + s * (b + s * (c + s * d))
            }
        }
    }

    /// The knot before a time, and the coefficients there of a derivative; NaN if the time is NaN.
    fn piece(&self, order: usize, t: f64) -> (f64, [f64; 4]) {
        let after = self.knots.partition_point(|knot| *knot <= t);
        let knot = self.knots.get(after.saturating_sub(1)).copied().unwrap_or(f64::NAN);
        let mut piece = self.pieces.get(after).filter(|_| !t.is_nan()).copied().unwrap_or([f64::NAN; 4]);
        for _ in 0..order {
            let [_, b, c, d] = piece;
            piece = [b, 2.0 * c, 3.0 * d, 0.0];
        }
        (knot, piece)
    }
}

/// An interval between two samples: its length, the value at its start, and the mean slope.
#[derive(Clone, Copy)]
struct Interval {
    length: f64,
    value: f64,
    slope: f64,
}

fn intervals(times: &[f64], values: &[f64]) -> impl Iterator<Item = Interval> {
    times.windows(2).zip(values.windows(2)).map(|(times, values)| {
        let ([t0, t1], [y0, y1]) = (ends(times), ends(values));
        Interval { length: t1 - t0, value: y0, slope: (y1 - y0) / (t1 - t0) }
    })
}

/// The first and the last of some numbers.
fn ends(numbers: &[f64]) -> [f64; 2] {
    [numbers.first(), numbers.last()].map(|x| x.copied().unwrap_or(f64::NAN))
}

/// The coefficients of the cubic spline in each interval. (C. de Boor, "A Practical Guide to Splines", chapter IV.)
fn spline(times: &[f64], values: &[f64]) -> Vec<[f64; 4]> {
    let intervals: Vec<Interval> = intervals(times, values).collect();
    let second = second_derivatives(&intervals);
    let pieces = intervals.iter().zip(second.windows(2)).map(|(interval, second)| {
        let (Interval { length, value, slope }, [from, to]) = (*interval, ends(second));
        [value, slope - length * (2.0 * from + to) / 6.0, 0.5 * from, (to - from) / (6.0 * length)]
    });
    pieces.collect()
}

/// The second derivatives of the cubic spline at the samples. Those at the inner samples satisfy a tridiagonal system
/// with a dominant diagonal, which is solved by elimination without pivoting.
fn second_derivatives(intervals: &[Interval]) -> Vec<f64> {
    let bends = intervals.windows(2).filter_map(|pair| match pair {
        [a, b] => Some((*a, *b)),
        _ => None,
    });
    let bends: Vec<(Interval, Interval)> = bends.collect();
    match bends.as_slice() {
        [] => return vec![0.0; 2],
        [(a, b)] => return vec![2.0 * (b.slope - a.slope) / (a.length + b.length); 3],
        _ => {}
    }
    let last = bends.len() - 1;
    // The rows after elimination: each unknown is `right - upper * next`.
    let mut rows: Vec<(f64, f64)> = Vec::with_capacity(bends.len());
    for (i, (a, b)) in bends.iter().enumerate() {
        let (mut below, mut above) = (a.length, b.length);
        let mut diagonal = 2.0 * (a.length + b.length);
        // The outermost second derivatives are extrapolated from the two next to each.
        if i == 0 {
            diagonal += a.length * (1.0 + a.length / b.length);
            above -= a.length * (a.length / b.length);
            below = 0.0;
        }
        if i == last {
            diagonal += b.length * (1.0 + b.length / a.length);
            below -= b.length * (b.length / a.length);
            above = 0.0;
        }
        let (upper, right) = rows.last().copied().unwrap_or_default();
        let pivot = diagonal - below * upper;
        rows.push((above / pivot, (6.0 * (b.slope - a.slope) - below * right) / pivot));
    }
    let mut second: Vec<f64> = rows.iter().map(|(_, right)| *right).collect();
    let mut next = 0.0;
    for ((upper, _), x) in rows.iter().zip(&mut second).rev() {
        *x -= upper * next;
        next = *x;
    }
    let outer = |near: f64, next: f64, end: f64, beside: f64| near + (near - next) * (end / beside);
    let first = match (bends.first(), second.as_slice()) {
        (Some((a, b)), [near, next, ..]) => outer(*near, *next, a.length, b.length),
        _ => f64::NAN,
    };
    let end = match (bends.last(), second.as_slice()) {
        (Some((a, b)), [.., next, near]) => outer(*near, *next, b.length, a.length),
        _ => f64::NAN,
    };
    std::iter::once(first).chain(second).chain([end]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;
    use nalgebra::SVector;

    fn table(times: &[f64], values: &[f64], interpolation: Interpolation) -> Table {
        Table::new(times, values, interpolation).unwrap()
    }

    /// Times with intervals of different lengths.
    fn times(n: usize, span: f64) -> Vec<f64> {
        let steps: Vec<f64> = (0..n).map(|i| 1.0 + 0.7 * (i as f64 * 2.3).sin()).collect();
        let sum: f64 = steps.iter().sum();
        std::iter::once(0.0)
            .chain(steps.iter().scan(0.0, |t, h| {
                *t += h * span / sum;
                Some(*t)
            }))
            .collect()
    }

    #[test]
    fn values_of_each_interpolation() {
        let (times, values) = ([1.0, 2.0, 4.0], [3.0, -1.0, 5.0]);
        let held = table(&times, &values, Interpolation::Held);
        let at = [0.0, 1.0, 1.9, 2.0, 3.9, 4.0, 9.0];
        assert_eq!(at.map(|t: f64| held.value(t)), [3.0, 3.0, 3.0, -1.0, -1.0, 5.0, 5.0]);
        let linear = table(&times, &values, Interpolation::Linear);
        assert_eq!(
            [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(|t: f64| linear.value(t)),
            [3.0, 3.0, 1.0, -1.0, 2.0, 5.0, 5.0]
        );
        assert_eq!([0.0, 1.5, 3.0, 4.0].map(|t: f64| linear.derivative(1, t)), [0.0, -4.0, 3.0, 0.0]);
        assert_eq!([0.0, 1.5, 4.0].map(|t: f64| linear.derivative(2, t)), [0.0; 3]);
        for interpolation in [Interpolation::Held, Interpolation::Linear, Interpolation::Cubic] {
            let table = table(&times, &values, interpolation);
            assert!(table.value(f64::NAN).is_nan() && table.derivative(1, f64::NAN).is_nan());
            for (t, y) in times.iter().zip(values) {
                assert!((table.value(*t) - y).abs() <= 1e-15, "{interpolation:?}");
            }
            assert_eq!((table.value(-1e300), table.value(1e300)), (3.0, 5.0));
        }
    }

    /// A spline reproduces cubic polynomials, from two samples on those that two, three or four samples determine.
    #[test]
    fn cubics_are_exact() {
        for n in 1..40 {
            let coefficients = [0.7, -1.3, if n > 1 { 0.9 } else { 0.0 }, if n > 2 { -0.4 } else { 0.0 }];
            let of = |t: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
            let times = times(n, 2.0);
            let values: Vec<f64> = times.iter().map(|t| of(*t)).collect();
            let spline = table(&times, &values, Interpolation::Cubic);
            for k in 0..100 {
                let t = f64::from(k) * 0.02;
                assert!((spline.value(t) - of(t)).abs() < 1e-14, "{n} intervals at {t}");
                let slope = coefficients[1] + t * (2.0 * coefficients[2] + t * 3.0 * coefficients[3]);
                assert!((spline.derivative(1, t) - slope).abs() < 1e-12, "{n} intervals at {t}");
            }
        }
    }

    #[test]
    fn splines_are_smooth_and_of_fourth_order() {
        let worst = |n: usize| {
            let times = times(n, 3.0);
            let values: Vec<f64> = times.iter().map(|t| t.sin()).collect();
            let spline = table(&times, &values, Interpolation::Cubic);
            for knot in &times[1..n] {
                let (before, after) = (knot.next_down(), *knot);
                for order in 0..3 {
                    let jump = spline.derivative(order, before) - spline.derivative(order, after);
                    assert!(jump.abs() < 1e-12 * (n as f64).powi(2), "{order}: {jump}");
                }
            }
            (0..3000).map(|k| f64::from(k) * 1e-3).map(|t| (spline.value(t) - t.sin()).abs()).fold(0.0, f64::max)
        };
        let (coarse, fine) = (worst(20), worst(80));
        assert!(coarse < 1e-4 && fine < coarse / 150.0, "{coarse} {fine}");
    }

    /// The derivatives on dual numbers are those of the pieces.
    #[test]
    fn derivatives_are_those_of_dual_numbers() {
        type Twice = Dual<Dual<f64, SVector<f64, 1>>, SVector<Dual<f64, SVector<f64, 1>>, 1>>;
        let times = times(7, 2.0);
        let values: Vec<f64> = times.iter().map(|t| (3.0 * t).cos()).collect();
        for interpolation in [Interpolation::Held, Interpolation::Linear, Interpolation::Cubic] {
            let table = table(&times, &values, interpolation);
            for k in -10..60 {
                let t = f64::from(k) * 0.05;
                let one = SVector::<f64, 1>::new(1.0);
                let moving = Twice { re: Dual { re: t, d: one }, d: SVector::<_, 1>::new(Dual::from(1.0)) };
                let found = table.value(moving);
                let expected = [0, 1, 2].map(|order| table.derivative(order, t));
                let found = [found.re.re, found.re.d[0], found.d[0].d[0]];
                for (a, b) in found.into_iter().zip(expected) {
                    assert!((a - b).abs() <= 1e-13 * (1.0 + b.abs()), "{interpolation:?} at {t}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn samples_that_make_no_table() {
        let of = |times: &[f64], values: &[f64]| Table::new(times, values, Interpolation::Cubic).unwrap_err();
        for (times, values, message) in [
            (&[][..], &[][..], "the table has 0 samples; it needs at least 2"),
            (&[0.0], &[1.0], "the table has 1 samples; it needs at least 2"),
            (&[0.0, 1.0], &[1.0], "the table has 2 times and 1 values; each time needs one value"),
            (&[0.0, 1.0, 1.0], &[1.0; 3], "the times of the table must increase, but sample 2 at 1 follows one at 1"),
            (&[0.0, f64::NAN], &[1.0; 2], "the time of sample 1 of the table is NaN; it must be a finite number"),
            (
                &[0.0, 1.0],
                &[1.0, f64::INFINITY],
                "the value of sample 1 of the table is inf; it must be a finite number",
            ),
            (&[0.0, 1.0], &[1e308, -1e308], "the table changes too much between samples 0 and 1 for floating-point"),
            (&[0.0, 1e-300], &[0.0, 1e10], "the table changes too much between samples 0 and 1 for floating-point"),
        ] {
            let error = of(times, values).to_string();
            assert!(error.contains(message), "{error}");
        }
        assert!(Table::new(&[0.0, 1.0], &[1e308, -1e308], Interpolation::Held).is_ok());
    }
}
