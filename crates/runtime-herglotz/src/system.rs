//! Systems by their formula.

use crate::kernel::{Kernel, kernel_of};
use crate::outcome::KeptRows;
use crate::{Check, Geometry, Motion, Outcome, Plan, RunMonitor, RuntimeError, Start};
use contact_geom::Structure;
use discrete_herglotz::{AnyIntegrator, InputError, ResumeState};
use formula_lagrangian::Formula;
use std::sync::Arc;

/// A symmetry that is seen in a formula; its momentum decays as the conformal factor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SeenSymmetry {
    /// Moving these coordinates by one length leaves L as it is.
    Translation(Vec<usize>),
    /// Turning these pairs of coordinates by one angle leaves L as it is.
    Rotation(Vec<(usize, usize)>),
}

/// A Lagrangian by its formula, in 1 to 16 coordinates, with all that integrators need. Cloning is cheap.
///
/// ```
/// use runtime_herglotz::{Motion, Start, System, StepControl};
/// let pendulum = System::parse("theta'^2/2 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)])?;
/// let motion = Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 100.0, StepControl::Accuracy { wanted: 1e-10, by: None });
/// println!("{}", pendulum.plan(&motion)?.text);
/// println!("theta = {}", pendulum.run(&motion, &mut ())?.q[0]);
/// # Ok::<(), runtime_herglotz::RuntimeError>(())
/// ```
#[derive(Clone)]
pub struct System {
    pub(crate) kernel: Arc<dyn Kernel>,
}

impl System {
    /// The system of a formula.
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] where it is too large.
    pub fn new(formula: &Formula) -> Result<Self, RuntimeError> {
        Ok(System { kernel: kernel_of(formula)? })
    }

    /// The same from a text over coordinates and parameters; see [`Formula::parse`].
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] with the place in the text.
    pub fn parse(text: &str, coordinates: &[&str], parameters: &[(&str, f64)]) -> Result<Self, RuntimeError> {
        Self::new(&Formula::parse(text, coordinates, parameters)?)
    }

    /// The same with other values of some parameters; nothing is read or derived anew.
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] where there is no such parameter, or a value is not finite.
    pub fn with_parameters(&self, values: &[(&str, f64)]) -> Result<Self, RuntimeError> {
        Ok(System { kernel: self.kernel.with_parameters(values)? })
    }

    /// The formula, with the present values of its parameters.
    pub fn formula(&self) -> &Formula {
        self.kernel.formula()
    }

    /// The number of coordinates.
    pub fn dimension(&self) -> usize {
        self.formula().dimension()
    }

    /// What is proved of the structure of L.
    pub fn structure(&self) -> Structure {
        self.kernel.structure()
    }

    /// Whether L has neither kinks nor jumps.
    pub fn is_smooth(&self) -> bool {
        self.kernel.is_smooth()
    }

    /// The symmetries that are seen.
    pub fn symmetries(&self) -> Vec<SeenSymmetry> {
        self.kernel.symmetries()
    }

    /// The same Lagrangian as a source file in Rust, for those who outgrow the text; see
    /// [`FormulaLagrangian::to_rust`](formula_lagrangian::FormulaLagrangian::to_rust).
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] where `name` cannot be that of a type.
    pub fn to_rust(&self, name: &str) -> Result<String, RuntimeError> {
        Ok(self.kernel.to_rust(name)?)
    }

    /// Whether the system meets the hypotheses of an integrator.
    ///
    /// # Errors
    /// [`RuntimeError::Input`] with the claim that is missing.
    pub fn check_integrator(&self, integrator: AnyIntegrator) -> Result<(), InputError> {
        self.kernel.check_integrator(integrator)
    }

    /// Checks a motion, chooses its step and route, and says what will be computed and what is skipped.
    ///
    /// # Errors
    /// [`RuntimeError`] for all that is wrong with it.
    pub fn plan(&self, motion: &Motion) -> Result<Plan, RuntimeError> {
        self.kernel.plan(motion)
    }

    /// Runs a motion. What goes wrong on the way is the status of the outcome.
    ///
    /// # Errors
    /// Those of [`plan`](Self::plan).
    pub fn run(&self, motion: &Motion, watch: &mut dyn RunMonitor) -> Result<Outcome, RuntimeError> {
        self.kernel.run(motion, watch, None)
    }

    /// Goes on with a motion where it was interrupted, to the last bit. The events and the rows that follow are seen; of rows at steps the
    /// first is that at which it goes on, of rows at times the first is after it.
    ///
    /// # Errors
    /// Those of [`run`](Self::run); [`InputError::AnotherRun`].
    pub fn resume(
        &self,
        motion: &Motion,
        from: ResumeState,
        watch: &mut dyn RunMonitor,
    ) -> Result<Outcome, RuntimeError> {
        self.kernel.run(motion, watch, Some(from))
    }

    /// Runs a motion and keeps its rows.
    ///
    /// # Errors
    /// Those of [`run`](Self::run).
    pub fn record(&self, motion: &Motion) -> Result<(Outcome, Vec<Vec<f64>>), RuntimeError> {
        let mut kept = KeptRows::default();
        let outcome = self.run(motion, &mut kept)?;
        Ok((outcome, kept.0))
    }

    /// The contact geometry at a time and a point of TQ x R.
    ///
    /// # Errors
    /// [`RuntimeError`] where L is not defined or not regular there.
    pub fn geometry(&self, at: &Start) -> Result<Geometry, RuntimeError> {
        self.kernel.geometry(at)
    }

    /// Whether the steps of a motion are contact: looked at in so many places along it.
    ///
    /// # Errors
    /// Those of [`plan`](Self::plan).
    pub fn check(&self, motion: &Motion, places: usize) -> Result<Check, RuntimeError> {
        self.kernel.check(motion, places)
    }
}
