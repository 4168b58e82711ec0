//! The reason why no number of steps reaches an accuracy.

use crate::SelectionFailure;

/// The reason why runs do not agree, from their distances along the motion and their observed order.
pub(crate) fn obstacle(distances: &[f64], order: f64, wanted: f64, t0: f64, span: f64) -> SelectionFailure {
    let (first, last) = (distances.first().copied().unwrap_or(0.0), distances.last().copied().unwrap_or(0.0));
    // Runs that differ only by round-off show an order below this.
    let noise = order < 2.0;
    if noise && last > 1e-8 && last > 1e4 * first {
        let kept = distances.iter().take_while(|d| **d <= wanted).count();
        return SelectionFailure::Chaos { t: t0 + span * kept as f64 / distances.len() as f64 };
    }
    // If only round-off remains, the observed order is arbitrary.
    if noise && last < 1e-9 || last <= 64.0 * f64::EPSILON {
        SelectionFailure::RoundOff
    } else {
        SelectionFailure::Order { order }
    }
}
