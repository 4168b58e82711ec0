//! What a text assigns: the coordinate of a force; the coordinates, velocities and z that a reset sets.

use super::{Parsed, Parser};
use crate::ParseError;
use crate::names::Block;
use crate::nearest_name;
use crate::token::{Token, Word};

/// The kind of a variable that is assigned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Position,
    Velocity,
    Action,
}

/// A variable that is assigned, or all entries of an array.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target<'a> {
    pub kind: Kind,
    /// The index of the coordinate, or that of the first entry of the array.
    pub first: u32,
    /// For all entries of an array, such as `u[i]`, the name of the index and the number of entries.
    pub entries: Option<(&'a str, u32)>,
}

impl<'a> Target<'a> {
    /// The index of each coordinate, with the name and the value of the index in an array.
    pub fn indices(&self) -> impl Iterator<Item = (u32, Option<(&'a str, u32)>)> + use<'a> {
        let Target { first, entries, .. } = *self;
        let count = entries.map_or(1, |(_, count)| count);
        (0..count).map(move |i| (first.saturating_add(i), entries.map(|(name, _)| (name, i))))
    }
}

impl<'a> Parser<'a> {
    /// A text that consists of one target.
    pub fn only_target(mut self) -> Parsed<Target<'a>> {
        let target = self.target()?;
        let word = self.word(0);
        if word.token == Token::End { Ok(target) } else { Err(self.unexpected(word, "the end")) }
    }

    /// A coordinate by its name or its index, with a prime its velocity, or z. `u[i]` are all entries of an array if
    /// `i` has no other meaning.
    pub(super) fn target(&mut self) -> Parsed<Target<'a>> {
        let (word, names) = (self.word(0), self.names);
        let all = |name: &str| Block { name: name.to_owned(), first: 0, count: Some(names.dimension) };
        let name = match word.token {
            Token::Name(name) => name,
            Token::End | Token::Line => return Err(self.unexpected(word, "the name of a coordinate")),
            _ => return self.by_index(word),
        };
        let opens = self.word(1).token == Token::Sign('[');
        match (names.blocks.iter().find(|block| block.name == name), name) {
            (Some(block), _) => self.entry(block, Kind::Position, word),
            (None, "q") if opens => self.entry(&all(name), Kind::Position, word),
            (None, "v") if opens => self.entry(&all(name), Kind::Velocity, word),
            (None, name) if name == names.action => {
                self.next()?;
                Ok(Target { kind: Kind::Action, first: 0, entries: None })
            }
            _ if self.is_value(name) => self.by_index(word),
            _ => Err(self.no_coordinate(name, word)),
        }
    }

    /// The coordinate with an index.
    fn by_index(&mut self, word: Word<'a>) -> Parsed<Target<'a>> {
        let (index, count) = (self.whole()?, self.names.dimension);
        match u32::try_from(index) {
            Ok(first) if (first as usize) < count => Ok(Target { kind: Kind::Position, first, entries: None }),
            _ => Err(self.error(word, format!("there is no coordinate {index}; their indices are 0 to {}", count - 1))),
        }
    }

    /// A coordinate, or an entry of an array, or all of its entries, whose name is the next word.
    fn entry(&mut self, block: &Block, kind: Kind, word: Word<'a>) -> Parsed<Target<'a>> {
        self.next()?;
        let mut prime = kind == Kind::Position && self.takes_prime(word)?;
        let (open, inside, close) = (self.word(0), self.word(1), self.word(2));
        let (first, entries) = match (block.count, open.token, inside.token, close.token) {
            (None, Token::Sign('['), ..) => {
                return Err(self.error(open, format!("`{}` is a single number and has no entries", block.name)));
            }
            (None, ..) => (block.first as u32, None),
            (Some(count), Token::Sign('['), Token::Name(index), Token::Sign(']')) if self.is_free(index) => {
                for _ in 0..3 {
                    self.next()?;
                }
                (block.first as u32, Some((index, count as u32)))
            }
            _ => (self.index(block)?, None),
        };
        prime |= kind == Kind::Position && self.takes_prime(word)?;
        Ok(Target { kind: if prime { Kind::Velocity } else { kind }, first, entries })
    }

    /// Whether a name has no meaning, so that it may be that of an index.
    fn is_free(&self, name: &str) -> bool {
        !(self.names.is_reserved(name) || self.is_value(name) || matches!(name, "q" | "v"))
            && self.names.table(name).is_none()
    }

    fn no_coordinate(&self, name: &str, word: Word<'a>) -> ParseError {
        let mut error = self.error(word, format!("there is no coordinate `{name}`"));
        error.nearest = nearest_name(name, self.names.blocks.iter().map(|b| b.name.as_str())).map(str::to_owned);
        if error.nearest.is_none() {
            let known: Vec<String> = self.names.coordinates().collect();
            error.message = format!("{}; the coordinates are {}", error.message, known.join(", "));
        }
        error
    }
}
