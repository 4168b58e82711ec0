//! Steps that are compositions of contact maps: the state by compensated sums, the number of steps, the last factor.

use super::ContactIncrement;
use crate::numbers::array::from_fn;
use crate::numbers::compensated::{CompensatedSum, Unevaluated};
use crate::numbers::state_words::{Saved, saved};
use crate::{InputError, PlanEntry, RunSupport, State, StepError, StepFailure, Stepper};
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
        let sums = |v: &SVector<f64, N>| from_fn(|i| CompensatedSum::from(v[i]));
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

/// The contact maps of which a step consists.
pub(super) trait ContactMaps<const N: usize> {
    /// Adds the increments of the maps of one step of length h from the time t, and counts the evaluations.
    fn add_step(&self, t: f64, h: f64, sums: &mut StateSums<N>, evaluations: &mut u64) -> Result<(), StepError>;

    /// Why Newton's method is needed or not, and how the action is found.
    fn work_summary(&self) -> Vec<PlanEntry>;
}

/// The stepper of a method whose step is a composition of contact maps: [`PieceStepper`](super::PieceStepper), and that
/// of [`ContactEuler`](super::ContactEuler). The state is kept by compensated sums.
#[derive(Clone, Debug)]
pub struct MapStepper<M, const N: usize> {
    pub(super) maps: M,
    h: f64,
    t0: f64,
    taken: u64,
    pub(super) sums: StateSums<N>,
    evaluations: u64,
}

impl<M, const N: usize> MapStepper<M, N> {
    /// Steps of length h from the state x at the time t0.
    pub(super) fn of(maps: M, h: f64, t0: f64, x: &PhasePoint<N>) -> Result<Self, InputError> {
        if N == 0 {
            return Err(InputError::Dimension);
        }
        if !(h.is_finite() && h != 0.0) {
            return Err(InputError::Step { h });
        }
        crate::integration::system_problem::check_time(t0)?;
        x.check()?;
        Ok(MapStepper { maps, h, t0, taken: 0, sums: StateSums::new(x), evaluations: 0 })
    }
}

/// A step whose result is not finite, or whose factor is not positive, fails and leaves the state before it.
impl<M: ContactMaps<N>, const N: usize> Stepper for MapStepper<M, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            let mut sums = StateSums { sigma: 1.0, ..self.sums };
            let added = self.maps.add_step(self.time(), self.h, &mut sums, &mut self.evaluations);
            added.and_then(|()| checked(&sums)).map_err(|cause| StepFailure { taken, cause })?;
            self.sums = sums;
            self.taken += 1;
        }
        Ok(())
    }

    fn state(&self) -> State {
        self.sums.state().into()
    }

    fn time(&self) -> f64 {
        self.t0 + self.taken as f64 * self.h
    }

    fn sigma(&self) -> f64 {
        self.sums.sigma
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn run_support(&self) -> Option<&dyn RunSupport> {
        Some(self)
    }

    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        Some(self)
    }
}

impl<M: ContactMaps<N>, const N: usize> RunSupport for MapStepper<M, N> {
    fn work_summary(&self) -> Vec<PlanEntry> {
        self.maps.work_summary()
    }

    fn save(&self) -> Option<Vec<u64>> {
        let mut words = Vec::new();
        Saved::save(self, &mut words);
        Some(words)
    }

    fn restore(&mut self, mut words: &[u64]) -> bool {
        self.load(&mut words).is_some() && words.is_empty()
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
saved!([M, const N: usize] MapStepper<M, N> { taken, sums, evaluations });
