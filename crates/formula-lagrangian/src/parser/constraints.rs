//! Holonomic constraints: equations over the coordinates and parameters.

use super::{Parsed, Parser};
use crate::node::Inputs;
use crate::token::{Token, Word};
use crate::{Id, ParseError};

impl<'a> Parser<'a> {
    /// A text that consists of definitions and an equation `a = b`, or an expression that is to vanish. Returns the
    /// node of `a - b`.
    pub fn equation(mut self) -> Parsed<Id> {
        self.positions_only = true;
        loop {
            self.skip_lines();
            let (first, second) = (self.word(0), self.word(1));
            if let (Token::Name(name), Token::Sign('=')) = (first.token, second.token)
                && !self.is_value(name)
            {
                self.at += 2;
                let value = self.expression(0)?;
                if !self.ends_line()? {
                    return Err(self.unknown(name, first, "name"));
                }
                self.define(name, first, value)?;
                continue;
            }
            let left = self.expression(0)?;
            let value = match self.word(0).token {
                Token::Sign('=') => {
                    self.next()?;
                    self.skip_lines();
                    let right = self.expression(0)?;
                    self.graph.sub(left, right)
                }
                _ => left,
            };
            if self.ends_line()? {
                let message = "a constraint is a single equation, at the end of its text; write a definition as \
                               `name = ...`, and give other constraints as texts of their own";
                return Err(self.error(self.word(0), message));
            }
            if self.graph.is_constant(value) {
                let message = "this constraint does not depend on a coordinate; give an equation of coordinates, such \
                               as `x^2 + y^2 = 1`";
                return Err(ParseError::at(self.text, (0, self.text.len()), message));
            }
            return Ok(value);
        }
    }

    /// Refuses a value that a holonomic constraint cannot contain, where it is written.
    pub(super) fn check_in_constraint(&self, value: Id, word: Word<'a>) -> Parsed<()> {
        if !self.positions_only {
            return Ok(());
        }
        match not_holonomic(self.graph.inputs(value)) {
            Some(why) => Err(self.error(word, format!("a constraint {why}"))),
            None if self.graph.has_kink(value) => {
                let message = format!("{} has a kink or a jump; a constraint is a smooth function", word.shown());
                Err(self.error(word, message))
            }
            None => Ok(()),
        }
    }
}

/// Why a function of these inputs is no holonomic, scleronomic constraint.
pub(crate) fn not_holonomic(inputs: Inputs) -> Option<&'static str> {
    if inputs.meets(Inputs::VELOCITY) {
        Some(
            "depends on the coordinates alone, not on velocities; give the equation of positions whose derivative it is",
        )
    } else if inputs.meets(Inputs::TIME) {
        Some("does not depend on time; choose coordinates relative to what moves")
    } else if inputs.meets(Inputs::ACTION) {
        Some("depends on the coordinates alone, not on the action")
    } else {
        None
    }
}
