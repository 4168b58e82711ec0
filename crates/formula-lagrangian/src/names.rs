//! The names that a formula may use.

use crate::functions::{FUNCTIONS, OPERATIONS};
use crate::tables::NamedTable;
use crate::{FormulaError, MOST_COORDINATES};

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

/// The name that is nearest to a given one, if it is close enough to be intended: at most three characters differ, and
/// at most a third of them.
///
/// ```
/// assert_eq!(formula_lagrangian::nearest_name("keplr", ["pendulum", "kepler"]), Some("kepler"));
/// assert_eq!(formula_lagrangian::nearest_name("lattice", ["pendulum", "kepler"]), None);
/// ```
pub fn nearest_name<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let near = known.into_iter().map(|other| (distance(name, other), other)).min_by_key(|(distance, _)| *distance);
    let limit = name.chars().count().div_ceil(3).min(3);
    near.filter(|(distance, _)| *distance <= limit).map(|(_, other)| other)
}

/// Whether a name has a fixed meaning everywhere.
pub(crate) fn is_reserved(name: &str) -> bool {
    RESERVED.contains(&name) || FUNCTIONS.iter().any(|f| f.0 == name) || OPERATIONS.iter().any(|o| o.0 == name)
}

fn bad(name: &str, why: &'static str) -> FormulaError {
    FormulaError::Name { name: name.to_owned(), why }
}

/// The number of characters to change, insert or delete, or of neighbouring characters to exchange (Damerau-Levenshtein
/// distance), for the first characters of long names. Case is ignored.
fn distance(a: &str, b: &str) -> usize {
    // The time grows with the product of the lengths.
    const MAX_COMPARED_CHARACTERS: usize = 40;
    let letters = |s: &str| s.chars().take(MAX_COMPARED_CHARACTERS).flat_map(char::to_lowercase).collect::<Vec<_>>();
    let (x, y) = (letters(a), letters(b));
    let mut rows: Vec<Vec<usize>> = vec![(0..=y.len()).collect()];
    for i in 1..=x.len() {
        let mut row = vec![i];
        for j in 1..=y.len() {
            let above = &rows[i - 1];
            let mut least = (above[j] + 1).min(row[j - 1] + 1).min(above[j - 1] + usize::from(x[i - 1] != y[j - 1]));
            if i > 1 && j > 1 && x[i - 1] == y[j - 2] && x[i - 2] == y[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    // Names that differ only in case have distance 0.
    rows.last().and_then(|row| row.last().copied()).unwrap_or(usize::MAX)
}
