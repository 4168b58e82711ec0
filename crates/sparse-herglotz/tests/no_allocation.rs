//! Steps of sparse systems do not allocate, except for new factorisations; and the memory of a long chain is
//! bounded.

#[path = "../../../tests/common/counting_allocator.rs"]
mod counting_allocator;

use counting_allocator::{allocations, held, peak};
use discrete_herglotz::SplittingScheme;
use discrete_herglotz::constraints::OffConstraint;
use sparse_herglotz::systems::{FputBond, OuterSolarSystem, RodChain, SineGordon, fput_chain, lattice};
use sparse_herglotz::{SparseError, SparseGauss, SparseMidpoint, SparseRattle, SparseSplitting, State};

#[test]
fn steps() {
    assert!(allocations(|| drop(std::hint::black_box(vec![1.0; 8]))) >= 1, "the counter counts");
    let n = 3000;
    let chain = fput_chain(n, FputBond { alpha: 0.1, beta: 1.0 }, -0.01).unwrap();
    let (q, v) = (vec![0.5; n], vec![0.1; n]);
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let mut explicit = SparseSplitting::new(&chain, &SplittingScheme::BLANES_MOAN_6, 0.1, start).unwrap();
    explicit.state();
    let found = allocations(|| {
        explicit.advance(300).unwrap();
        explicit.state();
    });
    assert_eq!(found, 0);
    // With compensated sums, and with elements outside runs.
    let planets = OuterSolarSystem::system(5, -1e-8).unwrap();
    let (at, moving) = (OuterSolarSystem::positions(5), OuterSolarSystem::velocities(5));
    let begin = State { t: 0.0, q: &at, v: &moving, z: Some(0.0) };
    let mut bodies =
        SparseSplitting::new(&planets, &SplittingScheme::BLANES_MOAN_6, 100.0, begin).unwrap().compensated();
    let found = allocations(|| {
        bodies.advance(300).unwrap();
        bodies.state();
    });
    assert_eq!(found, 0);
    let mut implicit = SparseMidpoint::new(&chain, 0.05, start, None).unwrap();
    implicit.advance(5).unwrap();
    let before = implicit.factorisations();
    assert_eq!(allocations(|| implicit.advance(50).unwrap()), 0);
    assert!(
        implicit.factorisations() - before <= 5,
        "{} factorisations in 50 steps",
        implicit.factorisations() - before
    );
}

/// Steps of RATTLE do not allocate, although they factorise a matrix.
#[test]
fn steps_of_rods() {
    let rods = RodChain { links: 64, length: 1.0 / 64.0, mass: 1.0 / 64.0, gravity: 9.81 };
    let (chain, q) = (rods.system(-0.1).unwrap(), rods.straight(0.5));
    let v = vec![0.0; q.len()];
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let mut motion = SparseRattle::new(&chain, &SplittingScheme::SUZUKI_4, 1e-3, start, OffConstraint::Refuse).unwrap();
    motion.advance(2).unwrap();
    let found = allocations(|| {
        motion.advance(100).unwrap();
        motion.multipliers().unwrap();
    });
    assert_eq!(found, 0);
}

/// A chain and its motion hold at most six vectors, including the initial state of the user.
#[test]
fn memory_of_a_chain() {
    let n = 100_000;
    let bytes = peak(|| {
        let (q, v) = (vec![0.5; n], vec![0.1; n]);
        let chain = fput_chain(n, FputBond { alpha: 0.1, beta: 1.0 }, -0.01).unwrap();
        let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
        let mut motion = SparseSplitting::new(&chain, &SplittingScheme::BLANES_MOAN_6, 0.1, start).unwrap();
        motion.advance(2).unwrap();
        motion.state();
    });
    // The lists of blocks may take 64 kB more.
    assert!(bytes <= 6 * 8 * n as isize + 65_536, "{bytes} bytes, {} vectors", bytes as f64 / (8 * n) as f64);
}

/// Steps of Gauss collocation with kept factors do not allocate, and the memory held is within the estimate that is
/// compared with the limit.
#[test]
fn memory_of_gauss() {
    let side = 40;
    let n = side * side;
    let system = lattice([side, side], SineGordon { omega_squared: 1.0 }, 1.0, -0.01).unwrap();
    let q: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).sin()).collect();
    let v = vec![0.0; n];
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let Some(SparseError::Memory { needed, limit: 1 }) = SparseGauss::new(&system, 2, 0.05, start, Some(1)).err()
    else {
        panic!("a byte is not enough");
    };
    assert!(SparseGauss::new(&system, 2, 0.05, start, Some(needed - 1)).is_err());
    let before = held();
    let mut motion = SparseGauss::new(&system, 2, 0.05, start, Some(needed)).unwrap();
    motion.advance(5).unwrap();
    let held = held() - before;
    // The estimate does not include the vectors, and the pattern and the lists of indices: some 30 and 60 numbers for
    // each unknown.
    assert!(held <= needed as isize + 100 * 8 * n as isize, "{held} bytes are held, {needed} were estimated");
    // The estimate is not excessively large either.
    assert!(held >= needed as isize / 20, "{held} bytes are held, {needed} were estimated");
    let factorisations = motion.factorisations();
    let found = allocations(|| motion.advance(10).unwrap());
    assert!(motion.factorisations() > factorisations || found == 0, "{found} allocations");
}
