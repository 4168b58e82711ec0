//! The equations of motion as a first-order system, for external integrators.

use crate::kernel::Kernel;
use crate::{Motion, Outcome, RuntimeError, Start, System};
use std::sync::Arc;

/// An external integrator that a [comparison](System::compare) measures along with those of the library.
pub trait Peer {
    /// Its name.
    fn name(&self) -> &str;

    /// Its order.
    fn order(&self) -> u32;

    /// The end of a motion, computed to a relative tolerance of its variables; `None` where the integrator fails.
    fn run(&self, motion: &FirstOrder, tolerance: f64) -> Option<PeerEnd>;
}

/// The final state that a peer computed, and the work it took.
#[derive(Clone, Debug, PartialEq)]
pub struct PeerEnd {
    /// The variables, ordered as in [`FirstOrder::start`].
    pub state: Vec<f64>,
    /// The steps taken.
    pub steps: usize,
    /// The evaluations of the vector field.
    pub evaluations: u64,
}

/// The equations of motion as a first-order system `y' = f(t, y)`: `y` is `(q, v)`, followed by the action `z` where
/// accelerations depend on it.
pub struct FirstOrder {
    kernel: Arc<dyn Kernel>,
    /// The variables at the start.
    pub start: Vec<f64>,
    /// The time of the start.
    pub t0: f64,
    /// The time of the end.
    pub end: f64,
    /// The size of `(q, v)` at the end, relative to which the error there is measured; absolute tolerances are in units
    /// of it.
    pub size: f64,
}

impl FirstOrder {
    /// The first-order system of a motion whose end is known.
    ///
    /// # Errors
    /// Those of [`System::geometry`] at the start.
    pub(crate) fn new(system: &System, motion: &Motion, end: &Outcome) -> Result<Self, RuntimeError> {
        let (start, n) = (&motion.start, system.dimension());
        // The Herglotz field has the velocity, also where the start has a momentum.
        let field = system.geometry(start)?.herglotz_field;
        let mut y = [start.q.as_slice(), field.get(..n).unwrap_or_default()].concat();
        if !system.structure().has_constant_rate() {
            y.push(start.z);
        }
        let at_end = end.q.iter().chain(end.v.iter().flatten());
        let size = at_end.map(|x| x * x).sum::<f64>().sqrt();
        Ok(FirstOrder { kernel: system.kernel.clone(), start: y, t0: start.t, end: motion.end, size })
    }

    /// The right-hand side `f(t, y)`; NaN where L is not defined or not regular.
    pub fn rates(&self, t: f64, y: &[f64], to: &mut [f64]) {
        self.kernel.rates(t, y, to);
    }

    /// Position and momentum of a state at the end.
    pub(crate) fn end_of(&self, system: &System, y: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let n = system.dimension();
        let (q, v) = (y.get(..n)?, y.get(n..2 * n)?);
        let z = y.get(2 * n).copied().unwrap_or(0.0);
        Some((q.to_vec(), system.geometry(&Start::new(self.end, q, v, z)).ok()?.momentum))
    }
}
