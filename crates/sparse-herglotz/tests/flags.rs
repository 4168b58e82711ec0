//! Steps that do not resolve the motion are flagged, and steps that do are not.

use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::{SplittingScheme, UnresolvedStep};
use sparse_herglotz::systems::{FputBond, OuterSolarSystem, SineGordon, bodies, fput_chain, lattice};
use sparse_herglotz::{LocalLagrangian, Potential, SparseGauss, SparseMidpoint, SparseSplitting, SparseSystem, State};

/// The flag after some steps, and the largest component of the position.
fn explicit(system: &SparseSystem, start: State, h: f64, steps: usize) -> (Option<UnresolvedStep>, f64) {
    let mut motion = SparseSplitting::new(system, &SplittingScheme::STRANG, h, start).unwrap();
    motion.advance(steps).unwrap();
    let largest = motion.state().q.iter().fold(0.0f64, |most, q| most.max(q.abs()));
    (motion.unresolved(), largest)
}

/// A lattice whose fastest waves have the frequency 5.7. Steps of 0.4 are unstable for a drag of either sign with the
/// action, and without it if gamma is not positive.
#[test]
fn an_unstable_lattice() {
    let q: Vec<f64> = (0..8000).map(|i| 0.1 * (0.7 * i as f64).sin()).collect();
    let v = vec![0.0; 8000];
    for (gamma, z) in [(-0.01, Some(0.0)), (-0.01, None), (0.0, None), (0.01, Some(0.0))] {
        let system = lattice([100, 80], SineGordon { omega_squared: 1.0 }, 4.0, gamma).unwrap();
        let start = State { t: 0.0, q: &q, v: &v, z };
        let (found, largest) = explicit(&system, start, 0.4, 50);
        assert!(largest > 1e3, "{largest:e}");
        assert!(found.is_some_and(|s| s.step < 50 && s.defect > 1.0), "gamma = {gamma}, {z:?}: {found:?}");
        // Once detected, the flag is kept.
        let later = explicit(&system, start, 0.4, 300).0;
        assert!(later.is_some_and(|s| s.step < 64), "{later:?}");
        for (h, steps) in [(0.1, 1100), (-0.1, 200), (0.2, 100)] {
            let (found, largest) = explicit(&system, start, h, steps);
            // Waves with a total amplitude of 0.1 add up to some times that value at single sites, and grow by at most
            // e^(0.01 * 110).
            assert!(found.is_none() && largest < 1.0, "h = {h}: {found:?}, {largest}");
        }
    }
}

/// Two bodies that fall onto each other: a step close to the collision does not approximate the motion.
#[test]
fn two_bodies_head_on() {
    let (q, v) = ([-0.5, 0.0, 0.0, 0.5, 0.0, 0.0], [0.0; 6]);
    for (gamma, z) in [(0.0, Some(0.0)), (-0.05, Some(0.0)), (-0.05, None)] {
        let system = bodies(&[1.0, 1.0], 1.0, gamma).unwrap();
        let start = State { t: 0.0, q: &q, v: &v, z };
        for scheme in [SplittingScheme::STRANG, SplittingScheme::BLANES_MOAN_6] {
            for (h, steps, hit) in [(0.01, 40, false), (0.01, 200, true), (0.003, 1100, true)] {
                let mut motion = SparseSplitting::new(&system, &scheme, h, start).unwrap();
                motion.advance(steps).unwrap();
                let found = motion.unresolved();
                assert_eq!(found.is_some(), hit, "{}, gamma = {gamma}, {z:?}, h = {h}: {found:?}", scheme.name());
            }
        }
    }
}

/// A softened attracting centre, as a general term with its own drag, or as a potential.
struct Centre;

impl LocalLagrangian<1> for Centre {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T, _c: &[T; 0]) -> T {
        v[0] * v[0] * 0.5 + (q[0].powi(2) + 1e-3).sqrt().recip() - z * 0.01
    }
}

impl Potential<1> for Centre {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _c: &[T; 0]) -> T {
        -(q[0].powi(2) + 1e-3).sqrt().recip()
    }
}

/// A motion from rest at 1 stays within 1. If steps jump over the centre and gain enough energy to escape, they must be
/// flagged or have ended with an error. Short steps away from the centre are not flagged.
#[test]
fn implicit_steps_past_a_centre() {
    let start = State { t: 0.0, q: &[1.0, 0.8], v: &[0.0, 0.0], z: Some(0.0) };
    let general = SparseSystem::new(2).and_then(|s| s.with_term(Centre, [[0], [1]])).unwrap();
    let plain = SparseSystem::new(2).and_then(|s| s.with_mass(1.0).with_potential(Centre, [[0], [1]])).unwrap();
    let free = |q: &[f64]| q.iter().any(|q| q.abs() > 1.5);
    let mut flagged = [0; 2];
    for k in 0..40 {
        let h = 0.05 + 0.01 * f64::from(k);
        for (which, system) in [&general, &plain].into_iter().enumerate() {
            for stages in [1, 2] {
                let mut motion = SparseGauss::new(system, stages, h, start, None).unwrap();
                let done = motion.advance((10.0 / h) as usize);
                let found = motion.unresolved();
                assert!(done.is_err() || found.is_some() || !free(motion.q()), "{which}, {stages}, h = {h}");
                flagged[which] += usize::from(done.is_ok() && found.is_some());
            }
        }
        let mut motion = SparseMidpoint::new(&plain, h, start, None).unwrap();
        let done = motion.advance((10.0 / h) as usize);
        let found = motion.unresolved();
        assert!(done.is_err() || found.is_some() || !free(motion.state().q), "midpoint, h = {h}");
    }
    assert!(flagged.iter().all(|count| *count > 0), "{flagged:?}");
    for system in [&general, &plain] {
        let mut motion = SparseGauss::new(system, 2, 0.02, start, None).unwrap();
        motion.advance(30).unwrap();
        assert_eq!(motion.unresolved(), None);
    }
}

/// A rate so large that the rational conformal factor of a step does not approximate the exponential.
#[test]
fn a_strong_drag() {
    let (q, v) = ([0.1; 5], [0.0; 5]);
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    for (gamma, flagged) in [(-2.0, false), (-16.0, true)] {
        let chain = fput_chain(5, FputBond { alpha: 0.0, beta: 1.0 }, gamma).unwrap();
        let mut midpoint = SparseMidpoint::new(&chain, 0.1, start, None).unwrap();
        let mut gauss = SparseGauss::new(&chain, 1, 0.1, start, None).unwrap();
        assert_eq!([midpoint.unresolved().is_some(), gauss.unresolved().is_some()], [flagged; 2]);
    }
}

/// A site that is driven by a short pulse in time, or periodically.
struct Driven {
    pulse: bool,
}

impl Potential<1> for Driven {
    #[inline(always)]
    fn energy<T: Scalar>(&self, t: T, q: &SVector<T, 1>, _c: &[T; 0]) -> T {
        let force = if self.pulse { (-((t - T::from(9.0)) * (t - T::from(9.0)) * 4.0)).exp() * 30.0 } else { t.sin() };
        q[0] * q[0] * 0.5 - q[0] * force
    }
}

/// Resolved motions are not flagged: time-dependent systems and drags, motions that approach rest or are at rest,
/// planets.
#[test]
fn no_false_flags() {
    let (q, v) = ([0.01, 0.0, -0.02], [0.0; 3]);
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    for pulse in [false, true] {
        for z in [Some(0.0), None] {
            let system = SparseSystem::new(3)
                .and_then(|s| s.with_mass(1.0).with_drag(-0.01).with_potential(Driven { pulse }, [[0], [1], [2]]))
                .unwrap();
            let (found, largest) = explicit(&system, State { z, ..start }, 0.05, 2000);
            assert!(found.is_none() && largest > 0.5, "pulse: {pulse}: {found:?}, {largest}");
        }
    }
    // The rate is positive half of the time.
    let chain = || fput_chain(3, FputBond { alpha: 0.0, beta: 0.1 }, 0.0).unwrap();
    let swaying = chain().with_timed_drag(|t| 0.3 * (0.5 * t).sin());
    assert_eq!(explicit(&swaying, start, 0.05, 2000).0, None);
    // Motions that approach rest, and a motion at rest.
    let damped = chain().with_drag(-0.5);
    let rest = State { q: &[0.0; 3], ..start };
    for start in [start, rest] {
        assert_eq!(explicit(&damped, start, 0.05, 20_000).0, None);
        let mut midpoint = SparseMidpoint::new(&damped, 0.05, start, None).unwrap();
        let mut gauss = SparseGauss::new(&damped, 2, 0.05, start, None).unwrap();
        midpoint.advance(3000).unwrap();
        gauss.advance(3000).unwrap();
        assert_eq!([midpoint.unresolved(), gauss.unresolved()], [None; 2]);
    }
    let planets = OuterSolarSystem::system(6, -1e-7).unwrap();
    let (q, v) = (OuterSolarSystem::positions(6), OuterSolarSystem::velocities(6));
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    assert_eq!(explicit(&planets, start, 50.0, 5000).0, None);
}
