//! Motions on Lie groups at any time.

use super::derivatives::check;
use super::{GroupIntegrator, GroupMotion, GroupState};
use contact_geom::groups::{GroupError, LieGroup};
use contact_geom::nalgebra::SVector;

/// A motion with its states at all steps, from which the state at any time is computed by one shorter step of the same
/// integrator: it has the order of the integrator, and is conformally contact between the steps too.
///
/// ```
/// use contact_geom::groups::{Inertia, LieGroup, NoPotential, RigidBody, Rotations};
/// use contact_geom::nalgebra::SVector;
/// use discrete_herglotz::groups::{DenseGroupMotion, GroupGauss, GroupState};
/// let body = RigidBody::rotating(&Inertia::principal([1.0, 2.0, 3.0])?, NoPotential, -0.1)?;
/// let start = GroupState { g: Rotations::identity(), momentum: SVector::from([1.0, 1.0, 1.0]), z: 0.0 };
/// let gauss = GroupGauss::new::<Rotations, 3>(&body, 4, 0.5)?;
/// let motion = DenseGroupMotion::<_, Rotations, 3>::new(gauss, 0.0, &start, 20)?;
/// println!("{:?}", motion.at(3.21)?.momentum);
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DenseGroupMotion<I, G: LieGroup<N>, const N: usize> {
    integrator: I,
    t0: f64,
    /// The states at the steps with the body velocities, from which iterations start.
    knots: Vec<(GroupState<G, N>, SVector<f64, N>)>,
}

impl<I: GroupIntegrator<G, N>, G: LieGroup<N>, const N: usize> DenseGroupMotion<I, G, N> {
    /// The motion of a number of steps from a start.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`], [`GroupError::NonUnitQuaternion`] for the start; those of the steps.
    pub fn new(integrator: I, t0: f64, start: &GroupState<G, N>, steps: usize) -> Result<Self, GroupError> {
        check(t0, start)?;
        let mut motion = GroupMotion::new(t0, *start)?;
        let mut knots = vec![(*start, integrator.velocity(t0, start)?)];
        for _ in 0..steps {
            motion.advance(&integrator, 1)?;
            let state = motion.state();
            let velocity = match motion.last_velocity() {
                Some(velocity) => velocity,
                None => integrator.velocity(motion.t(), &state)?,
            };
            knots.push((state, velocity));
        }
        Ok(DenseGroupMotion { integrator, t0, knots })
    }

    /// The first and the last time.
    pub fn span(&self) -> [f64; 2] {
        [self.t0, self.time(self.knots.len() - 1)]
    }

    /// The state at a time of the [span](Self::span).
    ///
    /// # Errors
    /// [`GroupError::OutsideSpan`]; those of a step.
    pub fn at(&self, t: f64) -> Result<GroupState<G, N>, GroupError> {
        let (h, last) = (self.integrator.step_size(), self.knots.len() - 1);
        let [from, to] = self.span();
        let part = (t - self.t0) / h;
        // Times that differ from an end by round-off are that end.
        let rounding = 4.0 * f64::EPSILON * (from.abs() + to.abs()) / h.abs();
        // Not true of a NaN.
        let is_within = part >= -rounding && part <= last as f64 + rounding;
        let k = (part.max(0.0) as usize).min(last);
        let (Some((state, velocity)), true) = (self.knots.get(k), is_within) else {
            return Err(GroupError::OutsideSpan { t, from, to });
        };
        let rest = t - self.time(k);
        // Round-off of the time is no step.
        if rest.abs() <= rounding * h.abs() {
            return Ok(*state);
        }
        Ok(state.after(&self.integrator.step_by(rest, self.time(k), state, velocity)?))
    }

    fn time(&self, k: usize) -> f64 {
        self.t0 + k as f64 * self.integrator.step_size()
    }
}
