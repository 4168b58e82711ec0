//! The run time that each omitted computation saves: the same motion with and without the computation, measured in one
//! run, and the difference of the results.
//!
//! Prints a table, and writes `skips.csv` into the directory that the environment variable `OUT` names, if it is set.

use contact_examples::systems::{DoublePendulum, HarmonicOscillator, Kepler, Pendulum, QuadraticInZ, System};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint, WithoutClosedDerivatives};
use discrete_herglotz::{
    AnyIntegrator, Event, Events, InputError, Outcome, Problem, Rows, Run, SplittingScheme, Status, Steps, Until,
};
use std::hint::black_box;
use std::io::Write;
use std::time::Instant;

/// A Lagrangian that claims less structure than it has, so that a method does the work that the claim would save.
struct Claiming<L>(L, Structure);

impl<const N: usize, L: Lagrangian<N>> Lagrangian<N> for Claiming<L> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, v, z)
    }
    fn structure(&self) -> Structure {
        self.1
    }
}

/// One line of the table.
struct Line {
    what: &'static str,
    on: &'static str,
    full: f64,
    skipped: f64,
    apart: f64,
}

/// The number of runs from which a median is taken.
const RUNS: usize = 41;

/// The median time of a motion, in microseconds, with its outcome.
type Timed = Result<(f64, Outcome), InputError>;

fn median(mut times: Vec<f64>, outcome: Outcome) -> Timed {
    assert_eq!(outcome.status, Status::Completed);
    times.sort_by(f64::total_cmp);
    Ok((times[RUNS / 2], outcome))
}

/// The time of the steps of a run, without its set-up.
fn steps<P>(run: &Run<'_, '_, P>, until: Until) -> Timed {
    let plan = run.plan(until)?;
    let mut times = Vec::with_capacity(RUNS);
    for _ in 0..RUNS {
        let mut stepper = plan.stepper()?;
        let clock = Instant::now();
        let halted = stepper.advance(plan.count());
        times.push(clock.elapsed().as_secs_f64() * 1e6);
        assert!(halted.is_ok(), "{halted:?}");
    }
    median(times, plan.run()?)
}

/// The time of a whole run, with its work between the steps.
fn whole(run: impl Fn() -> Result<Outcome, InputError>) -> Timed {
    let mut times = Vec::with_capacity(RUNS);
    for _ in 0..RUNS {
        let clock = Instant::now();
        black_box(run()?);
        times.push(clock.elapsed().as_secs_f64() * 1e6);
    }
    median(times, run()?)
}

/// A line of the table, from a motion with the full computation and one that skips a part of it.
fn line((what, on): (&'static str, &'static str), full: Timed, skipping: Timed) -> Result<Line, InputError> {
    let ((full, a), (skipped, b)) = (full?, skipping?);
    let size = a.q.amax().max(a.p.amax());
    Ok(Line { what, on, full, skipped, apart: (a.q - b.q).amax().max((a.p - b.p).amax()) / size })
}

fn lines() -> Result<Vec<Line>, InputError> {
    let start = VelocityPoint::new([1.0], [1.0], 0.0);
    let late = Until::Time(1000.0);
    let sixteen = AnyIntegrator::Gauss { stages: 16 };
    let eight = AnyIntegrator::Gauss { stages: 8 };
    let nystrom = AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6);

    let pendulum = Pendulum { gamma: -0.01 };
    let swing = Problem::new(&pendulum, 0.0, start)?;
    let with_z = |by: AnyIntegrator, h: f64| steps(&swing.by(by).steps(Steps::Size(h)), late);
    let without_z = |by: AnyIntegrator, h: f64| steps(&swing.by(by).steps(Steps::Size(h)).without_action(), late);
    let affine = Structure { separable: false, ..pendulum.structure() };
    let constant_mass = Claiming(pendulum, affine);
    let plain = Claiming(pendulum, Structure { constant_mass: false, ..affine });
    let general = |lagrangian| {
        let swing = Problem::new(lagrangian, 0.0, start)?;
        steps(&swing.by(eight).steps(Steps::Size(1.0)).without_action(), late)
    };
    // A plan has no observers, so that planning is part of the time with rows and without.
    let recorded = || {
        let mut rows = Rows::every(1)?.without_action();
        swing.by(nystrom).steps(Steps::Size(0.2)).without_action().observe(&mut rows).run(late)
    };
    let unrecorded = || swing.by(nystrom).steps(Steps::Size(0.2)).without_action().run(late);
    // One row within each step, and about three hundred crossings.
    let by_eight = || swing.by(eight).steps(Steps::Size(1.0)).without_action();
    let times: Vec<f64> = (0..1000).map(|k| f64::from(k) + 0.37).collect();
    let between = || {
        let mut rows = Rows::at(times.iter().copied())?.without_action();
        by_eight().observe(&mut rows).run(late)
    };
    let hundred: Vec<f64> = (0..100_000).map(|k| f64::from(k) / 100.0 + 0.0037).collect();
    let dense = |exact: bool| {
        let mut rows = Rows::at(hundred.iter().copied())?.without_action();
        let run = by_eight().observe(&mut rows);
        if exact { run.with_exact_states().run(late) } else { run.run(late) }
    };
    let crossing = |at: f64| {
        let mut lowest = Events::new([Event::new(move |_, x| x.q[0] - at)]).without_action();
        by_eight().observe(&mut lowest).run(late)
    };

    let oscillator = HarmonicOscillator { gamma: -0.05 };
    let unquadratic = Claiming(oscillator, Structure { quadratic: false, ..oscillator.structure() });
    let (linear, iterated) = (Problem::new(&oscillator, 0.0, start)?, Problem::new(&unquadratic, 0.0, start)?);
    let kepler = Kepler::<2> { mu: 1.0, gamma: -1e-4 };
    let orbit = Problem::new(&kepler, 0.0, kepler.initial())?;
    let around = || orbit.by(sixteen).steps(Steps::Size(0.5));
    let square = QuadraticInZ { c: 0.1 };
    let decay = Problem::new(&square, 0.0, VelocityPoint::new([1.0], [0.0], 1.0))?;
    let decaying = || decay.by(eight).steps(Steps::Size(2.0));
    let with_factor = decaying().with_conformal_factor().plan(Until::Time(100.0))?;
    let without_factor = decaying().plan(Until::Time(100.0))?;
    let double = DoublePendulum::default();
    let chaos = Problem::new(&double, 0.0, double.initial())?;
    let by = |integrator: AnyIntegrator| steps(&chaos.by(integrator).steps(Steps::Size(0.05)), Until::Time(20.0));

    let dual = WithoutClosedDerivatives(pendulum);
    let dual = Problem::new(&dual, 0.0, start)?;
    let derived = |by: AnyIntegrator, h: f64| steps(&dual.by(by).steps(Steps::Size(h)).without_action(), late);

    Ok(vec![
        line(("automatic differentiation", "pendulum, gauss_16"), derived(sixteen, 2.5), without_z(sixteen, 2.5))?,
        line(("automatic differentiation", "pendulum, blanes_moan_6"), derived(nystrom, 0.2), without_z(nystrom, 0.2))?,
        line(("z", "pendulum, gauss_16"), with_z(sixteen, 2.5), without_z(sixteen, 2.5))?,
        line(("z", "pendulum, blanes_moan_6"), with_z(nystrom, 0.2), without_z(nystrom, 0.2))?,
        line(
            ("z", "Kepler, gauss_16"),
            steps(&around(), Until::Time(200.0)),
            steps(&around().without_action(), Until::Time(200.0)),
        )?,
        line(
            ("iteration (one matrix)", "oscillator, gauss_16"),
            steps(&iterated.by(sixteen).steps(Steps::Size(2.5)).without_action(), late),
            steps(&linear.by(sixteen).steps(Steps::Size(2.5)).without_action(), late),
        )?,
        line(("stages of z and rho", "pendulum, gauss_8"), general(&constant_mass), without_z(eight, 1.0))?,
        line(("mass matrix at the stages", "pendulum, gauss_8"), general(&plain), general(&constant_mass))?,
        line(
            ("Newton's method", "double pendulum, midpoint by composition or gauss_3"),
            by(AnyIntegrator::Composition(discrete_herglotz::rules::Method::Midpoint, SplittingScheme::YOSHIDA_6)),
            by(AnyIntegrator::Gauss { stages: 3 }),
        )?,
        line(("rows", "pendulum, blanes_moan_6"), whole(recorded), whole(unrecorded))?,
        line(("rows between steps", "pendulum, gauss_8"), whole(between), whole(|| by_eight().run(late)))?,
        line(("steps to a hundred rows", "pendulum, gauss_8"), whole(|| dense(true)), whole(|| dense(false)))?,
        line(
            ("event without a crossing", "pendulum, gauss_8"),
            whole(|| crossing(9.0)),
            whole(|| by_eight().run(late)),
        )?,
        line(("an event", "pendulum, gauss_8"), whole(|| crossing(0.0)), whole(|| crossing(9.0)))?,
        line(
            ("conformal factor", "quadratic in z, gauss_8"),
            whole(|| with_factor.run()),
            whole(|| without_factor.run()),
        )?,
    ])
}

fn main() {
    // `cargo test --benches` passes `--test`; nothing is measured in that case.
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let lines = match lines() {
        Ok(lines) => lines,
        Err(error) => {
            eprintln!("{error}");
            std::process::exit(1);
        }
    };
    println!("{:28} {:52} {:>10} {:>10} {:>6} {:>9}", "what is skipped", "on", "with, us", "without", "ratio", "apart");
    for Line { what, on, full, skipped, apart } in &lines {
        println!("{what:28} {on:52} {full:10.1} {skipped:10.1} {:6.2} {apart:9.1e}", full / skipped);
    }
    let Ok(out) = std::env::var("OUT") else { return };
    let written = std::fs::File::create(std::path::Path::new(&out).join("skips.csv")).and_then(|mut file| {
        writeln!(file, "skipped,on,seconds_with,seconds_without,apart")?;
        lines.iter().try_for_each(|l| {
            writeln!(file, "{},\"{}\",{:e},{:e},{:e}", l.what, l.on, l.full * 1e-6, l.skipped * 1e-6, l.apart)
        })
    });
    if let Err(error) = written {
        eprintln!("{error}");
        std::process::exit(1);
    }
}
