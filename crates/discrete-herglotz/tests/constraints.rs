//! Motions under holonomic constraints: constraint, contact and order of the methods, redundant constraints, and invalid
//! input.

// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

#[path = "constraints/derivatives.rs"]
mod derivatives;
#[path = "constraints/runs.rs"]
mod runs;

use contact_examples::systems::constrained::{FourBar, ParallelCranks, RigidPendulum, Squeezer};
use contact_geom::constraints::{Constraint, ConstraintDerivatives, Redundancy};
use contact_geom::groups::{Inertia, RigidBody, Rotation, Rotations, UniformGravity};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::{MaxAbsOrNan, MaxOrNan};
use contact_geom::support::linear::solve;
use contact_geom::{Derivatives, Dual, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};
use discrete_herglotz::constraints::{ConstrainedStart, ConstraintError, ContactLobatto, DragRattle, OffConstraint};
use discrete_herglotz::groups::{GroupGauss, GroupMotion, GroupState};
use discrete_herglotz::{InputError, SplittingScheme, State, StepError, Stepper};

/// A bead on a closed curve, with a Lagrangian that is nonlinear in q, v and z.
struct Bead;

impl Lagrangian<2> for Bead {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let square = v.dot(v);
        (q[0] * q[0] * 0.15 + 0.5) * square + square * square * 0.05
            - q[1]
            - z * 0.1
            - z * z * 0.15
            - z * v[0] * q[1] * 0.1
            - z.sin() * q[0] * 0.2
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, ..Structure::default() }
    }
}

impl Constraint<2, 1> for Bead {
    fn value<T: Scalar>(&self, q: &SVector<T, 2>) -> SVector<T, 1> {
        SVector::from([q[0] * q[0] + q[1] * q[1] * 2.0 + q[0].powi(3) * q[1] * 0.3 - T::one()])
    }
}

/// A start on the curve of the bead.
fn bead() -> ConstrainedStart<2> {
    ConstrainedStart {
        off_constraint: OffConstraint::Project,
        ..ConstrainedStart::new(VelocityPoint::new([0.6, 0.5], [-1.2, 0.5], 0.3))
    }
}

/// A direction along which a step is differentiated.
type Along = Dual<f64, SVector<f64, 1>>;

/// The state with the derivative along a vector that is tangent to `c(q) = 0`: generic numbers, projected.
fn tangent<const N: usize, const M: usize>(
    constraint: &impl Constraint<N, M>,
    x: &PhasePoint<N>,
    seed: f64,
) -> PhasePoint<N, Along> {
    let generic = |i: usize| ((i as f64 + seed) * 2.399).sin();
    let g: SMatrix<f64, M, N> = constraint.with_jacobian(&x.q).1;
    let mut dq = SVector::<f64, N>::from_fn(|i, _| generic(i));
    // Twice, since the first projection has a round-off.
    for _ in 0..2 {
        let mut normal = g * dq;
        solve(&mut (g * g.transpose()), &mut normal).unwrap();
        dq -= g.transpose() * normal;
    }
    let moving = |re: f64, d: f64| Dual { re, d: SVector::from([d]) };
    PhasePoint {
        q: x.q.zip_map(&dq, moving),
        p: SVector::from_fn(|i, _| moving(x.p[i], generic(N + i))),
        z: moving(x.z, generic(2 * N)),
    }
}

/// `eta = dz - p dq` on the derivative of a state.
fn eta<const N: usize>(x: &PhasePoint<N, Along>) -> f64 {
    x.z.d[0] - (0..N).map(|i| x.p[i].re * x.q[i].d[0]).sum::<f64>()
}

/// The logarithms to the base 2 of the quotients of successive errors.
fn slopes(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect()
}

fn distance(a: &State, b: &State) -> f64 {
    assert_eq!((a.q.len(), a.p.len()), (b.q.len(), b.p.len()), "states of different systems");
    (&a.q - &b.q).amax().max_or_nan((&a.p - &b.p).amax()).max_or_nan((a.z - b.z).abs())
}

/// Over 1e5 steps the pendulum stays on its circle up to the rounding of its coordinates, and each step is conformally
/// contact with the factor `e^(gamma h)` up to some roundings of products of momenta below 5.
#[test]
fn pendulum_keeps_constraint_and_contact() {
    for gamma in [0.0, -1e-3] {
        let system = RigidPendulum::<2> { gravity: 9.81, gamma };
        let start = ConstrainedStart::new(VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0));
        let h = 2.367841947576237 / 64.0;
        let mut motion = DragRattle::new(system, system, &SplittingScheme::STRANG, h, &start).unwrap();
        let (mut off, mut contact) = (0f64, 0f64);
        for k in 0..100_000 {
            if k % 10 == 0 {
                let from = tangent(&system, &motion.state().fixed(), f64::from(k));
                let to = motion.step(motion.time(), &from).unwrap().end;
                contact = contact.max_or_nan((eta(&to) - (gamma * h).exp() * eta(&from)).abs());
            }
            motion.advance(1).unwrap();
            let q = motion.state().q.fixed();
            off = off.max_or_nan(Constraint::value(&system, &q)[0].abs());
        }
        assert!(off < 1e-15, "constraint {off:e}");
        assert!(contact < 1e-14, "contact {contact:e}");
        assert_eq!(motion.sigma(), (gamma * h).exp());
    }
}

/// After a period, `4 K(1/2) / sqrt(g)`, the pendulum without drag is at its start, at rest.
#[test]
fn pendulum_returns_after_its_period() {
    let system = RigidPendulum::<2> { gravity: 9.81, gamma: 0.0 };
    let start = ConstrainedStart::new(VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0));
    let h = 2.367841947576237 / 64.0;
    let mut motion = DragRattle::new(system, system, &SplittingScheme::SOFRONIOU_SPALETTA_10, h, &start).unwrap();
    motion.advance(64).unwrap();
    let end = motion.state().fixed::<2>();
    // The round-off of 64 * 35 substeps with momenta below 5.
    let off = (end.q - SVector::from([1.0, 0.0])).max_abs_or_nan().max_or_nan(end.p.max_abs_or_nan());
    assert!(off < 1e-12, "{off:e}");
}

/// Compositions have the order of their scheme for a closed chain with drag.
#[test]
fn compositions_have_their_order() {
    let system = FourBar::default();
    let q = system.closed_at(1.0);
    let start = ConstrainedStart {
        off_constraint: OffConstraint::Project,
        ..ConstrainedStart::new(VelocityPoint { q, v: SVector::from([-0.8, 0.5, -0.5, 0.5]), z: 0.2 })
    };
    let end = |scheme: &SplittingScheme, count: usize| {
        let mut motion = DragRattle::new(system, system, scheme, 2.0 / count as f64, &start).unwrap();
        motion.advance(count).unwrap();
        motion.state()
    };
    let exact = end(&SplittingScheme::SOFRONIOU_SPALETTA_10, 200);
    for (scheme, count) in [
        (SplittingScheme::STRANG, 80),
        (SplittingScheme::SUZUKI_4, 20),
        (SplittingScheme::KAHAN_LI_6, 20),
        (SplittingScheme::KAHAN_LI_8, 14),
        (SplittingScheme::SOFRONIOU_SPALETTA_10, 6),
    ] {
        let errors: Vec<f64> = [2, 3, 4].map(|m| distance(&end(&scheme, m * count / 2), &exact)).into();
        println!("{}: {errors:?} {:?}", scheme.name(), slopes(&errors));
        let order = f64::from(scheme.order());
        // Over a factor of two in the number of steps.
        let slope = slopes(&errors).iter().sum::<f64>();
        assert!((slope - order).abs() < 0.15, "{}: {slope}", scheme.name());
    }
}

/// Contact Lobatto methods have the order 2s - 2 where L is nonlinear in q, v and z.
#[test]
fn lobatto_methods_have_their_order() {
    let end = |stages: usize, count: usize| {
        let mut motion = ContactLobatto::new(Bead, Bead, stages, 1.0 / count as f64, &bead()).unwrap();
        motion.advance(count).unwrap();
        motion.state()
    };
    let exact = end(6, 60);
    for (stages, count) in [(2, 40), (3, 20), (4, 14)] {
        let errors: Vec<f64> = [1, 2, 4].map(|m| distance(&end(stages, m * count), &exact)).into();
        println!("s = {stages}: {errors:?} {:?}", slopes(&errors));
        let slope = slopes(&errors).iter().sum::<f64>() / 2.0;
        assert!((slope - (2 * stages - 2) as f64).abs() < 0.15, "{stages} stages: {slope}");
    }
}

/// Long steps of contact Lobatto methods are conformally contact on tangent vectors of N, and stay on the constraint.
#[test]
fn lobatto_steps_are_contact() {
    for stages in 2..=5 {
        let mut motion = ContactLobatto::new(Bead, Bead, stages, 0.25, &bead()).unwrap();
        for k in 0..40 {
            let from = tangent(&Bead, &motion.state().fixed(), f64::from(k));
            let to = motion.step(motion.time(), &from, &motion.velocity_point().v).unwrap();
            let defect = eta(&to.end) - to.sigma.re * eta(&from);
            assert!(defect.abs() < 1e-13, "{stages} stages, step {k}: {defect:e}");
            motion.advance(1).unwrap();
            let PhasePoint::<2> { q, .. } = motion.state().fixed();
            // Some roundings of a sum of three terms of order one.
            assert!(Constraint::value(&Bead, &q)[0].abs() < 4e-15);
            assert!((Bead.with_jacobian(&q).1 * motion.velocity_point().v)[0].abs() < 1e-14);
        }
    }
}

/// Both methods agree for the spherical pendulum, which passes near its pole, and keep the momentum of rotations about
/// the vertical times `e^(gamma t)` to round-off.
#[test]
fn spherical_pendulum_by_both_methods() {
    let system = RigidPendulum::<3> { gravity: 1.0, gamma: -0.1 };
    let start = ConstrainedStart::new(VelocityPoint::new([0.6, 0.0, -0.8], [0.0, 0.1, 0.0], 0.2));
    let scheme = SplittingScheme::SOFRONIOU_SPALETTA_10;
    let mut rattle = DragRattle::new(system, system, &scheme, 0.1, &start).unwrap();
    let mut lobatto = ContactLobatto::new(system, system, 5, 0.05, &start).unwrap();
    for k in 1..=20 {
        rattle.advance(5).unwrap();
        lobatto.advance(10).unwrap();
        // The error of order 8 of the second.
        let off = distance(&rattle.state(), &lobatto.state());
        assert!(off < 1e-11, "{off:e}");
        for State { q, p, .. } in [rattle.state(), lobatto.state()] {
            let momentum = q[0] * p[1] - q[1] * p[0];
            let expected = 0.06 * (-0.1 * 0.5 * f64::from(k)).exp();
            let off = (momentum - expected).abs();
            // 200 steps with a round-off of momenta of order one.
            assert!(off < 2e-13 || lobatto.state().p == p && off < 1e-9, "{k}: {off:e}");
        }
        // The formula of the multiplier: the tension is v^2 - g q3, and G = 2 q.
        let x = rattle.velocity_point();
        let tension = -2.0 * rattle.multipliers().unwrap()[0];
        assert!((tension - (x.v.dot(&x.v) - x.q[2])).abs() < 1e-13);
    }
}

/// The spherical pendulum through both poles: under the constraint, and as the axis of a symmetric top without spin, on the
/// group SO(3). The constraint `q.q = 1` and a chart of the group have no poles.
#[test]
fn spherical_pendulum_by_a_constraint_and_by_a_group() {
    let gamma = -0.1;
    let system = RigidPendulum::<3> { gravity: 1.0, gamma };
    let start = ConstrainedStart::new(VelocityPoint::new([0.6, 0.0, -0.8], [2.0, 0.0, 1.5], 0.2));
    let rattle = DragRattle::new(system, system, &SplittingScheme::SOFRONIOU_SPALETTA_10, 0.05, &start);
    let lobatto = ContactLobatto::new(system, system, 6, 0.05, &start);
    let gravity = UniformGravity { weight: [0.0, 0.0, -1.0], centre: [0.0, 0.0, 1.0] };
    let top = RigidBody::rotating(&Inertia::principal([1.0, 1.0, 0.3]).unwrap(), gravity, gamma).unwrap();
    // The rotation about the second axis that turns the third one to the start.
    let half = 0.5 * f64::atan2(0.6, -0.8);
    let g = Rotation::from_quaternion([half.cos(), 0.0, half.sin(), 0.0]).unwrap();
    let state = GroupState { g, momentum: SVector::from([0.0, -2.5, 0.0]), z: 0.2 };
    let mut on_group = GroupMotion::<Rotations, 3>::new(0.0, state).unwrap();
    let gauss = GroupGauss::new::<Rotations, 3>(&top, 6, 0.05).unwrap();
    let mut under_constraint: [Box<dyn Stepper>; 2] = [Box::new(rattle.unwrap()), Box::new(lobatto.unwrap())];
    let [mut highest, mut lowest]: [f64; 2] = [-1.0, 1.0];
    for _ in 0..120 {
        on_group.advance(&gauss, 1).unwrap();
        let axis = on_group.state().g.apply(&SVector::from([0.0, 0.0, 1.0]));
        (highest, lowest) = (highest.max_or_nan(axis[2]), -(-lowest).max_or_nan(-axis[2]));
        for motion in &mut under_constraint {
            motion.advance(1).unwrap();
            let PhasePoint::<3> { q, z, .. } = motion.state().fixed();
            // The errors of order 10 and more of steps of a twentieth, and of round-off.
            assert!((q - axis).max_abs_or_nan() < 1e-11 && (z - on_group.state().z).abs() < 1e-11);
        }
    }
    assert!(highest > 0.99 && lowest < -0.99, "{highest} {lowest}");
}

/// The angles of Andrews' squeezing mechanism at t = 0.03: to 1e-12 those of another method for other equations, and to
/// ten digits the reference of the test set.
///
/// The other values are by the classical Runge-Kutta method with 6000 and 12000 steps and extrapolation, for the equations
/// of motion in the form of the test set with the constraints differentiated twice. Methods of 4 to 7 stages with 300 to
/// 1200 steps give them as well, so that the reference itself is off by 1.5e-9.
#[test]
fn squeezer_reaches_its_reference() {
    let system = Squeezer::default();
    let start = ConstrainedStart {
        off_constraint: OffConstraint::Project,
        ..ConstrainedStart::new(VelocityPoint::new(Squeezer::START, [0.0; 7], 0.0))
    };
    let count = 300;
    let mut motion = ContactLobatto::new(system, system, 5, 0.03 / f64::from(count), &start).unwrap();
    motion.advance(count as usize).unwrap();
    let end: SVector<f64, 7> = motion.state().q.fixed();
    let extrapolated = SVector::from([
        15.81077119515395,
        -15.75637105841233,
        0.04082224011961796,
        -0.534730116342106,
        0.5244099658799553,
        0.5347301163421186,
        1.048080741041924,
    ]);
    let off = (end - extrapolated).max_abs_or_nan();
    // A shift of the motion by the round-off of t = 0.03 and of 300 steps, at angular velocities of 1400.
    assert!(off < 1e-12, "{off:e}: {end}");
    let off = (end - SVector::from(Squeezer::REFERENCE)).max_abs_or_nan();
    assert!(off < 1e-10 * end.max_abs_or_nan(), "{off:e}");
    assert!(Constraint::value(&system, &end).max_abs_or_nan() < 1e-15);
}

/// Redundant constraints are refused, or computed with multipliers of least norm: three parallel cranks move like one
/// pendulum, and the constraint forces balance the equations of motion.
#[test]
fn redundant_constraints() {
    let system = ParallelCranks { gravity: 1.0, gamma: -0.1 };
    let angle = 0.4f64;
    let turning = [0.0, 1.0, 2.0].map(|_| [-angle.sin(), angle.cos()]).concat();
    let at = VelocityPoint { q: ParallelCranks::at(angle), v: SVector::from_column_slice(&turning), z: 0.0 };
    let refused = ConstrainedStart::new(at);
    let scheme = SplittingScheme::KAHAN_LI_8;
    let error = DragRattle::new(system, system, &scheme, 0.05, &refused).err();
    assert!(
        matches!(error, Some(InputError::Constraint(ConstraintError::RankDeficient { rank: 5, expected: 6, .. }))),
        "{error:?}"
    );
    let start = ConstrainedStart { redundancy: Redundancy::LeastNorm, ..refused };
    let mut cranks = DragRattle::new(system, system, &scheme, 0.05, &start).unwrap();
    let mut by_lobatto = ContactLobatto::new(system, system, 4, 0.05, &start).unwrap();
    // The kinetic energy is that of a unit mass times two, the height 5/2 of it.
    let pendulum = RigidPendulum::<2> { gravity: 1.25, gamma: -0.1 };
    let (q, v) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]);
    let one = ConstrainedStart {
        off_constraint: OffConstraint::Project,
        ..ConstrainedStart::new(VelocityPoint::new(q, v, 0.0))
    };
    let mut single = DragRattle::new(pendulum, pendulum, &scheme, 0.05, &one).unwrap();
    let mut largest = 0f64;
    for _ in 0..10 {
        cranks.advance(1).unwrap();
        by_lobatto.advance(1).unwrap();
        single.advance(1).unwrap();
        let (q, all) = (single.state().q.fixed::<2>(), cranks.state().q.fixed::<6>());
        let off = (0..3).map(|i| (all.fixed_rows::<2>(2 * i) - q - SVector::from([i as f64, 0.0])).max_abs_or_nan());
        assert!(off.fold(0.0, f64::max_or_nan) < 1e-13);
        assert!((by_lobatto.state().q.fixed::<6>() - all).max_abs_or_nan() < 1e-9);
        let motion = cranks.constrained_motion().unwrap();
        let g = ConstraintDerivatives::<6, 6>::with_jacobian(&system, &all).1;
        // The multipliers are orthogonal to those without force, which are the kernel of G G^T.
        let without = (g * g.transpose()).symmetric_eigen();
        let smallest = without.eigenvalues.imin();
        assert!(without.eigenvalues[smallest].abs() < 1e-12);
        let along = without.eigenvectors.column(smallest).dot(&motion.multipliers);
        assert!(along.abs() < 1e-12, "{along:e}");
        largest = largest.max_or_nan(motion.multipliers.max_abs_or_nan());
        // p' = L_q + gamma p + G^T lambda, to the round-off of numbers of order one.
        let x = cranks.velocity_point();
        let (gradient, mass) = (system.gradient(0.0, &x), system.mass_matrix(0.0, &x));
        let balance = mass * motion.acceleration - gradient.x - gradient.y * -0.1 - g.transpose() * motion.multipliers;
        assert!(balance.max_abs_or_nan() < 1e-13, "{balance}");
    }
    assert!(largest > 1e-2, "{largest:e}");
}

/// At rest in its equilibrium the pendulum stays there, with the weight as its tension.
#[test]
fn pendulum_stays_in_its_equilibrium() {
    let system = RigidPendulum::<2> { gravity: 9.81, gamma: -0.1 };
    let start = ConstrainedStart::new(VelocityPoint::new([0.0, -1.0], [0.0, 0.0], 0.0));
    let mut rattle = DragRattle::new(system, system, &SplittingScheme::KAHAN_LI_8, 0.1, &start).unwrap();
    let mut lobatto = ContactLobatto::new(system, system, 3, 0.1, &start).unwrap();
    rattle.advance(100).unwrap();
    lobatto.advance(100).unwrap();
    for (state, tension) in
        [(rattle.state(), rattle.multipliers().unwrap()), (lobatto.state(), lobatto.multipliers().unwrap())]
    {
        let state = state.fixed::<2>();
        // The round-off of a weight of 10 in 100 steps.
        assert!((state.q - start.at.q).max_abs_or_nan().max_or_nan(state.p.max_abs_or_nan()) < 1e-13, "{state:?}");
        assert!((tension[0] + 0.5 * 9.81).abs() < 1e-13, "{tension}");
    }
}

/// Invalid input is refused by name.
#[test]
fn invalid_starts_are_refused() {
    /// Two lines that cross at the origin, where `c_q` vanishes; or the same circle twice, or two circles.
    struct Curves(u8);
    impl Constraint<2, 1> for Curves {
        fn value<T: Scalar>(&self, q: &SVector<T, 2>) -> SVector<T, 1> {
            SVector::from([q[0] * q[0] - q[1] * q[1]])
        }
    }
    impl Constraint<2, 2> for Curves {
        fn value<T: Scalar>(&self, q: &SVector<T, 2>) -> SVector<T, 2> {
            let (line, circle) = (q[1], q.dot(q) - T::one());
            match self.0 {
                0 => SVector::from([q[0] + q[1], q[0] + q[1] + q[0] * q[0]]),
                1 => SVector::from([circle, circle * 2.0 - 0.5]),
                _ => SVector::from([line, circle]),
            }
        }
    }
    let system = RigidPendulum::<2> { gravity: 1.0, gamma: -0.1 };
    let at = |q, v| ConstrainedStart::new(VelocityPoint::new(q, v, 0.0));
    let strang = SplittingScheme::STRANG;
    let of = |start: &ConstrainedStart<2>| DragRattle::new(system, system, &strang, 0.1, start).err();
    let off = of(&at([1.1, 0.0], [0.0, 0.0])).unwrap();
    assert!(
        matches!(off, InputError::Constraint(ConstraintError::OffConstraint { distance, index: 0, .. }) if (distance - 0.0955).abs() < 1e-3)
    );
    assert!(off.to_string().contains("OffConstraint::Project"), "{off}");
    let off = of(&at([1.0, 0.0], [0.1, 0.3])).unwrap();
    assert!(
        matches!(off, InputError::Constraint(ConstraintError::OffVelocity { distance }) if (distance - 0.1).abs() < 1e-12)
    );
    let project = |start: ConstrainedStart<2>| ConstrainedStart { off_constraint: OffConstraint::Project, ..start };
    let projected = DragRattle::new(system, system, &strang, 0.1, &project(at([1.1, 0.0], [0.1, 0.3]))).unwrap();
    let State { q, p, .. } = projected.state();
    assert!((q[0] - 1.0).abs() < 1e-15 && p[0].abs() < 1e-15 && (p[1] - 0.3).abs() < 1e-15);
    let far = of(&project(at([0.0, 0.0], [0.0, 0.0])));
    assert!(
        matches!(far, Some(InputError::Constraint(ConstraintError::RankDeficient { rank: 0, expected: 1, index: 0 }))),
        "{far:?}"
    );
    let nan = of(&at([f64::NAN, 0.0], [0.0, 0.0]));
    assert!(matches!(nan, Some(InputError::Geometry(_))), "{nan:?}");

    let crossing = DragRattle::<_, _, 2, 1>::new(system, Curves(0), &strang, 0.1, &at([0.0, 0.0], [1.0, 1.0])).err();
    assert_eq!(
        crossing,
        Some(InputError::Constraint(ConstraintError::RankDeficient { rank: 0, expected: 1, index: 0 }))
    );
    let least = |start| ConstrainedStart { redundancy: Redundancy::LeastNorm, ..start };
    let of =
        |curves, start: &ConstrainedStart<2>| DragRattle::<_, _, 2, 2>::new(system, curves, &strang, 0.1, start).err();
    let touching = of(Curves(0), &least(at([0.0, 0.0], [0.0, 0.0])));
    assert!(
        matches!(touching, Some(InputError::Constraint(ConstraintError::SingularPosition { rank: 1, .. }))),
        "{touching:?}"
    );
    let apart = of(Curves(1), &least(at([1.0, 0.0], [0.0, 1.0])));
    assert!(
        matches!(apart, Some(InputError::Constraint(ConstraintError::SingularPosition { rank: 1, .. }))),
        "{apart:?}"
    );
    assert_eq!(of(Curves(2), &at([1.0, 0.0], [0.0, 0.0])), None);

    let stages = ContactLobatto::new(system, system, 1, 0.1, &at([1.0, 0.0], [0.0, 0.0])).err();
    assert_eq!(stages, Some(InputError::Constraint(ConstraintError::Stages { found: 1 })));
    let step = ContactLobatto::new(system, system, 2, 0.0, &at([1.0, 0.0], [0.0, 0.0])).err();
    assert_eq!(step, Some(InputError::Step { h: 0.0 }));
    let curved = DragRattle::new(Bead, Bead, &strang, 0.1, &bead()).err();
    assert_eq!(curved, Some(InputError::Unclaimed { claim: "separable" }));
    // A step from which no point of the circle is reached along the normal.
    let long = DragRattle::new(system, system, &strang, 3.0, &at([1.0, 0.0], [0.0, 5.0])).err();
    let failed = |e: &StepError| matches!(e, StepError::NotConverged { .. } | StepError::Singular { .. });
    assert!(matches!(&long, Some(InputError::FirstStep(e)) if failed(e)), "{long:?}");
}
