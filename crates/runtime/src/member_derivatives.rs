//! Derivatives of the members of an ensemble.

use crate::{EndCovector, MotionState};

/// A function of the index of a member and of states of its motion: its value, and its partial derivatives in each of
/// them.
pub type BatchLoss<'l> = dyn Fn(usize, &[MotionState]) -> (f64, Vec<EndCovector>) + Sync + 'l;
