//! Ensembles: each member is the same as a single run, for any number of threads and any neighbours.

mod failures;
mod resolution;
mod rows;
mod sharded;
mod single_runs;
pub mod systems;

use crate::lagrangians::One;
use contact_geom::{Lagrangian, VelocityPoint};
use discrete_herglotz::ensemble::{BatchKernel, EnsembleError, Lagrangians, Member};
use discrete_herglotz::rules::Rule;
use discrete_herglotz::{
    CheckpointError, Ensemble, GaussCollocation, InputError, Integrator, MethodInfo, Problem, SplittingScheme, Status,
    Stepper, StepperOptions, Steps, Until,
};
use proptest::prelude::*;
use systems::pendulum;

fn unit(seed: usize) -> f64 {
    2.0 * ((seed as f64 + 0.5) * 0.618_033_988_749_894_9).fract() - 1.0
}

fn pendulum_start(i: usize) -> VelocityPoint<1> {
    VelocityPoint::new([2.0 * unit(i)], [unit(i + 1000)], 0.1)
}

/// All members at their ends.
fn members<L: Lagrangian<N> + Sync, const N: usize>(
    ensemble: &Ensemble<'_, Lagrangians<'_, L, N>>,
    until: Until,
) -> Vec<Member> {
    let mut all = Vec::new();
    let tally = ensemble.run(until, |member| all.push(member.clone())).unwrap();
    assert_eq!(tally.members, all.len());
    assert!(all.iter().enumerate().all(|(i, member)| member.index == i));
    all
}

/// The numbers of the final state of a member.
fn numbers(member: &Member) -> Vec<f64> {
    let state = &member.ending.as_ref().unwrap().state;
    state.q.iter().chain(state.p.iter()).copied().chain([state.z]).collect()
}

/// One integrator of each kernel, and a rule, which has no kernel.
#[derive(Clone, Copy, Debug)]
enum By {
    Splitting(SplittingScheme),
    Gauss(GaussCollocation),
    Rule(Rule),
}

impl<'a, L: Lagrangian<1> + 'a> Integrator<'a, L, 1> for By {
    fn info(&self) -> MethodInfo {
        match self {
            By::Splitting(by) => Integrator::<'a, L, 1>::info(by),
            By::Gauss(by) => Integrator::<'a, L, 1>::info(by),
            By::Rule(by) => Integrator::<'a, L, 1>::info(by),
        }
    }
    fn check(&self, _: &L) -> Result<(), InputError> {
        Ok(())
    }
    fn stepper(
        &self,
        of: &Problem<'a, L, 1>,
        h: f64,
        wants: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        match self {
            By::Splitting(by) => by.stepper(of, h, wants),
            By::Gauss(by) => by.stepper(of, h, wants),
            By::Rule(by) => by.stepper(of, h, wants),
        }
    }
    fn batch_kernel(&self) -> Option<BatchKernel> {
        match self {
            By::Splitting(by) => Integrator::<'a, L, 1>::batch_kernel(by),
            By::Gauss(by) => Integrator::<'a, L, 1>::batch_kernel(by),
            By::Rule(by) => Integrator::<'a, L, 1>::batch_kernel(by),
        }
    }
}

fn splitting(scheme: SplittingScheme) -> By {
    By::Splitting(scheme)
}

fn gauss(stages: usize) -> By {
    By::Gauss(GaussCollocation { stages })
}

fn integrators() -> [By; 3] {
    [splitting(SplittingScheme::BLANES_MOAN_6), gauss(5), By::Rule(Rule::MIDPOINT)]
}

#[test]
fn threads_do_not_change_a_bit() {
    let pendulum = pendulum(-0.1);
    for by in integrators() {
        let count = if let By::Rule(_) = by { 600 } else { 1500 };
        let run = |threads: usize| {
            let ensemble = Ensemble::new(&pendulum, 0.0, count, pendulum_start);
            members(&ensemble.by(by).steps(Steps::Count(7)).threads(threads), Until::Time(2.0))
        };
        let alone = run(1);
        for threads in [2, 5] {
            assert!(run(threads) == alone, "{by:?}, {threads} threads");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// Members in another order, among others and in another number of them, are the same to the last bit: also next to
    /// members that fail.
    #[test]
    fn neighbours_and_order_do_not_change_a_bit(
        starts in prop::collection::vec((-2.5f64..2.5, -1.5f64..1.5), 1..90),
        shift in 0usize..90,
        bad in prop::option::of(0usize..90),
    ) {
        for by in integrators() {
            let start = |i: usize| {
                let (q, v) = starts[i % starts.len()];
                VelocityPoint::new([q], [v], 0.0)
            };
            let pendulum = pendulum(-0.1);
            let count = starts.len();
            let plain = Ensemble::new(&pendulum, 0.0, count, start).by(by).steps(Steps::Count(5)).threads(1);
            let plain = members(&plain, Until::Time(2.0));
            // Each member twice, in another order, with an invalid one and one beyond the range of the sine in lanes.
            let moved = |i: usize| match bad {
                Some(bad) if i == bad % (2 * count) => VelocityPoint::new([f64::NAN], [0.0], 0.0),
                Some(bad) if i == (bad + 1) % (2 * count) => VelocityPoint::new([1e6], [0.0], 0.0),
                _ => start((i + shift) % count),
            };
            let others = Ensemble::new(&pendulum, 0.0, 2 * count, moved).by(by).steps(Steps::Count(5)).threads(1);
            for (i, member) in members(&others, Until::Time(2.0)).iter().enumerate() {
                let own = moved(i);
                if own.q[0].is_nan() {
                    prop_assert!(matches!(member.ending, Err(InputError::Geometry(_))));
                } else if own.q[0] < 1e5 {
                    prop_assert_eq!(&member.ending, &plain[(i + shift) % count].ending, "{:?}, {}", by, i);
                }
            }
        }
    }
}

/// The iteration ends in each lane separately: among neighbours whose steps take more iterations and fewer, a member is
/// the same as among members with its own start.
#[test]
fn a_lane_that_has_converged_does_not_change_while_others_iterate() {
    let pendulum = pendulum(-1e-3);
    let start = |i: usize| VelocityPoint::new([[0.01, 2.9, 1.5, 0.3][i % 4]], [0.0], 0.0);
    for stages in [5, 8] {
        let run = |start: &(dyn Fn(usize) -> VelocityPoint<1> + Sync)| {
            let ensemble =
                Ensemble::new(&pendulum, 0.0, 64, start).by(gauss(stages)).steps(Steps::Count(400)).threads(1);
            members(&ensemble, Until::Time(300.0))
        };
        for (own, member) in run(&start).iter().enumerate().take(4) {
            assert_eq!(member.ending, run(&|_| start(own))[own].ending, "gauss_{stages}, {own}");
        }
    }
}

#[test]
fn parameters_of_each_member() {
    let pendula: Vec<_> = (0..15).map(|i| pendulum(-0.02 * i as f64)).collect();
    for by in integrators() {
        // Twenty starts for each parameter.
        let ensemble = Ensemble::of(0.0, 300, |i| (&pendula[i / 20], pendulum_start(i % 20)));
        let all = members(&ensemble.by(by).steps(Steps::Count(10)), Until::After(1.0));
        for i in [0, 19, 123, 299] {
            let one =
                Ensemble::new(&pendula[i / 20], 0.0, 1, |_| pendulum_start(i % 20)).by(by).steps(Steps::Count(10));
            assert_eq!(members(&one, Until::After(1.0))[0].ending, all[i].ending, "{by:?}");
        }
        assert_ne!(all[0].ending, all[280].ending, "{by:?}");
        // One start for each parameter: such members are not padded to full lanes, and have runs of their own.
        let ensemble = Ensemble::of(0.0, 15, |i| (&pendula[i], pendulum_start(i))).by(by).steps(Steps::Count(10));
        let mut alone = Vec::new();
        let tally = ensemble.run(Until::After(1.0), |member| alone.push(member.clone())).unwrap();
        assert_eq!((tally.completed, tally.batch_kernel), (15, 0), "{by:?}");
        let problem = Problem::new(&pendula[7], 0.0, pendulum_start(7)).unwrap();
        let own = problem.by(by).steps(Steps::Count(10)).run(Until::After(1.0)).unwrap();
        let found = alone[7].ending.as_ref().unwrap();
        assert_eq!((found.state.q[0], found.state.p[0], Some(found.state.z)), (own.q[0], own.p[0], own.z), "{by:?}");
    }
}

#[test]
fn orders_are_those_of_the_schemes() {
    let pendulum = pendulum(-0.1);
    let ends = |by: By, steps: usize| {
        let ensemble = Ensemble::new(&pendulum, 0.0, 32, pendulum_start).by(by).steps(Steps::Count(steps));
        members(&ensemble, Until::Time(4.0))
    };
    let exact = ends(gauss(16), 16);
    let schemes =
        [(SplittingScheme::STRANG, 64), (SplittingScheme::BLANES_MOAN_4, 12), (SplittingScheme::BLANES_MOAN_6, 8)];
    let schemes = schemes.map(|(scheme, steps)| (splitting(scheme), steps));
    for (by, steps) in schemes.into_iter().chain([(gauss(2), 16), (gauss(3), 8)]) {
        let error = |steps: usize| {
            let far =
                ends(by, steps).iter().zip(&exact).map(|(a, b)| (numbers(a)[0] - numbers(b)[0]).powi(2)).sum::<f64>();
            far.sqrt().log2()
        };
        // Three halvings; the order is the mean slope, with an error from the next term of the error, which is below a
        // tenth of the first.
        let slope = (error(steps) - error(8 * steps)) / 3.0;
        assert!((slope - f64::from(Integrator::<One, 1>::info(&by).order)).abs() < 0.15, "{by:?}: {slope}");
    }
}

#[test]
fn without_the_action_nothing_else_changes() {
    for by in integrators() {
        let pendulum = pendulum(-0.1);
        let ensemble = || Ensemble::new(&pendulum, 0.0, 50, pendulum_start).by(by).steps(Steps::Count(10));
        let with = members(&ensemble(), Until::Time(1.0));
        let without = members(&ensemble().without_action(), Until::Time(1.0));
        for (a, b) in with.iter().zip(&without) {
            assert_eq!(numbers(a)[..2], numbers(b)[..2], "{by:?}");
            assert_ne!(numbers(a)[2], 0.1);
        }
        if !matches!(by, By::Rule(_)) {
            assert_eq!(numbers(&without[7])[2], 0.1, "{by:?}");
        }
    }
}

/// In an ensemble to its start all members are their starts, in lanes and one by one.
#[test]
fn an_ensemble_to_its_start_is_the_starts() {
    let pendulum = pendulum(-0.1);
    for by in integrators() {
        for steps in [Steps::Count(4), Steps::Size(0.1)] {
            let ensemble = Ensemble::new(&pendulum, 0.5, 9, pendulum_start).by(by).steps(steps);
            for member in members(&ensemble, Until::Time(0.5)) {
                let ending = member.ending.as_ref().unwrap();
                assert_eq!((ending.status, ending.unresolved), (Status::Completed, None), "{by:?}, {steps:?}");
                assert_eq!((ending.steps, ending.t), (0, 0.5), "{by:?}, {steps:?}");
                let (start, found) = (pendulum_start(member.index), ending.state.clone());
                assert_eq!((found.q, found.p, found.z), (start.q.into(), start.v.into(), start.z), "{by:?}, {steps:?}");
            }
        }
    }
}

#[test]
fn a_resumed_ensemble_is_the_same_to_the_last_bit() {
    let folder = std::env::temp_dir().join(format!("ensembles-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("shards");
    let pendulum = pendulum(-0.1);
    // One member fails.
    let start = |i: usize| if i == 500 { VelocityPoint::new([f64::NAN], [0.0], 0.0) } else { pendulum_start(i) };
    let of = |steps: usize| {
        Ensemble::new(&pendulum, 0.0, 1000, start)
            .by(GaussCollocation { stages: 3 })
            .steps(Steps::Count(steps))
            .threads(2)
    };
    let until = Until::Time(1.0);
    let bits = |ensemble: Ensemble<'_, Lagrangians<'_, One, 1>>| {
        let mut all = Vec::new();
        let tally = ensemble.run(until, |member| all.push(format!("{member:?}"))).unwrap();
        (tally, all)
    };
    let plain = bits(of(5));
    assert_eq!(plain.0.failed, 1);
    assert_eq!(bits(of(5).checkpoint(&path)), plain);
    let whole = std::fs::read(&path).unwrap();
    // Interrupted at any byte: shards that were not written completely are computed again, and the file is complete at
    // the end.
    for length in [whole.len(), whole.len() - 1, whole.len() / 2, whole.len() / 3, 32] {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert_eq!(bits(of(5).checkpoint(&path)), plain, "{length} bytes");
        assert!(std::fs::read(&path).unwrap() == whole, "{length} bytes");
    }
    let cause = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        match of(5).checkpoint(&path).run(until, |_| {}) {
            Err(EnsembleError::Checkpoint { cause, .. }) => cause,
            other => unreachable!("{other:?}"),
        }
    };
    // A changed bit of a shard and of the header; another kind of file, another version.
    for at in [100, whole.len() / 2, 17] {
        let mut damaged = whole.clone();
        damaged[at] ^= 4;
        assert!(matches!(cause(&damaged), CheckpointError::Damaged), "byte {at}");
    }
    assert!(matches!(cause(b"a letter to a friend, of no use here"), CheckpointError::Foreign));
    let mut later = whole.clone();
    later[8] = 3;
    assert!(matches!(cause(&later), CheckpointError::Version { found: 3 }));
    std::fs::write(&path, &whole).unwrap();
    let other = of(6).checkpoint(&path).run(until, |_| {});
    assert!(matches!(other, Err(EnsembleError::AnotherEnsemble { .. })), "{other:?}");
    let other = of(5).by(GaussCollocation { stages: 4 }).checkpoint(&path).run(until, |_| {});
    assert!(matches!(other, Err(EnsembleError::AnotherEnsemble { .. })), "another integrator: {other:?}");
    let nowhere = of(5).checkpoint(folder.join("missing").join("shards")).run(until, |_| {});
    assert!(matches!(nowhere, Err(EnsembleError::Checkpoint { cause: CheckpointError::Unreadable(_), .. })));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn progress_ends_at_one() {
    let reported = std::cell::RefCell::new(Vec::new());
    let pendulum = pendulum(-0.1);
    let ensemble =
        Ensemble::new(&pendulum, 0.0, 1000, pendulum_start).by(SplittingScheme::STRANG).steps(Steps::Count(2));
    ensemble.progress(|part| reported.borrow_mut().push(part)).run(Until::Time(1.0), |_| {}).unwrap();
    let reported = reported.into_inner();
    assert!(reported.is_sorted() && reported.len() > 1 && reported.last() == Some(&1.0), "{reported:?}");
}
