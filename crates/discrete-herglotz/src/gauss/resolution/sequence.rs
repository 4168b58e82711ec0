//! The mean velocities of the last steps, from which it is judged whether steps of few stages resolve the motion.

use crate::gauss::dense::StepStart;
use crate::numbers::state_words::saved;
use contact_geom::nalgebra::SVector;

/// The mean velocities of the last four steps, the last position, and the states after the last two steps.
pub(crate) struct Sequence<const N: usize> {
    pub velocities: [SVector<f64, N>; 4],
    pub q: SVector<f64, N>,
    pub ends: [StepStart<N>; 2],
}

impl<const N: usize> Sequence<N> {
    /// The sequence before the first step.
    pub fn new(start: StepStart<N>) -> Box<Self> {
        Box::new(Sequence { velocities: [SVector::zeros(); 4], q: SVector::from(start.q), ends: [start; 2] })
    }
}

saved!([const N: usize] Sequence<N> { velocities, q, ends });
