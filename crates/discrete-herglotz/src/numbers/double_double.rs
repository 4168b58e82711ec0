//! Double-double arithmetic on rows of numbers, in SIMD lanes with fused multiply-add.

use crate::numbers::compensated::{exact_sum, lost_in_product, product_plus};
use crate::numbers::instructions::Instructions;
use pulp::{Simd, WithSimd};
use qd::Quad;

/// A row of double-double numbers; heads and tails are stored separately, so that both fill SIMD registers.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct ExactRow<const W: usize> {
    head: [f64; W],
    tail: [f64; W],
}

/// Renormalises `head + tail` by Dekker's FastTwoSum; the head must be the larger.
#[inline(always)]
fn renormalised(head: f64, tail: f64) -> (f64, f64) {
    let sum = head + tail;
    (sum, tail - (sum - head))
}

/// `sum + factor x` to double-double round-off, unless the terms cancel.
#[inline(always)]
fn sum_of_product(sum: (f64, f64), factor: Quad, x: (f64, f64)) -> (f64, f64) {
    let product = factor.0 * x.0;
    let lost = lost_in_product(factor.0, x.0, product);
    let (head, rounding) = exact_sum(sum.0, product);
    renormalised(head, (sum.1 + rounding) + product_plus(factor.1, x.0, product_plus(factor.0, x.1, lost)))
}

impl<const W: usize> ExactRow<W> {
    pub const ZERO: Self = ExactRow { head: [0.0; W], tail: [0.0; W] };

    #[inline(always)]
    pub fn from_fn(f: impl Fn(usize) -> Quad) -> Self {
        let mut row = Self::ZERO;
        for j in 0..W {
            Quad(row.head[j], row.tail[j]) = f(j);
        }
        row
    }

    #[inline(always)]
    pub fn at(&self, j: usize) -> Quad {
        Quad(self.head[j], self.tail[j])
    }

    /// `self += factor x`.
    #[inline(always)]
    pub fn add(&mut self, factor: Quad, x: &Self) {
        for j in 0..W {
            (self.head[j], self.tail[j]) = sum_of_product((self.head[j], self.tail[j]), factor, (x.head[j], x.tail[j]));
        }
    }

    /// The entrywise product with another row.
    #[inline(always)]
    pub fn times(&self, x: &Self) -> Self {
        let mut row = Self::ZERO;
        for j in 0..W {
            (row.head[j], row.tail[j]) =
                sum_of_product((0.0, 0.0), Quad(self.head[j], self.tail[j]), (x.head[j], x.tail[j]));
        }
        row
    }
}

/// Solves `M X = R` in double-double precision, by Gauss-Jordan elimination with row pivoting. Each row has the `n`
/// entries of M followed by those of R, which are replaced by the solution. `false` if M is singular.
pub(crate) fn solve_exactly(rows: &mut [Vec<Quad>]) -> bool {
    let width = rows.first().map_or(0, Vec::len);
    let mut parts: Vec<f64> = Vec::with_capacity(2 * width * rows.len());
    for row in rows.iter() {
        parts.extend(row.iter().map(|e| e.0));
        parts.extend(row.iter().map(|e| e.1));
    }
    let regular = Instructions::new().dispatch(Eliminate { parts: &mut parts, width });
    for (row, parts) in rows.iter_mut().zip(parts.chunks_exact(2 * width)) {
        let (head, tail) = parts.split_at(width);
        row.iter_mut().zip(head.iter().zip(tail)).for_each(|(e, (head, tail))| *e = Quad(*head, *tail));
    }
    regular
}

/// The kernel of the elimination, on rows of `width` heads followed by as many tails.
struct Eliminate<'a> {
    parts: &'a mut [f64],
    width: usize,
}

impl WithSimd for Eliminate<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> bool {
        let Eliminate { parts, width } = self;
        if width == 0 {
            return true;
        }
        let n = parts.len() / (2 * width);
        let at = |parts: &[f64], i: usize, j: usize| Quad(parts[2 * width * i + j], parts[2 * width * i + width + j]);
        let mut above = vec![0.0; 2 * width];
        for k in 0..n {
            let pivot =
                (k..n).max_by(|i, j| at(parts, *i, k).0.abs().total_cmp(&at(parts, *j, k).0.abs())).unwrap_or(k);
            if pivot != k {
                (0..2 * width).for_each(|j| parts.swap(2 * width * k + j, 2 * width * pivot + j));
            }
            let entry = at(parts, k, k);
            if !(entry.0.abs() > 0.0 && entry.0.is_finite()) {
                return false;
            }
            let inverse = entry.recip();
            above.copy_from_slice(&parts[2 * width * k..2 * width * (k + 1)]);
            let (above_head, above_tail) = above.split_at(width);
            for (i, row) in parts.chunks_exact_mut(2 * width).enumerate() {
                let (head, tail) = row.split_at_mut(width);
                // The pivot row is divided by its pivot: factor = 1 / entry - 1.
                let factor = if i == k { inverse - Quad::from(1.0) } else { -(Quad(head[k], tail[k]) * inverse) };
                let row = head[k..].iter_mut().zip(&mut tail[k..]);
                for ((head, tail), x) in row.zip(above_head[k..].iter().zip(&above_tail[k..])) {
                    (*head, *tail) = sum_of_product((*head, *tail), factor, (*x.0, *x.1));
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The solution for a Hilbert matrix of condition 1e7 satisfies its equations to round-off, 1e-32 times the
    /// condition.
    #[test]
    fn systems_are_solved_in_twice_the_precision() {
        let n = 6;
        let hilbert = |i: usize, j: usize| Quad::from(1.0) / Quad::from((i + j + 1) as f64);
        let side = |i: usize| Quad::from(1.0) / Quad::from((3 * i + 7) as f64);
        let mut rows: Vec<Vec<Quad>> =
            (0..n).map(|i| (0..n).map(|j| hilbert(i, j)).chain([side(i)]).collect()).collect();
        assert!(solve_exactly(&mut rows));
        for i in 0..n {
            let sum = (0..n).fold(Quad::from(0.0), |sum, j| sum + hilbert(i, j) * rows[j][n]);
            // The solution has entries of up to 1e4.
            assert!((sum - side(i)).0.abs() <= 1e-26, "{i}: {:e}", (sum - side(i)).0);
        }
        assert!(!solve_exactly(&mut [vec![Quad::from(0.0), Quad::from(1.0)]]));
    }

    #[test]
    fn rows_add_products_to_twice_the_precision() {
        let third = Quad::from(1.0) / Quad::from(3.0);
        let x = ExactRow::<8>::from_fn(|j| third * Quad::from(j as f64 + 1.0));
        let mut sum = x.times(&x);
        sum.add(third, &x);
        for j in 0..8 {
            // ((j+1)^2 + (j+1)) / 9
            let exact = Quad::from(((j + 1) * (j + 2)) as f64) / Quad::from(9.0);
            assert!((sum.at(j) - exact).0.abs() <= 1e-30 * exact.0, "{j}");
        }
    }
}
