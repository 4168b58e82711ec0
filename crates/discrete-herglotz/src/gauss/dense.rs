//! The solved stages of a step, and its collocation polynomial.

use crate::DenseStep;
use crate::gauss::system::{CollocationSystem, PointRef};
use crate::gauss::tables::coefficients::Coefficients;
use crate::gauss::tables::condensed::Condensed;
use crate::integration::SolvedStages;
use crate::integration::dense_step::Series;
use crate::numbers::array::from_fn;
use crate::numbers::registers::{MAX_STAGES, Stages};
use crate::numbers::state_words::saved;
use contact_geom::PhasePoint;
use contact_geom::nalgebra::DMatrix;

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

/// The state at the start of a step in the variables of the route: y are velocities in the condensed routes, momenta in
/// the others.
#[derive(Clone, Debug)]
pub(crate) struct StartValues {
    pub q: Vec<f64>,
    pub y: Vec<f64>,
    pub z: f64,
}

saved!([] StartValues { q, y, z });

impl StartValues {
    pub fn zeros(n: usize) -> Self {
        StartValues { q: vec![0.0; n], y: vec![0.0; n], z: 0.0 }
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
    pub from: &'r StartValues,
}

/// The stages of a solved step: V, `rho L_q`, `rho L_z` and L, padded with 0 after the last stage.
pub(crate) struct Solved {
    pub v: Vec<Stages>,
    pub force: Vec<Stages>,
    pub rate: Stages,
    pub l: Stages,
    /// Whether `l` was computed.
    pub knows_l: bool,
}

impl Solved {
    pub fn zeros(n: usize) -> Self {
        let zero = || vec![Stages::ZERO; n];
        Solved { v: zero(), force: zero(), rate: Stages::ZERO, l: Stages::ZERO, knows_l: true }
    }

    /// The stages of a condensed step from its accelerations and positions.
    pub fn from_accelerations(
        system: &dyn CollocationSystem,
        step: &SolvedStep<'_>,
        table: &Condensed,
        [a, x]: [&[Stages]; 2],
        wants_l: bool,
    ) -> Self {
        let SolvedStep { t, from: start, mass } = *step;
        let (n, s) = (a.len(), table.s);
        let mut solved = Self::zeros(n);
        solved.knows_l = wants_l;
        for d in 0..n {
            let v = &mut solved.v[d].0;
            v.iter_mut().zip(&table.inverse_rho.0).for_each(|(v, inverse)| *v = inverse * start.y[d]);
            for (column, a) in table.d.0.iter().zip(&a[d].0).take(s) {
                v.iter_mut().zip(&column.0).for_each(|(v, entry)| *v += entry * a);
            }
            v[s..].fill(0.0);
        }
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        for i in 0..s {
            let rho = 1.0 / table.inverse_rho.0[i];
            for d in 0..n {
                let entry = |e: usize| mass.map_or(f64::from(u8::from(d == e)), |mass| mass[(d, e)]);
                solved.force[d].0[i] =
                    (0..n).map(|e| entry(e) * (rho * a[e].0[i])).reduce(|sum, term| sum + term).unwrap_or(0.0);
            }
            solved.rate.0[i] = rho * table.gamma;
            if wants_l {
                for d in 0..n {
                    (q[d], v[d]) = (x[d].0[i], solved.v[d].0[i]);
                }
                solved.l.0[i] = system.value(t + table.times.0[i], PointRef { q: &q, v: &v, z: 0.0 });
            }
        }
        if wants_l && table.gamma != 0.0 {
            // So far the values are those of `L - gamma z`; this adds `gamma z`.
            let (actions, values) = (table.actions(), solved.l);
            for i in 0..s {
                solved.l.0[i] += actions.from_start[i] * start.z;
            }
            for (column, value) in actions.from_values.iter().zip(&values.0).take(s) {
                solved.l.0.iter_mut().zip(column).for_each(|(l, entry)| *l += entry * value);
            }
        }
        solved
    }

    /// The collocation polynomial through these stages.
    pub fn curve<const N: usize>(&self, s: usize, (t, h): (f64, f64), start: PhasePoint<N>) -> DenseStep<N> {
        let [v, force] = [&self.v, &self.force].map(|of| from_fn(|d| through(&of[d], s)));
        DenseStep::new(s, (t, h), start, [v, force], [through(&self.rate, s), through(&self.l, s)])
    }

    /// These stages for the tangent of the step.
    pub fn stages<const N: usize>(&self, s: usize, (t, h): (f64, f64), start: PhasePoint<N>) -> SolvedStages<N> {
        let [v, force] = [&self.v, &self.force].map(|of| from_fn(|d| of[d]));
        SolvedStages { s, t, h, start, v, force, rate: self.rate, l: self.l, knows_l: self.knows_l }
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
