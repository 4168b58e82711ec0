//! The requested output of a motion.

use super::SceneError;
use super::checked::{finite, positive};
use super::file::{DirectionName, EventTable, RowsTable};
use super::location::{Location, Span};
use crate::runtime::{
    Column, Direction, Event, Expression, Formula, FormulaError, OutputTimes, RuntimeError, nearest_name, velocity_name,
};

/// The number of intervals between rows of a scene without `rows`: as many as a figure resolves.
const DEFAULT_ROWS: usize = 1000;

/// The maximal number of rows at given times, which are stored.
const MAX_ROWS: f64 = 1e7;

/// The times of the rows.
#[derive(Clone, Debug)]
pub(crate) enum RowTimes {
    /// At equal intervals of time.
    Every(f64),
    /// At the ends of a number of equal parts of the span.
    Parts(usize),
    /// At given times.
    At(Vec<f64>),
    /// At every n-th step.
    EveryStep(usize),
}

impl RowTimes {
    /// The output times of a motion from `t0` to `end`.
    pub fn when(&self, t0: f64, end: f64) -> OutputTimes {
        match self {
            // The only row is at the start.
            RowTimes::Parts(_) | RowTimes::Every(_) if t0 == end => OutputTimes::At(vec![t0]),
            RowTimes::EveryStep(steps) => OutputTimes::Every(*steps),
            RowTimes::At(times) => OutputTimes::At(times.clone()),
            RowTimes::Parts(parts) => {
                let of = |k: usize| if k == *parts { end } else { t0 + (end - t0) * (k as f64 / *parts as f64) };
                OutputTimes::At((0..=*parts).map(of).collect())
            }
            RowTimes::Every(every) => {
                // The tolerance is for a span that is a multiple of the interval up to rounding.
                let count = ((end - t0).abs() / every * (1.0 + 4.0 * f64::EPSILON)).floor();
                let stride = every.copysign(end - t0);
                let at = |k: usize| t0 + k as f64 * stride;
                let inside = |t: f64| if end < t0 { t.max(end) } else { t.min(end) };
                OutputTimes::At((0..=count as usize).map(at).map(inside).collect())
            }
        }
    }

    pub fn read(text: &str, rows: Option<&Location<RowsTable>>, (t0, end): (f64, f64)) -> Result<Self, SceneError> {
        let Some(rows) = rows else { return Ok(RowTimes::Parts(DEFAULT_ROWS)) };
        match (&rows.every, &rows.at, &rows.every_step) {
            (Some(every), None, None) => {
                let value = positive(text, every, "every")?;
                if (end - t0).abs() / value > MAX_ROWS {
                    let message =
                        format!("this gives more than {MAX_ROWS:e} rows; take a longer time between the rows");
                    return Err(SceneError::at(text, every.span(), message));
                }
                Ok(RowTimes::Every(value))
            }
            (None, Some(times), None) => Ok(RowTimes::At(times_in_order(text, times, "at", (t0, end))?)),
            (None, None, Some(steps)) if **steps == 0 => {
                Err(SceneError::at(text, steps.span(), "`every_step` is 0; it must be at least 1"))
            }
            (None, None, Some(steps)) => Ok(RowTimes::EveryStep(**steps)),
            (None, None, None) => Ok(RowTimes::Parts(DEFAULT_ROWS)),
            _ => Err(SceneError::at(text, rows.span(), "give only one of `every`, `at` and `every_step`")),
        }
    }
}

/// Times within the span of a motion, in its direction.
pub(crate) fn times_in_order(
    text: &str,
    times: &[Location<f64>],
    name: &str,
    (t0, end): (f64, f64),
) -> Result<Vec<f64>, SceneError> {
    let mut last: Option<f64> = None;
    for time in times {
        let t = within(text, time, name, (t0, end))?;
        if last.is_some_and(|last| (t - last) * (end - t0) <= 0.0) {
            let message = format!(
                "the time {t} does not follow the previous time in the direction of the motion; sort the times"
            );
            return Err(SceneError::at(text, time.span(), message));
        }
        last = Some(t);
    }
    Ok(times.iter().map(|t| **t).collect())
}

/// Checks that a time is between the start and the end of a motion.
fn within(text: &str, time: &Location<f64>, name: &str, (t0, end): (f64, f64)) -> Result<f64, SceneError> {
    let t = finite(text, time, name)?;
    if !(t0.min(end)..=t0.max(end)).contains(&t) {
        let message =
            format!("the time {t} is outside of the motion, which runs from {t0} to {end}; give a time within it");
        return Err(SceneError::at(text, time.span(), message));
    }
    Ok(t)
}

pub(crate) const NO_COLUMNS: &str = "`columns` is empty; give some columns, or remove `columns` for the whole state";

/// The columns of a row, with their names.
pub(crate) fn columns(
    text: &str,
    formula: &Formula,
    rows: Option<&Location<RowsTable>>,
) -> Result<Vec<(String, Column)>, SceneError> {
    let Some(columns) = rows.and_then(|rows| rows.columns.as_ref()) else { return Ok(Column::state(formula)) };
    if columns.is_empty() {
        return Err(SceneError::at(text, columns.span(), NO_COLUMNS));
    }
    let of = |name: &Location<String>| match Column::parse(name, formula) {
        Ok(column) => Ok((name_of(name).to_owned(), column)),
        Err(error) => Err(with_nearest(of_formula(text, name.span(), &error), formula)),
    };
    columns.iter().map(of).collect()
}

/// The name of a column: that given to its last value, as in `E1 = x'^2/2 + x^2/2`, or its text.
fn name_of(column: &str) -> &str {
    let is_name = |text: &&str| !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || c == '_');
    let last = column.trim().rsplit(['\n', ';']).next().and_then(|last| last.split_once('='));
    last.map(|(name, _)| name.trim()).filter(is_name).unwrap_or(column)
}

/// For an unknown name in a column or an event, also suggests names that are not part of the formula.
fn with_nearest(mut error: SceneError, formula: &Formula) -> SceneError {
    let unknown = error.error.message.strip_prefix("unknown name `").and_then(|rest| rest.split('`').next());
    if let (Some(name), None) = (unknown, &error.error.nearest) {
        let known: Vec<String> =
            ["energy", "sigma", "log_factor"].map(str::to_owned).into_iter().chain(formula.momenta()).collect();
        error.error.nearest = nearest_name(name, known.iter().map(String::as_str)).map(str::to_owned);
        if error.error.nearest.is_none() {
            error.error.message += "; the known names are those of the formula and ";
            error.error.message += &known.join(", ");
        }
    }
    error
}

/// The columns that every row of events.csv has after the name of the event: the time, coordinates, velocities, momenta
/// and the action.
pub(crate) fn state_of_event(formula: &Formula) -> Vec<String> {
    let names = formula.coordinates();
    let velocities = names.iter().map(|name| velocity_name(name));
    let t = ["t".to_owned()].into_iter();
    let action = [formula.action().to_owned()];
    t.chain(names.iter().cloned()).chain(velocities).chain(formula.momenta()).chain(action).collect()
}

/// The events with their names, and their columns.
pub(crate) struct Events {
    pub events: Vec<(String, Event)>,
    pub columns: EventColumns,
}

/// The columns of all events in addition to the state; events share columns of the same name.
#[derive(Clone, Debug, Default)]
pub(crate) struct EventColumns {
    pub names: Vec<String>,
    /// For each event the indices of its columns.
    pub of_event: Vec<Vec<usize>>,
}

impl Events {
    /// The events of a motion over a time span, with the numbers of their resets. `known_factor` is whether the
    /// conformal factor is known within steps.
    pub fn read(
        text: &str,
        (formula, known_factor): (&Formula, bool),
        (tables, resets): (&[EventTable], &[Option<usize>]),
        span: (f64, f64),
    ) -> Result<Self, SceneError> {
        let expression = |source: &Location<String>, named: bool| {
            let read = if named { formula.named_expression(source) } else { formula.expression(source) };
            let refused = |error: FormulaError| with_nearest(of_formula(text, source.span(), &error.into()), formula);
            let read = read.map_err(refused)?;
            if read.has_conformal_factor() && !known_factor {
                let message = if formula.has_conformal_impacts() {
                    "`sigma` and `log_factor` are not known at events of a motion with conformal impacts; use them in \
                     a column of rows"
                } else {
                    "`sigma` and `log_factor` are known at events only if L_z is constant; use them in a column of rows"
                };
                return Err(SceneError::at(text, source.span(), message));
            }
            Ok(read)
        };
        let mut read = Events { events: Vec::new(), columns: EventColumns::default() };
        for (table, reset) in tables.iter().zip(resets) {
            let EventTable { when, direction, terminal, from, columns, .. } = table;
            let direction = match direction {
                DirectionName::Rising => Direction::Rising,
                DirectionName::Falling => Direction::Falling,
                DirectionName::Both => Direction::Both,
            };
            if let (Some(from), true) = (from, terminal) {
                let message = "a terminal event is detected from the start; remove `from` or `terminal`";
                return Err(SceneError::at(text, from.span(), message));
            }
            let own = columns.iter().map(|column| expression(column, true)).collect::<Result<Vec<Expression>, _>>()?;
            let event = Event {
                direction,
                terminal: *terminal,
                from: from.as_ref().map(|from| within(text, from, "from", span)).transpose()?,
                columns: own,
                reset: *reset,
                ..Event::new(expression(when, false)?)
            };
            read.events.push(((**when).clone(), event));
            read.columns.add(text, formula, columns)?;
        }
        Ok(read)
    }
}

impl EventColumns {
    /// Adds the columns of one more event.
    fn add(&mut self, text: &str, formula: &Formula, columns: &[Location<String>]) -> Result<(), SceneError> {
        let of_state = state_of_event(formula);
        let mut own = Vec::with_capacity(columns.len());
        for column in columns {
            let name = name_of(column);
            let refuse = |message: String| Err(SceneError::at(text, column.span(), message));
            if name == "event" || of_state.iter().any(|known| known == name) {
                return refuse(format!(
                    "every event already has the column `{name}`; remove it, or give it another name"
                ));
            }
            let index = self.names.iter().position(|known| known == name).unwrap_or(self.names.len());
            if own.contains(&index) {
                return refuse(format!("the event has two columns `{name}`; give one of them another name"));
            }
            if index == self.names.len() {
                self.names.push(name.to_owned());
            }
            own.push(index);
        }
        self.of_event.push(own);
        Ok(())
    }
}

/// The names of the columns that are angles, validated against the known names.
pub(crate) fn angles(text: &str, wrapped: &[Location<String>], known: &[&str]) -> Result<Vec<String>, SceneError> {
    let of = |name: &Location<String>| {
        if known.contains(&name.as_str()) {
            return Ok((**name).clone());
        }
        let mut all: Vec<&str> = Vec::new();
        known.iter().for_each(|name| {
            if !all.contains(name) {
                all.push(name)
            }
        });
        let message = format!("unknown column `{}` in `wrap`; the columns are {}", **name, all.join(", "));
        Err(SceneError::unknown(text, name.span(), name, known.iter().copied(), message))
    };
    wrapped.iter().map(of).collect()
}

/// An error of a formula in the file.
pub(crate) fn of_formula(text: &str, span: Span, error: &RuntimeError) -> SceneError {
    match error {
        RuntimeError::Formula(FormulaError::Parse(error)) => SceneError::in_string(text, span, error),
        error => SceneError::at(text, span, error.to_string()),
    }
}
