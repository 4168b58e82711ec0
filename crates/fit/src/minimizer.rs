//! The iteration of Levenberg and Marquardt, by the crate `levenberg-marquardt`: the only place that knows it and its
//! version of nalgebra.

use crate::bounds::Bounds;
use crate::residuals::{Evaluation, Residuals};
use crate::settings::Settings;
use crate::{Criterion, Model, ModelFailure};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra_of_minimizer::{DMatrix, DVector, Dyn, storage::Owned};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// The norm of the residuals where the model cannot be evaluated: larger than all others, so that the step is rejected.
/// Its square is finite.
const BARRIER: f64 = 1e150;

/// How an iteration ended.
#[derive(Clone, Debug)]
pub(crate) enum End {
    Converged(Criterion),
    EvaluationLimit,
    /// The model cannot be evaluated here, and no shorter step was left.
    Failed(Vec<f64>, ModelFailure),
    Numerical(String),
}

/// The state that iterations over different sets of free parameters share.
#[derive(Clone, Debug)]
pub(crate) struct Progress {
    /// The best evaluation so far, with its Jacobian.
    pub best: Rc<Evaluation>,
    pub evaluations: usize,
    pub iterations: usize,
    /// Whether a free parameter was beyond a bound at the end, and was held there by the projection.
    pub is_projected: bool,
}

/// Minimises over the free parameters, from the best point so far. A trial outside the bounds is projected onto them;
/// the derivatives with respect to a parameter beyond its bound are then zero.
pub(crate) fn minimize<M: Model>(
    residuals: &Residuals<'_, M>,
    bounds: &Bounds,
    settings: &Settings,
    free: &[usize],
    progress: &mut Progress,
) -> End {
    let start = progress.best.clone();
    let limit = settings.limit(start.theta.len());
    let trial = Trial {
        residuals,
        bounds,
        free,
        limit,
        unknowns: DVector::from_iterator(free.len(), free.iter().map(|i| start.theta[*i])),
        current: RefCell::new(Some(start.clone())),
        best: RefCell::new(start),
        failure: RefCell::new(None),
        evaluations: progress.evaluations,
        iterations: Cell::new(progress.iterations),
        is_exhausted: false,
    };
    let remaining = limit.saturating_sub(progress.evaluations);
    let minimizer = LevenbergMarquardt::new()
        .with_ftol(settings.cost_tolerance)
        .with_xtol(settings.parameter_tolerance)
        .with_gtol(settings.gradient_tolerance)
        .with_stepbound(settings.step_bound)
        // The limit itself is that of the trial.
        .with_patience(remaining / (free.len() + 1) + 2);
    let (trial, report) = minimizer.minimize(trial);
    progress.evaluations = trial.evaluations;
    progress.iterations = trial.iterations.get();
    progress.is_projected = free.iter().zip(trial.unknowns.iter()).any(|(i, u)| !bounds.contains(*i, *u));
    progress.best = trial.best.into_inner();
    let (failure, is_exhausted) = (trial.failure.into_inner(), trial.is_exhausted);
    let converged = |criterion| match &failure {
        // The steps became short because the model cannot be evaluated beyond.
        Some((theta, failure)) => End::Failed(theta.clone(), failure.clone()),
        None => End::Converged(criterion),
    };
    match report.termination {
        TerminationReason::ResidualsZero => End::Converged(Criterion::ZeroResiduals),
        TerminationReason::Orthogonal => End::Converged(Criterion::Gradient),
        TerminationReason::Converged { ftol: true, .. } => converged(Criterion::Cost),
        TerminationReason::Converged { .. } => converged(Criterion::Parameters),
        TerminationReason::NoImprovementPossible(_) => converged(Criterion::RoundOff),
        TerminationReason::LostPatience => End::EvaluationLimit,
        TerminationReason::User(_) if is_exhausted => End::EvaluationLimit,
        TerminationReason::User(what) => match failure {
            Some((theta, failure)) => End::Failed(theta, failure),
            None => End::Numerical(format!("no {what}")),
        },
        TerminationReason::Numerical(what) => End::Numerical(format!("{what} is not finite")),
        other => End::Numerical(format!("{other:?}")),
    }
}

/// The problem as the minimizer sees it.
struct Trial<'a, M> {
    residuals: &'a Residuals<'a, M>,
    bounds: &'a Bounds,
    free: &'a [usize],
    limit: usize,
    /// The free parameters, not projected.
    unknowns: DVector<f64>,
    /// The evaluation there; `None` where the model cannot be evaluated.
    current: RefCell<Option<Rc<Evaluation>>>,
    best: RefCell<Rc<Evaluation>>,
    /// The last trial, if the model could not be evaluated there.
    failure: RefCell<Option<(Vec<f64>, ModelFailure)>>,
    evaluations: usize,
    iterations: Cell<usize>,
    is_exhausted: bool,
}

impl<M: Model> LeastSquaresProblem<f64, Dyn, Dyn> for Trial<'_, M> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, unknowns: &DVector<f64>) {
        self.unknowns.copy_from(unknowns);
        let best = self.best.borrow().clone();
        let mut theta = best.theta.clone();
        for (i, u) in self.free.iter().zip(unknowns.iter()) {
            theta[*i] = self.bounds.project(*i, *u);
        }
        // The minimizer returns to the last accepted parameters.
        if theta == best.theta {
            self.current.replace(Some(best));
            return;
        }
        if self.evaluations >= self.limit {
            self.is_exhausted = true;
            self.current.replace(None);
            return;
        }
        self.evaluations += 1;
        match self.residuals.evaluate(&theta, self.residuals.model.evaluates_jointly()) {
            Ok(evaluation) => {
                let evaluation = Rc::new(evaluation);
                if evaluation.cost < best.cost {
                    self.best.replace(evaluation.clone());
                }
                self.failure.replace(None);
                self.current.replace(Some(evaluation));
            }
            Err(failure) => {
                self.failure.replace(Some((theta, failure)));
                self.current.replace(None);
            }
        }
    }

    fn params(&self) -> DVector<f64> {
        self.unknowns.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        if self.is_exhausted {
            return None;
        }
        let count = self.residuals.data.len();
        match &*self.current.borrow() {
            Some(evaluation) => {
                let root = |i: usize| self.residuals.loss_of(i).term(evaluation.residuals[i]).root;
                Some(DVector::from_fn(count, |i, _| root(i)))
            }
            None => {
                let norm = BARRIER.max(1e3 * (2.0 * self.best.borrow().cost).sqrt());
                Some(DVector::from_fn(count, |i, _| if i == 0 { norm } else { 0.0 }))
            }
        }
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        self.iterations.set(self.iterations.get() + 1);
        let current = self.current.borrow().clone()?;
        let evaluation = if current.jacobian.is_some() {
            current
        } else {
            match self.residuals.evaluate(&current.theta, true) {
                Ok(evaluation) => {
                    let evaluation = Rc::new(evaluation);
                    self.current.replace(Some(evaluation.clone()));
                    if self.best.borrow().theta == evaluation.theta {
                        self.best.replace(evaluation.clone());
                    }
                    evaluation
                }
                Err(failure) => {
                    self.failure.replace(Some((current.theta.clone(), failure)));
                    return None;
                }
            }
        };
        let jacobian = evaluation.jacobian.as_ref()?;
        let slope = |(i, r): (usize, &f64)| self.residuals.loss_of(i).term(*r).root_slope;
        let slopes: Vec<f64> = evaluation.residuals.iter().enumerate().map(slope).collect();
        Some(DMatrix::from_fn(slopes.len(), self.free.len(), |i, j| {
            let index = self.free[j];
            if self.bounds.contains(index, self.unknowns[j]) { slopes[i] * jacobian[(i, index)] } else { 0.0 }
        }))
    }
}
