//! Systems given by a formula.

mod derivatives;
mod ensemble_derivatives;

use crate::kernel::{self, Kernel, LOSSES_WITH_FORCE, kernel_of};
use crate::outcome::KeptRows;
use crate::{
    BoundaryProblem, Check, Ensemble, EnsembleMonitor, FormulaSymmetry, FoundPath, Geometry, HamiltonianGeometry,
    Motion, Outcome, Plan, RunMonitor, RuntimeError, Start,
};
use contact_geom::{HamiltonianStructure, Structure};
use discrete_herglotz::{AnyIntegrator, InputError, ResumeState, ensemble::Tally};
use formula_lagrangian::Formula;
use std::sync::Arc;

/// A Lagrangian given by its formula, in 1 to 16 coordinates with all that integrators need, in up to 256 by contact Gauss
/// collocation, with derivatives, ensembles and checks; or a contact Hamiltonian, in 1 to 4 coordinates, which runs by contact Gauss collocation from a momentum. Cloning is inexpensive.
///
/// ```
/// use herglotz_runtime::{Motion, Start, System, StepControl};
/// let pendulum = System::parse("theta'^2/2 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)])?;
/// let start = Start::new(0.0, [1.0], [0.0], 0.0);
/// let motion = Motion::new(start, 100.0, StepControl::Accuracy { error: 1e-10, by: None });
/// println!("{}", pendulum.plan(&motion)?.text);
/// println!("theta = {}", pendulum.run(&motion, &mut ())?.q[0]);
/// # Ok::<(), herglotz_runtime::RuntimeError>(())
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

    /// The system of a formula that is parsed from a text over coordinates and parameters; see [`Formula::parse`].
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] with the position in the text.
    pub fn parse(text: &str, coordinates: &[&str], parameters: &[(&str, f64)]) -> Result<Self, RuntimeError> {
        Self::new(&Formula::parse(text, coordinates, parameters)?)
    }

    /// The same system with other values of some parameters; the formula is not parsed or differentiated again.
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] where there is no such parameter, or a value is not finite.
    pub fn with_parameters(&self, values: &[(&str, f64)]) -> Result<Self, RuntimeError> {
        Ok(System { kernel: self.kernel.with_parameters(values)? })
    }

    /// The formula, with the current values of its parameters.
    pub fn formula(&self) -> &Formula {
        self.kernel.formula()
    }

    /// The number of coordinates.
    pub fn dimension(&self) -> usize {
        self.formula().dimension()
    }

    /// The structure of L that is proved from its formula.
    pub fn structure(&self) -> Structure {
        self.kernel.structure()
    }

    /// The structure of a Hamiltonian that is proved from its formula; `None` for a Lagrangian.
    pub fn hamiltonian_structure(&self) -> Option<HamiltonianStructure> {
        self.kernel.hamiltonian_structure()
    }

    /// Whether L, or the Hamiltonian, has neither kinks nor jumps.
    pub fn is_smooth(&self) -> bool {
        self.kernel.is_smooth()
    }

    /// The symmetries that are recognised.
    pub fn symmetries(&self) -> Vec<FormulaSymmetry> {
        self.kernel.symmetries()
    }

    /// What contact flows have and the motions of this system do not, because of its forces, and why; empty without
    /// forces.
    pub fn losses(&self) -> &'static [(&'static str, &'static str)] {
        if self.kernel.has_force() { LOSSES_WITH_FORCE } else { &[] }
    }

    /// Checks whether the system satisfies the hypotheses of an integrator.
    ///
    /// # Errors
    /// [`RuntimeError::Input`] with the claim that is missing.
    pub fn check_integrator(&self, integrator: AnyIntegrator) -> Result<(), InputError> {
        self.kernel.check_integrator(integrator)
    }

    /// Checks a motion, chooses its step and numerical method, and describes what will be computed and what is skipped.
    ///
    /// # Errors
    /// [`RuntimeError`] for invalid input.
    pub fn plan(&self, motion: &Motion) -> Result<Plan, RuntimeError> {
        self.kernel.plan(motion).map_err(|error| error.with_constraint_of(self.formula()))
    }

    /// Runs a motion. A failure during the run is reported in the status of the outcome.
    ///
    /// # Errors
    /// Those of [`plan`](Self::plan).
    pub fn run(&self, motion: &Motion, monitor: &mut dyn RunMonitor) -> Result<Outcome, RuntimeError> {
        self.kernel.run(motion, monitor, None).map_err(|error| error.with_constraint_of(self.formula()))
    }

    /// Continues an interrupted motion; the result is bitwise that of an uninterrupted run. Events and rows from there
    /// on are reported. With `OutputTimes::Every` rows start with the step at which the motion continues, with
    /// `OutputTimes::At` after it.
    ///
    /// # Errors
    /// Those of [`run`](Self::run); [`InputError::AnotherRun`].
    pub fn resume(
        &self,
        motion: &Motion,
        from: ResumeState,
        monitor: &mut dyn RunMonitor,
    ) -> Result<Outcome, RuntimeError> {
        self.kernel.run(motion, monitor, Some(from)).map_err(|error| error.with_constraint_of(self.formula()))
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

    /// The contact geometry of a Hamiltonian at a time and a point of T\*Q x R.
    ///
    /// ```
    /// use herglotz_runtime::{Formula, FormulaNames, InitialVelocity, Start, System};
    /// let names = FormulaNames::new(&["x"], &[]);
    /// let system = System::new(&Formula::parse_hamiltonian("p_x^2/2 + x^2/2 + z/10", &names)?)?;
    /// let at = Start { velocity: InitialVelocity::Momentum(vec![2.0]), ..Start::new(0.0, [1.0], [], 0.0) };
    /// assert_eq!(system.hamiltonian_geometry(&at)?.field, [2.0, -1.2, 1.5]); // q', p', z'
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// [`RuntimeError`] where H is not defined, and for a Lagrangian, which has [`geometry`](Self::geometry).
    pub fn hamiltonian_geometry(&self, at: &Start) -> Result<HamiltonianGeometry, RuntimeError> {
        self.kernel.hamiltonian_geometry(at)
    }

    /// The velocity of the motion at a time and a point, for integrators of one's own: `(q', v', z')` at `y = (q, v, z)`, for a
    /// Hamiltonian `(q', p', z')` at `y = (q, p, z)`, without resets and constraints. NaN where it is not defined, or where `y`
    /// or `to` has another length.
    ///
    /// ```
    /// let system = herglotz_runtime::System::parse("x'^2/2 - x^2/2 - z/10", &["x"], &[])?;
    /// let mut rates = [0.0; 3];
    /// system.rates(0.0, &[1.0, 2.0, 0.0], &mut rates);
    /// assert_eq!(rates, [2.0, -1.2, 1.5]);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    pub fn rates(&self, t: f64, y: &[f64], to: &mut [f64]) {
        let length = 2 * self.dimension() + 1;
        if [y.len(), to.len()] == [length; 2] { self.kernel.rates(t, y, to) } else { to.fill(f64::NAN) }
    }

    /// Checks at this number of samples of a motion whether its steps are contact transformations.
    ///
    /// # Errors
    /// Those of [`plan`](Self::plan).
    pub fn check(&self, motion: &Motion, samples: usize) -> Result<Check, RuntimeError> {
        self.kernel.check(motion, samples).map_err(|error| error.with_constraint_of(self.formula()))
    }

    /// Runs an ensemble. A member that cannot start, or that fails, is passed on with the cause, and the others
    /// continue. The result of a member does not depend on the number of threads.
    ///
    /// # Errors
    /// Errors that concern all members.
    pub fn ensemble(&self, ensemble: &Ensemble<'_>, monitor: &mut dyn EnsembleMonitor) -> Result<Tally, RuntimeError> {
        kernel::check_direction(self.formula(), ensemble.t0, ensemble.end)?;
        self.kernel.ensemble(ensemble, monitor)
    }

    /// Searches for a path between two positions, of a system of one to eight coordinates. The status of the result
    /// says whether a path was found.
    ///
    /// # Errors
    /// [`RuntimeError`] for an invalid problem.
    pub fn path(&self, problem: &BoundaryProblem) -> Result<FoundPath, RuntimeError> {
        if self.formula().is_hamiltonian() {
            return Err(RuntimeError::OfLagrangians { what: "paths between two positions" });
        }
        kernel::refuse_constraints(self.formula(), "paths between two positions")?;
        kernel::path::search(self.formula(), problem)
    }
}
