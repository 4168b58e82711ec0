//! Two figures beyond the paper's: how the conformal factor and a momentum decay, and how the theorems predict it.

use contact_examples::{Axis, Curve, Directory, Failure, Legend, Line, Panel, draw_stack, number};
use contact_geom::nalgebra::DMatrix;
use contact_geom::systems::{Kepler, Pendulum, System};
use contact_geom::{Darboux, DiscretePoint, Symmetry, conformality_with_jacobian, legendre};
use discrete_herglotz::{
    DiscreteLagrangian, Flow, LeftMidpoint, Midpoint, MomentumDecay, Status, hamiltonian_flow_jacobian,
};

const TIME: &str = "time t (dimensionless)";

/// What cannot be seen on a logarithmic axis: a deviation of zero is drawn at this value.
const FLOOR: f64 = 1e-17;

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
/// against the true `e^(gamma t)`.
pub fn conformal_factor(out: &Directory) -> Result<(), Failure> {
    let h = PENDULUM_RUN.0;
    let left = factors(&LeftMidpoint::new::<1>(PENDULUM, h)?)?;
    let middle = factors(&Midpoint::new::<1>(PENDULUM, h)?)?;
    let curve = |name: &str, line, rows: &[Factor], entry: fn(&Factor) -> f64| {
        Curve::new(name, line, rows.iter().map(|r| (r.t, entry(r))).collect())
    };
    let deviation = |r: &Factor| (r.measured / r.exact - 1.0).abs().max(FLOOR);
    let defect = |r: &Factor| (r.measured / r.product - 1.0).abs().max(FLOOR);
    let time = Axis::Linear(0.0, 50.0, 10.0);
    let decay = Panel {
        x_label: TIME.into(),
        y_label: "conformal factor σ".into(),
        x: time,
        y: Axis::Logarithmic(-3, 0),
        legend: Legend::BottomLeft,
        curves: vec![
            curve("midpoint, z at the left end", Line::Solid, &left, |r| r.measured),
            curve("symmetric midpoint", Line::DashDot, &middle, |r| r.measured),
            curve("exact flow, exp(γt)", Line::Dashed, &left, |r| r.exact),
        ],
        marks: Vec::new(),
    };
    let error = Panel {
        x_label: TIME.into(),
        y_label: "relative deviation of σ".into(),
        x: time,
        y: Axis::Logarithmic(-17, 4),
        legend: Legend::TopRight,
        curves: vec![
            curve("z at the left end, from exp(γt)", Line::Solid, &left[1..], deviation),
            curve("symmetric, from exp(γt)", Line::DashDot, &middle[1..], deviation),
            curve("both, from the product of σ_d", Line::Dotted, &left[1..], defect),
            Curve { name: None, ..curve("", Line::Dotted, &middle[1..], defect) },
        ],
        marks: Vec::new(),
    };
    out.text("conformal_factor.svg", &draw_stack(&[decay, error], 2))?;
    let columns =
        ["t", "sigma_left_midpoint", "product_left_midpoint", "sigma_midpoint", "product_midpoint", "sigma_exact"];
    let rows = left.iter().zip(&middle);
    let entries = rows.map(|(l, m)| [l.t, l.measured, l.product, m.measured, m.product, l.exact].map(number));
    out.table("conformal_factor.csv", &columns, entries)
}

/// Kepler's problem with drag, its step and its number of steps.
const KEPLER: Kepler<2> = Kepler { mu: 1.0, gamma: -0.02 };
const KEPLER_RUN: (f64, usize) = (0.025, 1200);

/// The angular momentum of a run.
fn momenta(ld: &impl DiscreteLagrangian<2>) -> Result<MomentumDecay<Symmetry<2>>, Failure> {
    let start = legendre(&KEPLER, 0.0, &KEPLER.initial());
    let mut flow = Flow::new(ld, 0.0, start)?;
    let mut decay = MomentumDecay::new(Symmetry::rotation(0, 1)?);
    match flow.run(KEPLER_RUN.1, &mut decay)? {
        Status::Completed => Ok(decay),
        status => Err(Failure::Run { what: KEPLER.name(), status }),
    }
}

/// The angular momentum along a Kepler orbit with drag, against its predicted decay by the product of the `sigma_d` and
/// against the true `e^(gamma t)`.
pub fn angular_momentum(out: &Directory) -> Result<(), Failure> {
    let h = KEPLER_RUN.0;
    let left = momenta(&LeftMidpoint::new::<2>(KEPLER, h)?)?.rows;
    let middle = momenta(&Midpoint::new::<2>(KEPLER, h)?)?.rows;
    let initial = left.first().map_or(f64::NAN, |r| r.momentum);
    let exact = |t: f64| initial * (KEPLER.gamma * t).exp();
    let time = Axis::Linear(0.0, 30.0, 5.0);
    let decay = Panel {
        x_label: TIME.into(),
        y_label: "angular momentum J".into(),
        x: time,
        y: Axis::Linear(0.0, 1.0, 0.2),
        legend: Legend::TopRight,
        curves: vec![
            Curve::new("midpoint, z at the left end", Line::Solid, left.iter().map(|r| (r.t, r.momentum)).collect()),
            Curve::new(
                "predicted, J₀ times the product of σ_d",
                Line::Dotted,
                left.iter().map(|r| (r.t, r.predicted)).collect(),
            ),
            Curve::new("exact flow, J₀ exp(γt)", Line::Dashed, left.iter().map(|r| (r.t, exact(r.t))).collect()),
        ],
        marks: Vec::new(),
    };
    let deviation = |t: f64, j: f64| (t, (j / exact(t) - 1.0).abs().max(FLOOR));
    let error = Panel {
        x_label: TIME.into(),
        y_label: "relative deviation of J".into(),
        x: time,
        y: Axis::Logarithmic(-17, 4),
        legend: Legend::TopRight,
        curves: vec![
            Curve::new(
                "z at the left end, from J₀ exp(γt)",
                Line::Solid,
                left[1..].iter().map(|r| deviation(r.t, r.momentum)).collect(),
            ),
            Curve::new(
                "symmetric midpoint, from J₀ exp(γt)",
                Line::DashDot,
                middle[1..].iter().map(|r| deviation(r.t, r.momentum)).collect(),
            ),
            Curve::new(
                "z at the left end, from its prediction",
                Line::Dotted,
                left[1..].iter().map(|r| (r.t, r.defect().max(FLOOR))).collect(),
            ),
        ],
        marks: Vec::new(),
    };
    out.text("angular_momentum.svg", &draw_stack(&[decay, error], 2))?;
    let columns = ["t", "j_left_midpoint", "predicted_left_midpoint", "j_midpoint", "predicted_midpoint", "j_exact"];
    let rows = left.iter().zip(&middle);
    let entries = rows.map(|(l, m)| [l.t, l.momentum, l.predicted, m.momentum, m.predicted, exact(l.t)].map(number));
    out.table("angular_momentum.csv", &columns, entries)
}
