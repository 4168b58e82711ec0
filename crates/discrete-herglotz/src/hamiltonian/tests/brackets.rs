//! Modified Hamiltonians of splittings as series of Jacobi brackets.

use crate::hamiltonian::BracketSeries;
use crate::hamiltonian::SplitPart::{self, A, B};
use crate::{InputError, StepError};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{ContactHamiltonian, PhasePoint, Scalar};

const GAMMA: f64 = -0.3;
const BETA: f64 = 0.4;

/// Parts of contact Hamiltonians, with their exact flows.
#[derive(Clone, Copy, Debug)]
enum Part {
    /// `p^2/2 - gamma z`.
    Kinetic,
    /// `2 - cos q + beta z^2/2`: a pendulum with a drag that is nonlinear in z.
    Pendulum,
    /// `q^2/2`.
    Spring,
}

impl ContactHamiltonian<1> for Part {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        match self {
            Part::Kinetic => p[0] * p[0] * 0.5 - z * GAMMA,
            Part::Pendulum => -q[0].cos() + 2.0 + z * z * (0.5 * BETA),
            Part::Spring => q[0] * q[0] * 0.5,
        }
    }
}

impl Part {
    /// The state after a time, and the factor.
    fn flow(self, x: &PhasePoint<1>, t: f64) -> (PhasePoint<1>, f64) {
        let (q, p, z) = (x.q[0], x.p[0], x.z);
        match self {
            Part::Kinetic => {
                let (sigma, moved) = ((GAMMA * t).exp(), p * (GAMMA * t).exp_m1() / GAMMA);
                (PhasePoint::new([q + moved], [sigma * p], sigma * (z + 0.5 * p * moved)), sigma)
            }
            Part::Pendulum => {
                // z = a tan(theta - k t), and p / sigma changes at the rate -V'/sigma.
                let v = 2.0 - q.cos();
                let (a, k) = ((2.0 * v / BETA).sqrt(), (0.5 * v * BETA).sqrt());
                let before = (z / a).atan();
                let after = before - k * t;
                let sigma = (before.cos() / after.cos()).powi(2);
                let integral =
                    (0.5 * t + ((2.0 * before).sin() - (2.0 * after).sin()) / (4.0 * k)) / before.cos().powi(2);
                (PhasePoint::new([q], [sigma * (p - q.sin() * integral)], a * after.tan()), sigma)
            }
            Part::Spring => (PhasePoint::new([q], [p - q * t], z - 0.5 * q * q * t), 1.0),
        }
    }
}

/// The step of a composition.
fn step(
    composition: &[(SplitPart, f64)],
    b: Part,
) -> impl Fn(&PhasePoint<1>, f64) -> Result<(PhasePoint<1>, f64), StepError> {
    move |x, h| {
        Ok(composition.iter().fold((*x, 1.0), |(x, sigma), (part, time)| {
            let part = if *part == A { Part::Kinetic } else { b };
            let (y, factor) = part.flow(&x, time * h);
            (y, sigma * factor)
        }))
    }
}

fn slope(points: &[(f64, f64)]) -> f64 {
    let (first, last) = (points[0], points[points.len() - 1]);
    (last.1 / first.1).ln() / (last.0 / first.0).ln()
}

const LIE_TROTTER: [(SplitPart, f64); 2] = [(A, 1.0), (B, 1.0)];
const STRANG: [(SplitPart, f64); 3] = [(A, 0.5), (B, 1.0), (A, 0.5)];

/// `H~_k o Phi = sigma_d H~_k + O(h^(k+1))` on a pendulum with a drag that is nonlinear in z, for k up to 6, for the
/// Lie-Trotter splitting and the Strang splitting, whose terms of even degree vanish.
#[test]
fn a_step_keeps_its_series() {
    let states = [(1.0, 0.7, 0.2), (-0.6, 1.2, -0.5), (2.0, -0.9, 0.8)];
    let states = states.map(|(q, p, z)| PhasePoint::new([q], [p], z));
    let steps = [0.0125, 0.025, 0.05, 0.1, 0.2];
    let most = 6;
    for (name, composition) in [("lie_trotter", &LIE_TROTTER[..]), ("strang", &STRANG[..])] {
        let symmetric = name == "strang";
        let series = BracketSeries::new(composition, most).unwrap();
        let step = step(composition, Part::Pendulum);
        let defects = series.defects(&Part::Kinetic, &Part::Pendulum, &states, &steps, step).unwrap();
        for k in 1..=most {
            let of_k: Vec<(f64, f64)> = defects.iter().filter(|d| d.k == k).map(|d| (d.h, d.defect)).collect();
            let order = k + if symmetric && k % 2 == 1 { 2 } else { 1 };
            // The smallest steps whose defects are above the rounding of the values, some 1e-16.
            let first = of_k.iter().position(|(_, defect)| *defect > 2e-14).unwrap();
            let found = slope(&of_k[first..first + 2]);
            assert!((found - order as f64).abs() < 0.15, "{name}, {k}: slope {found}, {of_k:?}");
        }
        if symmetric {
            assert!(series.terms().iter().all(|term| term.degree() % 2 == 1), "{:?}", series.terms());
        }
    }
}

/// The Strang splitting of the damped oscillator: its step is a matrix on (q, p), whose logarithm has the contact
/// Hamiltonian `b p^2/2 + a q p - c q^2/2 - gamma z`, `log(M)/h = ((a, b), (c, gamma - a))`. The series of degree k
/// differs from it by `O(h^(k+1))`.
#[test]
fn the_series_of_the_oscillator_is_the_logarithm() {
    let series = BracketSeries::new(&STRANG, 7).unwrap();
    let x = PhasePoint::new([0.8], [0.5], 0.3);
    let step = step(&STRANG, Part::Spring);
    let off = |h: f64, k: usize| {
        let column = |q: f64, p: f64| step(&PhasePoint::new([q], [p], 0.0), h).unwrap().0;
        let (first, second) = (column(1.0, 0.0), column(0.0, 1.0));
        let m = SMatrix::<f64, 2, 2>::new(first.q[0], second.q[0], first.p[0], second.p[0]);
        let unit = SMatrix::<f64, 2, 2>::identity();
        let root = m.determinant().sqrt();
        let cosine = 0.5 * m.trace() / root;
        let angle = cosine.acos();
        let field = (unit * (0.5 * GAMMA * h) + (m / root - unit * cosine) * (angle / angle.sin())) / h;
        let (a, b, c) = (field[(0, 0)], field[(0, 1)], field[(1, 0)]);
        let (q, p) = (x.q[0], x.p[0]);
        let closed = 0.5 * b * p * p + a * q * p - 0.5 * c * q * q - GAMMA * x.z;
        (series.value(&Part::Kinetic, &Part::Spring, &x, h, k) - closed).abs()
    };
    for (k, order) in [(1, 2.0), (3, 4.0), (5, 6.0), (7, 8.0)] {
        let steps = if k < 5 { [0.05, 0.1] } else { [0.2, 0.3] };
        let found = slope(&steps.map(|h| (h, off(h, k))));
        assert!((found - order).abs() < 0.15, "degree {k}: slope {found}");
    }
}

#[test]
fn invalid_compositions_are_refused() {
    assert!(matches!(BracketSeries::new(&STRANG, 0), Err(InputError::Count { found: 0, .. })));
    assert!(matches!(BracketSeries::new(&STRANG, 8), Err(InputError::Count { found: 8, .. })));
    assert!(matches!(BracketSeries::new(&[(A, f64::NAN)], 2), Err(InputError::Span { .. })));
}
