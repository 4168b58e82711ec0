//! The names that a formula may use.

use crate::functions::{FUNCTIONS, OPERATIONS};
use crate::tables::NamedTable;
use crate::{FormulaError, MOST_COORDINATES, nearest_name};

/// The names with a fixed meaning.
const RESERVED: [&str; 6] = ["t", "z", "sum", "if", "asin", "acos"];

/// A coordinate as named by the user: a number, or an array.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Block {
    pub name: String,
    /// The index of its first coordinate.
    pub first: usize,
    /// The number of entries of an array; `None` for a number.
    pub count: Option<usize>,
}

/// The coordinates, parameters and tables of a formula.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Names {
    pub blocks: Vec<Block>,
    pub dimension: usize,
    pub parameters: Vec<String>,
    pub tables: Vec<NamedTable>,
}

impl Names {
    pub fn new(coordinates: &[&str], parameters: &[(&str, f64)]) -> Result<Self, FormulaError> {
        let mut names = Names { blocks: Vec::new(), dimension: 0, parameters: Vec::new(), tables: Vec::new() };
        for coordinate in coordinates {
            let (name, count) = match coordinate.split_once('[') {
                None => (*coordinate, None),
                Some((name, rest)) => {
                    let count = rest.strip_suffix(']').and_then(|count| count.trim().parse::<usize>().ok());
                    let Some(count) = count.filter(|count| *count > 0) else {
                        return Err(bad(coordinate, "is not of the form `q[3]`, where 3 is the number of entries"));
                    };
                    (name.trim(), Some(count))
                }
            };
            names.check(name)?;
            names.blocks.push(Block { name: name.to_owned(), first: names.dimension, count });
            names.dimension = names.dimension.saturating_add(count.unwrap_or(1));
        }
        if !(1..=MOST_COORDINATES).contains(&names.dimension) {
            return Err(FormulaError::Dimension { found: names.dimension });
        }
        for (name, value) in parameters {
            names.check(name)?;
            if !value.is_finite() {
                return Err(FormulaError::ParameterValue { name: (*name).to_owned(), value: *value });
            }
            names.parameters.push((*name).to_owned());
        }
        Ok(names)
    }

    /// Checks that a new name is valid and not in use.
    pub fn check(&self, name: &str) -> Result<(), FormulaError> {
        let first = name.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_');
        if !(first && name.chars().all(|c| c.is_alphabetic() || c.is_ascii_digit() || c == '_')) {
            return Err(bad(name, "must be a letter or `_` followed by letters, digits and `_`"));
        }
        if is_reserved(name) {
            return Err(bad(name, "is reserved; choose another name"));
        }
        let taken = self.parameters.iter().any(|p| p == name) || self.table(name).is_some();
        if taken || self.blocks.iter().any(|b| b.name == name) {
            return Err(bad(name, "is given twice"));
        }
        Ok(())
    }

    /// The names of the single coordinates, such as `x` or `q[0]`.
    pub fn coordinates(&self) -> impl Iterator<Item = String> {
        self.blocks.iter().flat_map(|Block { name, count, .. }| {
            (0..count.unwrap_or(1)).map(move |i| if count.is_some() { format!("{name}[{i}]") } else { name.clone() })
        })
    }

    /// The index of the table with this name.
    pub fn table(&self, name: &str) -> Option<u32> {
        self.tables.iter().find(|table| table.name == name).map(|table| table.index)
    }

    /// The name that is nearest to an unknown one, among the known names and `others`.
    pub fn nearest(&self, name: &str, others: &[String]) -> Option<String> {
        let known = self.blocks.iter().map(|b| b.name.as_str()).chain(self.parameters.iter().map(String::as_str));
        let known =
            known.chain(others.iter().map(String::as_str)).chain(RESERVED).chain(["pi", "q", "v", "n", "force"]);
        let known = known.chain(self.tables.iter().map(|table| table.name.as_str()));
        let known = known.chain(FUNCTIONS.iter().map(|f| f.0)).chain(OPERATIONS.iter().map(|o| o.0));
        // A known name that is invalid at this position is not suggested as its own correction.
        nearest_name(name, known.filter(|other| *other != name)).map(str::to_owned)
    }
}

/// Whether a name has a fixed meaning everywhere.
pub(crate) fn is_reserved(name: &str) -> bool {
    RESERVED.contains(&name) || FUNCTIONS.iter().any(|f| f.0 == name) || OPERATIONS.iter().any(|o| o.0 == name)
}

fn bad(name: &str, why: &'static str) -> FormulaError {
    FormulaError::Name { name: name.to_owned(), why }
}
