//! Errors of formulas.

use std::fmt::{Display, Formatter};
use thiserror::Error;

/// The largest number of coordinates of a formula: its second derivatives fit into memory. Programs that read formulas
/// compile all integrators for up to 16.
pub const MOST_COORDINATES: usize = 256;

/// Invalid input to a formula.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FormulaError {
    /// The text is not a formula.
    #[error(transparent)]
    Parse(#[from] ParseError),
    /// The text that names the coordinate of a force, or a variable that a reset assigns, is not the name of one, or
    /// names it a second time.
    #[error(transparent)]
    Target(ParseError),
    /// Two forces on a coordinate.
    #[error("the force on `{coordinate}` is given twice; give one sum")]
    ForceTwice {
        /// The coordinate.
        coordinate: String,
    },
    /// An identifier of a node that the graph of the formula does not have.
    #[error("a node does not belong to the graph of the formula; build forces and resets in the graph of L")]
    ForeignNode,
    /// A reset that is not one.
    #[error("a reset {why}")]
    Reset {
        /// The reason.
        why: &'static str,
    },
    /// An impact that is not one.
    #[error("an impact {why}")]
    Impact {
        /// The reason, and the remedy.
        why: &'static str,
    },
    /// A holonomic constraint that is not one, or that cannot be combined with another part of the formula.
    #[error("a constraint {why}")]
    Constraint {
        /// The reason, and the remedy.
        why: &'static str,
    },
    /// As many holonomic constraints as coordinates, or more.
    #[error(
        "there are {found} constraints on {coordinates} coordinates, so that nothing can move; give fewer constraints \
         than coordinates, each independent of the others"
    )]
    Constraints {
        /// The number of constraints.
        found: usize,
        /// The number of coordinates.
        coordinates: usize,
    },
    /// A time at which steps are to end is not finite.
    #[error("a break of the motion is at the time {time}; it must be a finite number")]
    Break {
        /// The time.
        time: f64,
    },
    /// A table with very many samples has an argument that depends on the state, or not linearly on time.
    #[error(
        "a table of {found} samples has an argument that is not of the form `a*t + b`; there it can have at most \
         {limit} samples"
    )]
    TableOfState {
        /// The number of samples.
        found: usize,
        /// The bound.
        limit: usize,
    },
    /// The name of a coordinate, a parameter or a table is invalid.
    #[error("the name {name:?} {why}")]
    Name {
        /// The name.
        name: String,
        /// The reason.
        why: &'static str,
    },
    /// The number of names of momenta is not that of the coordinates.
    #[error(
        "there are names of {found} momenta for {expected} coordinates; give one for each coordinate, or none, so that \
         they are `p_x` for `x`"
    )]
    Momenta {
        /// The number of momenta.
        found: usize,
        /// The number of coordinates.
        expected: usize,
    },
    /// A Lagrangian, or something that only a Lagrangian has, was requested of a Hamiltonian.
    #[error("the formula is a Hamiltonian, which has no {what}; {remedy}")]
    IsHamiltonian {
        /// What was requested.
        what: &'static str,
        /// The remedy.
        remedy: &'static str,
    },
    /// A Hamiltonian was requested of a Lagrangian.
    #[error("the formula is a Lagrangian; parse a Hamiltonian with `Formula::parse_hamiltonian`")]
    IsLagrangian,
    /// The number of coordinates is out of range.
    #[error(
        "the formula has {found} coordinates; it can have from 1 to {MOST_COORDINATES}. Use a lattice or bodies for \
         systems with more: `lattice` and `bodies` in Python, [system.lattice] in a scene"
    )]
    Dimension {
        /// The number of coordinates.
        found: usize,
    },
    /// A Lagrangian was requested with a dimension other than that of the formula.
    #[error("the formula has {found} coordinates, not {asked}; use FormulaLagrangian<{found}>")]
    OtherDimension {
        /// The number of coordinates of the formula.
        found: usize,
        /// The requested dimension.
        asked: usize,
    },
    /// There is no parameter of this name.
    #[error("there is no parameter `{name}`; {known}")]
    UnknownParameter {
        /// The name.
        name: String,
        /// The parameters that exist.
        known: String,
    },
    /// A graph has a coordinate or a parameter without a name.
    #[error(
        "the graph contains the {what} with index {index}, but only {count} have names; give a name to each {what}"
    )]
    Unknown {
        /// A coordinate, a velocity or a parameter.
        what: &'static str,
        /// Its index.
        index: usize,
        /// The number of named ones.
        count: usize,
    },
    /// A formula was built from symbols of different graphs.
    #[error("the formula combines symbols of different graphs; build it from the symbols of a single `Symbols`")]
    Mixed,
    /// A parameter has a value that is not finite.
    #[error("the parameter `{name}` is {value}; it must be a finite number")]
    ParameterValue {
        /// The name.
        name: String,
        /// Its value.
        value: f64,
    },
    /// The formula, or one of its derivatives, is too large.
    #[error(
        "the formula and its derivatives have more than {limit} operations; simplify the formula, or write the \
         Lagrangian in Rust"
    )]
    TooLarge {
        /// The bound.
        limit: usize,
    },
}

impl FormulaError {
    /// An error on a whole text that names what is assigned.
    pub(crate) fn target(text: &str, message: impl Into<String>) -> Self {
        FormulaError::Target(ParseError::at(text, (0, text.len()), message))
    }
}

/// A position in a text that cannot be parsed, with the reason. `Display` shows the line, with the position marked
/// below.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ParseError {
    /// The reason, and the correction if one is known.
    pub message: String,
    /// The nearest known name, if a name is unknown.
    pub nearest: Option<String>,
    /// The line, counted from 1.
    pub line: usize,
    /// The column, counted in characters from 1.
    pub column: usize,
    /// The length of the marked part, in characters: at least 1.
    pub length: usize,
    /// The text of the line.
    pub text: String,
    /// The start of the marked part in the text of the line, in characters from 0.
    pub mark: usize,
}

/// The number of characters of a line that are shown before and after the marked position, so that
/// a shown line has at most 120.
const SHOWN_CHARACTERS: usize = 60;

impl ParseError {
    /// The error at the bytes `start .. end` of a text. Also for programs that read files with formulas in them.
    pub fn at(source: &str, (start, end): (usize, usize), message: impl Into<String>) -> Self {
        let start = (0..=start.min(source.len())).rev().find(|i| source.is_char_boundary(*i)).unwrap_or(0);
        let (before, rest) = source.split_at(start);
        let head = before.rsplit('\n').next().unwrap_or("");
        let tail = rest.split('\n').next().unwrap_or("");
        let marked = rest.char_indices().take_while(|(i, c)| start + i < end && *c != '\n').count();
        ParseError {
            message: message.into(),
            nearest: None,
            line: before.matches('\n').count() + 1,
            column: head.chars().count() + 1,
            mark: head.chars().count(),
            length: marked.max(1),
            text: format!("{head}{tail}").trim_end_matches('\r').to_owned(),
        }
    }

    /// The same error for a text that is part of another one, such as a file: `line` and `column` are the position of
    /// the text in it.
    pub fn moved_to(mut self, line: usize, column: usize) -> Self {
        if self.line == 1 {
            self.column += column.saturating_sub(1);
        }
        self.line += line.saturating_sub(1);
        self
    }
}

impl Display for ParseError {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let ParseError { message, line, column, length, text, mark, .. } = self;
        write!(f, "line {line}, column {column}: {message}")?;
        if let Some(nearest) = &self.nearest {
            write!(f, "; did you mean `{nearest}`?")?;
        }
        // The column within the shown text, which may be a part of a longer line.
        let width = text.chars().count();
        let at = (*mark).min(width);
        let first = at.saturating_sub(SHOWN_CHARACTERS);
        let shown: String = text.chars().skip(first).take(2 * SHOWN_CHARACTERS).collect();
        // Tabs are kept, so that the mark is below its position.
        let indent: String = shown.chars().take(at - first).map(|c| if c == '\t' { c } else { ' ' }).collect();
        let mark = "^".repeat((*length).clamp(1, SHOWN_CHARACTERS));
        write!(f, "\n  {shown}\n  {indent}{mark}")
    }
}

impl std::error::Error for ParseError {}
