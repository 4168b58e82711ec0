//! Chebyshev interpolation of a function on an interval, with bounds that follow from its coefficients.

use std::f64::consts::PI;
use std::sync::OnceLock;

/// The largest degree of an interpolant. A smooth function on a short interval is resolved to round-off by about 16
/// coefficients, and the product with a matrix of this size takes less time than a few evaluations of a motion.
pub(crate) const MAX_DEGREE: usize = 16;

/// The largest number of nodes.
pub(crate) const MAX_NODES: usize = MAX_DEGREE + 1;

/// The number of last coefficients from which the error of an interpolant is estimated: an even or odd function has
/// every second coefficient zero, so that one or two of them could vanish by symmetry.
const LAST_COEFFICIENTS: usize = 3;

/// What interpolation of one degree needs.
struct Table {
    /// The nodes as fractions of the interval, from 0 to 1.
    nodes: [f64; MAX_NODES],
    /// The coefficients of the interpolants that are 1 at one node and 0 at the others.
    cardinal: [[f64; MAX_NODES]; MAX_NODES],
}

impl Table {
    fn of(degree: usize) -> &'static Table {
        static TABLES: [OnceLock<Table>; MAX_DEGREE] = [const { OnceLock::new() }; MAX_DEGREE];
        let n = degree.clamp(1, MAX_DEGREE);
        TABLES[n - 1].get_or_init(|| {
            let mut table = Table { nodes: [0.0; MAX_NODES], cardinal: [[0.0; MAX_NODES]; MAX_NODES] };
            let weight = |k: usize| if k == 0 || k == n { 0.5 } else { 1.0 };
            for j in 0..=n {
                // Symmetric to the last digit: the nodes 0, 1/2 and 1 are exact.
                table.nodes[j] = match (2 * j).cmp(&n) {
                    std::cmp::Ordering::Less => (0.5 * PI * j as f64 / n as f64).sin().powi(2),
                    std::cmp::Ordering::Equal => 0.5,
                    std::cmp::Ordering::Greater => 1.0 - (0.5 * PI * (n - j) as f64 / n as f64).sin().powi(2),
                };
                for k in 0..=n {
                    // `T_k` at the node, whose angle is counted from the end of the interval.
                    let cosine = (PI * ((n - j) * k % (2 * n)) as f64 / n as f64).cos();
                    table.cardinal[j][k] = 2.0 / n as f64 * weight(j) * weight(k) * cosine;
                }
            }
            table
        })
    }
}

/// A node of the Chebyshev-Lobatto grid with `degree + 1` points, as a fraction of the interval. They increase from 0
/// to 1.
pub(crate) fn node(degree: usize, j: usize) -> f64 {
    Table::of(degree).nodes[j.min(degree)]
}

/// The values of a function at the Chebyshev-Lobatto nodes of an interval.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Samples {
    degree: usize,
    values: [f64; MAX_NODES],
}

impl Samples {
    /// The values of a function of the index of the node, in the order of the nodes.
    pub fn new(degree: usize, mut value: impl FnMut(usize) -> f64) -> Self {
        let degree = degree.clamp(1, MAX_DEGREE);
        let mut values = [0.0; MAX_NODES];
        for (j, slot) in values.iter_mut().enumerate().take(degree + 1) {
            *slot = value(j);
        }
        Samples { degree, values }
    }

    /// The values of a function on an interval.
    pub fn on([a, b]: [f64; 2], degree: usize, mut value: impl FnMut(f64) -> f64) -> Self {
        Samples::new(degree, |j| value(if j == degree { b } else { a + node(degree, j) * (b - a) }))
    }

    pub fn degree(&self) -> usize {
        self.degree
    }

    pub fn values(&self) -> &[f64] {
        &self.values[..=self.degree]
    }

    pub fn ends(&self) -> [f64; 2] {
        [self.values[0], self.values[self.degree]]
    }

    pub fn is_finite(&self) -> bool {
        self.values().iter().all(|value| value.is_finite())
    }

    /// Replaces the value at the start of the interval.
    pub fn set_start(&mut self, value: f64) {
        self.values[0] = value;
    }

    /// Replaces the value at the end of the interval.
    pub fn set_end(&mut self, value: f64) {
        self.values[self.degree] = value;
    }

    /// The largest absolute value among those that are finite.
    pub fn size(&self) -> f64 {
        self.values().iter().map(|value| value.abs()).filter(|value| value.is_finite()).fold(0.0, f64::max)
    }

    /// The index of the smallest absolute value.
    pub fn smallest(&self) -> usize {
        (0..=self.degree).min_by(|i, j| self.values[*i].abs().total_cmp(&self.values[*j].abs())).unwrap_or(0)
    }

    /// The interpolant through the values.
    pub fn interpolant(&self) -> Chebyshev {
        let mut c = [0.0; MAX_NODES];
        for (row, value) in Table::of(self.degree).cardinal.iter().zip(self.values()) {
            for (c, entry) in c.iter_mut().zip(row) {
                *c += value * entry;
            }
        }
        let last = c[..=self.degree].iter().rev().take(LAST_COEFFICIENTS);
        // Coefficients that decrease like 1/k^2, as those of a function with a kink, have a sum of this size.
        let error = self.degree as f64 * last.fold(0.0, |most: f64, c| most.max(c.abs()));
        Chebyshev { degree: self.degree, c, error }
    }
}

/// A polynomial in Chebyshev form on `[-1, 1]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chebyshev {
    degree: usize,
    c: [f64; MAX_NODES],
    /// The estimated error, as an approximation of the function through whose values it passes.
    pub error: f64,
}

impl Chebyshev {
    /// A bound for the difference from the mean, without the error.
    fn variation(&self) -> f64 {
        self.c[1..].iter().fold(0.0, |sum, c| sum + c.abs())
    }

    /// Whether the function is larger than `margin` everywhere, up to its sign; false if a value is not finite.
    pub fn exceeds(&self, margin: f64) -> bool {
        self.c[0].abs() > self.variation() + self.error + margin
    }

    /// Whether the function differs from its mean at most by a part of it.
    pub fn is_nearly_constant(&self, part: f64) -> bool {
        self.variation() + self.error <= part * self.c[0].abs()
    }

    /// The derivative. Its error is bounded as for polynomials, by Markov's inequality.
    pub fn derivative(&self) -> Chebyshev {
        let mut c = [0.0; MAX_NODES];
        for k in (1..=self.degree).rev() {
            c[k - 1] = c.get(k + 1).copied().unwrap_or(0.0) + 2.0 * k as f64 * self.c[k];
        }
        c[0] *= 0.5;
        Chebyshev { degree: self.degree - 1, c, error: (self.degree * self.degree) as f64 * self.error }
    }

    /// The value at a fraction of the interval, by Clenshaw's recurrence.
    pub fn at(&self, fraction: f64) -> f64 {
        let x = 2.0 * fraction - 1.0;
        let (mut next, mut after) = (0.0, 0.0);
        for c in self.c[1..=self.degree].iter().rev() {
            (next, after) = (c + 2.0 * x * next - after, next);
        }
        self.c[0] + x * next - after
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The interpolant of a polynomial of its degree is that polynomial, and so are its derivatives, for each degree.
    #[test]
    fn polynomials_are_interpolated_exactly() {
        for degree in 4..=MAX_DEGREE {
            assert_eq!([node(degree, 0), node(degree, degree)], [0.0, 1.0]);
            let samples = Samples::on([-1.0, 1.0], degree, |x| 2.0 + x - 3.0 * x * x + x.powi(4));
            let (p, bound) = (samples.interpolant(), 64.0 * f64::EPSILON);
            let (first, second) = (p.derivative(), p.derivative().derivative());
            for x in [-1.0f64, -0.3, 0.0, 0.7, 1.0] {
                let fraction = 0.5 * (x + 1.0);
                let found = [p.at(fraction), first.at(fraction), second.at(fraction)];
                let expected =
                    [2.0 + x - 3.0 * x * x + x.powi(4), 1.0 - 6.0 * x + 4.0 * x.powi(3), -6.0 + 12.0 * x * x];
                let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // By Markov's inequality, of two derivatives.
                assert!(off <= (degree as f64).powi(4) * f64::EPSILON, "{degree}, {x}: {off:e}");
            }
            assert!(degree < 7 || p.error <= bound, "{degree}: {:e}", p.error);
        }
    }

    /// The bounds hold where the function does not vanish, and fail where it does or is not finite.
    #[test]
    fn a_bound_excludes_zeros() {
        let exceeds = |g: fn(f64) -> f64, margin| Samples::on([0.0, 1.0], 8, g).interpolant().exceeds(margin);
        assert!(exceeds(|x| 2.0 + x, 1.9) && !exceeds(|x| 2.0 + x, 2.1));
        assert!(exceeds(|x| -x.exp(), 0.5) && !exceeds(|x| x.exp() - 1.5, 0.0));
        assert!(!exceeds(|x| if x < 0.5 { 1.0 } else { f64::NAN }, 0.0) && !exceeds(|_| f64::INFINITY, 0.0));
        // A kink: its error is large.
        assert!(exceeds(|x| (x - 0.4).abs() + 2.0, 0.0) && !exceeds(|x| (x - 0.4).abs() - 1e-3, 0.0));
    }
}
