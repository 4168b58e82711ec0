//! Calls of functions, sums and choices.

use super::{Parsed, Parser};
use crate::functions::{FUNCTIONS, OPERATIONS};
use crate::token::{Token, Word};
use crate::{Function, Id, Operation};

impl<'a> Parser<'a> {
    /// A function with its arguments.
    pub(super) fn call(&mut self, name: &'a str, word: Word<'a>) -> Parsed<Id> {
        if name == "sum" {
            self.next()?;
            return self.bracketed(|parser| parser.sum(), ')');
        }
        if name == "if" {
            self.next()?;
            return self.bracketed(|parser| parser.choice(), ')');
        }
        let function = FUNCTIONS.iter().find(|f| f.0 == name).map(|f| f.1);
        let operation = OPERATIONS.iter().find(|o| o.0 == name).map(|o| o.1);
        let inverse = matches!(name, "asin" | "acos");
        let table = self.names.table(name);
        if function.is_none() && operation.is_none() && table.is_none() && !inverse {
            return Err(self.unknown(name, word, "function"));
        }
        self.next()?;
        let arguments = self.bracketed(|parser| parser.arguments(), ')')?;
        let value = match (function, operation, arguments.as_slice()) {
            (Some(function), _, [a]) => self.graph.unary(function, *a),
            (_, Some(operation @ (Operation::Min | Operation::Max)), [first, others @ ..]) if !others.is_empty() => {
                others.iter().fold(*first, |least, a| self.graph.binary(operation, least, *a))
            }
            (_, Some(operation), [a, b]) => self.graph.binary(operation, *a, *b),
            (None, None, [a]) if table.is_some() => self.graph.lookup(table.unwrap_or_default(), 0, *a),
            (None, None, [a]) => self.inverse(name == "asin", *a),
            (_, operation, found) => {
                let arguments = if operation.is_some() { "two arguments" } else { "one argument" };
                return Err(self.error(word, format!("`{name}` takes {arguments}, not {}", found.len())));
            }
        };
        self.check_number(value, word)?;
        Ok(value)
    }

    fn arguments(&mut self) -> Parsed<Vec<Id>> {
        let mut arguments = vec![self.expression(0)?];
        while self.word(0).token == Token::Sign(',') {
            self.next()?;
            arguments.push(self.expression(0)?);
        }
        Ok(arguments)
    }

    /// `asin x` is the angle of the point `(sqrt((1 - x)(1 + x)), x)`, and `acos x` that of the point with these
    /// coordinates exchanged.
    fn inverse(&mut self, sine: bool, x: Id) -> Id {
        let one = self.graph.number(1.0);
        let (below, above) = (self.graph.sub(one, x), self.graph.add(x, one));
        let square = self.graph.mul(below, above);
        let root = self.graph.unary(Function::Sqrt, square);
        let (y, x) = if sine { (x, root) } else { (root, x) };
        self.graph.binary(Operation::Atan2, y, x)
    }

    /// `if(a < b, then, otherwise)`.
    fn choice(&mut self) -> Parsed<Id> {
        let a = self.expression(0)?;
        let word = self.next()?;
        let Token::Sign(sign @ ('<' | '>')) = word.token else {
            self.at = self.at.saturating_sub(1);
            return Err(self.unexpected(word, "`<` or `>`"));
        };
        let b = self.expression(0)?;
        self.expect(',')?;
        let then = self.expression(0)?;
        self.expect(',')?;
        let otherwise = self.expression(0)?;
        let (a, b) = if sign == '<' { (a, b) } else { (b, a) };
        Ok(self.graph.select([a, b, then, otherwise]))
    }

    /// `sum(i, first, last, term)`: the term is parsed again for each index.
    fn sum(&mut self) -> Parsed<Id> {
        let word = self.next()?;
        let Token::Name(index) = word.token else {
            self.at = self.at.saturating_sub(1);
            return Err(self.unexpected(word, "the name of an index, such as `i` in `sum(i, 0, n-1, q[i]^2)`"));
        };
        if self.word(0).token != Token::Sign(',') {
            let message =
                format!("expected `,`, found {}: a sum has the form `sum(i, 0, n-1, q[i]^2)`", self.word(0).shown());
            return Err(self.error(self.word(0), message));
        }
        if self.names.is_reserved(index) || self.is_value(index) || self.names.table(index).is_some() {
            return Err(self.error(word, format!("the name `{index}` is in use; choose another name for the index")));
        }
        self.expect(',')?;
        let first = self.whole()?;
        self.expect(',')?;
        let last = self.whole()?;
        self.expect(',')?;
        if last < first {
            self.skip_argument();
            return Ok(self.graph.number(0.0));
        }
        let (begin, mut sum) = (self.at, None);
        for i in first..=last {
            self.at = begin;
            let number = self.graph.number(i as f64);
            self.locals.push((index, number));
            let term = self.expression(0);
            self.locals.pop();
            let term = term?;
            sum = Some(match sum {
                None => term,
                Some(sum) => self.graph.add(sum, term),
            });
        }
        Ok(sum.unwrap_or_else(|| self.graph.number(0.0)))
    }

    /// Skips to the bracket that closes the present one, since the term of an empty sum cannot be parsed.
    fn skip_argument(&mut self) {
        let mut open = 0_usize;
        while let Some(word) = self.words.get(self.at) {
            match word.token {
                Token::Sign('(' | '[') => open += 1,
                Token::Sign(')' | ']') if open == 0 => return,
                Token::Sign(')' | ']') => open -= 1,
                _ => {}
            }
            self.at += 1;
        }
    }
}
