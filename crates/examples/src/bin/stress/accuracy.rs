//! Whether a requested accuracy is kept, and how long it takes, for random systems, spans, initial values and
//! tolerances.

use crate::formula::{Feature, Force, Formula, Rate, Smooth};
use crate::motion::{Problem, RunEnd, Verdict, caught, distance, dop853, end_of_outcome};
use crate::parallel::parallel;
use crate::random::Random;
use crate::statistics::quantile;
use contact_examples::Report;
use contact_examples::{Axis, Curve, Failure, Line, Panel, draw, number};
use contact_geom::{PhasePoint, VelocityPoint, numbers::max_or_nan};
use discrete_herglotz::{AnyIntegrator, InputError, SplittingScheme, Steps, rules::Method};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::time::Instant;

/// The configurations that a careful user would try.
const CONFIGURATIONS: [AnyIntegrator; 8] = [
    AnyIntegrator::Gauss { stages: 4 },
    AnyIntegrator::Gauss { stages: 6 },
    AnyIntegrator::Gauss { stages: 8 },
    AnyIntegrator::Gauss { stages: 12 },
    AnyIntegrator::Gauss { stages: 16 },
    AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6),
    AnyIntegrator::Splitting(SplittingScheme::KAHAN_LI_8),
    AnyIntegrator::Splitting(SplittingScheme::SOFRONIOU_SPALETTA_10),
];

/// The integrators that a third of the problems request by name, each with the tightest tolerance requested of it.
const NAMED: [(AnyIntegrator, f64); 8] = [
    (AnyIntegrator::Discrete(Method::Midpoint), 1e-5),
    (AnyIntegrator::Splitting(SplittingScheme::STRANG), 1e-6),
    (AnyIntegrator::Splitting(SplittingScheme::MCLACHLAN_4), 1e-8),
    (AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6), 1e-10),
    (AnyIntegrator::Splitting(SplittingScheme::KAHAN_LI_8), 1e-12),
    (AnyIntegrator::Gauss { stages: 2 }, 1e-8),
    (AnyIntegrator::Gauss { stages: 6 }, 1e-12),
    (AnyIntegrator::Gauss { stages: 16 }, 1e-12),
];

/// The largest number of steps that is tried for a configuration.
const MAX_STEPS: f64 = 1e5;

/// The bound on the time of a plan, in seconds: a longer plan would be taken for a hang.
const MAX_PLAN_SECONDS: f64 = 10.0;

/// A random problem with one degree of freedom.
fn one(random: &mut Random) -> Problem<1> {
    let double_well = random.happens(0.15);
    let spring = if double_well { -random.between(0.3, 1.0) } else { random.spread(0.1, 10.0) };
    let smooth = Smooth {
        linear: if random.happens(0.3) { random.between(-0.5, 0.5) } else { 0.0 },
        spring,
        quartic: if double_well || random.happens(0.3) { random.between(0.2, 2.0) } else { 0.0 },
        swing: if random.happens(0.4) { random.between(0.2, 2.0) } else { 0.0 },
        coupling: 0.0,
    };
    let gamma = if random.happens(0.2) { 0.0 } else { -random.spread(1e-4, 1.0) };
    // Some drives have whole numbers of periods in each step, if the number of steps is a power of two.
    let whole = random.happens(0.2);
    let frequency = if whole { TAU * f64::from(1 << random.below(4)) } else { random.between(0.2, 3.0) };
    let rate = if random.happens(0.15) { Rate::Swinging { size: gamma, frequency } } else { Rate::Constant(gamma) };
    let force =
        if random.happens(0.25) { Force::Swinging { size: random.between(0.1, 2.0), frequency } } else { Force::None };
    let action = if random.happens(0.15) { random.between(0.01, 0.2) } else { 0.0 };
    let size = if random.happens(0.1) { random.spread(1e-100, 1.0) } else { 1.0 };
    let mut within = |width: f64| size * random.between(-width, width);
    let (q, v, z) = (within(1.5), within(1.5), within(1.0));
    let at_rest = random.happens(0.05);
    let start = VelocityPoint::new([q], [if at_rest { 0.0 } else { v }], z * size);
    let t0 = if random.happens(0.1) { random.between(-1e3, 1e3) } else { 0.0 };
    let system = Formula { smooth, rate, force, action, ..Formula::FREE };
    // Long spans only for motions whose phase error remains small.
    let long = random.happens(0.1) && smooth.quartic == 0.0 && smooth.swing == 0.0 && gamma > -0.01;
    let span = if long { random.spread(1e2, 1e5) } else { random.spread(1.0, 100.0) };
    Problem { system, t0, start, span: if whole { span.log2().round().exp2() } else { span } }
}

/// A random problem with two degrees of freedom: an orbit, or a coupled pair.
fn two(random: &mut Random) -> Problem<2> {
    let gamma = if random.happens(0.3) { 0.0 } else { -random.spread(1e-5, 0.01) };
    let span = random.spread(1.0, 100.0);
    if random.happens(0.4) {
        let e = random.between(0.0, 0.6);
        let start = VelocityPoint::new([1.0 - e, 0.0], [0.0, ((1.0 + e) / (1.0 - e)).sqrt()], 0.0);
        let system = Formula { feature: Feature::Centre { mu: 1.0 }, rate: Rate::Constant(gamma), ..Formula::FREE };
        return Problem { system, t0: 0.0, start, span };
    }
    let smooth = Smooth {
        spring: random.spread(0.2, 5.0),
        coupling: random.between(0.0, 0.5),
        quartic: if random.happens(0.4) { random.between(0.0, 1.0) } else { 0.0 },
        swing: if random.happens(0.4) { random.between(0.2, 2.0) } else { 0.0 },
        ..Smooth::default()
    };
    let mut number = || random.between(-1.0, 1.0);
    let start = VelocityPoint::new([number(), number()], [number(), number()], number());
    let system = Formula { smooth, rate: Rate::Constant(10.0 * gamma), ..Formula::FREE };
    Problem { system, t0: 0.0, start, span }
}

/// The result for one problem.
struct Found {
    dimension: usize,
    named: Option<AnyIntegrator>,
    tolerance: f64,
    verdict: Verdict,
    error: f64,
    steps: usize,
    /// Whether the error is above the tolerance and dop853 disagrees with the exact flow too, by more than half of that
    /// error.
    doubt: bool,
    /// For a refused problem: whether a configuration of the library solves it.
    solvable: bool,
    /// Seconds of the plan, of the run, and of the run of the fastest configuration.
    plan: f64,
    run: f64,
    best: Option<f64>,
}

/// The shortest time of a few calls, and the result of the last.
fn fastest<T>(call: impl Fn() -> T) -> (f64, T) {
    let timed = || {
        let clock = Instant::now();
        let result = call();
        (clock.elapsed().as_secs_f64(), result)
    };
    let (mut least, mut result) = timed();
    let mut total = least;
    for _ in 0..4 {
        if total > 0.02 {
            break;
        }
        let (seconds, again) = timed();
        (least, result) = (least.min(seconds), again);
        total += seconds;
    }
    (least, result)
}

/// The shortest time of the configurations that keep the tolerance, each with the smallest number of steps that keeps
/// it; with `first`, the time of the first such configuration.
fn by_hand<const N: usize>(problem: &Problem<N>, truth: &PhasePoint<N>, tolerance: f64, first: bool) -> Option<f64> {
    let mut best: Option<f64> = None;
    for integrator in CONFIGURATIONS.into_iter().filter(|i| i.check(&problem.system).is_ok()) {
        let keeps = |count: f64| problem.by(integrator, count as usize).error(truth, 0.0) <= tolerance;
        let mut count = (problem.span / 4.0).ceil().max(1.0);
        while count < MAX_STEPS && !keeps(count) {
            count = (count * 1.25).ceil();
        }
        if count >= MAX_STEPS {
            continue;
        }
        let run = || -> Result<f64, InputError> {
            let motion = problem.motion()?;
            let plan = motion.by(integrator).steps(Steps::Count(count as usize)).plan(problem.end())?;
            Ok(fastest(|| plan.run()).0)
        };
        if let Ok(seconds) = run() {
            best = Some(best.map_or(seconds, |b| b.min(seconds)));
        }
        if first {
            break;
        }
    }
    best
}

/// Solves a problem to a tolerance; `None` where the reference solution is not accurate enough.
fn solve<const N: usize, const D: usize>(
    problem: &Problem<N>,
    tolerance: f64,
    named: Option<AnyIntegrator>,
    compared: bool,
) -> Option<Found> {
    let named = named.filter(|integrator| integrator.check(&problem.system).is_ok());
    let truth = problem.exact_in(3).ok()?;
    if distance(&problem.exact_in(7).ok()?, &truth, 0.0) > 0.05 * tolerance {
        return None;
    }
    let clock = Instant::now();
    let motion = caught(|| problem.motion());
    let plan = motion.as_ref().and_then(|motion| match motion {
        Ok(motion) => caught(|| {
            let run = motion.accuracy(tolerance);
            let run = if let Some(integrator) = named { run.by(integrator) } else { run };
            run.plan(problem.end())
        }),
        Err(refused) => Some(Err(*refused)),
    });
    let plan_time = clock.elapsed().as_secs_f64();
    let (run, end, steps) = match &plan {
        None => (f64::NAN, RunEnd::Panicked, 0),
        Some(Err(refused)) => (f64::NAN, RunEnd::Refused(*refused), 0),
        Some(Ok(plan)) => {
            let (seconds, outcome) = fastest(|| caught(|| plan.run()));
            let end = match outcome {
                None => RunEnd::Panicked,
                Some(Err(refused)) => RunEnd::Refused(refused),
                Some(Ok(outcome)) => end_of_outcome(&outcome),
            };
            (seconds, end, plan.count())
        }
    };
    let (verdict, error) = (end.verdict(&truth, 0.0, 10.0 * tolerance), end.error(&truth, 0.0));
    let doubt = error > tolerance && {
        let size = distance(&PhasePoint { q: truth.q * 0.0, p: truth.p * 0.0, z: 0.0 }, &truth, 0.0);
        let other = dop853::<N, D>(problem, 1e-13, 1e-13 * crate::motion::norm(&[size, 1e-300]));
        other.is_some_and(|other| distance(&other, &truth, 0.0) > 0.5 * error)
    };
    let refused = matches!(verdict, Verdict::Refused | Verdict::Failed | Verdict::Unresolved);
    let solvable = refused && by_hand(problem, &truth, tolerance, true).is_some();
    let best = if compared && named.is_none() && verdict == Verdict::Right {
        by_hand(problem, &truth, tolerance, false)
    } else {
        None
    };
    Some(Found { dimension: N, named, tolerance, verdict, error, steps, doubt, solvable, plan: plan_time, run, best })
}

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let (count, compared) = if report.quick { (200, 5) } else { (10_000, 10) };
    let found = parallel(&report.bar, count, |i| {
        let mut random = Random::new(10, i);
        let tolerance = random.spread(1e-12, 1e-3);
        let compare = i % compared == 0;
        let named = NAMED[random.below(NAMED.len())];
        let named = (random.happens(0.33) && tolerance >= named.1).then_some(named.0);
        if random.happens(0.65) {
            solve::<1, 3>(&one(&mut random), tolerance, named, compare)
        } else {
            solve::<2, 5>(&two(&mut random), tolerance, named, compare)
        }
    });
    let known: Vec<(usize, &Found)> = found.iter().enumerate().filter_map(|(i, f)| Some((i, f.as_ref()?))).collect();
    let all = known.len() as f64;
    let that = |what: &dyn Fn(&Found) -> bool| known.iter().filter(|(_, f)| what(f)).count() as f64;
    let above = that(&|f| f.error > f.tolerance);
    let bad = that(&|f| f.verdict.is_failure());
    let refused = that(&|f| matches!(f.verdict, Verdict::Refused | Verdict::Failed | Verdict::Unresolved));
    let solvable = that(&|f| f.solvable);
    report.say(&format!(
        "  {all} of {count} random problems have a reference that is known to a twentieth of the tolerance\n"
    ))?;
    report.at_most("problems without an accurate reference, share of all", 1.0 - all / count as f64, 0.2)?;
    report.at_most("true error above the tolerance, share of all", above / all, 0.01)?;
    report.at_most("error above ten times the tolerance, NaN or a panic: count", bad, 0.0)?;
    report.at_most("refused although the library solves it, share of all", solvable / all, 0.02)?;
    report.at_most("dop853 agrees with the run and not with the exact flow: count", that(&|f| f.doubt), 0.0)?;
    let of = |value: &dyn Fn(&Found) -> Option<f64>| known.iter().filter_map(|(_, f)| value(f)).collect::<Vec<f64>>();
    let planned = of(&|f| (f.named.is_none() && f.run.is_finite()).then_some(f.plan / f.run));
    report.at_most_timed("time of plan and trial runs over that of the run, median", quantile(&planned, 0.5), 4.0)?;
    let ratios = of(&|f| Some(f.run / f.best?));
    report.at_most_timed("time of the run over that of the best configuration, median", quantile(&ratios, 0.5), 1.5)?;
    report.say(&format!(
        "        time of the plan over that of the run: 10% {:.1}, 90% {:.1}; time of the run over the best: 10% \
         {:.2}, 90% {:.2}, for {} runs\n",
        quantile(&planned, 0.1),
        quantile(&planned, 0.9),
        quantile(&ratios, 0.1),
        quantile(&ratios, 0.9),
        ratios.len()
    ))?;
    let longest = known.iter().fold(0.0, |most, (_, f)| max_or_nan(most, f.plan));
    report.at_most_timed("longest plan, in seconds", longest, MAX_PLAN_SECONDS)?;

    let mut decades: BTreeMap<i32, [f64; 5]> = BTreeMap::new();
    for (_, f) in &known {
        let row = decades.entry(f.tolerance.log10().floor() as i32).or_default();
        row[0] += 1.0;
        row[1] += f64::from(u8::from(f.error > f.tolerance));
        row[2] += f64::from(u8::from(f.verdict.is_failure()));
        row[3] += f64::from(u8::from(matches!(f.verdict, Verdict::Refused | Verdict::Failed | Verdict::Unresolved)));
        row[4] += f64::from(u8::from(f.solvable));
    }
    report.markdown(
        &[
            "tolerance",
            "problems",
            "above the tolerance",
            "above ten times the tolerance",
            "refused",
            "refused but solvable",
        ],
        decades.iter().rev().map(|(decade, row)| {
            let name = format!("1e{} .. 1e{decade}", decade + 1);
            [name].into_iter().chain(row.iter().map(|x| x.to_string())).collect()
        }),
    );
    report.say(&format!("        {refused} refused in total\n"))?;
    report.table(
        "",
        &["problem", "dimension", "integrator", "tolerance", "worth", "error", "steps"],
        known.iter().map(|(i, f)| {
            let numbers = [number(f.tolerance), f.verdict.name().into(), number(f.error), f.steps.to_string()];
            let named = f.named.map_or("chosen".into(), |integrator| integrator.to_string());
            [i.to_string(), f.dimension.to_string(), named].into_iter().chain(numbers).collect()
        }),
    )?;
    let points = |dimension: usize| {
        let of = known.iter().filter(move |(_, f)| f.dimension == dimension && f.error > 0.0);
        of.map(|(_, f)| (f.tolerance, f.error)).collect::<Vec<_>>()
    };
    report.figure(&draw(&Panel::new(
        ("requested relative error", Axis::Logarithmic(-12, -3, 1)),
        ("true relative error at the end", Axis::Logarithmic(-17, 1, 2)),
        (0.03, 0.98),
        vec![
            Curve::new("the requested error", Line::Dashed, [(1e-12, 1e-12), (1e-3, 1e-3)]),
            Curve::new("ten times the requested error", Line::Dotted, [(1e-12, 1e-11), (1e-3, 1e-2)]),
            Curve::new("one degree of freedom", Line::Discs, points(1)),
            Curve::new("two degrees of freedom", Line::Crosses, points(2)),
        ],
    )))
}
