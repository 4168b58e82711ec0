//! Derivatives of runs: tangents, forward, and gradients, by the adjoint.
//!
//! A step of contact Gauss collocation is a Runge-Kutta step on the symplectification, with the coordinates
//! `y = (q, z, P, rho)`, `P = rho p`, and the motion `q' = V`, `z' = L`, `P' = rho (L_q + f)`, `rho' = -rho L_z`, where
//! `rho L_v(q, V, z) = P`. Its tangent is the same method for the linearised motion, at the same stages. The adjoint of a
//! symplectic map is the tangent of its inverse: a covector `(l_q, l_z, l_P, l_rho)` is carried back as the tangent
//! `w = (l_P, -l_rho, -l_q, l_z)` of the step backward at the same stages, and the derivative in a parameter theta is
//! `h sum_i b_i d(rho L_theta)[w_i]` summed over the steps. It is the exact gradient of the discrete run. See section 10
//! of `docs/theory.md`.
//!
//! Splittings, quadrature rules and their compositions are differentiated sub-flow by sub-flow, and steps under constraints
//! on positions by dual numbers, along the state and along variations of L. [Lyapunov
//! exponents](crate::Run::lyapunov_exponents) are the growth rates of the tangent. An [`Ensemble`](crate::Ensemble) has the
//! gradients of all its members.

mod carried_columns;
mod columns;
mod corner_derivatives;
mod end_state;
mod engine;
mod ensemble;
mod error;
mod event_time;
pub(crate) mod flows;
mod gradient;
mod gradient_parts;
mod kept_states;
mod linear_stages;
mod lyapunov;
mod of_parametric;
mod of_slices;
mod of_system;
pub(crate) mod parameter_derivatives;
mod parametric_system;
mod projected_start;
mod row_times;
mod stage_derivatives;
mod stage_kernel;
mod stage_matrix;
mod step_maps;
pub(crate) mod step_tangent;
mod stretching;
mod switch;
mod tangent;
mod tangent_parts;
mod time_jumps;
mod variable;
mod velocity_dependence;

pub use crate::integration::{PartEnd, Passage, SolvedPart, SolvedStages};
pub use end_state::{EndCovector, EndState, Loss, MotionState};
pub use ensemble::BatchGradient;
pub use error::SensitivityError;
pub use event_time::EventTime;
pub use gradient::{Gradient, LossGradient, RecordedRun};
pub use lyapunov::LyapunovExponents;
pub use parametric_system::{Differentiable, DifferentiableProblem};
pub use tangent::{StateDerivative, SwitchTime, Tangent, TangentRow};
pub use variable::Variable;
