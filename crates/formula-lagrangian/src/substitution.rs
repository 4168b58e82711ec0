//! Texts with other names, from which larger texts are made.

use crate::ParseError;
use crate::limits::LONGEST_TEXT;
use crate::token::{Token, Word, words};

/// The value of a text as one expression, with other expressions in the place of names. Definitions of the text are put
/// in the place of their names.
///
/// `of` is called with each name that the text does not define, and with whether it is that of a velocity, as `x` in
/// `x'`; names for which it returns `None` stay. What is put in the place of a name is not put into brackets.
///
/// ```
/// use formula_lagrangian::substitute;
/// let entry = |name: &str, velocity: bool| match name {
///     "x" if velocity => Some("u'[i]".to_owned()),
///     "x" => Some("u[i]".to_owned()),
///     _ => None,
/// };
/// let text = substitute("r = 1 + x^2\nL = x'^2/2 - k/r", &entry)?;
/// assert_eq!(text, "u'[i] ^ 2 / 2 - k / (1 + u[i] ^ 2)");
/// # Ok::<(), formula_lagrangian::ParseError>(())
/// ```
///
/// # Errors
/// [`ParseError`] for a character that no formula has, and where the expression is longer than [`LONGEST_TEXT`]. The
/// text is not parsed otherwise.
pub fn substitute(text: &str, of: &dyn Fn(&str, bool) -> Option<String>) -> Result<String, ParseError> {
    let words = words(text)?;
    let mut definitions: Vec<(&str, String)> = Vec::new();
    let mut value = String::new();
    for line in lines(&words) {
        let (name, words) = match line {
            [Word { token: Token::Name(name), .. }, Word { token: Token::Sign('='), .. }, rest @ ..] => (*name, rest),
            _ => ("", line),
        };
        value = expanded(text, words, &definitions, of);
        if value.len() > LONGEST_TEXT {
            let message =
                format!("with its definitions in the place of their names the text has more than {LONGEST_TEXT} bytes");
            return Err(ParseError::at(text, (0, 0), message));
        }
        if !name.is_empty() {
            definitions.push((name, format!("({value})")));
        }
    }
    Ok(value)
}

/// The lines of a text, which end outside of brackets and not after an operator; without those that are empty.
fn lines<'a, 't>(words: &'a [Word<'t>]) -> impl Iterator<Item = &'a [Word<'t>]> {
    let (mut depth, mut continues) = (0_usize, false);
    let ends = move |word: &Word<'_>| {
        let is_end = word.token == Token::End || word.token == Token::Line && depth == 0 && !continues;
        match word.token {
            Token::Sign('(' | '[') => depth += 1,
            Token::Sign(')' | ']') => depth = depth.saturating_sub(1),
            _ => {}
        }
        if word.token != Token::Line {
            continues = matches!(word.token, Token::Sign('+' | '-' | '*' | '/' | '^' | '=' | ',' | '<' | '>'));
        }
        is_end
    };
    words.split(ends).filter(|line| line.iter().any(|word| word.token != Token::Line))
}

/// The words of a line with what is in the place of names.
fn expanded(
    text: &str,
    line: &[Word<'_>],
    definitions: &[(&str, String)],
    of: &dyn Fn(&str, bool) -> Option<String>,
) -> String {
    let (mut result, mut at) = (String::new(), 0);
    while let Some(word) = line.get(at) {
        at += 1;
        let is_velocity = line.get(at).is_some_and(|next| next.token == Token::Sign('\''));
        let (start, end) = word.span;
        let mut part = text.get(start..end).unwrap_or_default().to_owned();
        match word.token {
            Token::Line => continue,
            Token::Name(name) => {
                if let Some((_, value)) = definitions.iter().rev().find(|(defined, _)| *defined == name) {
                    part.clone_from(value);
                } else if let Some(other) = of(name, is_velocity) {
                    part = other;
                    at += usize::from(is_velocity);
                }
            }
            _ => {}
        }
        if !result.is_empty() && !matches!(word.token, Token::Sign('\'')) {
            result.push(' ');
        }
        result.push_str(&part);
    }
    result
}
