//! Theoretical properties of the flows of sparse systems: orders, conformal factors, decay of the momenta and of the
//! energy.

use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::SplittingScheme;
use sparse_herglotz::systems::{FputBond, KleinGordon, OuterSolarSystem, SineGordon, fput_chain, lattice};
use sparse_herglotz::{
    LocalLagrangian, SparseError, SparseGauss, SparseMidpoint, SparseSplitting, SparseSystem, State,
};

/// An initial state without symmetry.
fn start(n: usize) -> (Vec<f64>, Vec<f64>) {
    let of = |shift: f64| (0..n).map(|i| 0.8 * (0.37 * i as f64 + shift).sin()).collect();
    (of(0.2), of(1.4))
}

/// Positions, velocities and action after a time.
fn explicit(system: &SparseSystem, scheme: &SplittingScheme, start: State, time: f64, steps: usize) -> Vec<f64> {
    let mut motion = SparseSplitting::new(system, scheme, time / steps as f64, start).unwrap();
    motion.advance(steps).unwrap();
    let end = motion.state();
    [end.q, end.v, &[end.z.unwrap()]].concat()
}

fn implicit(system: &SparseSystem, start: State, time: f64, steps: usize) -> Vec<f64> {
    let mut motion = SparseMidpoint::new(system, time / steps as f64, start, None).unwrap();
    motion.advance(steps).unwrap();
    let end = motion.state();
    [end.q, end.v, &[end.z.unwrap()]].concat()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// The slope of a least-squares fit to the logarithms.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|(h, e)| (h.ln(), e.ln())).unzip();
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (top, bottom) =
        x.iter().zip(&y).fold((0.0, 0.0), |(t, b), (x, y)| (t + (x - mx) * (y - my), b + (x - mx).powi(2)));
    top / bottom
}

/// On a nonlinear chain of 50 sites the measured order of each method is the theoretical one to within 0.15.
#[test]
fn orders() {
    let n = 50;
    let chain = fput_chain(n, FputBond { alpha: 0.3, beta: 1.0 }, -0.1).unwrap();
    let (q, v) = start(n);
    let from = State { t: 0.0, q: &q, v: &v, z: Some(0.2) };
    let exact = explicit(&chain, &SplittingScheme::SOFRONIOU_SPALETTA_10, from, 4.0, 256);
    let check = |name: &str, order: f64, steps: [usize; 4], run: &dyn Fn(usize) -> Vec<f64>| {
        let points = steps.map(|k| (4.0 / k as f64, distance(&run(k), &exact)));
        let found = slope(&points);
        assert!((found - order).abs() <= 0.15, "{name}: order {found}, not {order}: {points:?}");
        // Above the round-off of some 1e3 stages of 50 sites.
        assert!(points[3].1 > 1e-12, "{name}: {points:?} is round-off");
    };
    for (scheme, steps) in [
        (SplittingScheme::STRANG, [128, 192, 256, 384]),
        (SplittingScheme::BLANES_MOAN_4, [64, 96, 128, 160]),
        (SplittingScheme::BLANES_MOAN_6, [32, 40, 48, 64]),
    ] {
        check(scheme.name(), f64::from(scheme.order()), steps, &|k| explicit(&chain, &scheme, from, 4.0, k));
    }
    check("midpoint", 2.0, [128, 192, 256, 384], &|k| implicit(&chain, from, 4.0, k));
}

/// With free ends and no forces on single sites the total momentum is multiplied by `sigma_d` in each step of any
/// method.
#[test]
fn momenta_decay_with_the_conformal_factor() {
    let size = [12, 5, 3];
    let n = size.iter().product();
    let free = KleinGordon { mass_squared: 0.0, lambda: 0.0 };
    let system = lattice(size, free, 2.0, -0.3).unwrap();
    let (q, v) = start(n);
    let v: Vec<f64> = v.iter().map(|v| v + 0.5).collect();
    let from = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let (h, steps) = (0.1, 50);
    let before: f64 = v.iter().sum();
    // The forces on the ends of a bond are exactly opposite; each unknown is rounded about four times per stage, at
    // random.
    let tolerance = |stages: usize| 4.0 * f64::EPSILON * (n * steps * stages) as f64;
    for scheme in [SplittingScheme::STRANG, SplittingScheme::BLANES_MOAN_6_LONG] {
        let mut motion = SparseSplitting::new(&system, &scheme, h, from).unwrap();
        motion.advance(steps).unwrap();
        let after: f64 = motion.state().v.iter().sum();
        let expected = before * (-0.3 * h * steps as f64).exp();
        assert!((after - expected).abs() <= tolerance(scheme.stages()), "{}: {after} {expected}", scheme.name());
    }
    let mut motion = SparseMidpoint::new(&system, h, from, None).unwrap();
    motion.advance(steps).unwrap();
    let after: f64 = motion.state().v.iter().sum();
    let expected = before * motion.sigma().powi(steps as i32);
    // Newton's method stops within the round-off of q/h.
    assert!((after - expected).abs() <= tolerance(1) / h, "midpoint: {after} {expected}");
}

/// The energy `E_L` of an autonomous system is multiplied by `e^(gamma t)` along the motion. A splitting reproduces
/// this with an error of its order, which does not grow with time.
#[test]
fn energy_decays() {
    let system = lattice([16, 16], SineGordon { omega_squared: 1.0 }, 1.0, -0.05).unwrap();
    let n = system.unknowns();
    let (q, v) = start(n);
    let from = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let before = system.energy(from).unwrap();
    let defect = |h: f64| {
        let mut motion = SparseSplitting::new(&system, &SplittingScheme::STRANG, h, from).unwrap();
        let mut worst = 0.0f64;
        for _ in 0..10 {
            motion.advance((4.0 / h).round() as usize).unwrap();
            let end = motion.state();
            let (e, t) = (system.energy(end).unwrap(), end.t);
            worst = worst.max((e * (0.05 * t).exp() / before - 1.0).abs());
        }
        worst
    };
    // The frequencies of the lattice are below 3: the error of Strang is about (3 h)^2/24 at h = 0.05.
    let (coarse, fine) = (defect(0.05), defect(0.025));
    assert!(coarse < 1e-3 && fine > 1e-8, "{coarse:e}, {fine:e}");
    assert!((coarse / fine).log2() > 1.8, "order of the energy's error: {coarse:e}, {fine:e}");
}

/// A drag as a general term of one unknown.
struct Drag;

impl LocalLagrangian<1> for Drag {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, _v: &SVector<T, 1>, z: T, _c: &[T; 0]) -> T {
        z * -0.1
    }
}

/// A motion that starts without the action has none later. The energy is then refused if L depends on the action, and
/// is the same otherwise.
#[test]
fn no_energy_without_the_action() {
    let (q, v) = start(50);
    let from = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    for gamma in [-0.1, 0.0] {
        let chain = fput_chain(50, FputBond { alpha: 0.3, beta: 1.0 }, gamma).unwrap();
        let energy = |state: State| {
            assert_eq!(state.z, None);
            chain.energy(state)
        };
        let without = State { z: None, ..from };
        let mut splitting = SparseSplitting::new(&chain, &SplittingScheme::STRANG, 0.05, without).unwrap();
        let mut midpoint = SparseMidpoint::new(&chain, 0.05, without, None).unwrap();
        let mut gauss = SparseGauss::new(&chain, 2, 0.05, without, None).unwrap();
        splitting.advance(20).unwrap();
        midpoint.advance(20).unwrap();
        gauss.advance(20).unwrap();
        let energies = [splitting.state(), midpoint.state(), gauss.state().unwrap()].map(energy);
        let mut with = SparseSplitting::new(&chain, &SplittingScheme::STRANG, 0.05, from).unwrap();
        with.advance(20).unwrap();
        let with = with.state();
        assert_eq!((with.q, with.z.is_some()), (splitting.state().q, true));
        let expected = chain.energy(with).unwrap();
        for found in energies {
            if gamma == 0.0 {
                // The error of second-order steps of 0.05 for waves of frequencies up to 4.
                assert!((found.unwrap() / expected - 1.0).abs() < 0.01, "{found:?}, {expected}");
            } else {
                assert_eq!(found, Err(SparseError::NoAction));
            }
        }
    }
    // A general term may depend on z.
    let general =
        fput_chain(50, FputBond { alpha: 0.0, beta: 1.0 }, 0.0).and_then(|s| s.with_term(Drag, [[3]])).unwrap();
    let refused = SparseGauss::new(&general, 2, 0.05, State { z: None, ..from }, None).err();
    assert_eq!(refused, Some(SparseError::NoAction));
    assert!(SparseGauss::new(&general, 2, 0.05, from, None).is_ok());
}

/// The error for the outer solar system with drag is that without drag: no part of it is proportional to the drag.
///
/// An orbit with drag differs from one without even in the time `tau = int e^(gamma t) dt`, so each is compared with
/// its own reference solution.
#[test]
fn outer_solar_system() {
    let (q, v) = (OuterSolarSystem::positions(6), OuterSolarSystem::velocities(6));
    let from = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let error = |gamma: f64, steps: usize| {
        let system = OuterSolarSystem::system(6, gamma).unwrap();
        let exact = explicit(&system, &SplittingScheme::SOFRONIOU_SPALETTA_10, from, 20_000.0, 400);
        let found = explicit(&system, &SplittingScheme::BLANES_MOAN_4, from, 20_000.0, steps);
        distance(&found[..18], &exact[..18])
    };
    let free = error(0.0, 100);
    // A drag of 1e-6/day does not halve any orbit in 20 000 days. Its error as a force of low order would be 1e-6 * h
    // of each position.
    for gamma in [-1e-7, -1e-6] {
        let dragged = error(gamma, 100);
        assert!(dragged < 1.5 * free && free > 1e-9, "gamma {gamma:e}: {dragged:e}, without {free:e}");
    }
}
