//! Errors of a scene, with their position.

use super::location::Span;
use crate::runtime::{ParseError, nearest_name};
use std::fmt::{Display, Formatter};
use std::ops::Range;

/// An error of a scene. Its text has file, line and column, the accepted input, and the line with the position marked
/// below it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneError {
    /// The file, or another source of the text.
    pub file: Option<String>,
    /// The error and its position.
    pub error: Box<ParseError>,
}

impl SceneError {
    /// The same error with the name of the file.
    pub fn in_file(self, file: impl Into<String>) -> Self {
        SceneError { file: self.file.or_else(|| Some(file.into())), ..self }
    }

    /// An error at a range of bytes of a text.
    pub(crate) fn at(text: &str, span: Span, message: impl Into<String>) -> Self {
        SceneError { file: None, error: Box::new(ParseError::at(text, first_line(text, span), message)) }
    }

    /// An error of a text at a range of its bytes, or at its start.
    pub fn of_text(text: &str, bytes: Option<Range<usize>>, message: &str) -> Self {
        Self::at(text, bytes.map_or((0, 0), |bytes| (bytes.start, bytes.end)), plain(message))
    }

    /// An unknown name, with the nearest known one.
    pub(crate) fn unknown<'k>(
        text: &str,
        span: Span,
        name: &str,
        known: impl IntoIterator<Item = &'k str>,
        message: impl Into<String>,
    ) -> Self {
        let mut error = Self::at(text, span, message);
        error.error.nearest = nearest_name(name, known).map(str::to_owned);
        error
    }

    /// An error in a formula that is the value of a string in the file.
    pub(crate) fn in_string(text: &str, span: Span, error: &ParseError) -> Self {
        let raw = text.get(span.0..span.1).unwrap_or_default();
        let quotes =
            ["\"\"\"", "'''", "\"", "'"].into_iter().find(|quotes| raw.starts_with(quotes)).unwrap_or_default();
        // A line end directly after the opening quotes does not belong to the string.
        let after = &raw[quotes.len()..];
        let dropped =
            ["\r\n", "\n"].into_iter().find(|end| quotes.len() == 3 && after.starts_with(end)).map_or(0, str::len);
        if quotes.is_empty() || quotes.starts_with('"') && raw.contains('\\') {
            // Positions in the string differ from those in the file.
            return Self::at(text, span, format!("in this formula: {}", error.message));
        }
        let first = span.0 + quotes.len() + dropped;
        let lines = text.get(first..).unwrap_or_default().split_inclusive('\n');
        let start = first + lines.take(error.line - 1).map(str::len).sum::<usize>();
        let bytes = |chars: usize, from: usize| -> usize {
            text.get(from..).unwrap_or_default().chars().take(chars).map(char::len_utf8).sum()
        };
        let start = start + bytes(error.column - 1, start);
        let mut moved = Self::at(text, (start, start + bytes(error.length, start)), error.message.clone());
        moved.error.nearest.clone_from(&error.nearest);
        moved
    }

    /// An error of the TOML reader.
    pub(crate) fn of_format(text: &str, error: &toml::de::Error) -> Self {
        let span = error.span().map_or((0, 0), |span| (span.start, span.end));
        let message = plain(error.message());
        // In a message such as `unknown field `a`, expected one of `b`, `c``, the first quoted name is the unknown one.
        let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
        match quoted.as_slice() {
            [name, known @ ..] if message.starts_with("unknown") => {
                Self::unknown(text, span, name, known.iter().copied(), message.as_str())
            }
            _ => Self::at(text, span, message.clone() + remedy(text, span, &message)),
        }
    }
}

/// Advice for an error of the TOML reader.
fn remedy(text: &str, (start, _): Span, message: &str) -> &'static str {
    let before = text.get(..start).and_then(|before| before.rsplit('\n').next()).unwrap_or_default();
    let after = text.get(start..).and_then(|after| after.lines().next()).unwrap_or_default();
    let value =
        before.rsplit(['=', '[', ',']).next().map(str::trim_start).filter(|value| !value.is_empty()).unwrap_or(after);
    let of_number = value.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+' || c == '.');
    match message {
        _ if message.starts_with("missing field") => "; add it",
        _ if of_number && (message.starts_with("unexpected key") || message.starts_with("string values")) => {
            "; write a number with a decimal point and without a unit"
        }
        _ => "",
    }
}

/// A range within one line; a table is represented by its first line.
fn first_line(text: &str, (start, end): Span) -> Span {
    let length = text.get(start..end).map_or(0, |part| part.lines().next().unwrap_or_default().trim_end().len());
    (start, start + length)
}

/// A message of the TOML reader without the names of types.
fn plain(message: &str) -> String {
    const PLAIN: [(&str, &str); 9] = [
        ("expected f64", "expected a number"),
        ("expected i64", "expected a whole number"),
        ("expected usize", "expected a whole number, 0 or more"),
        ("expected a string", "expected a string in quotes"),
        ("expected a sequence", "expected a list"),
        ("expected a boolean", "expected true or false"),
        ("floating point", "number"),
        ("unknown field", "unknown name"),
        ("unknown variant", "unknown word"),
    ];
    let message = message.trim().lines().map(str::trim).collect::<Vec<_>>().join("; ");
    PLAIN.iter().fold(message, |message, (from, to)| message.replace(from, to))
}

impl Display for SceneError {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{file}, ")?;
        }
        write!(f, "{}", self.error)
    }
}

impl std::error::Error for SceneError {}
