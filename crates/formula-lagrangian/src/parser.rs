//! A parser from text to a node of a graph, by operator precedence (V. Pratt, "Top down operator precedence", 1973).

mod calls;
mod constraints;
mod expressions;
mod forces;
mod messages;
mod targets;
mod values;

pub(crate) use constraints::not_holonomic;
pub(crate) use targets::{Kind, Target};

use crate::forces::{Forces, RAYLEIGH};
use crate::limits::{LONGEST_TEXT, MOST_NODES};
use crate::names::Names;
use crate::token::{Token, Word, words};
use crate::{Formula, Graph, Id, ParseError};

/// The maximum number of words that are read; those of a sum count once for each of its terms. It bounds the time for
/// sums of many terms that add no nodes.
const MOST_WORDS: usize = 1_000_000;

/// The name that the value at the end of a text may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ValueName {
    /// `L` only, or `H` for a Hamiltonian.
    Function,
    /// Any name that is not used otherwise.
    Any,
}

/// The state of the parser.
pub(crate) struct Parser<'a> {
    text: &'a str,
    words: Vec<Word<'a>>,
    at: usize,
    names: &'a Names,
    graph: &'a mut Graph,
    /// Definitions and the indices of sums, the innermost last.
    locals: Vec<(&'a str, Id)>,
    depth: usize,
    read: usize,
    /// The depth of brackets, within which lines do not end.
    brackets: usize,
    value_name: ValueName,
    /// The Lagrangian of an expression, whose energy, momenta and conformal factor the expression may use.
    beside: Option<&'a Formula>,
    /// The forces of the text; `None` for a text that can have none.
    forces: Option<Forces>,
    /// Whether the text is that of a holonomic constraint, a smooth function of the coordinates.
    positions_only: bool,
}

type Parsed<T> = Result<T, ParseError>;

impl<'a> Parser<'a> {
    /// A parser of a text, before its first word.
    pub fn new(text: &'a str, names: &'a Names, graph: &'a mut Graph, value_name: ValueName) -> Parsed<Self> {
        if text.len() > LONGEST_TEXT {
            let message = format!("the text has {} bytes; it can have at most {LONGEST_TEXT}", text.len());
            return Err(ParseError::at(text, (0, 0), message));
        }
        let words = words(text)?;
        Ok(Parser {
            text,
            words,
            at: 0,
            names,
            graph,
            locals: Vec::new(),
            depth: 0,
            read: 0,
            brackets: 0,
            value_name,
            beside: None,
            forces: None,
            positions_only: false,
        })
    }

    /// Parses the text of a Lagrangian, which may also have lines with forces, or of a Hamiltonian.
    pub fn parse_formula(text: &'a str, names: &'a Names, graph: &'a mut Graph) -> Parsed<(Id, Forces)> {
        let mut parser = Self::new(text, names, graph, ValueName::Function)?;
        parser.forces = (!names.are_of_hamiltonian()).then(Forces::default);
        let root = parser.program()?;
        Ok((root, parser.forces.take().unwrap_or_default()))
    }

    /// Permits the energy, momenta and conformal factor of a Lagrangian.
    pub fn beside(mut self, formula: &'a Formula) -> Self {
        self.beside = Some(formula);
        self
    }

    /// Gives an integer a name, if there is one.
    pub fn with_index(mut self, index: Option<(&'a str, u32)>) -> Self {
        if let Some((name, i)) = index {
            let number = self.graph.number(f64::from(i));
            self.locals.push((name, number));
        }
        self
    }

    /// Parses the text, which consists of definitions and forces, one per line, and the value at the end, with or
    /// without a name. Returns the value.
    pub fn program(&mut self) -> Parsed<Id> {
        loop {
            self.skip_lines();
            let (first, second) = (self.word(0), self.word(1));
            if self.begins_force(first, second) {
                self.force()?;
                continue;
            }
            if let (Token::Name(name), Token::Sign('=')) = (first.token, second.token) {
                self.at += 2;
                // A named value is the last one, unless more lines follow.
                let value = self.expression(0)?;
                let more = self.ends_line()?;
                if !more {
                    if self.value_name == ValueName::Any {
                        self.define(name, first, value)?;
                    } else if name != self.names.letter() {
                        let message = format!("expected a value after the definition of `{name}`");
                        return Err(self.error(self.word(0), message));
                    }
                    return Ok(value);
                }
                self.define(name, first, value)?;
                self.note_rayleigh(name, value);
                continue;
            }
            let value = self.expression(0)?;
            if self.ends_line()? {
                let word = self.word(0);
                let message = "a formula has a single value, at its end; write a definition as `name = ...`";
                return Err(self.error(word, message));
            }
            return Ok(value);
        }
    }

    /// Expects the end of a line, and returns whether more text follows.
    fn ends_line(&mut self) -> Parsed<bool> {
        let word = self.word(0);
        match word.token {
            Token::Line => {
                self.skip_lines();
                Ok(self.word(0).token != Token::End)
            }
            Token::End => Ok(false),
            _ => Err(self.unexpected(word, "an operator")),
        }
    }

    fn define(&mut self, name: &'a str, word: Word<'a>, value: Id) -> Parsed<()> {
        let taken = self.names.is_reserved(name)
            || self.names.blocks.iter().any(|b| b.name == name)
            || self.names.momentum(name).is_some()
            || self.names.parameters.iter().any(|p| p == name)
            || self.names.table(name).is_some()
            || self.locals.iter().any(|(local, _)| *local == name);
        if taken {
            return Err(
                self.error(word, format!("the name `{name}` is in use; choose another name for this definition"))
            );
        }
        if name == RAYLEIGH && self.names.are_of_hamiltonian() {
            return Err(self.error(word, "a Hamiltonian has no dissipation function: write the drag as a term in z"));
        }
        self.locals.push((name, value));
        Ok(())
    }

    fn word(&self, ahead: usize) -> Word<'a> {
        let end = (self.text.len(), self.text.len());
        let mut words = self.words.iter().skip(self.at);
        let word =
            if self.brackets == 0 { words.nth(ahead) } else { words.filter(|w| w.token != Token::Line).nth(ahead) };
        word.copied().unwrap_or(Word { token: Token::End, span: end })
    }

    /// Consumes the next word.
    fn next(&mut self) -> Parsed<Word<'a>> {
        if self.brackets > 0 {
            self.skip_lines();
        }
        let word = self.word(0);
        self.at = (self.at + 1).min(self.words.len());
        self.read += 1;
        if self.read > MOST_WORDS || self.graph.len() > MOST_NODES {
            let message =
                format!("the formula has more than {MOST_NODES} operations after its sums are expanded; simplify it");
            return Err(self.error(word, message));
        }
        Ok(word)
    }

    fn skip_lines(&mut self) {
        while self.words.get(self.at).is_some_and(|w| w.token == Token::Line) {
            self.at += 1;
        }
    }

    /// Consumes a required sign.
    fn expect(&mut self, sign: char) -> Parsed<()> {
        let word = self.word(0);
        if word.token == Token::Sign(sign) {
            self.next()?;
            return Ok(());
        }
        Err(self.unexpected(word, &format!("`{sign}`")))
    }

    fn error(&self, word: Word<'a>, message: impl Into<String>) -> ParseError {
        ParseError::at(self.text, word.span, message)
    }
}
