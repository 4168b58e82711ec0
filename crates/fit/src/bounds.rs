//! Bounds of parameters.

use crate::FitError;

/// The side of its interval on which a parameter is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// The lower bound.
    Lower,
    /// The upper bound.
    Upper,
    /// Both bounds are the same number: the parameter is not fitted.
    Fixed,
}

/// The intervals of all parameters.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
}

impl Bounds {
    pub fn none(count: usize) -> Self {
        Bounds { lower: vec![f64::NEG_INFINITY; count], upper: vec![f64::INFINITY; count] }
    }

    pub fn set(&mut self, name: &str, index: usize, lower: f64, upper: f64) -> Result<(), FitError> {
        // Comparisons with a NaN are false.
        let is_interval = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
        if !is_interval {
            return Err(FitError::Bounds { name: name.to_owned(), lower, upper });
        }
        (self.lower[index], self.upper[index]) = (lower, upper);
        Ok(())
    }

    /// The nearest number within the interval; a NaN remains one.
    pub fn project(&self, index: usize, value: f64) -> f64 {
        if value < self.lower[index] {
            self.lower[index]
        } else if value > self.upper[index] {
            self.upper[index]
        } else {
            value
        }
    }

    pub fn contains(&self, index: usize, value: f64) -> bool {
        (self.lower[index]..=self.upper[index]).contains(&value)
    }

    /// The bound that holds a parameter back, where the cost has this derivative: it would decrease beyond the bound.
    pub fn holds(&self, index: usize, value: f64, derivative: f64) -> Option<Bound> {
        if self.lower[index] == self.upper[index] {
            Some(Bound::Fixed)
        } else if value <= self.lower[index] && derivative >= 0.0 {
            Some(Bound::Lower)
        } else if value >= self.upper[index] && derivative <= 0.0 {
            Some(Bound::Upper)
        } else {
            None
        }
    }
}
