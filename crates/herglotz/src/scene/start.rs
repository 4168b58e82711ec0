//! The initial state of a motion.

use super::SceneError;
use super::checked::finite;
use super::location::{Location, Named, Numbers, Span};
use crate::runtime::{CatalogueEntry, Formula, InitialVelocity, Start, velocity_name};
use std::ops::Range;

/// A part of the initial state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Position,
    Velocity,
    Momentum,
    Action,
    Time,
}

/// A name that may occur in an initial state, with its meaning: a range of entries of a part.
struct Key {
    name: String,
    part: Part,
    entries: Range<usize>,
    is_list: bool,
}

/// All names that may occur in an initial state.
fn keys(formula: &Formula) -> Vec<Key> {
    let names = formula.coordinates();
    let velocities: Vec<String> = names.iter().map(|name| velocity_name(name)).collect();
    let mut keys = Vec::new();
    for (names, part) in [(names, Part::Position), (velocities, Part::Velocity), (formula.momenta(), Part::Momentum)] {
        let arrays = arrays(&names);
        let single = names.into_iter().enumerate().map(|(i, name)| (name, i..i + 1, false));
        let arrays = arrays.into_iter().map(|(name, entries)| (name, entries, true));
        let of_part = single.chain(arrays);
        keys.extend(of_part.map(|(name, entries, is_list)| Key { name, part, entries, is_list }));
    }
    for (name, part) in [(formula.action(), Part::Action), ("t", Part::Time)] {
        keys.push(Key { name: name.into(), part, entries: 0..1, is_list: false });
    }
    keys
}

/// The arrays among some names, such as `q[0]`, `q[1]` or `q'[0]`, with the range of their entries.
fn arrays(names: &[String]) -> Vec<(String, Range<usize>)> {
    let mut arrays: Vec<(String, Range<usize>)> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let Some((base, _)) = name.split_once('[') else { continue };
        match arrays.last_mut() {
            Some((last, entries)) if *last == base => entries.end = i + 1,
            _ => arrays.push((base.to_owned(), i..i + 1)),
        }
    }
    arrays
}

/// The part and the entry that a name of a single number refers to.
pub(crate) fn entry_of(formula: &Formula, name: &str) -> Option<(Part, usize)> {
    let key = keys(formula).into_iter().find(|key| key.name == name && !key.is_list)?;
    Some((key.part, key.entries.start))
}

/// The names of single numbers, for messages.
pub(crate) fn single_names(formula: &Formula) -> Vec<String> {
    keys(formula).into_iter().filter(|key| !key.is_list).map(|key| key.name).collect()
}

/// The initial state as far as a file gives it.
#[derive(Default)]
struct Given {
    q: Vec<Option<f64>>,
    v: Vec<Option<f64>>,
    p: Vec<Option<f64>>,
    z: Option<f64>,
    t: Option<f64>,
}

impl Given {
    fn set(&mut self, part: Part, entry: usize, value: f64) {
        let vector = match part {
            Part::Position => &mut self.q,
            Part::Velocity => &mut self.v,
            Part::Momentum => &mut self.p,
            Part::Action => return self.z = Some(value),
            Part::Time => return self.t = Some(value),
        };
        if let Some(component) = vector.get_mut(entry) {
            *component = Some(value);
        }
    }
}

/// The initial state of a table, completed by that of the catalogue entry.
pub(crate) fn read(
    text: &str,
    formula: &Formula,
    table: Option<&Named<Numbers>>,
    entry: Option<&CatalogueEntry>,
    at: Span,
) -> Result<Start, SceneError> {
    complete(text, given(text, keys(formula), "the start", table)?, formula, entry, at)
}

/// The ends of a path: the times, the positions, and the action of the start.
pub(crate) struct Ends {
    pub t: [f64; 2],
    pub q: [Vec<f64>; 2],
    pub z0: f64,
}

impl Ends {
    /// The ends from two tables; the start is completed by that of the catalogue entry.
    pub fn read(
        text: &str,
        formula: &Formula,
        (start, start_at): (Option<&Named<Numbers>>, Span),
        (end, end_at): (&Named<Numbers>, Span),
        entry: Option<&CatalogueEntry>,
    ) -> Result<Self, SceneError> {
        let names = formula.coordinates();
        let keys_of = |parts: &[Part]| {
            let mut keys = keys(formula);
            keys.retain(|key| parts.contains(&key.part));
            keys
        };
        let of_start = given(text, keys_of(&[Part::Position, Part::Action, Part::Time]), "the start of a path", start)?;
        let of_end = given(text, keys_of(&[Part::Position, Part::Time]), "the end of a path", Some(end))?;
        let q0 = all(text, &names, of_start.q, entry.map(|entry| entry.q), ["coordinate", "start"], start_at, &|x| {
            x.to_owned()
        })?;
        let q1 = all(text, &names, of_end.q, None, ["coordinate", "end"], end_at, &|x| x.to_owned())?;
        let Some(t1) = of_end.t else {
            return Err(SceneError::at(
                text,
                end_at,
                "the end of the path has no time; add `t = 1.0` to [ends], or another value",
            ));
        };
        let t0 = of_start.t.or(entry.map(|entry| entry.t)).unwrap_or(0.0);
        Ok(Ends { t: [t0, t1], q: [q0, q1], z0: of_start.z.unwrap_or(0.0) })
    }
}

/// The values that a table gives for these names.
fn given(text: &str, keys: Vec<Key>, what: &str, table: Option<&Named<Numbers>>) -> Result<Given, SceneError> {
    let count = keys.iter().map(|key| key.entries.end).max().unwrap_or(0);
    let none = || vec![None; count];
    let mut given = Given { q: none(), v: none(), p: none(), ..Given::default() };
    for (name, numbers) in table.map(|table| table.0.as_slice()).unwrap_or_default() {
        let Some(key) = keys.iter().find(|key| key.name == **name) else {
            let known = || keys.iter().map(|key| key.name.as_str());
            let all = known().collect::<Vec<_>>().join(", ");
            let message = format!("unknown name `{}` in {what}; the known names are {all}", **name);
            return Err(SceneError::unknown(text, name.span(), name, known(), message));
        };
        let wrong_count = |found: &str| {
            let expected = match key.entries.len() {
                _ if !key.is_list => "a number".to_owned(),
                count => format!("a list of {count} numbers, or one number for all"),
            };
            SceneError::at(text, numbers.span(), format!("`{}` is {found}; it must be {expected}", **name))
        };
        let values: Vec<Location<f64>> = match &**numbers {
            // For an array, the number is the value of all its entries.
            Numbers::One(x) => vec![Location::new(*x, numbers.span()); key.entries.len()],
            Numbers::Many(list) if key.is_list && list.len() == key.entries.len() => list.clone(),
            Numbers::Many(list) => return Err(wrong_count(&format!("a list of length {}", list.len()))),
        };
        for (i, x) in key.entries.clone().zip(&values) {
            given.set(key.part, i, finite(text, x, name)?);
        }
    }
    Ok(given)
}

/// The numbers of all coordinates: those that are given, and otherwise those of the catalogue entry.
fn all(
    text: &str,
    names: &[String],
    given: Vec<Option<f64>>,
    of_entry: Option<&[f64]>,
    [what, end]: [&str; 2],
    at: Span,
    name: &dyn Fn(&str) -> String,
) -> Result<Vec<f64>, SceneError> {
    let mut all = Vec::with_capacity(names.len());
    for (i, coordinate) in names.iter().enumerate() {
        let known = given.get(i).copied().flatten().or_else(|| of_entry?.get(i).copied());
        all.push(known.ok_or_else(|| {
            let name = name(coordinate);
            // TOML keys of letters, digits and _ need no quotes.
            let bare = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
            let key = if bare { name.clone() } else { format!("\"{name}\"") };
            let table = if end == "end" { "ends" } else { "start" };
            let message = format!(
                "the {what} `{name}` has no value at the {end}; add `{key} = 0.0` to [{table}], or another value"
            );
            SceneError::at(text, at, message)
        })?);
    }
    Ok(all)
}

/// The complete initial state of a motion.
fn complete(
    text: &str,
    given: Given,
    formula: &Formula,
    entry: Option<&CatalogueEntry>,
    at: Span,
) -> Result<Start, SceneError> {
    let (names, momenta) = (formula.coordinates(), formula.momenta());
    let of = |given: Vec<Option<f64>>, of_entry: Option<&[f64]>, what: &str, name: &dyn Fn(&str) -> String| {
        let names = if what == "momentum" { &momenta } else { &names };
        all(text, names, given, of_entry, [what, "start"], at, name)
    };
    let q = of(given.q, entry.map(|entry| entry.q), "coordinate", &|x| x.to_owned())?;
    let by_momentum = given.p.iter().any(Option::is_some);
    if by_momentum && given.v.iter().any(Option::is_some) {
        let message = "the start has both velocities and momenta; give one kind for all coordinates";
        return Err(SceneError::at(text, at, message));
    }
    let by_velocity = given.v.iter().any(Option::is_some);
    let velocity = if by_momentum || formula.is_hamiltonian() && !by_velocity {
        InitialVelocity::Momentum(of(given.p, None, "momentum", &|p| p.to_owned())?)
    } else {
        InitialVelocity::Velocity(of(given.v, entry.map(|entry| entry.v), "velocity", &velocity_name)?)
    };
    Ok(Start { t: given.t.unwrap_or(0.0), q, velocity, z: given.z.unwrap_or(0.0) })
}
