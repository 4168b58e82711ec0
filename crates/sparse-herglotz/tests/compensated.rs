//! Compensated sums give the same motion to round-off, with smaller round-off. The system of bodies agrees with that of
//! the library for small systems.

use contact_examples::systems::Bodies;
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, VelocityPoint, check_closed_derivatives};
use discrete_herglotz::{SplittingScheme, Stepper, splitting::Splitting};
use sparse_herglotz::systems::{FputBond, OuterSolarSystem, fput_chain};
use sparse_herglotz::{SparseSplitting, SparseSystem, State};

const SCHEME: SplittingScheme = SplittingScheme::BLANES_MOAN_6;

/// Position, velocity and action after some steps, with and without compensated sums.
fn after(system: &SparseSystem, start: State, h: f64, steps: usize, compensated: bool) -> (Vec<f64>, Vec<f64>, f64) {
    by(&SCHEME, system, start, (h, steps), compensated)
}

fn by(
    scheme: &SplittingScheme,
    system: &SparseSystem,
    start: State,
    (h, steps): (f64, usize),
    compensated: bool,
) -> (Vec<f64>, Vec<f64>, f64) {
    let motion = SparseSplitting::new(system, scheme, h, start).unwrap();
    let mut motion = if compensated { motion.compensated() } else { motion };
    motion.advance(steps).unwrap();
    let State { q, v, z, .. } = motion.state();
    (q.to_vec(), v.to_vec(), z.unwrap())
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// The motions agree for one block and for many blocks, which are distributed over threads, and for equal and different
/// masses.
#[test]
fn the_same_motion() {
    for n in [3, 70, 1500, 200_000] {
        let system = fput_chain(n, FputBond { alpha: 0.3, beta: 0.5 }, -0.02).unwrap();
        let masses = (0..n).map(|i| 1.0 + 0.5 * (i % 3) as f64).collect();
        let q: Vec<f64> = (0..n).map(|i| 0.2 * (0.7 * i as f64).sin()).collect();
        let v: Vec<f64> = (0..n).map(|i| 0.2 * (0.4 * i as f64).cos()).collect();
        for system in [fput_chain(n, FputBond { alpha: 0.3, beta: 0.5 }, -0.02).unwrap().with_masses(masses), system] {
            let start = State { t: 0.0, q: &q, v: &v, z: Some(0.3) };
            let (plain, compensated) = (after(&system, start, 0.1, 20, false), after(&system, start, 0.1, 20, true));
            for (a, b) in plain.0.iter().chain(&plain.1).zip(compensated.0.iter().chain(&compensated.1)) {
                // A few roundings in each stage of 20 steps.
                assert!((a - b).abs() <= 500.0 * f64::EPSILON, "{n} unknowns: {a:e}, {b:e}");
            }
            assert!((plain.2 - compensated.2).abs() <= 500.0 * f64::EPSILON * n as f64, "{n} unknowns: z");
        }
    }
}

/// After a run forward and backward in time, the distance from the start is round-off.
#[test]
fn less_round_off() {
    let system = OuterSolarSystem::system(5, 0.0).unwrap();
    let (q, v) = (OuterSolarSystem::positions(5), OuterSolarSystem::velocities(5));
    let scheme = &SplittingScheme::SOFRONIOU_SPALETTA_10;
    let back = |compensated: bool| {
        let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
        let (q1, v1, _) = by(scheme, &system, start, (150.0, 20_000), compensated);
        let start = State { t: 0.0, q: &q1, v: &v1, z: Some(0.0) };
        distance(&by(scheme, &system, start, (-150.0, 20_000), compensated).0, &q)
    };
    let (plain, compensated) = (back(false), back(true));
    // With 35 stages in each of the 29 steps of Jupiter's period, a kick is less than a hundredth of its velocity and
    // is rounded some ten times.
    assert!(compensated < 0.1 * plain && compensated < 1e-9, "{compensated:e} au, {plain:e} au without");
}

/// A state that is requested in mid-run does not change the run.
#[test]
fn states_that_are_asked_for_change_nothing() {
    let system = OuterSolarSystem::system(3, -1e-6).unwrap();
    let (q, v) = (OuterSolarSystem::positions(3), OuterSolarSystem::velocities(3));
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let new = || SparseSplitting::new(&system, &SCHEME, 100.0, start).unwrap().compensated();
    let (mut at_once, mut one_by_one) = (new(), new());
    at_once.advance(50).unwrap();
    for _ in 0..50 {
        one_by_one.advance(1).unwrap();
        one_by_one.state();
    }
    assert_eq!(at_once.state(), one_by_one.state());
}

/// The systems of bodies of the two libraries are the same: a step is the same map.
#[test]
fn bodies_of_both_libraries() {
    const N: usize = 9;
    let gamma = -1e-4;
    let bodies = Bodies::<N>::new(|i| OuterSolarSystem::MASSES[i], OuterSolarSystem::G, gamma);
    let system = OuterSolarSystem::system(3, gamma).unwrap();
    let (q, v) = (OuterSolarSystem::positions(3), OuterSolarSystem::velocities(3));
    let p = SVector::<f64, N>::from_fn(|d, _| bodies.masses()[d] * v[d]);
    let from = PhasePoint { q: SVector::<f64, N>::from_column_slice(&q), p, z: 0.1 };
    let at = VelocityPoint { q: from.q, v: SVector::from_column_slice(&v), z: 0.1 };
    // The error is relative to the size of the terms.
    let (gradient, _) = check_closed_derivatives(&bodies, 0.0, &at);
    assert!(gradient.is_some_and(|off| off <= 1e-14), "{gradient:?}");
    for wrong in [f64::NAN, f64::INFINITY, 0.0] {
        let bodies = Bodies::<N>::new(|i| if i == 1 { wrong } else { 1.0 }, 1.0, gamma);
        assert!(Splitting::new(&bodies, &SCHEME, 100.0, 0.0, from).is_err(), "a mass of {wrong}");
    }
    let mut small = Splitting::new(&bodies, &SCHEME, 100.0, 0.0, from).unwrap();
    small.advance(50).unwrap();
    let large = after(&system, State { t: 0.0, q: &q, v: &v, z: Some(0.1) }, 100.0, 50, true);
    let state = small.state();
    for d in 0..N {
        let (dq, dp) = (state.q[d] - large.0[d], state.p[d] - bodies.masses()[d] * large.1[d]);
        // Round-off of positions up to 10 au along a revolution of Jupiter.
        assert!(dq.abs() <= 1e-13 && dp.abs() <= 1e-15, "{d}: {dq:e}, {dp:e}");
    }
    assert!((state.z - large.2).abs() <= 1e-14, "{:e}", state.z - large.2);
    // The total momentum is multiplied by the conformal factor.
    let total = |p: &SVector<f64, N>| p.iter().step_by(3).sum::<f64>();
    let (decayed, expected) = (total(&state.p.fixed()), total(&from.p) * (gamma * 5000.0).exp());
    assert!((decayed - expected).abs() <= 1e-14 * expected.abs().max(1e-5), "{decayed:e}, {expected:e}");
}
