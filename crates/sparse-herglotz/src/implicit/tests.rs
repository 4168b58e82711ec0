//! Compares the assembled matrix of a step with second derivatives of the whole Lagrangian by dual numbers.

use super::SparseMidpoint;
use super::midpoint::LinearSolver;
use crate::{Difference, FIXED, Potential, SparseSystem, State};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, Scalar, VelocityPoint};

const N: usize = 21;
const H: f64 = 0.3;

/// A bond whose force is not an odd function of r.
struct Bond;

impl Potential<1, 1> for Bond {
    #[inline(always)]
    fn energy<T: Scalar>(&self, t: T, r: &SVector<T, 1>, c: &[T; 1]) -> T {
        r[0].sin() * (t + c[0]) + r[0].powi(4) * 0.25
    }
}

/// A potential of three unknowns.
struct Triple;

impl Potential<3> for Triple {
    #[inline(always)]
    fn energy<T: Scalar>(&self, _t: T, q: &SVector<T, 3>, _c: &[T; 0]) -> T {
        (q[0] * q[1] - q[2]).cos() + q[0].powi(2) * q[2]
    }
}

/// The bonds, as one run from wall to wall.
fn bonds() -> impl Iterator<Item = ([usize; 2], [f64; 1])> {
    (0..=N).map(|i| ([i.checked_sub(1).unwrap_or(FIXED), if i == N { FIXED } else { i }], [0.1 * i as f64]))
}

const TRIPLES: [[usize; 3]; 3] = [[4, 17, 0], [FIXED, 3, 20], [9, 5, 1]];

struct Whole;

impl Lagrangian<N> for Whole {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, _z: T) -> T {
        let at = |i: usize| if i == FIXED { T::zero() } else { q[i] };
        let mut l = v.dot(v) * 0.5;
        for ([a, b], c) in bonds() {
            l -= Bond.energy(t, &SVector::from([at(b) - at(a)]), &c.map(T::from));
        }
        for triple in TRIPLES {
            l -= Triple.energy(t, &SVector::from(triple.map(at)), &[]);
        }
        l
    }
}

#[test]
fn the_assembled_matrix_is_that_of_the_whole() {
    let system = SparseSystem::new(N)
        .and_then(|s| s.with_mass(1.0).with_potential(Difference(Bond), bonds()))
        .and_then(|s| s.with_potential(Triple, TRIPLES))
        .unwrap();
    let q: [f64; N] = std::array::from_fn(|i| (1.3 * i as f64).sin());
    let start = State { t: 0.4, q: &q, v: &[0.0; N], z: Some(0.0) };
    let mut midpoint = SparseMidpoint::new(&system, H, start, None).unwrap();
    midpoint.factorise(start.t).unwrap();
    let x = VelocityPoint { q: SVector::from(q), v: SVector::zeros(), z: 0.0 };
    let whole = Whole.hessian(start.t, &x).qq;
    let LinearSolver::Factors(matrix) = &midpoint.solver else { unreachable!() };
    let pattern = matrix.factors.pattern();
    for i in 1..=N {
        for j in 1..=N {
            let at = pattern.entry(i, j);
            let found = matrix.entries.get(at as usize).copied().unwrap_or(0.0);
            let expected = f64::from(i == j) - 0.25 * H * H * whole[(i - 1, j - 1)];
            // Sums of a few terms of size one.
            assert!((found - expected).abs() <= 20.0 * f64::EPSILON, "({i}, {j}): {found}, not {expected}");
        }
    }
    // The pattern holds only the diagonal, the N - 1 bonds between unknowns, and the pairs of triples that are not
    // bonds.
    assert_eq!(pattern.rows.len(), N + N - 1 + 7);
}
