//! Motions near singularities: an ill-conditioned W, Kepler's centre, the poles of a chart, the speed of light, t = 0,
//! sigma_d = 0, and conjugate points.

use crate::damping::{Tally, bad};
use crate::formula::{Feature, Formula, Kinetic, Rate, Smooth};
use crate::motion::{FAMILIES, ORDER_ONE, Problem, RunEnd, Verdict, distance};
use contact_examples::Report;
use contact_examples::systems::{HarmonicOscillator, LaneEmden};
use contact_examples::{Axis, Curve, Failure, Line, Panel, draw, number};
use contact_geom::nalgebra::SMatrix;
use contact_geom::{DiscretePoint, PhasePoint, VelocityPoint, numbers::max_or_nan};
use discrete_herglotz::{AnyIntegrator, Stepper, gauss::TransformedStepper, rules::Method};
use exact_lagrangian::ContactExponential;
use std::f64::consts::{PI, TAU};

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let mut table = Table { rows: Vec::new(), tally: Tally::new() };
    let conditions = mass_condition(report, &mut table)?;
    let orbits = eccentric(report, &mut table)?;
    fall(report, &mut table)?;
    poles(report, &mut table)?;
    light(report, &mut table)?;
    time_zero(report, &mut table)?;
    vanishing_sigma(report, &mut table)?;
    conjugate_points(report, &mut table)?;
    report.at_most("all fixed steps near singularities: runs silently wrong", bad([&table.tally]), 0.0)?;
    report.table("", &["what", "integrator", "parameter", "worth", "error"], table.rows)?;
    let grey = [1e2, 1e16].map(|c: f64| (c, c * f64::EPSILON));
    report.figure(&draw(&Panel::new(
        ("condition of W, or 1 / (1 - e)", Axis::Logarithmic(0, 16, 2)),
        ("relative error", Axis::Logarithmic(-18, 0, 2)),
        (0.03, 0.98),
        vec![
            Curve::new("eps times the condition", Line::Dotted, grey),
            Curve::new("gauss 16, condition of W", Line::Solid, conditions),
            Curve::new("gauss 8 with a time transformation, e of an orbit", Line::Dashed, orbits),
        ],
    )))
}

struct Table {
    rows: Vec<Vec<String>>,
    tally: Tally,
}

impl Table {
    fn add(&mut self, what: &str, by: impl ToString, parameter: f64, verdict: Verdict, error: f64) {
        *self.tally.entry(verdict).or_default() += 1;
        self.rows.push(vec![what.into(), by.to_string(), number(parameter), verdict.name().into(), number(error)]);
    }
}

type Points = Vec<(f64, f64)>;

/// Two masses with a common frequency and a mass matrix of any condition: each coordinate is an oscillator of its own.
fn mass_condition(report: &mut Report, table: &mut Table) -> Result<Points, Failure> {
    let gamma = -0.1;
    let (mut points, mut refused, mut worst) = (Vec::new(), 0, 0.0);
    for power in (2..=16).step_by(2) {
        let condition = 10f64.powi(power);
        let (sin, cos) = 0.6f64.sin_cos();
        let (one, other) = (1.0, 1.0 / condition);
        let mixed = (one - other) * sin * cos;
        let mass =
            SMatrix::from([[one * cos * cos + other * sin * sin, mixed], [mixed, one * sin * sin + other * cos * cos]]);
        let system = Formula::<2> {
            kinetic: Kinetic::Mass(mass),
            feature: Feature::Metric { square: 1.0 },
            rate: Rate::Constant(gamma),
            ..Formula::FREE
        };
        let start = VelocityPoint::new([1.0, -0.4], [0.3, 0.8], 0.0);
        let problem = Problem { system, t0: 0.0, start, span: 4.0 };
        let each = |i: usize| {
            let x = VelocityPoint::new([start.q[i]], [start.v[i]], 0.0);
            HarmonicOscillator { gamma }.solution(problem.span, &x).q[0]
        };
        let exact = PhasePoint::new([each(0), each(1)], [0.0, 0.0], 0.0);
        let only_q = |x: &PhasePoint<2>| PhasePoint { p: x.p * 0.0, ..*x };
        for integrator in FAMILIES {
            let end = match problem.by(integrator, 64) {
                RunEnd::Completed(x) => RunEnd::Completed(only_q(&x)),
                RunEnd::Unresolved(x) => RunEnd::Unresolved(only_q(&x)),
                other => other,
            };
            let (verdict, error) = (end.verdict(&exact, 0.0, ORDER_ONE), end.error(&exact, 0.0));
            table.add("mass_condition", integrator, condition, verdict, error);
            if condition <= 1e10 {
                refused += u32::from(matches!(verdict, Verdict::Refused | Verdict::Failed | Verdict::Unresolved));
                if integrator.order() >= 16 {
                    worst = max_or_nan(worst, error / condition);
                }
            }
            if integrator == (AnyIntegrator::Gauss { stages: 16 }) && matches!(verdict, Verdict::Right | Verdict::Wrong)
            {
                points.push((condition, error));
            }
        }
    }
    report.at_most("W of condition 1e2 .. 1e10: runs that are refused, halted or flagged", f64::from(refused), 0.0)?;
    // One rounding error of the momentum in each of 64 steps, amplified by the inverse of W.
    report.at_most("W of condition 1e2 .. 1e10: error of Gauss over the condition", worst, 64.0 * f64::EPSILON)?;
    Ok(points)
}

/// One revolution from the apocentre, with increasing eccentricity.
fn eccentric(report: &mut Report, table: &mut Table) -> Result<Points, Failure> {
    let system = Formula::<2>::kepler(0.0);
    let (mut points, mut kept, mut worst) = (Vec::new(), 0, 0.0);
    for e in [0.0, 0.5, 0.9, 0.99, 0.999, 0.9999_f64] {
        let start = VelocityPoint::new([1.0 + e, 0.0], [0.0, ((1.0 - e) / (1.0 + e)).sqrt()], 0.0);
        let problem = Problem { system, t0: 0.0, start, span: TAU };
        let exact = problem.state();
        for (integrator, count) in FAMILIES.into_iter().flat_map(|i| [32, 1024].map(|n| (i, n))) {
            let (verdict, error) = problem.verdict(integrator, count, &exact, 0.0);
            table.add("orbit", integrator, e, verdict, error);
        }
        let end = problem.to(1e-6);
        let verdict = end.verdict(&exact, 0.0, 1e-5);
        kept += u32::from(verdict.is_failure());
        table.rows.push(vec![
            "orbit".into(),
            "accuracy".into(),
            number(e),
            verdict.name().into(),
            number(end.error(&exact, 0.0)),
        ]);

        let motion = discrete_herglotz::Problem::new(&system, 0.0, start)?;
        let mut stepper = TransformedStepper::new(&motion, 8, 0.1)?;
        let end =
            if stepper.advance_to(TAU).is_ok() { RunEnd::Completed(stepper.state().fixed()) } else { RunEnd::Panicked };
        let error = end.error(&exact, 0.0);
        table.add("orbit", "transformed_gauss_8", e, end.verdict(&exact, 0.0, ORDER_ONE), error);
        points.push((1.0 / (1.0 - e), error));
        worst = max_or_nan(worst, error * (1.0 - e));
    }
    report.at_most("a revolution with e = 0 .. 0.9999, to 1e-6: above 1e-5", f64::from(kept), 0.0)?;
    // A rounding error of the velocity at the centre is 1/sqrt(1 - e) times that on the orbit, and the passage
    // amplifies it by the same factor.
    report.at_most(
        "gauss_8 with a time transformation, e = 0 .. 0.9999: error times 1 - e",
        worst,
        64.0 * f64::EPSILON,
    )?;
    Ok(points)
}

/// From rest into the centre, where the motion ends: every completed run is wrong.
fn fall(report: &mut Report, table: &mut Table) -> Result<(), Failure> {
    let start = VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0);
    let problem = Problem { system: Formula::<2>::kepler(-0.01), t0: 0.0, start, span: 3.0 };
    // No result is close to this state.
    let exact = PhasePoint::new([1e9, 1e9], [1e9, 1e9], 0.0);
    for (integrator, count) in FAMILIES.into_iter().flat_map(|i| [3, 16, 100, 1000].map(|n| (i, n))) {
        let end = problem.by(integrator, count);
        table.add("fall", integrator, count as f64, end.verdict(&exact, 0.0, ORDER_ONE), f64::NAN);
    }
    let through = u32::from(problem.exact().is_ok()) + u32::from(matches!(problem.to(1e-6), RunEnd::Completed(_)));
    report.at_most(
        "a fall into the centre by the exact flow and to an accuracy: runs that continue",
        f64::from(through),
        0.0,
    )
}

/// Past a pole of the chart of the sphere: a great circle, on which the longitude changes abruptly.
fn poles(report: &mut Report, table: &mut Table) -> Result<(), Failure> {
    let system = Formula::<2> { kinetic: Kinetic::Sphere, ..Formula::FREE };
    let mut kept = 0;
    for sideways in [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 0.0] {
        let start = VelocityPoint::new([1.0, 0.0], [-1.0, sideways], 0.0);
        let problem = Problem { system, t0: 0.0, start, span: 2.0 };
        // Unit vectors along the radius and the velocity.
        let (sin, cos) = 1f64.sin_cos();
        let (radius, velocity) = ([sin, 0.0, cos], [-cos, sin * sideways, sin]);
        let speed = (1.0 + (sin * sideways).powi(2)).sqrt();
        let (turned, along) = ((speed * problem.span).cos(), (speed * problem.span).sin() / speed);
        let place: [f64; 3] = std::array::from_fn(|i| radius[i] * turned + velocity[i] * along);
        let misses = |x: &PhasePoint<2>| {
            let (sin, cos) = x.q[0].sin_cos();
            let found = [sin * x.q[1].cos(), sin * x.q[1].sin(), cos];
            (0..3).map(|i| (found[i] - place[i]).powi(2)).sum::<f64>().sqrt()
        };
        let verdict = |end: &RunEnd<2>, bound: f64| match end {
            RunEnd::Completed(x) if misses(x) <= bound => (Verdict::Right, misses(x)),
            RunEnd::Completed(x) if misses(x).is_nan() => (Verdict::NonFinite, f64::NAN),
            RunEnd::Completed(x) => (Verdict::Wrong, misses(x)),
            other => (other.verdict(&problem.state(), 0.0, bound), f64::NAN),
        };
        let applies = |i: &AnyIntegrator| i.check(&system).is_ok();
        for (integrator, count) in FAMILIES.into_iter().filter(applies).flat_map(|i| [20, 400].map(|n| (i, n))) {
            let (verdict, error) = verdict(&problem.by(integrator, count), ORDER_ONE);
            table.add("pole", integrator, sideways, verdict, error);
        }
        let (verdict, error) = verdict(&problem.to(1e-6), 1e-5);
        kept += u32::from(verdict.is_failure());
        table.rows.push(vec!["pole".into(), "accuracy".into(), number(sideways), verdict.name().into(), number(error)]);
    }
    report.at_most("past a pole, to 1e-6: above 1e-5", f64::from(kept), 0.0)
}

/// Relativistic oscillators of increasing speed: the speed is close to 1 except near the turning points.
fn light(report: &mut Report, table: &mut Table) -> Result<(), Failure> {
    let smooth = Smooth { spring: 1.0, ..Smooth::default() };
    let system = Formula::<1> { kinetic: Kinetic::Relativistic, smooth, rate: Rate::Constant(-0.01), ..Formula::FREE };
    let mut worst = 0.0;
    for size in [1.0, 3.0, 10.0, 20.0] {
        let start = VelocityPoint::new([size], [0.0], 0.0);
        let problem = Problem { system, t0: 0.0, start, span: 2.0 * size };
        let exact = problem.exact_in(64)?;
        let applies = |i: &AnyIntegrator| i.check(&system).is_ok();
        for (integrator, count) in FAMILIES.into_iter().filter(applies).flat_map(|i| [8, 64, 512].map(|n| (i, n))) {
            let (verdict, error) = problem.verdict(integrator, count, &exact, 0.0);
            table.add("light", integrator, size, verdict, error);
        }
        // The exact flow in one call.
        worst = max_or_nan(worst, problem.exact().map_or(f64::NAN, |x| distance(&x, &exact, 0.0)));
    }
    // Each of 64 parts starts from a rounded velocity, which W = (1 - v^2)^(-3/2), up to 8000, turns into an error of
    // 400 eps relative to a momentum of 20.
    report.at_most(
        "a relativistic oscillator up to 1 - v = 1e-5: the exact flow against itself in parts",
        worst,
        64.0 * 400.0 * f64::EPSILON,
    )
}

/// The Lane-Emden equation with drag 2/t from t = 0, where the drag is not defined, and from later times.
fn time_zero(report: &mut Report, table: &mut Table) -> Result<(), Failure> {
    let system = Formula::<1> { feature: Feature::Power { n: 1 }, rate: Rate::OverTime(-2.0), ..Formula::FREE };
    let mut begun = 0;
    for integrator in FAMILIES {
        let start = VelocityPoint::new([1.0], [0.0], 0.0);
        // A run that starts at t = 0 must agree with the closed form; otherwise it must be refused.
        let problem = Problem { system, t0: 0.0, start, span: 3.0 };
        let exact = LaneEmden { n: 1 }.solution(3.0).map(|x| PhasePoint { q: x.q, p: x.v, z: x.z });
        let exact = exact.unwrap_or(problem.state());
        let (verdict, error) = problem.verdict(integrator, 30, &exact, 0.0);
        table.add("time_zero", integrator, 0.0, verdict, error);
        begun += u32::from(verdict.is_failure());
        for t0 in [1e-6, 1e-3, 0.01, 0.1] {
            let Some((from, to)) = LaneEmden { n: 1 }.solution(t0).zip(LaneEmden { n: 1 }.solution(t0 + 3.0)) else {
                continue;
            };
            let problem = Problem { system, t0, start: from, span: 3.0 };
            let exact = PhasePoint { q: to.q, p: to.v, z: to.z };
            for count in [10, 300] {
                let (verdict, error) = problem.verdict(integrator, count, &exact, 0.0);
                table.add("time_zero", integrator, t0, verdict, error);
            }
        }
    }
    report.at_most("a drag 2/t from t = 0: families that start and are wrong", f64::from(begun), 0.0)
}

/// Quadrature rules with `1 + h gamma`, which is sigma_d for rules explicit in z, close to zero and negative.
fn vanishing_sigma(report: &mut Report, table: &mut Table) -> Result<(), Failure> {
    let mut beyond = 0;
    for method in Method::RULES {
        let integrator = AnyIntegrator::Discrete(*method);
        for left in [0.5, 1e-1, 1e-2, 1e-4, 1e-8, 1e-15, 0.0, -1e-15, -0.1, -1.0] {
            let gamma = left - 1.0;
            let start = VelocityPoint::new([1.0], [0.5], 0.0);
            let problem = Problem { system: Formula::oscillator(gamma), t0: 0.0, start, span: 4.0 };
            let exact = HarmonicOscillator { gamma }.solution(4.0, &start);
            let exact = PhasePoint { q: exact.q, p: exact.v, z: exact.z };
            let (verdict, error) = problem.verdict(integrator, 4, &exact, 1.0);
            let explicit = !method.implicit_in_z();
            beyond += u32::from(
                explicit && left <= 0.0 && matches!(verdict, Verdict::Right | Verdict::Coarse | Verdict::Wrong),
            );
            table.add("sigma", integrator, left, verdict, error);
        }
    }
    report.at_most("rules explicit in z with sigma_d <= 0: runs that continue", f64::from(beyond), 0.0)
}

/// The initial velocity of the motion through two points that are almost conjugate.
fn conjugate_points(report: &mut Report, table: &mut Table) -> Result<(), Failure> {
    let system = Formula::<1>::oscillator(0.0);
    let (mut worst, mut silent) = (0.0, 0);
    for (turns, power) in [1.0, 2.0, 5.0].into_iter().flat_map(|k| (1..=16).map(move |p| (k, p))) {
        let off = 10f64.powi(-power);
        let h = turns * PI * (1.0 + off);
        let exponential = ContactExponential::new(&system, h)?;
        let x = VelocityPoint::new([0.3], [1.7], 0.0);
        let end = HarmonicOscillator { gamma: 0.0 }.solution(h, &x);
        let found = exponential.retract_near(0.0, &DiscretePoint { q0: x.q, q1: end.q, z0: 0.0 }, &x.v);
        // Rounding errors of two positions and of the angle, amplified by 1/sin h.
        let condition = (2.0 + 2.0 * h) / (h.sin().abs());
        let (verdict, error) = match found {
            Ok(found) => {
                let error = (found.start.v[0] - 1.7).abs();
                let right = error <= 8.0 * f64::EPSILON * condition;
                (if right { Verdict::Right } else { Verdict::Wrong }, error)
            }
            Err(_) => (Verdict::Refused, f64::NAN),
        };
        silent += u32::from(verdict == Verdict::Wrong);
        if verdict == Verdict::Right {
            worst = max_or_nan(worst, error / condition / f64::EPSILON);
        }
        table.rows.push(vec![
            "conjugate".into(),
            "exact".into(),
            number(turns * off),
            verdict.name().into(),
            number(error),
        ]);
    }
    report.at_most("velocities through almost conjugate points: silently wrong", f64::from(silent), 0.0)?;
    report.at_most("velocities through almost conjugate points: roundings of the positions in the error", worst, 8.0)
}
