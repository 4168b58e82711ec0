//! What every splitting moves: sums that may carry their rounding, a state of them, and a run in chunks.

use crate::{Halt, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, Triple};

/// A vector that many small changes are added to, with what rounding has taken from it so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sum<const N: usize> {
    pub(super) value: SVector<f64, N>,
    carry: SVector<f64, N>,
}

impl<const N: usize> Sum<N> {
    pub(super) fn new(value: SVector<f64, N>) -> Self {
        Sum { value, carry: SVector::zeros() }
    }

    /// Adds `change(i, value_i)` to each component; compensated by Kahan's sum.
    #[inline(always)]
    pub(super) fn add<const COMPENSATED: bool>(&mut self, change: impl Fn(usize, f64) -> f64) {
        for i in 0..N {
            let before = self.value[i];
            if COMPENSATED {
                let change = change(i, before) + self.carry[i];
                self.value[i] = before + change;
                self.carry[i] = change - (self.value[i] - before);
            } else {
                self.value[i] = before + change(i, before);
            }
        }
    }
}

/// Where a run goes on from, with the value and the derivative of the next kick: those at the last position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion<const N: usize> {
    pub(super) q: Sum<N>,
    pub(super) p: Sum<N>,
    pub(super) z: Sum<1>,
    pub(super) force: SVector<f64, N>,
    pub(super) value: f64,
    /// `sigma_d` of the last step.
    pub(super) sigma: f64,
}

impl<const N: usize> Motion<N> {
    pub(super) fn new(state: PhasePoint<N>, (value, force): (f64, SVector<f64, N>)) -> Self {
        let z = Sum::new(SVector::<f64, 1>::new(state.z));
        Motion { q: Sum::new(state.q), p: Sum::new(state.p), z, force, value, sigma: 1.0 }
    }

    pub(super) fn state(&self) -> PhasePoint<N> {
        PhasePoint { q: self.q.value, p: self.p.value, z: self.z.value[0] }
    }

    /// The flow of `-V` over a time s, with the force that the motion holds.
    #[inline(always)]
    pub(super) fn kick<const ACTION: bool, const COMPENSATED: bool>(&mut self, s: f64) {
        let (value, force) = (self.value, self.force);
        if ACTION {
            self.z.add::<COMPENSATED>(|_, _| s * value);
        }
        self.p.add::<COMPENSATED>(|i, _| s * force[i]);
    }
}

/// The steps between two looks whether the motion is finite.
const CHUNK: usize = 256;

/// How far a run has come.
#[derive(Clone, Debug)]
pub(super) struct Progress<const N: usize> {
    pub(super) h: f64,
    pub(super) t0: f64,
    pub(super) taken: usize,
    /// The forces of a step.
    pub(super) forces: usize,
    pub(super) motion: Motion<N>,
    /// The state after the steps taken: that of the motion, completed where the next step has a part of the last.
    pub(super) state: PhasePoint<N>,
}

impl<const N: usize> Progress<N> {
    /// The time after so many steps more.
    #[inline(always)]
    pub(super) fn time_after(&self, steps: usize) -> f64 {
        self.t0 + (self.taken + steps) as f64 * self.h
    }

    /// The forces evaluated so far: those of the steps, and the first.
    pub(super) fn evaluations(&self) -> u64 {
        (self.taken * self.forces) as u64 + 1
    }

    /// Takes steps in chunks; in one that ends with what is not finite, step by step up to the last that is.
    pub(super) fn advance(
        &mut self,
        steps: usize,
        after: impl Fn(&Self, usize) -> (Motion<N>, PhasePoint<N>),
    ) -> Result<(), Halt> {
        let (mut taken, mut longest) = (0, CHUNK);
        while taken < steps {
            let chunk = longest.min(steps - taken);
            let (motion, state) = after(self, chunk);
            // What is not finite in the motion is not finite in its end, or in the next.
            if Triple::from(state).is_finite() && motion.sigma.is_finite() {
                (self.motion, self.state) = (motion, state);
                self.taken += chunk;
                taken += chunk;
            } else if chunk > 1 {
                longest = 1;
            } else {
                return Err(Halt { taken, cause: StepError::NonFinite });
            }
        }
        Ok(())
    }
}
