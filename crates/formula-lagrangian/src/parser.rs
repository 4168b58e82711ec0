//! A parser from text to a node of a graph, by operator precedence (V. Pratt, "Top down operator precedence", 1973).

mod messages;

use crate::functions::{FUNCTIONS, OPERATIONS};
use crate::hints::{CHOICE, instead_of_function, instead_of_name, velocity_of};
use crate::names::{Block, Names, is_reserved, nearest_name};
use crate::quantities::Quantity;
use crate::token::{Token, Word, words};
use crate::{Formula, Function, Graph, Id, Operation, ParseError};

/// The maximum length of a text, in bytes.
pub const LONGEST_TEXT: usize = 1 << 16;
/// The maximum nesting depth of brackets, signs and powers.
pub const DEEPEST_NESTING: usize = 200;
/// The maximum number of nodes of a text.
pub const MOST_NODES: usize = 20_000;
/// The maximum number of words that are read; those of a sum count once for each of its terms.
const MOST_WORDS: usize = 1_000_000;

/// The precedence of operators: sums, products, signs, powers.
const SUM: u8 = 1;
const PRODUCT: u8 = 3;
const SIGN: u8 = 5;
const POWER: u8 = 8;

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
    /// Whether the value may have any unused name, instead of `L`.
    named: bool,
    /// The Lagrangian of an expression, whose energy, momenta and conformal factor the expression may use.
    beside: Option<&'a Formula>,
}

type Parsed<T> = Result<T, ParseError>;

impl<'a> Parser<'a> {
    /// Parses a text into a node of a graph. The text consists of definitions, one per line, and the value at the end,
    /// with or without `L =`; if `named`, the value may have any name.
    pub fn parse(text: &'a str, names: &'a Names, graph: &'a mut Graph, named: bool) -> Parsed<Id> {
        Self::parse_beside(None, text, names, graph, named)
    }

    /// The same for an expression that may use the energy, momenta and conformal factor of a Lagrangian.
    pub fn parse_beside(
        beside: Option<&'a Formula>,
        text: &'a str,
        names: &'a Names,
        graph: &'a mut Graph,
        named: bool,
    ) -> Parsed<Id> {
        if text.len() > LONGEST_TEXT {
            let message = format!("the text has {} bytes; it can have at most {LONGEST_TEXT}", text.len());
            return Err(ParseError::at(text, (0, 0), message));
        }
        let words = words(text)?;
        let mut parser = Parser {
            text,
            words,
            at: 0,
            names,
            graph,
            locals: Vec::new(),
            depth: 0,
            read: 0,
            brackets: 0,
            named,
            beside,
        };
        parser.program()
    }

    fn program(&mut self) -> Parsed<Id> {
        loop {
            self.skip_lines();
            let (first, second) = (self.word(0), self.word(1));
            if let (Token::Name(name), Token::Sign('=')) = (first.token, second.token) {
                self.at += 2;
                // A named value is the last one, unless more lines follow.
                let value = self.expression(0)?;
                let more = self.ends_line()?;
                if !more {
                    if self.named {
                        self.define(name, first, value)?;
                    } else if name != "L" {
                        let message = format!("expected a value after the definition of `{name}`");
                        return Err(self.error(self.word(0), message));
                    }
                    return Ok(value);
                }
                self.define(name, first, value)?;
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
        let taken = is_reserved(name)
            || self.names.blocks.iter().any(|b| b.name == name)
            || self.names.parameters.iter().any(|p| p == name)
            || self.locals.iter().any(|(local, _)| *local == name);
        if taken {
            return Err(self.error(word, format!("the name `{name}` is in use; choose another name for this definition")));
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
            let message = format!("the formula has more than {MOST_NODES} operations after its sums are expanded; \
                                   simplify it");
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

    /// An expression whose operators have a higher precedence than `weakest`.
    fn expression(&mut self, weakest: u8) -> Parsed<Id> {
        if self.depth >= DEEPEST_NESTING {
            let message = format!("the formula is nested more than {DEEPEST_NESTING} levels deep; define a part of it \
                                   beforehand, as `name = ...`");
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
            self.after_operator();
            let other = self.expression(right)?;
            left = self.graph.binary(operation, left, other);
            self.check_number(left, word)?;
        }
    }

    /// Lines continue after an operator.
    fn after_operator(&mut self) {
        self.skip_lines();
    }

    /// Rejects numbers that are not finite, such as `1/0`.
    fn check_number(&self, id: Id, word: Word<'a>) -> Parsed<()> {
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
            Token::Name(name) => self.named(name, word),
            _ => {
                self.at = self.at.saturating_sub(1);
                Err(self.unexpected(word, "a value"))
            }
        }
    }

    /// The content of brackets, the first of which is already consumed.
    fn bracketed<T>(&mut self, inside: impl FnOnce(&mut Self) -> Parsed<T>, close: char) -> Parsed<T> {
        self.brackets += 1;
        let value = inside(self).and_then(|value| self.expect(close).map(|()| value));
        self.brackets -= 1;
        value
    }

    /// A value that begins with a name.
    fn named(&mut self, name: &'a str, word: Word<'a>) -> Parsed<Id> {
        if self.word(0).token == Token::Sign('(') && !self.is_value(name) {
            return self.call(name, word);
        }
        let prime = self.word(0);
        let has_prime = prime.token == Token::Sign('\'');
        if let Some((_, value)) = self.locals.iter().rev().find(|(local, _)| *local == name) {
            if has_prime {
                return Err(self.error(prime, format!("`{name}` is a definition and has no velocity; write its \
                                                      derivative out")));
            }
            return Ok(*value);
        }
        if let Some(block) = self.names.blocks.iter().find(|b| b.name == name) {
            return self.coordinate(block, word);
        }
        if let Some(i) = self.names.parameters.iter().position(|p| p == name) {
            if has_prime {
                let message = format!("`{name}` is a parameter, which is constant: only coordinates have a velocity");
                return Err(self.error(prime, message));
            }
            return Ok(self.graph.parameter(i as u32));
        }
        let all = Block { name: name.to_owned(), first: 0, count: Some(self.names.dimension) };
        if let Some(message) = self.has_no_velocity(name) {
            return Err(self.error(self.word(0), message));
        }
        match name {
            "t" => Ok(self.graph.time()),
            "z" => Ok(self.graph.action()),
            "pi" => Ok(self.graph.number(std::f64::consts::PI)),
            "n" => Ok(self.graph.number(self.names.dimension as f64)),
            "q" if self.word(0).token == Token::Sign('[') => self.coordinate(&all, word),
            "v" if self.word(0).token == Token::Sign('[') => {
                let i = self.index(&all)?;
                Ok(self.graph.velocity(i))
            }
            "if" => Err(self.error(word, format!("`if` is a function: {CHOICE}"))),
            "sum" => Err(self.error(word, "`sum` is a function: write `sum(i, 0, n-1, q[i]^2)`")),
            _ if is_reserved(name) => Err(self.error(word, format!("`{name}` is a function: write `{name}(...)`"))),
            _ => self.quantity(name, word),
        }
    }

    /// A quantity of the motion of the Lagrangian to which the expression belongs.
    fn quantity(&mut self, name: &'a str, word: Word<'a>) -> Parsed<Id> {
        let mut error = self.unknown(name, word, "name");
        let Some(formula) = self.beside else { return Err(error) };
        let names = self.names;
        let block = name.strip_prefix("p_").and_then(|of| names.blocks.iter().find(|block| block.name == of));
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
        let found = quantity.node(formula, self.graph);
        found.ok_or_else(|| self.error(word, format!("`{name}` has more operations than an expression can have")))
    }

    /// Whether a name has a value, so that a bracket after it is a product with a missing `*`.
    fn is_value(&self, name: &str) -> bool {
        let known = self.names.blocks.iter().map(|b| b.name.as_str());
        let known = known.chain(self.names.parameters.iter().map(String::as_str)).chain(["t", "z", "pi", "n"]);
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
        Ok(if prime { self.graph.velocity(index) } else { self.graph.position(index) })
    }

    /// Consumes a prime, if there is one.
    fn takes_prime(&mut self, word: Word<'a>) -> Parsed<bool> {
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
    fn index(&mut self, block: &Block) -> Parsed<u32> {
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
    fn whole(&mut self) -> Parsed<i64> {
        let word = self.word(0);
        let id = self.expression(0)?;
        match self.graph.as_number(id) {
            Some(x) if x.fract() == 0.0 && x.abs() <= 1e9 => Ok(x as i64),
            Some(x) => Err(self.error(word, format!("expected an integer, found {x}"))),
            None => Err(self.error(word, "expected an integer that does not depend on parameters or on the state")),
        }
    }

    /// A function with its arguments.
    fn call(&mut self, name: &'a str, word: Word<'a>) -> Parsed<Id> {
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
        if function.is_none() && operation.is_none() && !inverse {
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
            (None, None, [a]) => self.inverse(name == "asin", *a),
            (_, operation, found) => {
                let wanted = if operation.is_some() { "two" } else { "one" };
                let message = format!("`{name}` has {wanted} of arguments, not {}", found.len());
                return Err(self.error(word, message.replace("one of arguments", "one argument").replace(" of ", " ")));
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
        if is_reserved(index) || self.is_value(index) {
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
