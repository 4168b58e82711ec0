//! Dense output of contact Gauss collocation: the collocation polynomial of the last step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::DenseStep;
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::gauss::tables::condensed::Condensed;
use crate::integration::SolvedStages;
use crate::integration::dense_step::Series;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::saved;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Lagrangian, PhasePoint};

/// The state at the start of a step in the variables of the route: y are velocities in the condensed routes, momenta in
/// the general one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepStart<const N: usize> {
    pub q: [f64; N],
    pub y: [f64; N],
    pub z: f64,
}

saved!([const N: usize] StepStart<N> { q, y, z });

impl<const N: usize> StepStart<N> {
    pub const ZERO: Self = StepStart { q: [0.0; N], y: [0.0; N], z: 0.0 };
}

/// The last step of a run: the mass matrix of the condensed routes (`None` in the general route), the time and the state
/// at its start.
#[derive(Clone, Copy)]
pub(crate) struct SolvedStep<'r, const N: usize> {
    pub mass: Option<&'r SMatrix<f64, N, N>>,
    pub t: f64,
    pub from: &'r StepStart<N>,
}

/// The stages of a solved step: V, `rho L_q`, `rho L_z` and L, padded with 0 after the last stage.
pub(crate) struct Solved<const N: usize> {
    pub v: [[f64; MAX_STAGES]; N],
    pub force: [[f64; MAX_STAGES]; N],
    pub rate: [f64; MAX_STAGES],
    pub l: [f64; MAX_STAGES],
}

impl<const N: usize> Solved<N> {
    pub const ZERO: Self = Solved {
        v: [[0.0; MAX_STAGES]; N],
        force: [[0.0; MAX_STAGES]; N],
        rate: [0.0; MAX_STAGES],
        l: [0.0; MAX_STAGES],
    };

    /// The collocation polynomial through these stages.
    pub fn curve(&self, s: usize, t: f64, h: f64, start: PhasePoint<N>) -> DenseStep<N> {
        let series = |values: &[f64; MAX_STAGES]| through(values, s);
        let [v, force] = [&self.v, &self.force].map(|of| of.each_ref().map(series));
        DenseStep::new(s, (t, h), start, [v, force], [series(&self.rate), series(&self.l)])
    }

    /// These stages for the tangent of the step.
    pub fn stages(&self, s: usize, (t, h): (f64, f64), start: PhasePoint<N>) -> SolvedStages<N> {
        let [v, force] = [&self.v, &self.force].map(|of| of.map(Stages));
        SolvedStages { s, t, h, start, v, force, rate: Stages(self.rate), l: Stages(self.l), knows_l: true }
    }

    /// The stages of a condensed step from its accelerations and positions.
    pub fn from_accelerations(
        lagrangian: &impl Lagrangian<N>,
        step: &SolvedStep<'_, N>,
        table: &Condensed,
        [a, x]: [&[[f64; MAX_STAGES]; N]; 2],
        wants_z: bool,
    ) -> Self {
        let SolvedStep { t, from: start, .. } = *step;
        let mass = step.mass.copied().unwrap_or_else(SMatrix::identity);
        let (s, mut solved) = (table.s, Self::ZERO);
        for d in 0..N {
            let v = &mut solved.v[d];
            v.iter_mut().zip(&table.inverse_rho.0).for_each(|(v, inverse)| *v = inverse * start.y[d]);
            for (column, a) in table.d.0.iter().zip(&a[d]).take(s) {
                v.iter_mut().zip(&column.0).for_each(|(v, entry)| *v += entry * a);
            }
            v[s..].fill(0.0);
        }
        for i in 0..s {
            let rho = 1.0 / table.inverse_rho.0[i];
            let force = mass * SVector::from_fn(|d, _| rho * a[d][i]);
            for d in 0..N {
                solved.force[d][i] = force[d];
            }
            solved.rate[i] = rho * table.gamma;
            if wants_z {
                let at = |of: &[[f64; MAX_STAGES]; N]| SVector::from_fn(|d, _| of[d][i]);
                solved.l[i] = lagrangian.value(t + table.times.0[i], &at(x), &at(&solved.v), 0.0);
            }
        }
        if wants_z && table.gamma != 0.0 {
            // So far the values are those of `L - gamma z`; this adds `gamma z`.
            let (actions, values) = (table.actions(), solved.l);
            for i in 0..s {
                solved.l[i] += actions.from_start[i] * start.z;
            }
            for (column, value) in actions.from_values.iter().zip(&values).take(s) {
                solved.l.iter_mut().zip(column).for_each(|(l, entry)| *l += entry * value);
            }
        }
        solved
    }
}

/// The Legendre series of the polynomial through values at the nodes. The Gauss quadrature of its products with the
/// Legendre polynomials is exact.
fn through(values: &[f64; MAX_STAGES], s: usize) -> Series {
    let mut c = [0.0; MAX_STAGES];
    for (row, value) in Coefficients::of(s).series.iter().zip(values).take(s) {
        for (c, entry) in c.iter_mut().zip(row) {
            *c += entry * value;
        }
    }
    Series(c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::chebyshev::node;
    use contact_geom::numbers::max_or_nan;
    use std::array::from_fn;

    /// The states at the nodes agree with those of the curve to a few units of round-off of each term.
    #[test]
    fn a_sketch_is_on_the_curve() {
        for s in 1..=MAX_STAGES {
            let value = |i: usize, seed: f64| (1.3 * i as f64 + seed).sin();
            let stages = |seed: f64| from_fn(|i| if i < s { value(i, seed) } else { 0.0 });
            let mut solved = Solved::<2>::ZERO;
            (solved.v, solved.force) = ([stages(0.1), stages(0.7)], [stages(1.9), stages(2.3)]);
            (solved.rate, solved.l) = (stages(3.1), stages(0.4));
            let curve = solved.curve(s, 0.5, 0.3, PhasePoint::new([1.0, -2.0], [0.4, 0.9], 0.2));
            let mut states = Vec::new();
            curve.states_at_nodes(&mut states);
            assert_eq!(states.len() + 1, curve.sampling_degree());
            for (i, found) in states.iter().enumerate() {
                let at = curve.at_fraction(node(curve.sampling_degree(), i + 1));
                let off =
                    max_or_nan((found.q - at.q).amax(), max_or_nan((found.p - at.p).amax(), (found.z - at.z).abs()));
                assert!(off <= 16.0 * s as f64 * f64::EPSILON, "{s} stages, node {i}: {off:e}");
            }
        }
    }
}
