//! The theorems of the discrete theory, evaluated at points of a motion.

use super::discrete::FormulaStep;
use crate::{FormulaMethod, RuntimeError, StatementResidual};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, Symmetry, numbers::max_or_nan};
use discrete_herglotz::{AnyIntegrator, DiscreteLagrangian, gauss::Gauss, statements};
use formula_lagrangian::{Formula, FormulaError};

/// The largest number of coordinates for which the theorems of a discrete Lagrangian of one's own are evaluated.
const MOST_OF_METHODS: usize = 4;

/// Two positions of a motion that are one step apart, and the action at the first.
pub(super) struct Points {
    pub t: f64,
    pub q0: Vec<f64>,
    pub q1: Vec<f64>,
    pub z0: f64,
}

/// The theorems for the discrete Lagrangian of contact Gauss collocation: the largest residuals over some points.
///
/// They are compiled for a few dimensions; a formula in another one uses the next larger. With second derivatives of
/// second derivatives this is the longest code of each dimension, and its run time is not critical.
pub(super) fn theorems(
    formula: &Formula,
    stages: usize,
    h: f64,
    points: &[Points],
) -> Result<Vec<StatementResidual>, RuntimeError> {
    macro_rules! of {
        ($($n:literal)*) => {
            match formula.dimension() {
                $(found if found <= $n => within::<$n>(formula, stages, h, points),)*
                found => Err(FormulaError::Dimension { found }.into()),
            }
        };
    }
    of!(1 2 4 16)
}

/// The theorems for a discrete Lagrangian of one's own: the largest residuals over some points. Its symmetries are not known.
/// They are compiled for one number of coordinates; in more there are none.
pub(super) fn of_method(
    method: &FormulaMethod,
    h: f64,
    points: &[Points],
) -> Result<Vec<StatementResidual>, RuntimeError> {
    if method.dimension() > MOST_OF_METHODS {
        return Ok(Vec::new());
    }
    let ld = FormulaStep::<MOST_OF_METHODS>::new(method, h)?;
    residuals(&ld, &[], (method.name(), h), points)
}

fn within<const N: usize>(
    formula: &Formula,
    stages: usize,
    h: f64,
    points: &[Points],
) -> Result<Vec<StatementResidual>, RuntimeError> {
    let lagrangian = formula.lagrangian_within::<N>()?;
    let (gauss, symmetries) = (Gauss::new::<N>(lagrangian.clone(), stages, h)?, lagrangian.symmetries());
    let method = AnyIntegrator::Gauss { stages }.to_string();
    residuals(&gauss, &symmetries, (&method, h), points)
}

/// The largest residuals of the statements for a discrete Lagrangian over some points.
fn residuals<D: DiscreteLagrangian<N>, const N: usize>(
    ld: &D,
    symmetries: &[Symmetry<N>],
    (method, h): (&str, f64),
    points: &[Points],
) -> Result<Vec<StatementResidual>, RuntimeError> {
    let vector = |q: &[f64]| SVector::from_fn(|i, _| q.get(i).copied().unwrap_or(0.0));
    let point = |p: &Points| (p.t, DiscretePoint { q0: vector(&p.q0), q1: vector(&p.q1), z0: p.z0 });
    let mut points: Vec<(f64, DiscretePoint<N>)> = points.iter().map(point).collect();
    // Newton's method for the discrete Lagrangian measures its residual relative to the momentum at the start, and does
    // not converge where that is 0. Such points are dropped, unless all points fail.
    if points.iter().any(|(t, x)| ld.second_jet(*t, x).is_ok()) {
        points.retain(|(t, x)| ld.second_jet(*t, x).is_ok());
    }
    let mut stated = Vec::new();
    for statement in statements::STATEMENTS {
        let mut worst: Option<f64> = None;
        for (t, point) in &points {
            if let Some(residual) = statements::residual(statement, ld, symmetries, *t, point)? {
                worst = Some(worst.map_or(residual, |worst| max_or_nan(worst, residual)));
            }
        }
        if let Some(residual) = worst {
            stated.push(StatementResidual { statement, method: method.to_owned(), step_size: h, residual });
        }
    }
    Ok(stated)
}
