//! Steps of a contact Hamiltonian are bitwise those of their form for a number of coordinates known at compile time. To be
//! removed together with the latter.

use super::{HamiltonianStages, StepDerivatives, step_derivatives, step_jacobian};
use crate::Problem;
use crate::gauss::dynamic::routes::StageRoute;
use crate::gauss::dynamic::system::{PointRef, Typed};
use crate::gauss::routes::StageRoute as _;
use crate::gauss::routes::hamiltonian as typed;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::tables::stage_table::StageTable;
use crate::integration::QuantityDerivatives;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::forget_branches;
use crate::numbers::state_words::{restored_from, words_of};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, ContactHamiltonian, Force, Forced, Lagrangian, OfHamiltonian, PhasePoint, Scalar, VelocityPoint,
};
use pulp::{Simd, WithSimd};

/// One step, compiled for one instruction set.
struct TakeStep<'b, 'a, L, const N: usize>(&'b mut typed::HamiltonianStages<'a, L, N>, f64);

impl<L: Lagrangian<N>, const N: usize> WithSimd for TakeStep<'_, '_, L, N> {
    type Output = IterationOutcome;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> IterationOutcome {
        self.0.take_step::<S>(self.1)
    }
}

/// A chain with masses that depend on the positions, a magnetic term and a rate that depends on z: its stiffness, and the
/// amplitude of a force that depends on time.
#[derive(Debug)]
struct Chain(f64, f64);

impl<const N: usize> ContactHamiltonian<N> for Chain {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        let mut h = z * 0.1 + z * z * 0.02 - t.cos() * q[0] * self.1;
        for i in 0..N {
            let next = q[(i + 1) % N];
            h += (p[i] * p[i] + 1.0).sqrt() * (q[i] * q[i] * 0.1 + 1.0)
                + p[i] * p[(i + 1) % N] * 0.1
                + p[i] * next * 0.2;
            h += ((q[i] - next * 0.5).powi(2) * 2.0 + q[i].powi(4) * 0.3) * self.0;
        }
        h
    }
}

struct Friction;

impl<const N: usize> Force<N> for Friction {
    fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        SVector::from_fn(|i, _| -(x.v[i] * (x.q[i] * x.q[i] + 0.2)) - x.z * 0.05)
    }
}

/// Compares steps by each method of solution, and the words of the two routes after each step.
fn compare<L: Lagrangian<N>, const N: usize>(lagrangian: &L, q: [f64; N], p: [f64; N], h: f64) {
    let (t0, v) = (0.3, SVector::from_element(0.1));
    let state = PhasePoint::new(q, p, 0.1);
    let from = PointRef { q: &q, v: &p, z: 0.1 };
    let system = Typed::<L, N>(lagrangian);
    for s in [1, 2, 5, 8, 16] {
        let mut expected = typed::HamiltonianStages::new(lagrangian, StageTable::new(s, h), &state, &v);
        let mut stages = HamiltonianStages::new(&system, StageTable::new(s, h), from, v.as_slice());
        for k in 0..60 {
            let t = t0 + f64::from(k) * h;
            match k {
                20 => assert_eq!(stages.linearise_at_state(&system, t), expected.linearise_at_state(t)),
                45 => {
                    expected.suspend_newton();
                    stages.suspend_newton();
                }
                47 => stages.reserve_newton(&system),
                50..55 => assert_eq!(stages.solve_stages(&system, t), expected.solve_stages(t)),
                _ => {}
            }
            forget_branches();
            let outcome = Instructions::new().dispatch(TakeStep(&mut expected, t));
            forget_branches();
            assert_eq!(stages.step(&system, t), outcome, "{N} coordinates, {s} stages, step {k}");
            assert_eq!(stages.defect().to_bits(), expected.defect().to_bits());
            let words = words_of(&expected);
            assert_eq!(words_of(&stages), words, "{N} coordinates, {s} stages, step {k}");
            if k == 30 {
                stages = HamiltonianStages::new(&system, StageTable::new(s, h), from, v.as_slice());
                assert!(restored_from(&mut stages, &words));
            }
        }
        compare_derivatives(lagrangian, &state, s, h);
    }
}

/// Compares the derivatives of a step.
fn compare_derivatives<L: Lagrangian<N>, const N: usize>(lagrangian: &L, state: &PhasePoint<N>, s: usize, h: f64) {
    let quantity = |a: f64, x: &PhasePoint<N>| QuantityDerivatives {
        l: a * x.z,
        gradient: ChartVector { x: x.p * a, y: x.q * a, z: a },
        force: x.p * (a * 0.1),
    };
    let mut explicit = |t: f64, x: &PhasePoint<N>| vec![quantity(0.3 + t, x), quantity(-0.7, x)];
    let at = (0.3, state);
    let found = step_derivatives(lagrangian, s, h, at, Some(&mut explicit));
    let expected = typed::step_derivatives(lagrangian, s, h, at, Some(&mut explicit));
    match (found, expected) {
        (Ok(StepDerivatives { state, sources }), Ok(expected)) => {
            assert_eq!((state, sources), (expected.state, expected.sources), "{N} coordinates, {s} stages");
        }
        (found, expected) => assert_eq!(found.err(), expected.err()),
    }
    let problem = Problem::new(lagrangian, 0.3, *state).unwrap();
    assert_eq!(step_jacobian(&problem, s, h, at), typed::step_jacobian(&problem, s, h, at));
}

#[test]
fn steps_are_those_of_the_typed_route() {
    compare(&OfHamiltonian(Chain(1.0, 0.1)), [0.4], [0.3], 0.1);
    compare(&OfHamiltonian(Chain(1.0, 0.1)), [0.7, -0.2], [0.1, 0.4], 0.1);
    compare(&OfHamiltonian(Chain(1.0, 0.1)), [0.3, -0.2, 0.1], [0.2, 0.1, -0.4], 0.1);
    compare(&OfHamiltonian(Chain(1.0, 0.1)), [0.3, -0.2, 0.1, 0.4], [0.2, 0.1, -0.4, 0.0], 0.1);
    compare(&OfHamiltonian(Chain(1.0, 0.1)), [0.3, -0.2, 0.1, 0.4, -0.1, 0.0, 0.2, -0.3, 0.25], [0.1; 9], 0.1);
    let forced = Forced { lagrangian: OfHamiltonian(Chain(1.0, 0.1)), force: Friction };
    compare(&forced, [0.7, -0.2], [0.1, 0.4], 0.05);
    // The fixed-point iteration does not converge.
    compare(&OfHamiltonian(Chain(100.0, 0.1)), [0.7, -0.2], [0.1, 0.4], 0.5);
    // At an equilibrium changes are round-off.
    compare(&OfHamiltonian(Chain(1.0, 0.0)), [0.0, 0.0], [0.0, 0.0], 0.1);
}
