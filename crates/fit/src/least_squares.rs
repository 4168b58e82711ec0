//! Nonlinear least squares.

use crate::bounds::Bounds;
use crate::residuals::Residuals;
use crate::settings::Settings;
use crate::{Fit, FitError, Loss, Model, MultiStart, solve};
use contact_geom::UnknownParameter;
use contact_geom::support::nearest_name;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Nonlinear least squares: minimises `1/2 sum_i C^2 rho((r_i/C)^2)` with `r_i = w_i (model_i(theta) - y_i)` over theta
/// within bounds, by the method of Levenberg and Marquardt with exact Jacobians.
///
/// # Bounds
///
/// Bounds are kept by an active set: trials of the iteration are projected onto them; at the end of an iteration the
/// parameters at bounds whose multipliers have the right sign are held there, the others are released, and the iteration
/// is continued over the free parameters until nothing changes. At the solution the conditions of Karush, Kuhn and Tucker
/// hold with the tolerances of an unconstrained fit, and convergence is as fast. (A transformation of the parameters
/// would make the Jacobian singular where a bound is active.) The model is never evaluated outside the bounds.
pub struct LeastSquares<'a, M> {
    pub(crate) residuals: Residuals<'a, M>,
    pub(crate) bounds: Bounds,
    pub(crate) settings: Settings,
}

impl<M> Clone for LeastSquares<'_, M> {
    fn clone(&self) -> Self {
        let LeastSquares { residuals, bounds, settings } = self;
        LeastSquares { residuals: residuals.clone(), bounds: bounds.clone(), settings: *settings }
    }
}

impl<M> std::fmt::Debug for LeastSquares<'_, M> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Residuals { names, data, weights, loss, .. } = &self.residuals;
        let mut fields = f.debug_struct("LeastSquares");
        fields.field("names", names).field("data", data).field("weights", weights).field("loss", loss);
        fields.field("bounds", &self.bounds).field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl<'a, M: Model> LeastSquares<'a, M> {
    /// The fit of the values of a model to measured ones, with weights 1.
    ///
    /// # Errors
    /// A model without parameters, two parameters of one name, or a wrong number of values.
    pub fn new(model: &'a M, data: &[f64]) -> Result<Self, FitError> {
        let names = model.parameter_names();
        if names.is_empty() {
            return Err(FitError::NoParameters);
        }
        if let Some((_, name)) = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
            return Err(FitError::NameTwice { name: name.clone() });
        }
        check_count("measured values", data.len(), model.value_count())?;
        let (bounds, settings) = (Bounds::none(names.len()), Settings::default());
        let weights = vec![1.0; data.len()];
        let residuals = Residuals { model, names, data: data.to_vec(), weights, loss: Loss::Linear, constraints: 0 };
        Ok(LeastSquares { residuals, bounds, settings })
    }

    /// Sets the weight of each measured value; a value of weight 0 is ignored, and need not be a number.
    ///
    /// # Errors
    /// A wrong number of weights, or one that is negative or not finite.
    pub fn weights(mut self, weights: &[f64]) -> Result<Self, FitError> {
        check_count("weights", weights.len(), self.residuals.data.len())?;
        if let Some(index) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
            return Err(FitError::Weight { index, value: weights[index] });
        }
        self.residuals.weights = weights.to_vec();
        Ok(self)
    }

    /// Sets the standard deviation of each measured value; the weights are their inverses.
    ///
    /// # Errors
    /// A wrong number of standard deviations, or one that is not positive.
    pub fn standard_deviations(self, deviations: &[f64]) -> Result<Self, FitError> {
        // The inverse of a subnormal number is infinite.
        if let Some(index) = deviations.iter().position(|s| !(*s > 0.0 && s.recip().is_finite())) {
            return Err(FitError::StandardDeviation { index, value: deviations[index] });
        }
        self.weights(&deviations.iter().map(|s| s.recip()).collect::<Vec<_>>())
    }

    /// Declares that the weights are the inverses of known standard deviations, as those of a calibrated instrument: standard
    /// errors are then not scaled by the size of the residuals.
    #[must_use]
    pub fn absolute_deviations(mut self, are_known: bool) -> Self {
        self.settings.absolute_deviations = are_known;
        self
    }

    /// Sets the bounds of a parameter; infinite where there is none, equal for a parameter that is held fixed.
    ///
    /// # Errors
    /// An unknown name, or bounds that are not an interval.
    pub fn bounds(mut self, name: &str, lower: f64, upper: f64) -> Result<Self, FitError> {
        let names = &self.residuals.names;
        let Some(index) = names.iter().position(|n| n == name) else {
            let nearest = nearest_name(name, names.iter().map(String::as_str)).map(str::to_owned);
            return Err(UnknownParameter { name: name.to_owned(), nearest, known: names.clone() }.into());
        };
        self.bounds.set(name, index, lower, upper)?;
        Ok(self)
    }

    /// Sets the loss.
    ///
    /// # Errors
    /// A scale that is not positive and finite.
    pub fn loss(mut self, loss: Loss) -> Result<Self, FitError> {
        if let Some(scale) = loss.scale() {
            check_positive("the scale of the loss", scale)?;
        }
        self.residuals.loss = loss;
        Ok(self)
    }

    /// Sets the largest number of evaluations of the model; by default 100 for each parameter and one more.
    #[must_use]
    pub fn max_evaluations(mut self, count: usize) -> Self {
        self.settings.max_evaluations = Some(count);
        self
    }

    /// Sets the tolerances: of the relative decrease of the cost (1e-14), of the relative change of the parameters
    /// (1e-12), and of the cosine of the angle between residuals and columns of the Jacobian (1e-12). The iteration ends
    /// when one of them is met.
    ///
    /// # Errors
    /// A tolerance that is not positive and finite.
    pub fn tolerances(mut self, cost: f64, parameters: f64, gradient: f64) -> Result<Self, FitError> {
        check_positive("the tolerance of the cost", cost)?;
        check_positive("the tolerance of the parameters", parameters)?;
        check_positive("the tolerance of the gradient", gradient)?;
        self.settings.cost_tolerance = cost;
        self.settings.parameter_tolerance = parameters;
        self.settings.gradient_tolerance = gradient;
        Ok(self)
    }

    /// Sets the largest first step, as a multiple of the norm of the parameters, scaled by the columns of the Jacobian;
    /// by default 100. Smaller values, to 0.1, stay near the start.
    ///
    /// # Errors
    /// A bound that is not positive and finite.
    pub fn step_bound(mut self, bound: f64) -> Result<Self, FitError> {
        check_positive("the bound of the first step", bound)?;
        self.settings.step_bound = bound;
        Ok(self)
    }

    /// Sets the ratio to the largest singular value of the Jacobian, with columns of norm 1, below which a singular value
    /// is taken as zero; by default 1e-10. Jacobians with larger errors, such as those by differences, need a larger one.
    ///
    /// # Errors
    /// A tolerance that is not positive and finite.
    pub fn rank_tolerance(mut self, tolerance: f64) -> Result<Self, FitError> {
        check_positive("the tolerance of the rank", tolerance)?;
        self.settings.rank_tolerance = tolerance;
        Ok(self)
    }

    /// The fit from a start.
    ///
    /// # Errors
    /// A measured value that is not finite, a start that is not finite or outside the bounds, fewer values than
    /// parameters, a model that cannot be evaluated.
    pub fn solve(&self, start: &[f64]) -> Result<Fit, FitError> {
        solve::solve(&self.residuals, &self.bounds, &self.settings, start)
    }

    /// The fits from each of these starts, one after the other.
    pub fn solve_from<S: AsRef<[f64]>>(&self, starts: &[S]) -> MultiStart {
        MultiStart { fits: starts.iter().map(|start| self.solve(start.as_ref())).collect() }
    }

    /// The fits from each of these starts, in this number of threads. The results do not depend on it.
    pub fn solve_in_threads<S: AsRef<[f64]> + Sync>(&self, starts: &[S], threads: usize) -> MultiStart
    where
        M: Sync,
    {
        let next = AtomicUsize::new(0);
        let results = Mutex::new(Vec::with_capacity(starts.len()));
        let work = || {
            while let Some((index, start)) = {
                let index = next.fetch_add(1, Ordering::Relaxed);
                starts.get(index).map(|start| (index, start))
            } {
                let fit = self.solve(start.as_ref());
                // A thread that panics does so in the model, and this propagates it.
                results.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((index, fit));
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads.min(starts.len()) {
                scope.spawn(work);
            }
            work();
        });
        let mut fits = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        fits.sort_by_key(|(index, _)| *index);
        MultiStart { fits: fits.into_iter().map(|(_, fit)| fit).collect() }
    }
}

fn check_count(what: &'static str, found: usize, expected: usize) -> Result<(), FitError> {
    if found == expected { Ok(()) } else { Err(FitError::Count { what, found, expected }) }
}

fn check_positive(what: &'static str, value: f64) -> Result<(), FitError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(FitError::Option { what, value }) }
}
