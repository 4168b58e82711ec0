//! Formulas in the index of an array, for the values of its entries.

use super::SceneError;
use super::location::Location;
use super::output::of_formula;
use crate::runtime::Formula;

/// The names of the indices along the directions of an array.
const INDICES: [&str; 3] = ["i", "j", "k"];

/// The values of a formula at all entries of an array: in the index `i`, with several directions also `j` and `k`, the number
/// `n` of entries, and the parameters.
pub(super) fn values(
    text: &str,
    name: &str,
    formula: &Location<&str>,
    sizes: &[usize],
    parameters: &[(String, f64)],
) -> Result<Vec<f64>, SceneError> {
    let refuse = |message: String| Err(SceneError::at(text, formula.span(), message));
    let Some(indices) = INDICES.get(..sizes.len()) else {
        return refuse("the start can be given by formulas for up to three directions".to_owned());
    };
    let count: usize = sizes.iter().product();
    let mut known: Vec<(&str, f64)> = parameters
        .iter()
        .filter(|(name, _)| !indices.contains(&name.as_str()))
        .map(|(name, x)| (name.as_str(), *x))
        .collect();
    if !known.iter().any(|(name, _)| *name == "n") {
        known.push(("n", count as f64));
    }
    let read = Formula::parse("0", indices, &known).and_then(|names| names.expression(formula));
    let read = read.map_err(|error| of_formula(text, formula.span(), &error.into()))?;
    if read.has_velocity() || read.has_action() {
        return refuse("the formula of a start can depend only on the index of an entry".to_owned());
    }
    let at = |entry: usize| {
        let mut rest = count;
        let index = sizes.iter().map(|size| {
            rest /= size;
            (entry / rest % size) as f64
        });
        let index: Vec<f64> = index.collect();
        read.at(0.0, &index, &vec![0.0; sizes.len()], 0.0)
    };
    let all: Vec<f64> = (0..count).map(at).collect();
    match all.iter().enumerate().find(|(_, x)| !x.is_finite()) {
        Some((k, x)) => refuse(format!("`{name}` is {x} at the entry {k}; it must be a finite number")),
        None => Ok(all),
    }
}
