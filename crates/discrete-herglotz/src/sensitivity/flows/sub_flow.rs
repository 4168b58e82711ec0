//! A linearised sub-flow of a step.

use super::tangent_matrix::TangentMatrix;
use crate::Components;
use crate::sensitivity::columns::{Column, Covector};

/// A sub-flow of a step, linearised at the state where it acts: an exact flow of a splitting, or a step of a quadrature
/// rule.
#[derive(Clone, Debug)]
pub(super) struct SubFlow {
    /// The derivative in the state.
    pub state: TangentMatrix,
    /// The derivatives in each parameter, in the time at which it starts, and in its duration; empty if not requested.
    pub sources: Vec<Components>,
    /// The time at which it starts, from the start of the step, and its duration, in units of the step size.
    pub start: f64,
    pub duration: f64,
}

impl SubFlow {
    /// The derivatives in the time and in the duration.
    fn of_times(&self) -> Option<[&Components; 2]> {
        let [.., time, duration] = self.sources.as_slice() else { return None };
        Some([time, duration])
    }

    /// Carries the tangent of a column over the sub-flow, in the k-th step of the run.
    pub fn push(&self, k: usize, column: &Column, tangent: &mut Components) {
        let mut image = self.state.push(tangent);
        if let Some(source) = column.parameter.and_then(|index| self.sources.get(index)) {
            image = image.plus(source);
        }
        if let Some([time, duration]) = self.of_times()
            && (column.dt0 != 0.0 || column.dh != 0.0)
        {
            let dt = column.dt0 + (k as f64 + self.start) * column.dh;
            image = image.plus(&time.scale(dt)).plus(&duration.scale(self.duration * column.dh));
        }
        *tangent = image;
    }

    /// Carries the derivatives w in the state back over the sub-flow, in the k-th step of the run, and adds those in
    /// parameters and times to a covector.
    pub fn pull(&self, k: usize, covector: &mut Covector, w: &mut Components) {
        for (sum, source) in covector.parameters.iter_mut().zip(&self.sources) {
            *sum += source.dot(w);
        }
        if let Some([time, duration]) = self.of_times() {
            let of_time = time.dot(w);
            covector.time += of_time;
            covector.step += (k as f64 + self.start) * of_time + self.duration * duration.dot(w);
        }
        *w = self.state.pull(w);
    }
}
