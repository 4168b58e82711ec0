//! The forces of a scene.

use super::SceneError;
use super::file::FrictionTable;
use super::location::{Location, Named};
use crate::runtime::{Formula, FormulaError, Friction};

/// The key of Rayleigh's dissipation function.
const RAYLEIGH: &str = "rayleigh";

/// The formula with the forces of a table.
pub(super) fn with_forces(
    text: &str,
    formula: Formula,
    table: Option<&Location<Named<String>>>,
) -> Result<Formula, SceneError> {
    let Some(table) = table else { return Ok(formula) };
    let is_coordinate = formula.coordinates().iter().any(|name| name == RAYLEIGH);
    table.0.iter().try_fold(formula, |formula, (name, force)| {
        let with = match name.as_str() {
            RAYLEIGH if !is_coordinate => formula.with_rayleigh(force),
            coordinate => formula.with_force(coordinate, force),
        };
        with.map_err(|error| of_assignment(text, (name, force), &error))
    })
}

/// The formula with the friction of a table.
pub(super) fn with_friction(text: &str, formula: Formula, table: &Named<FrictionTable>) -> Result<Formula, SceneError> {
    table.0.iter().try_fold(formula, |formula, (name, of)| {
        let part = |part: &Option<Location<String>>| part.as_ref().map(|text| (**text).clone());
        let (sticking, surface) = (part(&of.sticking), part(&of.surface));
        let friction = Friction { sliding: &of.sliding, sticking: sticking.as_deref(), surface: surface.as_deref() };
        formula.with_friction(name, friction).map_err(|error| {
            // The formula that cannot be read is the first one that is wrong by itself.
            let wrong = of.formulas().find(|text| formula.expression(text).is_err()).unwrap_or(&of.sliding);
            of_assignment(text, (name, wrong), &error)
        })
    })
}

/// An error of a formula that is assigned to a name.
pub(super) fn of_assignment(
    text: &str,
    (name, value): (&Location<String>, &Location<String>),
    error: &FormulaError,
) -> SceneError {
    match error {
        FormulaError::Parse(error) => SceneError::in_string(text, value.span(), error),
        FormulaError::Target(error) => {
            let mut at_name = SceneError::at(text, name.span(), error.message.clone());
            at_name.error.nearest.clone_from(&error.nearest);
            at_name
        }
        error => SceneError::at(text, value.span(), error.to_string()),
    }
}
