//! Conformality over many steps: the product of the `sigma_d`, the momentum of a symmetry, and the contact form.

use crate::formula::Formula;
use crate::motion::{FAMILIES, Problem};
use crate::parallel::parallel;
use contact_examples::Report;
use contact_examples::{Axis, Curve, Failure, Line, Panel, draw, number};
use contact_geom::{
    ChartVector, PhasePoint, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::{AnyIntegrator, InputError, Steps};

/// The coefficient of the drag, and the step, a power of two.
const GAMMA: f64 = -1e-6;
const H: f64 = 1.0 / 32.0;

/// The errors after a number of steps.
struct Row {
    steps: f64,
    /// Relative error of the angular momentum against the product of the conformal factors by the formula of the
    /// method.
    momentum: f64,
    /// Relative error of the product of the `sigma_d` that the steps report.
    product: f64,
    /// The defect of the pullback of `eta` by one step, relative to its size.
    contact: f64,
}

/// The logarithm of a step's conformal factor by the formula of the method.
fn factor(integrator: AnyIntegrator) -> f64 {
    let half = 0.5 * GAMMA * H;
    let rational = |g: f64| (g * half).ln_1p() - (-g * half).ln_1p();
    match integrator {
        // (1 + gamma h/2) / (1 - gamma h/2).
        AnyIntegrator::Discrete(_) => rational(1.0),
        AnyIntegrator::Composition(_, scheme) => {
            scheme.substeps().map_or(f64::NAN, |g| g.iter().map(|g| rational(*g)).sum())
        }
        // The factor of a Gauss method is a Pade approximation of e^x, which at this x equals e^x from two stages on.
        // In transformed time the steps differ.
        AnyIntegrator::Gauss { .. }
        | AnyIntegrator::TransformedGauss { .. }
        | AnyIntegrator::Divided(_)
        | AnyIntegrator::Splitting(_) => 2.0 * half,
        _ => f64::NAN,
    }
}

fn angular(x: &PhasePoint<2>) -> f64 {
    x.q[0] * x.p[1] - x.q[1] * x.p[0]
}

/// One step from a state.
fn step(integrator: AnyIntegrator, from: &ChartVector<2>) -> Result<(PhasePoint<2>, f64), InputError> {
    let start = VelocityPoint { q: from.x, v: from.y, z: from.z };
    let problem = Problem { system: Formula::<2>::kepler(GAMMA), t0: 0.0, start, span: H };
    let motion = problem.motion()?;
    let plan = motion.by(integrator).steps(Steps::Count(1)).plan(problem.end())?;
    let mut stepper = plan.stepper()?;
    let ended = stepper.advance(1).is_err();
    Ok((stepper.state().fixed(), if ended { f64::NAN } else { stepper.sigma() }))
}

/// The defect between a step's pullback of `dz - p dq` and `sigma_d` times the form, by differences of fourth order.
fn contact_defect(integrator: AnyIntegrator, at: &PhasePoint<2>) -> Result<f64, InputError> {
    const DISTANCE: f64 = 1e-3;
    let from = ChartVector::from(*at);
    let (end, sigma) = step(integrator, &from)?;
    let mut worst = 0.0;
    for k in 0..5 {
        let moved = |by: f64| -> Result<ChartVector<2>, InputError> {
            let there = ChartVector::from_fn(|i| from.component(i) + if i == k { by * DISTANCE } else { 0.0 });
            Ok(step(integrator, &there)?.0.into())
        };
        let (near, far) = (moved(1.0)?.minus(moved(-1.0)?), moved(2.0)?.minus(moved(-2.0)?));
        let derivative = near.scale(8.0).minus(far).scale(1.0 / (12.0 * DISTANCE));
        let pulled_back = derivative.z - end.p.dot(&derivative.x);
        let eta = match k {
            0 | 1 => -at.p[k],
            4 => 1.0,
            _ => 0.0,
        };
        worst = max_or_nan(worst, (pulled_back - sigma * eta).abs() / (1.0 + at.p.norm()));
    }
    Ok(worst)
}

fn along(integrator: AnyIntegrator, power: u32) -> Result<Vec<Row>, InputError> {
    let start = VelocityPoint::new([0.7, 0.0], [0.0, (1.3f64 / 0.7).sqrt()], 0.0);
    let problem = Problem { system: Formula::<2>::kepler(GAMMA), t0: 0.0, start, span: H };
    let motion = problem.motion()?;
    let plan = motion.by(integrator).steps(Steps::Count(1)).plan(problem.end())?;
    let mut stepper = plan.stepper()?;
    let (mut rows, mut taken, first) = (Vec::new(), 0, angular(&stepper.state().fixed()));
    // The compensated sum of the logarithms.
    let (mut sum, mut lost) = (0.0, 0.0);
    for k in 4..=power {
        let mut ended = false;
        while taken < 1u64 << k && !ended {
            ended = stepper.advance(1).is_err();
            taken += 1;
            let term = (stepper.sigma() - 1.0).ln_1p() - lost;
            let next = sum + term;
            lost = (next - sum) - term;
            sum = next;
        }
        let predicted = factor(integrator) * taken as f64;
        let momentum = (angular(&stepper.state().fixed()) / first / predicted.exp() - 1.0).abs();
        rows.push(Row {
            steps: taken as f64,
            momentum: if ended { f64::NAN } else { momentum },
            product: (sum - predicted).abs(),
            contact: contact_defect(integrator, &stepper.state().fixed())?,
        });
    }
    Ok(rows)
}

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let power = if report.quick { 12 } else { 20 };
    let found = parallel(&report.bar, FAMILIES.len(), |i| along(FAMILIES[i], power));
    let (mut rows, mut curves, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    for (i, (integrator, found)) in FAMILIES.iter().zip(found).enumerate() {
        let found = found?;
        for Row { steps, momentum, product, contact } in &found {
            let numbers = [number(*steps), number(*momentum), number(*product), number(*contact)];
            rows.push([integrator.to_string()].into_iter().chain(numbers).collect());
        }
        // One rounding error of the momentum per substep, as a random walk; a composition has 17 substeps.
        let stages = if matches!(integrator, AnyIntegrator::Composition(..)) { 17.0 } else { 5.0 };
        let walk = |steps: f64| 8.0 * f64::EPSILON * (stages * steps).sqrt();
        let momentum = max_abs_or_nan(found.iter().map(|r| r.momentum / walk(r.steps)));
        // Each sigma_d is a number close to one, rounded to half of eps.
        let product = max_abs_or_nan(found.iter().map(|r| r.product / (stages * f64::EPSILON * r.steps)));
        let contact = max_abs_or_nan(found.iter().map(|r| r.contact));
        report.at_most(
            &format!("{integrator}: angular momentum against its factor, over a random walk"),
            momentum,
            1.0,
        )?;
        report.at_most(&format!("{integrator}: product of the sigma_d, in roundings of each"), product, 1.0)?;
        // The error of the difference formula: the fourth power of 1e-3 times a fifth derivative, and eps / 1e-3.
        report.at_most(&format!("{integrator}: defect of the contact form in a step, anywhere"), contact, 1e-8)?;
        let last = found.last().map_or(f64::NAN, |r| r.momentum);
        lines.push(vec![
            integrator.to_string(),
            format!("{last:.1e}"),
            format!("{momentum:.2}"),
            format!("{product:.2}"),
            format!("{contact:.0e}"),
        ]);
        let points = found.iter().map(|r| (r.steps, r.momentum));
        curves.push(Curve::new(&integrator.to_string().replace('_', " "), Line::Coloured(i), points));
    }
    let walk = [1e1, 1e6].map(|n: f64| (n, 1e-16 * n.sqrt()));
    curves.push(Curve::new("square root of the steps", Line::Grey(0), walk));
    let columns =
        ["integrator", "momentum at the end", "over a random walk", "sigma_d in roundings", "contact form, one step"];
    report.markdown(&columns, lines);
    report.table("", &["integrator", "steps", "momentum_error", "log_product_error", "contact_defect"], rows)?;
    report.figure(&draw(&Panel::new(
        ("steps", Axis::Logarithmic(1, 6, 1)),
        ("relative error of the angular momentum", Axis::Logarithmic(-17, -9, 1)),
        (1.0, 1.0),
        curves,
    )))
}
