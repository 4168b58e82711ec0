//! Chaos and time reversal: runs forward and backward, and bitwise equal results whatever else a run computes.

use crate::formula::{Force, Formula, Rate, Smooth};
use crate::motion::{FAMILIES, Problem, distance};
use crate::parallel::parallel;
use crate::random::Random;
use contact_examples::Report;
use contact_examples::{Axis, Curve, Failure, Line, Panel, draw, number};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, PhasePoint, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::gauss::{Gauss, GaussStepper};
use discrete_herglotz::{AnyIntegrator, InputError, Rows, Run, State, Stepper, StepperOptions, Steps, rules::Flow};

/// A particle in a square well with rounded corners, chaotic at this energy.
fn chaotic(gamma: f64) -> Formula<2> {
    let smooth = Smooth { spring: 0.25, coupling: 8.0, ..Smooth::default() };
    Formula { smooth, rate: Rate::Constant(gamma), ..Formula::FREE }
}

/// The step of the chaotic motion.
const H: f64 = 1.0 / 32.0;

/// The initial distance of neighbours by which the growth is measured, and the time after which it is restored: over
/// the whole span the distance would become the width of the well, whatever the growth.
const INITIAL_DISTANCE: f64 = 1e-9;
const PIECE_TIME: i32 = 4;

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let mut rows = Vec::new();
    reversal(report, &mut rows)?;
    same_bits(report, &mut rows)?;
    lanes(report, &mut rows)?;
    report.table("", &["what", "integrator", "parameter", "figure"], rows)
}

/// Runs forward, then backward by the reversed motion: the map `(q, p, z)` to `(q, -p, -z)` reverses time, and with it
/// the sign of the drag.
///
/// The defect is compared with the growth of a small difference on the way back: a symmetric method retraces its steps
/// up to round-off.
fn reversal(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let spans = if report.quick { vec![4, 16] } else { vec![4, 8, 16, 32, 64] };
    let symmetric: Vec<AnyIntegrator> = FAMILIES.into_iter().collect();
    let cases: Vec<(f64, AnyIntegrator, i32)> = [0.0, -0.01]
        .into_iter()
        .flat_map(|g| symmetric.iter().flat_map(|i| spans.iter().map(|s| (g, *i, *s))).collect::<Vec<_>>())
        .collect();
    let starts = if report.quick { 4 } else { 32 };
    let found = parallel(&report.bar, cases.len(), |case| -> Result<(f64, f64), InputError> {
        let (gamma, integrator, span) = cases[case];
        let run = |gamma: f64, span: i32, start: &PhasePoint<2>| -> Result<PhasePoint<2>, InputError> {
            let count = steps_of(span);
            let start = VelocityPoint { q: start.q, v: start.p, z: start.z };
            let problem = Problem { system: chaotic(gamma), t0: 0.0, start, span: f64::from(span) };
            let motion = problem.motion()?;
            let plan = motion.by(integrator).steps(Steps::Count(count)).plan(problem.end())?;
            let mut stepper = plan.stepper()?;
            let ended = stepper.advance(count).is_err();
            let state: PhasePoint<2> = stepper.state().fixed();
            Ok(if ended { PhasePoint { z: f64::NAN, q: state.q * f64::NAN, ..state } } else { state })
        };
        let turned = |x: &PhasePoint<2>| PhasePoint { q: x.q, p: -x.p, z: -x.z };
        let (mut worst, mut largest_growth) = (0.0, 0.0);
        for i in 0..starts {
            let mut random = Random::new(7, i);
            let mut number = || random.between(-0.5, 0.5);
            let start = PhasePoint::new([number(), number()], [number() + 1.0, number() + 1.0], 0.1);
            let end = turned(&run(gamma, span, &start)?);
            let back = turned(&run(-gamma, span, &end)?);
            let growth = growth(&end, span / PIECE_TIME, |x| run(-gamma, PIECE_TIME, x))?;
            let defect = distance(&back, &start, 1.0);
            worst = max_or_nan(worst, defect / (growth * f64::EPSILON * (steps_of(span) as f64).sqrt()));
            largest_growth = max_or_nan(largest_growth, growth);
        }
        Ok((worst, largest_growth))
    });
    let mut of_family: Vec<(String, f64)> = Vec::new();
    let mut points = Vec::new();
    for ((gamma, integrator, span), found) in cases.iter().zip(found) {
        let (worst, growth) = found?;
        let name = integrator.to_string();
        rows.push(vec![format!("reversal, gamma {gamma}"), name.clone(), span.to_string(), number(worst)]);
        rows.push(vec![format!("growth, gamma {gamma}"), name.clone(), span.to_string(), number(growth)]);
        if *gamma == 0.0 && *integrator == (AnyIntegrator::Gauss { stages: 8 }) {
            points.push((f64::from(*span), worst * growth * f64::EPSILON * (steps_of(*span) as f64).sqrt(), growth));
        }
        match of_family.iter_mut().find(|(n, _)| *n == name) {
            Some((_, w)) => *w = max_or_nan(*w, worst),
            None => of_family.push((name, worst)),
        }
    }
    for (name, worst) in &of_family {
        // About ten rounding errors per step, each of which may point in any of the growing directions.
        report.at_most(&format!("{name}: defect after forward and back, over growth and roundings"), *worst, 64.0)?;
    }
    report.markdown(
        &["integrator", "defect after forward and back over (growth x eps x sqrt steps), worst"],
        of_family.iter().map(|(name, worst)| vec![name.clone(), format!("{worst:.1}")]),
    );
    report.figure(&draw(&Panel::new(
        ("time forward and backward", Axis::Logarithmic(0, 2, 1)),
        ("distance from the start", Axis::Logarithmic(-16, 2, 2)),
        (0.03, 0.98),
        vec![
            Curve::new("gauss 8, forward and backward", Line::Solid, points.iter().map(|p| (p.0, p.1))),
            Curve::new("growth of a rounding error", Line::Dotted, points.iter().map(|p| (p.0, p.2 * f64::EPSILON))),
        ],
    )))
}

fn steps_of(span: i32) -> usize {
    (f64::from(span) / H) as usize
}

/// The growth of a small difference of states over some pieces; the largest over four initial directions.
fn growth(
    start: &PhasePoint<2>,
    pieces: i32,
    run: impl Fn(&PhasePoint<2>) -> Result<PhasePoint<2>, InputError>,
) -> Result<f64, InputError> {
    let mut states = vec![*start];
    for k in 0..pieces as usize {
        states.push(run(&states[k])?);
    }
    let entries = |x: &PhasePoint<2>| SVector::<f64, 4>::new(x.q[0], x.q[1], x.p[0], x.p[1]);
    let mut largest = 1.0;
    for k in 0..4 {
        let (mut growth, mut direction) = (1.0, SVector::<f64, 4>::ith(k, 1.0));
        for ends in states.windows(2) {
            let x = entries(&ends[0]) + direction * INITIAL_DISTANCE;
            let beside = run(&PhasePoint::new([x[0], x[1]], [x[2], x[3]], ends[0].z))?;
            let apart = entries(&beside) - entries(&ends[1]);
            growth *= apart.norm() / INITIAL_DISTANCE;
            direction = apart.normalize();
        }
        largest = max_or_nan(largest, growth);
    }
    Ok(largest)
}

fn bits(x: &State) -> Vec<u64> {
    x.q.iter().chain(&x.p).chain([&x.z]).map(|x| x.to_bits()).collect()
}

/// Repeated runs, runs in pieces, with rows and with the conformal factor must have the same bits.
fn same_bits(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let driven = Formula::<2> { force: Force::Swinging { size: 0.3, frequency: 0.7 }, ..chaotic(-0.1) };
    let mut swinging = chaotic(0.0);
    swinging.rate = Rate::Swinging { size: -0.1, frequency: 0.9 };
    let acting = Formula::<2> { action: 0.1, ..chaotic(-0.05) };
    let systems =
        [("drag", chaotic(-0.1)), ("drive", driven), ("oscillating drag", swinging), ("not affine in z", acting)];
    let start = VelocityPoint::new([0.3, -0.2], [0.9, 1.1], 0.1);
    let steps = 1001;
    let (mut again, mut pieces, mut recorded) = (0, 0, 0);
    for (name, system) in systems {
        let applies = |i: &AnyIntegrator| i.check(&system).is_ok();
        for integrator in FAMILIES.into_iter().filter(applies) {
            let problem = Problem { system, t0: 0.0, start, span: H * f64::from(steps) };
            let motion = problem.motion()?;
            let count = Steps::Count(steps as usize);
            let whole =
                |run: Run<'_, '_, discrete_herglotz::Problem<'_, Formula<2>, 2>>| -> Result<Vec<u64>, InputError> {
                    Ok(bits(&run.run(problem.end())?.state()))
                };
            let one = whole(motion.by(integrator).steps(count))?;
            again += u32::from(whole(motion.by(integrator).steps(count))? != one);
            let plan = motion.by(integrator).steps(count).plan(problem.end())?;
            for piece in [1, 7, 300] {
                let mut stepper = plan.stepper()?;
                let mut left = steps as usize;
                while left > 0 && stepper.advance(piece.min(left)).is_ok() {
                    left -= piece.min(left);
                }
                pieces += u32::from(bits(&stepper.state()) != one);
            }
            for stride in [1, 10, 333] {
                let mut states = Rows::every(stride)?;
                let run = motion.by(integrator).steps(count).observe(&mut states);
                recorded += u32::from(whole(run)? != one);
                let mut states = Rows::every(stride)?;
                let run = motion.by(integrator).steps(count).with_conformal_factor().observe(&mut states);
                recorded += u32::from(whole(run)? != one);
            }
            let words = one.iter().map(|b| format!("{b:016x}")).collect::<Vec<_>>().join(" ");
            rows.push(vec![format!("bits, {name}"), integrator.to_string(), steps.to_string(), words]);
        }
    }
    report.at_most("runs whose bits differ from those of the same run", f64::from(again), 0.0)?;
    report.at_most("runs whose bits differ when they are advanced in parts", f64::from(pieces), 0.0)?;
    report.at_most("runs whose bits differ when rows or factors are recorded", f64::from(recorded), 0.0)
}

/// Stages in SIMD lanes compared with the same method in scalar arithmetic, by Newton's method.
fn lanes(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let mut worst = 0.0;
    for stages in [1, 2, 3, 4, 5, 7, 8, 9, 12, 16] {
        let system = Formula::<2> { action: 0.1, ..chaotic(-0.05) };
        let start = VelocityPoint::new([0.3, -0.2], [0.9, 1.1], 0.1);
        let problem = Problem { system, t0: 0.0, start, span: 1.0 };
        let gauss = Gauss::new(&system, stages, H)?;
        let motion = problem.motion()?;
        let options = StepperOptions { action: true, ..StepperOptions::default() };
        let mut fast = GaussStepper::new(&motion, stages, H, options)?;
        let mut plain = Flow::with_guess(&gauss, 0.0, problem.state(), start.v)?;
        let ended = fast.advance(8).is_err() || Stepper::advance(&mut plain, 8).is_err();
        let (a, b) = (ChartVector::from(Stepper::state(&fast).fixed()), ChartVector::from(*plain.state()));
        let ulps = max_abs_or_nan(a.minus(b).to_vector().iter().copied()) / f64::EPSILON;
        let ulps = if ended { f64::NAN } else { ulps };
        rows.push(vec!["lanes against single numbers".into(), stages.to_string(), "8".into(), number(ulps)]);
        worst = max_or_nan(worst, ulps);
    }
    // Eight steps, each with the rounding of its sums and of the last Newton iterate.
    report.at_most("gauss_1 .. 16 in lanes against single numbers, 8 steps: ulps of one", worst, 32.0)
}
