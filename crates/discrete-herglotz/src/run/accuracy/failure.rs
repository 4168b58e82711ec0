//! Why no steps reach an accuracy.

use crate::SelectionFailure;

/// What keeps runs from agreeing, by their distances along the motion and the order that they show.
pub(crate) fn obstacle(distances: &[f64], order: f64, wanted: f64, t0: f64, span: f64) -> SelectionFailure {
    let (first, last) = (distances.first().copied().unwrap_or(0.0), distances.last().copied().unwrap_or(0.0));
    // The order that is left where runs differ by nothing but what they have rounded.
    let noise = order < 2.0;
    if noise && last > 1e-8 && last > 1e4 * first {
        let kept = distances.iter().take_while(|d| **d <= wanted).count();
        return SelectionFailure::Chaos { t: t0 + span * kept as f64 / distances.len() as f64 };
    }
    // Where only roundings are left they may show any order.
    if noise && last < 1e-9 || last <= 64.0 * f64::EPSILON {
        SelectionFailure::RoundOff
    } else {
        SelectionFailure::Order { order }
    }
}
