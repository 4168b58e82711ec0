//! Expressions of operators, by precedence.

use super::{Parsed, Parser};
use crate::limits::DEEPEST_NESTING;
use crate::token::{Token, Word};
use crate::{Function, Id, Operation};

/// The precedence of operators: sums, products, signs, powers. The numbers between them are free for the precedence of
/// a right operand, which for a right-associative operator is lower by one.
const SUM: u8 = 1;
const PRODUCT: u8 = 3;
const SIGN: u8 = 5;
const POWER: u8 = 8;

impl<'a> Parser<'a> {
    /// An expression whose operators have a higher precedence than `weakest`.
    pub(super) fn expression(&mut self, weakest: u8) -> Parsed<Id> {
        if self.depth >= DEEPEST_NESTING {
            let message = format!(
                "the formula is nested more than {DEEPEST_NESTING} levels deep; define a part of it beforehand, as \
                 `name = ...`"
            );
            return Err(self.error(self.word(0), message));
        }
        self.depth += 1;
        let value = self.operators(weakest);
        self.depth -= 1;
        value
    }

    fn operators(&mut self, weakest: u8) -> Parsed<Id> {
        let mut left = self.operand()?;
        loop {
            let word = self.word(0);
            let Token::Sign(sign) = word.token else { return Ok(left) };
            let (operation, strength, right) = match sign {
                '+' => (Operation::Add, SUM, SUM),
                '-' => (Operation::Sub, SUM, SUM),
                '*' => (Operation::Mul, PRODUCT, PRODUCT),
                '/' => (Operation::Div, PRODUCT, PRODUCT),
                // Right-associative.
                '^' => (Operation::Power, POWER, POWER - 1),
                _ => return Ok(left),
            };
            if strength <= weakest {
                return Ok(left);
            }
            self.next()?;
            // A line continues after an operator.
            self.skip_lines();
            let other = self.expression(right)?;
            left = self.graph.binary(operation, left, other);
            self.check_number(left, word)?;
        }
    }

    /// Rejects numbers that are not finite, such as `1/0`.
    pub(super) fn check_number(&self, id: Id, word: Word<'a>) -> Parsed<()> {
        match self.graph.as_number(id) {
            Some(x) if !x.is_finite() => Err(self.error(word, format!("the value is {x}; it must be a finite number"))),
            _ => Ok(()),
        }
    }

    fn operand(&mut self) -> Parsed<Id> {
        let word = self.next()?;
        match word.token {
            Token::Number(x) => Ok(self.graph.number(x)),
            Token::Sign('-') => {
                let value = self.expression(SIGN)?;
                Ok(self.graph.unary(Function::Neg, value))
            }
            Token::Sign('+') => self.expression(SIGN),
            Token::Sign('(') => self.bracketed(|parser| parser.expression(0), ')'),
            Token::Name(name) => {
                let value = self.named(name, word)?;
                self.check_in_constraint(value, word)?;
                Ok(value)
            }
            _ => {
                self.at = self.at.saturating_sub(1);
                Err(self.unexpected(word, "a value"))
            }
        }
    }

    /// The content of brackets, the first of which is already consumed.
    pub(super) fn bracketed<T>(&mut self, inside: impl FnOnce(&mut Self) -> Parsed<T>, close: char) -> Parsed<T> {
        self.brackets += 1;
        let value = inside(self).and_then(|value| self.expect(close).map(|()| value));
        self.brackets -= 1;
        value
    }
}
