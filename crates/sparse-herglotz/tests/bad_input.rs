//! Invalid input is a typed error that contains the element or the unknown; a failure during the motion is a status.

use discrete_herglotz::{InputError, SplittingScheme, StepError};
use sparse_herglotz::systems::{FputBond, Gravitation, OuterSolarSystem, SineGordon, Spring, fput_chain, lattice};
use sparse_herglotz::{Difference, FIXED, SparseError, SparseMidpoint, SparseSplitting, SparseSystem, State};

fn chain() -> SparseSystem {
    fput_chain(20, FputBond { alpha: 0.0, beta: 1.0 }, -0.1).unwrap()
}

fn of(system: SparseSystem, elements: &[[usize; 2]]) -> Option<SparseError> {
    system.with_potential(Difference(Spring { stiffness: 1.0 }), elements.iter().copied()).err()
}

/// The error of an explicit and an implicit method, which must be the same.
fn refused(system: &SparseSystem, h: f64, start: State) -> SparseError {
    let explicit = SparseSplitting::new(system, &SplittingScheme::STRANG, h, start).err().unwrap();
    let implicit = SparseMidpoint::new(system, h, start, None).err().unwrap();
    // Compared as text, since a NaN in an error is not equal to itself.
    assert_eq!(explicit.to_string(), implicit.to_string());
    explicit
}

#[test]
fn elements() {
    let system = || SparseSystem::new(3).unwrap();
    let many: Vec<[usize; 2]> = (0..40).map(|i| [i, i + 1]).collect();
    assert_eq!(
        of(system(), &[[0, 1], [1, 3]]),
        Some(SparseError::OutOfRange { list: 0, element: 1, unknown: 3, last: 2 })
    );
    // An unknown within a run of elements is checked as well.
    let large = SparseSystem::new(30).unwrap();
    assert_eq!(of(large, &many), Some(SparseError::OutOfRange { list: 0, element: 29, unknown: 30, last: 29 }));
    assert_eq!(of(chain(), &[[0, 1], [5, 5]]), Some(SparseError::Repeated { list: 1, element: 1, unknown: 5 }));
    assert_eq!(of(system(), &[[FIXED, FIXED]]), None);
    let weighted =
        system().with_potential(Difference(Gravitation), [([0, 1, 2, FIXED, FIXED, FIXED], [f64::INFINITY])]);
    assert_eq!(weighted.err(), Some(SparseError::Parameter { list: 0, element: 0, value: f64::INFINITY }));
    for n in [0, usize::MAX] {
        assert!(matches!(SparseSystem::new(n), Err(SparseError::Unknowns { found, .. }) if found == n));
    }
    assert!(matches!(lattice([3, 0], SineGordon { omega_squared: 1.0 }, 1.0, 0.0), Err(SparseError::Unknowns { .. })));
    assert!(matches!(OuterSolarSystem::system(7, 0.0), Err(SparseError::Parameters { .. })));
}

#[test]
fn starts_and_steps() {
    let (q, v) = (vec![0.1; 20], vec![0.0; 20]);
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let system = chain();
    for h in [0.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(refused(&system, h, start), SparseError::Input(InputError::Step { .. })));
    }
    let short = refused(&system, 0.1, State { q: &q[..19], ..start });
    assert_eq!(short, SparseError::Length { what: "q", found: 19, expected: 20 });
    let bad = [&v[..7], &[f64::INFINITY], &v[8..]].concat();
    let infinite = refused(&system, 0.1, State { v: &bad, ..start });
    assert_eq!(infinite, SparseError::NonFinite { what: "v", index: 7, value: f64::INFINITY });
    assert!(matches!(refused(&system, 0.1, State { t: f64::NAN, ..start }), SparseError::NonFinite { what: "t", .. }));
    assert!(matches!(
        refused(&system, 0.1, State { z: Some(f64::NAN), ..start }),
        SparseError::NonFinite { what: "z", .. }
    ));
    let drag = refused(&chain().with_drag(f64::NAN), 0.1, start);
    assert!(matches!(drag, SparseError::NonFinite { what: "gamma", .. }));
    let mut masses = vec![1.0; 20];
    masses[11] = 0.0;
    assert_eq!(refused(&chain().with_masses(masses), 0.1, start), SparseError::Mass { unknown: 11, mass: 0.0 });
    let none = SparseSystem::new(20).unwrap();
    assert_eq!(refused(&none, 0.1, start), SparseError::Mass { unknown: 0, mass: 0.0 });
    let few = refused(&chain().with_masses(vec![1.0; 19]), 0.1, start);
    assert_eq!(few, SparseError::Length { what: "the masses", found: 19, expected: 20 });
    // The force between two bodies at the same position is infinite.
    let solar = OuterSolarSystem::system(2, 0.0).unwrap();
    assert_eq!(
        refused(&solar, 1.0, State { q: &[1.0; 6], v: &[0.0; 6], ..start }),
        SparseError::Undefined { unknown: 0 }
    );
    // sigma_d = (1 + gamma h/2)/(1 - gamma h/2) is not positive.
    let long = SparseMidpoint::new(&system, 30.0, start, None).err();
    assert!(matches!(long, Some(SparseError::Input(InputError::Sigma { sigma })) if sigma < 0.0));
}

/// The memory for the factors is estimated, and refused if necessary, before it is allocated.
#[test]
fn too_little_memory() {
    let system = lattice([30, 30], SineGordon { omega_squared: 1.0 }, 1.0, 0.0).unwrap();
    let zeros = vec![0.0; 900];
    let start = State { t: 0.0, q: &zeros, v: &zeros, z: Some(0.0) };
    let Some(SparseError::Memory { needed, limit: 1000 }) = SparseMidpoint::new(&system, 0.1, start, Some(1000)).err()
    else {
        panic!("1000 bytes are not enough");
    };
    // The estimate is larger than the matrix itself, 900 + 1740 entries of 8 bytes.
    assert!(needed > 2640 * 8, "{needed}");
    assert!(SparseMidpoint::new(&system, 0.1, start, Some(needed)).is_ok());
    assert!(SparseMidpoint::new(&system, 0.1, start, Some(needed - 1)).is_err());
}

/// An unbounded motion ends with a status. The implicit method then keeps the state before the failed step.
#[test]
fn motions_that_end() {
    // Bonds repel beyond r = 1: positions become infinite in finite time.
    let unbound = fput_chain(20, FputBond { alpha: 0.0, beta: -1.0 }, 0.0).unwrap();
    let q: Vec<f64> = (0..20).map(|i| if i % 2 == 0 { 3.0 } else { -3.0 }).collect();
    let v = vec![0.0; 20];
    let start = State { t: 0.0, q: &q, v: &v, z: Some(0.0) };
    let mut explicit = SparseSplitting::new(&unbound, &SplittingScheme::STRANG, 0.1, start).unwrap();
    let halt = explicit.advance(1000).unwrap_err();
    assert_eq!((halt.cause, halt.taken), (StepError::NonFinite, 0));
    let mut implicit = SparseMidpoint::new(&unbound, 0.01, start, None).unwrap();
    let halt = implicit.advance(1000).unwrap_err();
    assert!(halt.taken > 0 && halt.taken < 1000, "{halt:?}");
    let state = implicit.state();
    assert_eq!(state.t, halt.taken as f64 * 0.01);
    assert!(state.q.iter().chain(state.v).all(|x| x.is_finite()));
}
