//! The names that a formula may use.

use crate::functions::{FUNCTIONS, OPERATIONS};
use crate::{FormulaError, MOST_COORDINATES, nearest_name};
use contact_geom::table::Table;

/// The names with a fixed meaning, beside that of the action.
const RESERVED: [&str; 5] = ["t", "sum", "if", "asin", "acos"];

/// The name of the action unless another one is given.
pub(crate) const ACTION: &str = "z";

/// The names that a text may use.
///
/// ```
/// use formula_lagrangian::{Formula, FormulaNames};
/// // The action is s, so that z is a coordinate.
/// let names = FormulaNames { action: "s", ..FormulaNames::new(&["x", "y", "z"], &[("g", 9.81), ("gamma", -0.1)]) };
/// let thrown = Formula::parse_lagrangian("(x'^2 + y'^2 + z'^2)/2 - g*z + gamma*s", &names)?;
/// assert_eq!((thrown.dimension(), thrown.action()), (3, "s"));
/// # Ok::<(), formula_lagrangian::FormulaError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FormulaNames<'a> {
    /// The coordinates; `"q[3]"` is an array of three.
    pub coordinates: &'a [&'a str],
    /// The parameters with their values.
    pub parameters: &'a [(&'a str, f64)],
    /// The tables, which are functions by their names.
    pub tables: &'a [(&'a str, Table)],
    /// The name of the action; `z` by default.
    pub action: &'a str,
    /// The momenta of a Hamiltonian, in the form of the coordinates and in their order. Without any, the momentum of `x`
    /// is `p_x`. They are not used for a Lagrangian.
    pub momenta: &'a [&'a str],
}

impl<'a> FormulaNames<'a> {
    /// Coordinates and parameters, with the action z and no tables.
    pub fn new(coordinates: &'a [&'a str], parameters: &'a [(&'a str, f64)]) -> Self {
        FormulaNames { coordinates, parameters, tables: &[], action: ACTION, momenta: &[] }
    }
}

/// A coordinate as named by the user: a number, or an array.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Block {
    pub name: String,
    /// The index of its first coordinate.
    pub first: usize,
    /// The number of entries of an array; `None` for a number.
    pub count: Option<usize>,
}

/// A table with its name in texts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NamedTable {
    pub name: String,
    /// Its index in the graph.
    pub index: u32,
}

/// The coordinates, parameters and tables of a formula.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Names {
    pub blocks: Vec<Block>,
    pub dimension: usize,
    pub parameters: Vec<String>,
    pub tables: Vec<NamedTable>,
    /// The name of the action.
    pub action: String,
    /// The momenta of a Hamiltonian; `None` for a Lagrangian.
    pub momenta: Option<Vec<Block>>,
}

impl Names {
    /// The names of a Lagrangian, with the action z.
    pub fn new(coordinates: &[&str], parameters: &[(&str, f64)]) -> Result<Self, FormulaError> {
        Self::of(&FormulaNames::new(coordinates, parameters), false)
    }

    /// The names of a Lagrangian or of a Hamiltonian, without the tables.
    pub fn of(given: &FormulaNames<'_>, hamiltonian: bool) -> Result<Self, FormulaError> {
        let mut names = Names {
            blocks: Vec::new(),
            dimension: 0,
            parameters: Vec::new(),
            tables: Vec::new(),
            action: String::new(),
            momenta: None,
        };
        names.check(given.action)?;
        names.action = given.action.to_owned();
        for coordinate in given.coordinates {
            let (name, count) = name_and_count(coordinate)?;
            names.check(name)?;
            names.blocks.push(Block { name: name.to_owned(), first: names.dimension, count });
            names.dimension = names.dimension.saturating_add(count.unwrap_or(1));
        }
        if !(1..=MOST_COORDINATES).contains(&names.dimension) {
            return Err(FormulaError::Dimension { found: names.dimension });
        }
        if hamiltonian {
            names.add_momenta(given.momenta)?;
        }
        for (name, value) in given.parameters {
            names.check(name)?;
            if !value.is_finite() {
                return Err(FormulaError::ParameterValue { name: (*name).to_owned(), value: *value });
            }
            names.parameters.push((*name).to_owned());
        }
        Ok(names)
    }

    /// Gives names to the momenta: those that are given, or `p_x` for the coordinate `x`.
    fn add_momenta(&mut self, given: &[&str]) -> Result<(), FormulaError> {
        let of = |block: &Block| Block { name: format!("p_{}", block.name), ..block.clone() };
        let default: Vec<Block> = self.blocks.iter().map(of).collect();
        let (mut momenta, mut count) = (Vec::new(), 0_usize);
        for momentum in given {
            let (name, entries) = name_and_count(momentum)?;
            momenta.push(Block { name: name.to_owned(), first: count, count: entries });
            count = count.saturating_add(entries.unwrap_or(1));
        }
        if given.is_empty() {
            momenta = default;
        } else if count != self.dimension {
            return Err(FormulaError::Momenta { found: count, expected: self.dimension });
        }
        let mut known = Vec::new();
        for momentum in momenta {
            self.check(&momentum.name)?;
            if known.iter().any(|other: &Block| other.name == momentum.name) {
                return Err(bad(&momentum.name, "is given twice"));
            }
            known.push(momentum);
        }
        self.momenta = Some(known);
        Ok(())
    }

    /// Checks that a new name is valid and not in use.
    pub fn check(&self, name: &str) -> Result<(), FormulaError> {
        let first = name.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_');
        if !(first && name.chars().all(|c| c.is_alphabetic() || c.is_ascii_digit() || c == '_')) {
            return Err(bad(name, "must be a letter or `_` followed by letters, digits and `_`"));
        }
        if name == self.action {
            return Err(bad(name, ACTION_IN_USE));
        }
        if self.is_reserved(name) {
            return Err(bad(name, "is reserved; choose another name"));
        }
        if self.momenta.iter().flatten().any(|block| block.name == name) {
            return Err(bad(name, "is that of a momentum; choose another name, or give names in `momenta`"));
        }
        let taken = self.parameters.iter().any(|p| p == name) || self.table(name).is_some();
        if taken || self.blocks.iter().any(|b| b.name == name) {
            return Err(bad(name, "is given twice"));
        }
        Ok(())
    }

    /// Whether a name has a fixed meaning.
    pub fn is_reserved(&self, name: &str) -> bool {
        name == self.action
            || RESERVED.contains(&name)
            || FUNCTIONS.iter().any(|f| f.0 == name)
            || OPERATIONS.iter().any(|o| o.0 == name)
    }

    /// The names of the single coordinates, such as `x` or `q[0]`.
    pub fn coordinates(&self) -> impl Iterator<Item = String> {
        singles(&self.blocks)
    }

    /// The names of the single momenta, such as `p_x` or `p_q[0]`, of a Hamiltonian and of a Lagrangian alike.
    pub fn momenta(&self) -> Vec<String> {
        match &self.momenta {
            Some(momenta) => singles(momenta).collect(),
            None => self.coordinates().map(|name| format!("p_{name}")).collect(),
        }
    }

    /// The array or the number of this name among the momenta of a Hamiltonian.
    pub fn momentum(&self, name: &str) -> Option<&Block> {
        self.momenta.iter().flatten().find(|block| block.name == name)
    }

    /// The name of the function: L, or H.
    pub fn letter(&self) -> &'static str {
        if self.are_of_hamiltonian() { "H" } else { "L" }
    }

    /// Whether they are those of a Hamiltonian.
    pub fn are_of_hamiltonian(&self) -> bool {
        self.momenta.is_some()
    }

    /// The index of the table with this name.
    pub fn table(&self, name: &str) -> Option<u32> {
        self.tables.iter().find(|table| table.name == name).map(|table| table.index)
    }

    /// The name that is nearest to an unknown one, among the known names and `others`.
    pub fn nearest(&self, name: &str, others: &[String]) -> Option<String> {
        let known = self.blocks.iter().map(|b| b.name.as_str()).chain(self.parameters.iter().map(String::as_str));
        let known = known.chain(others.iter().map(String::as_str)).chain([self.action.as_str()]).chain(RESERVED);
        let known = known.chain(self.momenta.iter().flatten().map(|block| block.name.as_str()));
        let own: &[&str] =
            if self.are_of_hamiltonian() { &["pi", "q", "p", "n"] } else { &["pi", "q", "v", "n", "force"] };
        let known = known.chain(own.iter().copied());
        let known = known.chain(self.tables.iter().map(|table| table.name.as_str()));
        let known = known.chain(FUNCTIONS.iter().map(|f| f.0)).chain(OPERATIONS.iter().map(|o| o.0));
        // A known name that is invalid at this position is not suggested as its own correction.
        nearest_name(name, known.filter(|other| *other != name)).map(str::to_owned)
    }
}

impl Names {
    /// The names of all functions: tables, and those of the language.
    fn functions(&self) -> impl Iterator<Item = &str> {
        let own = self.tables.iter().map(|table| table.name.as_str());
        own.chain(FUNCTIONS.iter().map(|f| f.0))
            .chain(OPERATIONS.iter().map(|o| o.0))
            .chain(["asin", "acos", "if", "sum"])
    }

    /// The name of a function that is nearest to an unknown one.
    pub fn nearest_function(&self, name: &str) -> Option<String> {
        nearest_name(name, self.functions()).map(str::to_owned)
    }

    /// The functions whose names begin like an unknown one, or all of them.
    pub fn functions_like(&self, name: &str) -> String {
        /// The number of letters that names have in common.
        const COMMON: usize = 3;
        let begin = |of: &str| of.chars().take(COMMON).collect::<String>().to_lowercase();
        let near: Vec<&str> = self.functions().filter(|known| begin(known) == begin(name)).collect();
        match near.as_slice() {
            [] => format!("the functions are {}", self.functions().collect::<Vec<_>>().join(", ")),
            near => format!("functions with a similar name are {}", near.join(", ")),
        }
    }
}

/// Why a name cannot be that of the action.
const ACTION_IN_USE: &str =
    "is that of the action; choose another name, or another name of the action, as in action = \"s\"";

/// The names of the single entries of numbers and arrays.
fn singles(blocks: &[Block]) -> impl Iterator<Item = String> {
    blocks.iter().flat_map(|Block { name, count, .. }| {
        (0..count.unwrap_or(1)).map(move |i| if count.is_some() { format!("{name}[{i}]") } else { name.clone() })
    })
}

/// The name of a number, or that of an array with the number of its entries.
fn name_and_count(text: &str) -> Result<(&str, Option<usize>), FormulaError> {
    let Some((name, rest)) = text.split_once('[') else { return Ok((text, None)) };
    let count = rest.strip_suffix(']').and_then(|count| count.trim().parse::<usize>().ok());
    match count.filter(|count| *count > 0) {
        Some(count) => Ok((name.trim(), Some(count))),
        None => Err(bad(text, "is not of the form `q[3]`, where 3 is the number of entries")),
    }
}

fn bad(name: &str, why: &'static str) -> FormulaError {
    FormulaError::Name { name: name.to_owned(), why }
}
