//! The integrators of rigid bodies.

use super::BodyTorque;
use super::interruptible::Interruptible;
use crate::{Interrupt, RuntimeError};
use contact_geom::groups::{GroupError, GroupForced, RigidBody, Rotations, UniformGravity};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Scalar};
use discrete_herglotz::groups::{GroupBreaks, GroupGauss, GroupIntegrator, GroupState, GroupStep, RigidBodySplitting};
use discrete_herglotz::rules::Method;
use discrete_herglotz::{AnyIntegrator, SplittingScheme};

/// The integrator where only an accuracy is given: explicit, of order 10, for any moments of inertia.
const DEFAULT: AnyIntegrator = AnyIntegrator::Splitting(SplittingScheme::SOFRONIOU_SPALETTA_10);

/// The integrator of a body with a torque where only an accuracy is given.
const DEFAULT_FORCED: AnyIntegrator = AnyIntegrator::Gauss { stages: 5 };

/// The body with its torque.
pub(super) type ForcedBody = GroupForced<RigidBody<UniformGravity, 3>, Option<BodyTorque>>;

/// Gauss collocation or a splitting of a rigid body, as one type, for which runs are compiled once. Its steps end at the
/// named times of the torque, and fail once an interrupt is requested.
pub(super) type BodyIntegrator = GroupBreaks<Interruptible<BodyMethod>>;

/// Gauss collocation or a splitting of a rigid body.
#[expect(clippy::large_enum_variant, reason = "a run has one")]
pub(super) enum BodyMethod {
    Gauss(GroupGauss<ForcedBody>),
    Splitting(RigidBodySplitting<UniformGravity>),
}

/// The method with steps that end at the named times of the torque, and fail once an interrupt is requested.
pub(super) fn with_ends<I>(
    method: I,
    body: &ForcedBody,
    interrupt: Option<&Interrupt>,
) -> Result<GroupBreaks<Interruptible<I>>, GroupError> {
    let times = body.force.as_ref().map_or(Vec::new(), |torque| torque.breaks().to_vec());
    GroupBreaks::new(Interruptible::new(method, interrupt), times)
}

impl BodyMethod {
    /// The integrator of this name with the step h.
    pub fn integrator(
        body: &ForcedBody,
        by: AnyIntegrator,
        h: f64,
        interrupt: Option<&Interrupt>,
    ) -> Result<BodyIntegrator, GroupError> {
        let split = |scheme| RigidBodySplitting::new(body.lagrangian, scheme, h).map(BodyMethod::Splitting);
        let method = match by {
            AnyIntegrator::Gauss { stages } => {
                GroupGauss::new::<Rotations, 3>(body.clone(), stages, h).map(BodyMethod::Gauss)
            }
            AnyIntegrator::Splitting(scheme) => split(scheme),
            _ => split(SplittingScheme::STRANG),
        };
        with_ends(method?, body, interrupt)
    }

    /// The integrator of a body for an accuracy, where none is named.
    pub fn default_for(is_forced: bool) -> AnyIntegrator {
        if is_forced { DEFAULT_FORCED } else { DEFAULT }
    }

    /// The virtual work of the torque in a step; `None` for a splitting, which takes no torque.
    pub fn virtual_work(&self, t: f64, from: &GroupState<Rotations, 3>) -> Option<Result<ChartVector<3>, GroupError>> {
        match self {
            BodyMethod::Gauss(gauss) => Some(gauss.virtual_work(t, from)),
            BodyMethod::Splitting(_) => None,
        }
    }

    /// Refuses integrators that rigid bodies do not have, and splittings of a body with a torque.
    pub fn check(by: AnyIntegrator, is_forced: bool) -> Result<(), RuntimeError> {
        match by {
            AnyIntegrator::Splitting(_) | AnyIntegrator::Discrete(Method::Strang) if is_forced => {
                Err(RuntimeError::argument(
                    "integrator",
                    format!(
                        "is \"{by}\", a splitting, which takes no torque; a body with a torque is integrated by a \
                         Gauss method such as \"gauss_5\""
                    ),
                ))
            }
            AnyIntegrator::Gauss { .. } | AnyIntegrator::Splitting(_) | AnyIntegrator::Discrete(Method::Strang) => {
                Ok(())
            }
            other => {
                let splitting = if is_forced { "" } else { " or by a splitting such as \"sofroniou_spaletta_10\"" };
                let why = format!(
                    "is \"{other}\", but this rigid body is integrated by a Gauss method such as \"gauss_4\"{splitting}"
                );
                Err(RuntimeError::argument("integrator", why))
            }
        }
    }
}

impl GroupIntegrator<Rotations, 3> for BodyMethod {
    fn step_size(&self) -> f64 {
        match self {
            BodyMethod::Gauss(gauss) => GroupIntegrator::<Rotations, 3>::step_size(gauss),
            BodyMethod::Splitting(splitting) => splitting.step_size(),
        }
    }

    fn step_by<T: Scalar>(
        &self,
        h: f64,
        t: f64,
        from: &GroupState<Rotations, 3, T>,
        velocity: &SVector<T, 3>,
    ) -> Result<GroupStep<3, T>, GroupError> {
        match self {
            BodyMethod::Gauss(gauss) => gauss.step_by(h, t, from, velocity),
            BodyMethod::Splitting(splitting) => splitting.step_by(h, t, from, velocity),
        }
    }

    fn velocity(&self, t: f64, from: &GroupState<Rotations, 3>) -> Result<SVector<f64, 3>, GroupError> {
        match self {
            BodyMethod::Gauss(gauss) => gauss.velocity(t, from),
            BodyMethod::Splitting(splitting) => splitting.velocity(t, from),
        }
    }
}
