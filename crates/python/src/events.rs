//! Requests for events, and for the resets that occur at them.

use crate::arrays::{shown, value_error};
use crate::motion::named;
use crate::system::System;
use formula_lagrangian::Reset;
use herglotz::runtime::{Direction, Event};
use pyo3::prelude::*;

/// The text of an event, its direction, whether it ends the motion, and the new values of variables at it.
pub type GivenEvent<'py> = (String, Bound<'py, PyAny>, bool, Option<Vec<(String, String)>>);

/// The requested events, and the system with their resets.
pub fn events(given: Vec<GivenEvent<'_>>, of: &System) -> PyResult<(herglotz::runtime::System, Vec<Event>)> {
    let mut formula = of.formula.clone();
    let mut events = Vec::with_capacity(given.len());
    for (text, direction, terminal, then) in given {
        let function = named("the event", &text, formula.expression(&text).map_err(Into::into))?;
        let direction = self::direction(&text, &direction)?;
        let mut event = Event { direction, terminal, ..Event::new(function) };
        if let Some(then) = then {
            let then: Vec<(&str, &str)> =
                then.iter().map(|(variable, value)| (variable.as_str(), value.as_str())).collect();
            let reset = Reset { when: &text, direction: of_reset(direction), then: &then, rest: None };
            event.reset = Some(formula.resets());
            formula = named("the reset of the event", &text, formula.with_reset(reset).map_err(Into::into))?;
        }
        events.push(event);
    }
    let system = if formula.resets() > 0 {
        herglotz::runtime::System::new(&formula).map_err(value_error)?
    } else {
        of.inner.clone()
    };
    Ok((system, events))
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
