//! Lines with forces, `force[x] = ...` and `rayleigh = ...`.

use super::{Kind, Parsed, Parser};
use crate::Id;
use crate::forces::{RAYLEIGH, given_twice};
use crate::token::{Token, Word};

/// The word with which the line of a force begins.
const FORCE: &str = "force";

impl<'a> Parser<'a> {
    /// Whether two words begin the line of a force. A coordinate, a parameter or a definition of the name `force` takes
    /// precedence.
    pub(super) fn begins_force(&self, first: Word<'a>, second: Word<'a>) -> bool {
        first.token == Token::Name(FORCE) && second.token == Token::Sign('[') && !self.is_value(FORCE)
    }

    /// A line `force[x] = ...`, with the end of the line.
    pub(super) fn force(&mut self) -> Parsed<()> {
        let word = self.next()?;
        if self.forces.is_none() {
            let message = "a force is a line of the text of a Lagrangian, not of a Hamiltonian or another expression";
            return Err(self.error(word, message));
        }
        self.next()?;
        let place = self.word(0);
        let target = self.bracketed(|parser| parser.target(), ']')?;
        if target.kind != Kind::Position {
            return Err(self.error(place, "a force belongs to a coordinate; write `force[x]`, without a prime"));
        }
        self.expect('=')?;
        let begin = self.at;
        for (i, index) in target.indices() {
            self.at = begin;
            let locals = self.locals.len();
            if let Some((name, value)) = index {
                let number = self.graph.number(f64::from(value));
                self.locals.push((name, number));
            }
            let value = self.expression(0);
            self.locals.truncate(locals);
            self.give_force(i, value?, place)?;
        }
        if !self.ends_line()? {
            return Err(self.error(self.word(0), "expected the Lagrangian after the forces; it is the last line"));
        }
        Ok(())
    }

    fn give_force(&mut self, i: u32, value: Id, place: Word<'a>) -> Parsed<()> {
        let dimension = self.names.dimension;
        if self.forces.as_mut().is_some_and(|forces| forces.set(i, value, dimension)) {
            return Ok(());
        }
        Err(self.error(place, given_twice(self.names, i)))
    }

    /// Records a definition that is Rayleigh's function.
    pub(super) fn note_rayleigh(&mut self, name: &str, value: Id) {
        if let Some(forces) = self.forces.as_mut().filter(|_| name == RAYLEIGH) {
            forces.rayleigh = Some(value);
        }
    }
}
