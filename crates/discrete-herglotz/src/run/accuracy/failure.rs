//! The reason why no number of steps reaches an accuracy.

use crate::SelectionFailure;
use crate::run::accuracy::limits::{
    CERTAIN_ROUND_OFF, MAX_ROUND_OFF, MIN_CHAOTIC_DISTANCE, MIN_CHAOTIC_GROWTH, MIN_ORDER_ABOVE_ROUND_OFF,
};

/// The reason why runs do not agree, from their distances along the motion and their observed order.
pub(crate) fn cause_of_disagreement(
    distances: &[f64],
    order: f64,
    wanted: f64,
    t0: f64,
    span: f64,
) -> SelectionFailure {
    let (first, last) = (distances.first().copied().unwrap_or(0.0), distances.last().copied().unwrap_or(0.0));
    let no_order = order < MIN_ORDER_ABOVE_ROUND_OFF;
    if no_order && last > MIN_CHAOTIC_DISTANCE && last > MIN_CHAOTIC_GROWTH * first {
        let kept = distances.iter().take_while(|d| **d <= wanted).count();
        return SelectionFailure::Chaos { t: t0 + span * kept as f64 / distances.len() as f64 };
    }
    // If only round-off remains, the observed order is arbitrary.
    if no_order && last < MAX_ROUND_OFF || last <= CERTAIN_ROUND_OFF {
        SelectionFailure::RoundOff
    } else {
        SelectionFailure::Order { order }
    }
}
