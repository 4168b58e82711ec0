//! One kernel for each dimension: all code that is compiled for a fixed number of coordinates is in this module.

mod check;
mod constrained;
mod discrete;
mod ensemble;
mod ensemble_many;
mod ensemble_of;
mod event_times;
mod formula_system;
mod geometry;
mod hamiltonian;
mod many;
mod member_derivatives;
mod moved_start;
mod observed;
pub(crate) mod path;
mod recorder;
mod run;
mod sensitivity;
mod sized;
mod theorems;
mod work_thread;

use crate::full::{FULL, not_compiled};
use crate::{
    BatchLoss, Check, Ensemble, EnsembleMonitor, FormulaSymmetry, Geometry, HamiltonianGeometry, Interrupt, Loss,
    LossGradient, LyapunovExponents, Motion, Outcome, Plan, RunMonitor, RuntimeError, Sensitivity, Start,
};
pub(crate) use constrained::refuse_constraints;
use contact_geom::{HamiltonianStructure, Lagrangian, Structure};
use discrete_herglotz::hamiltonian::ModifiedDefect;
use discrete_herglotz::{
    AnyIntegrator, InputError, Integrator, Point, ResumeState, ensemble::Tally, sensitivity::Variable,
};
pub(crate) use event_times::{Differentiated, of_expression};
use formula_lagrangian::{Formula, FormulaDerivatives, FormulaError, FormulaLagrangian};
use formula_system::FormulaSystem;
pub(crate) use run::LOSSES_WITH_FORCE;
pub(crate) use sized::check_direction;
use sized::{Sized, coordinates};
use std::sync::Arc;
use work_thread::on_large_stack;

/// A system whose dimension is not part of its type.
pub(crate) trait Kernel: Send + Sync {
    fn formula(&self) -> &Formula;
    /// The error where the kernel has no such computation.
    fn lacks(&self, what: &'static str) -> RuntimeError {
        RuntimeError::OfLagrangians { what }
    }
    fn structure(&self) -> Structure;
    fn is_smooth(&self) -> bool;
    fn has_force(&self) -> bool;
    /// The derivatives of a Lagrangian formula, over the number of coordinates of the kernel; `None` of a Hamiltonian.
    fn derivatives(&self) -> Option<&Arc<FormulaDerivatives>> {
        None
    }
    fn symmetries(&self) -> Vec<FormulaSymmetry> {
        self.derivatives().map_or_else(Vec::new, |derivatives| derivatives.symmetries())
    }
    /// The proved structure of a Hamiltonian; `None` for a Lagrangian.
    fn hamiltonian_structure(&self) -> Option<HamiltonianStructure> {
        None
    }
    fn with_parameters(&self, values: &[(&str, f64)]) -> Result<Arc<dyn Kernel>, FormulaError>;
    fn check_integrator(&self, integrator: AnyIntegrator) -> Result<(), InputError>;
    fn plan(&self, motion: &Motion) -> Result<Plan, RuntimeError>;
    fn run(
        &self,
        motion: &Motion,
        monitor: &mut dyn RunMonitor,
        from: Option<ResumeState>,
    ) -> Result<Outcome, RuntimeError>;
    fn ensemble(&self, ensemble: &Ensemble<'_>, monitor: &mut dyn EnsembleMonitor) -> Result<Tally, RuntimeError>;
    fn rates(&self, _t: f64, _y: &[f64], to: &mut [f64]) {
        to.fill(f64::NAN);
    }
    /// The start of a motion, validated, with its velocity.
    fn point(&self, _at: &Start) -> Result<Point, RuntimeError> {
        Err(self.lacks("geometry on TQ x R"))
    }
    fn geometry(&self, at: &Start) -> Result<Geometry, RuntimeError> {
        refuse_constraints(self.formula(), "the geometry on TQ x R and the Herglotz field")?;
        let x = self.point(at)?;
        let derivatives = self.derivatives().ok_or_else(|| self.lacks("geometry on TQ x R"))?;
        geometry::at(derivatives, at.t, &x)
    }
    fn hamiltonian_geometry(&self, _at: &Start) -> Result<HamiltonianGeometry, RuntimeError> {
        Err(FormulaError::IsLagrangian.into())
    }
    fn check(&self, motion: &Motion, samples: usize) -> Result<Check, RuntimeError>;
    fn modified_defects(&self, motion: &Motion, most: usize) -> Result<Vec<ModifiedDefect>, RuntimeError>;
    fn sensitivity(
        &self,
        _motion: &Motion,
        _of: Differentiated<'_>,
        _monitor: &mut dyn RunMonitor,
    ) -> Result<Sensitivity, RuntimeError> {
        Err(self.lacks(DERIVATIVES))
    }
    fn gradient(
        &self,
        _motion: &Motion,
        _times: &[f64],
        _loss: &mut Loss<'_>,
        _monitor: &mut dyn RunMonitor,
    ) -> Result<LossGradient, RuntimeError> {
        Err(self.lacks(DERIVATIVES))
    }
    fn lyapunov_exponents(
        &self,
        _motion: &Motion,
        _monitor: &mut dyn RunMonitor,
    ) -> Result<LyapunovExponents, RuntimeError> {
        Err(self.lacks(DERIVATIVES))
    }
    fn ensemble_gradient(
        &self,
        _ensemble: &Ensemble<'_>,
        _times: &[f64],
        _loss: &BatchLoss<'_>,
        _interrupt: Option<&Interrupt>,
    ) -> Result<Vec<Result<LossGradient, RuntimeError>>, RuntimeError> {
        Err(self.lacks(DERIVATIVES))
    }
    fn ensemble_sensitivity(
        &self,
        _ensemble: &Ensemble<'_>,
        _variables: &[Variable],
        _times: &[f64],
        _interrupt: Option<&Interrupt>,
    ) -> Result<Vec<Result<Sensitivity, RuntimeError>>, RuntimeError> {
        Err(self.lacks(DERIVATIVES))
    }
}

/// What a Hamiltonian has no kernel for, nor a formula with constraints.
const DERIVATIVES: &str = "derivatives of motions";

const ENSEMBLES: &str = "ensembles";

/// What a kernel of formulas with constraints alone does not compute.
const WITHOUT_CONSTRAINTS: &str = "motions without constraints in this number of coordinates";

/// Whether there is a kernel of this number of coordinates for formulas without constraints: without the feature `full` only of a few.
const fn has_kernel(coordinates: usize) -> bool {
    FULL || matches!(coordinates, 1 | 2 | 4)
}

/// The largest number of coordinates for which kernels without constraints are compiled.
const MOST_COMPILED_COORDINATES: usize = if FULL { 16 } else { 4 };

/// The kernel of a formula.
pub(crate) fn kernel_of(formula: &Formula) -> Result<Arc<dyn Kernel>, RuntimeError> {
    if formula.is_hamiltonian() {
        return hamiltonian::kernel_of(formula);
    }
    if formula.constraints() > 0 && formula.dimension() > constrained::MAX_CONSTRAINED_COORDINATES {
        let (found, most) = (formula.dimension(), constrained::MAX_CONSTRAINED_COORDINATES);
        return Err(RuntimeError::ConstrainedDimension { found, most });
    }
    let constrained = formula.constraints() > 0;
    macro_rules! of {
        ($($n:literal)*) => {
            match formula.dimension() {
                $(found if const { has_kernel($n) || constrained::is_compiled($n) }
                    && found <= $n
                    && if constrained { constrained::is_compiled($n) } else { has_kernel($n) } =>
                {
                    Ok(Arc::new(Sized(formula.lagrangian_within::<$n>()?)) as Arc<dyn Kernel>)
                })*
                _ => many::kernel_of(formula),
            }
        };
    }
    // Each dimension is half a minute of compiling: a system of five coordinates is computed with one more at rest.
    of!(1 2 3 4 6 8 16)
}

impl<const N: usize> Kernel for Sized<FormulaLagrangian<N>, N> {
    fn formula(&self) -> &Formula {
        self.0.formula()
    }

    fn structure(&self) -> Structure {
        *self.0.proved()
    }

    fn is_smooth(&self) -> bool {
        self.0.is_smooth()
    }

    fn has_force(&self) -> bool {
        Lagrangian::has_force(&self.0)
    }

    fn derivatives(&self) -> Option<&Arc<FormulaDerivatives>> {
        Some(self.0.derivatives())
    }

    fn with_parameters(&self, values: &[(&str, f64)]) -> Result<Arc<dyn Kernel>, FormulaError> {
        let mut lagrangian = self.0.clone();
        values.iter().try_for_each(|(name, value)| lagrangian.set(name, *value))?;
        Ok(Arc::new(Sized(lagrangian)))
    }

    fn check_integrator(&self, integrator: AnyIntegrator) -> Result<(), InputError> {
        match self.0.constrained(Some(integrator))? {
            Some(method) => method.check(&self.0),
            None => integrator.check(&self.0),
        }
    }

    fn plan(&self, motion: &Motion) -> Result<Plan, RuntimeError> {
        run::plan(self, motion)
    }

    fn run(
        &self,
        motion: &Motion,
        monitor: &mut dyn RunMonitor,
        from: Option<ResumeState>,
    ) -> Result<Outcome, RuntimeError> {
        run::run(self, motion, monitor, from)
    }

    fn ensemble(&self, ensemble: &Ensemble<'_>, monitor: &mut dyn EnsembleMonitor) -> Result<Tally, RuntimeError> {
        if const { FULL } { ensemble::run(self, ensemble, monitor) } else { Err(not_compiled(ENSEMBLES)) }
    }

    fn rates(&self, t: f64, y: &[f64], to: &mut [f64]) {
        geometry::rates(self, t, y, to);
    }

    fn point(&self, at: &Start) -> Result<Point, RuntimeError> {
        let (problem, n) = (self.problem(at)?, self.0.formula().dimension());
        let x = problem.start();
        Ok(Point { q: coordinates(x.q.as_slice(), n).into(), v: coordinates(x.v.as_slice(), n).into(), z: x.z })
    }

    fn check(&self, motion: &Motion, samples: usize) -> Result<Check, RuntimeError> {
        on_large_stack(|| check::check(self, motion, samples))
    }

    fn modified_defects(&self, motion: &Motion, most: usize) -> Result<Vec<ModifiedDefect>, RuntimeError> {
        if const { !FULL } {
            return Err(not_compiled("modified Hamiltonians"));
        }
        refuse_constraints(self.formula(), "modified Hamiltonians")?;
        check::modified_defects(self, motion, most)
    }

    fn sensitivity(
        &self,
        motion: &Motion,
        of: Differentiated<'_>,
        monitor: &mut dyn RunMonitor,
    ) -> Result<Sensitivity, RuntimeError> {
        sensitivity::tangent(self, motion, of, monitor)
    }

    fn gradient(
        &self,
        motion: &Motion,
        times: &[f64],
        loss: &mut Loss<'_>,
        monitor: &mut dyn RunMonitor,
    ) -> Result<LossGradient, RuntimeError> {
        sensitivity::gradient(self, motion, times, loss, monitor)
    }

    fn lyapunov_exponents(
        &self,
        motion: &Motion,
        monitor: &mut dyn RunMonitor,
    ) -> Result<LyapunovExponents, RuntimeError> {
        sensitivity::lyapunov_exponents(self, motion, monitor)
    }

    fn ensemble_gradient(
        &self,
        ensemble: &Ensemble<'_>,
        times: &[f64],
        loss: &BatchLoss<'_>,
        interrupt: Option<&Interrupt>,
    ) -> Result<Vec<Result<LossGradient, RuntimeError>>, RuntimeError> {
        refuse_constraints(self.formula(), "derivatives of ensembles")?;
        member_derivatives::gradients(self, ensemble, times, loss, interrupt)
    }

    fn ensemble_sensitivity(
        &self,
        ensemble: &Ensemble<'_>,
        variables: &[Variable],
        times: &[f64],
        interrupt: Option<&Interrupt>,
    ) -> Result<Vec<Result<Sensitivity, RuntimeError>>, RuntimeError> {
        refuse_constraints(self.formula(), "derivatives of ensembles")?;
        member_derivatives::sensitivities(self, ensemble, variables, times, interrupt)
    }
}
