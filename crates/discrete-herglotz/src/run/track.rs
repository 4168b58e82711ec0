//! A motion as trial runs see it at some marks, and how far two of them are apart.

use contact_geom::larger;
use contact_geom::nalgebra::SVector;

/// The smallest number.
const SMALLEST: f64 = f64::from_bits(1);

/// A motion at some marks: (q, p).
#[derive(Clone, Debug)]
pub(super) struct Track<const N: usize> {
    pub states: Vec<[SVector<f64, N>; 2]>,
    /// What the rounding of forces may have moved them by, where they have decayed as far as that; else 0.
    pub noise: Vec<f64>,
    /// The largest misfit that was seen between the nodes of its steps.
    pub misfit: f64,
    /// What it has cost without the looks, in evaluations of L at one stage.
    pub cost: u64,
    /// The span in the time of its clock.
    pub tau: f64,
}

/// A 2-norm that neither overflows nor underflows.
pub(super) fn norm<const N: usize>(x: &[SVector<f64, N>; 2]) -> f64 {
    let size = contact_geom::largest(x.iter().flat_map(|x| x.iter().copied()));
    if !(size > 0.0 && size.is_finite()) {
        return size;
    }
    size * x.iter().map(|x| (x / size).norm_squared()).sum::<f64>().sqrt()
}

/// The distance of a state from another beyond the noise, relative to the size of that, or to one that is given where it is larger.
fn relative<const N: usize>(a: &[SVector<f64, N>; 2], b: &[SVector<f64, N>; 2], noise: f64, least: f64) -> f64 {
    let (apart, size) = (norm(&[a[0] - b[0], a[1] - b[1]]), larger(norm(b), least));
    if apart <= noise {
        return 0.0;
    }
    // Numbers are known to no less than half of the smallest one.
    if apart == 0.0 && size == 0.0 { 0.0 } else { larger(apart, SMALLEST) / size }
}

impl<const N: usize> Track<N> {
    /// The distances of the states of two tracks at the same marks, relative to the size of the second's at that time, or at the end
    /// where that is larger. Not a number where a state is not.
    pub fn distances(&self, of: &Self) -> Vec<f64> {
        let last = of.states.last().map_or(0.0, norm);
        let states = self.states.iter().zip(&of.states).zip(&of.noise);
        states.map(|((a, b), noise)| relative(a, b, *noise, last)).collect()
    }

    /// The same of the last states alone, of runs that need not have other marks in common.
    pub fn distance_at_end(&self, of: &Self) -> f64 {
        match (self.states.last(), of.states.last()) {
            (Some(a), Some(b)) => relative(a, b, of.noise.last().copied().unwrap_or(0.0), 0.0),
            _ => f64::NAN,
        }
    }

    /// Whether the motion ends with numbers that have lost digits since they are too small.
    pub fn has_underflown(&self) -> bool {
        self.states.last().is_some_and(|last| norm(last) < f64::MIN_POSITIVE)
    }

    /// The largest of the [`distances`](Self::distances).
    pub fn distance(&self, of: &Self) -> f64 {
        contact_geom::largest(self.distances(of))
    }
}
