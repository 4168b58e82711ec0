//! A motion as trial runs see it at some marks, and how far two of them are apart.

use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, numbers::max_or_nan};

/// The smallest number.
const SMALLEST: f64 = f64::from_bits(1);

/// A motion at some marks: (q, p), and v.
#[derive(Clone, Debug)]
pub(crate) struct Track<const N: usize> {
    pub states: Vec<[SVector<f64, N>; 2]>,
    /// The velocities of the states, which their momenta may determine less well than they are known themselves: as in a strong magnetic field,
    /// where `p = v + A(q)`.
    pub velocities: Vec<SVector<f64, N>>,
    /// What the velocities are measured by; infinite where the motion moves by no more than rounding.
    pub speed: f64,
    /// What each coordinate is measured by, where that is asked for; else all have the unit of their common norm.
    pub scales: Option<SVector<f64, N>>,
    /// What the rounding of forces may have moved them by, where they have decayed as far as that; else 0.
    pub noise: Vec<f64>,
    /// The largest misfit that was seen between the nodes of its steps.
    pub defect: f64,
    /// What it has cost without the looks, in evaluations of L at one stage.
    pub cost: u64,
    /// The span in its transformed time.
    pub tau: f64,
}

/// A 2-norm that neither overflows nor underflows.
pub(crate) fn norm<const N: usize, const M: usize>(x: &[SVector<f64, N>; M]) -> f64 {
    let size = contact_geom::numbers::max_abs_or_nan(x.iter().flat_map(|x| x.iter().copied()));
    if !(size > 0.0 && size.is_finite()) {
        return size;
    }
    size * x.iter().map(|x| (x / size).norm_squared()).sum::<f64>().sqrt()
}

/// A position or a velocity in units of the scales, where they are given.
pub(crate) fn in_units<const N: usize>(x: &SVector<f64, N>, scales: Option<&SVector<f64, N>>) -> SVector<f64, N> {
    scales.map_or(*x, |scales| x.component_div(scales))
}

/// The distance of a state from another beyond the noise, relative to the size of that, or to one that is given where it is larger.
fn relative<const N: usize>(a: &[SVector<f64, N>; 2], b: &[SVector<f64, N>; 2], noise: f64, least: f64) -> f64 {
    let (apart, size) = (norm(&[a[0] - b[0], a[1] - b[1]]), max_or_nan(norm(b), least));
    if apart <= noise {
        return 0.0;
    }
    // Numbers are known to no less than half of the smallest one.
    if apart == 0.0 && size == 0.0 { 0.0 } else { max_or_nan(apart, SMALLEST) / size }
}

impl<const N: usize> Track<N> {
    /// The end of a run alone, with its velocity.
    pub fn of_end(state: &PhasePoint<N>, v: SVector<f64, N>) -> Self {
        Track {
            states: vec![[state.q, state.p]],
            velocities: vec![v],
            speed: f64::INFINITY,
            scales: None,
            noise: vec![0.0],
            defect: 0.0,
            cost: 0,
            tau: 0.0,
        }
    }

    /// The distances of the states of two tracks at the same marks. Not a number where a state is not.
    ///
    /// Those of (q, p) are relative to the size of the second's at that time, or at the end where that is larger; with scales each coordinate
    /// has its own. Those of v are relative to the largest speed of the motion.
    pub fn distances(&self, of: &Self) -> Vec<f64> {
        let last = of.states.last().map_or(0.0, norm);
        (0..self.states.len().min(of.states.len())).map(|i| self.distance_at([i, i], of, last)).collect()
    }

    /// The same of the last states alone, of runs that need not have other marks in common.
    pub fn distance_at_end(&self, of: &Self) -> f64 {
        match (self.states.len().checked_sub(1), of.states.len().checked_sub(1)) {
            (Some(i), Some(j)) => self.distance_at([i, j], of, 0.0),
            _ => f64::NAN,
        }
    }

    /// The distance at one mark of each.
    fn distance_at(&self, [i, j]: [usize; 2], of: &Self, least: f64) -> f64 {
        let (a, b, v) = (&self.states[i], &of.states[j], self.velocities[i] - of.velocities[j]);
        let scales = of.scales.as_ref();
        let of_state = match scales {
            None => relative(a, b, of.noise[j], least),
            Some(_) => norm(&[in_units(&(a[0] - b[0]), scales)]),
        };
        max_or_nan(of_state, norm(&[in_units(&v, scales)]) / of.speed)
    }

    /// Whether the motion ends with numbers that have lost digits since they are too small.
    pub fn has_underflown(&self) -> bool {
        self.states.last().is_some_and(|last| norm(last) < f64::MIN_POSITIVE)
    }

    /// The largest of the [`distances`](Self::distances).
    pub fn distance(&self, of: &Self) -> f64 {
        contact_geom::numbers::max_abs_or_nan(self.distances(of))
    }
}
