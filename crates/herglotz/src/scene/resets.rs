//! The events of a scene that change the state.

use super::SceneError;
use super::file::{DirectionName, EventTable, ImpactLaw};
use super::forces::of_assignment;
use super::location::{Location, Named};
use crate::runtime::{Formula, FormulaDirection, FormulaError, FormulaReset, Impact};

/// The number of the reset of each event in the formula; `None` for an event without one.
pub(super) type ResetNumbers = Vec<Option<usize>>;

/// The formula with the resets and impacts of the events, on whose surfaces coordinates stay that come to rest there.
pub(super) fn with_resets(
    text: &str,
    mut formula: Formula,
    events: &[EventTable],
) -> Result<(Formula, ResetNumbers), SceneError> {
    let mut numbers = Vec::with_capacity(events.len());
    for event in events {
        check(text, event)?;
        let number = formula.resets();
        match (&event.then, &event.impact) {
            (Some(then), _) => formula = with_reset(text, &formula, event, then)?,
            (None, Some(law)) => formula = with_impact(text, &formula, event, law)?,
            (None, None) => {
                numbers.push(None);
                continue;
            }
        }
        numbers.push(Some(number));
    }
    let Some(event) = events.iter().find(|event| event.rest.is_some()) else { return Ok((formula, numbers)) };
    let refused = |error: FormulaError| SceneError::at(text, event.when.span(), error.to_string());
    Ok((formula.with_resting_contact().map_err(refused)?, numbers))
}

/// Rejects entries of an event that exclude each other.
fn check(text: &str, event: &EventTable) -> Result<(), SceneError> {
    let refuse = |span, message: &str| Err(SceneError::at(text, span, message));
    let EventTable { then, impact, rest, from, direction, terminal, .. } = event;
    let Some((change, key)) =
        then.as_ref().map(|then| (then.span(), "then")).or(impact.as_ref().map(|impact| (impact.span(), "impact")))
    else {
        return match rest {
            Some(rest) => refuse(rest.span(), "`rest` belongs to a reset; add `then` or `impact`, or remove `rest`"),
            None => Ok(()),
        };
    };
    if let (Some(impact), Some(_)) = (impact, then) {
        return refuse(impact.span(), "give the new state by `then` or by `impact`, not by both");
    }
    if *terminal {
        let message =
            format!("a terminal event ends the motion, which `{key}` continues; remove `terminal` or `{key}`");
        return refuse(change, &message);
    }
    if let Some(from) = from {
        return refuse(from.span(), &format!("a reset acts from the start; remove `from` or `{key}`"));
    }
    if let (Some(impact), DirectionName::Rising) = (impact, direction) {
        return refuse(impact.span(), "an impact is where the function falls; change its sign, and remove `direction`");
    }
    Ok(())
}

fn with_reset(
    text: &str,
    formula: &Formula,
    event: &EventTable,
    then: &Location<Named<String>>,
) -> Result<Formula, SceneError> {
    let direction = match event.direction {
        DirectionName::Rising => FormulaDirection::Rising,
        DirectionName::Falling => FormulaDirection::Falling,
        DirectionName::Both => FormulaDirection::Both,
    };
    let (values, rest) = (pairs(then), event.rest.as_ref().map(|rest| pairs(rest)));
    let reset = FormulaReset { when: &event.when, direction, then: &values, rest: rest.as_deref() };
    formula.with_reset(reset).map_err(|error| {
        if values.is_empty() {
            return SceneError::at(text, then.span(), error.to_string());
        }
        // With each text by itself, to find the one of the error.
        let when_alone =
            formula.with_reset(FormulaReset { then: &[(formula.action(), formula.action())], rest: None, ..reset });
        of_event(text, formula, event, when_alone.err(), &error)
    })
}

fn with_impact(
    text: &str,
    formula: &Formula,
    event: &EventTable,
    law: &Location<ImpactLaw>,
) -> Result<Formula, SceneError> {
    let rest = event.rest.as_ref().map(|rest| pairs(rest));
    let of = match **law {
        ImpactLaw::Elastic => Impact::Elastic,
        ImpactLaw::Restitution(e) => Impact::Restitution(e),
        ImpactLaw::Conformal(factor) => Impact::Conformal(factor),
    };
    formula.with_impact(&event.when, of, rest.as_deref()).map_err(|error| {
        let elastic = formula.with_impact(&event.when, Impact::Elastic, None);
        match elastic.err() {
            None if matches!(error, FormulaError::Impact { .. }) => SceneError::at(text, law.span(), error.to_string()),
            of_when => of_event(text, formula, event, of_when, &error),
        }
    })
}

/// The names and the new values of a reset.
fn pairs(table: &Named<String>) -> Vec<(&str, &str)> {
    table.0.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect()
}

/// The error of an event with its position: in the function, in a new value or in a name.
fn of_event(
    text: &str,
    formula: &Formula,
    event: &EventTable,
    of_when: Option<FormulaError>,
    error: &FormulaError,
) -> SceneError {
    match of_when {
        Some(FormulaError::Parse(error)) => return SceneError::in_string(text, event.when.span(), &error),
        Some(error) => return SceneError::at(text, event.when.span(), error.to_string()),
        None => {}
    }
    for (name, value) in event.then.iter().chain(&event.rest).flat_map(|table| &table.0) {
        let alone = [(name.as_str(), value.as_str())];
        let direction = FormulaDirection::Both;
        if let Err(error) = formula.with_reset(FormulaReset { when: "t", direction, then: &alone, rest: None }) {
            return of_assignment(text, (name, value), &error);
        }
    }
    // A variable that is assigned twice is known by its second name.
    let named = |error: &FormulaError| {
        let FormulaError::Target(error) = error else { return None };
        let mut tables = event.then.iter().chain(&event.rest).flat_map(|table| &table.0);
        tables.rfind(|(name, _)| ***name == *error.text)
    };
    match named(error) {
        Some(pair) => of_assignment(text, (&pair.0, &pair.1), error),
        None => SceneError::at(text, event.then.as_ref().map_or(event.when.span(), Location::span), error.to_string()),
    }
}
