//! Two figures beyond the paper's: how the conformal factor and a momentum decay, and how the theorems predict it.

use contact_examples::systems::{Kepler, Pendulum, System};
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw_row, number};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{
    Darboux, DiscretePoint, OneParameterGroup, Symmetry, legendre, support::conformality_with_jacobian,
};
use discrete_herglotz::{
    DiscreteLagrangian, MomentumRow,
    rules::{Flow, Rule},
    theory::hamiltonian_flow_jacobian,
};

const TIME: &str = "time t (dimensionless)";

/// The two rules in the legends: the paper's, and the same made symmetric in z.
const LEFT: &str = "left midpoint (z at the left end)";
const MIDDLE: &str = "midpoint (z in the middle)";

/// The conformal factor of the map after k steps.
struct Factor {
    t: f64,
    /// Measured: the pullback of the contact form along the whole map.
    measured: f64,
    /// Predicted by the theorem: the product of the `sigma_d`.
    product: f64,
    /// That of the true flow.
    exact: f64,
}

/// The pendulum of the conformal factor's figure, its step and its number of steps: long steps, so that the order of a rule
/// shows.
const PENDULUM: Pendulum = Pendulum { gamma: -0.1 };
const PENDULUM_RUN: (f64, usize) = (0.25, 200);

/// Follows the Jacobian of the map after k steps, and the conformal factor that it has.
fn factors(ld: &impl DiscreteLagrangian<1>) -> Result<Vec<Factor>, Failure> {
    let start = legendre(&PENDULUM, 0.0, &PENDULUM.initial());
    let mut flow = Flow::new(ld, 0.0, start)?;
    let mut jacobian = DMatrix::identity(3, 3);
    let mut rows = vec![Factor { t: 0.0, measured: 1.0, product: 1.0, exact: 1.0 }];
    let mut product = 1.0;
    for _ in 0..PENDULUM_RUN.1 {
        let step = flow.step()?;
        let x = DiscretePoint { q0: step.from.q, q1: step.to.q, z0: step.from.z };
        jacobian = hamiltonian_flow_jacobian(ld, step.t - ld.step_size(), &x)? * jacobian;
        product *= step.sigma;
        let pullback = conformality_with_jacobian(&Darboux, &Darboux, &start.into(), &step.to.into(), &jacobian)?;
        rows.push(Factor { t: step.t, measured: pullback.sigma, product, exact: (PENDULUM.gamma * step.t).exp() });
    }
    Ok(rows)
}

/// The conformal factor along a run of the pendulum, measured on the whole map, against the product of the `sigma_d` and
/// against the true `e^(gamma t)`. For the rule with z at the left end, measured and product agree in every bit.
pub fn conformal_factor(out: &Directory) -> Result<(), Failure> {
    let h = PENDULUM_RUN.0;
    let left = factors(&Rule::LEFT_MIDPOINT.of::<1, _>(PENDULUM, h)?)?;
    let middle = factors(&Rule::MIDPOINT.of::<1, _>(PENDULUM, h)?)?;
    let points = |rows: &[Factor], entry: fn(&Factor) -> f64| -> Vec<(f64, f64)> {
        rows.iter().map(|r| (r.t, entry(r))).collect()
    };
    let deviation = |r: &Factor| (r.measured / r.exact - 1.0).abs();
    let defect = |r: &Factor| (r.measured / r.product - 1.0).abs();
    let decay = Panel::new(
        (TIME, Axis::Linear(0.0, 50.0, 10.0)),
        ("conformal factor σ", Axis::Logarithmic(-3, 0, 1)),
        (0.04, 0.32),
        vec![
            Curve::new(LEFT, Line::Solid, points(&left, |r| r.measured)),
            Curve::new(MIDDLE, Line::DashDot, points(&middle, |r| r.measured)),
            Curve::new("exact flow, exp(γt)", Line::Dashed, points(&left, |r| r.exact)),
        ],
    );
    let error = Panel::new(
        (TIME, Axis::Linear(0.0, 50.0, 10.0)),
        ("relative deviation of σ", Axis::Logarithmic(-18, 2, 4)),
        (0.1, 0.62),
        vec![
            Curve::new("left midpoint, from exp(γt)", Line::Solid, points(&left[1..], deviation)),
            Curve::new("midpoint, from exp(γt)", Line::DashDot, points(&middle[1..], deviation)),
            Curve::new("midpoint, from the product of the σ", Line::Dotted, points(&middle[1..], defect)),
        ],
    );
    out.text("conformal_factor.svg", &draw_row(&[decay, error]))?;
    let columns =
        ["t", "sigma_left_midpoint", "product_left_midpoint", "sigma_midpoint", "product_midpoint", "sigma_exact"];
    let rows = left.iter().zip(&middle);
    let entries = rows.map(|(l, m)| [l.t, l.measured, l.product, m.measured, m.product, l.exact].map(number));
    out.table("conformal_factor.csv", &columns, entries)
}

/// Kepler's problem with drag, its step and its number of steps.
const KEPLER: Kepler<2> = Kepler { mu: 1.0, gamma: -0.02 };
const KEPLER_RUN: (f64, usize) = (0.025, 1200);

/// The angular momentum of a run, with its prediction by the product of the `sigma_d`.
fn momenta(ld: &impl DiscreteLagrangian<2>) -> Result<Vec<MomentumRow>, Failure> {
    let start = legendre(&KEPLER, 0.0, &KEPLER.initial());
    let group = Symmetry::rotation(0, 1)?;
    let mut flow = Flow::new(ld, 0.0, start)?;
    let mut predicted = group.momentum(&start.q, &start.p);
    let mut rows = vec![MomentumRow { t: 0.0, momentum: predicted, predicted }];
    for _ in 0..KEPLER_RUN.1 {
        let step = flow.step()?;
        predicted *= step.sigma;
        rows.push(MomentumRow { t: step.t, momentum: group.momentum(&step.to.q, &step.to.p), predicted });
    }
    Ok(rows)
}

/// The angular momentum along a Kepler orbit with drag, against its predicted decay by the product of the `sigma_d` and
/// against the true `e^(gamma t)`.
pub fn angular_momentum(out: &Directory) -> Result<(), Failure> {
    let h = KEPLER_RUN.0;
    let left = momenta(&Rule::LEFT_MIDPOINT.of::<2, _>(KEPLER, h)?)?;
    let middle = momenta(&Rule::MIDPOINT.of::<2, _>(KEPLER, h)?)?;
    let initial = left.first().map_or(f64::NAN, |r| r.momentum);
    let exact = |t: f64| initial * (KEPLER.gamma * t).exp();
    let deviation = |r: &MomentumRow| (r.t, (r.momentum / exact(r.t) - 1.0).abs());
    let defect = |r: &MomentumRow| (r.t, r.defect());
    let decay = Panel::new(
        (TIME, Axis::Linear(0.0, 30.0, 5.0)),
        ("momentum J (dimensionless)", Axis::Linear(0.4, 0.9, 0.1)),
        (0.24, 0.95),
        vec![
            Curve::new(LEFT, Line::Solid, left.iter().map(|r| (r.t, r.momentum))),
            Curve::new("predicted, product of the σ", Line::Dashed, left.iter().map(|r| (r.t, r.predicted))),
        ],
    );
    let error = Panel::new(
        (TIME, Axis::Linear(0.0, 30.0, 5.0)),
        ("relative deviation of J", Axis::Logarithmic(-18, 2, 4)),
        (0.1, 0.98),
        vec![
            Curve::new("left midpoint, from J(0) exp(γt)", Line::Solid, left[1..].iter().map(deviation)),
            Curve::new("midpoint, from J(0) exp(γt)", Line::DashDot, middle[1..].iter().map(deviation)),
            Curve::new("both rules, from the product of the σ", Line::Dotted, left[1..].iter().map(defect)),
            Curve::unnamed(Line::Dotted, middle[1..].iter().map(defect)),
        ],
    );
    out.text("angular_momentum.svg", &draw_row(&[decay, error]))?;
    let columns = ["t", "j_left_midpoint", "predicted_left_midpoint", "j_midpoint", "predicted_midpoint", "j_exact"];
    let rows = left.iter().zip(&middle);
    let entries = rows.map(|(l, m)| [l.t, l.momentum, l.predicted, m.momentum, m.predicted, exact(l.t)].map(number));
    out.table("angular_momentum.csv", &columns, entries)
}
