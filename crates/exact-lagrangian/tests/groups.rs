//! Closed motions with linear drag: the change of time, and the free rigid body by elliptic functions.

// A failed `unwrap` is a failure of the test.
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use contact_geom::groups::{GroupError, Inertia, LieGroup, NoPotential, RigidBody, Rotations};
use contact_geom::nalgebra::{Matrix3, SVector};
use contact_geom::numbers::{MaxAbsOrNan, MaxOrNan};
use discrete_herglotz::SplittingScheme;
use discrete_herglotz::groups::{GroupGauss, GroupMotion, GroupState, RigidBodySplitting};
use exact_lagrangian::groups::{ChangeOfTime, FreeRigidBody, jacobi_functions};

const EPS: f64 = f64::EPSILON;

fn start(momentum: [f64; 3]) -> GroupState<Rotations, 3> {
    GroupState { g: Rotations::exp(&SVector::from([0.4, -1.1, 0.8])), momentum: momentum.into(), z: 0.4 }
}

/// The values of an independent computation with thirty digits.
#[test]
fn the_damped_free_body_to_its_published_digits() {
    let body = FreeRigidBody::new(Inertia::principal([1.0, 2.0, 3.0]).unwrap(), -0.1).unwrap();
    let end = body.at(10.0, &start([1.0; 3])).unwrap();
    let expected = SVector::from([0.328_817_081_371_932_9, -0.494_159_614_067_396_36, -0.231_714_161_269_102_46]);
    assert!((end.momentum - expected).max_abs_or_nan() < 2.0 * EPS, "{:?}", end.momentum);
}

/// Attitude, momentum and action agree with Gauss collocation of order 16, for every order of the moments, momenta on
/// both sides of the separatrix, symmetric and spherical bodies, a rotated frame, and turns about a principal axis.
#[test]
fn the_free_body_agrees_with_collocation() {
    let turned = {
        let frame = Rotations::exp(&SVector::from([0.3, 0.5, -0.7])).matrix();
        let m = frame * Matrix3::from_diagonal(&[1.0, 2.0, 2.5].into()) * frame.transpose();
        Inertia::new((m + m.transpose()) * 0.5).unwrap()
    };
    let principal = |m| Inertia::principal(m).unwrap();
    let bodies = [
        principal([1.0, 2.0, 3.0]),
        principal([3.0, 1.0, 2.0]),
        principal([2.0, 1.0, 3.0]),
        principal([1.0, 1.0, 1.7]),
        principal([1.7, 1.0, 1.7]),
        principal([1.0, 1.0 + 1e-6, 1.7]),
        principal([2.0, 2.0, 2.0]),
        turned,
    ];
    let momenta = [
        [1.0, 1.0, 1.0],
        [-0.2, 0.3, 1.5],
        [1.5, -0.2, 0.1],
        [0.1, 1.5, -0.3],
        [0.0, 0.0, -1.0],
        [0.0, 1.2, 0.0],
        [0.7, 0.0, -0.7],
        [0.0, 0.0, 0.0],
    ];
    for (k, inertia) in bodies.into_iter().enumerate() {
        let exact = FreeRigidBody::new(inertia, -0.2).unwrap();
        let body = RigidBody::rotating(&inertia, NoPotential, -0.2).unwrap();
        let method = GroupGauss::new::<Rotations, 3>(body, 8, 0.25).unwrap();
        for momentum in momenta {
            let start = start(momentum);
            let mut motion = GroupMotion::new(0.0, start).unwrap();
            motion.advance(&method, 16).unwrap();
            let (found, end) = (exact.at(4.0, &start).unwrap(), motion.state());
            let turn = Rotations::log(&Rotations::compose(&Rotations::inverse(&found.g), &end.g));
            let off = turn
                .max_abs_or_nan()
                .max_or_nan((found.momentum - end.momentum).max_abs_or_nan())
                .max_or_nan((found.z - end.z).abs());
            // The method's error, 1e-14 at this step, and sums of four radians.
            assert!(off < 4e-14, "body {k}, {momentum:?}: {off:e}\n{found:?}\n{end:?}");
        }
    }
}

/// Splittings of order 10 of an asymmetric body converge to the closed form at that order.
#[test]
fn a_splitting_of_order_10_of_the_asymmetric_body() {
    let inertia = Inertia::principal([1.0, 2.0, 3.0]).unwrap();
    let body = RigidBody::rotating(&inertia, NoPotential, -0.1).unwrap();
    let start = start([2.0, 2.0, 2.0]);
    let exact = FreeRigidBody::new(inertia, -0.1).unwrap().at(12.0, &start).unwrap();
    let error = |steps: usize| {
        let method =
            RigidBodySplitting::new(body, SplittingScheme::SOFRONIOU_SPALETTA_10, 12.0 / steps as f64).unwrap();
        let mut motion = GroupMotion::new(0.0, start).unwrap();
        motion.advance(&method, steps).unwrap();
        (motion.state().momentum - exact.momentum).max_abs_or_nan()
    };
    let counts = [8, 10, 12];
    let errors = counts.map(error);
    println!("{errors:?} {:e}", error(60));
    assert!(error(60) < 1e-13, "{:e}", error(60));
}

/// `sn^2 + cn^2 = 1`, the half period, the limits of the modulus, and the differential equation at the separatrix.
#[test]
fn elliptic_functions() {
    for k in [0.0_f64, 1e-9, 0.3, 0.8, 0.999_999, 1.0] {
        let complementary = if k == 0.999_999 { (1.0 - k).sqrt() * (1.0 + k).sqrt() } else { (1.0 - k * k).sqrt() };
        for u in [0.0, 1e-8, 0.4, 1.7, -3.0] {
            let [sn, cn, dn] = jacobi_functions(u, [k, complementary]);
            assert!((sn * sn + cn * cn - 1.0).abs() < 4.0 * EPS && (dn * dn + k * k * sn * sn - 1.0).abs() < 8.0 * EPS);
            if k <= 1e-9 {
                assert!((sn - u.sin()).abs() < 4.0 * EPS && (cn - u.cos()).abs() < 4.0 * EPS);
            }
            if k >= 0.999_999 {
                // sn differs from its limit by at most k'^2 (sinh u cosh u - u) sech^2 u/4.
                let bound = complementary * complementary + 4.0 * EPS;
                assert!((sn - u.tanh()).abs() <= bound, "{u}: {sn}");
            }
        }
    }
    // sn(u | 1/sqrt 2) = 1 at the quarter period K = 1.8540746773013719.
    let root = 0.5f64.sqrt();
    let [sn, cn, dn] = jacobi_functions(1.854_074_677_301_371_9, [root, root]);
    assert!((sn - 1.0).abs() < 2.0 * EPS && cn.abs() < 4.0 * EPS && (dn - root).abs() < 2.0 * EPS);
}

/// A great circle of the sphere with drag, in closed form: SO(3) with the inertia of a ball, where motions are
/// geodesics.
#[test]
fn geodesics_with_drag_are_geodesics_in_another_time() {
    let ball = RigidBody::rotating(&Inertia::principal([2.0; 3]).unwrap(), NoPotential, -0.7).unwrap();
    let start = start([1.0, -0.4, 0.6]);
    let mut motion = GroupMotion::new(0.0, start).unwrap();
    motion.advance(&GroupGauss::new::<Rotations, 3>(ball, 4, 0.1).unwrap(), 30).unwrap();
    let drag = ChangeOfTime::new(-0.7).unwrap();
    let (tau, end) = (drag.free_time(3.0), motion.state());
    let g = Rotations::compose(&start.g, &Rotations::exp(&(start.momentum * (0.5 * tau))));
    let turn = Rotations::log(&Rotations::compose(&Rotations::inverse(&g), &end.g));
    // Order 8 of e^(gamma t), with (gamma h/2)^9 per step.
    assert!(turn.max_abs_or_nan() < 1e-13, "{:e}", turn.max_abs_or_nan());
    assert!((end.momentum - start.momentum * drag.factor(3.0)).max_abs_or_nan() < 4.0 * EPS);
    let kinetic = start.momentum.dot(&start.momentum) / 4.0;
    assert!((end.z - drag.action(3.0, start.z, kinetic)).abs() < 1e-13);
    assert!(matches!(ChangeOfTime::new(f64::NAN), Err(GroupError::NonFinite { .. })));
}
