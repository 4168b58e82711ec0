//! Figures of fits: the data with the fitted motion, and the residuals.

use crate::plot::{axis, grid, label};
use contact_examples::figure::{Axis, Curve, Line, Panel};
use herglotz::runtime::{FittedMotion, FittedSeries};

/// The measured values of each quantity as discs, and the fitted motion, whose rows have the time and the quantities, as
/// a line.
pub(crate) fn of_fit(fitted: &FittedMotion, rows: &[Vec<f64>]) -> String {
    let panel = |(i, series): (usize, &FittedSeries)| {
        let motion: Vec<(f64, f64)> = rows.iter().filter_map(|row| Some((*row.first()?, *row.get(i + 1)?))).collect();
        let data = points(&series.times, &series.values);
        panel(
            series,
            &series.quantity,
            [Curve::new("data", Line::Discs, data), Curve::new("fit", Line::Dashed, motion)],
        )
    };
    grid(&fitted.series.iter().enumerate().filter_map(panel).collect::<Vec<_>>())
}

/// The residuals of each quantity against time, with a line at zero.
pub(crate) fn of_residuals(fitted: &FittedMotion) -> String {
    let (t0, end) = (fitted.motion.start.t, fitted.motion.end);
    let panel = |series: &FittedSeries| {
        let residuals = points(&series.times, &series.residuals);
        let zero = [(t0, 0.0), (end, 0.0)];
        let curves = [Curve::unnamed(Line::Discs, residuals), Curve::unnamed(Line::Dotted, zero)];
        panel(series, &format!("residual of {}", series.quantity), curves)
    };
    grid(&fitted.series.iter().filter_map(panel).collect::<Vec<_>>())
}

fn points(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    x.iter().copied().zip(y.iter().copied()).filter(|(x, y)| (x + y).is_finite()).collect()
}

/// A panel of curves against time; `None` without data.
fn panel(series: &FittedSeries, name: &str, curves: [Curve; 2]) -> Option<Panel> {
    if series.times.is_empty() {
        return None;
    }
    let all =
        |of: fn(&(f64, f64)) -> f64| -> Option<Axis> { axis(curves.iter().flat_map(|curve| &curve.points).map(of)) };
    let (x, y) = (all(|p| p.0)?, all(|p| p.1)?);
    let (x_label, y_label) = ("t".to_owned(), label(name));
    Some(Panel::new((&x_label, x), (&y_label, y), (0.72, 1.0), curves.into()))
}
