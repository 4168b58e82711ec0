//! Systems of the catalogue compared with closed-form solutions.

use discrete_herglotz::SplittingScheme;
use sparse_herglotz::systems::{Mesh, OuterSolarSystem, cloth, consistent_membrane, membrane};
use sparse_herglotz::{SparseError, SparseGauss, SparseMidpoint, SparseSplitting, State};

/// Nodes, triangles and held boundary nodes of a square of `k x k` cells.
fn square(k: usize) -> (Vec<[f64; 2]>, Vec<[usize; 3]>, Vec<bool>) {
    let nodes: Vec<[f64; 2]> =
        (0..(k + 1) * (k + 1)).map(|i| [(i % (k + 1)) as f64 / k as f64, (i / (k + 1)) as f64 / k as f64]).collect();
    let corner = |i: usize, j: usize| i + (k + 1) * j;
    let triangles = (0..k * k).flat_map(|c| {
        let (i, j) = (c % k, c / k);
        [[corner(i, j), corner(i + 1, j), corner(i, j + 1)], [corner(i + 1, j + 1), corner(i, j + 1), corner(i + 1, j)]]
    });
    let held = nodes.iter().map(|x| x.iter().any(|x| *x == 0.0 || *x == 1.0)).collect();
    (nodes.clone(), triangles.collect(), held)
}

/// The first mode of a square membrane, `sin(pi x) sin(pi y)`, has the frequency `sqrt(2 pi^2 - gamma^2/4)`. The error
/// of linear elements is proportional to the square of their width.
#[test]
fn a_membrane() {
    let (gamma, t) = (-0.5f64, 0.3);
    let pi = std::f64::consts::PI;
    let w = (2.0 * pi * pi - gamma * gamma / 4.0).sqrt();
    let amplitude = (0.5 * gamma * t).exp() * ((w * t).cos() - 0.5 * gamma / w * (w * t).sin());
    let error = |k: usize| {
        let (nodes, triangles, held) = square(k);
        let system = membrane(Mesh { nodes: &nodes, triangles: &triangles, held: &held }, 1.0, gamma).unwrap();
        assert_eq!(system.unknowns(), (k - 1) * (k - 1));
        let mode = |x: &[f64; 2]| (pi * x[0]).sin() * (pi * x[1]).sin();
        let q: Vec<f64> = nodes.iter().zip(&held).filter(|(_, held)| !**held).map(|(x, _)| mode(x)).collect();
        let start = State { t: 0.0, q: &q, v: &vec![0.0; q.len()], z: Some(0.0) };
        let mut motion = SparseSplitting::new(&system, &SplittingScheme::BLANES_MOAN_6, t / 60.0, start).unwrap();
        motion.advance(60).unwrap();
        let end = motion.state().q.to_vec();
        q.iter().zip(&end).fold(0.0f64, |worst, (q, end)| worst.max((end - amplitude * q).abs()))
    };
    let (coarse, fine) = (error(8), error(16));
    // Half the width gives a quarter of the error. The next term of the error is (pi/8)^2 of the first, times a factor
    // below one.
    assert!((coarse / fine - 4.0).abs() < 0.6, "{coarse:e}, {fine:e}");
    assert!(fine < 0.02, "{fine:e}");
}

/// With consistent masses the error is proportional to the square of the width as well. The error of Gauss collocation
/// in time is far below it.
#[test]
fn a_membrane_with_consistent_masses() {
    let (gamma, t) = (-0.5f64, 0.3);
    let pi = std::f64::consts::PI;
    let w = (2.0 * pi * pi - gamma * gamma / 4.0).sqrt();
    let amplitude = (0.5 * gamma * t).exp() * ((w * t).cos() - 0.5 * gamma / w * (w * t).sin());
    // At the centre of the membrane, where the mode is 1.
    let error = |k: usize| {
        let (nodes, triangles, held) = square(k);
        let system =
            consistent_membrane(Mesh { nodes: &nodes, triangles: &triangles, held: &held }, 1.0, gamma).unwrap();
        let mode = |x: &[f64; 2]| (pi * x[0]).sin() * (pi * x[1]).sin();
        let q: Vec<f64> = nodes.iter().zip(&held).filter(|(_, held)| !**held).map(|(x, _)| mode(x)).collect();
        let start = State { t: 0.0, q: &q, v: &vec![0.0; q.len()], z: Some(0.0) };
        let mut motion = SparseGauss::new(&system, 2, t / 30.0, start, None).unwrap();
        motion.advance(30).unwrap();
        // For a constant rate sigma_d is the diagonal Padé approximation of the exponential, with an error of
        // `(gamma h)^5/720 = 4e-15`.
        assert!((motion.sigma() - (gamma * t / 30.0).exp()).abs() < 1e-14, "{}", motion.sigma());
        (motion.q()[q.len() / 2] - amplitude).abs()
    };
    let (coarse, fine) = (error(8), error(16));
    // Half the width gives a quarter of the error, as for the lumped masses.
    assert!((coarse / fine - 4.0).abs() < 0.6, "{coarse:e}, {fine:e}");
    assert!(fine < 0.02, "{fine:e}");
}

#[test]
fn bad_meshes() {
    let (nodes, triangles, held) = square(2);
    let refused = |nodes: &[[f64; 2]], triangles: &[[usize; 3]], held: &[bool]| {
        membrane(Mesh { nodes, triangles, held }, 1.0, 0.0).err().unwrap()
    };
    assert!(matches!(refused(&nodes, &triangles, &held[1..]), SparseError::Length { .. }));
    let out = refused(&nodes, &[[0, 1, 3], [0, 1, 9]], &held);
    assert_eq!(out, SparseError::OutOfRange { list: 0, element: 1, unknown: 9, last: 8 });
    assert!(matches!(refused(&nodes, &[[0, 1, 2]], &held), SparseError::Parameters { value: 0.0, .. }));
    assert!(matches!(refused(&nodes, &triangles, &[true; 9]), SparseError::Unknowns { found: 0, .. }));
    // A free node that belongs to no triangle.
    let lone = membrane(Mesh { nodes: &nodes, triangles: &[[0, 1, 3]], held: &[false; 9] }, 1.0, 0.0).unwrap();
    let zeros = [0.0; 9];
    let start = State { t: 0.0, q: &zeros, v: &zeros, z: Some(0.0) };
    let none = SparseSplitting::new(&lone, &SplittingScheme::STRANG, 0.1, start).err();
    assert_eq!(none, Some(SparseError::Mass { unknown: 2, mass: 0.0 }));
}

/// A free cloth in its natural shape falls with drag, `q = -g (1 + gamma t - e^(gamma t))/gamma^2`. Splittings and the
/// midpoint rule reproduce this to their order, and the lengths of the threads do not change.
#[test]
fn a_cloth_falls() {
    let (g, gamma, t) = (0.7f64, -0.4f64, 2.0f64);
    let system = cloth([6, 5], 3.0, g, gamma).unwrap();
    let q: Vec<f64> = (0..30).flat_map(|i| [f64::from(i % 6), f64::from(i / 6), 0.0]).collect();
    let v = vec![0.0; 90];
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let fallen = -g * ((gamma * t).exp() - 1.0 - gamma * t) / (gamma * gamma);
    let mut explicit = SparseSplitting::new(&system, &SplittingScheme::BLANES_MOAN_6, 0.1, start).unwrap();
    explicit.advance(20).unwrap();
    let mut implicit = SparseMidpoint::new(&system, 0.01, start, None).unwrap();
    implicit.advance(200).unwrap();
    // The error of the first method is 1e-10, that of the second (gamma h)^2/12 of the distance.
    for (end, tolerance) in [(explicit.state(), 1e-9), (implicit.state(), 1e-5)] {
        for i in 0..30 {
            let expected = [q[3 * i], q[3 * i + 1], fallen];
            for (k, expected) in expected.into_iter().enumerate() {
                let found = end.q[3 * i + k];
                assert!((found - expected).abs() < tolerance, "mass {i}, coordinate {k}: {found}, not {expected}");
            }
        }
    }
}

/// Jupiter's orbit closes to within a hundredth of its length after the period of Kepler's third law, 4332.6 days: the
/// initial data and G are consistent.
#[test]
fn jupiter_comes_back() {
    let system = OuterSolarSystem::system(2, 0.0).unwrap();
    let (q, v) = (OuterSolarSystem::positions(2), OuterSolarSystem::velocities(2));
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let mut motion = SparseSplitting::new(&system, &SplittingScheme::BLANES_MOAN_6, 43.326, start).unwrap();
    motion.advance(100).unwrap();
    let end = motion.state().q;
    let away = |q: &[f64]| [0, 1, 2].map(|k| q[3 + k] - q[k]);
    let (a, b) = (away(&q), away(end));
    let missed = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    // The length of the orbit is 33 au.
    assert!(missed < 0.33, "{missed} au");
}
