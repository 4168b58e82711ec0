//! A drag whose rate is periodic in time: the maps agree with those of the library for small systems, `sigma_d` is
//! correct, and the order is not reduced.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure};
use discrete_herglotz::{
    Problem, SplittingScheme, Start, StepError, Stepper, StepperOptions,
    gauss::GaussStepper,
    rules::{Flow, Rule},
    splitting::Splitting,
};
use sparse_herglotz::systems::{FputBond, OuterSolarSystem, fput_chain};
use sparse_herglotz::{SparseError, SparseGauss, SparseMidpoint, SparseSplitting, SparseSystem, State};

const N: usize = 5;
const STEPS: usize = 20;

/// The rate has both signs, so that the motion is driven at times.
fn rate<T: Scalar>(t: T) -> T {
    (t * 3.0).cos() * 0.3 - 0.1
}

/// A chain between two walls, with the periodic drag.
struct Whole;

impl Lagrangian<N> for Whole {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let at = |i: usize| if (1..=N).contains(&i) { q[i - 1] } else { T::zero() };
        let bonds = (0..=N).fold(T::zero(), |sum, i| {
            let r = at(i + 1) - at(i);
            sum + r * r * 0.5 + (r * r) * (r * r) * 0.125
        });
        v.dot(v) * 0.5 - bonds + z * rate(t)
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, z_affine: true, constant_mass: true, ..Structure::default() }
    }
}

fn chain() -> SparseSystem {
    fput_chain(N, FputBond { alpha: 0.0, beta: 0.5 }, 0.0).unwrap().with_timed_drag(rate)
}

fn same(name: &str, found: State, expected: PhasePoint<N>, tolerance: f64) {
    for i in 0..N {
        let (dq, dp) = (found.q[i] - expected.q[i], found.v[i] - expected.p[i]);
        assert!(dq.abs() <= tolerance && dp.abs() <= tolerance, "{name}, unknown {i}: {dq:e}, {dp:e} > {tolerance:e}");
    }
    let dz = found.z.unwrap() - expected.z;
    assert!(dz.abs() <= N as f64 * tolerance, "{name}: z differs by {dz:e}");
}

#[test]
fn small_systems() {
    let of = |shift: f64| SVector::<f64, N>::from_fn(|i, _| (1.7 * i as f64 + shift).sin());
    let (q, p, z, t) = (of(0.3), of(1.1), 0.4, 0.7);
    let large = chain();
    let from = State { t, q: q.as_slice(), v: p.as_slice(), z: Some(z) };
    let state = PhasePoint { q, p, z };
    for h in [0.1, -0.1] {
        // As in small_systems.rs: round-off, times ten for the divergence of neighbouring motions; divided by h for
        // Newton's method.
        let tolerance = |stages: usize| 200.0 * f64::EPSILON * (STEPS * stages) as f64;
        for scheme in SplittingScheme::ALL {
            let mut a = SparseSplitting::new(&large, &scheme, h, from).unwrap();
            let mut b = Splitting::new(&Whole, &scheme, h, t, state).unwrap();
            // The conformal factor of a step is the exponential of the integral, 0.1 sin(3t) - 0.1 t, to the order 12
            // of the quadrature.
            a.advance(1).unwrap();
            let integral = |t: f64| 0.1 * (3.0 * t).sin() - 0.1 * t;
            let sigma = (integral(t + h) - integral(t)).exp();
            assert!(
                (a.sigma() / sigma - 1.0).abs() <= 16.0 * f64::EPSILON * scheme.stages() as f64,
                "{}",
                a.sigma() / sigma - 1.0
            );
            assert_eq!((a.advance(STEPS - 1), b.advance(STEPS)), (Ok(()), Ok(())));
            same(scheme.name(), a.state(), b.state().fixed(), tolerance(scheme.stages()));
        }
        let mut a = SparseMidpoint::new(&large, h, from, None).unwrap();
        let mut b = Flow::new(Rule::MIDPOINT.of(&Whole, h).unwrap(), t, state).unwrap();
        assert_eq!((a.advance(STEPS), b.advance(STEPS)), (Ok(()), Ok(())));
        same("midpoint", a.state(), Stepper::state(&b).fixed(), tolerance(1) / h.abs());
        for stages in [1, 2] {
            let mut a = SparseGauss::new(&large, stages, h, from, None).unwrap();
            let problem = Problem::new(&Whole, t, Start::Momentum(state, p)).unwrap();
            let mut b =
                GaussStepper::new(&problem, stages, h, StepperOptions { action: true, ..StepperOptions::default() })
                    .unwrap();
            assert_eq!((a.advance(STEPS), b.advance(STEPS)), (Ok(()), Ok(())));
            same("gauss", a.state().unwrap(), b.state().fixed(), tolerance(1) / h.abs());
        }
    }
}

/// For bodies with a periodic drag the order of the scheme is found to within 0.3, since the next power of the step
/// contributes (with twice the step the measured order is 4.4). No part of the error is proportional to the drag.
#[test]
fn bodies() {
    let (q, v) = (OuterSolarSystem::positions(5), OuterSolarSystem::velocities(5));
    let from = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let run = |gamma: f64, scheme: &SplittingScheme, steps: usize| {
        let system = OuterSolarSystem::system(5, 0.0).unwrap();
        // The period is about a year.
        let system = system.with_timed_drag(move |t| gamma * (1.0 + (0.0172 * t).cos()));
        let mut motion = SparseSplitting::new(&system, scheme, 20_000.0 / steps as f64, from).unwrap();
        motion.advance(steps).unwrap();
        motion.state().q.to_vec()
    };
    let error = |gamma: f64, steps: usize| {
        let exact = run(gamma, &SplittingScheme::SOFRONIOU_SPALETTA_10, 1000);
        let found = run(gamma, &SplittingScheme::BLANES_MOAN_4, steps);
        found.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let (free, coarse, fine) = (error(0.0, 400), error(-1e-6, 400), error(-1e-6, 800));
    assert!(coarse < 1.5 * free && free > 1e-10, "{coarse:e}, without {free:e}");
    assert!(((coarse / fine).log2() - 4.0).abs() < 0.3, "{coarse:e}, {fine:e}");
}

/// A rate that is not finite, or too large for the step, is an error at the start and a status later.
#[test]
fn bad_rates() {
    let zeros = [0.1; N];
    let from = State { t: 0.0, q: &zeros, v: &zeros, z: Some(0.0) };
    let of =
        |rate: fn(f64) -> f64| fput_chain(N, FputBond { alpha: 0.0, beta: 0.5 }, 0.0).unwrap().with_timed_drag(rate);
    let infinite = of(|t| 1.0 / t);
    for error in [
        SparseSplitting::new(&infinite, &SplittingScheme::STRANG, 0.1, from).err(),
        SparseMidpoint::new(&infinite, 0.1, from, None).err(),
        SparseGauss::new(&infinite, 2, 0.1, from, None).err(),
    ] {
        assert!(matches!(error, Some(SparseError::NonFinite { what: "gamma", .. })), "{error:?}");
    }
    let growing = of(|t| -10.0 * t);
    let mut motion = SparseMidpoint::new(&growing, 0.1, from, None).unwrap();
    let halt = motion.advance(100).unwrap_err();
    // |gamma h| reaches 2 at t = 2.
    assert_eq!(halt.taken, 20);
    assert!(matches!(halt.cause, StepError::SigmaVanished { .. }), "{halt}");
}
