//! States on T\*G x R, and steps.

use contact_geom::Scalar;
use contact_geom::groups::{GroupError, LieGroup};
use contact_geom::nalgebra::SVector;

/// A point `(g, Pi, z)` of T\*G x R, with the body momentum Pi.
#[derive(Debug)]
pub struct GroupState<G: LieGroup<N>, const N: usize, T: Scalar = f64> {
    /// The configuration.
    pub g: G::Element<T>,
    /// The body momentum `Pi = l_xi`.
    pub momentum: SVector<T, N>,
    /// The action.
    pub z: T,
}

// Derived implementations would require those of G, which has no values.
impl<G: LieGroup<N>, const N: usize, T: Scalar> Clone for GroupState<G, N, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<G: LieGroup<N>, const N: usize, T: Scalar> Copy for GroupState<G, N, T> {}

impl<G: LieGroup<N>, const N: usize, T: Scalar> PartialEq for GroupState<G, N, T> {
    fn eq(&self, other: &Self) -> bool {
        self.g == other.g && self.momentum == other.momentum && self.z == other.z
    }
}

impl<G: LieGroup<N>, const N: usize, T: Scalar> GroupState<G, N, T> {
    /// The spatial momentum `Ad_(g^-1)^T Pi`.
    pub fn spatial_momentum(&self) -> SVector<T, N> {
        G::coadjoint(&G::inverse(&self.g), &self.momentum)
    }

    /// The state after a step.
    pub fn after(&self, step: &GroupStep<N, T>) -> Self {
        let f = G::exp(&step.increment);
        let momentum = self.momentum + self.momentum * step.sigma_minus_one + step.impulse;
        GroupState { g: G::compose(&self.g, &f), momentum: G::coadjoint(&f, &momentum), z: self.z + step.action }
    }
}

impl<G: LieGroup<N>, const N: usize> GroupState<G, N> {
    /// Checks that the state is finite and its configuration is an element of the group.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`], [`GroupError::NonUnitQuaternion`].
    pub fn check(&self) -> Result<(), GroupError> {
        G::check(&self.g)?;
        if let Some(&value) = self.momentum.iter().find(|x| !x.is_finite()) {
            return Err(GroupError::NonFinite { what: "an entry of the momentum", value });
        }
        if self.z.is_finite() { Ok(()) } else { Err(GroupError::NonFinite { what: "the action z", value: self.z }) }
    }
}

/// What a step does to a state: `g1 = g0 exp(increment)`, `Pi1 = Ad_f^T (sigma_d Pi0 + impulse)` with
/// `f = exp(increment)`, `z1 = z0 + action`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupStep<const N: usize, T = f64> {
    /// `xi1 = log(g0^-1 g1)`.
    pub increment: SVector<T, N>,
    /// The impulse `d_c S` of the forces, at g0 in the body; 0 if the Lagrangian is left-invariant.
    pub impulse: SVector<T, N>,
    /// `sigma_d - 1`.
    pub sigma_minus_one: T,
    /// `z1 - z0`, the value of the discrete Lagrangian.
    pub action: T,
    /// The body velocity at the end of the step, by extrapolation.
    pub velocity: SVector<T, N>,
}

impl<const N: usize, T: Scalar> GroupStep<N, T> {
    /// This step and the next one as one step; its increment must be in the chart.
    pub(super) fn followed_by<G: LieGroup<N>>(&self, next: &Self) -> Self {
        let [f, g] = [self, next].map(|step| G::exp(&step.increment));
        // The second impulse acts in the body after the first step.
        let second = G::coadjoint(&G::inverse(&f), &next.impulse);
        let (first, factor) = (self.sigma_minus_one, next.sigma_minus_one);
        GroupStep {
            increment: G::log(&G::compose(&f, &g)),
            impulse: self.impulse + self.impulse * factor + second,
            sigma_minus_one: first + factor + first * factor,
            action: self.action + next.action,
            velocity: next.velocity,
        }
    }
}

/// An integrator of a Lagrangian on a Lie group, with a step of its own.
pub trait GroupIntegrator<G: LieGroup<N>, const N: usize> {
    /// The step h.
    fn step_size(&self) -> f64;

    /// A step of any length `h` from a state at time t: that of [`step_size`](Self::step_size), or a shorter one to a
    /// time between two steps. The velocity is a guess of the body velocity at t, which an explicit method does not
    /// use.
    ///
    /// # Errors
    /// Those of the method.
    fn step_by<T: Scalar>(
        &self,
        h: f64,
        t: f64,
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError>;

    /// A step of the length [`step_size`](Self::step_size).
    ///
    /// # Errors
    /// Those of the method.
    fn step<T: Scalar>(
        &self,
        t: f64,
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        self.step_by(self.step_size(), t, from, velocity)
    }

    /// A guess of the body velocity at a state.
    ///
    /// # Errors
    /// [`GroupError::Singular`], [`GroupError::NotConverged`] where the momentum belongs to no velocity.
    fn velocity(&self, t: f64, from: &GroupState<G, N>) -> Result<SVector<f64, N>, GroupError>;
}

/// An integrator whose steps are known for other values of the parameters of its Lagrangian.
pub trait ParametricGroupIntegrator<G: LieGroup<N>, const N: usize>: GroupIntegrator<G, N> {
    /// The values of the parameters.
    fn parameters(&self) -> Vec<f64>;

    /// A step of the length h from a state at the time t, for other values of the parameters; see
    /// [`step_by`](GroupIntegrator::step_by).
    ///
    /// # Errors
    /// Those of the method.
    fn step_at<T: Scalar>(
        &self,
        theta: &[T],
        step: (f64, f64),
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError>;
}
