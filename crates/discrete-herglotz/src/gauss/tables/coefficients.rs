//! Coefficients of Gauss collocation, in double-double precision.

use crate::numbers::double_double::ExactRow;
use crate::numbers::instructions::Instructions;
use contact_geom::support::legendre_polynomials;
use num_traits::{One, Zero};
use pulp::{Simd, WithSimd};
use qd::Quad;
use std::array::from_fn;
use std::sync::OnceLock;

pub(crate) use crate::numbers::registers::MAX_STAGES;

/// The coefficients of Gauss collocation with `s` stages on `[0, 1]`.
///
/// They are computed in twice the working precision, since the coefficients of a run are derived from them once, and
/// their round-off acts in the same direction in every step: see Hairer, McLachlan and Razakarivony, "Achieving
/// Brouwer's law with implicit Runge-Kutta methods", BIT 48 (2008).
pub(crate) struct Coefficients {
    /// The nodes.
    pub c: [Quad; MAX_STAGES],
    /// The weights.
    pub b: [Quad; MAX_STAGES],
    /// The Butcher matrix: the integrals of the Lagrange polynomials from 0 to each node.
    pub a: [[Quad; MAX_STAGES]; MAX_STAGES],
    /// The matrix that extrapolates values at the nodes of a step to the nodes of the next step by the interpolation
    /// polynomial: `[i][j]` for node i of the next step.
    pub extrapolation: [[f64; MAX_STAGES]; MAX_STAGES],
    /// The weights of the stages in the last two Legendre coefficients of the polynomial through them: of
    /// `P_(s-1)(2 x - 1)` and, for s > 1, of `P_(s-2)(2 x - 1)`.
    pub last: [[f64; MAX_STAGES]; 2],
    /// The weights of the stages in the Legendre series of the polynomial through them: `[j][k]` for stage j and degree
    /// k.
    pub series: [[f64; MAX_STAGES]; MAX_STAGES],
    /// The values of the Lagrange polynomials of the nodes at the start and at the end of the step.
    pub ends: [[f64; MAX_STAGES]; 2],
}

/// The number of Legendre polynomials that suffices for any number of stages.
pub(crate) use crate::integration::dense_step::POLYNOMIALS;

impl Coefficients {
    /// The coefficients for a number of stages from 1 to 16, computed once.
    pub fn of(s: usize) -> &'static Coefficients {
        static TABLES: [OnceLock<Box<Coefficients>>; MAX_STAGES] = [const { OnceLock::new() }; MAX_STAGES];
        TABLES[s.clamp(1, MAX_STAGES) - 1].get_or_init(|| Box::new(Self::new(s.clamp(1, MAX_STAGES))))
    }

    fn new(s: usize) -> Self {
        Instructions::new().dispatch(Make { s })
    }
}

/// Computes the coefficients, for all nodes or columns at once in SIMD lanes, since a program waits for them before its
/// first step.
struct Make {
    s: usize,
}

/// One number for each node.
type Row = ExactRow<MAX_STAGES>;

/// The values of the Legendre polynomials of degree 0 to s at points; the rows of higher degree are zero.
#[inline(always)]
fn legendre_rows(s: usize, x: &Row) -> [Row; POLYNOMIALS] {
    let mut rows = [Row::ZERO; POLYNOMIALS];
    rows[0] = Row::from_fn(|_| Quad::one());
    rows[1] = *x;
    for k in 1..s {
        let below = Quad::from((k + 1) as f64);
        let (before, last) = (rows[k - 1], rows[k]);
        rows[k + 1].add(odd(k) / below, &last.times(x));
        rows[k + 1].add(-Quad::from(k as f64) / below, &before);
    }
    rows
}

fn odd(k: usize) -> Quad {
    Quad::from((2 * k + 1) as f64)
}

impl WithSimd for Make {
    type Output = Coefficients;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Coefficients {
        let s = self.s;
        let (one, half, n) = (Quad::one(), Quad::from(0.5), s as f64);
        let slope = |x: f64, [below, p]: [f64; 2]| n * (x * p - below) / (x * x - 1.0);
        let guess = |i: usize| {
            if i >= s {
                return Quad::zero();
            }
            // Tricomi's approximation, then Newton's method to the round-off of `f64`.
            let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            for _ in 0..5 {
                let p = legendre_polynomials::<f64, POLYNOMIALS>(s, x);
                x -= p[s] / slope(x, [p[s - 1], p[s]]);
            }
            Quad::from(x)
        };
        let mut nodes = Row::from_fn(guess);
        // Newton corrections in double-double precision. A slope with the digits of `f64` suffices, since each
        // correction squares the error.
        for _ in 0..2 {
            let p = legendre_rows(s, &nodes);
            let corrected = |i: usize| {
                let (x, p, below) = (nodes.at(i), p[s].at(i), p[s - 1].at(i));
                if i < s { x - Quad::from(p.0 / slope(x.0, [below.0, p.0])) } else { x }
            };
            nodes = Row::from_fn(corrected);
        }
        let at = legendre_rows(s, &nodes);
        let c = Row::from_fn(|i| (nodes.at(i) + one) * half);
        let b = Row::from_fn(|j| {
            let (x, below) = (nodes.at(j), Quad::from(n) * at[s - 1].at(j));
            if j < s { (one - x * x) / (below * below) } else { Quad::zero() }
        });
        // The Lagrange polynomial of node j is b_j sum (2k+1) P_k(x_j) P_k, and the integral of P_k is a multiple of
        // P_(k+1) - P_(k-1).
        let a = from_fn(|i| {
            if i >= s {
                return [Quad::zero(); MAX_STAGES];
            }
            let mut row = Row::from_fn(|_| c.at(i));
            for k in 1..s {
                row.add(half * (at[k + 1].at(i) - at[k - 1].at(i)), &at[k]);
            }
            let row = b.times(&row);
            from_fn(|j| row.at(j))
        });
        // The values of the Lagrange polynomials at a point, from those of the Legendre polynomials there.
        let values = |p: &dyn Fn(usize) -> Quad| -> [f64; MAX_STAGES] {
            let mut row = Row::ZERO;
            for (k, at) in at.iter().enumerate().take(s) {
                row.add(odd(k) * p(k), at);
            }
            let row = b.times(&row);
            from_fn(|j| row.at(j).0)
        };
        let beyond = legendre_rows(s, &Row::from_fn(|i| nodes.at(i) + one + one));
        let extrapolation = from_fn(|i| if i < s { values(&|k| beyond[k].at(i)) } else { [0.0; MAX_STAGES] });
        // Gauss quadrature of products with the Legendre polynomials is exact.
        let last = from_fn(|i| {
            let k = (s - 1).saturating_sub(i);
            from_fn(|j| (odd(k) * b.at(j) * at[k].at(j)).0)
        });
        let series = from_fn(|j| from_fn(|k| if j.max(k) < s { (odd(k) * b.at(j) * at[k].at(j)).0 } else { 0.0 }));
        // P_k(-1) = (-1)^k and P_k(1) = 1.
        let ends = [-one, one].map(|end| values(&|k| if k % 2 == 0 { one } else { end }));
        Coefficients { c: from_fn(|i| c.at(i)), b: from_fn(|j| b.at(j)), a, extrapolation, last, series, ends }
    }
}

/// The values of the Lagrange polynomials of the nodes at points of `[0, 1]`, and their integrals from 0: `[i][j]` for
/// point i and node j.
pub(crate) fn lagrange_rows(s: usize, points: &[f64; MAX_STAGES]) -> [[[f64; MAX_STAGES]; MAX_STAGES]; 2] {
    Instructions::new().dispatch(Lagrange { s, points })
}

struct Lagrange<'a> {
    s: usize,
    points: &'a [f64; MAX_STAGES],
}

impl WithSimd for Lagrange<'_> {
    type Output = [[[f64; MAX_STAGES]; MAX_STAGES]; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let Lagrange { s, points } = self;
        let g = Coefficients::of(s);
        let at = legendre_rows(s, &Row::from_fn(|j| Quad::from(2.0 * g.c[j].0 - 1.0)));
        let p = legendre_rows(s, &Row::from_fn(|i| Quad::from(2.0 * points[i] - 1.0)));
        let mut rows = [[[0.0; MAX_STAGES]; MAX_STAGES]; 2];
        for (i, x) in points.iter().enumerate() {
            let p = |k: usize| p[k].at(i).0;
            let (mut value, mut rest) = ([0.0; MAX_STAGES], [0.0; MAX_STAGES]);
            for (k, at) in at.iter().enumerate().take(s) {
                let (factor, of_integral) = ((2 * k + 1) as f64 * p(k), if k > 0 { p(k + 1) - p(k - 1) } else { 0.0 });
                for j in 0..s {
                    value[j] += factor * at.at(j).0;
                    rest[j] += of_integral * at.at(j).0;
                }
            }
            for j in 0..s {
                rows[0][i][j] = g.b[j].0 * value[j];
                rows[1][i][j] = g.b[j].0 * (x + 0.5 * rest[j]);
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Polynomials of degree `s - 1` are interpolated and integrated exactly, to round-off times the size of the
    /// entries.
    #[test]
    fn between_the_nodes() {
        let points: [f64; MAX_STAGES] = from_fn(|i| (0.37 + 0.618 * i as f64).fract());
        for s in 1..=MAX_STAGES {
            let (g, [value, integral]) = (Coefficients::of(s), lagrange_rows(s, &points));
            let degree = s as i32 - 1;
            for (i, x) in points.iter().enumerate() {
                let apply = |row: &[f64; MAX_STAGES]| -> (f64, f64) {
                    let terms = (0..s).map(|j| row[j] * g.c[j].0.powi(degree));
                    (terms.clone().sum(), terms.map(f64::abs).sum())
                };
                let ((value, size), (integral, size_of)) = (apply(&value[i]), apply(&integral[i]));
                assert!((value - x.powi(degree)).abs() <= 64.0 * f64::EPSILON * (size + 1.0), "s = {s}, {x}");
                let exact = x.powi(s as i32) / s as f64;
                assert!((integral - exact).abs() <= 64.0 * f64::EPSILON * (size_of + 1.0), "s = {s}, {x}");
                // x^(s-1) at the ends 0 and 1.
                let ends = g.ends.map(|row| apply(&row));
                let at_start = if degree == 0 { 1.0 } else { 0.0 };
                for ((end, size), expected) in ends.into_iter().zip([at_start, 1.0]) {
                    assert!((end - expected).abs() <= 64.0 * f64::EPSILON * (size + 1.0), "s = {s}");
                }
                // The coefficient of P_(s-1)(2x - 1) in x^(s-1) is the reciprocal of that polynomial's leading
                // coefficient.
                let last: f64 = (0..s).map(|j| g.last[0][j] * g.c[j].0.powi(degree)).sum();
                let central = (1..s).fold(1.0, |b, k| b * (s - 1 + k) as f64 / k as f64);
                assert!((last * central - 1.0).abs() <= 1e-15 * central * s as f64, "s = {s}: {last}");
            }
        }
    }

    /// The weights integrate polynomials up to degree `2s - 1`, the rows of the Butcher matrix those up to degree
    /// `s - 1`, and the coefficients are symplectic, `b_i a_ij + b_j a_ji = b_i b_j`: all to double-double round-off,
    /// 1e-30 for a sum of up to sixteen terms.
    #[test]
    fn the_coefficients_are_those_of_gauss() {
        let power = |x: Quad, k: usize| (0..k).fold(Quad::one(), |p, _| p * x);
        let small = |x: Quad| x.0.abs() < 1e-30;
        for s in 1..=MAX_STAGES {
            let g = Coefficients::of(s);
            for k in 0..2 * s {
                let sum = (0..s).fold(Quad::zero(), |sum, j| sum + g.b[j] * power(g.c[j], k));
                assert!(small(sum - Quad::one() / Quad::from((k + 1) as f64)), "s = {s}, degree {k}");
            }
            for (i, k) in (0..s).flat_map(|i| (0..s).map(move |k| (i, k))) {
                let sum = (0..s).fold(Quad::zero(), |sum, j| sum + g.a[i][j] * power(g.c[j], k));
                assert!(small(sum - power(g.c[i], k + 1) / Quad::from((k + 1) as f64)), "s = {s}, row {i}, degree {k}");
                assert!(small(g.b[i] * g.a[i][k] + g.b[k] * g.a[k][i] - g.b[i] * g.b[k]), "s = {s}: {i}, {k}");
            }
        }
    }

    /// Polynomials of degree `s - 1` are extrapolated exactly, to round-off times the size of the matrix entries.
    #[test]
    fn extrapolation_is_that_of_the_polynomial() {
        for s in 1..=MAX_STAGES {
            let g = Coefficients::of(s);
            for i in 0..s {
                let size: f64 = g.extrapolation[i].iter().map(|e| e.abs()).sum();
                let sum: f64 = (0..s).map(|j| g.extrapolation[i][j] * g.c[j].0.powi(s as i32 - 1)).sum();
                let expected = (1.0 + g.c[i].0).powi(s as i32 - 1);
                assert!((sum - expected).abs() <= 4.0 * f64::EPSILON * (size + expected), "s = {s}, node {i}");
            }
        }
    }
}
