//! A Lagrangian as text.

mod derivatives;
mod error;
mod evaluation;
mod expression;
mod formula;
mod functions;
mod graph;
mod lagrangian;
mod names;
mod parser;
mod rust_source;
mod structure;
mod tape;
mod token;

pub use error::{FormulaError, MOST_COORDINATES, ParseError};
pub use expression::Expression;
pub use formula::Formula;
pub use graph::{Function, Graph, Id, Node, Operation};
pub use lagrangian::FormulaLagrangian;
pub use parser::{DEEPEST_NESTING, LONGEST_TEXT, MOST_NODES};
