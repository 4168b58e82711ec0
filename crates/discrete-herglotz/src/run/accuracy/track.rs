//! A motion at the times of a comparison grid, and the distance of two motions.

use crate::{State, Vector};
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};
use std::borrow::Borrow;

/// The smallest positive number.
const SMALLEST: f64 = f64::from_bits(1);

/// A motion at the times of a comparison grid: (q, p), and v.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    pub states: Vec<[Vector; 2]>,
    /// The actions at the states, if they were computed.
    pub actions: Vec<f64>,
    /// The velocities at the states. They may be known more accurately than the momenta determine them, as in a strong
    /// magnetic field, where `p = v + A(q)`.
    pub velocities: Vec<Vector>,
    /// The size of the velocities for relative errors; infinite if the motion moves by no more than round-off.
    pub speed: f64,
    /// The scales of the coordinates, if they were requested; otherwise all coordinates are compared by their common
    /// norm.
    pub scales: Option<Vector>,
    /// The displacement that the round-off of forces may have caused, for states that have decayed to that size;
    /// otherwise 0.
    pub round_off: Vec<f64>,
    /// The largest defect that was sampled between the nodes of the steps.
    pub defect: f64,
    /// The cost without the defect samples, in evaluations of L at one stage.
    pub cost: u64,
    /// The span in transformed time.
    pub tau: f64,
}

/// The 2-norm of all components of some vectors, which neither overflows nor underflows.
pub(crate) fn norm<V: Borrow<Vector>>(x: &[V]) -> f64 {
    let vectors = || x.iter().map(Borrow::<Vector>::borrow);
    let size = max_abs_or_nan(vectors().flat_map(|x| x.iter().copied()));
    if !(size > 0.0 && size.is_finite()) {
        return size;
    }
    size * vectors().map(|x| (x / size).norm_squared()).sum::<f64>().sqrt()
}

/// The 2-norm of a position or a velocity, in units of the scales, if they are given.
pub(crate) fn norm_in_units(x: &Vector, scales: Option<&Vector>) -> f64 {
    scales.map_or_else(|| norm(&[x]), |scales| norm(&[x.component_div(scales)]))
}

/// The distance between two states, relative to the size of the second one or to `least` if that is larger; 0 if it
/// does not exceed the round-off.
fn relative(a: &[Vector; 2], b: &[Vector; 2], round_off: f64, least: f64) -> f64 {
    let (apart, size) = (norm(&[&a[0] - &b[0], &a[1] - &b[1]]), max_or_nan(norm(b), least));
    if apart <= round_off {
        return 0.0;
    }
    // The round-off of a subnormal number is up to half of the smallest positive number.
    if apart == 0.0 && size == 0.0 { 0.0 } else { max_or_nan(apart, SMALLEST) / size }
}

impl Track {
    /// Only the end of a run, with its velocity.
    pub fn of_end(state: &State, v: Vector) -> Self {
        Track {
            states: vec![[state.q.clone(), state.p.clone()]],
            actions: Vec::new(),
            velocities: vec![v],
            speed: f64::INFINITY,
            scales: None,
            round_off: vec![0.0],
            defect: 0.0,
            cost: 0,
            tau: 0.0,
        }
    }

    /// The distances of the states of two tracks at the same times. NaN where a state is NaN.
    ///
    /// The distances of (q, p) are relative to the size of the second track at that time, or at the end if that is
    /// larger; with scales each coordinate is relative to its own. The distances of v are relative to the largest speed
    /// of the motion.
    pub fn distances(&self, of: &Self) -> Vec<f64> {
        let last = of.states.last().map_or(0.0, |last| norm(last));
        (0..self.states.len().min(of.states.len())).map(|i| self.distance_at([i, i], of, last)).collect()
    }

    /// The distance of the last states, of runs that need not have other times in common.
    pub fn distance_at_end(&self, of: &Self) -> f64 {
        match (self.states.len().checked_sub(1), of.states.len().checked_sub(1)) {
            (Some(i), Some(j)) => self.distance_at([i, j], of, 0.0),
            _ => f64::NAN,
        }
    }

    /// The distance between one state of each track.
    fn distance_at(&self, [i, j]: [usize; 2], of: &Self, least: f64) -> f64 {
        let (a, b, v) = (&self.states[i], &of.states[j], &self.velocities[i] - &of.velocities[j]);
        let scales = of.scales.as_ref();
        let of_state = match scales {
            None => relative(a, b, of.round_off[j], least),
            Some(_) => norm_in_units(&(&a[0] - &b[0]), scales),
        };
        max_or_nan(of_state, norm_in_units(&v, scales) / of.speed)
    }

    /// Whether the last state has lost digits by underflow.
    pub fn has_underflown(&self) -> bool {
        self.states.last().is_some_and(|last| norm(last) < f64::MIN_POSITIVE)
    }

    /// The largest of the [`distances`](Self::distances).
    pub fn distance(&self, of: &Self) -> f64 {
        max_abs_or_nan(self.distances(of))
    }
}
