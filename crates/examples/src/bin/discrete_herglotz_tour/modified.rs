//! The modified Hamiltonians of a splitting: their defects against the step size, and the smallest of them.

use contact_examples::systems::Pendulum;
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw_row, number};
use contact_geom::VelocityPoint;
use discrete_herglotz::hamiltonian::{MAX_MODIFIED_ORDER, ModifiedDefect, modified_defects};
use discrete_herglotz::{Problem, SplittingScheme};

/// The step sizes, each about four fifths of the one before.
const STEPS: [f64; 14] = [1.0, 0.8, 0.64, 0.5, 0.4, 0.32, 0.25, 0.2, 0.16, 0.125, 0.1, 0.08, 0.064, 0.05];

/// The defects of the Strang splitting of a damped pendulum over a span of 8, as a table and as a figure; the smallest
/// defect for the steps 0.8 and 0.4.
pub fn write(out: &Directory) -> Result<[f64; 2], Failure> {
    let pendulum = Pendulum { gamma: -0.3 };
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.7], 0.2))?;
    let defects = modified_defects(&problem, &SplittingScheme::STRANG, 8.0, &STEPS, MAX_MODIFIED_ORDER)?;
    let rows = defects.iter().map(|of| [of.k.to_string(), number(of.h), number(of.defect)]);
    out.table("modified_hamiltonian.csv", &["k", "h", "defect"], rows)?;
    let of_order = |k: usize| {
        let points = defects.iter().filter(|of| of.k == k).map(|of| (of.h, of.defect));
        Curve::new(&format!("k = {k}"), Line::Coloured(k - 1), points)
    };
    let by_step = Panel::new(
        ("step h (dimensionless)", Axis::Logarithmic(-2, 0, 1)),
        ("defect of H~k (relative)", Axis::Logarithmic(-14, 0, 2)),
        (0.02, 0.98),
        (1..=MAX_MODIFIED_ORDER).map(of_order).collect(),
    );
    let smallest = |h: f64| smallest(&defects, h);
    let least = Panel::new(
        ("1/h (dimensionless)", Axis::Linear(0.0, 20.0, 5.0)),
        ("smallest defect over k (relative)", Axis::Logarithmic(-14, 0, 2)),
        (0.4, 0.95),
        vec![Curve::unnamed(Line::Discs, STEPS.iter().map(|h| (1.0 / h, smallest(*h))))],
    );
    out.text("modified_hamiltonian.svg", &draw_row(&[by_step, least]))?;
    Ok([smallest(0.8), smallest(0.4)])
}

/// The smallest defect of a step size.
fn smallest(defects: &[ModifiedDefect], h: f64) -> f64 {
    defects.iter().filter(|of| of.h == h).map(|of| of.defect).fold(f64::INFINITY, f64::min)
}
