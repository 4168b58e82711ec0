//! Starts that were moved to the constraints on request, and how they depend on the start that was given.

use super::formula_system::FormulaSystem;
use super::sized::Sized;
use crate::{Gradient, InitialVelocity, Motion, RuntimeError, StateDerivative};
use contact_geom::Parametric;
use contact_geom::nalgebra::{DMatrix, DVector, RowDVector};
use discrete_herglotz::Vector;
use discrete_herglotz::sensitivity::{Tangent, Variable};

/// The distance of differences, relative to a coordinate: those of fourth order then have errors of 1e-12.
const DISTANCE: f64 = 1e-3;

/// A start that moves by less, relative to its size, is on the constraints up to round-off, and the tangent of a run has the
/// derivatives of its projection.
const ON_CONSTRAINTS: f64 = 1e-12;

/// The derivatives of the start on the constraints, `(q, v)` of the n coordinates of a formula, in the start that was given and
/// in the parameters.
pub(super) struct MovedStart {
    n: usize,
    in_start: DMatrix<f64>,
    in_parameters: DMatrix<f64>,
}

impl MovedStart {
    /// That of a motion; `None` where its start is on the constraints, or not moved.
    pub fn of<L: FormulaSystem<N> + Parametric<N>, const N: usize>(
        system: &Sized<L, N>,
        motion: &Motion,
    ) -> Result<Option<Self>, RuntimeError> {
        if !motion.project {
            return Ok(None);
        }
        let given = *system.problem(&motion.start)?.start();
        let (t, n) = (motion.start.t, system.0.formula().dimension());
        let moved = system.0.projected(t, given)?;
        let (size, by) = (given.q.amax() + given.v.amax(), (moved.q - given.q).amax() + (moved.v - given.v).amax());
        if by <= ON_CONSTRAINTS * size {
            return Ok(None);
        }
        let numbers = |lagrangian: &L, at| {
            let x = lagrangian.projected(t, at)?;
            Ok::<_, RuntimeError>(DVector::from_fn(2 * n, |i, _| if i < n { x.q[i] } else { x.v[i - n] }))
        };
        let slope = |f: &dyn Fn(f64) -> Result<DVector<f64>, RuntimeError>, size: f64| {
            let d = DISTANCE * (1.0 + size.abs());
            Ok::<_, RuntimeError>(((f(d)? - f(-d)?) * 8.0 - (f(2.0 * d)? - f(-2.0 * d)?)) / (12.0 * d))
        };
        let mut in_start = DMatrix::zeros(2 * n, 2 * n);
        for k in 0..2 * n {
            let moved = |by: f64| {
                let mut at = given;
                if k < n {
                    at.q[k] += by
                } else {
                    at.v[k - n] += by
                }
                numbers(&system.0, at)
            };
            in_start.set_column(k, &slope(&moved, if k < n { given.q[k] } else { given.v[k - n] })?);
        }
        let parameters: Vec<(String, f64)> =
            system.0.formula().parameters().map(|(name, value)| (name.to_owned(), value)).collect();
        let mut in_parameters = DMatrix::zeros(2 * n, parameters.len());
        for (k, (name, value)) in parameters.iter().enumerate() {
            let moved = |by: f64| {
                let mut lagrangian = system.0.clone();
                lagrangian.set(name, value + by)?;
                numbers(&lagrangian, given)
            };
            in_parameters.set_column(k, &slope(&moved, *value)?);
        }
        Ok(Some(MovedStart { n, in_start, in_parameters }))
    }

    /// The variables of the start on the constraints, and then those that are wanted and are no variables of the start.
    pub fn variables(&self, wanted: &[Variable]) -> Vec<Variable> {
        let start = (0..self.n).map(Variable::Position).chain((0..self.n).map(Variable::Velocity));
        start.chain(wanted.iter().filter(|of| self.number(of).is_none()).cloned()).collect()
    }

    /// The number of a variable of the start that was given.
    fn number(&self, of: &Variable) -> Option<usize> {
        match of {
            Variable::Position(i) => Some(*i).filter(|i| *i < self.n),
            Variable::Velocity(i) => Some(self.n + i).filter(|i| *i < 2 * self.n),
            _ => None,
        }
    }

    /// The derivatives in the wanted variables, from those in [these](Self::variables).
    pub fn push(&self, found: Tangent, wanted: &[Variable], parameters: &[String]) -> Tangent {
        let mut others = 2 * self.n..;
        // The factors of the columns of the start, and the index of one that is added.
        let combinations: Vec<(RowDVector<f64>, Option<usize>)> = wanted
            .iter()
            .map(|of| match self.number(of) {
                Some(k) => (self.in_start.column(k).transpose(), None),
                None => {
                    let index = match of {
                        Variable::Parameter(name) => parameters.iter().position(|known| known == name),
                        _ => None,
                    };
                    let none = || RowDVector::zeros(2 * self.n);
                    (index.map_or_else(none, |k| self.in_parameters.column(k).transpose()), others.next())
                }
            })
            .collect();
        let states = |columns: &[StateDerivative]| {
            combinations.iter().map(|(factors, other)| combined(columns, factors, *other)).collect::<Vec<_>>()
        };
        let numbers = |of: &[f64]| {
            let sum = |(factors, other): &(RowDVector<f64>, Option<usize>)| {
                let start: f64 = factors.iter().zip(of).map(|(factor, x)| factor * x).sum();
                start + other.and_then(|i| of.get(i)).copied().unwrap_or(0.0)
            };
            combinations.iter().map(sum).collect::<Vec<_>>()
        };
        let mut found = found;
        found.columns = states(&found.columns);
        found.rows.iter_mut().for_each(|row| row.columns = states(&row.columns));
        found.switches.iter_mut().for_each(|switch| switch.derivatives = numbers(&switch.derivatives));
        found
    }

    /// The gradient in the start that was given and in the parameters, from that in the start on the constraints.
    pub fn pull(&self, of: Gradient) -> Gradient {
        let start = DVector::from_fn(2 * self.n, |i, _| if i < self.n { of.q[i] } else { of.rate[i - self.n] });
        let (in_start, in_parameters) = (self.in_start.tr_mul(&start), self.in_parameters.tr_mul(&start));
        let part =
            |from: usize, all: usize| Vector::from_fn(all, |i| if i < self.n { in_start[from + i] } else { 0.0 });
        let mut found = Gradient { q: part(0, of.q.len()), rate: part(self.n, of.rate.len()), ..of };
        found.parameters.iter_mut().zip(&in_parameters).for_each(|(sum, more)| *sum += more);
        found
    }
}

/// A sum of derivatives with factors, and one more of them.
fn combined(columns: &[StateDerivative], factors: &RowDVector<f64>, other: Option<usize>) -> StateDerivative {
    let n = columns.first().map_or(0, |column| column.q.len());
    let zero = || Vector::zeros(n);
    let mut sum = StateDerivative { q: zero(), v: zero(), p: zero(), z: 0.0 };
    let all = columns.iter().zip(factors.iter().copied()).chain(other.and_then(|i| Some((columns.get(i)?, 1.0))));
    for (column, factor) in all {
        sum.q += &(&column.q * factor);
        sum.v += &(&column.v * factor);
        sum.p += &(&column.p * factor);
        sum.z += column.z * factor;
    }
    sum
}

/// Refuses a start that is moved from given momenta, whose variables are not those of the start on the constraints.
pub(super) fn check(motion: &Motion) -> Result<(), RuntimeError> {
    if motion.project && !matches!(motion.start.velocity, InitialVelocity::Velocity(_)) {
        let why = "is requested of a start with given momenta; for derivatives give velocities, or a start on the constraints";
        return Err(RuntimeError::argument("project", why));
    }
    Ok(())
}
