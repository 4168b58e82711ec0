//! Motions on a Lie group.

use super::{GroupIntegrator, GroupState};
use contact_geom::groups::{GroupError, LieGroup, Rotation, Rotations};
use contact_geom::nalgebra::SVector;

/// A motion that is advanced by steps. Configuration, spatial momentum and action are summed with compensation, so that
/// the round-off of many steps does not add up: what a symmetry keeps in a step, it keeps over a run.
///
/// The momentum is carried in space, `mu = Ad_(g^-1)^T Pi`; a step replaces it by `sigma_d mu` and the spatial impulse.
#[derive(Debug)]
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

// A derived implementation would require one of G, which has no values.
impl<G: LieGroup<N>, const N: usize> Clone for GroupMotion<G, N> {
    fn clone(&self) -> Self {
        GroupMotion {
            t0: self.t0,
            t: self.t,
            start: self.start,
            count: self.count,
            h: self.h,
            g: self.g,
            g_rest: self.g_rest,
            spatial: self.spatial,
            spatial_rest: self.spatial_rest,
            z: self.z,
            log_factor: self.log_factor,
            velocity: self.velocity,
        }
    }
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
        for _ in 0..steps {
            self.advance_by(integrator, integrator.step_size())?;
        }
        Ok(())
    }

    /// Takes one step of any length, such as a shorter one to the time of an event. After a failure the motion is
    /// unchanged.
    ///
    /// # Errors
    /// [`GroupError::Step`], and those of the step.
    pub fn advance_by(&mut self, integrator: &impl GroupIntegrator<G, N>, h: f64) -> Result<(), GroupError> {
        if !(h.is_finite() && h != 0.0) {
            return Err(GroupError::Step { h });
        }
        let from = self.state();
        let guess = match self.velocity {
            Some(velocity) => velocity,
            None => integrator.velocity(self.t, &from)?,
        };
        let step = integrator.step_by(h, self.t, &from, &guess)?;
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
        if h != self.h {
            (self.h, self.start, self.count) = (h, self.t, 0);
        }
        self.count += 1;
        self.t = self.start + self.count as f64 * h;
        Ok(())
    }

    /// Changes each component of the momentum, in space and in the body, by half a unit in its last place up or down, as other
    /// roundings would; the signs are those of random numbers (Marsaglia, Xorshift RNGs, 2003). A component that is 0 has no
    /// rounding.
    pub(super) fn round_otherwise(&mut self, random: &mut u64) {
        let mut rounded = |x: f64| {
            *random ^= *random << 13;
            *random ^= *random >> 7;
            *random ^= *random << 17;
            if *random >> 63 == 0 { 0.5 * f64::EPSILON * x } else { -0.5 * f64::EPSILON * x }
        };
        let in_space = self.spatial.map(&mut rounded);
        let in_body = G::coadjoint(&self.g, &self.spatial).map(&mut rounded);
        self.spatial += in_space + G::coadjoint(&G::inverse(&self.g), &in_body);
    }

    /// The body velocity at the present time as the last step extrapolates it; `None` before the first step.
    pub(super) fn last_velocity(&self) -> Option<SVector<f64, N>> {
        self.velocity
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

/// The number of numbers of a saved motion on SO(3).
const SAVED: usize = 26;

impl GroupMotion<Rotations, 3> {
    /// The motion as numbers, from which [`restore`](Self::restore) continues it to the last bit.
    pub fn save(&self) -> [f64; SAVED] {
        let mut numbers = [0.0; SAVED];
        let [g, g_rest] = [self.g, self.g_rest].map(|g| g.quaternion());
        // Exact for up to 2^53 steps.
        let times = [self.t0, self.t, self.start, self.count as f64, self.h];
        // NaN before the first step.
        let velocity = self.velocity.unwrap_or(SVector::from([f64::NAN; 3]));
        let all = times
            .iter()
            .chain(&g)
            .chain(&g_rest)
            .chain(&self.spatial)
            .chain(&self.spatial_rest)
            .chain(&self.z)
            .chain(&self.log_factor)
            .chain(&velocity);
        for (to, x) in numbers.iter_mut().zip(all) {
            *to = *x;
        }
        numbers
    }

    /// The motion that was saved.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`], [`GroupError::NonUnitQuaternion`] for other numbers than those of a motion.
    pub fn restore(numbers: &[f64; SAVED]) -> Result<Self, GroupError> {
        let mut all = numbers.iter().copied();
        let mut next = || all.next().unwrap_or(f64::NAN);
        let [t0, t, start, count, h] = std::array::from_fn(|_| next());
        let mut rotation = || Rotation { w: next(), u: SVector::from(std::array::from_fn(|_| next())) };
        let (g, g_rest) = (rotation(), rotation());
        let mut vector = || SVector::from(std::array::from_fn(|_| next()));
        let (spatial, spatial_rest): (SVector<f64, 3>, SVector<f64, 3>) = (vector(), vector());
        let z = std::array::from_fn(|_| next());
        let log_factor = std::array::from_fn(|_| next());
        let velocity: SVector<f64, 3> = SVector::from(std::array::from_fn(|_| next()));
        // The velocity is not known before the first step.
        let known = numbers.len() - 3;
        if let Some(&value) = numbers.iter().take(known).find(|x| !x.is_finite()) {
            return Err(GroupError::NonFinite { what: "a number of a saved motion", value });
        }
        Rotations::check(&g)?;
        // The rest of a sum is far below it.
        Rotations::check(&Rotation { w: g.w + g_rest.w, u: g.u + g_rest.u })?;
        let velocity = velocity.iter().all(|x| x.is_finite()).then_some(velocity);
        let count = count as u64;
        Ok(GroupMotion { t0, t, start, count, h, g, g_rest, spatial, spatial_rest, z, log_factor, velocity })
    }
}
