//! The solved stages of a step, and its collocation polynomial.

use crate::gauss::stages::stage_values::CondensedStages;
use crate::gauss::system::CollocationSystem;
use crate::gauss::tables::coefficients::Coefficients;
use crate::gauss::tables::condensed::Condensed;
use crate::integration::SolvedStages;
use crate::integration::dense_step::Series;
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{MAX_STAGES, Stages};
use crate::numbers::state_words::saved;
use crate::{DenseStep, Vector};
use contact_geom::nalgebra::DMatrix;

/// The state at the start of a step in the variables of the route: y are velocities in the condensed routes, momenta in
/// the others.
#[derive(Clone, Debug)]
pub(crate) struct StepStart {
    pub q: Vector,
    pub y: Vector,
    pub z: f64,
}

saved!([] StepStart { q, y, z });

impl StepStart {
    pub fn zeros(n: usize) -> Self {
        StepStart { q: Vector::zeros(n), y: Vector::zeros(n), z: 0.0 }
    }

    pub fn copy_from(&mut self, from: &Self) {
        self.q.copy_from_slice(&from.q);
        self.y.copy_from_slice(&from.y);
        self.z = from.z;
    }
}

/// The last step of a run: the mass matrix of the condensed routes (`None` in the others), the time and the state at its
/// start.
#[derive(Clone, Copy)]
pub(crate) struct SolvedStep<'r> {
    pub mass: Option<&'r DMatrix<f64>>,
    pub t: f64,
    pub from: &'r StepStart,
}

/// The stages of a solved step, into which a route writes: V, `rho L_q`, `rho L_z` and L, padded with 0 after the last
/// stage. They are 0 before.
pub(crate) struct Solved<'s> {
    pub v: &'s mut [Stages],
    pub force: &'s mut [Stages],
    pub rate: &'s mut Stages,
    pub l: &'s mut Stages,
}

impl Solved<'_> {
    /// Writes the stages of a condensed step from its accelerations and positions; L only if it is requested.
    pub fn set_accelerations(
        self,
        system: &dyn CollocationSystem,
        step: &SolvedStep<'_>,
        table: &Condensed,
        [a, x]: [&[Stages]; 2],
        wants_l: bool,
    ) {
        let SolvedStep { t, from: start, mass } = *step;
        let (n, s) = (a.len(), table.s);
        if wants_l {
            let solved = CondensedStages { table, t, v0: &start.y, a, x, v: self.v };
            let values = system.stage_values(Instructions::new(), solved);
            self.l.0[..s].copy_from_slice(&values.0[..s]);
        }
        for d in 0..n {
            let v = &mut self.v[d].0;
            if !wants_l {
                v.iter_mut().zip(&table.inverse_rho.0).for_each(|(v, inverse)| *v = inverse * start.y[d]);
                for (column, a) in table.d.0.iter().zip(&a[d].0).take(s) {
                    v.iter_mut().zip(&column.0).for_each(|(v, entry)| *v += entry * a);
                }
            }
            v[s..].fill(0.0);
        }
        let mut rho = Stages::ZERO;
        rho.0.iter_mut().zip(&table.inverse_rho.0).take(s).for_each(|(rho, inverse)| *rho = 1.0 / inverse);
        for d in 0..n {
            for e in 0..n {
                let entry = mass.map_or(f64::from(u8::from(d == e)), |mass| mass[(d, e)]);
                if entry != 0.0 {
                    // The accelerations may have any padding.
                    let sums = self.force[d].0.iter_mut().zip(&rho.0).zip(&a[e].0);
                    sums.take(s).for_each(|((sum, rho), a)| *sum += entry * (rho * a));
                }
            }
        }
        self.rate.0.iter_mut().zip(&rho.0).for_each(|(rate, rho)| *rate = rho * table.gamma);
        if wants_l && table.gamma != 0.0 {
            // So far the values are those of `L - gamma z`; this adds `gamma z`.
            let (actions, values) = (table.actions(), *self.l);
            for i in 0..s {
                self.l.0[i] += actions.from_start[i] * start.z;
            }
            for (column, value) in actions.from_values.iter().zip(&values.0).take(s) {
                self.l.0.iter_mut().zip(column).for_each(|(l, entry)| *l += entry * value);
            }
        }
    }

    /// Divides stage values by weights, and pads them with 0.
    pub fn unweighted(x: &Stages, weights: &Stages, s: usize) -> Stages {
        let mut values = Stages::ZERO;
        for i in 0..s.min(MAX_STAGES) {
            values.0[i] = x.0[i] / weights.0[i];
        }
        values
    }
}

/// The collocation polynomial through the stages of a step.
pub(crate) fn curve_through(stages: SolvedStages) -> DenseStep {
    let SolvedStages { s, t, h, start, v, force, rate, l, .. } = stages;
    let [v, force] = [v, force].map(|of| of.iter().map(|of| through(of, s)).collect());
    DenseStep::new(s, (t, h), start, [v, force], [through(&rate, s), through(&l, s)])
}

/// The Legendre series of the polynomial through values at the nodes. The Gauss quadrature of its products with the
/// Legendre polynomials is exact.
fn through(values: &Stages, s: usize) -> Series {
    let mut c = [0.0; MAX_STAGES];
    for (row, value) in Coefficients::of(s).series.iter().zip(&values.0).take(s) {
        for (c, entry) in c.iter_mut().zip(row) {
            *c += entry * value;
        }
    }
    Series(c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::State;
    use crate::gauss::system::Typed;
    use crate::numbers::array::from_fn;
    use crate::solve::chebyshev::node;
    use contact_examples::systems::Pendulum;
    use contact_geom::numbers::max_or_nan;
    use smallvec::smallvec;

    /// The states at the nodes agree with those of the curve to a few units of round-off of each term.
    #[test]
    fn a_sketch_is_on_the_curve() {
        for s in 1..=MAX_STAGES {
            let value = |i: usize, seed: f64| (1.3 * i as f64 + seed).sin();
            let stages = |seed: f64| Stages(from_fn(|i| if i < s { value(i, seed) } else { 0.0 }));
            let curve = curve_through(SolvedStages {
                s,
                t: 0.5,
                h: 0.3,
                start: State::new([1.0, -2.0], [0.4, 0.9], 0.2),
                v: smallvec![stages(0.1), stages(0.7)],
                force: smallvec![stages(1.9), stages(2.3)],
                rate: stages(3.1),
                l: stages(0.4),
                knows_l: true,
            });
            let mut states = Vec::new();
            curve.states_at_nodes(&mut states);
            assert_eq!(states.len() + 1, curve.sampling_degree());
            for (i, found) in states.iter().enumerate() {
                let at = curve.at_fraction(node(curve.sampling_degree(), i + 1));
                let off =
                    max_or_nan((&found.q - at.q).amax(), max_or_nan((&found.p - at.p).amax(), (found.z - at.z).abs()));
                assert!(off <= 16.0 * s as f64 * f64::EPSILON, "{s} stages, node {i}: {off:e}");
            }
        }
    }

    /// Products with the matrices of an odd number of stages read one number of the padding, with the factor 0.
    #[test]
    fn padding_is_zero_whatever_that_of_the_accelerations() {
        let (pendulum, from) = (Pendulum { gamma: -0.1 }, StepStart::zeros(1));
        let table = Condensed::of(5, 0.3, -0.1).unwrap();
        let of = |i: usize| if i < 5 { 1.0 + i as f64 } else { f64::NAN };
        let [a, x] = [Stages(from_fn(of)), Stages::ZERO];
        for mass in [None, Some(DMatrix::from_element(1, 1, 2.0))] {
            let (mut v, mut force) = ([Stages::ZERO], [Stages::ZERO]);
            let (mut rate, mut l) = (Stages::ZERO, Stages::ZERO);
            let to = Solved { v: &mut v, force: &mut force, rate: &mut rate, l: &mut l };
            let step = SolvedStep { mass: mass.as_ref(), t: 0.0, from: &from };
            to.set_accelerations(&Typed::<_, 1>(&pendulum), &step, &table, [&[a], &[x]], false);
            let factor = mass.map_or(1.0, |mass| mass[(0, 0)]);
            for i in 0..MAX_STAGES {
                let rho = if i < 5 { 1.0 / table.inverse_rho.0[i] } else { 0.0 };
                let expected = if i < 5 { factor * (rho * of(i)) } else { 0.0 };
                assert_eq!((force[0].0[i], rate.0[i]), (expected, rho * -0.1), "stage {i}");
                assert!(if i < 5 { v[0].0[i] != 0.0 } else { v[0].0[i] == 0.0 }, "stage {i}");
            }
        }
    }
}
