//! Ensembles: each member is the same as a single run, for any number of threads and any neighbours.

// In a test a missing value is a failure.
#![allow(clippy::unwrap_used)]

mod resolution;
mod rows;

use contact_geom::nalgebra::SVector;
use contact_geom::systems::{Duffing, HarmonicOscillator, Kepler, Pendulum};
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};
use discrete_herglotz::rules::MidpointRule;
use discrete_herglotz::{
    CheckpointError, Ensemble, Event, Events, GaussCollocation, InputError, Integrator, MethodInfo, Problem, Row, Rows,
    SplittingScheme, Status, StepError, Stepper, StepperOptions, Steps, Until,
    ensemble::{BatchKernel, Ending, EnsembleError, Member},
    rules::QuadratureMethod,
};
use proptest::prelude::*;

/// The Hénon-Heiles potential with a mass matrix that is not diagonal, and linear drag.
struct HenonHeiles;

impl Lagrangian<2> for HenonHeiles {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let kinetic = (v[0] * v[0] + v[1] * v[1]) * 0.5 + v[0] * v[1] * 0.25;
        let cubic = q[0] * q[0] * q[1] - q[1] * q[1] * q[1] / 3.0;
        kinetic - (q[0] * q[0] + q[1] * q[1]) * 0.5 - cubic - z * 0.02
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// `v^2/2 + sqrt(1 - q^2) - z/10`: not defined beyond one.
struct Bowl;

impl Lagrangian<1> for Bowl {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + (-(q[0] * q[0]) + 1.0).sqrt() - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// An oscillator whose formula branches on the value of its position.
struct Branching;

impl Lagrangian<1> for Branching {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let stiffness = if q[0].re() < 0.0 { 1.0 } else { 1.5 };
        (v[0] * v[0] - q[0] * q[0] * stiffness) * 0.5
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

fn unit(seed: usize) -> f64 {
    2.0 * ((seed as f64 + 0.5) * 0.618_033_988_749_894_9).fract() - 1.0
}

fn pendulum_start(i: usize) -> VelocityPoint<1> {
    VelocityPoint::new([2.0 * unit(i)], [unit(i + 1000)], 0.1)
}

fn plane_start(i: usize) -> VelocityPoint<2> {
    VelocityPoint::new([0.2 * unit(i), 0.2 * unit(i + 99)], [0.2 * unit(i + 7), 0.2], -0.3)
}

fn orbit_start(i: usize) -> VelocityPoint<2> {
    VelocityPoint::new([1.0 + 0.1 * unit(i), 0.0], [0.0, 1.0], 0.0)
}

/// All members at their ends.
fn members<const N: usize>(ensemble: &Ensemble<'_, impl Lagrangian<N> + Sync, N>, until: Until) -> Vec<Member<N>> {
    let mut all = Vec::new();
    let tally = ensemble.run(until, |member| all.push(member.clone())).unwrap();
    assert_eq!(tally.members, all.len());
    assert!(all.iter().enumerate().all(|(i, member)| member.index == i));
    all
}

/// The numbers of the final state of a member.
fn numbers<const N: usize>(member: &Member<N>) -> Vec<f64> {
    let state = member.ending.unwrap().state;
    state.q.iter().chain(state.p.iter()).copied().chain([state.z]).collect()
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
            let mut own =
                integrator.stepper(&problem, h, StepperOptions { action: true, check_resolution: false }).unwrap();
            own.advance(steps).unwrap();
            let ending = member.ending.unwrap();
            assert_eq!((ending.status, ending.steps, ending.t), (Status::Completed, steps, own.time()), "{name}");
            let own = Member { index: 0, ending: Ok(Ending { state: own.state(), ..ending }), rows: Vec::new() };
            for (a, b) in numbers(member).iter().zip(numbers(&own)) {
                // The largest distance is not taken by `max`, which would lose a NaN.
                let apart = (a - b).abs() / b.abs().max(1.0);
                farthest = if apart <= farthest { farthest } else { apart };
            }
        })
        .unwrap();
    assert_eq!((tally.batch_kernel, tally.completed), (count, count), "{name}");
    farthest
}

#[test]
fn by_splittings_members_are_single_runs_to_the_last_bit() {
    for scheme in SplittingScheme::ALL {
        let (by, name) = (scheme, scheme.name());
        // Sums, products, quotients and roots are rounded alike in all instruction sets; one mass matrix is not
        // diagonal.
        assert_eq!(distance(&Kepler::<2>::default(), orbit_start, by, 50), 0.0, "{name}");
        assert_eq!(distance(&HenonHeiles, plane_start, by, 50), 0.0, "{name}");
        assert_eq!(distance(&HarmonicOscillator { gamma: -0.1 }, pendulum_start, by, 50), 0.0, "{name}");
        // The sine has an error of 2 units in the last place, at most 35 of which enter a step, each times a part of
        // the step; in five units of time a difference grows at most by e^5, near the upper equilibrium, and the
        // motions here stay below it.
        let apart = distance(&Pendulum { gamma: -0.01 }, pendulum_start, by, 50);
        assert!(apart <= 64.0 * f64::EPSILON, "{name}: {apart:e}");
    }
}

#[test]
fn a_drag_that_depends_on_time_and_forces_that_do_are_those_of_single_runs() {
    let by = SplittingScheme::BLANES_MOAN_4;
    // The sine of the forcing is the one of the lanes.
    let apart = distance(&Duffing::forced(), pendulum_start, by, 50);
    assert!(apart <= 64.0 * f64::EPSILON, "{apart:e}");
}

#[test]
fn by_collocation_members_are_single_runs_but_for_rounding() {
    for stages in 1..=16 {
        let by = GaussCollocation { stages };
        let systems = [
            distance(&Kepler::<2>::default(), orbit_start, by, 40),
            distance(&HenonHeiles, plane_start, by, 40),
            distance(&HarmonicOscillator { gamma: -0.1 }, pendulum_start, by, 40),
            distance(&Pendulum { gamma: -0.01 }, pendulum_start, by, 40),
        ];
        // Both solve the stages to round-off, of which a few units remain after 40 steps, and an orbit multiplies them
        // by 3/2 of its phase.
        assert!(systems.iter().all(|apart| *apart <= 64.0 * f64::EPSILON), "{stages} stages: {systems:?}");
    }
}

/// One integrator of each kernel, and a rule, which has no kernel.
#[derive(Clone, Copy, Debug)]
enum By {
    Splitting(SplittingScheme),
    Gauss(GaussCollocation),
    Rule(QuadratureMethod<MidpointRule>),
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
    ) -> Result<Box<dyn Stepper<1> + 'a>, InputError> {
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
    [splitting(SplittingScheme::BLANES_MOAN_6), gauss(5), By::Rule(QuadratureMethod::default())]
}

#[test]
fn threads_do_not_change_a_bit() {
    for by in integrators() {
        let count = if let By::Rule(_) = by { 600 } else { 1500 };
        let run = |threads: usize| {
            let ensemble = Ensemble::new(&Pendulum { gamma: -0.1 }, 0.0, count, pendulum_start);
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
            let pendulum = Pendulum { gamma: -0.1 };
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
                    prop_assert_eq!(member.ending, plain[(i + shift) % count].ending, "{:?}, {}", by, i);
                }
            }
        }
    }
}

/// The iteration ends in each lane separately: among neighbours whose steps take more iterations and fewer, a member is
/// the same as among members with its own start.
#[test]
fn a_lane_that_has_converged_does_not_change_while_others_iterate() {
    let pendulum = Pendulum { gamma: -1e-3 };
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
fn a_member_that_fails_has_its_error_and_the_others_continue() {
    // From q = 0.5 with v = 5 the motion crosses the edge; at 2 L is not defined.
    let start = |i: usize| match i {
        3 => VelocityPoint::new([0.5], [5.0], 0.0),
        20 => VelocityPoint::new([2.0], [0.0], 0.0),
        21 => VelocityPoint::new([0.1], [f64::INFINITY], 0.0),
        _ => VelocityPoint::new([0.001 * i as f64], [0.1], 0.0),
    };
    let good = |i: usize| VelocityPoint::new([0.001 * i as f64], [0.1], 0.0);
    for by in [splitting(SplittingScheme::KAHAN_LI_6), gauss(4), By::Rule(QuadratureMethod::default())] {
        let all = |start: &(dyn Fn(usize) -> VelocityPoint<1> + Sync)| {
            let ensemble = Ensemble::new(&Bowl, 0.0, 40, start).by(by).steps(Steps::Count(20)).threads(1);
            let mut all = Vec::new();
            (ensemble.run(Until::Time(2.0), |member| all.push(member.clone())).unwrap(), all)
        };
        let ((tally, mixed), (_, plain)) = (all(&start), all(&good));
        assert_eq!((tally.completed, tally.failed, tally.first_failed), (37, 3, Some(3)), "{by:?}");
        let Ok(failed) = mixed[3].ending else { unreachable!("{by:?}: {:?}", mixed[3]) };
        assert!(matches!(failed.status, Status::Failed { .. }), "{by:?}: {failed:?}");
        assert!(failed.t < 2.0 && failed.state.q[0].is_finite(), "{by:?}: {failed:?}");
        assert_eq!(mixed[20].ending, Err(InputError::Undefined), "{by:?}");
        assert!(matches!(mixed[21].ending, Err(InputError::Geometry(_))), "{by:?}: {:?}", mixed[21].ending);
        for i in (0..40).filter(|i| ![3, 20, 21].contains(i)) {
            assert_eq!(mixed[i], plain[i], "{by:?}");
        }
    }
}

#[test]
fn a_formula_that_branches_is_run_one_by_one() {
    let start = |i: usize| VelocityPoint::new([if i.is_multiple_of(2) { 1.0 } else { -1.0 }], [0.0], 0.0);
    let run = |by: SplittingScheme| {
        let ensemble = Ensemble::new(&Branching, 0.0, 20, start).by(by).steps(Steps::Count(10));
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
fn parameters_of_each_member() {
    let pendula: Vec<Pendulum> = (0..30).map(|i| Pendulum { gamma: -0.01 * i as f64 }).collect();
    for by in integrators() {
        // Ten starts for each parameter.
        let ensemble = Ensemble::of(0.0, 300, |i| (&pendula[i / 10], pendulum_start(i % 10)));
        let all = members(&ensemble.by(by).steps(Steps::Count(10)), Until::After(1.0));
        for i in [0, 19, 123, 299] {
            let one =
                Ensemble::new(&pendula[i / 10], 0.0, 1, |_| pendulum_start(i % 10)).by(by).steps(Steps::Count(10));
            assert_eq!(members(&one, Until::After(1.0))[0].ending, all[i].ending, "{by:?}");
        }
        assert_ne!(all[0].ending, all[290].ending, "{by:?}");
    }
}

#[test]
fn orders_are_those_of_the_schemes() {
    let pendulum = Pendulum { gamma: -0.1 };
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
        assert!((slope - f64::from(Integrator::<Pendulum, 1>::info(&by).order)).abs() < 0.15, "{by:?}: {slope}");
    }
}

#[test]
fn without_the_action_nothing_else_changes() {
    for by in integrators() {
        let pendulum = Pendulum { gamma: -0.1 };
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

#[test]
fn bad_input_is_refused_before_work_begins() {
    let pendulum = Pendulum { gamma: -0.1 };
    let by = SplittingScheme::STRANG;
    let of = |count: usize| Ensemble::new(&pendulum, 0.0, count, pendulum_start).by(by).steps(Steps::Count(4));
    let fold = |_: &Member<1>| unreachable!("nothing is computed");
    let until = Until::Time(1.0);
    assert!(matches!(of(0).run(until, fold), Err(EnsembleError::Empty)));
    assert!(matches!(of(1).threads(0).run(until, fold), Err(EnsembleError::Threads)));
    let refused = |result: Result<_, EnsembleError>| match result {
        Err(EnsembleError::Member { index: 0, cause }) => cause,
        other => unreachable!("{other:?}"),
    };
    let endless = refused(of(9).run(Until::Time(f64::INFINITY), fold));
    assert_eq!(endless, InputError::Span { span: f64::INFINITY });
    assert!(matches!(refused(of(9).steps(Steps::Size(-1.0)).run(until, fold)), InputError::Step { .. }));
    let none = Ensemble::new(&pendulum, 0.0, 9, pendulum_start);
    assert_eq!(refused(none.run(until, fold)), InputError::NoIntegrator);
    let none = Ensemble::new(&pendulum, 0.0, 9, pendulum_start).by(by);
    assert_eq!(refused(none.run(until, fold)), InputError::NoSteps);
    // An invalid start in an ensemble in which all starts are invalid.
    let nowhere = Ensemble::new(&pendulum, 0.0, 9, |_| VelocityPoint::new([f64::NAN], [0.0], 0.0)).by(by);
    assert!(matches!(refused(nowhere.steps(Steps::Count(4)).run(until, fold)), InputError::Geometry(_)));
    assert!(Integrator::<Pendulum, 1>::batch_kernel(&by).is_some());
}

/// In an ensemble to its start all members are their starts, in lanes and one by one.
#[test]
fn an_ensemble_to_its_start_is_the_starts() {
    let pendulum = Pendulum { gamma: -0.1 };
    for by in integrators() {
        for steps in [Steps::Count(4), Steps::Size(0.1)] {
            let ensemble = Ensemble::new(&pendulum, 0.5, 9, pendulum_start).by(by).steps(steps);
            for member in members(&ensemble, Until::Time(0.5)) {
                let ending = member.ending.unwrap();
                assert_eq!((ending.status, ending.unresolved), (Status::Completed, None), "{by:?}, {steps:?}");
                assert_eq!((ending.steps, ending.t), (0, 0.5), "{by:?}, {steps:?}");
                let (start, found) = (pendulum_start(member.index), ending.state);
                assert_eq!((found.q, found.p, found.z), (start.q, start.v, start.z), "{by:?}, {steps:?}");
            }
        }
    }
}

#[test]
fn a_resumed_ensemble_is_the_same_to_the_last_bit() {
    let folder = std::env::temp_dir().join(format!("ensembles-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("shards");
    let pendulum = Pendulum { gamma: -0.1 };
    // One member fails.
    let start = |i: usize| if i == 500 { VelocityPoint::new([f64::NAN], [0.0], 0.0) } else { pendulum_start(i) };
    let of = |steps: usize| {
        Ensemble::new(&pendulum, 0.0, 1000, start)
            .by(GaussCollocation { stages: 3 })
            .steps(Steps::Count(steps))
            .threads(2)
    };
    let until = Until::Time(1.0);
    let bits = |ensemble: Ensemble<'_, Pendulum, 1>| {
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
    let pendulum = Pendulum { gamma: -0.1 };
    let ensemble =
        Ensemble::new(&pendulum, 0.0, 1000, pendulum_start).by(SplittingScheme::STRANG).steps(Steps::Count(2));
    ensemble.progress(|part| reported.borrow_mut().push(part)).run(Until::Time(1.0), |_| {}).unwrap();
    let reported = reported.into_inner();
    assert!(reported.is_sorted() && reported.len() > 1 && reported.last() == Some(&1.0), "{reported:?}");
}

#[test]
fn a_panic_of_the_start_is_one_of_the_run() {
    let pendulum = Pendulum { gamma: -0.1 };
    let start = |i: usize| if i == 777 { unreachable!("a start that panics") } else { pendulum_start(i) };
    let ensemble =
        Ensemble::new(&pendulum, 0.0, 100_000, start).by(SplittingScheme::STRANG).steps(Steps::Count(2)).threads(3);
    // The panic does not cause a deadlock.
    let run = std::panic::AssertUnwindSafe(|| ensemble.run(Until::Time(1.0), |_| {}));
    assert!(std::panic::catch_unwind(run).is_err());
}

#[test]
fn steps_that_do_not_converge_are_those_of_a_single_run() {
    // A step for which the fixed-point iteration fails: a single run solves it by Newton's method, or reports why it
    // cannot.
    let stiff = HarmonicOscillator { gamma: -0.1 };
    let by = GaussCollocation { stages: 4 };
    let ensemble = Ensemble::new(&stiff, 0.0, 10, pendulum_start).by(by).steps(Steps::Size(30.0)).threads(1);
    let mut all = Vec::new();
    ensemble.run(Until::Steps(3), |member| all.push(member.clone())).unwrap();
    for (i, member) in all.iter().enumerate() {
        let problem = Problem::new(&stiff, 0.0, pendulum_start(i)).unwrap();
        let own = problem.by(by).steps(Steps::Size(30.0)).run(Until::Steps(3)).unwrap();
        let ending = member.ending.unwrap();
        assert_eq!((ending.status, ending.state), (own.status, own.state()));
        assert!(!matches!(ending.status, Status::Failed { cause: StepError::NonFinite, .. }));
    }
}
