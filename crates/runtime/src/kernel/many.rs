//! The kernel of formulas with more coordinates than any other kernel is compiled for.

use super::formula_system::Observed;
use super::recorder::Recorder;
use super::run::{outcome_of, plan_of, requested};
use super::sensitivity::{exponents_of, loss_gradient, unobserved};
use super::sized::{check_direction, checked, initial_state};
use super::{DERIVATIVES, Differentiated, ENSEMBLES, Kernel, check, ensemble, geometry};
use crate::full::{FULL, not_compiled};
use crate::{
    Check, Ensemble, EnsembleMonitor, Loss, LossGradient, LyapunovExponents, Motion, Outcome, Plan, RunMonitor,
    RuntimeError, Sensitivity, Start, StepControl,
};
use contact_geom::nalgebra::DMatrix;
use contact_geom::switching::BreakRate;
use contact_geom::{Arguments, Hints, ScalarSystem, Slopes, Structure};
use discrete_herglotz::hamiltonian::ModifiedDefect;
use discrete_herglotz::sensitivity::DifferentiableProblem;
use discrete_herglotz::{
    AnyIntegrator, AtSwitch, Components, ExplicitDerivatives, ForceDerivatives, ForceKind, GaussCollocation,
    InputError, Kernels, Point, Quantity, ResumeState, Run, SecondDerivatives, State, System, SystemProblem, Until,
    Vector, ensemble::Tally,
};
use formula_lagrangian::{Formula, FormulaDerivatives, FormulaError};
use std::rc::Rc;
use std::sync::Arc;

/// A formula without constraints, in any number of coordinates: it runs by contact Gauss collocation.
pub(super) struct ManyCoordinates(pub Arc<FormulaDerivatives>);

/// What a formula with many coordinates has no kernel for.
pub(super) fn few(what: &'static str) -> RuntimeError {
    RuntimeError::OfFewCoordinates { what, most: super::MOST_COMPILED_COORDINATES }
}

/// The kernel of a formula.
pub(super) fn kernel_of(formula: &Formula) -> Result<Arc<dyn Kernel>, RuntimeError> {
    let derivatives = formula.derivatives()?;
    if formula.constraints() > 0 {
        return Err(few("constraints"));
    }
    Ok(Arc::new(ManyCoordinates(Arc::new(derivatives))))
}

impl System for ManyCoordinates {
    fn dimension(&self) -> usize {
        self.0.formula().dimension()
    }
    fn hints(&self) -> Hints {
        let switching_functions = !self.0.is_smooth() || self.0.resets() > 0;
        Hints { proved: true, switching_functions, forced: self.0.has_force(), ..Hints::NONE }
    }
    fn structure(&self) -> Structure {
        *self.0.proved()
    }
    fn force_kind(&self) -> ForceKind {
        match self.0.force_drag() {
            _ if !self.0.has_force() => ForceKind::None,
            _ if self.0.force_is_of_positions() => ForceKind::OfPositions,
            Some((linear, quadratic)) => ForceKind::Drag { linear: linear.into(), quadratic },
            None => ForceKind::General,
        }
    }
    fn has_force(&self) -> bool {
        self.0.has_force()
    }
    fn applied_force(&self, t: f64, x: &Point) -> Vector {
        let mut force = Vector::zeros(x.q.len());
        self.0.applied_force::<f64, 0>(t, &x.q, &x.v, x.z, &mut force);
        force
    }
    fn force_derivatives(&self, t: f64, x: &Point) -> Option<ForceDerivatives> {
        ForceDerivatives::of_slices(&*self.0, t, x)
    }
    fn switching_functions(&self, t: f64, x: &Point, values: &mut Vec<f64>) {
        self.0.switching_functions(t, &x.q, &x.v, x.z, values);
    }
    fn at_switch(&self, index: usize, t: f64, x: &Point, rising: bool) -> AtSwitch {
        let mut to = x.clone();
        let factor = self.0.reset(index, rising, t, (&mut to.q, &mut to.v, &mut to.z));
        factor.map_or(AtSwitch::Continue, |factor| AtSwitch::Replace { to, factor })
    }
    fn at_accumulation(&self, index: usize, t: f64, x: &Point) -> AtSwitch {
        let mut to = x.clone();
        match self.0.rest(index, t, (&mut to.q, &mut to.v, &mut to.z)) {
            true => AtSwitch::Replace { to, factor: None },
            false => AtSwitch::Continue,
        }
    }
    fn breaks(&self) -> &[f64] {
        self.0.breaks()
    }
    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>> {
        Some(self.0.break_rates(parameter))
    }

    fn has_cones(&self) -> bool {
        self.0.has_cones()
    }
    fn parameter_names(&self) -> Vec<String> {
        self.0.formula().parameters().map(|(name, _)| name.to_owned()).collect()
    }
    fn parameters(&self) -> Vec<f64> {
        self.0.formula().parameters().map(|(_, value)| value).collect()
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Rc<dyn System>> {
        Some(Rc::new(ManyCoordinates(Arc::new(self.0.with_parameters(theta)?))))
    }
    fn in_quantity(&self, of: Quantity, t: f64, x: &Point) -> ExplicitDerivatives {
        let mut to = ExplicitDerivatives::zeros(x.q.len());
        let parameter = match of {
            Quantity::Time if self.0.proved().autonomous => return to,
            Quantity::Time => None,
            Quantity::Parameter(k) => Some(k),
        };
        let slopes = Slopes { q: &mut to.gradient.x, v: &mut to.gradient.y, z: &mut to.gradient.z };
        to.l = self.0.explicit(parameter, Arguments { t, q: &x.q, v: &x.v, z: x.z }, slopes, &mut to.force);
        to
    }
    fn kernels(&self) -> Option<Kernels> {
        Some(if const { FULL } { Kernels::of(self.0.clone()) } else { Kernels::of_motions(self.0.clone()) })
    }
    fn value(&self, t: f64, x: &Point) -> f64 {
        self.0.value::<f64, 0>(t, &x.q, &x.v, x.z)
    }
    fn gradient(&self, t: f64, x: &Point) -> Components {
        let mut to = Components::zeros(x.q.len());
        let slopes = Slopes { q: &mut to.x, v: &mut to.y, z: &mut to.z };
        self.0.with_gradient::<f64, 0>(t, &x.q, &x.v, x.z, slopes);
        to
    }
    fn hessian(&self, t: f64, x: &Point) -> SecondDerivatives {
        let n = x.q.len();
        let (square, line) = (|| DMatrix::zeros(n, n), || Vector::from_fn(n, |_| 0.0));
        let mut to = SecondDerivatives { qq: square(), qv: square(), vv: square(), qz: line(), vz: line(), zz: 0.0 };
        let SecondDerivatives { qq, qv, vv, qz, vz, zz } = &mut to;
        let [qq, qv, vv] = [qq, qv, vv].map(|m| m.as_mut_slice());
        let mut first = Components::zeros(n);
        let slopes = Slopes { q: &mut first.x, v: &mut first.y, z: &mut first.z };
        let at = Arguments { t, q: &x.q[..], v: &x.v[..], z: x.z };
        self.0.with_second_derivatives::<f64, 0>(at, slopes, [qq, qv, vv, qz, vz, std::slice::from_mut(zz)]);
        to
    }
    fn mass_matrix(&self, t: f64, x: &Point) -> DMatrix<f64> {
        let n = x.q.len();
        let mut w = DMatrix::zeros(n, n);
        self.0.mass_matrix::<f64, 0>(t, &x.q, &x.v, x.z, w.as_mut_slice());
        w
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
        self.0.resets()
    }
    fn reset_of(&self, index: usize) -> Option<usize> {
        self.0.reset_of(index)
    }
    fn velocity_or_momentum(&self, t: f64, state: &State, guess: &[f64]) -> Option<Vector> {
        let guess = Vector::from_fn(state.q.len(), |i| guess.get(i).copied().unwrap_or(0.0));
        self.legendre_inverse(t, state, &guess).ok().map(|x| x.v)
    }
    fn energy(&self, t: f64, state: &State, v: Option<&Vector>) -> Option<f64> {
        let x = Point { q: state.q.clone(), v: v?.clone(), z: state.z };
        Some(x.v.dot(&state.p) - System::value(self, t, &x))
    }
}

impl ManyCoordinates {
    /// The same formula with other values of some parameters.
    pub(super) fn with_values<'n>(
        &self,
        mut values: impl Iterator<Item = (&'n str, f64)>,
    ) -> Result<Self, FormulaError> {
        let mut derivatives = (*self.0).clone();
        values.try_for_each(|(name, value)| derivatives.set(name, value))?;
        Ok(ManyCoordinates(Arc::new(derivatives)))
    }

    pub(super) fn problem(&self, motion: &Motion) -> Result<SystemProblem<'_>, RuntimeError> {
        check_direction(self.0.formula(), motion.start.t, motion.end)?;
        self.problem_at(&motion.start)
    }

    /// The problem of a start, validated.
    fn problem_at(&self, at: &Start) -> Result<SystemProblem<'_>, RuntimeError> {
        let problem = SystemProblem::new(self, at.t, initial_state(self.0.formula(), at)?)?;
        let force = self.applied_force(at.t, problem.start());
        let names = self.0.formula().coordinates();
        match names.into_iter().zip(force.iter().copied()).find(|(_, value)| !value.is_finite()) {
            Some((coordinate, value)) => Err(RuntimeError::ForceUndefined { coordinate, value }),
            None => Ok(problem),
        }
    }

    fn with_problem<'p, 'o>(
        &self,
        problem: &'p SystemProblem<'p>,
        motion: &Motion,
    ) -> Result<Run<'p, 'o>, RuntimeError> {
        if motion.method.is_some() {
            return Err(few("methods of one's own"));
        }
        let run = match motion.step_control {
            StepControl::Accuracy { error, by: None } => problem.accuracy(error),
            StepControl::Accuracy { error, by: Some(by) } => problem.by(gauss(by)?).accuracy(error),
            StepControl::Steps { by, steps } => problem.by(gauss(by)?).steps(steps),
        };
        let scales = motion.scales.as_ref().map(|scales| checked(self.0.formula(), "scales", scales)).transpose()?;
        Ok(requested(run, motion, scales))
    }

    /// Calls a function with the run of a motion, which may end after a time, and its observer.
    fn observed<R>(
        &self,
        motion: &Motion,
        (monitor, until): (&mut dyn RunMonitor, Option<f64>),
        work: impl FnOnce(Run<'_, '_>) -> Result<R, RuntimeError>,
    ) -> Result<R, RuntimeError> {
        let problem = self.problem(motion)?;
        let mut recorder = Recorder::new(self, motion, monitor)?.until(until);
        work(self.with_problem(&problem, motion)?.observe(&mut recorder))
    }
}

/// Contact Gauss collocation.
///
/// # Errors
/// [`InputError::Hypothesis`] for another integrator.
pub(super) fn gauss(by: AnyIntegrator) -> Result<GaussCollocation, InputError> {
    match by {
        AnyIntegrator::Gauss { stages } => Ok(GaussCollocation { stages }),
        _ => Err(InputError::Hypothesis {
            hypothesis: if FULL {
                "at most 16 coordinates; a formula with more runs by `gauss_1` to `gauss_16`, and a lattice of equal sites \
                 by splittings too"
            } else {
                "at most 4 coordinates; a formula with more runs here by `gauss_1` to `gauss_16`"
            },
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
        self.0.is_smooth()
    }

    fn has_force(&self) -> bool {
        self.0.has_force()
    }

    fn derivatives(&self) -> Option<&Arc<FormulaDerivatives>> {
        Some(&self.0)
    }

    fn with_parameters(&self, values: &[(&str, f64)]) -> Result<Arc<dyn Kernel>, FormulaError> {
        Ok(Arc::new(self.with_values(values.iter().copied())?))
    }

    fn check_integrator(&self, integrator: AnyIntegrator) -> Result<(), InputError> {
        gauss(integrator).map(|_| ())
    }

    fn rates(&self, t: f64, y: &[f64], to: &mut [f64]) {
        geometry::rates_of_many(self, t, y, to);
    }

    fn point(&self, at: &Start) -> Result<Point, RuntimeError> {
        Ok(self.problem_at(at)?.start().clone())
    }

    fn plan(&self, motion: &Motion) -> Result<Plan, RuntimeError> {
        self.observed(motion, (&mut (), None), |run| plan_of(&run, motion, self.0.formula(), self.0.has_force()))
    }

    fn run(
        &self,
        motion: &Motion,
        monitor: &mut dyn RunMonitor,
        from: Option<ResumeState>,
    ) -> Result<Outcome, RuntimeError> {
        self.observed(motion, (monitor, None), |run| outcome_of(run, motion, from, self.0.formula().dimension()))
    }

    fn sensitivity(
        &self,
        motion: &Motion,
        of: Differentiated<'_>,
        monitor: &mut dyn RunMonitor,
    ) -> Result<Sensitivity, RuntimeError> {
        if const { !FULL } {
            return Err(not_compiled(DERIVATIVES));
        }
        let (until, problem) = (Until::Time(motion.end), self.problem(motion)?);
        let times = of.row_times(motion);
        self.observed(&unobserved(motion), (monitor, times.last().copied()), |run| {
            let found = run.tangent_at(of.variables, &times, until)?;
            of.of(&found, motion, (self, &problem.differentiable()))
        })
    }

    fn gradient(
        &self,
        motion: &Motion,
        times: &[f64],
        loss: &mut Loss<'_>,
        monitor: &mut dyn RunMonitor,
    ) -> Result<LossGradient, RuntimeError> {
        if const { !FULL } {
            return Err(not_compiled(DERIVATIVES));
        }
        let until = Until::Time(motion.end);
        self.observed(&unobserved(motion), (monitor, None), |run| {
            Ok(loss_gradient(run.gradient_at(times, |states| loss(states), until)?, self.dimension()))
        })
    }

    fn lyapunov_exponents(
        &self,
        motion: &Motion,
        monitor: &mut dyn RunMonitor,
    ) -> Result<LyapunovExponents, RuntimeError> {
        if const { !FULL } {
            return Err(not_compiled(DERIVATIVES));
        }
        let until = Until::Time(motion.end);
        self.observed(&unobserved(motion), (monitor, None), |run| {
            let is_of_contact = !self.0.has_force() && !self.0.formula().has_noncontact_resets();
            Ok(exponents_of(run.lyapunov_exponents(until)?, self.0.proved(), is_of_contact))
        })
    }

    fn ensemble(&self, ensemble: &Ensemble<'_>, monitor: &mut dyn EnsembleMonitor) -> Result<Tally, RuntimeError> {
        if const { FULL } { ensemble::run(self, ensemble, monitor) } else { Err(not_compiled(ENSEMBLES)) }
    }

    /// Without the theorems on discrete Lagrangians.
    fn check(&self, motion: &Motion, samples: usize) -> Result<Check, RuntimeError> {
        check::of_many(self, motion, samples)
    }

    fn modified_defects(&self, _motion: &Motion, _most: usize) -> Result<Vec<ModifiedDefect>, RuntimeError> {
        Err(few("modified Hamiltonians"))
    }
}
