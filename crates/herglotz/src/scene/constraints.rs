//! The holonomic constraints of a scene.

use super::SceneError;
use super::location::Location;
use crate::runtime::{Formula, FormulaError};

/// The formula with the constraints of a list.
pub(super) fn with_constraints(
    text: &str,
    formula: Formula,
    list: Option<&Location<Vec<Location<String>>>>,
) -> Result<Formula, SceneError> {
    let Some(list) = list else { return Ok(formula) };
    list.iter().try_fold(formula, |formula, constraint| {
        formula.with_constraints(&[constraint.as_str()]).map_err(|error| match error {
            FormulaError::Parse(error) => SceneError::in_string(text, constraint.span(), &error),
            FormulaError::Constraints { .. } => {
                let all = FormulaError::Constraints { found: list.len(), coordinates: formula.dimension() };
                SceneError::at(text, list.span(), all.to_string())
            }
            error => SceneError::at(text, constraint.span(), error.to_string()),
        })
    })
}
