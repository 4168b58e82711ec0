//! Values that begin with a name: coordinates, velocities, parameters, definitions, quantities of the motion.

use super::{Parsed, Parser};
use crate::hints::CHOICE;
use crate::names::Block;
use crate::nearest_name;
use crate::quantities::Quantity;
use crate::token::{Token, Word};
use crate::{Formula, Id};

/// The largest absolute value of an integer in a text: far beyond the number of entries or terms that are possible, and
/// exact as a floating-point number.
const MAX_INTEGER: f64 = 1e9;

impl<'a> Parser<'a> {
    /// A value that begins with a name.
    pub(super) fn named(&mut self, name: &'a str, word: Word<'a>) -> Parsed<Id> {
        if self.word(0).token == Token::Sign('(') && !self.is_value(name) {
            return self.call(name, word);
        }
        let prime = self.word(0);
        let has_prime = prime.token == Token::Sign('\'');
        if let Some((_, value)) = self.locals.iter().rev().find(|(local, _)| *local == name) {
            if has_prime {
                return Err(self
                    .error(prime, format!("`{name}` is a definition and has no velocity; write its derivative out")));
            }
            return Ok(*value);
        }
        if let Some(block) = self.names.blocks.iter().find(|b| b.name == name) {
            return self.coordinate(block, word);
        }
        if let Some(block) = self.names.momentum(name) {
            if has_prime {
                return Err(self.error(prime, format!("`{name}` is a momentum: only coordinates have a velocity")));
            }
            let index = if block.count.is_some() { self.index(block)? } else { block.first as u32 };
            return Ok(self.graph.velocity(index));
        }
        if let Some(i) = self.names.parameters.iter().position(|p| p == name) {
            if has_prime {
                let message = format!("`{name}` is a parameter, which is constant: only coordinates have a velocity");
                return Err(self.error(prime, message));
            }
            return Ok(self.graph.parameter(i as u32));
        }
        let all = Block { name: name.to_owned(), first: 0, count: Some(self.names.dimension) };
        let of_hamiltonian = self.names.are_of_hamiltonian();
        if let Some(message) = self.has_no_velocity(name) {
            return Err(self.error(self.word(0), message));
        }
        match name {
            "t" => Ok(self.graph.time()),
            _ if name == self.names.action => Ok(self.graph.action()),
            "pi" => Ok(self.graph.number(std::f64::consts::PI)),
            "n" => Ok(self.graph.number(self.names.dimension as f64)),
            "q" if self.word(0).token == Token::Sign('[') => self.coordinate(&all, word),
            "p" if of_hamiltonian && self.word(0).token == Token::Sign('[') => {
                let i = self.index(&all)?;
                Ok(self.graph.velocity(i))
            }
            "v" if self.word(0).token == Token::Sign('[') => {
                let i = self.index(&all)?;
                self.velocity(i, word)
            }
            "if" => Err(self.error(word, format!("`if` is a function: {CHOICE}"))),
            "sum" => Err(self.error(word, "`sum` is a function: write `sum(i, 0, n-1, q[i]^2)`")),
            _ if self.names.table(name).is_some() => {
                Err(self.error(word, format!("`{name}` is a table, a function: write `{name}(t)`")))
            }
            _ if self.names.is_reserved(name) => {
                Err(self.error(word, format!("`{name}` is a function: write `{name}(...)`")))
            }
            _ => self.quantity(name, word),
        }
    }

    /// A quantity of the motion of the Lagrangian to which the expression belongs.
    fn quantity(&mut self, name: &'a str, word: Word<'a>) -> Parsed<Id> {
        let mut error = self.unknown(name, word, "name");
        let Some(formula) = self.beside else { return Err(error) };
        let names = self.names;
        let of_lagrangian = name.strip_prefix("p_").filter(|_| !names.are_of_hamiltonian());
        let block = of_lagrangian.and_then(|of| names.blocks.iter().find(|block| block.name == of));
        let quantity = match (Quantity::of(name), block) {
            (Some(quantity), _) => quantity,
            (None, Some(block)) if block.count.is_some() => Quantity::Momentum(self.index(block)?),
            (None, Some(block)) => Quantity::Momentum(block.first as u32),
            (None, None) => {
                let known: Vec<String> = Quantity::names(names).collect();
                let nearest = nearest_name(name, known.iter().map(String::as_str)).map(str::to_owned);
                error.nearest = error.nearest.or(nearest);
                return Err(error);
            }
        };
        self.derived(quantity, formula, name, word)
    }

    fn derived(&mut self, quantity: Quantity, formula: &Formula, name: &str, word: Word<'a>) -> Parsed<Id> {
        let found = quantity.node(formula, self.graph);
        found.ok_or_else(|| self.error(word, format!("`{name}` has more operations than an expression can have")))
    }

    /// The velocity of a coordinate, which is `H_p` in an expression that belongs to a Hamiltonian.
    fn velocity(&mut self, index: u32, word: Word<'a>) -> Parsed<Id> {
        if !self.names.are_of_hamiltonian() {
            return Ok(self.graph.velocity(index));
        }
        let name = self.text.get(word.span.0..word.span.1).unwrap_or("x");
        match self.beside {
            Some(formula) => self.derived(Quantity::Velocity(index), formula, name, word),
            None => {
                let momentum = self.names.momenta().into_iter().nth(index as usize).unwrap_or_default();
                let message = format!("a Hamiltonian depends on momenta, not on velocities; write `{momentum}`");
                Err(self.error(word, message))
            }
        }
    }

    /// Whether a name has a value, so that a bracket after it is a product with a missing `*`.
    pub(super) fn is_value(&self, name: &str) -> bool {
        let momenta = self.names.momenta.iter().flatten();
        let known = self.names.blocks.iter().chain(momenta).map(|b| b.name.as_str());
        let known = known.chain(self.names.parameters.iter().map(String::as_str));
        let known = known.chain(["t", "pi", "n", self.names.action.as_str()]);
        known.chain(self.locals.iter().map(|(local, _)| *local)).any(|k| k == name)
    }

    /// A coordinate, or with a prime its velocity.
    fn coordinate(&mut self, block: &Block, word: Word<'a>) -> Parsed<Id> {
        let mut prime = self.takes_prime(word)?;
        let index = match block.count {
            Some(_) => self.index(block)?,
            None if self.word(0).token == Token::Sign('[') => {
                return Err(self.error(self.word(0), format!("`{}` is a single number and has no entries", block.name)));
            }
            None => block.first as u32,
        };
        prime |= self.takes_prime(word)?;
        if prime { self.velocity(index, word) } else { Ok(self.graph.position(index)) }
    }

    /// Consumes a prime, if there is one.
    pub(super) fn takes_prime(&mut self, word: Word<'a>) -> Parsed<bool> {
        let sign = Token::Sign('\'');
        if self.word(0).token != sign {
            return Ok(false);
        }
        self.next()?;
        if self.word(0).token == sign {
            let name = self.text.get(word.span.0..word.span.1).unwrap_or("x");
            let message = format!(
                "the formula has a second derivative of `{name}`; write L in terms of `{name}` and `{name}'`, since \
                 Herglotz' equation determines the acceleration"
            );
            return Err(self.error(word, message));
        }
        Ok(true)
    }

    /// The index of an entry in brackets, as that of a coordinate. It is a number at parse time.
    pub(super) fn index(&mut self, block: &Block) -> Parsed<u32> {
        let (name, count) = (&block.name, block.count.unwrap_or(1));
        let open = self.word(0);
        if open.token != Token::Sign('[') {
            return Err(self.error(open, format!("`{name}` has {count} entries; write one of them as `{name}[0]`")));
        }
        self.next()?;
        let word = self.word(0);
        let index = self.bracketed(|parser| parser.whole(), ']')?;
        match usize::try_from(index) {
            Ok(i) if i < count => Ok((block.first + i) as u32),
            _ => Err(self.error(word, format!("`{name}` has no entry {index}; its entries are 0 to {}", count - 1))),
        }
    }

    /// An integer that is known at parse time.
    pub(super) fn whole(&mut self) -> Parsed<i64> {
        let word = self.word(0);
        let id = self.expression(0)?;
        match self.graph.as_number(id) {
            Some(x) if x.fract() == 0.0 && x.abs() <= MAX_INTEGER => Ok(x as i64),
            Some(x) => Err(self.error(word, format!("expected an integer, found {x}"))),
            None => Err(self.error(word, "expected an integer that does not depend on parameters or on the state")),
        }
    }
}
