//! Work-precision diagrams: error against run time, one curve per method.

use crate::problems::Problem;
use crate::row::{Action, Origin, Row};
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw};

/// The exponents of ten between which errors are drawn. With larger errors the motion is lost; smaller ones are below
/// the rounding of a final state.
const ERRORS: (i32, i32) = (-16, 0);

/// Writes the diagram of a problem, with or without the action, if it has any rows. The rows are sorted.
pub fn write(out: &Directory, problem: &Problem, z: Action, rows: &[Row]) -> Result<(), Failure> {
    let (least, most) = (10f64.powi(ERRORS.0), 10f64.powi(ERRORS.1));
    let drawn = |row: &&Row| row.problem == problem.name && row.z == z && (least..=most).contains(&row.error);
    let mut rows: Vec<&Row> = rows.iter().filter(drawn).collect();
    // The library comes first in the legend; the sort is stable, so that each group keeps the order of the table.
    rows.sort_by_key(|row| row.origin != Origin::Library);
    let seconds = || rows.iter().map(|row| row.seconds);
    let (fastest, slowest) = (seconds().fold(f64::INFINITY, f64::min), seconds().fold(0.0, f64::max));
    if rows.is_empty() {
        return Ok(());
    }
    let (mut ours, mut theirs) = (0.., 0..);
    let curve = |of_method: &[&Row]| {
        let row = of_method.first()?;
        let line = match row.origin {
            Origin::Library => Line::Coloured(ours.next()?),
            Origin::Peer | Origin::Recorded => Line::Grey(theirs.next()?),
        };
        let points = of_method.iter().map(|row| (row.seconds, row.error));
        Some(Curve::new(&row.method.replace('_', " "), line, points))
    };
    let panel = Panel::new(
        (
            &format!("{}, z {}: run time (s)", problem.name, z.name()),
            Axis::Logarithmic(fastest.log10().floor() as i32, slowest.log10().ceil() as i32, 1),
        ),
        ("error of (q, v) (relative)", Axis::Logarithmic(ERRORS.0, ERRORS.1, 2)),
        (1.0, 1.0),
        rows.chunk_by(|a, b| a.method == b.method).filter_map(curve).collect(),
    );
    out.text(&format!("{}_z_{}.svg", problem.name, z.name()), &draw(&panel))
}
