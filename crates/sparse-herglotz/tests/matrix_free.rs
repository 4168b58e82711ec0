//! Midpoint steps by conjugate gradients, without forming the matrix, agree with those by matrix factors.

use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::StepError;
use sparse_herglotz::systems::{FputBond, OuterSolarSystem, fput_chain};
use sparse_herglotz::{Potential, SparseMidpoint, SparseSystem, State};

/// The largest difference of positions, velocities and action after the same steps by both solvers, relative to the
/// largest of its kind, and the number of matrix-vector products.
fn apart(system: &SparseSystem, h: f64, start: State, steps: usize) -> (f64, u64) {
    let mut factors = SparseMidpoint::new(system, h, start, None).unwrap();
    let mut products = SparseMidpoint::matrix_free(system, h, start).unwrap();
    factors.advance(steps).unwrap();
    products.advance(steps).unwrap();
    let (a, b) = (factors.state(), products.state());
    let largest = |x: &[f64]| x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let off = |a: &[f64], b: &[f64]| {
        let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        largest(&differences) / largest(b)
    };
    assert!(a.q != start.q && products.factorisations() == 0);
    let (a_z, b_z) = (a.z.unwrap(), b.z.unwrap());
    let z = (a_z - b_z).abs() / b_z.abs().max(1.0);
    (off(a.q, b.q).max(off(a.v, b.v)).max(z), products.products())
}

/// Both solvers stop when a correction is below round-off, so that they may differ by some units of round-off per step.
/// The resulting errors of the positions grow with the number of steps as well.
fn tolerance(steps: usize) -> f64 {
    4.0 * f64::EPSILON * (steps * steps) as f64
}

#[test]
fn planets() {
    for gamma in [0.0, -1e-5] {
        let planets = OuterSolarSystem::system(6, gamma).unwrap();
        let (q, v) = (OuterSolarSystem::positions(6), OuterSolarSystem::velocities(6));
        let (apart, products) = apart(&planets, 40.0, State { t: 0.0, q: &q, v: &v, z: Some(0.3) }, 200);
        assert!(apart <= tolerance(200), "gamma = {gamma}: {apart:e}");
        // A few products per step suffice, since the matrix is close to the identity in the variables of the solver.
        assert!((200..10 * 200).contains(&products), "{products}");
    }
}

#[test]
fn a_chain_from_wall_to_wall() {
    let n = 50;
    let chain = fput_chain(n, FputBond { alpha: 0.25, beta: 1.0 }, -0.05).unwrap();
    let q: Vec<f64> = (1..=n).map(|i| (0.3 * i as f64).sin()).collect();
    // The steps are longer than the time scale of the fastest wave, so that the matrix is far from the identity.
    let (apart, products) = apart(&chain, 1.5, State { t: 0.0, q: &q, v: &vec![0.1; n], z: Some(0.0) }, 40);
    assert!(apart <= tolerance(40), "{apart:e}");
    assert!(products > 40);
}

/// A hill that is too steep for the step: the matrix has a negative eigenvalue.
struct Hill;

impl Potential<1> for Hill {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _c: &[T; 0]) -> T {
        q[0].powi(2) * -50.0
    }
}

#[test]
fn what_is_not_positive_definite_is_a_status() {
    let system = SparseSystem::new(2).and_then(|s| s.with_mass(1.0).with_potential(Hill, [[0], [1]])).unwrap();
    let start = State { t: 0.0, q: &[0.1, 0.2], v: &[0.0, 0.1], z: Some(0.0) };
    let mut motion = SparseMidpoint::matrix_free(&system, 1.0, start).unwrap();
    let halt = motion.advance(3).unwrap_err();
    assert_eq!(halt.taken, 0);
    assert!(matches!(halt.cause, StepError::Singular { .. }), "{:?}", halt.cause);
    assert_eq!(motion.state(), start);
}
