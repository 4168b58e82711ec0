//! Members of an ensemble are the same as single runs.

use super::systems::{Branching, HenonHeiles, pendulum};
use super::{numbers, pendulum_start, unit};
use crate::lagrangians::{One, kepler, one};
use contact_examples::systems::{Duffing, HarmonicOscillator, Kepler};
use contact_geom::numbers::MaxOrNan;
use contact_geom::{Lagrangian, VelocityPoint};
use discrete_herglotz::ensemble::{Ending, Member};
use discrete_herglotz::{
    Ensemble, GaussCollocation, Integrator, Problem, SplittingScheme, Status, StepError, StepperOptions, Steps, Until,
};

fn plane_start(i: usize) -> VelocityPoint<2> {
    VelocityPoint::new([0.2 * unit(i), 0.2 * unit(i + 99)], [0.2 * unit(i + 7), 0.2], -0.3)
}

fn orbit_start(i: usize) -> VelocityPoint<2> {
    VelocityPoint::new([1.0 + 0.1 * unit(i), 0.0], [0.0, 1.0], 0.0)
}

/// The largest distance of some members of an ensemble in lanes from single runs, in units of the larger of their size
/// and one.
fn distance<'a, L: Lagrangian<N> + Sync, I: Integrator<'a, L, N> + Sync + Copy + 'a, const N: usize>(
    lagrangian: &'a L,
    start: impl Fn(usize) -> VelocityPoint<N> + Sync + Copy + 'a,
    integrator: I,
    steps: usize,
) -> f64 {
    let (count, end, name) = (70, Until::Time(5.0), integrator.info().name);
    let ensemble = Ensemble::new(lagrangian, 0.0, count, start).by(integrator).steps(Steps::Count(steps)).threads(1);
    let mut farthest = 0.0f64;
    let tally = ensemble
        .run(end, |member| {
            if member.index % 23 != 0 {
                return;
            }
            let problem = Problem::new(lagrangian, 0.0, start(member.index)).unwrap();
            let h = 5.0 / steps as f64;
            let mut own = integrator
                .stepper(
                    &problem,
                    h,
                    StepperOptions { action: true, check_resolution: false, ..StepperOptions::default() },
                )
                .unwrap();
            own.advance(steps).unwrap();
            let ending = member.ending.as_ref().unwrap();
            assert_eq!((ending.status, ending.steps, ending.t), (Status::Completed, steps, own.time()), "{name}");
            let own =
                Member { index: 0, ending: Ok(Ending { state: own.state(), ..ending.clone() }), rows: Vec::new() };
            for (a, b) in numbers(member).iter().zip(numbers(&own)) {
                // The largest distance is not taken by `max`, which would lose a NaN.
                let apart = (a - b).abs() / b.abs().max_or_nan(1.0);
                farthest = if apart <= farthest { farthest } else { apart };
            }
        })
        .unwrap();
    assert_eq!((tally.batch_kernel, tally.completed), (count, count), "{name}");
    farthest
}

#[test]
fn by_splittings_members_are_single_runs_to_the_last_bit() {
    let [oscillator, pendulum] = [one(HarmonicOscillator { gamma: -0.1 }), pendulum(-0.01)];
    let [kepler, henon_heiles] = [kepler(Kepler::default()), HenonHeiles.into()];
    for scheme in SplittingScheme::ALL {
        let (by, name) = (scheme, scheme.name());
        // Sums, products, quotients and roots are rounded alike in all instruction sets; one mass matrix is not
        // diagonal.
        assert_eq!(distance(&kepler, orbit_start, by, 50), 0.0, "{name}");
        assert_eq!(distance(&henon_heiles, plane_start, by, 50), 0.0, "{name}");
        assert_eq!(distance(&oscillator, pendulum_start, by, 50), 0.0, "{name}");
        // The sine has an error of 2 units in the last place, at most 35 of which enter a step, each times a part of
        // the step; in five units of time a difference grows at most by e^5, near the upper equilibrium, and the
        // motions here stay below it.
        let apart = distance(&pendulum, pendulum_start, by, 50);
        assert!(apart <= 64.0 * f64::EPSILON, "{name}: {apart:e}");
    }
}

#[test]
fn a_drag_that_depends_on_time_and_forces_that_do_are_those_of_single_runs() {
    let by = SplittingScheme::BLANES_MOAN_4;
    // The sine of the forcing is the one of the lanes.
    let apart = distance(&one(Duffing::forced()), pendulum_start, by, 50);
    assert!(apart <= 64.0 * f64::EPSILON, "{apart:e}");
}

#[test]
fn by_collocation_members_are_single_runs_but_for_rounding() {
    let [oscillator, pendulum] = [one(HarmonicOscillator { gamma: -0.1 }), pendulum(-0.01)];
    let [kepler, henon_heiles] = [kepler(Kepler::default()), HenonHeiles.into()];
    for stages in 1..=16 {
        let by = GaussCollocation { stages };
        let systems = [
            distance(&kepler, orbit_start, by, 40),
            distance(&henon_heiles, plane_start, by, 40),
            distance(&oscillator, pendulum_start, by, 40),
            distance(&pendulum, pendulum_start, by, 40),
        ];
        // Both solve the stages to round-off, of which a few units remain after 40 steps, and an orbit multiplies them
        // by 3/2 of its phase.
        assert!(systems.iter().all(|apart| *apart <= 64.0 * f64::EPSILON), "{stages} stages: {systems:?}");
    }
}

#[test]
fn a_formula_that_branches_is_run_one_by_one() {
    let start = |i: usize| VelocityPoint::new([if i.is_multiple_of(2) { 1.0 } else { -1.0 }], [0.0], 0.0);
    let branching = One::from(Branching);
    let run = |by: SplittingScheme| {
        let ensemble = Ensemble::new(&branching, 0.0, 20, start).by(by).steps(Steps::Count(10));
        let mut ends = Vec::new();
        let tally = ensemble.run(Until::Time(1.0), |member| ends.push(numbers(member)[0])).unwrap();
        (tally.batch_kernel, ends)
    };
    let (batch_kernel, ends) = run(SplittingScheme::KAHAN_LI_8);
    assert_eq!(batch_kernel, 0);
    for (i, end) in ends.into_iter().enumerate() {
        let frequency = if i % 2 == 0 { 1.5f64.sqrt() } else { 1.0 };
        // The closed form, up to the error of order 8 with ten steps; no motion changes its side before t = 1.
        assert!((end.abs() - frequency.cos()).abs() < 1e-9, "{i}: {end}");
    }
}

#[test]
fn steps_that_do_not_converge_are_those_of_a_single_run() {
    // A step for which the fixed-point iteration fails: a single run solves it by Newton's method, or reports why it
    // cannot.
    let stiff = one(HarmonicOscillator { gamma: -0.1 });
    let by = GaussCollocation { stages: 4 };
    let ensemble = Ensemble::new(&stiff, 0.0, 10, pendulum_start).by(by).steps(Steps::Size(30.0)).threads(1);
    let mut all = Vec::new();
    ensemble.run(Until::Steps(3), |member| all.push(member.clone())).unwrap();
    for (i, member) in all.iter().enumerate() {
        let problem = Problem::new(&stiff, 0.0, pendulum_start(i)).unwrap();
        let own = problem.by(by).steps(Steps::Size(30.0)).run(Until::Steps(3)).unwrap();
        let ending = member.ending.as_ref().unwrap();
        assert_eq!((ending.status, &ending.state), (own.status, &own.state()));
        assert!(!matches!(ending.status, Status::Failed { cause: StepError::NonFinite, .. }));
    }
}
