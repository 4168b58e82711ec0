//! Sections of the exact discrete Lagrangian beside two discretisations of the same Lagrangian.

use contact_examples::systems::Pendulum;
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw_row, number};
use contact_geom::DiscretePoint;
use discrete_herglotz::{DiscreteLagrangian, rules::Rule};
use exact_lagrangian::ExactLagrangian;

/// A pendulum with strong drag, since the rules differ mainly in how they treat z.
const PENDULUM: Pendulum = Pendulum { gamma: -0.5 };

/// The values of q0 and z0 of the sections.
const AT: (f64, f64) = (0.5, 1.0);

/// The long step, for which the values are drawn, and a short step for comparison of the differences.
const STEPS: [f64; 2] = [1.0, 0.1];

/// The largest mean velocity `(q1 - q0)/h`, and the number of samples on each side. Sections of different h are
/// compared at equal mean velocities, since only then the differences scale with a power of h.
const SAMPLES: (f64, i32) = (3.0, 150);

/// A point of a section and the three values there.
struct Row {
    /// The mean velocity `(q1 - q0)/h`.
    u: f64,
    q1: f64,
    /// `L_h^e`, the action along the motion.
    exact: f64,
    /// The paper's midpoint rule, with z at the left end.
    left: f64,
    /// The midpoint rule made symmetric in z.
    middle: f64,
}

impl Row {
    /// The differences of the two rules from the exact value.
    fn errors(&self) -> (f64, f64) {
        ((self.left - self.exact).abs(), (self.middle - self.exact).abs())
    }
}

/// The section for a time step.
fn section(h: f64) -> Result<Vec<Row>, Failure> {
    let exact = ExactLagrangian::<_, 1>::new(PENDULUM, h)?;
    let left = Rule::LEFT_MIDPOINT.of::<1, _>(PENDULUM, h)?;
    let middle = Rule::MIDPOINT.of::<1, _>(PENDULUM, h)?;
    let (q0, z0) = AT;
    let (fastest, samples) = SAMPLES;
    let row = |k: i32| -> Result<Row, Failure> {
        let u = fastest * f64::from(k) / f64::from(samples);
        let q1 = q0 + h * u;
        let x = DiscretePoint::new([q0], [q1], z0);
        let action = exact.retract(0.0, &x)?.action;
        Ok(Row { u, q1, exact: action, left: left.value(0.0, &x)?, middle: middle.value(0.0, &x)? })
    };
    (-samples..=samples).map(row).collect()
}

/// The largest differences of the two rules from the exact values of a section.
fn worst(rows: &[Row]) -> (f64, f64) {
    rows.iter().map(Row::errors).fold((0.0, 0.0), |worst, error| (worst.0.max(error.0), worst.1.max(error.1)))
}

/// Writes table and figure; returns a summary as text.
pub fn write(out: &Directory) -> Result<String, Failure> {
    let [long, short] = STEPS;
    let (slow, fast) = (section(long)?, section(short)?);
    let (q0, z0) = AT;
    let columns = ["q0", "q1", "z0", "h", "exact", "left_midpoint", "midpoint"];
    let of = |rows: &[Row], h: f64| -> Vec<[String; 7]> {
        rows.iter().map(|r| [q0, r.q1, z0, h, r.exact, r.left, r.middle].map(number)).collect()
    };
    let table = of(&slow, long).into_iter().chain(of(&fast, short));
    out.table("exact_lagrangian_sections.csv", &columns, table)?;
    out.text("exact_lagrangian_sections.svg", &draw_row(&[values(&slow), differences(&slow, &fast)]))?;
    let (slow, fast) = (worst(&slow), worst(&fast));
    Ok(format!(
        "sections at q0 = {q0}, z0 = {z0}, |q1 - q0| <= {} h: largest difference from L_h^e\n  \
         left midpoint: {:.1e} for h = {long}, {:.1e} for h = {short}\n  \
         midpoint:      {:.1e} for h = {long}, {:.1e} for h = {short}\n",
        SAMPLES.0, slow.0, fast.0, slow.1, fast.1
    ))
}

/// The three discrete Lagrangians for the long step, as functions of q1.
fn values(rows: &[Row]) -> Panel {
    Panel::new(
        ("position q1 (dimensionless)", Axis::Linear(-3.0, 4.0, 1.0)),
        ("Ld(q0, q1, z0) (dimensionless)", Axis::Linear(-1.0, 4.0, 1.0)),
        (0.36, 0.95),
        vec![
            Curve::new("left midpoint", Line::Solid, rows.iter().map(|r| (r.q1, r.left))),
            Curve::new("midpoint", Line::DashDot, rows.iter().map(|r| (r.q1, r.middle))),
            Curve::new("exact", Line::Dashed, rows.iter().map(|r| (r.q1, r.exact))),
        ],
    )
}

/// The differences of both rules for both steps, as functions of the mean velocity.
fn differences(slow: &[Row], fast: &[Row]) -> Panel {
    let left = |rows: &[Row]| -> Vec<(f64, f64)> { rows.iter().map(|r| (r.u, r.errors().0)).collect() };
    let middle = |rows: &[Row]| -> Vec<(f64, f64)> { rows.iter().map(|r| (r.u, r.errors().1)).collect() };
    Panel::new(
        ("mean velocity (q1 \u{2212} q0)/h (dimensionless)", Axis::Linear(-3.0, 3.0, 1.0)),
        ("difference from the exact Ld", Axis::Logarithmic(-8, 2, 2)),
        (0.04, 0.97),
        vec![
            Curve::new("left midpoint: h = 1 (upper), h = 0.1 (lower)", Line::Solid, left(slow)),
            Curve::unnamed(Line::Solid, left(fast)),
            Curve::new("midpoint: h = 1 (upper), h = 0.1 (lower)", Line::DashDot, middle(slow)),
            Curve::unnamed(Line::DashDot, middle(fast)),
        ],
    )
}
