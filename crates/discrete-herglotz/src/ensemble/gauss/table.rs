//! The coefficients of the steps of Gauss collocation in lanes.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::gauss::tables::condensed::Condensed;
use crate::numbers::compensated_batch::Pair;
use num_traits::{One, Zero};
use qd::Quad;

/// The coefficients of a step, with high and low parts where their round-off would act in the same direction in every
/// step.
pub(super) struct Table {
    pub s: usize,
    pub b: [[f64; MAX_STAGES]; MAX_STAGES],
    pub b_tail: [[f64; MAX_STAGES]; MAX_STAGES],
    pub u: [Pair; MAX_STAGES],
    pub d: [[f64; MAX_STAGES]; MAX_STAGES],
    pub inverse_rho: [f64; MAX_STAGES],
    pub times: [f64; MAX_STAGES],
    pub first: [[f64; MAX_STAGES]; MAX_STAGES],
    pub end_u: Pair,
    pub end_b: [Pair; MAX_STAGES],
    pub grow: Pair,
    pub end_v: [Pair; MAX_STAGES],
    /// The weights of the last Legendre coefficient of the accelerations.
    pub last: [f64; MAX_STAGES],
}

impl Table {
    pub fn new(condensed: &Condensed) -> Self {
        let pair = |x: Quad| [x.0, x.1];
        let exact = &condensed.exact;
        Table {
            s: condensed.s,
            b: condensed.b.map(|row| row.map(|e| e.0)),
            b_tail: condensed.b.map(|row| row.map(|e| e.1)),
            u: condensed.u.map(pair),
            d: exact.d.map(|row| row.map(|e| e.0)),
            inverse_rho: condensed.inverse_rho.0,
            times: condensed.times.0,
            first: first_iteration_matrix(condensed),
            end_u: pair(exact.end_u),
            end_b: exact.end_b.map(pair),
            grow: pair(exact.grow),
            end_v: exact.end_v.map(pair),
            last: Coefficients::of(condensed.s).last[0],
        }
    }
}

/// The matrix `B` of the first iteration of a step: row i maps the newest known accelerations, those of the stages
/// before i in this step and those from i on in the step before, to the position that the polynomial through them
/// predicts.
fn first_iteration_matrix(condensed: &Condensed) -> [[f64; MAX_STAGES]; MAX_STAGES] {
    let (s, c) = (condensed.s, &Coefficients::of(condensed.s).c);
    let zero = Quad::zero();
    // The distances from the nodes of a step to the nodes of the same step and of the step before, and their
    // reciprocals.
    let (mut apart, mut inverse) = ([[[zero; MAX_STAGES]; MAX_STAGES]; 2], [[[zero; MAX_STAGES]; MAX_STAGES]; 2]);
    for (j, k, before) in (0..2 * s * s).map(|at| (at / 2 % s, at / 2 / s, at % 2)) {
        let distance = c[j] - c[k] + Quad::from(before as f64);
        apart[before][j][k] = distance;
        inverse[before][j][k] = if distance.0 == 0.0 { zero } else { distance.recip() };
    }
    let mut rows = [[0.0; MAX_STAGES]; MAX_STAGES];
    for i in 0..s {
        let before = |k: usize| usize::from(k >= i);
        let mut row = condensed.b[i];
        row[i..].fill(zero);
        let scale: [Quad; MAX_STAGES] = std::array::from_fn(|k| {
            let others = (0..s).filter(|m| *m != k);
            others.fold(Quad::one(), |product, m| match (before(k), before(m)) {
                (0, 1) => product * inverse[1][k][m],
                (1, 0) => -product * inverse[1][m][k],
                _ => product * inverse[0][k][m],
            })
        });
        // The Lagrange polynomials of the nodes k at the nodes j: the product of the distances of j to all nodes except
        // k, divided by the product of those of k to the others.
        for j in i..s {
            let all = (0..s).fold(condensed.b[i][j], |all, m| all * apart[before(m)][j][m]);
            for k in 0..s {
                row[k] += all * inverse[before(k)][j][k] * scale[k];
            }
        }
        rows[i] = row.map(|e| e.0);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// If the accelerations of two consecutive steps lie on one polynomial that the stages of a single step determine,
    /// the first iteration gives the positions to which the iteration converges, up to the round-off of its sums of s
    /// terms and of the coefficients.
    #[test]
    fn the_first_iteration_predicts_polynomials() {
        for (s, h, gamma) in [(1, 0.3, -0.1), (2, 0.7, 0.0), (5, 1.1, -0.2), (10, 1.1, 0.1), (16, 2.0, -1.0)] {
            let condensed = Condensed::new(s, h, gamma).unwrap();
            let (rows, c) = (first_iteration_matrix(&condensed), &Coefficients::of(s).c);
            // The Chebyshev polynomial of degree s - 1 over the two steps, of size one.
            let a = |x: f64| ((s - 1) as f64 * x.acos()).cos();
            for i in 0..s {
                let before = |j: usize| a(if j < i { c[j].0 } else { c[j].0 - 1.0 });
                let (mut predicted, mut position, mut size) = (0.0, 0.0, 0.0);
                for j in 0..s {
                    predicted += rows[i][j] * before(j);
                    position += condensed.b[i][j].0 * a(c[j].0);
                    size += rows[i][j].abs() + condensed.b[i][j].0.abs();
                }
                // The error of the values of the polynomial is `eps s^2`, since its slope is up to s^2.
                let bound = ((s * s) as f64 + 4.0) * f64::EPSILON * size;
                assert!((predicted - position).abs() <= bound, "{s} stages, {i}: {predicted:e} {position:e}");
            }
        }
    }
}
