//! The initial state of a motion.

use super::SceneError;
use super::checked::finite;
use super::location::{Location, Named, Numbers, Span};
use super::profile;
use crate::runtime::{CatalogueEntry, Formula, InitialVelocity, Lattice, Start, velocity_name};
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

/// The names of an initial state.
pub(crate) struct StartNames<'f> {
    /// The coordinates; those of a large lattice are left out, whose start is given by its components alone.
    coordinates: Vec<String>,
    momenta: Vec<String>,
    action: &'f str,
    is_hamiltonian: bool,
    /// The components at a site of a lattice, with the number of sites along each direction.
    lattice: Option<(&'f [String], &'f [usize])>,
    parameters: Vec<(String, f64)>,
    dimension: usize,
}

impl<'f> StartNames<'f> {
    /// Those of a formula.
    pub fn of(formula: &'f Formula) -> Self {
        StartNames {
            coordinates: formula.coordinates(),
            momenta: formula.momenta(),
            action: formula.action(),
            is_hamiltonian: formula.is_hamiltonian(),
            lattice: None,
            parameters: formula.parameters().map(|(name, value)| (name.to_owned(), value)).collect(),
            dimension: formula.dimension(),
        }
    }

    /// With those of the components of all sites of a lattice, if it is one.
    pub fn with_lattice(self, lattice: Option<&'f Lattice>) -> Self {
        let lattice = lattice.map(|lattice| (lattice.coordinates.as_slice(), lattice.sizes.as_slice()));
        StartNames { lattice, ..self }
    }

    /// Those of a lattice of any number of sites.
    pub fn of_lattice(lattice: &'f Lattice) -> Self {
        StartNames {
            coordinates: Vec::new(),
            momenta: Vec::new(),
            action: "z",
            is_hamiltonian: false,
            lattice: Some((&lattice.coordinates, &lattice.sizes)),
            parameters: lattice.parameters.clone(),
            dimension: lattice.coordinates.len() * lattice.sizes.iter().product::<usize>(),
        }
    }

    /// The single number at a site of a lattice whose coordinates are left out: `x[3]`, `x'[3]`, `p_x[3]`, or with several
    /// components `x_3`, `x_3'`, `p_x_3`.
    fn of_large_lattice(&self, name: &str) -> Option<Key> {
        let (components, _) = self.lattice.filter(|_| self.coordinates.is_empty())?;
        let (component, site, quote) = match components {
            [_] => name.strip_suffix(']')?.split_once('[').map(|(component, site)| (component, site, ""))?,
            _ => {
                let bare = name.strip_suffix('\'').unwrap_or(name);
                let (component, site) = bare.rsplit_once('_')?;
                (component, site, &name[bare.len()..])
            }
        };
        let component = format!("{component}{quote}");
        let named = components.iter().enumerate().flat_map(|(c, x)| names_of(x).map(|(name, part)| (name, part, c)));
        let (_, part, c) = named.into_iter().find(|(name, ..)| *name == component)?;
        let entry = site.parse::<usize>().ok()?.checked_mul(components.len())?.checked_add(c)?;
        (entry < self.dimension).then(|| Key::single(name.to_owned(), part, entry))
    }
}

/// A name that may occur in an initial state, with its meaning: entries of a part, `count` of them from `first` on in a
/// stride.
struct Key {
    name: String,
    part: Part,
    first: usize,
    stride: usize,
    /// The number of entries along each direction of an array; none for a single number.
    sizes: Option<Vec<usize>>,
}

impl Key {
    fn count(&self) -> usize {
        self.sizes.as_ref().map_or(1, |sizes| sizes.iter().product())
    }

    fn single(name: String, part: Part, entry: usize) -> Self {
        Key { name, part, first: entry, stride: 1, sizes: None }
    }
}

/// The names of a coordinate of a Lagrangian, of its velocity and of its momentum.
fn names_of(x: &str) -> [(String, Part); 3] {
    [(x.to_owned(), Part::Position), (velocity_name(x), Part::Velocity), (format!("p_{x}"), Part::Momentum)]
}

/// All names that may occur in an initial state.
fn keys(names: &StartNames<'_>) -> Vec<Key> {
    let velocities: Vec<String> = names.coordinates.iter().map(|name| velocity_name(name)).collect();
    let mut keys = Vec::new();
    let parts = [(&names.coordinates, Part::Position), (&velocities, Part::Velocity), (&names.momenta, Part::Momentum)];
    for (of_part, part) in parts {
        keys.extend(of_part.iter().enumerate().map(|(i, name)| Key::single(name.clone(), part, i)));
        if names.lattice.is_none() {
            let arrays = arrays(of_part).into_iter();
            let of = |(name, entries): (String, Range<usize>)| Key {
                name,
                part,
                first: entries.start,
                stride: 1,
                sizes: Some(vec![entries.len()]),
            };
            keys.extend(arrays.map(of));
        }
    }
    if let Some((components, sizes)) = names.lattice {
        for (c, x) in components.iter().enumerate() {
            keys.extend(names_of(x).map(|(name, part)| {
                let (stride, sizes) = (components.len(), Some(sizes.to_vec()));
                Key { name, part, first: c, stride, sizes }
            }));
        }
    }
    keys.extend(
        [(names.action, Part::Action), ("t", Part::Time)].map(|(name, part)| Key::single(name.into(), part, 0)),
    );
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
    let key = keys(&StartNames::of(formula)).into_iter().find(|key| key.name == name && key.sizes.is_none())?;
    Some((key.part, key.first))
}

/// The names of single numbers, for messages.
pub(crate) fn single_names(formula: &Formula) -> Vec<String> {
    keys(&StartNames::of(formula)).into_iter().filter(|key| key.sizes.is_none()).map(|key| key.name).collect()
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
    names: &StartNames<'_>,
    table: Option<&Named<Numbers>>,
    entry: Option<&CatalogueEntry>,
    at: Span,
) -> Result<Start, SceneError> {
    complete(text, given(text, names, keys(names), "the start", table)?, names, entry, at)
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
        (formula, lattice): (&Formula, Option<&Lattice>),
        (start, start_at): (Option<&Named<Numbers>>, Span),
        (end, end_at): (&Named<Numbers>, Span),
        entry: Option<&CatalogueEntry>,
    ) -> Result<Self, SceneError> {
        let of = StartNames::of(formula).with_lattice(lattice);
        let names = &of.coordinates;
        let keys_of = |parts: &[Part]| {
            let mut keys = keys(&of);
            keys.retain(|key| parts.contains(&key.part));
            keys
        };
        let of_start = keys_of(&[Part::Position, Part::Action, Part::Time]);
        let of_start = given(text, &of, of_start, "the start of a path", start)?;
        let of_end = given(text, &of, keys_of(&[Part::Position, Part::Time]), "the end of a path", Some(end))?;
        let q0 = all(text, names, of_start.q, entry.map(|entry| entry.q), ["coordinate", "start"], start_at, &|x| {
            x.to_owned()
        })?;
        let q1 = all(text, names, of_end.q, None, ["coordinate", "end"], end_at, &|x| x.to_owned())?;
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
fn given(
    text: &str,
    names: &StartNames<'_>,
    keys: Vec<Key>,
    what: &str,
    table: Option<&Named<Numbers>>,
) -> Result<Given, SceneError> {
    let none = || vec![None; names.dimension];
    let mut given = Given { q: none(), v: none(), p: none(), ..Given::default() };
    for (name, numbers) in table.map(|table| table.0.as_slice()).unwrap_or_default() {
        let own = names.of_large_lattice(name);
        let Some(key) = keys.iter().find(|key| key.name == **name).or(own.as_ref()) else {
            let known = || keys.iter().map(|key| key.name.as_str());
            let all = known().collect::<Vec<_>>().join(", ");
            let message = format!("unknown name `{}` in {what}; the known names are {all}", **name);
            return Err(SceneError::unknown(text, name.span(), name, known(), message));
        };
        let refuse = |found: &str| {
            let expected = match key.sizes {
                None => "a number".to_owned(),
                Some(_) => format!("a list of {} numbers, one number for all, or a formula in `i`", key.count()),
            };
            SceneError::at(text, numbers.span(), format!("`{}` is {found}; it must be {expected}", **name))
        };
        let entry = |k: usize| key.first + k * key.stride;
        match (&**numbers, &key.sizes) {
            // For an array, the number is the value of all its entries.
            (Numbers::One(x), _) => {
                let x = finite(text, &Location::new(*x, numbers.span()), name)?;
                (0..key.count()).for_each(|k| given.set(key.part, entry(k), x));
            }
            (Numbers::Many(list), Some(_)) if list.len() == key.count() => {
                for (k, x) in list.iter().enumerate() {
                    given.set(key.part, entry(k), finite(text, x, name)?);
                }
            }
            (Numbers::Many(list), _) => return Err(refuse(&format!("a list of length {}", list.len()))),
            (Numbers::Formula(formula), Some(sizes)) => {
                let at = Location::new(formula.as_str(), numbers.span());
                for (k, x) in profile::values(text, name, &at, sizes, &names.parameters)?.into_iter().enumerate() {
                    given.set(key.part, entry(k), x);
                }
            }
            (Numbers::Formula(_), None) => return Err(refuse("a text")),
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

/// The numbers of all sites of a lattice of any number of sites.
fn all_of_lattice(
    text: &str,
    components: &[String],
    given: Vec<Option<f64>>,
    what: &str,
    at: Span,
    name: &dyn Fn(&str) -> String,
) -> Result<Vec<f64>, SceneError> {
    let missing = |entry: usize| {
        let component = components.get(entry % components.len()).map_or("x", String::as_str);
        let name = if what == "momentum" { format!("p_{component}") } else { name(component) };
        let message = format!(
            "the {what} `{name}` has no value at the start; add `{name} = 0.0` to [start], or a formula in `i`"
        );
        SceneError::at(text, at, message)
    };
    given.into_iter().enumerate().map(|(entry, x)| x.ok_or_else(|| missing(entry))).collect()
}

/// The complete initial state of a motion.
fn complete(
    text: &str,
    given: Given,
    names: &StartNames<'_>,
    entry: Option<&CatalogueEntry>,
    at: Span,
) -> Result<Start, SceneError> {
    let of = |given: Vec<Option<f64>>, of_entry: Option<&[f64]>, what: &str, name: &dyn Fn(&str) -> String| {
        if let (Some((components, _)), true) = (names.lattice, names.coordinates.is_empty()) {
            return all_of_lattice(text, components, given, what, at, name);
        }
        let names = if what == "momentum" { &names.momenta } else { &names.coordinates };
        all(text, names, given, of_entry, [what, "start"], at, name)
    };
    let q = of(given.q, entry.map(|entry| entry.q), "coordinate", &|x| x.to_owned())?;
    let by_momentum = given.p.iter().any(Option::is_some);
    if by_momentum && given.v.iter().any(Option::is_some) {
        let message = "the start has both velocities and momenta; give one kind for all coordinates";
        return Err(SceneError::at(text, at, message));
    }
    let by_velocity = given.v.iter().any(Option::is_some);
    let velocity = if by_momentum || names.is_hamiltonian && !by_velocity {
        InitialVelocity::Momentum(of(given.p, None, "momentum", &|p| p.to_owned())?)
    } else if names.lattice.is_some() {
        InitialVelocity::Velocity(given.v.into_iter().map(|v| v.unwrap_or(0.0)).collect())
    } else {
        InitialVelocity::Velocity(of(given.v, entry.map(|entry| entry.v), "velocity", &velocity_name)?)
    };
    Ok(Start { t: given.t.unwrap_or(0.0), q, velocity, z: given.z.unwrap_or(0.0) })
}
