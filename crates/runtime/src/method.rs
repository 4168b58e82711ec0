//! Discrete Lagrangians that are given by formulas.

use crate::RuntimeError;
use contact_geom::ScalarSystem;
use formula_lagrangian::{Formula, FormulaDerivatives, FormulaError};
use std::borrow::Cow;
use std::sync::Arc;

/// A discrete Lagrangian `L_d(t, q0, q1, z0)` for steps of any length h, given by a formula in which `q0` are the coordinates,
/// `q1` the velocities, `z0` the action, t the time at the start of a step and h a parameter: an integrator of a
/// [`Motion`](crate::Motion).
///
/// ```
/// use herglotz_runtime::{AnyIntegrator, Formula, FormulaMethod, Motion, Start, StepControl, Steps, System};
/// let system = System::parse("x'^2/2 - x^2/2 - z/10", &["x"], &[])?;
/// // The midpoint rule, h L(t, (q0 + q1)/2, (q1 - q0)/h, z0).
/// let text = "h*(((x' - x)/h)^2/2 - ((x + x')/2)^2/2 - z/10)";
/// let method = FormulaMethod::new("mine", 1, &Formula::parse(text, &["x"], &[("h", 1.0)])?, "h")?;
/// let way = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 1 }, steps: Steps::Size(0.1) };
/// let motion = Motion { method: Some(method), ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 10.0, way) };
/// assert_eq!(system.plan(&motion)?.integrator.name, "mine");
/// assert!(system.check(&motion, 5)?.is_contact());
/// # Ok::<(), herglotz_runtime::RuntimeError>(())
/// ```
#[derive(Clone)]
pub struct FormulaMethod {
    pub(crate) name: Cow<'static, str>,
    pub(crate) order: u32,
    pub(crate) symmetric: bool,
    pub(crate) of: Arc<FormulaDerivatives>,
    step: String,
}

impl FormulaMethod {
    /// The discrete Lagrangian of a formula, whose parameter with the name `step` is h, with a name and the order of its flow.
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] where there is no such parameter, and for a formula that is too large;
    /// [`RuntimeError::Argument`] for a Hamiltonian, and for one with forces, resets or constraints.
    pub fn new(
        name: impl Into<Cow<'static, str>>,
        order: u32,
        formula: &Formula,
        step: &str,
    ) -> Result<Self, RuntimeError> {
        let of = formula.derivatives()?;
        if formula.is_hamiltonian() || of.has_force() || formula.resets() > 0 || formula.constraints() > 0 {
            let why = "is a function of t, q0, q1, z0 and h alone; leave out forces, resets and constraints";
            return Err(RuntimeError::argument("method", why));
        }
        let mut found =
            FormulaMethod { name: name.into(), order, symmetric: false, of: Arc::new(of), step: step.to_owned() };
        found.of = found.with_step(1.0)?;
        Ok(found)
    }

    /// The same method, declared to be symmetric: equal to its adjoint.
    pub fn symmetric(self) -> Self {
        FormulaMethod { symmetric: true, ..self }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The order of its flow.
    pub fn order(&self) -> u32 {
        self.order
    }

    /// The number of coordinates.
    pub(crate) fn dimension(&self) -> usize {
        self.of.formula().dimension()
    }

    /// The discrete Lagrangian for steps of one length.
    pub(crate) fn with_step(&self, h: f64) -> Result<Arc<FormulaDerivatives>, FormulaError> {
        let mut of = (*self.of).clone();
        of.set(&self.step, h)?;
        Ok(Arc::new(of))
    }
}

impl std::fmt::Debug for FormulaMethod {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FormulaMethod").field("name", &self.name).field("order", &self.order).finish_non_exhaustive()
    }
}
