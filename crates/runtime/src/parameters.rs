//! Detection of parameters that are not used by any formula, most often misspelt ones.

use crate::RuntimeError;
use formula_lagrangian::{Formula, nearest_name};

/// Rejects parameters of a formula that are neither used in its value nor occur, as a word, in the texts of the
/// additional expressions.
///
/// ```
/// use herglotz_runtime::{Formula, check_parameters};
/// let formula = Formula::parse("x'^2/2 + gamma*z", &["x"], &[("gamma", -0.1), ("gama", -5.0), ("level", 2.0)])?;
/// let error = check_parameters(&formula, &["x - level"]).unwrap_err();
/// assert!(error.to_string().contains("`gama`") && error.to_string().ends_with("did you mean `gamma`?"));
/// # Ok::<(), herglotz_runtime::FormulaError>(())
/// ```
///
/// # Errors
/// [`RuntimeError::UnusedParameter`], with the nearest name that is used.
pub fn check_parameters(formula: &Formula, texts: &[&str]) -> Result<(), RuntimeError> {
    let of_formula: Vec<&str> = formula.used_parameters().collect();
    let in_texts = |name: &str| texts.iter().any(|text| words(text).any(|word| word == name));
    let (used, unused): (Vec<&str>, Vec<&str>) =
        formula.parameters().map(|(name, _)| name).partition(|name| of_formula.contains(name) || in_texts(name));
    let Some(name) = unused.first() else { return Ok(()) };
    let known = || used.iter().copied();
    let hint = match nearest_name(name, known()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if used.is_empty() => "the formulas use no parameters".to_owned(),
        None => format!("the formulas use {}", known().collect::<Vec<_>>().join(", ")),
    };
    Err(RuntimeError::UnusedParameter { name: (*name).to_owned(), hint })
}

/// The identifiers in a text.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_'))
}
