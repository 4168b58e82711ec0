//! Weighted residuals and their Jacobian.

use crate::{FitError, Loss, Model, ModelFailure};
use nalgebra::{DMatrix, DVector};

/// `r_i(theta) = w_i (model_i(theta) - y_i)`, with the loss.
pub(crate) struct Residuals<'a, M> {
    pub model: &'a M,
    pub names: Vec<String>,
    pub data: Vec<f64>,
    pub weights: Vec<f64>,
    pub loss: Loss,
    /// The number of last residuals that are constraints: they are not data, and the loss does not apply to them.
    pub constraints: usize,
}

impl<M> Clone for Residuals<'_, M> {
    fn clone(&self) -> Self {
        let Residuals { model, names, data, weights, loss, constraints } = self;
        let (names, data, weights) = (names.clone(), data.clone(), weights.clone());
        Residuals { model, names, data, weights, loss: *loss, constraints: *constraints }
    }
}

/// Residuals at a point.
#[derive(Clone, Debug)]
pub(crate) struct Evaluation {
    pub theta: Vec<f64>,
    pub values: Vec<f64>,
    /// The weighted residuals r.
    pub residuals: DVector<f64>,
    /// The derivatives of r, without the loss, where they have been computed.
    pub jacobian: Option<DMatrix<f64>>,
    /// Half the sum of squares, each through the loss.
    pub cost: f64,
}

impl<M: Model> Residuals<'_, M> {
    /// The number of measured values with a weight, and of constraints.
    pub fn data_count(&self) -> usize {
        self.weights.iter().filter(|w| **w > 0.0).count()
    }

    /// The loss of a residual.
    pub fn loss_of(&self, index: usize) -> Loss {
        if index + self.constraints < self.data.len() { self.loss } else { Loss::Linear }
    }

    pub fn evaluate(&self, theta: &[f64], with_jacobian: bool) -> Result<Evaluation, ModelFailure> {
        let count = self.data.len();
        let mut values = vec![f64::NAN; count];
        let mut jacobian = with_jacobian.then(|| DMatrix::from_element(count, theta.len(), f64::NAN));
        self.model.evaluate(theta, &mut values, jacobian.as_mut())?;
        let mut residuals = DVector::zeros(count);
        let mut cost = 0.0;
        for i in (0..count).filter(|i| self.weights[*i] > 0.0) {
            let r = self.weights[i] * (values[i] - self.data[i]);
            if !r.is_finite() {
                return Err(ModelFailure::Value { index: i, value: values[i] });
            }
            residuals[i] = r;
            cost += self.loss_of(i).cost(r);
        }
        if !f64::is_finite(cost) {
            return Err(ModelFailure::Undefined(format!("the cost is {cost}")));
        }
        if let Some(jacobian) = &mut jacobian {
            for (j, mut column) in jacobian.column_iter_mut().enumerate() {
                for (i, weight) in self.weights.iter().enumerate() {
                    // A value without weight may be undefined, and so may its derivatives.
                    let weighted = if *weight > 0.0 { weight * column[i] } else { 0.0 };
                    if !weighted.is_finite() {
                        let parameter = self.names[j].clone();
                        return Err(ModelFailure::Derivative { index: i, parameter, value: column[i] });
                    }
                    column[i] = weighted;
                }
            }
        }
        Ok(Evaluation { theta: theta.to_vec(), values, residuals, jacobian, cost })
    }

    /// The error of a model that cannot be evaluated.
    pub fn failed(&self, parameters: &[f64], failure: ModelFailure) -> FitError {
        FitError::Model { names: self.names.clone(), parameters: parameters.to_vec(), failure }
    }

    /// The derivative of the cost with respect to each parameter, if the Jacobian has been computed.
    pub fn gradient(&self, at: &Evaluation) -> Option<DVector<f64>> {
        let influence = |i: usize, r: f64| self.loss_of(i).term(r).influence;
        let influence = DVector::from_fn(self.data.len(), |i, _| influence(i, at.residuals[i]));
        at.jacobian.as_ref().map(|jacobian| jacobian.tr_mul(&influence))
    }
}
