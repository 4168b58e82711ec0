//! Steps that are far too long are flagged as unresolved or refused, by every integrator; and properties that must not
//! affect this.

use crate::common::gauss::GaussSteppers;
use crate::lagrangians::{One, Two, one};
use crate::motions::run_of;
use contact_examples::systems::{HarmonicOscillator, Kepler, Pendulum};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint, numbers::max_or_nan};
use discrete_herglotz::{
    AnyIntegrator, InputError, SplittingScheme, Status, Stepper, Steps, UnresolvedStep, gauss::Gauss, rules::Method,
};

/// The outcome of a run of three given steps, and its unresolved step.
fn run<L: Lagrangian<1>>(
    system: &L,
    integrator: AnyIntegrator,
    h: f64,
) -> Result<(Status, Option<UnresolvedStep>), InputError> {
    let start = VelocityPoint::new([1.0], [0.3], 0.0);
    let outcome = run_of(system, start, 3.0 * h, integrator, Steps::Count(3))?;
    Ok((outcome.status, outcome.unresolved))
}

/// Every integrator resolves steps of 0.4 radians or, with many stages, of 0.2 in each stage, and a quarter of that
/// with order one; and none resolves 40, or two and a half for each stage of Gauss' methods: the longest schemes have
/// some twenty substeps.
fn every_integrator<L: Lagrangian<1>>(system: &L) {
    let (mut flagged, mut of_all) = (0, 0);
    for integrator in AnyIntegrator::all().into_iter().filter(|integrator| integrator.check(system).is_ok()) {
        let (parts, coarse) = match integrator {
            AnyIntegrator::Gauss { stages } => (max_or_nan(0.5 * stages as f64, 1.0), 2.5 * stages as f64 + 2.5),
            _ => (1.0, 40.0),
        };
        let fine = if integrator.order() == 1 { 0.1 } else { 0.4 * parts };
        assert_eq!(run(system, integrator, fine), Ok((Status::Completed, None)), "{integrator}, h = {fine}");
        let found = run(system, integrator, coarse);
        assert_ne!(found, Ok((Status::Completed, None)), "{integrator}, h = {coarse}");
        flagged += usize::from(matches!(found, Ok((Status::Completed, _))));
        of_all += 1;
    }
    // Most runs are completed, and flagged.
    assert!(2 * flagged > of_all, "{flagged} of {of_all}");
}

#[test]
fn coarse_steps_of_a_linear_motion_are_flagged() {
    every_integrator(&one(HarmonicOscillator { gamma: -0.01 }));
}

#[test]
fn coarse_steps_of_a_pendulum_are_flagged() {
    every_integrator(&one(Pendulum { gamma: -0.01 }));
}

/// `-v^2/6 + 2 q^4`, a force that grows without bound: long steps are solved by Newton's method, or have no solution.
#[derive(Clone, Copy, Debug)]
pub struct Runaway;

impl Lagrangian<1> for Runaway {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let square = q[0] * q[0];
        v[0] * v[0] * (-1.0 / 6.0) - square * square * 2.0 + square * 0.5
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// Where the motion does not depend on the action, computing the action changes neither the motion nor its end.
#[test]
fn the_action_does_not_decide_where_a_run_ends() {
    let mut by_newton = 0;
    for (stages, tenths) in [1, 2, 4, 8].into_iter().flat_map(|s| (1..20).map(move |k| (s, k))) {
        let gauss = Gauss::new(One::from(Runaway), stages, 0.05 * f64::from(tenths)).unwrap();
        let (start, v) = (PhasePoint::new([-0.585], [0.63], 1e3), SVector::from([-1.89]));
        let (mut with, mut without) =
            (gauss.stepper(0.0, start, v).unwrap(), gauss.stepper_without_action(0.0, start, v).unwrap());
        let ends = (with.advance(20), without.advance(20));
        assert_eq!(ends.0, ends.1, "{stages} stages, h = 0.05 * {tenths}");
        let (a, b) = (with.state(), without.state());
        assert_eq!((a.q, a.p), (b.q, b.p), "{stages} stages, h = 0.05 * {tenths}");
        by_newton += with.newton_steps() + u64::from(ends.0.is_err());
    }
    assert!(by_newton > 0);
}

/// The velocity at the start is that of the momentum for any guess, also for one so large that its difference from the
/// velocity has lost all digits.
#[test]
fn a_guess_of_the_velocity_may_be_of_any_size() {
    let gauss = Gauss::new(one(Pendulum { gamma: -0.01 }), 8, 0.1).unwrap();
    let end = |guess: f64| {
        let mut run = gauss.stepper(0.0, PhasePoint::new([0.5], [0.4], 0.1), SVector::from([guess])).unwrap();
        run.advance(1).unwrap();
        run.state()
    };
    for guess in [0.0, -5.0, 1e3, 1e10, 1e160] {
        let (found, right) = (end(guess), end(0.4));
        // One or two roundings of numbers below one.
        assert!(
            (&found.q - right.q).norm() + (&found.p - right.p).norm() <= 4.0 * f64::EPSILON,
            "from {guess:e}: {found:?}"
        );
    }
}

/// `v^2/2 - q^2/2 - slope |q - at|`, whose force jumps.
#[derive(Clone, Copy, Debug)]
pub struct Kinked {
    at: f64,
    slope: f64,
}

impl Lagrangian<1> for Kinked {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        (v[0] * v[0] - q[0] * q[0]) * 0.5 - (q[0] - self.at).abs() * self.slope
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// The integrators without a check of the motion between their nodes.
fn without_check_between_nodes() -> impl Iterator<Item = AnyIntegrator> {
    let checked =
        |i: &AnyIntegrator| matches!(i, AnyIntegrator::Gauss { stages: 3.. } | AnyIntegrator::TransformedGauss { .. });
    AnyIntegrator::all().into_iter().filter(move |i| !checked(i))
}

/// A force that jumps by a tenth of the velocity in a step is noticed, wherever in the run and in the step it jumps.
#[test]
fn an_error_of_the_energy_at_a_kink_is_flagged() {
    let (mut lost, mut kept) = (Vec::new(), 0);
    for (at, slope) in [(0.3, 1.0), (0.0, 5.0), (-0.2, 100.0)] {
        let system = One::from(Kinked { at, slope });
        let energy = |q: f64, p: f64| 0.5 * (p * p + q * q) + slope * (q - at).abs();
        for (integrator, count) in without_check_between_nodes().flat_map(|i| [10, 50, 200].map(|n| (i, n))) {
            let start = VelocityPoint::new([1.0], [0.0], 0.0);
            let run = run_of(&system, start, 3.0, integrator, Steps::Count(count));
            let Ok(end) = run else { continue };
            if (end.status, end.unresolved) != (Status::Completed, None) {
                continue;
            }
            let off = energy(end.q[0], end.p[0]) / energy(1.0, 0.0) - 1.0;
            if off.abs() <= 0.1 {
                kept += 1;
            } else {
                lost.push((slope, integrator.to_string(), count, off));
            }
        }
    }
    assert!(lost.is_empty(), "{} lost, {kept} kept: {lost:?}", lost.len());
    // Short steps are flagged only where the error of the energy is a hundredth of the kinetic energy.
    assert!(kept > 30, "{kept}");
}

/// A revolution of an eccentric orbit, whose passage of the centre takes one or two steps.
#[test]
fn a_centre_that_is_passed_in_a_step_is_flagged() {
    let system = Kepler::<2> { mu: 1.0, gamma: 0.0 };
    let (mut silent, mut flagged) = (Vec::new(), 0);
    for e in [0.9, 0.97, 0.99, 0.999] {
        let start = VelocityPoint::new([1.0 + e, 0.0], [0.0, f64::sqrt((1.0 - e) / (1.0 + e))], 0.0);
        for (integrator, count) in
            without_check_between_nodes().flat_map(|i| (20..40).step_by(3).chain([32]).map(move |n| (i, n)))
        {
            let end = run_of(&system, start, std::f64::consts::TAU, integrator, Steps::Count(count));
            let Ok(end) = end else { continue };
            flagged += u32::from(end.unresolved.is_some());
            let off = (end.q - start.q).norm() + (end.p - start.v).norm();
            if (end.status, end.unresolved) == (Status::Completed, None) && off > 0.3 {
                silent.push((e, integrator.to_string(), count, off));
            }
        }
    }
    assert!(silent.is_empty() && flagged > 100, "{flagged} flagged, {}: {silent:?}", silent.len());
}

/// Long steps that resolve the motion give suspect intervals, which are checked and not flagged.
#[test]
fn a_suspect_interval_is_not_flagged() {
    let start = VelocityPoint::new([1.0], [0.3], 0.0);
    let system = one(Pendulum { gamma: -0.01 });
    for integrator in AnyIntegrator::all().into_iter().filter(|i| i.order() > 1 && i.check::<1, _>(&system).is_ok()) {
        let parts =
            if let AnyIntegrator::Gauss { stages } = integrator { max_or_nan(0.5 * stages as f64, 1.0) } else { 1.0 };
        for radians in [0.1, 0.2, 0.3, 0.4] {
            for count in [10, 100] {
                let (span, steps) = (radians * parts * f64::from(count), Steps::Count(count as usize));
                let end = run_of(&system, start, span, integrator, steps).unwrap();
                assert_eq!(
                    (end.status, end.unresolved),
                    (Status::Completed, None),
                    "{integrator}, {radians} x {count}"
                );
            }
        }
    }
}

/// A pendulum by `sin(q + pi/2)`, whose forces near the origin have the rounding of numbers near pi/2.
#[derive(Clone, Copy, Debug)]
pub struct Shifted;

impl Lagrangian<1> for Shifted {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + (q[0] + std::f64::consts::FRAC_PI_2).sin() - z
    }
    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            z_affine: true,
            constant_rate: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

/// A motion that has come to rest near the origin moves by rounding alone, which is no motion to be resolved.
#[test]
fn a_motion_at_rest_is_not_flagged() {
    let shifted = One::from(Shifted);
    for scheme in SplittingScheme::ALL {
        for count in [1000, 1024] {
            let start = VelocityPoint::new([1.0], [0.3], 0.0);
            let (span, steps) = (0.1 * f64::from(count), Steps::Count(count as usize));
            let end = run_of(&shifted, start, span, AnyIntegrator::Splitting(scheme), steps).unwrap();
            assert_eq!((end.status, end.unresolved), (Status::Completed, None), "{}, {:e}", scheme.name(), end.q[0]);
            assert!(end.q[0].abs() < 1e-14, "{}, {:e}", scheme.name(), end.q[0]);
        }
    }
    // The equations of an implicit step have no solution there, as the forces jump from one number to the next: they
    // are solved up to that.
    let (start, midpoint) = (VelocityPoint::new([1.0], [0.3], 0.0), AnyIntegrator::Discrete(Method::Midpoint));
    let end = run_of(&shifted, start, 100.0, midpoint, Steps::Count(1000)).unwrap();
    assert_eq!((end.status, end.unresolved), (Status::Completed, None));
    assert!(end.q[0].abs() < 1e-14, "{:e}", end.q[0]);
}

/// A step that ends at a centre of force has nodes on one side of it alone: the change of the velocity there is
/// compared with that of half steps.
#[test]
fn many_stages_do_not_pass_a_centre_at_the_end_of_a_step() {
    let system = Kepler::<2> { mu: 1.0, gamma: 0.0 };
    let (mut lost, mut silent) = (0, Vec::new());
    for e in [0.9, 0.95, 0.98, 0.99, 0.995, 0.999] {
        let start = VelocityPoint::new([1.0 + e, 0.0], [0.0, f64::sqrt((1.0 - e) / (1.0 + e))], 0.0);
        for stages in 3..=16 {
            for count in 20..=40 {
                let by = AnyIntegrator::Gauss { stages };
                let end = run_of(&system, start, std::f64::consts::TAU, by, Steps::Count(count)).unwrap();
                if end.status == Status::Completed && (end.q - start.q).norm() > 1.0 {
                    lost += 1;
                    if end.unresolved.is_none() {
                        silent.push((e, stages, count));
                    }
                }
            }
        }
    }
    assert!(lost > 100, "{lost}");
    assert!(silent.is_empty(), "{silent:?} of {lost}");
}

/// Steps so short that each is rounded in the same way: the sum of many of them is accurate.
#[test]
fn tiny_steps_lose_nothing() {
    let (system, count) = (one(Pendulum { gamma: -0.1 }), 1000);
    let (q, v) = (1.0, 0.7);
    for (scheme, h) in SplittingScheme::ALL.into_iter().flat_map(|s| [1e-12, 1e-11, 1e-10].map(|h| (s, h))) {
        let (start, steps) = (VelocityPoint::new([q], [v], 0.0), Steps::Count(count as usize));
        let end = run_of(&system, start, h * f64::from(count), AnyIntegrator::Splitting(scheme), steps).unwrap();
        // Taylor's series; the time is 1e-7 at most.
        let (t, a) = (h * f64::from(count), -f64::sin(q) - 0.1 * v);
        let (right_q, right_p) = (q + t * (v + 0.5 * t * a), v + t * (a + 0.5 * t * (-f64::cos(q) * v - 0.1 * a)));
        // The rounding of the start, the end and the series.
        let off = max_or_nan((end.q[0] - right_q).abs(), (end.p[0] - right_p).abs());
        assert!(off <= 4.0 * f64::EPSILON, "{}, h = {h:e}: {off:e}", scheme.name());
    }
}

/// Two coordinates, the first with a mass that grows with z from a negative value: the motion ends where it vanishes.
#[derive(Clone, Copy, Debug)]
pub struct Massless;

impl Lagrangian<2> for Massless {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        v[0] * v[0] * (q[1] * z * 0.588 - 0.064) * 0.5 + v[1] * v[1] * 252.0
    }
}

/// The equations of a step may have a solution beyond the end of the motion, and so may those of all later steps.
#[test]
fn a_step_past_the_end_of_a_motion_is_flagged() {
    let massless = Two::from(Massless);
    let start = VelocityPoint::new([-0.674, 0.863], [1.348, 0.541], 0.0);
    let (mut silent, mut whole) = (Vec::new(), 0);
    for integrator in without_check_between_nodes() {
        // The mass vanishes after 0.0017.
        for count in [10, 20, 40] {
            let Ok(end) = run_of(&massless, start, 1.6, integrator, Steps::Count(count)) else { continue };
            whole += u32::from(end.status == Status::Completed);
            if (end.status, end.unresolved) == (Status::Completed, None) {
                silent.push((integrator.to_string(), count));
            }
        }
    }
    assert!(silent.is_empty() && whole > 0, "{silent:?} of {whole}");
}
