//! Error messages of the parser, with the correction to make.

use super::Parser;
use crate::ParseError;
use crate::hints::{instead_of_function, instead_of_name, velocity_of};
use crate::names::ACTION;
use crate::token::{Token, Word};

impl<'a> Parser<'a> {
    pub(super) fn unexpected(&self, word: Word<'a>, wanted: &str) -> ParseError {
        let before = self.at.checked_sub(1).and_then(|i| self.words.get(i)).map(|w| w.token);
        let hint = match (before, word.token) {
            (Some(_), Token::Name("if" | "and" | "or" | "else")) => "; write `if(a < b, then, otherwise)`",
            (Some(Token::Sign('<' | '>' | '=')), Token::Sign('=')) | (_, Token::Sign('<' | '>' | '='))
                if wanted != "`=`" =>
            {
                "; a condition is `if(a < b, then, otherwise)`, with `<` or `>`"
            }
            (Some(Token::Name(name)), Token::Sign('(')) if self.is_value(name) => {
                "; a product is written with `*`, and a coordinate as its name without `(t)`"
            }
            (_, Token::Sign('\'')) => "; only coordinates have a velocity, `x'`",
            (Some(Token::Number(_) | Token::Name(_) | Token::Sign(')' | ']')), Token::Name(_) | Token::Number(_))
            | (Some(Token::Number(_) | Token::Sign(')' | ']')), Token::Sign('(')) => "; a product is written with `*`",
            (Some(Token::Number(_)), Token::Sign(',')) if wanted == "an operator" => {
                "; numbers have a point, not a comma"
            }
            _ => "",
        };
        self.error(word, format!("expected {wanted}, found {}{hint}", word.shown()))
    }

    pub(super) fn unknown(&self, name: &str, word: Word<'a>, kind: &str) -> ParseError {
        let locals: Vec<String> = self.locals.iter().map(|(local, _)| (*local).to_owned()).collect();
        let mut error = self.error(word, format!("unknown {kind} `{name}`"));
        let is_function = kind == "function";
        let instead = match name {
            "q" | "v" if !is_function => Some(self.all_of(name)),
            _ if is_function => instead_of_function(name).map(str::to_owned),
            ACTION if self.names.action != ACTION => Some(format!("the action is `{}` here", self.names.action)),
            _ => instead_of_name(name).map(str::to_owned),
        };
        match instead {
            Some(instead) => error.message = format!("{}; {instead}", error.message),
            None if is_function => {
                error.nearest = self.names.nearest_function(name);
                if error.nearest.is_none() {
                    error.message = format!("{}; {}", error.message, self.names.functions_like(name));
                }
            }
            None => {
                let has_velocities = !self.names.are_of_hamiltonian();
                let velocity = velocity_of(name, &self.names.blocks).filter(|_| has_velocities);
                error.nearest = velocity.or_else(|| self.names.nearest(name, &locals));
            }
        }
        error
    }

    /// The correction for a text that uses the name of all coordinates, or of all velocities, as a number.
    pub(super) fn all_of(&self, name: &str) -> String {
        let prime = if name == "v" { "'" } else { "" };
        let what = if name == "v" { "velocities" } else { "coordinates" };
        let named = self.names.blocks.first().map_or(String::new(), |block| match block.count {
            Some(_) => format!("`{}{prime}[0]`", block.name),
            None => format!("`{}{prime}`", block.name),
        });
        format!("the {what} are {named} and so on, or `{name}[0]` to `{name}[n-1]`")
    }

    /// The message for a prime after the name of a quantity that has no velocity.
    pub(super) fn has_no_velocity(&self, name: &str) -> Option<String> {
        if self.word(0).token != Token::Sign('\'') {
            return None;
        }
        match name {
            "t" => Some("the rate of `t` is 1".to_owned()),
            _ if name != self.names.action => None,
            _ if self.names.are_of_hamiltonian() => Some(format!("the rate of `{name}` is `p . H_p - H`")),
            _ => Some(format!("the rate of `{name}` is the Lagrangian itself, which cannot depend on it")),
        }
    }
}
