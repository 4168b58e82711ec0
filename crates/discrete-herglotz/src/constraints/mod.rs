//! Motions under constraints: holonomic, `c(q) = 0`, and linear in the velocities, `omega(q) v = 0`.
//!
//! - [`DragRattle`]: RATTLE between two halves of a linear drag, for separable Lagrangians; conformally contact with the
//!   factor `e^(gamma h)`, explicit but for the multipliers, composed to order 10.
//! - [`ContactLobatto`]: the partitioned Lobatto IIIA-IIIB method of order 2s - 2 on the symplectified motion, for any
//!   Lagrangian; conformally contact.
//! - [`Nonholonomic`]: the discrete Lagrange-d'Alembert-Herglotz equations of any symmetric discrete Lagrangian, of
//!   order 2, and their compositions.
//!
//! [`Constrained`] makes an integrator of the first two, and [`LagrangeDAlembert`] of the third, for runs with rows,
//! events, checkpoints and an accuracy.

mod constrained;
mod drag_rattle;
mod lagrange_d_alembert;
mod linear_system;
mod lobatto;
mod lobatto_tables;
mod lobatto_workspace;
mod nonholonomic;
mod start;
mod variation;

pub use crate::error::ConstraintError;
pub use constrained::{Constrained, ConstrainedMethod};
pub use drag_rattle::{DragRattle, RattleStep};
pub use lagrange_d_alembert::LagrangeDAlembert;
pub use lobatto::{ContactLobatto, LobattoStep};
pub use nonholonomic::Nonholonomic;
pub use start::{ConstrainedStart, OffConstraint};

use crate::StepError;

/// The bound on the iterations of a step. Newton's method needs less than ten.
const MAX_ITERATIONS: u32 = 50;

/// The test of an iteration that is continued until its corrections are round-off.
#[derive(Clone, Copy, Debug)]
struct Corrections {
    before: f64,
    taken: u32,
}

/// What a correction shows about an iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    /// It continues.
    Continues,
    /// It continues, but slowly: its matrix is to be evaluated again.
    Slow,
    /// The correction was round-off: it was the last one.
    Ended,
}

impl Corrections {
    fn new() -> Self {
        Corrections { before: f64::INFINITY, taken: 0 }
    }

    /// The progress after a correction of this size of quantities of the given scale.
    fn after(&mut self, size: f64, scale: f64) -> Result<Progress, StepError> {
        self.taken += 1;
        if !(size.is_finite() && scale.is_finite()) {
            return Err(StepError::NonFinite);
        }
        // A correction that stops decreasing below this is the round-off of the equations.
        const SETTLED: f64 = 1e-9;
        if size <= f64::EPSILON * scale || (size >= 0.5 * self.before && size <= SETTLED * scale) {
            return Ok(Progress::Ended);
        }
        if self.taken >= MAX_ITERATIONS {
            return Err(StepError::NotConverged { residual: size, iterations: self.taken });
        }
        let slow = size > 0.1 * self.before;
        self.before = size;
        Ok(if slow { Progress::Slow } else { Progress::Continues })
    }
}

/// The scale of corrections of velocities: `|v|`, at least `1e-4 |q| / h`. Velocities that are computed from positions
/// have their rounding error divided by h, and multiplied by the weights of the stages, up to a hundred: corrections of
/// this scale settle at 1e-13, some hundred units of it.
fn velocity_scale(velocity: f64, position: f64, h: f64) -> f64 {
    velocity.max(1e-4 * position / h.abs()).max(f64::MIN_POSITIVE)
}
