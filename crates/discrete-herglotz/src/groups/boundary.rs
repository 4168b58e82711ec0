//! Motions between two configurations of a group, by shooting.

use super::derivatives::{after_steps, check, lifted};
use super::{GroupIntegrator, GroupState};
use contact_geom::Scalar;
use contact_geom::groups::{GroupError, LieGroup};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::MaxAbsOrNan;
use contact_geom::support::linear::solve;

/// The bound on the iterations: Newton's method needs less than ten near a solution.
const MAX_ITERATIONS: u32 = 50;

/// The residual at which the search ends, in units of round-off of the size of a chart.
const ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// The largest number of halvings of a correction that does not decrease the residual.
const MAX_HALVINGS: u32 = 20;

/// The two ends of a motion on a group: a number of steps from `g0` with the action `z0` at the time `t0` to `g1`.
///
/// ```
/// use contact_geom::groups::{Inertia, LieGroup, RigidBody, Rotation, Rotations, UniformGravity};
/// use contact_geom::nalgebra::SVector;
/// use discrete_herglotz::groups::{GroupEnds, GroupGauss};
/// let gravity = UniformGravity { weight: [0.0, 0.0, -1.0], centre: [0.1, 0.0, 0.2] };
/// let body = RigidBody::rotating(&Inertia::principal([1.0, 2.0, 2.5])?, gravity, -0.1)?;
/// let turned = Rotation::from_quaternion([0.6, 0.0, 0.8, 0.0])?; // an attitude to be reached after 2 time units
/// let ends = GroupEnds::<Rotations, 3> { t0: 0.0, g0: Rotations::identity(), g1: turned, z0: 0.0, steps: 40 };
/// let guess = body.momentum(&SVector::from([0.0, 0.9, 0.0]));
/// let motion = ends.search(&GroupGauss::new(&body, 3, 0.05)?, &guess)?;
/// println!("start with Pi = {:?}", motion.start.momentum);
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Debug)]
pub struct GroupEnds<G: LieGroup<N>, const N: usize> {
    /// The initial time.
    pub t0: f64,
    /// The initial configuration.
    pub g0: G::Element<f64>,
    /// The final configuration.
    pub g1: G::Element<f64>,
    /// The initial action.
    pub z0: f64,
    /// The number of steps.
    pub steps: usize,
}

/// A motion between two configurations.
#[derive(Debug)]
pub struct MotionBetween<G: LieGroup<N>, const N: usize> {
    /// The state at the start.
    pub start: GroupState<G, N>,
    /// The state at the end, whose configuration is that which is given, up to the residual.
    pub end: GroupState<G, N>,
    /// The largest component of `log(g1^-1 g)` for the configuration g at the end.
    pub residual: f64,
    /// The number of corrections.
    pub iterations: u32,
}

impl<G: LieGroup<N>, const N: usize> GroupEnds<G, N> {
    /// The body momentum at the start of a motion that ends at `g1`, near a guess: Newton's method for
    /// `log(g1^-1 g(Pi)) = 0`, with the derivatives of the discrete motion. Corrections that do not decrease the residual
    /// are halved. There may be other motions, with more turns.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`] for ends or a guess that are not; [`GroupError::Singular`] where the end does not depend
    /// on the momentum, as at conjugate points; [`GroupError::NoMotionBetween`] where no correction decreases the residual;
    /// those of the steps.
    pub fn search(
        &self,
        integrator: &impl GroupIntegrator<G, N>,
        guess: &SVector<f64, N>,
    ) -> Result<MotionBetween<G, N>, GroupError> {
        let state = |momentum: SVector<f64, N>| GroupState { g: self.g0, momentum, z: self.z0 };
        check(self.t0, &state(*guess))?;
        G::check(&self.g1)?;
        let mut momentum = *guess;
        let mut motion = self.end_of(integrator, &state(momentum))?;
        for iterations in 0..MAX_ITERATIONS {
            let residual = motion.1;
            if residual.max_abs_or_nan() <= ROUND_OFF {
                return Ok(self.found(state(momentum), motion, iterations));
            }
            let slopes = self.end_of(integrator, &lifted(&state(momentum), true))?.1;
            let mut matrix = SMatrix::<f64, N, N>::from_fn(|i, j| slopes[i].d.y[j]);
            let mut correction = residual;
            solve(&mut matrix, &mut correction).map_err(|e| GroupError::Singular { pivot: e.pivot })?;
            let mut scale = 1.0;
            let shorter = (0..MAX_HALVINGS).find_map(|_| {
                let next = momentum - correction * scale;
                scale *= 0.5;
                let motion = self.end_of(integrator, &state(next)).ok()?;
                (motion.1.norm() < residual.norm()).then_some((next, motion))
            });
            match shorter {
                Some(better) => (momentum, motion) = better,
                // The residual is round-off of a motion of many steps.
                None if residual.max_abs_or_nan() <= ROUND_OFF * self.steps as f64 => {
                    return Ok(self.found(state(momentum), motion, iterations));
                }
                None => return Err(GroupError::NoMotionBetween { residual: residual.max_abs_or_nan(), iterations }),
            }
        }
        let residual = motion.1.max_abs_or_nan();
        Err(GroupError::NoMotionBetween { residual, iterations: MAX_ITERATIONS })
    }

    fn found(
        &self,
        start: GroupState<G, N>,
        (end, residual): (GroupState<G, N>, SVector<f64, N>),
        iterations: u32,
    ) -> MotionBetween<G, N> {
        MotionBetween { start, end, residual: residual.max_abs_or_nan(), iterations }
    }

    /// The state after all steps, with `log(g1^-1 g)`.
    fn end_of<T: Scalar>(
        &self,
        integrator: &impl GroupIntegrator<G, N>,
        start: &GroupState<G, N, T>,
    ) -> Result<(GroupState<G, N, T>, SVector<T, N>), GroupError> {
        let h = integrator.step_size();
        let real = GroupState { g: self.g0, momentum: start.momentum.map(|p| p.re()), z: self.z0 };
        let velocity = integrator.velocity(self.t0, &real)?;
        let ends = after_steps(*start, velocity, (h, self.t0), &[(self.steps, 0.0)], |(h, t), state, velocity| {
            integrator.step_by(h, t, state, velocity)
        })?;
        let state = ends.first().map_or(*start, |(state, _)| *state);
        let apart = G::log(&G::compose(&G::inverse(&G::lift(&self.g1, T::from)), &state.g));
        if !apart.iter().all(|x| x.re().is_finite()) {
            let what = "the distance from the final configuration";
            return Err(GroupError::NonFinite { what, value: f64::NAN });
        }
        Ok((state, apart))
    }
}
