//! Tests of pieces, splittings and generating functions: contact to round-off, orders, symmetry, exactness, errors.

mod errors;
mod generating;
mod orders;
mod pieces;

use super::increment::SeededPoint;
use super::{PointFlow, Polynomial};
use crate::Stepper;
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::numbers::MaxAbsOrNan;
use contact_geom::{ChartVector, ContactHamiltonian, Darboux, HamiltonianDerivatives, PhasePoint, Scalar};

/// Contact Hamiltonians in two coordinates, and parts of them.
#[derive(Clone, Copy, Debug)]
pub(super) enum Plane {
    /// Nonlinear in q, p and z, and dependent on time.
    Coupled,
    /// Linear in p.
    Linear,
    /// Homogeneous of degree one in p: rays in a medium with absorption.
    Ray,
    /// T(t, p), not quadratic.
    Kinetic,
    /// V(t, q).
    Potential,
    /// Homogeneous of this degree in p.
    Homogeneous(f64),
}

impl ContactHamiltonian<2> for Plane {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, p: &SVector<T, 2>, z: T) -> T {
        let square = p[0] * p[0] + p[1] * p[1] * 2.0 + p[0] * p[1] * 0.6;
        match self {
            Plane::Coupled => {
                let kinetic = (square + 1.0).sqrt() * (q[0].cos() * 0.2 + 1.0);
                kinetic + (q[0] - q[1] * 0.5).sin() + z * (q[1] * 0.3 + p[0] * 0.2 + t.sin() * 0.1) + z * z * 0.1
            }
            Plane::Linear => {
                p[0] * (q[1] + z * 0.3) + p[1] * ((q[0] * q[0] - 1.0) * -0.5) + q[0].sin() * z + z * z * 0.1
            }
            Plane::Ray => square.sqrt() * (q[0].sin() * q[1] * 0.3 + 1.0) + (p[0] - p[1]) * z * 0.2,
            Plane::Kinetic => (square + 1.0).sqrt() + p[0] * p[0] * p[1] * 0.2 + p[1] * t,
            Plane::Potential => (q[0] - q[1] * 0.5).sin() * (t * t + 1.0) + q[0] * q[1] * q[1] + 0.7,
            Plane::Homogeneous(degree) => square.powf(0.5 * degree),
        }
    }
}

/// Coefficients of a polynomial in z whose discriminant has this sign.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coefficients(pub f64);

impl<const N: usize> Polynomial<N> for Coefficients {
    fn coefficients<T: Scalar>(&self, t: T, q: &SVector<T, N>) -> [T; 3] {
        let last = q[N - 1];
        [(q[0] * 0.5 + t).sin() + 2.0, last * last * 0.3 + 0.2, q[0].cos() * (-0.5 * self.0)]
    }
}

/// `H = z sum p_i q_i^2`, with the flow of a user's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Squares;

impl<const N: usize> PointFlow<N> for Squares {
    type Map = f64;

    fn field<T: Scalar>(&self, _t: T, q: &SVector<T, N>, z: T) -> (SVector<T, N>, T) {
        (q.map(|e| e * e * z), T::zero())
    }
    fn over(&self, tau: f64) -> f64 {
        tau
    }
    fn change<T: Scalar>(&self, tau: &f64, _t: f64, q: &SVector<T, N>, z: T) -> (SVector<T, N>, T) {
        let s = z * *tau;
        (q.map(|e| e * e * s / (-(e * s) + 1.0)), T::zero())
    }
}

/// A point with coordinates between -1 and 1.
pub(super) fn random_point<const N: usize>(k: usize) -> PhasePoint<N> {
    let mut i = k * (2 * N + 1);
    let mut next = || {
        i += 1;
        2.0 * (i as f64 * 0.618_033_988_749_894_9 + (i * i) as f64 * std::f64::consts::SQRT_2).fract() - 1.0
    };
    PhasePoint { q: SVector::from_fn(|_, _| next()), p: SVector::from_fn(|_, _| next()), z: next() }
}

pub(super) fn distance<const N: usize>(a: &PhasePoint<N>, b: &PhasePoint<N>) -> f64 {
    ChartVector::from(*a).minus(ChartVector::from(*b)).max_abs_or_nan()
}

/// The state and `ln sigma` after a time by the classical Runge-Kutta method of order 4 with this number of steps,
/// which shares no code with the methods under test.
pub(super) fn runge_kutta<const N: usize>(
    h: &impl ContactHamiltonian<N>,
    (t0, duration): (f64, f64),
    start: &PhasePoint<N>,
    steps: usize,
    frozen: bool,
) -> (PhasePoint<N>, f64) {
    let field = |t: f64, x: &ChartVector<N>| {
        let point = PhasePoint::from(*x);
        let t = if frozen { t0 } else { t };
        (h.contact_field(t, &point), -h.with_gradient(t, &point).1.z)
    };
    let s = duration / steps as f64;
    let (mut x, mut log) = (ChartVector::from(*start), 0.0);
    for k in 0..steps {
        let t = t0 + k as f64 * s;
        let (k1, r1) = field(t, &x);
        let (k2, r2) = field(t + 0.5 * s, &x.plus(k1.scale(0.5 * s)));
        let (k3, r3) = field(t + 0.5 * s, &x.plus(k2.scale(0.5 * s)));
        let (k4, r4) = field(t + s, &x.plus(k3.scale(s)));
        x = x.plus(k1.plus(k4).plus(k2.plus(k3).scale(2.0)).scale(s / 6.0));
        log += s / 6.0 * (r1 + r4 + 2.0 * (r2 + r3));
    }
    (x.into(), log)
}

/// The contact defect of a map at a point, with its factor by the pullback.
pub(super) fn pullback<E: std::fmt::Debug, const N: usize>(
    x: &PhasePoint<N>,
    map: impl Fn(&SeededPoint<N>) -> Result<SeededPoint<N>, E>,
) -> (f64, f64) {
    let jacobian: DMatrix<f64> = super::increment::jacobian(x, &map).unwrap();
    let image = {
        let end = map(&contact_geom::support::seed(&ChartVector::from(*x)).into()).unwrap();
        PhasePoint { q: end.q.map(|e| e.re), p: end.p.map(|e| e.re), z: end.z.re }
    };
    let found = contact_geom::support::conformality_with_jacobian(
        &Darboux,
        &Darboux,
        &ChartVector::from(*x),
        &ChartVector::from(image),
        &jacobian,
    );
    let found = found.unwrap();
    (found.defect, found.sigma)
}

/// Asserts that the order of a method, measured as the slope of its errors over the last four of a sequence of finer
/// resolutions above round-off, agrees with its order to 0.15.
pub(super) fn assert_order<'s, const N: usize>(
    name: &str,
    order: u32,
    (duration, exact): (f64, &PhasePoint<N>),
    stepper: impl Fn(f64) -> Box<dyn Stepper + 's>,
) {
    let mut points: Vec<(f64, f64)> = Vec::new();
    let mut n = 8;
    while n < 400 {
        let mut motion = stepper(duration / n as f64);
        motion.advance(n).unwrap();
        let error = distance(&motion.state().fixed(), exact);
        // The round-off of a reference is some 1e-14.
        if error < 2e-13 {
            break;
        }
        points.push(((n as f64).ln(), error.ln()));
        n += 1 + n / 6;
    }
    assert!(points.len() >= 4, "{name}: {points:?}");
    let (first, last) = (points[points.len() - 4], points[points.len() - 1]);
    let slope = (first.1 - last.1) / (last.0 - first.0);
    assert!((slope - f64::from(order)).abs() < 0.15, "{name}: {slope}, {points:?}");
}
