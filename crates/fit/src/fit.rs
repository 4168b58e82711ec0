//! The result of a fit.

use crate::{Bound, FitStatus};
use nalgebra::{DMatrix, DVector};
use std::fmt::{Display, Formatter};

/// The result of a fit: parameters, residuals, how they were found, and how well the data determine them.
///
/// `println!("{fit}")` writes a table of the parameters with their standard errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The names of the parameters.
    pub names: Vec<String>,
    /// The parameters.
    pub parameters: Vec<f64>,
    /// For each parameter the bound at which it is held, if it is.
    pub at_bounds: Vec<Option<Bound>>,
    /// How the fit ended.
    pub status: FitStatus,
    /// Half the sum of the squares of the weighted residuals, each through the loss.
    pub cost: f64,
    /// The values of the model.
    pub values: Vec<f64>,
    /// The weighted residuals `w_i (model_i - y_i)`; 0 for values without weight.
    pub residuals: DVector<f64>,
    /// The derivatives of the weighted residuals.
    pub jacobian: DMatrix<f64>,
    /// The number of times that the parameters were improved, or an improvement was sought: evaluated Jacobians.
    pub iterations: usize,
    /// The number of evaluations of the values of the model.
    pub evaluations: usize,
    /// The rank of the columns of the Jacobian that belong to parameters that are not held at a bound.
    pub rank: usize,
    /// The number of values with a weight, less that of the parameters that are not held at a bound.
    pub degrees_of_freedom: usize,
    /// The estimated variance s^2 of a residual with weight 1: the sum of squares divided by the degrees of freedom, and
    /// its robust counterpart for other losses. `None` without degrees of freedom. If the weights are the inverses of the
    /// true standard deviations it is about 1.
    pub residual_variance: Option<f64>,
    /// Whether the weights are the inverses of known standard deviations: the covariance is then that of these, and is not
    /// scaled by the variance of the residuals.
    pub absolute_deviations: bool,
    /// The cofactor matrix `(J^T J)^-1`; `None` where the data do not determine the parameters. It is the covariance of
    /// the parameters if the weights are the inverses of the true standard deviations. The rows and columns of parameters
    /// at bounds are zero: the others are judged as if these were known.
    pub cofactors: Option<DMatrix<f64>>,
}

impl Fit {
    /// The value of a parameter.
    pub fn parameter(&self, name: &str) -> Option<f64> {
        self.names.iter().position(|n| n == name).map(|i| self.parameters[i])
    }

    /// The covariance of the parameters, `s^2 (J^T J)^-1` with the [variance](Self::residual_variance) s^2 of the residuals;
    /// with [known standard deviations](Self::absolute_deviations) s is 1.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let variance = if self.absolute_deviations { 1.0 } else { self.residual_variance? };
        Some(self.cofactors.as_ref()? * variance)
    }

    /// How standard errors are computed, in words.
    pub fn of_errors(&self) -> String {
        match self.residual_variance {
            _ if self.absolute_deviations => "standard errors are those of the given deviations".to_owned(),
            Some(s) => format!("standard errors are scaled by the residuals, whose deviation is {:.3e}", s.sqrt()),
            None => "there are no standard errors: as many unknowns as data".to_owned(),
        }
    }

    /// The standard error of each parameter, the square root of its variance; `None` for parameters at bounds, and where
    /// there is no covariance.
    pub fn standard_errors(&self) -> Vec<Option<f64>> {
        let Some(covariance) = self.covariance() else { return vec![None; self.names.len()] };
        let error = |(i, bound): (usize, &Option<Bound>)| bound.is_none().then(|| covariance[(i, i)].sqrt());
        self.at_bounds.iter().enumerate().map(error).collect()
    }

    /// The standard error of a parameter.
    pub fn standard_error(&self, name: &str) -> Option<f64> {
        let index = self.names.iter().position(|n| n == name)?;
        self.standard_errors()[index]
    }

    /// The correlation matrix of the parameters; those at bounds are correlated with no other.
    pub fn correlation(&self) -> Option<DMatrix<f64>> {
        let cofactors = self.cofactors.as_ref()?;
        let scale = cofactors.diagonal().map(f64::sqrt);
        Some(DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
            if i == j {
                1.0
            } else if scale[i] == 0.0 || scale[j] == 0.0 {
                0.0
            } else {
                cofactors[(i, j)] / (scale[i] * scale[j])
            }
        }))
    }
}

impl Display for Fit {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}", self.status)?;
        writeln!(
            f,
            "cost {:.6e}, {} iterations, {} evaluations, {} degrees of freedom",
            self.cost, self.iterations, self.evaluations, self.degrees_of_freedom
        )?;
        let width = self.names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        let errors = self.standard_errors();
        for (i, name) in self.names.iter().enumerate() {
            write!(f, "{name:width$} = {:.12e}", self.parameters[i])?;
            match (self.at_bounds[i], errors[i]) {
                (Some(Bound::Lower), _) => writeln!(f, " at its lower bound")?,
                (Some(Bound::Upper), _) => writeln!(f, " at its upper bound")?,
                (Some(Bound::Fixed), _) => writeln!(f, " held fixed")?,
                (None, Some(error)) => writeln!(f, " +- {error:.3e}")?,
                (None, None) => writeln!(f)?,
            }
        }
        if self.cofactors.is_some() {
            writeln!(f, "{}", self.of_errors())?;
        }
        if let Some(correlation) = self.correlation() {
            const LEAST_LISTED: f64 = 0.1;
            const MOST_LISTED: usize = 10;
            let n = self.names.len();
            let mut pairs: Vec<_> = (0..n).flat_map(|j| (0..j).map(move |i| (i, j))).collect();
            pairs.retain(|p| correlation[*p].abs() >= LEAST_LISTED);
            pairs.sort_by(|a, b| correlation[*b].abs().total_cmp(&correlation[*a].abs()));
            for (i, j) in pairs.into_iter().take(MOST_LISTED) {
                let correlation = correlation[(i, j)];
                writeln!(f, "correlation of {} and {}: {correlation:.3}", self.names[i], self.names[j])?;
            }
        }
        Ok(())
    }
}
