//! Dense output of contact Gauss collocation: the collocation polynomial of the last step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use super::coefficients::{Coefficients, MAX_STAGES, POLYNOMIALS};
use super::condensed::Condensed;
use crate::run::saved::saved;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Lagrangian, PhasePoint};
use std::array::from_fn;
use std::sync::OnceLock;

/// The state at the start of a step as a route holds it: momenta, or velocities in the condensed routes.
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

/// The stages of a solved step: V, `rho L_q`, `rho L_z` and L, with 0 beyond the last stage.
pub(super) struct Solved<const N: usize> {
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

    /// From the accelerations and the positions of a condensed step.
    pub fn from_accelerations(
        lagrangian: &impl Lagrangian<N>,
        table: &Condensed,
        mass: &SMatrix<f64, N, N>,
        (t, start): (f64, &StepStart<N>),
        [a, x]: [&[[f64; MAX_STAGES]; N]; 2],
        wants_z: bool,
    ) -> Self {
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
            // L itself, of which the values are `L - gamma z`.
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

/// A step as a curve: the collocation polynomial of [`GaussStepper`](super::GaussStepper), with `tau` from 0 to h
///
/// `q(tau) = q0 + int V`, `z(tau) = z0 + int L`, `rho(tau) = 1 - int rho L_z`, `p(tau) = (p0 + int rho L_q) / rho(tau)`,
///
/// where V, L, `rho L_z` and `rho L_q` are the polynomials of degree `s - 1` through the stages.
///
/// At its ends it is the states of the run to round-off, which have order 2s; between them its order is s. So the curve of
/// a run is continuous, and its velocity jumps from step to step by `O(h^s)`. Where the action is not requested
/// and z decouples, z stays what it was at the start.
#[derive(Clone, Copy, Debug)]
pub struct DenseStep<const N: usize> {
    s: usize,
    t: f64,
    h: f64,
    start: PhasePoint<N>,
    v: [Series; N],
    force: [Series; N],
    rate: Series,
    l: Series,
}

impl<const N: usize> DenseStep<N> {
    pub(super) fn new(s: usize, t: f64, h: f64, start: PhasePoint<N>, solved: &Solved<N>) -> Self {
        let series = |values: &[f64; MAX_STAGES]| Series::through(values, s);
        DenseStep {
            s,
            t,
            h,
            start,
            v: from_fn(|d| series(&solved.v[d])),
            force: from_fn(|d| series(&solved.force[d])),
            rate: series(&solved.rate),
            l: series(&solved.l),
        }
    }

    /// The times of the step's start and end.
    pub fn span(&self) -> (f64, f64) {
        (self.t, self.t + self.h)
    }

    /// The state at a time of the [`span`](Self::span); beyond it the polynomials are continued.
    pub fn at(&self, t: f64) -> PhasePoint<N> {
        self.at_fraction((t - self.t) / self.h)
    }

    /// The velocity `dq/dt` of the curve at a time: a polynomial of degree `s - 1`, the stages' velocities at their times.
    pub fn velocity(&self, t: f64) -> SVector<f64, N> {
        let p = polynomials(self.s, (t - self.t) / self.h);
        SVector::from_fn(|d, _| self.v[d].value(&p, self.s))
    }

    /// Velocity, value of L and rho at a fraction of the step.
    pub(super) fn stage(&self, fraction: f64) -> (SVector<f64, N>, f64, f64) {
        let p = polynomials(self.s, fraction);
        let v = SVector::from_fn(|d, _| self.v[d].value(&p, self.s));
        let rho = 1.0 - self.h * self.rate.value(&integrals(self.s, &p, fraction), self.s);
        (v, self.l.value(&p, self.s), rho)
    }

    /// The length of the step.
    pub(super) fn length(&self) -> f64 {
        self.h
    }

    /// The parts in which [`sketch`](Self::sketch) divides the step.
    pub(crate) fn parts(&self) -> usize {
        self.s + 2
    }

    /// The states between the parts of the step, all at once.
    pub(crate) fn sketch(&self, to: &mut Vec<PhasePoint<N>>) {
        let table = integrals_to_parts(self.s);
        let along = |series: &Series| {
            let mut sums = [0.0; BETWEEN_PARTS];
            for (row, c) in table.iter().zip(&series.0).take(self.s) {
                for (sum, integral) in sums.iter_mut().zip(row) {
                    *sum += self.h * c * integral;
                }
            }
            sums
        };
        let (moved, pushed) = (self.v.each_ref().map(along), self.force.each_ref().map(along));
        let (rate, action) = (along(&self.rate), along(&self.l));
        to.extend((0..self.parts() - 1).map(|i| PhasePoint {
            q: SVector::from_fn(|d, _| self.start.q[d] + moved[d][i]),
            p: SVector::from_fn(|d, _| (self.start.p[d] + pushed[d][i]) / (1.0 - rate[i])),
            z: self.start.z + action[i],
        }));
    }

    /// The state at a fraction of the step.
    pub(crate) fn at_fraction(&self, fraction: f64) -> PhasePoint<N> {
        let p = polynomials(self.s, fraction);
        let integrals = integrals(self.s, &p, fraction);
        let integral = |series: &Series| self.h * series.value(&integrals, self.s);
        let rho = 1.0 - integral(&self.rate);
        PhasePoint {
            q: SVector::from_fn(|d, _| self.start.q[d] + integral(&self.v[d])),
            p: SVector::from_fn(|d, _| (self.start.p[d] + integral(&self.force[d])) / rho),
            z: self.start.z + integral(&self.l),
        }
    }
}

/// The factors of the recurrence `P_(k+1) = (2k + 1)/(k + 1) x P_k - k/(k + 1) P_(k-1)`.
const RECURRENCE: [[f64; 2]; MAX_STAGES] = {
    let (mut factors, mut k) = ([[0.0; 2]; MAX_STAGES], 0);
    while k < MAX_STAGES {
        factors[k] = [(2 * k + 1) as f64 / (k + 1) as f64, k as f64 / (k + 1) as f64];
        k += 1;
    }
    factors
};

/// The Legendre polynomials `P_0` to `P_s` of `2 x - 1`, without divisions.
fn polynomials(s: usize, fraction: f64) -> [f64; POLYNOMIALS] {
    let x = 2.0 * fraction - 1.0;
    let mut p = [1.0; POLYNOMIALS];
    p[1] = x;
    for k in 1..s.min(MAX_STAGES) {
        let [first, second] = RECURRENCE[k];
        p[k + 1] = first * x * p[k] - second * p[k - 1];
    }
    p
}

/// The integrals of the Legendre polynomials from 0 to a fraction of `[0, 1]`: `(2k + 1) P_k` is the derivative of `P_(k+1) - P_(k-1)`.
fn integrals(s: usize, p: &[f64; POLYNOMIALS], fraction: f64) -> [f64; POLYNOMIALS] {
    let mut integrals = [0.0; POLYNOMIALS];
    integrals[0] = fraction;
    for k in 1..s {
        integrals[k] = (p[k + 1] - p[k - 1]) * HALF_OF_ODD[k];
    }
    integrals
}

/// The most states between the parts of a step.
const BETWEEN_PARTS: usize = MAX_STAGES + 1;

/// The integrals of the Legendre polynomials to the ends of the parts of a step, of which there are s + 2: `[k][i]` to the end of part i.
fn integrals_to_parts(s: usize) -> &'static [[f64; BETWEEN_PARTS]; MAX_STAGES] {
    static TABLES: [OnceLock<Box<[[f64; BETWEEN_PARTS]; MAX_STAGES]>>; MAX_STAGES] =
        [const { OnceLock::new() }; MAX_STAGES];
    TABLES[s.clamp(1, MAX_STAGES) - 1].get_or_init(|| {
        let mut table = Box::new([[0.0; BETWEEN_PARTS]; MAX_STAGES]);
        for i in 0..=s {
            let fraction = (i + 1) as f64 / (s + 2) as f64;
            let p = polynomials(s, fraction);
            for (row, integral) in table.iter_mut().zip(integrals(s, &p, fraction)) {
                row[i] = integral;
            }
        }
        table
    })
}

/// `1 / (2 (2k + 1))`.
const HALF_OF_ODD: [f64; MAX_STAGES] = {
    let (mut numbers, mut k) = ([0.0; MAX_STAGES], 0);
    while k < MAX_STAGES {
        numbers[k] = 0.5 / (2 * k + 1) as f64;
        k += 1;
    }
    numbers
};

/// The coefficients of a polynomial on `[0, 1]` in the Legendre polynomials of `2 x - 1`.
#[derive(Clone, Copy, Debug)]
struct Series([f64; MAX_STAGES]);

impl Series {
    /// The polynomial through values at the nodes: Gauss' weights integrate its products with the Legendre polynomials exactly.
    fn through(values: &[f64; MAX_STAGES], s: usize) -> Self {
        let mut c = [0.0; MAX_STAGES];
        for (row, value) in Coefficients::of(s).series.iter().zip(values).take(s) {
            for (c, entry) in c.iter_mut().zip(row) {
                *c += entry * value;
            }
        }
        Series(c)
    }

    fn value(&self, p: &[f64; MAX_STAGES + 1], s: usize) -> f64 {
        (0..s).fold(0.0, |sum, k| sum + self.0[k] * p[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::max_or_nan;

    /// The states between the parts are those of the curve, to some roundings of each of its terms.
    #[test]
    fn a_sketch_is_on_the_curve() {
        for s in 1..=MAX_STAGES {
            let value = |i: usize, seed: f64| (1.3 * i as f64 + seed).sin();
            let stages = |seed: f64| from_fn(|i| if i < s { value(i, seed) } else { 0.0 });
            let mut solved = Solved::<2>::ZERO;
            (solved.v, solved.force) = ([stages(0.1), stages(0.7)], [stages(1.9), stages(2.3)]);
            (solved.rate, solved.l) = (stages(3.1), stages(0.4));
            let curve = DenseStep::new(s, 0.5, 0.3, PhasePoint::new([1.0, -2.0], [0.4, 0.9], 0.2), &solved);
            let mut sketch = Vec::new();
            curve.sketch(&mut sketch);
            assert_eq!(sketch.len() + 1, curve.parts());
            for (i, found) in sketch.iter().enumerate() {
                let at = curve.at_fraction((i + 1) as f64 / curve.parts() as f64);
                let off =
                    max_or_nan((found.q - at.q).amax(), max_or_nan((found.p - at.p).amax(), (found.z - at.z).abs()));
                assert!(off <= 16.0 * s as f64 * f64::EPSILON, "{s} stages, part {i}: {off:e}");
            }
        }
    }
}
