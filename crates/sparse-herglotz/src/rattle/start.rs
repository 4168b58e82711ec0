//! Starts of motions under constraints of elements: checks and projections.

use super::solver::ConstraintSolver;
use crate::SparseError;
use crate::constraints::jacobian::element_of;
use crate::implicit::{NewtonConvergence, NewtonDecision, max_norm};
use discrete_herglotz::{StepError, constraints::OffConstraint, solve::ITERATION_LIMIT};

/// Deviations of a start up to this number of round-off units of the largest position or velocity are accepted.
const ROUND_OFFS: f64 = 64.0;

impl ConstraintSolver<'_> {
    /// Checks a start, padded, or projects it on request, and linearises the constraints there.
    ///
    /// # Errors
    /// [`SparseError::UndefinedConstraint`], [`SparseError::Dependent`], [`SparseError::OffConstraint`],
    /// [`SparseError::OffVelocity`], [`SparseError::NotProjected`].
    pub fn start(&mut self, q: &mut [f64], v: &mut [f64], off: OffConstraint) -> Result<(), SparseError> {
        self.evaluate(q);
        self.residual(q);
        self.check_finite()?;
        if off == OffConstraint::Refuse
            && let Some((constraint, distance)) = self.farthest(ROUND_OFFS * f64::EPSILON * max_norm(q))
        {
            let [list, element] = element_of(self.lists, constraint);
            return Err(SparseError::OffConstraint { list, element, distance });
        }
        self.check_independent()?;
        if off == OffConstraint::Project {
            self.move_onto(q)?;
            self.evaluate(q);
            self.check_independent()?;
        }
        self.linearise(q).map_err(|e| self.dependent(e))?;
        if off == OffConstraint::Project {
            let mut impulse = vec![0.0; self.y.len()];
            return self.project(v, &mut impulse).map_err(|e| self.dependent(e));
        }
        self.pattern.product(&self.g, v, &mut self.y);
        match self.farthest(ROUND_OFFS * f64::EPSILON * max_norm(v)) {
            Some((constraint, speed)) => {
                let [list, element] = element_of(self.lists, constraint);
                Err(SparseError::OffVelocity { list, element, speed })
            }
            None => Ok(()),
        }
    }

    fn check_finite(&self) -> Result<(), SparseError> {
        let mut rows = self.y.iter().zip(self.pattern.rows(&self.g));
        match rows.position(|(c, mut row)| !(c.is_finite() && row.all(|(_, g)| g.is_finite()))) {
            Some(constraint) => {
                let [list, element] = element_of(self.lists, constraint);
                Err(SparseError::UndefinedConstraint { list, element })
            }
            None => Ok(()),
        }
    }

    /// The constraint with the largest `|y|/|c_q|`, if it exceeds a bound, with that number.
    fn farthest(&self, bound: f64) -> Option<(usize, f64)> {
        let free = |i: usize| self.inverse_masses[i] > 0.0;
        let distances = self.y.iter().zip(self.pattern.rows(&self.g)).map(|(y, row)| {
            let slope = row.filter(|(i, _)| free(*i)).map(|(_, g)| g * g).sum::<f64>().sqrt();
            if *y == 0.0 { 0.0 } else { y.abs() / slope }
        });
        let largest = distances.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        largest.filter(|(_, distance)| distance.is_nan() || *distance > bound)
    }

    /// Checks that the constraints are independent at the position of the last evaluation.
    fn check_independent(&mut self) -> Result<(), SparseError> {
        match self.gram.dependent(&self.g, &self.weighted) {
            Some(constraint) => {
                let [list, element] = element_of(self.lists, constraint);
                Err(SparseError::Dependent { list, element })
            }
            None => Ok(()),
        }
    }

    /// The input error of a matrix that could not be factorised, although its constraints were found independent.
    fn dependent(&self, cause: StepError) -> SparseError {
        match cause {
            StepError::Singular { .. } => {
                let [list, element] = element_of(self.lists, 0);
                SparseError::Dependent { list, element }
            }
            _ => SparseError::NotProjected,
        }
    }

    /// Moves a position onto the constraints along the directions `M^-1 G^T`, by Newton's method.
    fn move_onto(&mut self, q: &mut [f64]) -> Result<(), SparseError> {
        let mut convergence = NewtonConvergence::expecting(f64::INFINITY);
        for _ in 0..ITERATION_LIMIT {
            self.linearise(q).map_err(|_| SparseError::NotProjected)?;
            self.residual(q);
            self.gram.solve(&mut self.y).map_err(|_| SparseError::NotProjected)?;
            self.respond();
            q.iter_mut().zip(&self.change).for_each(|(q, change)| *q += change);
            let (moved, scale) = (max_norm(&self.change), max_norm(q));
            if !(moved.is_finite() && scale.is_finite()) {
                return Err(SparseError::NotProjected);
            }
            if convergence.decide(moved, f64::EPSILON * scale) == NewtonDecision::Converged {
                return Ok(());
            }
        }
        Err(SparseError::NotProjected)
    }
}
