//! Division of a text into words.

use crate::ParseError;
use crate::hints::instead_of_character;

/// The kind of a word of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Token<'t> {
    Number(f64),
    Name(&'t str),
    /// One of `+ - * / ^ ( ) [ ] , = < > '`.
    Sign(char),
    /// The end of a line, or a semicolon.
    Line,
    End,
}

/// A token with the bytes at which it begins and ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Word<'t> {
    pub token: Token<'t>,
    pub span: (usize, usize),
}

impl Word<'_> {
    /// The word as it is shown in messages.
    pub fn shown(&self) -> String {
        match self.token {
            Token::Number(x) => format!("the number {x}"),
            Token::Name(name) => format!("`{name}`"),
            Token::Sign(sign) => format!("`{sign}`"),
            Token::Line => "the end of the line".to_owned(),
            Token::End => "the end".to_owned(),
        }
    }
}

/// Divides a text into words. Comments begin with `#`; `**` is `^`.
pub(crate) fn words(text: &str) -> Result<Vec<Word<'_>>, ParseError> {
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let length = match first {
            '#' => {
                at += rest.find('\n').unwrap_or(rest.len());
                continue;
            }
            '\n' | ';' => 1,
            c if c.is_whitespace() => {
                at += c.len_utf8();
                continue;
            }
            c if c.is_alphabetic() || c == '_' => {
                rest.find(|c: char| !(c.is_alphabetic() || c.is_ascii_digit() || c == '_')).unwrap_or(rest.len())
            }
            c if c.is_ascii_digit() || c == '.' => number_length(rest),
            '*' if rest.starts_with("**") => 2,
            c => c.len_utf8(),
        };
        let (word, span) = (&rest[..length], (at, at + length));
        let token = match first {
            '\n' | ';' => Token::Line,
            c if c.is_alphabetic() || c == '_' => Token::Name(word),
            c if c.is_ascii_digit() || c == '.' => match word.parse::<f64>() {
                Ok(x) if x.is_finite() => Token::Number(x),
                Ok(_) => return Err(ParseError::at(text, span, "this number is too large")),
                Err(_) if word == "." && matches!(words.last(), Some(Word { token: Token::Name(_), .. })) => {
                    let message = "names do not contain a point; write `sin(x)` for `np.sin(x)`, and `pi` for \
                                   `math.pi`";
                    return Err(ParseError::at(text, span, message));
                }
                Err(_) => return Err(ParseError::at(text, span, format!("`{word}` is not a number"))),
            },
            '*' if length == 2 => Token::Sign('^'),
            '+' | '-' | '*' | '/' | '^' | '(' | ')' | '[' | ']' | ',' | '=' | '<' | '>' | '\'' => Token::Sign(first),
            '\u{2019}' | '\u{2032}' => Token::Sign('\''),
            '\u{b7}' | '\u{d7}' => Token::Sign('*'),
            '\u{2212}' => Token::Sign('-'),
            c => {
                let instead = instead_of_character(c).map(|instead| format!("; {instead}")).unwrap_or_default();
                let message = format!("the character {c:?} has no meaning here{instead}");
                return Err(ParseError::at(text, span, message));
            }
        };
        words.push(Word { token, span });
        at += length;
    }
    words.push(Word { token: Token::End, span: (text.len(), text.len()) });
    Ok(words)
}

/// The length of the number at the start of a text: digits with at most one point, and an exponent.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes.iter().skip(from).take_while(|c| c.is_ascii_digit()).count();
    let mut length = digits(0);
    if bytes.get(length) == Some(&b'.') {
        length += 1 + digits(length + 1);
    }
    if matches!(bytes.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
        let exponent = digits(length + 1 + sign);
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    length
}
