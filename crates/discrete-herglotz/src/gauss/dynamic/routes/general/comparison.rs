//! Steps of the general route are bitwise those of its form for a number of coordinates known at compile time. To be
//! removed together with the latter.

use super::{Extension, General};
use crate::gauss::dynamic::routes::StageRoute;
use crate::gauss::dynamic::routes::transformed::TransformedStepper;
use crate::gauss::dynamic::stages::equations::{
    Given as DynamicGiven, Products as DynamicProducts, StageEquations as DynamicEquations, Workspace,
};
use crate::gauss::dynamic::stages::mass_matrix::Mass;
use crate::gauss::dynamic::system::{PointRef, Typed};
use crate::gauss::initial_mass::InitialMass;
use crate::gauss::routes::StageRoute as _;
use crate::gauss::routes::general::General as TypedGeneral;
use crate::gauss::routes::transformed::TransformedStepper as TypedStepper;
use crate::gauss::stages::equations::{Given, Products, StageEquations};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::mass_matrix::Mass as TypedMass;
use crate::gauss::stages::parametrization::{Extension as TypedExtension, Parametrization, Physical};
use crate::gauss::tables::stage_table::StageTable;
use crate::integration::depends_on_action;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::forget_branches;
use crate::numbers::state_words::words_of;
use crate::test_lagrangians::{Curved, InPlane, OnLine};
use crate::{Problem, Stepper};
use contact_examples::systems::{DoublePendulum, Kepler, QuadraticInZ};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{Force, Forced, Lagrangian, Scalar, VelocityPoint};
use pulp::{Simd, WithSimd};

/// One step, compiled for one instruction set.
struct TakeStep<'b, 'a, L, P, const N: usize>(&'b mut TypedGeneral<'a, L, P, N>, f64);

impl<L: Lagrangian<N>, P: Parametrization<N>, const N: usize> WithSimd for TakeStep<'_, '_, L, P, N> {
    type Output = IterationOutcome;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> IterationOutcome {
        self.0.take_step::<S>(self.1)
    }
}

/// A chain with masses that depend on the positions, a nonlinear coupling and a rate that depends on z.
#[derive(Debug)]
struct Chain;

impl<const N: usize> Lagrangian<N> for Chain {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let mut l = -z * 0.1 - z * z * 0.02 + t.cos() * q[0] * 0.1;
        for i in 0..N {
            let next = q[(i + 1) % N];
            l += v[i] * v[i] * (q[i] * q[i] * 0.1 + 1.0) * 0.5 + v[i] * v[(i + 1) % N] * 0.1;
            l -= (q[i] - next * 0.5).powi(2) * 2.0 + q[i].powi(4) * 0.3;
        }
        l
    }
}

struct Friction;

impl<const N: usize> Force<N> for Friction {
    fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        SVector::from_fn(|i, _| -(x.v[i] * (x.q[i] * x.q[i] + 0.2)) - x.z * 0.05)
    }
}

/// Compares steps by each method of solution, and the words of the two routes after each step.
fn compare<L: Lagrangian<N>, const N: usize>(lagrangian: &L, q: [f64; N], v: [f64; N], h: f64) {
    for s in [1, 2, 5, 8, 16] {
        let problem = Problem::new(lagrangian, 0.3, VelocityPoint::new(q, v, 0.1)).unwrap();
        let Problem { t0, start, state, structure, .. } = problem;
        let InitialMass { inverse, .. } = InitialMass::of(&problem).unwrap();
        let mass = Mass::new(&structure, DMatrix::from_column_slice(N, N, inverse.as_slice()));
        let drives = depends_on_action(lagrangian, &structure);
        let mut typed = TypedGeneral::new(
            lagrangian,
            TypedExtension::new(Physical, t0, 0.0),
            StageTable::new(s, h),
            TypedMass::new(&structure, inverse),
            drives,
            &state,
            &start.v,
        );
        let from = PointRef { q: state.q.as_slice(), v: state.p.as_slice(), z: state.z };
        let extension = (Extension::new(t0, 0.0), false);
        let mut general = General::new(extension, StageTable::new(s, h), mass, drives, from, start.v.as_slice());
        let system = Typed::<L, N>(lagrangian);
        for k in 0..60 {
            let t = t0 + f64::from(k) * h;
            match k {
                20 => assert_eq!(typed.linearise_at_state(t), general.linearise_at_state(&system, t)),
                45 => {
                    typed.suspend_newton();
                    general.suspend_newton();
                }
                50..55 => assert_eq!(typed.solve_stages(t), general.solve_stages(&system, t)),
                _ => {}
            }
            forget_branches();
            let expected = Instructions::new().dispatch(TakeStep(&mut typed, t));
            forget_branches();
            let outcome = general.step(&system, t);
            assert_eq!(outcome, expected, "{N} coordinates, {s} stages, step {k}");
            assert_eq!(general.defect.to_bits(), typed.defect.to_bits());
            let (words, expected) = (words_of(&general), words_of(&typed));
            assert_eq!(words, expected, "{N} coordinates, {s} stages, step {k}");
        }
        between_ends(lagrangian, q, v, s, h);
    }
}

/// Compares Newton's method between given ends.
fn between_ends<L: Lagrangian<N>, const N: usize>(lagrangian: &L, q: [f64; N], v: [f64; N], s: usize, h: f64) {
    let (q0, u): (SVector<f64, N>, SVector<f64, N>) = (q.into(), v.into());
    let (q1, z0) = (q0 + u * h, 0.1);
    let (products, given) = (Products::new(s, h), Given::Ends { q0, q1, z0 });
    let equations = StageEquations { lagrangian, products: &products, t: 0.3 };
    let mut work = equations.workspace(&given);
    let expected = equations.solve(&given, &u, &u, &mut work);

    let (system, products) = (Typed::<L, N>(lagrangian), DynamicProducts::new(s, h));
    let given = DynamicGiven::Ends { q0: q0.as_slice(), q1: q1.as_slice(), z0 };
    let mut dynamic = Workspace::new(&system, s, true);
    let equations = DynamicEquations { system: &system, products: &products, t: 0.3 };
    assert_eq!(equations.solve(&given, u.as_slice(), u.as_slice(), &mut dynamic), expected);
    let (x, l) = dynamic.solution::<N>();
    assert_eq!((&x.v, &x.z, &x.rho, &x.p0), (&work.x.v, &work.x.z, &work.x.rho, &work.x.p0));
    for (l, expected) in l.iter().zip(&work.l) {
        assert_eq!((l.l.re, l.force, l.l.d), (expected.l.re, expected.force, expected.l.d));
    }
    assert!(equations.inverse_jacobian(&given, &mut dynamic).is_some());
}

#[test]
fn steps_are_those_of_the_typed_route() {
    compare(&OnLine::Curved(Curved), [0.4], [0.3], 0.1);
    compare(&OnLine::QuadraticInZ(QuadraticInZ::default()), [0.4], [0.3], 0.1);
    compare(&DoublePendulum::default(), [0.7, -0.2], [0.1, 0.4], 0.05);
    compare(&Chain, [0.3, -0.2, 0.1], [0.2, 0.1, -0.4], 0.1);
    compare(&Chain, [0.3, -0.2, 0.1, 0.4, -0.1], [0.2, 0.1, -0.4, 0.0, 0.3], 0.1);
    compare(&Chain, [0.3, -0.2, 0.1, 0.4, -0.1, 0.0, 0.2, -0.3, 0.25], [0.1; 9], 0.1);
    let forced = Forced { lagrangian: DoublePendulum::default(), force: Friction };
    compare(&forced, [0.7, -0.2], [0.1, 0.4], 0.05);
}

#[test]
fn steps_in_transformed_time_are_those_of_the_typed_route() {
    let lagrangian = InPlane::Kepler(Kepler::default());
    let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new([0.4, 0.0], [0.0, 2.0], 0.0)).unwrap();
    for s in [2, 5, 8] {
        let mut typed = TypedStepper::new(&problem, s, 0.1).unwrap();
        let mut stepper = TransformedStepper::new(&problem, s, 0.1).unwrap();
        for k in 0..30 {
            if k % 3 == 0 {
                assert_eq!(stepper.advance(2), typed.advance(2));
            } else {
                let t_end = typed.time() + 0.13 * f64::from(k);
                assert_eq!(stepper.advance_until(3, t_end), typed.advance_until(3, t_end));
                typed.advance_to(t_end + 0.01).unwrap();
                stepper.advance_to(t_end + 0.01).unwrap();
            }
            assert_eq!(stepper.save(), typed.save(), "{s} stages, {k}");
            assert_eq!(
                (stepper.time(), stepper.state(), stepper.unresolved()),
                (typed.time(), typed.state(), typed.unresolved())
            );
            if k == 20 {
                let words = typed.save().unwrap();
                assert!(stepper.restore(&words) && typed.restore(&words));
            }
        }
    }
}
