//! The kernel of formulas with more coordinates than any other kernel is compiled for.

use super::Kernel;
use super::formula_system::Observed;
use super::recorder::Recorder;
use super::run::{outcome_of, plan_of, requested};
use super::sized::{checked, initial_state};
use crate::{
    Check, Ensemble, EnsembleMonitor, FormulaSymmetry, Motion, Outcome, Plan, RunMonitor, RuntimeError, StepControl,
};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{Hints, Structure};
use discrete_herglotz::hamiltonian::ModifiedDefect;
use discrete_herglotz::{
    AnyIntegrator, Components, GaussCollocation, InputError, Point, ResumeState, Run, SecondDerivatives, State, System,
    SystemProblem, Vector, ensemble::Tally,
};
use formula_lagrangian::{Formula, FormulaDerivatives, FormulaError};
use std::sync::Arc;

/// A smooth formula without forces, constraints and resets, in any number of coordinates: it runs by contact Gauss
/// collocation, which evaluates it at one point at a time.
pub(super) struct ManyCoordinates(FormulaDerivatives);

/// What a formula with many coordinates has no kernel for.
fn few(what: &'static str) -> RuntimeError {
    RuntimeError::OfFewCoordinates { what, most: super::MOST_COMPILED_COORDINATES }
}

/// The kernel of a formula.
pub(super) fn kernel_of(formula: &Formula) -> Result<Arc<dyn Kernel>, RuntimeError> {
    let derivatives = formula.derivatives()?;
    let what = match () {
        () if formula.constraints() > 0 => "constraints",
        () if formula.has_forces() => "forces",
        () if formula.resets() > 0 => "resets and impacts",
        () if !derivatives.is_smooth() => "kinks and jumps",
        () => return Ok(Arc::new(ManyCoordinates(derivatives))),
    };
    Err(few(what))
}

impl System for ManyCoordinates {
    fn dimension(&self) -> usize {
        self.0.formula().dimension()
    }
    fn hints(&self) -> Hints {
        Hints { proved: true, ..Hints::NONE }
    }
    fn structure(&self) -> Structure {
        *self.0.proved()
    }
    fn value(&self, t: f64, x: &Point) -> f64 {
        self.0.value(t, &x.q, &x.v, x.z)
    }
    fn gradient(&self, t: f64, x: &Point) -> Components {
        let n = x.q.len();
        let mut all = vec![0.0; 2 * n + 1];
        self.0.with_gradient(t, &x.q, &x.v, x.z, &mut all);
        let (q, rest) = all.split_at(n);
        let (v, z) = rest.split_at(n);
        Components { x: q.into(), y: v.into(), z: z.first().copied().unwrap_or(f64::NAN) }
    }
    fn hessian(&self, t: f64, x: &Point) -> SecondDerivatives {
        let n = x.q.len();
        let (square, line) = (|| DMatrix::zeros(n, n), || Vector::from_fn(n, |_| 0.0));
        let mut to = SecondDerivatives { qq: square(), qv: square(), vv: square(), qz: line(), vz: line(), zz: 0.0 };
        let SecondDerivatives { qq, qv, vv, qz, vz, zz } = &mut to;
        let [qq, qv, vv] = [qq, qv, vv].map(|m| m.as_mut_slice());
        self.0.second_partials(t, &x.q, &x.v, x.z, [qq, qv, vv, qz, vz, std::slice::from_mut(zz)]);
        to
    }
    fn mass_matrix(&self, t: f64, x: &Point) -> DMatrix<f64> {
        self.0.mass_matrix(t, &x.q, &x.v, x.z)
    }
}

impl Observed for ManyCoordinates {
    fn formula(&self) -> &Formula {
        self.0.formula()
    }
    fn constant_rate(&self) -> Option<f64> {
        self.0.constant_rate()
    }
    fn resets(&self) -> usize {
        0
    }
    fn reset_of(&self, _index: usize) -> Option<usize> {
        None
    }
    fn velocity_or_momentum(&self, t: f64, state: &State, guess: &[f64]) -> Option<Vector> {
        let guess = Vector::from_fn(state.q.len(), |i| guess.get(i).copied().unwrap_or(0.0));
        self.legendre_inverse(t, state, &guess).ok().map(|x| x.v)
    }
}

impl ManyCoordinates {
    fn problem(&self, motion: &Motion) -> Result<SystemProblem<'_>, RuntimeError> {
        let start = initial_state(self.0.formula(), &motion.start)?;
        Ok(SystemProblem::new(self, motion.start.t, start)?)
    }

    fn with_problem<'p, 'o>(
        &self,
        problem: &'p SystemProblem<'p>,
        motion: &Motion,
    ) -> Result<Run<'p, 'o>, RuntimeError> {
        let run = match motion.step_control {
            StepControl::Accuracy { error, by: None } => problem.accuracy(error),
            StepControl::Accuracy { error, by: Some(by) } => problem.by(gauss(by)?).accuracy(error),
            StepControl::Steps { by, steps } => problem.by(gauss(by)?).steps(steps),
        };
        let scales = motion.scales.as_ref().map(|scales| checked(self.0.formula(), "scales", scales)).transpose()?;
        Ok(requested(run, motion, scales))
    }
}

/// Contact Gauss collocation.
///
/// # Errors
/// [`InputError::Hypothesis`] for another integrator.
fn gauss(by: AnyIntegrator) -> Result<GaussCollocation, InputError> {
    match by {
        AnyIntegrator::Gauss { stages } => Ok(GaussCollocation { stages }),
        _ => Err(InputError::Hypothesis {
            hypothesis: "at most 16 coordinates; a formula with more runs by `gauss_1` to `gauss_16`, and a lattice of \
                         equal sites by splittings too",
        }),
    }
}

impl Kernel for ManyCoordinates {
    fn formula(&self) -> &Formula {
        self.0.formula()
    }

    fn lacks(&self, what: &'static str) -> RuntimeError {
        few(what)
    }

    fn structure(&self) -> Structure {
        *self.0.proved()
    }

    fn is_smooth(&self) -> bool {
        true
    }

    fn has_force(&self) -> bool {
        false
    }

    fn symmetries(&self) -> Vec<FormulaSymmetry> {
        Vec::new()
    }

    fn with_parameters(&self, values: &[(&str, f64)]) -> Result<Arc<dyn Kernel>, FormulaError> {
        let mut derivatives = self.0.clone();
        values.iter().try_for_each(|(name, value)| derivatives.set(name, *value))?;
        Ok(Arc::new(ManyCoordinates(derivatives)))
    }

    fn check_integrator(&self, integrator: AnyIntegrator) -> Result<(), InputError> {
        gauss(integrator).map(|_| ())
    }

    fn plan(&self, motion: &Motion) -> Result<Plan, RuntimeError> {
        let problem = self.problem(motion)?;
        let mut no_monitor = ();
        let mut recorder = Recorder::new(self, motion, &mut no_monitor)?;
        let run = self.with_problem(&problem, motion)?.observe(&mut recorder);
        plan_of(&run, motion, self.0.formula(), false)
    }

    fn run(
        &self,
        motion: &Motion,
        monitor: &mut dyn RunMonitor,
        from: Option<ResumeState>,
    ) -> Result<Outcome, RuntimeError> {
        let problem = self.problem(motion)?;
        let mut recorder = Recorder::new(self, motion, monitor)?;
        let run = self.with_problem(&problem, motion)?.observe(&mut recorder);
        outcome_of(run, motion, from, self.0.formula().dimension())
    }

    fn ensemble(&self, _ensemble: &Ensemble<'_>, _monitor: &mut dyn EnsembleMonitor) -> Result<Tally, RuntimeError> {
        Err(few("ensembles"))
    }

    fn check(&self, _motion: &Motion, _samples: usize) -> Result<Check, RuntimeError> {
        Err(few("checks of the contact form"))
    }

    fn modified_defects(&self, _motion: &Motion, _most: usize) -> Result<Vec<ModifiedDefect>, RuntimeError> {
        Err(few("modified Hamiltonians"))
    }
}
