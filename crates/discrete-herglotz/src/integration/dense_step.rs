//! Dense output: a step as a curve.

use crate::numbers::registers::MAX_STAGES;
use crate::solve::chebyshev::{MAX_DEGREE, node};
use crate::{State, Vector};
use contact_geom::numbers::max_or_nan;
use smallvec::SmallVec;
use std::sync::OnceLock;

/// The number of Legendre polynomials that the integrals of the highest degree need.
pub(crate) const POLYNOMIALS: usize = MAX_STAGES + 1;

/// A curve for each coordinate; without an allocation for up to four.
pub(crate) type Curves = SmallVec<[Series; 4]>;

/// Dense output of a step: the collocation polynomial of [`GaussStepper`](crate::gauss::GaussStepper). For `tau` from 0
/// to h
///
/// `q(tau) = q0 + int V`, `z(tau) = z0 + int L`, `rho(tau) = 1 - int rho L_z`,
/// `p(tau) = (p0 + int rho L_q) / rho(tau)`,
///
/// where V, L, `rho L_z` and `rho L_q` are the polynomials of degree `s - 1` through the stages.
///
/// At its ends it equals the states of the run, of order 2s, to round-off; between them its order is s. The curve of a
/// run is therefore continuous, and its velocity jumps by `O(h^s)` between steps. Where the action is not requested and
/// z decouples, z keeps its initial value.
#[derive(Clone, Debug)]
pub struct DenseStep {
    s: usize,
    t: f64,
    h: f64,
    start: State,
    v: Curves,
    force: Curves,
    rate: Series,
    l: Series,
}

impl DenseStep {
    /// A step from the Legendre series of V, `rho L_q`, `rho L_z` and L on it, each with `s` coefficients.
    pub(crate) fn new(
        s: usize,
        (t, h): (f64, f64),
        start: State,
        [v, force]: [Curves; 2],
        [rate, l]: [Series; 2],
    ) -> Self {
        DenseStep { s, t, h, start, v, force, rate, l }
    }

    /// The times of the start and the end of the step.
    pub fn span(&self) -> (f64, f64) {
        (self.t, self.t + self.h)
    }

    /// The state at a time in the [`span`](Self::span); outside of it the polynomials are extrapolated.
    pub fn at(&self, t: f64) -> State {
        self.at_fraction((t - self.t) / self.h)
    }

    /// The velocity `dq/dt` of the curve at a time: the polynomial of degree `s - 1` through the velocities of the
    /// stages.
    pub fn velocity(&self, t: f64) -> Vector {
        let p = polynomials(self.s, (t - self.t) / self.h);
        self.v.iter().map(|v| v.value(&p, self.s)).collect()
    }

    /// The velocity, the value of L and rho at a fraction of the step.
    pub(crate) fn stage(&self, fraction: f64) -> (Vector, f64, f64) {
        let p = polynomials(self.s, fraction);
        let v = self.v.iter().map(|v| v.value(&p, self.s)).collect();
        let rho = 1.0 - self.h * self.rate.value(&integrals(self.s, &p, fraction), self.s);
        (v, self.l.value(&p, self.s), rho)
    }

    /// The length of the step.
    pub(crate) fn length(&self) -> f64 {
        self.h
    }

    /// The number of stages.
    pub(crate) fn stages(&self) -> usize {
        self.s
    }

    /// The degree of the interpolation in [`states_at_nodes`](Self::states_at_nodes): larger by two than that of the
    /// positions, so that the last coefficients of a function that does not resolve are seen, up to the largest one.
    pub(crate) fn sampling_degree(&self) -> usize {
        sampling_degree(self.s)
    }

    /// Appends the states at the Chebyshev-Lobatto nodes of the step, without those at its ends.
    pub(crate) fn states_at_nodes(&self, to: &mut Vec<State>) {
        let table = integrals_to_nodes(self.s);
        let along = |series: &Series| {
            let mut sums = [0.0; MAX_INNER_NODES];
            for (row, c) in table.iter().zip(&series.0).take(self.s) {
                for (sum, integral) in sums.iter_mut().zip(row) {
                    *sum += self.h * c * integral;
                }
            }
            sums
        };
        let [moved, pushed] = [&self.v, &self.force].map(|of| of.iter().map(along).collect::<Vec<_>>());
        let (rate, action) = (along(&self.rate), along(&self.l));
        to.extend((0..self.sampling_degree() - 1).map(|i| State {
            q: self.start.q.iter().zip(&moved).map(|(q, moved)| q + moved[i]).collect(),
            p: self.start.p.iter().zip(&pushed).map(|(p, pushed)| (p + pushed[i]) / (1.0 - rate[i])).collect(),
            z: self.start.z + action[i],
        }));
    }

    /// Estimates of the errors of q, of p and of z between the ends, each with the size of the terms. The coefficients of the
    /// polynomials go on as the last ones decrease: two together, since those of an even or an odd function vanish in turn.
    pub(crate) fn truncation_errors(&self) -> [[f64; 2]; 3] {
        let s = self.s;
        // The integral of a Legendre polynomial beyond the last is at most this.
        let integral = self.h.abs() / (2 * s + 1) as f64;
        let of = |series: &Series| {
            let pair =
                |end: usize| series.0[end.saturating_sub(2)..end].iter().fold(0.0, |most, c| max_or_nan(most, c.abs()));
            let (last, before) = (pair(s), pair(s.saturating_sub(2)));
            let next = if last < before { last * (last / before) } else { last };
            let all = series.0[..s].iter().fold(0.0, |size, c| max_or_nan(size, c.abs()));
            [integral * next, self.h.abs() * all]
        };
        let of_all = |of_x: &Curves, x: &Vector| {
            let larger = |a: [f64; 2], b: [f64; 2]| [max_or_nan(a[0], b[0]), max_or_nan(a[1], b[1])];
            of_x.iter().map(of).fold([0.0, x.amax()], larger)
        };
        let (q, p, [l, of_l]) = (of_all(&self.v, &self.start.q), of_all(&self.force, &self.start.p), of(&self.l));
        let rate = of(&self.rate)[0];
        [q, [p[0] + rate * p[1], p[1]], [l, max_or_nan(of_l, self.start.z.abs())]]
    }

    /// The state at a time in the step, and rho there.
    pub(crate) fn state_and_rho(&self, t: f64) -> (State, f64) {
        self.at_fraction_with_rho((t - self.t) / self.h)
    }

    /// The state at a fraction of the step.
    pub(crate) fn at_fraction(&self, fraction: f64) -> State {
        self.at_fraction_with_rho(fraction).0
    }

    fn at_fraction_with_rho(&self, fraction: f64) -> (State, f64) {
        let p = polynomials(self.s, fraction);
        let integrals = integrals(self.s, &p, fraction);
        let integral = |series: &Series| self.h * series.value(&integrals, self.s);
        let rho = 1.0 - integral(&self.rate);
        let state = State {
            q: self.start.q.iter().zip(&self.v).map(|(q, v)| q + integral(v)).collect(),
            p: self.start.p.iter().zip(&self.force).map(|(p, force)| (p + integral(force)) / rho).collect(),
            z: self.start.z + integral(&self.l),
        };
        (state, rho)
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

/// The Legendre polynomials `P_0` to `P_s` of `2 x - 1` at a fraction x, without divisions.
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

/// The integrals of the Legendre polynomials from 0 to a fraction of `[0, 1]`, from
/// `(2k + 1) P_k = (P_(k+1) - P_(k-1))'`.
fn integrals(s: usize, p: &[f64; POLYNOMIALS], fraction: f64) -> [f64; POLYNOMIALS] {
    let mut integrals = [0.0; POLYNOMIALS];
    integrals[0] = fraction;
    for k in 1..s {
        integrals[k] = (p[k + 1] - p[k - 1]) * HALF_OF_ODD[k];
    }
    integrals
}

/// The smallest degree of interpolation: its error is estimated from the last three coefficients, which should not
/// include that of a linear function.
const MIN_SAMPLING_DEGREE: usize = 4;

/// The degree of interpolation on a step with s stages.
fn sampling_degree(s: usize) -> usize {
    (s + 2).clamp(MIN_SAMPLING_DEGREE, MAX_DEGREE)
}

/// The largest number of nodes between the ends of a step.
const MAX_INNER_NODES: usize = MAX_DEGREE - 1;

/// The integrals of the Legendre polynomials to the nodes between the ends of a step: `[k][i]` is the integral of `P_k`
/// to node i + 1.
fn integrals_to_nodes(s: usize) -> &'static [[f64; MAX_INNER_NODES]; MAX_STAGES] {
    static TABLES: [OnceLock<Box<[[f64; MAX_INNER_NODES]; MAX_STAGES]>>; MAX_STAGES] =
        [const { OnceLock::new() }; MAX_STAGES];
    TABLES[s.clamp(1, MAX_STAGES) - 1].get_or_init(|| {
        let mut table = Box::new([[0.0; MAX_INNER_NODES]; MAX_STAGES]);
        let degree = sampling_degree(s);
        for i in 0..degree - 1 {
            let fraction = node(degree, i + 1);
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
pub(crate) struct Series(pub [f64; MAX_STAGES]);

impl Series {
    fn value(&self, p: &[f64; POLYNOMIALS], s: usize) -> f64 {
        (0..s).fold(0.0, |sum, k| sum + self.0[k] * p[k])
    }
}
