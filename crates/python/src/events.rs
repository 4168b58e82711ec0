//! Requests for events, and for the resets that occur at them.

use crate::arrays::{named, shown, value_error};
use crate::system::System;
use formula_lagrangian::Reset;
use herglotz_runtime::{Direction, Event, Formula, Impact};
use pyo3::prelude::*;

/// Variables with the formulas of their new values.
type Assignments = Vec<(String, String)>;

/// The change of the state at an event, as new values or as the name and the number of an impact law, and the new values
/// where changes accumulate.
type GivenChange<'py> = (Option<Assignments>, Option<(String, Option<Bound<'py, PyAny>>)>, Option<Assignments>);

/// The text of an event, its direction, whether it ends the motion, and how the state changes there.
pub type GivenEvent<'py> = (String, Bound<'py, PyAny>, bool, Option<GivenChange<'py>>);

/// The requested events, and the system with their resets, on whose surfaces coordinates stay that come to rest there.
pub fn events(given: Vec<GivenEvent<'_>>, of: &System) -> PyResult<(herglotz_runtime::System, Vec<Event>)> {
    let mut formula = of.formula.clone();
    let mut events = Vec::with_capacity(given.len());
    for (text, direction, terminal, change) in given {
        let direction = self::direction(&text, &direction)?;
        let reset = change.is_some().then(|| formula.resets());
        if let Some(change) = change {
            named("the event", &text, formula.expression(&text).map_err(Into::into))?;
            formula = with_change(&formula, &text, direction, change)?;
        }
        events.push((text, direction, terminal, reset));
    }
    let has_resets = formula.resets() > of.formula.resets();
    if has_resets {
        formula = formula.with_resting_contact().map_err(value_error)?;
    }
    // In the coordinates with the modes of the contacts.
    let events = events.into_iter().map(|(text, direction, terminal, reset)| {
        let function = named("the event", &text, formula.expression(&text).map_err(Into::into))?;
        Ok(Event { direction, terminal, reset, ..Event::new(function) })
    });
    let events = events.collect::<PyResult<_>>()?;
    let inner =
        if has_resets { herglotz_runtime::System::new(&formula).map_err(value_error)? } else { of.inner.clone() };
    Ok((inner, events))
}

/// The names of the coordinates of a system with the resets of events, with those of the modes of resting contact.
#[pyfunction]
pub fn coordinates_of(system: &System, given: Vec<GivenEvent<'_>>) -> PyResult<Vec<String>> {
    Ok(events(given, system)?.0.formula().coordinates())
}

/// The formula with the reset or the impact of an event.
fn with_change(
    formula: &Formula,
    text: &str,
    direction: Direction,
    (then, impact, rest): GivenChange<'_>,
) -> PyResult<Formula> {
    let rest = rest.as_ref().map(borrowed);
    let Some((law, number)) = impact else {
        let given = then.unwrap_or_default();
        let then = borrowed(&given);
        let reset = Reset { when: text, direction: of_reset(direction), then: &then, rest: rest.as_deref() };
        return named("the reset of the event", text, formula.with_reset(reset).map_err(Into::into));
    };
    if direction == Direction::Rising {
        return Err(value_error(format!(
            "the event {text:?} has an impact, which is where its function falls; change the sign of the function, and \
             remove the direction"
        )));
    }
    let number_is_given = number.is_some();
    let number = |what: &str| match &number {
        Some(x) => crate::arrays::number(&format!("the {what} of the event {text:?}"), x),
        None => {
            Err(value_error(format!("the impact {law:?} of the event {text:?} needs a number, as in ({law:?}, 0.8)")))
        }
    };
    let law = match law.as_str() {
        "elastic" if number_is_given => {
            return Err(value_error(format!(
                "the impact \"elastic\" of the event {text:?} takes no number; for an impact that loses energy write \
                 (\"restitution\", 0.8)"
            )));
        }
        "elastic" => Impact::Elastic,
        "restitution" => Impact::Restitution(number("restitution")?),
        "conformal" => Impact::Conformal(number("conformal factor")?),
        _ => {
            return Err(value_error(format!(
                "the impact {law:?} of the event {text:?} must be \"elastic\", (\"restitution\", 0.8) or \
                 (\"conformal\", 0.64)"
            )));
        }
    };
    named("the impact of the event", text, formula.with_impact(text, law, rest.as_deref()).map_err(Into::into))
}

fn borrowed(of: &Assignments) -> Vec<(&str, &str)> {
    of.iter().map(|(variable, value)| (variable.as_str(), value.as_str())).collect()
}

fn of_reset(direction: Direction) -> formula_lagrangian::Direction {
    match direction {
        Direction::Rising => formula_lagrangian::Direction::Rising,
        Direction::Falling => formula_lagrangian::Direction::Falling,
        Direction::Both => formula_lagrangian::Direction::Both,
    }
}

/// The direction of the event with a text.
fn direction(text: &str, given: &Bound<'_, PyAny>) -> PyResult<Direction> {
    match given.extract::<String>().as_deref() {
        Ok("rising") => Ok(Direction::Rising),
        Ok("falling") => Ok(Direction::Falling),
        Ok("both") => Ok(Direction::Both),
        _ => {
            let shown = given.extract().map_or_else(|_| shown(given), |text: String| format!("{text:?}"));
            // SciPy gives directions as numbers.
            let instead = match given.extract::<f64>() {
                Ok(x) if x > 0.0 => ": write \"rising\"",
                Ok(x) if x < 0.0 => ": write \"falling\"",
                Ok(_) => ": write \"both\"",
                Err(_) => "",
            };
            Err(value_error(format!(
                "the direction {shown} of the event {text:?} must be \"rising\", \"falling\" or \"both\"{instead}"
            )))
        }
    }
}
