//! The mean velocities of the last steps, from which it is judged whether steps of few stages resolve the motion.

use crate::Vector;
use crate::gauss::dense::StepStart;
use crate::numbers::state_words::saved;

/// The mean velocities of the last four steps, the last position, and the states after the last two steps.
pub(crate) struct Sequence {
    pub velocities: [Vec<f64>; 4],
    pub q: Vector,
    pub ends: [StepStart; 2],
    /// The last two second differences of the velocities, the older one first.
    pub turns: [Vec<f64>; 2],
    /// The last one again, with another order of the sums.
    pub bend: Vec<f64>,
}

impl Sequence {
    /// The sequence before the first step.
    pub fn new(start: &StepStart) -> Self {
        let zeros = || vec![0.0; start.q.len()];
        Sequence {
            velocities: [zeros(), zeros(), zeros(), zeros()],
            q: start.q.clone(),
            ends: [start.clone(), start.clone()],
            turns: [zeros(), zeros()],
            bend: zeros(),
        }
    }

    /// Adds the mean velocity of the k-th step, of length h, from the position at its end.
    pub fn push(&mut self, q: &[f64], k: usize, h: f64) {
        let Sequence { velocities, q: before, turns, bend, .. } = self;
        velocities.rotate_left(1);
        let [a, b, c, d] = velocities;
        for i in 0..before.len() {
            d[i] = (q[i] - before[i]) / h;
            // The velocities before the first step are extrapolated linearly from those of the first two steps.
            match k {
                0 => (a[i], b[i], c[i]) = (d[i], d[i], d[i]),
                1 => b[i] = c[i] * 2.0 - d[i],
                _ => {}
            }
            turns[0][i] = b[i] * -2.0 + a[i] + c[i];
            turns[1][i] = c[i] * -2.0 + b[i] + d[i];
            bend[i] = d[i] - c[i] * 2.0 + b[i];
        }
        before.copy_from_slice(q);
    }

    /// Adds the state at the end of a step.
    pub fn keep(&mut self, end: &StepStart) {
        self.ends.swap(0, 1);
        self.ends[1].copy_from(end);
    }
}

saved!([] Sequence { velocities, q, ends });
