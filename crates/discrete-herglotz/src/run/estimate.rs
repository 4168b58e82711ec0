//! The error of a run with given steps, estimated.

use super::{Interrupt, Plan};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, largest};

/// The steps between two looks at whether it is to end.
const CHUNK: usize = 1024;

impl<L: Lagrangian<N>, const N: usize> Plan<'_, L, N> {
    /// The distance of (q, p) after some steps from that of a run with twice as many of half their length, relative to its size: of the
    /// error of an order `p` this is the part `1 - 2^-p`. Infinite where the other run does not come as far,
    /// or is interrupted.
    pub(super) fn distance_from_halves(&self, taken: usize, t: f64, end: &PhasePoint<N>) -> f64 {
        let Ok(mut fine) = self.make_stepper(self.problem, 0.5 * self.h, false) else { return f64::INFINITY };
        let steps = if self.facts.by_clock { usize::MAX } else { 2 * taken };
        let mut left = steps;
        while left > 0 && (fine.time() - t) * self.h < 0.0 {
            if self.problem.interrupt.is_some_and(Interrupt::is_wanted) {
                return f64::INFINITY;
            }
            match fine.advance_until(left.min(CHUNK), t) {
                Ok(done) if done > 0 => left -= done,
                Ok(_) => break,
                Err(_) => return f64::INFINITY,
            }
        }
        let fine = fine.state();
        let apart = norm([&(end.q - fine.q), &(end.p - fine.p)]);
        if apart == 0.0 { 0.0 } else { apart / norm([&fine.q, &fine.p]) }
    }
}

/// A 2-norm that neither overflows nor underflows.
fn norm<const N: usize>(x: [&SVector<f64, N>; 2]) -> f64 {
    let size = largest(x.iter().flat_map(|x| x.iter().copied()));
    if !(size > 0.0 && size.is_finite()) {
        return size;
    }
    size * x.iter().map(|x| (*x / size).norm_squared()).sum::<f64>().sqrt()
}
