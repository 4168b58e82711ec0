//! The swept quantities of a scene.

use super::SceneError;
use super::body_quantity::BodyQuantity;
use super::checked::finite;
use super::file::{RangeTable, Spacing, Values};
use super::location::Location;
use super::quantities::Quantities;
use super::start::{Part, entry_of, single_names};
use crate::runtime::{Formula, InitialVelocity, Start};

/// The maximal number of members: more rows than a table can be used with.
const MAX_MEMBERS: usize = 100_000_000;

/// The maximal number of values of one swept quantity, all of which are stored.
const MAX_VALUES: usize = 10_000_000;

/// The words for a table of parameters and values of the initial state.
pub(super) struct Purpose {
    /// The table.
    pub table: &'static str,
    /// What is done with the quantities.
    pub done: &'static str,
    /// What to do.
    pub act: &'static str,
    /// Why the initial time is not among them.
    pub not_time: &'static str,
}

const SWEEP: Purpose =
    Purpose { table: "sweep", done: "swept", act: "sweep", not_time: "all members start at the same time" };

/// The kind of a swept or fitted quantity.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Slot {
    /// A parameter.
    Parameter,
    /// A number of the initial state.
    Start(Part, usize),
    /// A number of a rigid body or of its start.
    Body(BodyQuantity),
}

/// A swept quantity, a parameter or a number of the initial state, with its values.
#[derive(Clone, Debug, PartialEq)]
pub struct SweptQuantity {
    /// The name: that of the parameter, or `start.x`.
    pub name: String,
    /// The values.
    pub values: Vec<f64>,
    pub(crate) slot: Slot,
}

/// Sets a number of an initial state.
pub(crate) fn put(start: &mut Start, part: Part, entry: usize, value: f64) {
    let vector = match (part, &mut start.velocity) {
        (Part::Position, _) => &mut start.q,
        (Part::Velocity, InitialVelocity::Velocity(v)) => v,
        (Part::Momentum, InitialVelocity::Momentum(p)) => p,
        (Part::Action, _) => return start.z = value,
        (Part::Time, _) => return start.t = value,
        (Part::Velocity | Part::Momentum, _) => return,
    };
    if let Some(component) = vector.get_mut(entry) {
        *component = value;
    }
}

/// The swept quantities of a table, validated against a formula and its initial state.
pub(crate) fn read(
    text: &str,
    formula: &Formula,
    start: &Start,
    table: &Quantities<Values>,
) -> Result<Vec<SweptQuantity>, SceneError> {
    quantities(text, table, |name| slot(text, formula, start, name, &SWEEP))
}

/// The swept quantities of a table of a rigid body.
pub(super) fn read_of_body(text: &str, table: &Quantities<Values>) -> Result<Vec<SweptQuantity>, SceneError> {
    quantities(text, table, |name| match BodyQuantity::named(name) {
        Some(BodyQuantity::Time) => {
            Err(SceneError::at(text, name.span(), format!("{}; {} another value", SWEEP.not_time, SWEEP.act)))
        }
        Some(quantity) => Ok(Slot::Body(quantity)),
        None => {
            let known = || BodyQuantity::ALL.iter().filter(|(_, of)| *of != BodyQuantity::Time).map(|(name, _)| *name);
            let all = known().collect::<Vec<_>>().join(", ");
            let message = format!("unknown name `{}` in [sweep]; the names that can be swept are {all}", **name);
            Err(SceneError::unknown(text, name.span(), name, known(), message))
        }
    })
}

/// The quantities of a table with their values; `slot` is the kind of the one with a name.
fn quantities(
    text: &str,
    table: &Quantities<Values>,
    slot: impl Fn(&Location<String>) -> Result<Slot, SceneError>,
) -> Result<Vec<SweptQuantity>, SceneError> {
    let mut swept = Vec::new();
    let mut members: usize = 1;
    for (name, values) in &table.0 {
        let slot = slot(name)?;
        let values_of = values_of(text, values)?;
        members = members.saturating_mul(values_of.len());
        if members > MAX_MEMBERS {
            let message = format!("the sweep has more than {MAX_MEMBERS} members; take fewer values");
            return Err(SceneError::at(text, values.span(), message));
        }
        swept.push(SweptQuantity { name: (**name).clone(), values: values_of, slot });
    }
    Ok(swept)
}

/// The kind of the quantity with a name.
pub(super) fn slot(
    text: &str,
    formula: &Formula,
    start: &Start,
    name: &Location<String>,
    Purpose { table, done, act, not_time }: &Purpose,
) -> Result<Slot, SceneError> {
    let refuse = |message: String| Err(SceneError::at(text, name.span(), message));
    let Some(of_start) = name.strip_prefix("start.") else {
        if formula.parameters().any(|(parameter, _)| parameter == **name) {
            return Ok(Slot::Parameter);
        }
        let known: Vec<String> = formula.parameters().map(|(parameter, _)| parameter.to_owned()).collect();
        let starts: Vec<String> = single_names(formula).iter().map(|name| format!("start.{name}")).collect();
        let all = known.iter().chain(&starts).map(String::as_str);
        let listed = all.clone().collect::<Vec<_>>().join(", ");
        let message = format!("unknown name `{}` in [{table}]; the names that can be {done} are {listed}", **name);
        return Err(SceneError::unknown(text, name.span(), name, all, message));
    };
    match (entry_of(formula, of_start), &start.velocity) {
        (Some((Part::Time, _)), _) => refuse(format!("{not_time}; {act} another value")),
        (Some((Part::Velocity, _)), InitialVelocity::Momentum(_) | InitialVelocity::MomentumNear { .. }) => {
            refuse(format!("the start is given by momenta; {act} one of them"))
        }
        (Some((Part::Momentum, _)), InitialVelocity::Velocity(_)) => {
            refuse(format!("the start is given by velocities; {act} one of them"))
        }
        (Some((part, entry)), _) => Ok(Slot::Start(part, entry)),
        (None, _) => {
            let names = single_names(formula);
            let message = format!("unknown name `{of_start}` in the start; the known names are {}", names.join(", "));
            Err(SceneError::unknown(text, name.span(), of_start, names.iter().map(String::as_str), message))
        }
    }
}

fn values_of(text: &str, values: &Location<Values>) -> Result<Vec<f64>, SceneError> {
    let refuse = |message: &str| Err(SceneError::at(text, values.span(), message));
    let RangeTable { from, to, count, spacing } = match &**values {
        Values::List(list) if list.is_empty() => return refuse("the list of values is empty; give at least one value"),
        Values::List(list) => return list.iter().map(|x| finite(text, x, "a value")).collect(),
        Values::Range(range) => range,
    };
    let (a, b) = (finite(text, from, "from")?, finite(text, to, "to")?);
    let count_at = count.span();
    let count = match **count {
        0 => return Err(SceneError::at(text, count.span(), "`count` is 0; it must be at least 1")),
        count if count > MAX_VALUES => {
            let message = format!("`count` exceeds {MAX_VALUES}; take fewer values");
            return Err(SceneError::at(text, count_at, message));
        }
        count => count,
    };
    if *spacing == Spacing::Log && (a == 0.0 || b == 0.0 || a.signum() != b.signum()) {
        return refuse("spacing = \"log\" requires nonzero `from` and `to` of the same sign; use spacing = \"linear\"");
    }
    let last = count.saturating_sub(1).max(1) as f64;
    let between = |k: usize| {
        let part = k as f64 / last;
        match spacing {
            // The ends are exact.
            _ if k == 0 => a,
            _ if k + 1 == count => b,
            Spacing::Linear => a * (1.0 - part) + b * part,
            Spacing::Log => a.signum() * (a.abs().ln() * (1.0 - part) + b.abs().ln() * part).exp(),
        }
    };
    Ok((0..count).map(between).collect())
}
