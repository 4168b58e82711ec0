//! Motions on a Lie group.

use super::{GroupIntegrator, GroupState};
use contact_geom::groups::{GroupError, LieGroup};
use contact_geom::nalgebra::SVector;

/// A motion that is advanced by steps. Configuration, spatial momentum and action are summed with compensation, so that
/// the round-off of many steps does not add up: what a symmetry keeps in a step, it keeps over a run.
///
/// The momentum is carried in space, `mu = Ad_(g^-1)^T Pi`; a step replaces it by `sigma_d mu` and the spatial impulse.
#[derive(Clone, Debug)]
pub struct GroupMotion<G: LieGroup<N>, const N: usize> {
    t0: f64,
    t: f64,
    /// The time is `start + count h` while h is the same.
    start: f64,
    count: u64,
    h: f64,
    g: G::Element<f64>,
    g_rest: G::Element<f64>,
    spatial: SVector<f64, N>,
    spatial_rest: SVector<f64, N>,
    z: [f64; 2],
    log_factor: [f64; 2],
    velocity: Option<SVector<f64, N>>,
}

/// Adds a change to a sum `[value, rest]` with compensation.
fn add(sum: &mut f64, rest: &mut f64, change: f64) {
    let (value, lost) = crate::numbers::compensated::exact_sum(*sum, change + *rest);
    (*sum, *rest) = (value, lost);
}

impl<G: LieGroup<N>, const N: usize> GroupMotion<G, N> {
    /// The motion from a state at time t0.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`], [`GroupError::NonUnitQuaternion`].
    pub fn new(t0: f64, start: GroupState<G, N>) -> Result<Self, GroupError> {
        if !t0.is_finite() {
            return Err(GroupError::NonFinite { what: "the initial time", value: t0 });
        }
        start.check()?;
        Ok(GroupMotion {
            t0,
            t: t0,
            start: t0,
            count: 0,
            h: 0.0,
            g: start.g,
            g_rest: G::null(),
            spatial: start.spatial_momentum(),
            spatial_rest: SVector::zeros(),
            z: [start.z, 0.0],
            log_factor: [0.0; 2],
            velocity: None,
        })
    }

    /// Takes steps. After a failure the motion is at the start of the step that failed.
    ///
    /// # Errors
    /// Those of the step.
    pub fn advance(&mut self, integrator: &impl GroupIntegrator<G, N>, steps: usize) -> Result<(), GroupError> {
        let h = integrator.step_size();
        if h != self.h {
            (self.h, self.start, self.count) = (h, self.t, 0);
        }
        for _ in 0..steps {
            let from = self.state();
            let guess = match self.velocity {
                Some(velocity) => velocity,
                None => integrator.velocity(self.t, &from)?,
            };
            let step = integrator.step(self.t, &from, &guess)?;
            let finite = step.increment.iter().chain(step.impulse.iter()).all(|x| x.is_finite());
            if !(finite && step.action.is_finite() && step.sigma_minus_one.is_finite()) {
                return Err(GroupError::NonFinite { what: "the result of a step", value: f64::NAN });
            }
            let impulse = G::coadjoint(&G::inverse(&self.g), &step.impulse);
            for i in 0..N {
                let scaled = (self.spatial[i] + self.spatial_rest[i]) * step.sigma_minus_one;
                add(&mut self.spatial[i], &mut self.spatial_rest[i], scaled);
                add(&mut self.spatial[i], &mut self.spatial_rest[i], impulse[i]);
            }
            G::advance(&mut self.g, &mut self.g_rest, &step.increment);
            let [z, rest] = &mut self.z;
            add(z, rest, step.action);
            let [factor, rest] = &mut self.log_factor;
            add(factor, rest, step.sigma_minus_one.ln_1p());
            self.velocity = Some(step.velocity);
            self.count += 1;
            self.t = self.start + self.count as f64 * h;
        }
        Ok(())
    }

    /// The time.
    pub fn t(&self) -> f64 {
        self.t
    }

    /// The initial time.
    pub fn initial_time(&self) -> f64 {
        self.t0
    }

    /// The state.
    pub fn state(&self) -> GroupState<G, N> {
        GroupState { g: self.g, momentum: G::coadjoint(&self.g, &self.spatial), z: self.z[0] }
    }

    /// The spatial momentum `Ad_(g^-1)^T Pi`.
    pub fn spatial_momentum(&self) -> &SVector<f64, N> {
        &self.spatial
    }

    /// The logarithm of the conformal factor from the start, `ln(sigma_1 ... sigma_k)`.
    pub fn log_factor(&self) -> f64 {
        self.log_factor[0]
    }
}
