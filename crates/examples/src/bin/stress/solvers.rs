//! Solvers on difficult problems: the work must be bounded, and the status right.

use crate::formula::{Feature, Formula, Kinetic, Rate, Smooth};
use crate::motion::{FAMILIES, Problem, RunEnd, Verdict};
use crate::parallel::parallel;
use crate::probe::{Ended, PROBES, ask};
use crate::random::Random;
use contact_examples::Report;
use contact_examples::{Axis, Curve, Failure, Line, Panel, draw, number};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{ChartVector, PhasePoint, VelocityPoint, numbers::max_or_nan};
use discrete_herglotz::{
    AnyIntegrator, InputError, Start, Stepper, StepperOptions, Steps,
    gauss::GaussStepper,
    rules::{Flow, Rule},
    solve::Solver,
};
use std::time::{Duration, Instant};

/// The bound on the time of a step whose iteration does not contract, relative to one whose iteration contracts.
const MAX_TIME_RATIO: f64 = 30.0;

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let mut rows = Vec::new();
    alone(report, &mut rows)?;
    poor_guesses(report, &mut rows)?;
    domains(report, &mut rows)?;
    matrices(report, &mut rows)?;
    price(report)?;
    report.table("", &["what", "by", "parameter", "ended", "error"], rows)
}

fn row(what: &str, by: &str, parameter: &str, ended: &str, error: f64) -> Vec<String> {
    vec![what.into(), by.into(), parameter.into(), ended.into(), number(error)]
}

/// Calls that may not return, or may crash the process.
fn alone(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    // A call that takes ten seconds counts as one that does not end; the quick form waits for three seconds.
    let time_limit = Duration::from_secs(if report.quick { 3 } else { 10 });
    let found = parallel(&report.bar, PROBES.len(), |i| ask(PROBES[i].0, time_limit));
    let (mut crashed, mut endless, mut otherwise) = (0, 0, 0);
    let mut lines = Vec::new();
    for ((name, right, _), ended) in PROBES.iter().zip(found) {
        let ended = ended.map_err(Failure::terminal)?;
        match &ended {
            Ended::Crashed => crashed += 1,
            Ended::TimedOut => endless += 1,
            Ended::Answered(text) => otherwise += u32::from(!right.iter().any(|word| text.starts_with(word))),
        }
        rows.push(row("alone", name, "-", ended.text(), f64::NAN));
        lines.push(vec![(*name).into(), right.join(" or "), ended.text().into()]);
    }
    report.markdown(&["call", "right answer", "found"], lines);
    report.at_most("calls that crash", f64::from(crashed), 0.0)?;
    report.at_most("calls that do not end", f64::from(endless), 0.0)?;
    report.at_most("calls that end with a wrong answer", f64::from(otherwise), 0.0)
}

/// First steps from guesses of the velocity that are far from the solution, where there is only one solution.
fn poor_guesses(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let smooth = Smooth { spring: 1.0, quartic: 1.0, ..Smooth::default() };
    let hard = Formula::<1> { smooth, rate: Rate::Constant(-0.1), ..Formula::FREE };
    let fast = Formula::<1> { kinetic: Kinetic::Relativistic, ..hard };
    let mut wrong = 0;
    for (name, system) in [("quartic", hard), ("relativistic", fast)] {
        let state = PhasePoint::new([0.5], [0.4], 0.1);
        for guess in [0.0, 0.3, 0.999, 1.0, -5.0, 1e3, 1e10, 1e160, f64::MAX, f64::INFINITY, f64::NAN] {
            let (midpoint, trapezoidal) = (Rule::MIDPOINT.of(&system, 0.25)?, Rule::TRAPEZOIDAL.of(&system, 0.25)?);
            let v = SVector::from([guess]);
            let gauss = discrete_herglotz::Problem::new(&system, 0.0, Start::Momentum(state, v))
                .and_then(|motion| GaussStepper::new(&motion, 8, 0.25, StepperOptions::default()));
            let found = [
                ("midpoint", first_step(Flow::with_guess(&midpoint, 0.0, state, v))),
                ("trapezoidal", first_step(Flow::with_guess(&trapezoidal, 0.0, state, v))),
                ("gauss_8", first_step(gauss)),
            ];
            let start = VelocityPoint { q: state.q, v: SVector::from([velocity(&system, state.p[0])]), z: state.z };
            let problem = Problem { system, t0: 0.0, start, span: 0.25 };
            let truth = problem.exact().map_err(Failure::from)?;
            for (by, found) in found {
                let (verdict, error) = match found {
                    None => (Verdict::Refused, f64::NAN),
                    Some(x) => {
                        (RunEnd::Completed(x).verdict(&truth, 0.0, 0.02), RunEnd::Completed(x).error(&truth, 0.0))
                    }
                };
                wrong += u32::from(verdict.is_failure());
                rows.push(row(&format!("poor guess, {name}"), by, &format!("{guess:e}"), verdict.name(), error));
            }
        }
    }
    report.at_most("first steps from poor guesses of the velocity: silently wrong", f64::from(wrong), 0.0)
}

/// The state after one step; `None` if the step fails.
fn first_step(stepper: Result<impl Stepper, InputError>) -> Option<PhasePoint<1>> {
    let mut stepper = stepper.ok()?;
    stepper.advance(1).ok()?;
    Some(stepper.state().fixed())
}

/// The velocity for a momentum.
fn velocity(system: &Formula<1>, p: f64) -> f64 {
    match system.kinetic {
        Kinetic::Relativistic => p / (1.0 + p * p).sqrt(),
        _ => p,
    }
}

/// Motions that leave the domain of L, and motions over kinks: each must end with a status, and no result may be NaN.
fn domains(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let (mut on, mut broken) = (0, 0);
    for speed in [0.5, 1.5, 3.0, 100.0] {
        let system = Formula { feature: Feature::Domain, rate: Rate::Constant(-0.05), ..Formula::<1>::FREE };
        let problem = Problem { system, t0: 0.0, start: VelocityPoint::new([0.2], [speed], 0.0), span: 5.0 };
        // A particle that is too slow to reach the border of the domain stays inside, and its exact motion is known.
        let truth = problem.exact().ok();
        for (integrator, count) in FAMILIES.into_iter().flat_map(|i| [5, 50, 1000].map(|n| (i, n))) {
            let outside = PhasePoint::new([1e9], [1e9], 0.0);
            let (verdict, error) = problem.verdict(integrator, count, truth.as_ref().unwrap_or(&outside), 0.0);
            on += u32::from(verdict == Verdict::Wrong);
            broken += u32::from(matches!(verdict, Verdict::NonFinite | Verdict::Panicked));
            rows.push(row("domain", &integrator.to_string(), &speed.to_string(), verdict.name(), error));
        }
    }
    report.at_most("motions that leave the domain of L: silently continued", f64::from(on), 0.0)?;
    let mut silent = 0;
    for (at, slope) in [(0.3, 1.0), (0.0, 5.0), (-0.2, 100.0)] {
        let smooth = Smooth { spring: 1.0, ..Smooth::default() };
        let system = Formula { smooth, feature: Feature::Kink { at, slope }, ..Formula::<1>::FREE };
        let problem = Problem { system, t0: 0.0, start: VelocityPoint::new([1.0], [0.0], 0.0), span: 3.0 };
        let energy = |x: &PhasePoint<1>| 0.5 * (x.p[0] * x.p[0] + x.q[0] * x.q[0]) + slope * (x.q[0] - at).abs();
        let first = energy(&problem.state());
        for (integrator, count) in FAMILIES.into_iter().flat_map(|i| [10, 200].map(|n| (i, n))) {
            let end = problem.by(integrator, count);
            let (verdict, error) = match &end {
                RunEnd::Completed(x) => {
                    let error = (energy(x) - first).abs() / first;
                    let finite = ChartVector::from(*x).is_finite();
                    (
                        if !finite {
                            Verdict::NonFinite
                        } else if error <= 0.1 {
                            Verdict::Right
                        } else {
                            Verdict::Wrong
                        },
                        error,
                    )
                }
                other => (other.verdict(&problem.state(), 0.0, 0.1), f64::NAN),
            };
            silent += u32::from(verdict == Verdict::Wrong);
            broken += u32::from(matches!(verdict, Verdict::NonFinite | Verdict::Panicked));
            rows.push(row("kink", &integrator.to_string(), &slope.to_string(), verdict.name(), error));
        }
    }
    report.at_most("motions over kinks: energy silently wrong by a tenth", f64::from(silent), 0.0)?;
    report.at_most("motions over kinks and boundaries of domains: NaN or a panic", f64::from(broken), 0.0)
}

/// The size from which faer solves the linear systems.
const SIZE: usize = 32;

/// Singular, graded and non-finite matrices: each must be refused, or solved to the rounding of its entries.
fn matrices(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let mut random = Random::new(9, 0);
    let dense = SMatrix::<f64, SIZE, SIZE>::from_fn(|_, _| random.between(-1.0, 1.0));
    let with = |i: usize, j: usize, x: f64| {
        let mut m = dense;
        m[(i, j)] = x;
        m
    };
    let twice = SMatrix::<f64, SIZE, SIZE>::from_fn(|i, j| dense[(if i == 7 { 3 } else { i }, j)]);
    let graded = SMatrix::<f64, SIZE, SIZE>::from_fn(|i, j| dense[(i, j)] * 10f64.powi(-(9 * i as i32)));
    let cases = [
        ("dense", dense),
        ("zero", dense * 0.0),
        ("two equal rows", twice),
        ("rows graded to 1e-279", graded),
        ("all of 1e300", dense * 1e300),
        ("all of 1e-300", dense * 1e-300),
        ("subnormal", dense * 1e-310),
        ("one NaN", with(3, 4, f64::NAN)),
        ("one NaN in the last place", with(SIZE - 1, SIZE - 1, f64::NAN)),
        ("one infinity", with(0, 0, f64::INFINITY)),
        ("one infinity below", with(SIZE - 1, 0, f64::NEG_INFINITY)),
    ];
    let (mut wrong, mut worst) = (0, 0.0);
    for (name, matrix) in cases {
        let solution = SVector::<f64, SIZE>::from_fn(|i, _| 1.0 + i as f64 / SIZE as f64);
        for (by, mut solver) in [("stack", Solver::<SIZE>::on_the_stack()), ("faer", Solver::<SIZE>::by_faer())] {
            let rhs = matrix * solution;
            let (mut a, mut b) = (matrix, rhs);
            let solved = solver.solve(&mut a, &mut b);
            // The residual of each row, relative to the sum of its terms.
            let residual = contact_geom::numbers::max_abs_or_nan((0..SIZE).map(|i| {
                let terms: f64 = (0..SIZE).map(|j| (matrix[(i, j)] * b[j]).abs()).sum();
                let sum: f64 = (0..SIZE).map(|j| matrix[(i, j)] * b[j]).sum();
                if sum == rhs[i] { 0.0 } else { (sum - rhs[i]).abs() / (terms + rhs[i].abs()) }
            }));
            let ended = match (&solved, name) {
                (Err(_), _) => "refused",
                (Ok(()), _) if residual <= 1e-10 => "solved",
                (Ok(()), _) => "wrong",
            };
            // Refusing a regular matrix is as wrong as accepting a singular one.
            let regular = matches!(name, "dense" | "rows graded to 1e-279" | "all of 1e300" | "all of 1e-300");
            let singular = matches!(
                name,
                "zero" | "one NaN" | "one NaN in the last place" | "one infinity" | "one infinity below"
            );
            wrong += u32::from(ended == "wrong" || (regular && ended == "refused") || (singular && ended != "refused"));
            if ended == "solved" {
                worst = max_or_nan(worst, residual);
            }
            rows.push(row("matrix", by, name, ended, residual));
        }
    }
    report.at_most(
        "matrices that are singular or not finite and solved, or regular and refused",
        f64::from(wrong),
        0.0,
    )?;
    report.at_most("residuals of the solved systems, over the size of their terms", worst, 1e-13)
}

/// The time of a step whose stage iteration does not contract, relative to one whose iteration contracts.
fn price(report: &mut Report) -> Result<(), Failure> {
    let smooth = Smooth { spring: 0.25, coupling: 1.0, quartic: 1.0, ..Smooth::default() };
    let coupled = Formula::<2> { smooth, rate: Rate::Constant(-0.05), ..Formula::FREE };
    let plain = VelocityPoint::new([1.0], [0.5], 0.2);
    let pair = VelocityPoint::new([1.0, -0.4], [0.5, 0.3], 0.2);
    let mut curves = Vec::new();
    for (i, stages) in [4, 8, 16].into_iter().enumerate() {
        let integrator = AnyIntegrator::Gauss { stages };
        let per_step = |time: &dyn Fn(f64) -> [f64; 2]| {
            let steps = [0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8];
            steps.map(|h| (h, time(h)))
        };
        let pendulum = per_step(&|h| of_step(Formula::<1>::pendulum(-0.1), plain, integrator, h));
        let acting = Formula { action: 0.1, ..Formula::<1>::pendulum(-0.1) };
        let general = per_step(&|h| of_step(acting, plain, integrator, h));
        let coupled = per_step(&|h| of_step(coupled, pair, integrator, h));
        for (j, (name, times)) in
            [("pendulum", pendulum), ("pendulum not affine in z", general), ("pair", coupled)].into_iter().enumerate()
        {
            let contracting = times[..4].iter().map(|(_, [taken, _])| *taken).fold(0.0, max_or_nan);
            // Zero if there is no such step.
            let dearest = |which: usize| times.iter().map(|(_, of)| of[which]).fold(0.0, max_or_nan);
            for (which, of) in ["successful step", "failed step"].into_iter().enumerate() {
                report.at_most_timed(
                    &format!("{integrator}, {name}: slowest {of} over the slowest contracting step"),
                    dearest(which) / contracting,
                    MAX_TIME_RATIO,
                )?;
            }
            curves.push(Curve::new(
                &format!("{integrator}, {name}").replace('_', " "),
                Line::Coloured(3 * i + j),
                times.map(|(h, [taken, given_up])| (h, max_or_nan(taken, given_up))),
            ));
        }
    }
    let svg = draw(&Panel::new(
        ("step", Axis::Logarithmic(-2, 2, 1)),
        ("seconds per step", Axis::Logarithmic(-8, -1, 1)),
        (1.0, 1.0),
        curves,
    ));
    report.timed_figure(&svg)
}

/// The time of a step in a run that advances as far as it can, and the time of a step that fails; zero where there is
/// none.
fn of_step<const N: usize>(system: Formula<N>, start: VelocityPoint<N>, integrator: AnyIntegrator, h: f64) -> [f64; 2] {
    let problem = Problem { system, t0: 0.0, start, span: h };
    let Ok(motion) = problem.motion() else { return [f64::NAN; 2] };
    let Ok(plan) = motion.by(integrator).steps(Steps::Count(1)).plan(problem.end()) else {
        return [f64::NAN; 2];
    };
    let mut least = [f64::INFINITY; 2];
    for _ in 0..3 {
        let Ok(mut stepper) = plan.stepper() else { return [f64::NAN; 2] };
        let clock = Instant::now();
        let (mut tried, mut given_up, mut until) = (0, 0.0, 0.0);
        while given_up == 0.0 && tried < 200 && until < 0.05 {
            let taken = stepper.advance(5);
            let now = clock.elapsed().as_secs_f64();
            match taken {
                Ok(()) => (tried, until) = (tried + 5, now),
                // The time includes up to four successful steps before the one that fails.
                Err(_) => given_up = now - until,
            }
        }
        let per_step = if tried == 0 { 0.0 } else { until / f64::from(tried) };
        least = [least[0].min(per_step), least[1].min(given_up)];
    }
    least
}
