//! Motions that come to rest: none of their steps is flagged as unresolved, wherever they come to rest.

use crate::common::draws::Draws;
use crate::common::lagrangians::WithStructure;
use crate::lagrangians::{One, one};
use contact_examples::systems::Pendulum;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint, numbers::max_or_nan};
use discrete_herglotz::{AnyIntegrator, Problem, Rows, SplittingScheme, Status, Steps, Until};

/// Systems of one coordinate that come to rest away from 0, with a drag.
#[derive(Clone, Copy, Debug)]
pub enum Resting {
    /// A pendulum with a constant torque, of less than its weight.
    Torque { torque: f64, gamma: f64 },
    /// Two wells.
    Duffing { beta: f64, gamma: f64 },
    /// A bead on a rotating hoop, with equilibria away from its lowest point.
    Hoop { square: f64, gamma: f64 },
    /// A Morse potential.
    Morse { gamma: f64 },
    /// A linear spring with an equilibrium away from 0.
    Spring { stiffness: f64, place: f64, gamma: f64 },
}

impl Lagrangian<1> for Resting {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let (x, kinetic) = (q[0], v[0] * v[0] * 0.5);
        match *self {
            Resting::Morse { gamma } => {
                let stretched = -((-x).exp()) + 1.0;
                kinetic - stretched * stretched + z * gamma
            }
            Resting::Torque { torque, gamma } => kinetic + x.cos() + x * torque + z * gamma,
            Resting::Duffing { beta, gamma } => kinetic + x * x * 0.5 - x * x * x * x * (0.25 * beta) + z * gamma,
            Resting::Spring { stiffness, place, gamma } => {
                kinetic - (x - place) * (x - place) * (0.5 * stiffness) + z * gamma
            }
            Resting::Hoop { square, gamma } => kinetic + x.sin() * x.sin() * (0.5 * square) + x.cos() + z * gamma,
        }
    }
    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            z_affine: true,
            constant_rate: true,
            separable: true,
            constant_mass: true,
            quadratic: matches!(self, Resting::Spring { .. }),
            ..Structure::default()
        }
    }
}

fn draw(draws: &mut Draws) -> (Resting, VelocityPoint<1>) {
    let gamma = -f64::exp(draws.between(f64::ln(0.05), f64::ln(3.0)));
    let system = match (draws.next() * 4.0) as u32 {
        3 => {
            let [stiffness, place] =
                [[0.1, 3.0], [0.01, 1e4]].map(|[low, high]: [f64; 2]| draws.between(low.ln(), high.ln()).exp());
            Resting::Spring { stiffness, place, gamma }
        }
        0 => Resting::Torque { torque: draws.between(0.05, 0.9), gamma },
        1 => Resting::Duffing { beta: f64::exp(draws.between(-2.0, 2.0)), gamma },
        _ => Resting::Hoop { square: draws.between(1.2, 4.0), gamma },
    };
    // Half of the starts are close to an equilibrium at or near 0.
    let size = if draws.next() < 0.5 { 1.0 } else { f64::powf(10.0, -draws.between(0.0, 8.0)) };
    (system, VelocityPoint::new([size * draws.between(-1.5, 1.5)], [size * draws.between(-1.0, 1.0)], 0.0))
}

#[test]
fn what_comes_to_rest_away_from_the_origin_is_not_flagged() {
    let cases = 1000;
    let integrators: Vec<_> = AnyIntegrator::all()
        .into_iter()
        .filter(|i| i.check(&One::from(Resting::Hoop { square: 2.0, gamma: -1.0 })).is_ok())
        .collect();
    let (mut flagged, mut done) = (Vec::new(), 0);
    for case in 0..cases {
        let mut draws = Draws::of(case);
        let (system, start) = draw(&mut draws);
        let (Resting::Torque { gamma, .. }
        | Resting::Duffing { gamma, .. }
        | Resting::Hoop { gamma, .. }
        | Resting::Spring { gamma, .. }
        | Resting::Morse { gamma }) = system;
        let integrator = integrators[(draws.next() * integrators.len() as f64) as usize];
        // Until e^(gamma t/2) is between 1e-3 and 1e-40; above the critical drag it takes longer.
        let span = draws.between(14.0, 180.0) / -max_or_nan(-gamma.abs(), -2.0 / gamma.abs());
        let lagrangian = One::from(system);
        let problem = Problem::new(&lagrangian, 0.0, start).unwrap();
        let by_accuracy = draws.next() < 0.25;
        // Linearity is only declared: a transient that ends within one step is flagged, since a false declaration looks
        // the same.
        if by_accuracy && matches!(system, Resting::Spring { .. }) {
            continue;
        }
        let run = if by_accuracy {
            problem.by(integrator).accuracy(1e-9)
        } else {
            let parts = match integrator {
                AnyIntegrator::Gauss { stages } => 0.1 * stages as f64,
                // For order one the error of the rate is half the square of `gamma h` in each step, so that the energy
                // decays too fast.
                _ if integrator.order() == 1 => 0.01,
                _ => 0.1,
            };
            problem.by(integrator).steps(Steps::Size(parts * draws.between(0.2, 1.0)))
        };
        match run.run(Until::Time(span)) {
            Ok(end) if end.status == Status::Completed => {
                done += 1;
                if end.unresolved.is_some() {
                    flagged.push(format!("{case}: {system:?} from {start:?} by {integrator}: {end:?}"));
                }
            }
            // Accuracies that methods of low order do not reach, and steps that cannot be taken.
            Ok(_) | Err(_) => {}
        }
    }
    assert!(flagged.is_empty() && 10 * done > 8 * cases, "{} of {done} flagged: {flagged:#?}", flagged.len());
}

/// Near its equilibrium at 0 the force of a Morse potential, `2 (1 - e^-x) e^-x`, has the rounding of numbers of size
/// 1: the motion decays to that rounding, which no step resolves and which no relative accuracy can reach.
#[test]
fn a_motion_that_is_left_with_the_rounding_of_its_forces_is_right() {
    let integrators = ["gauss_8", "gauss_11", "strang", "yoshida_6", "blanes_moan_6", "midpoint_by_kahan_li_8"];
    let (mut wrong, mut drawn) = (Vec::new(), Draws::of(1));
    for case in 0..150 {
        let gamma = -f64::exp(drawn.between(f64::ln(0.05), f64::ln(3.0)));
        let system = Resting::Morse { gamma };
        let start = VelocityPoint::new([drawn.between(-0.5, 1.0)], [drawn.between(-1.0, 1.0)], 0.0);
        // Until its oscillation, or the slower of the two decays above the critical drag, is between 1e-9 and 1e-43 of
        // the start.
        let span = drawn.between(20.0, 100.0) / -max_or_nan(0.5 * gamma, 2.0 / gamma);
        let lagrangian = One::from(system);
        let problem = Problem::new(&lagrangian, 0.0, start).unwrap();
        let integrator: AnyIntegrator = integrators[case % integrators.len()].parse().unwrap();
        let wanted = f64::powf(10.0, -drawn.between(4.0, 9.0));
        let (run, what) = match case % 3 {
            0 => (problem.accuracy(wanted), format!("accuracy {wanted:e}")),
            // Only for methods whose order suffices.
            1 if integrator.order() > 2 => {
                (problem.by(integrator).accuracy(wanted), format!("{integrator}, accuracy {wanted:e}"))
            }
            _ => (problem.by(integrator).steps(Steps::Size(0.1)), format!("{integrator}, h = 0.1")),
        };
        let end = run.run(Until::Time(span));
        let right = matches!(&end, Ok(end) if end.status == Status::Completed && end.unresolved.is_none());
        // The sum of some hundred roundings of the force.
        if !(right && end.as_ref().is_ok_and(|end| end.q[0].abs() < 1e-8)) {
            wrong.push(format!("{case}: {system:?} from {start:?} to {span} by {what}: {end:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn general_steps_are_solved_to_the_rounding_of_forces() {
    for gamma in [-0.1, -0.5, -2.0] {
        // Without declared structure the steps solve the general equations of the stages.
        let system = One::from(WithStructure(Resting::Morse { gamma }, Structure::default()));
        let start = VelocityPoint::new([0.4], [-0.3], 0.0);
        let problem = Problem::new(&system, 0.0, start).unwrap();
        // Until the oscillation is below 1e-25 of the start.
        let until = Until::Time(60.0 / -max_or_nan(0.5 * gamma, 2.0 / gamma));
        for stages in [1, 2, 4, 8, 12, 16] {
            let run = problem.by(AnyIntegrator::Gauss { stages }).steps(Steps::Size(0.1 * stages as f64));
            let end = run.run(until).unwrap();
            assert_eq!((end.status, end.unresolved), (Status::Completed, None), "{gamma}, {stages} stages: {end:?}");
            // The sum of some hundred roundings of the force.
            assert!(end.q[0].abs() < 1e-13, "{gamma}, {stages} stages: {end:?}");
        }
        assert!(problem.accuracy(1e-8).run(until).is_ok_and(|end| end.unresolved.is_none()), "{gamma}");
    }
}

/// A damped pendulum down to the smallest numbers: no step is taken after that, and it remains there.
#[test]
fn a_motion_at_rest_remains_there() {
    for (system, gamma) in [-0.05, -0.1, -1.0].map(|gamma| (one(Pendulum { gamma }), gamma)) {
        let start = VelocityPoint::new([1.0], [0.5], 0.0);
        let problem = Problem::new(&system, 0.0, start).unwrap();
        let mut rows = Rows::at((0..=100).map(|k| 1e4 * f64::from(k))).unwrap();
        let by_accuracy = problem.accuracy(1e-9).observe(&mut rows).run(Until::Time(1e6)).unwrap();
        let last = rows.rows.last().unwrap();
        assert!(
            rows.rows.len() == 101 && (last.t, &last.q, last.z) == (1e6, &by_accuracy.q, by_accuracy.z),
            "{last:?}"
        );
        let by_steps = problem.steps(Steps::Size(0.5)).run(Until::Time(1e6)).unwrap();
        let strang = problem.by(SplittingScheme::STRANG).steps(Steps::Size(0.1)).run(Until::Time(1e6)).unwrap();
        for end in [by_accuracy, by_steps, strang] {
            assert_eq!((end.status, end.t), (Status::Completed, 1e6), "{gamma}: {end:?}");
            assert!(end.rests_from.is_some_and(|t| t < 1e5), "{gamma}: {end:?}");
            assert!(end.q[0].abs() < 1e-279 && end.p[0].abs() < 1e-279, "{gamma}: {end:?}");
            assert_eq!(end.unresolved, None);
            // Where z' = cos q - 1 + gamma z vanishes.
            assert!(end.z.unwrap().abs() < 1e-13, "{gamma}: {end:?}");
        }
    }
}

/// `v^2/2 + q^2/2 + gamma z` from the stable direction of its hill: the motion approaches the hill up to round-off, and
/// leaves it.
#[derive(Clone, Copy, Debug)]
pub struct Hill;

impl Lagrangian<1> for Hill {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        (v[0] * v[0] + q[0] * q[0]) * 0.5 - z * 1.5
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// A pendulum with a pulse of force after a long time.
#[derive(Clone, Copy, Debug)]
pub struct Pushed;

impl Lagrangian<1> for Pushed {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let s = t - 4000.0;
        v[0] * v[0] * 0.5 + q[0].cos() + (-(s * s)).exp() * q[0] - z
    }
    fn structure(&self) -> Structure {
        Structure { z_affine: true, constant_rate: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

#[test]
fn what_will_move_again_does_not_end() {
    // q = e^(-2t) + 1e-300 e^(t/2), in between far below the numbers that count as rest.
    let start = VelocityPoint::new([1e-200], [-2e-200], 0.0);
    let (hill, pushed) = (One::from(Hill), One::from(Pushed));
    let problem = Problem::new(&hill, 0.0, start).unwrap();
    let end = problem.by(SplittingScheme::YOSHIDA_4).steps(Steps::Size(0.05)).run(Until::Time(1000.0)).unwrap();
    assert_eq!(end.rests_from, None, "{end:?}");
    let problem = Problem::new(&pushed, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let end = problem.steps(Steps::Size(0.25)).run(Until::Time(4003.0)).unwrap();
    assert_eq!(end.status, Status::Completed);
    assert!(end.q[0].abs() > 0.1, "{end:?}");
}

/// The action of a linear motion depends on its distance from the equilibrium: terms of the size of the place itself
/// cancel.
#[test]
fn the_action_of_a_spring_does_not_depend_on_its_place() {
    // Powers of two, so that the distance is the same number.
    let of = |place: f64, by: AnyIntegrator| {
        let spring = One::from(Resting::Spring { stiffness: 1.7, place, gamma: -0.3 });
        let problem = Problem::new(&spring, 0.0, VelocityPoint::new([place + 0.75], [0.5], 0.0)).unwrap();
        let outcome = problem.by(by).steps(Steps::Size(0.25)).run(Until::Time(100.0)).unwrap();
        assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None), "{by}, {place}");
        (outcome.q[0] - place, outcome.z.unwrap())
    };
    for by in [4, 8, 16].map(|stages| AnyIntegrator::Gauss { stages }) {
        let (expected_q, expected) = of(0.0, by);
        for place in [8.0, 1024.0, 65536.0] {
            let (q, z) = of(place, by);
            assert!((q - expected_q).abs() <= 4.0 * f64::EPSILON * place, "{by}, {place}: {q:e}, {expected_q:e}");
            // z' = gamma z + v^2/2 - k x^2/2, where x has the rounding of the place: some hundred roundings of x^2 on
            // the way, which decay as z does, and at rest the square of the rounding.
            let damped = (-0.3f64 * 100.0).exp() * f64::EPSILON * 256.0 * place;
            let at_rest = 1.7 * (2.0 * f64::EPSILON * place).powi(2) / 0.3;
            // The remaining motion, which decays at half the rate.
            let between = 1.7 * expected_q.abs() * 4.0 * f64::EPSILON * place / 0.3;
            assert!((z - expected).abs() <= damped + between + at_rest, "{by}, {place}: {z:e}, {expected:e}");
        }
    }
}
