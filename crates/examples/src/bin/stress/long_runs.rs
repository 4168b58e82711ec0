//! Very long runs: 1e9 steps compared with closed forms, and decay through subnormal numbers to zero.

use crate::formula::{Force, Formula};
use crate::motion::{FAMILIES, Problem, distance};
use crate::parallel::parallel;
use crate::statistics::quantile;
use contact_examples::Report;
use contact_examples::systems::HarmonicOscillator;
use contact_examples::{Axis, Curve, Failure, Line, Panel, draw, number};
use contact_geom::{
    ChartVector, PhasePoint, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::{AnyIntegrator, SplittingScheme, Steps};
use std::time::Instant;

/// The time step of the long runs: a power of two, so that times are exact.
const H: f64 = 0.125;

/// The drag of the damped oscillator, and the frequency of the drive: powers of two, so that phases are exact.
const WEAK_DRAG: f64 = -1.0 / (1u64 << 26) as f64;
const DRIVE: f64 = 0.5;

/// The drag of the driven oscillator.
const GAMMA: f64 = -1.0 / 64.0;

/// A long run with a known solution.
struct Long {
    name: &'static str,
    system: Formula<1>,
    integrator: AnyIntegrator,
    /// The steps of a full run.
    steps: usize,
    truth: fn(f64) -> PhasePoint<1>,
    /// The number of steps whose rounding errors are still present, for a number of steps taken; the bound on the error
    /// grows as its square root.
    remembered: fn(f64) -> f64,
    /// The frequency of the drive, whose phase is rounded together with the time.
    frequency: f64,
}

/// The weakly damped oscillator from `(1, 0)`. The angle `sqrt(1 - g^2/4) t` is the difference of t and a small angle,
/// each of which is exact.
fn damped(t: f64) -> PhasePoint<1> {
    let half = 0.5 * WEAK_DRAG;
    let slow = 0.5 * half * half * t;
    let (sin, cos) = t.sin_cos();
    let (small_sin, small_cos) = slow.sin_cos();
    let (sin, cos) = (sin * small_cos - cos * small_sin, cos * small_cos + sin * small_sin);
    let size = (half * t).exp();
    PhasePoint::new([size * (cos - half * sin)], [-size * sin], 0.0)
}

/// The driven oscillator `q'' = -q + g q' + cos(w t)` after its initial state has decayed.
fn driven(t: f64) -> PhasePoint<1> {
    let (a, b) = (1.0 - DRIVE * DRIVE, -GAMMA * DRIVE);
    let size = a * a + b * b;
    let (sin, cos) = (DRIVE * t).sin_cos();
    PhasePoint::new([(a * cos + b * sin) / size], [DRIVE * (b * cos - a * sin) / size], 0.0)
}

fn long_runs() -> [Long; 3] {
    let forced = Formula { force: Force::Swinging { size: 1.0, frequency: DRIVE }, ..Formula::oscillator(GAMMA) };
    // Rounding errors older than 1/|gamma| have decayed.
    let memory: fn(f64) -> f64 = |_| 1.0 / (GAMMA.abs() * H);
    [
        Long {
            name: "damped",
            system: Formula::oscillator(WEAK_DRAG),
            integrator: AnyIntegrator::Gauss { stages: 8 },
            steps: 1_000_000_000,
            truth: damped,
            remembered: |steps| steps,
            frequency: 0.0,
        },
        Long {
            name: "driven",
            system: forced,
            integrator: AnyIntegrator::Gauss { stages: 8 },
            steps: 100_000_000,
            truth: driven,
            remembered: memory,
            frequency: DRIVE,
        },
        Long {
            name: "driven",
            system: forced,
            integrator: AnyIntegrator::Splitting(SplittingScheme::KAHAN_LI_8),
            steps: 1_000_000_000,
            truth: driven,
            remembered: memory,
            frequency: DRIVE,
        },
    ]
}

/// The number of rounding errors of a step that may add up: those of some stages, and of the sums that end a step.
const ROUNDINGS: f64 = 16.0;

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let (all, quick) = (long_runs(), report.quick);
    let clock = Instant::now();
    // The errors after numbers of steps that double, recorded along the run.
    let found = parallel(&report.bar, all.len(), |i| -> Result<Vec<(f64, f64, f64)>, Failure> {
        let Long { system, integrator, steps, truth, remembered, frequency, .. } = &all[i];
        let steps = if quick { steps / 2000 } else { *steps };
        let problem = Problem { system: *system, t0: 0.0, start: start_of(*truth), span: H };
        let motion = problem.motion()?;
        let plan = motion.by(*integrator).steps(Steps::Count(1)).plan(problem.end())?;
        let mut stepper = plan.stepper()?;
        let (mut taken, mut seen) = (0, Vec::new());
        let mut next = 1 << 10;
        while taken < steps {
            next = next.min(steps);
            let ended = stepper.advance(next - taken).is_err();
            taken = next;
            next *= 2;
            let t = taken as f64 * H;
            let true_one = truth(t);
            let error = if ended { f64::NAN } else { distance(&stepper.state().fixed(), &true_one, 0.0) };
            let walk = remembered(taken as f64).min(taken as f64).sqrt();
            seen.push((taken as f64, error, f64::EPSILON * (ROUNDINGS * walk + frequency * t)));
        }
        Ok(seen)
    });
    report.say(&format!("  time of the long runs: {:.1} s\n", clock.elapsed().as_secs_f64()))?;
    let (mut rows, mut curves) = (Vec::new(), Vec::new());
    for (i, (long, seen)) in all.iter().zip(found).enumerate() {
        let (seen, name) = (seen?, format!("{} by {}", long.name, long.integrator));
        for (steps, error, bound) in &seen {
            rows.push([name.clone(), steps.to_string(), number(*error), number(*bound)].into());
        }
        let worst = max_abs_or_nan(seen.iter().map(|(_, error, bound)| error / bound));
        let last = seen.last().copied().unwrap_or((f64::NAN, f64::NAN, f64::NAN));
        let what =
            format!("{name}: error over its bound, worst along {:.0e} steps ({:.1e} at the end)", last.0, last.1);
        report.at_most(&what, worst, 1.0)?;
        let points: Vec<(f64, f64)> = seen.iter().map(|s| (s.0, s.1)).collect();
        curves.push(Curve::new(&name.replace('_', " "), Line::Coloured(i), points));
        curves.push(Curve::unnamed(Line::Grey(i), seen.iter().map(|s| (s.0, s.2))));
    }
    decays(report, &mut rows)?;
    report.markdown(
        &["run", "steps", "relative error", "bound"],
        rows.chunk_by(|a, b| a[0] == b[0]).filter_map(|run| run.last().cloned()).map(brief),
    );
    report.table("", &["run", "steps", "relative_error", "bound"], rows)?;
    report.figure(&draw(&Panel::new(
        ("steps", Axis::Logarithmic(3, 9, 1)),
        ("relative error, with its bound in grey", Axis::Logarithmic(-16, -9, 1)),
        (0.03, 0.98),
        curves,
    )))
}

/// A row of the table with fewer digits.
fn brief(row: Vec<String>) -> Vec<String> {
    row.iter().map(|text| text.parse::<f64>().map_or(text.clone(), |x| format!("{x:.1e}"))).collect()
}

fn start_of(truth: fn(f64) -> PhasePoint<1>) -> VelocityPoint<1> {
    let PhasePoint { q, p, .. } = truth(0.0);
    VelocityPoint { q, v: p, z: 0.0 }
}

/// Each family on an oscillator that decays to zero: the error while the state is a normal number, zero at the end, and
/// no slower steps.
fn decays(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    // The amplitude decays as e^(-t/2): at t = 2000 it is below the smallest double.
    let (gamma, h, half) = (-1.0, H, 8000);
    let (mut left, mut broken, mut slower) = (0.0, 0, Vec::new());
    for integrator in FAMILIES {
        let problem = Problem {
            system: Formula::oscillator(gamma),
            t0: 0.0,
            start: VelocityPoint::new([1.0], [0.0], 0.0),
            span: h,
        };
        let motion = problem.motion()?;
        let plan = motion.by(integrator).steps(Steps::Count(1)).plan(problem.end())?;
        let mut stepper = plan.stepper()?;
        let (mut times, mut fails) = (Vec::new(), false);
        for part in 0..16 {
            let clock = Instant::now();
            fails |= stepper.advance(half / 8).is_err();
            times.push(clock.elapsed().as_secs_f64());
            if part == 1 && integrator.order() >= 16 {
                let exact = HarmonicOscillator { gamma }.solution(250.0, &problem.start);
                let error = distance(&stepper.state().fixed(), &PhasePoint { q: exact.q, p: exact.v, z: exact.z }, 0.0);
                // A random walk of relative rounding errors, and the rounding of the phase of the closed form.
                let bound = ROUNDINGS * f64::EPSILON * (2000.0f64.sqrt() + 250.0);
                let name = format!("decayed to {:.0e} by {integrator}", exact.q.amax());
                report.at_most(&format!("{name}: relative error of the state"), error, bound)?;
                rows.push([name, "2000".into(), number(error), number(bound)].into());
            }
        }
        let end: PhasePoint<1> = stepper.state().fixed();
        broken += u32::from(fails || !ChartVector::from(end).is_finite());
        left = max_or_nan(left, max_abs_or_nan([end.q[0], end.p[0], end.z]));
        slower.push(quantile(&times[11..], 0.5) / quantile(&times[..8], 0.5));
    }
    report.at_most("families that fail or give a NaN on the way to zero", f64::from(broken), 0.0)?;
    report.at_most("size of the state after a decay by e^-1000", left, 1e-300)?;
    report.at_most_timed(
        "time of a step at zero over that of an earlier step, in the slowest family",
        max_abs_or_nan(slower),
        5.0,
    )
}
