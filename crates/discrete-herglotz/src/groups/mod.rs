//! Integrators on Lie groups: contact Gauss collocation in charts, and splittings of rigid bodies.
//!
//! A state is `(g, Pi, z)` with the body momentum `Pi = l_xi`, a point of T\*G x R with the contact form
//! `eta = dz - Pi . (g^-1 dg)`. The chart `xi -> g0 exp(xi)` of a step defines a discrete Lagrangian
//! `L_d(g0, g1, z0)`; the momentum at the start is its full derivative in g0, the centre of the chart included. The
//! step is therefore conformally contact, `sigma_d Pi0 = Ad_(f^-1)^T Pi1 - d_c S` with `f = g0^-1 g1`, and the momentum
//! of every symmetry scales with `sigma_d`.
//!
//! ```
//! use contact_geom::groups::{Inertia, LieGroup, RigidBody, Rotations, UniformGravity};
//! use contact_geom::nalgebra::SVector;
//! use discrete_herglotz::groups::{GroupGauss, GroupMotion, GroupState};
//! let gravity = UniformGravity { weight: [0.0, 0.0, -9.81], centre: [0.0, 0.5, 0.0] };
//! let body = RigidBody::rotating(&Inertia::principal([1.0, 0.5, 1.0])?, gravity, -0.1)?;
//! let momentum = body.momentum(&SVector::from([0.0, 20.0, -1.0]));
//! let start = GroupState { g: Rotations::identity(), momentum, z: 0.0 };
//! let mut motion = GroupMotion::<Rotations, 3>::new(0.0, start)?;
//! motion.advance(&GroupGauss::new(&body, 4, 0.02)?, 50)?;
//! println!("{:?} at t = {}", motion.state(), motion.t());
//! # Ok::<(), contact_geom::groups::GroupError>(())
//! ```

mod accuracy;
mod boundary;
mod breaks;
mod dense;
mod derivatives;
mod events;
mod gauss;
mod motion;
mod run;
mod splitting;
mod stages;
mod state;

pub use accuracy::{GroupSteps, group_distance, group_steps};
pub use boundary::{GroupEnds, MotionBetween};
pub use breaks::GroupBreaks;
pub use dense::DenseGroupMotion;
pub use derivatives::{GroupDerivatives, StepsAndRest};
pub use events::GroupEvent;
pub use gauss::GroupGauss;
pub use motion::GroupMotion;
pub use run::{GroupObserver, GroupRows, GroupRun, GroupStatus};
pub use splitting::RigidBodySplitting;
pub use state::{GroupIntegrator, GroupState, GroupStep, ParametricGroupIntegrator};
