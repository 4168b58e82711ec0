//! The progress of a run of contact maps: the state by compensated sums, the number of steps, the last factor.

use super::ContactIncrement;
use crate::numbers::compensated::{CompensatedSum, Unevaluated};
use crate::numbers::state_words::saved;
use crate::{InputError, StepError, StepFailure};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::max_abs_or_nan;

/// A state by compensated sums, with the product of the factors of the maps in a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct StateSums<const N: usize> {
    q: [CompensatedSum; N],
    p: [CompensatedSum; N],
    z: CompensatedSum,
    sigma: f64,
}

impl<const N: usize> StateSums<N> {
    fn new(x: &PhasePoint<N>) -> Self {
        let sums = |v: &SVector<f64, N>| std::array::from_fn(|i| CompensatedSum::from(v[i]));
        StateSums { q: sums(&x.q), p: sums(&x.p), z: x.z.into(), sigma: 1.0 }
    }

    pub fn state(&self) -> PhasePoint<N> {
        let vector = |sums: &[CompensatedSum; N]| SVector::from_fn(|i, _| sums[i].value);
        PhasePoint { q: vector(&self.q), p: vector(&self.p), z: self.z.value }
    }

    #[inline]
    pub fn add(&mut self, change: &ContactIncrement<N>) {
        let plain = |head: f64| Unevaluated { head, tail: 0.0 };
        for i in 0..N {
            self.q[i].add(plain(change.q[i]));
            self.p[i].add(plain(change.p[i]));
        }
        self.z.add(plain(change.z));
        self.sigma += self.sigma * change.sigma_minus_one;
    }
}

/// A run of steps of length h from the time t0.
#[derive(Clone, Debug)]
pub(super) struct Progress<const N: usize> {
    pub h: f64,
    pub t0: f64,
    taken: u64,
    sums: StateSums<N>,
    pub evaluations: u64,
}

impl<const N: usize> Progress<N> {
    pub fn new(h: f64, t0: f64, x: &PhasePoint<N>) -> Result<Self, InputError> {
        if N == 0 {
            return Err(InputError::Dimension);
        }
        if !(h.is_finite() && h != 0.0) {
            return Err(InputError::Step { h });
        }
        crate::integration::problem::check_time(t0)?;
        x.check()?;
        Ok(Progress { h, t0, taken: 0, sums: StateSums::new(x), evaluations: 0 })
    }

    pub fn state(&self) -> PhasePoint<N> {
        self.sums.state()
    }

    pub fn time(&self) -> f64 {
        self.t0 + self.taken as f64 * self.h
    }

    /// The factor of the last step, 1 before the first.
    pub fn sigma(&self) -> f64 {
        self.sums.sigma
    }

    /// Takes steps by a function of the time at the start that adds the increments of a step. A step whose result is
    /// not finite, or whose factor is not positive, fails and leaves the state before it.
    pub fn advance(
        &mut self,
        steps: usize,
        mut step: impl FnMut(f64, &mut StateSums<N>, &mut u64) -> Result<(), StepError>,
    ) -> Result<(), StepFailure> {
        for taken in 0..steps {
            let mut sums = StateSums { sigma: 1.0, ..self.sums };
            let result = step(self.time(), &mut sums, &mut self.evaluations).and_then(|()| checked(&sums));
            result.map_err(|cause| StepFailure { taken, cause })?;
            self.sums = sums;
            self.taken += 1;
        }
        Ok(())
    }
}

fn checked<const N: usize>(sums: &StateSums<N>) -> Result<(), StepError> {
    let x = sums.state();
    let size = max_abs_or_nan(x.q.iter().chain(x.p.iter()).copied().chain([x.z, sums.sigma]));
    if !size.is_finite() {
        return Err(StepError::NonFinite);
    }
    if sums.sigma <= 0.0 {
        return Err(StepError::SigmaVanished { sigma: sums.sigma });
    }
    Ok(())
}

saved!([const N: usize] StateSums<N> { q, p, z, sigma });
saved!([const N: usize] Progress<N> { taken, sums, evaluations });
