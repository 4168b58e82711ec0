//! Files of comma-separated values that a scene names.

use super::SceneError;
use super::location::{Location, Span};
use csv::StringRecord;
use std::io::ErrorKind;
use std::path::Path;

/// A file of comma-separated values: its header, and its rows with their lines.
pub(super) struct CsvFile<'a> {
    text: &'a str,
    name: &'a Location<String>,
    header: StringRecord,
    rows: Vec<(u64, StringRecord)>,
}

impl<'a> CsvFile<'a> {
    /// Reads a file that a scene names, in its folder.
    pub fn read(text: &'a str, folder: &Path, name: &'a Location<String>) -> Result<Self, SceneError> {
        let file = name.as_str();
        let refuse = |message: String| SceneError::at(text, name.span(), message);
        let contents = std::fs::read_to_string(folder.join(file)).map_err(|cause| {
            refuse(match cause.kind() {
                ErrorKind::NotFound => {
                    format!("there is no file {file:?}; give its path relative to the folder of the scene file")
                }
                _ => format!("the file {file:?} cannot be read: {cause}"),
            })
        })?;
        if let Some(separator) = other_separator(&contents) {
            return Err(refuse(format!(
                "the columns of the file {file:?} seem to be separated by {separator}; separate them by commas, and write \
                 numbers with a decimal point"
            )));
        }
        let no_table = |cause: csv::Error| refuse(format!("the file {file:?} is no table: {cause}"));
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(contents.as_bytes());
        let header = reader.headers().map_err(no_table)?.clone();
        let with_line = |row: StringRecord| (row.position().map_or(0, csv::Position::line), row);
        let rows = reader.records().map(|row| row.map(with_line)).collect::<Result<_, _>>().map_err(no_table)?;
        Ok(CsvFile { text, name, header, rows })
    }

    /// The position of its name in the scene.
    pub fn span(&self) -> Span {
        self.name.span()
    }

    /// The names of its columns.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.header.iter()
    }

    /// The place of a column, which the scene names by a key.
    pub fn place(&self, column: &str, span: Span, key: &str) -> Result<usize, SceneError> {
        let found = self.header.iter().position(|known| known == column);
        found.ok_or_else(|| {
            let (file, all) = (self.name.as_str(), self.header.iter().collect::<Vec<_>>().join(", "));
            let message =
                format!("the file {file:?} has no column `{column}`; its columns are {all}: name one by `{key}`");
            SceneError::unknown(self.text, span, column, self.header.iter(), message)
        })
    }

    /// The entries of a column, with their lines.
    pub fn entries(&self, place: usize) -> impl Iterator<Item = (u64, &str)> {
        self.rows.iter().map(move |(line, row)| (*line, row.get(place).unwrap_or_default()))
    }

    /// The number of an entry.
    pub fn number(&self, line: u64, entry: &str, column: &str) -> Result<f64, SceneError> {
        entry.parse().map_err(|_| self.refuse_entry(line, entry, column, "it must be a number"))
    }

    /// The error of an entry.
    pub fn refuse_entry(&self, line: u64, entry: &str, column: &str, why: &str) -> SceneError {
        let message = format!("line {line} of the file {:?} has {entry:?} for `{column}`; {why}", self.name.as_str());
        SceneError::at(self.text, self.span(), message)
    }
}

/// The separator that a text seems to have in place of commas: one that the header and all rows have equally often, while
/// the header has no comma.
fn other_separator(contents: &str) -> Option<&'static str> {
    let lines = || contents.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let header = lines().next()?;
    if header.contains(',') {
        return None;
    }
    [(';', "semicolons"), ('\t', "tabs"), ('|', "`|`"), (' ', "blanks")].into_iter().find_map(|(separator, name)| {
        let count = |line: &str| line.matches(separator).count();
        let found = count(header);
        let is_one = separator != ' ' || lines().skip(1).all(|line| line.split_whitespace().count() == found + 1);
        (found > 0 && is_one && lines().all(|line| separator == ' ' || count(line) == found)).then_some(name)
    })
}
