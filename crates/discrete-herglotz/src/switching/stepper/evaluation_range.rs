//! The points of a step at which an integrator evaluates L.

/// Where an integrator evaluates L.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum EvaluationRange {
    /// Between the ends of its steps, as Gauss collocation does.
    Within,
    /// Also at the ends of its steps, or beyond them by this fraction of a step.
    Extended(f64),
}
