//! The tables of a scene: functions of time by samples.

use super::SceneError;
use super::file::{PiecesName, SamplesTable};
use super::location::{Location, Named, Span};
use crate::runtime::{Interpolation, Table};
use std::io::ErrorKind;
use std::path::Path;

/// The column of the times of a file.
const TIME: &str = "t";

/// The tables with their names. Files are in a folder.
pub(super) fn read(
    text: &str,
    folder: &Path,
    tables: &Named<SamplesTable>,
) -> Result<Vec<(Location<String>, Table)>, SceneError> {
    tables.0.iter().map(|(name, table)| Ok((name.clone(), of(text, folder, name, table)?))).collect()
}

fn of(text: &str, folder: &Path, name: &Location<String>, table: &Location<SamplesTable>) -> Result<Table, SceneError> {
    let SamplesTable { csv, time, value, times, values, pieces } = &**table;
    let refuse = |span, message: &str| Err(SceneError::at(text, span, message));
    let (times, values, span) = match (csv, times, values) {
        (Some(csv), None, None) => {
            let (times, values) = File { text, folder, csv }.columns(time, value, name)?;
            (times, values, csv.span())
        }
        (None, Some(times), Some(values)) => {
            if let Some(column) = time.as_ref().or(value.as_ref()) {
                return refuse(column.span(), "`time` and `value` are columns of a file; add `csv`, or remove them");
            }
            ((**times).clone(), (**values).clone(), times.span())
        }
        (Some(csv), ..) => {
            return refuse(csv.span(), "give the samples by `csv` or by `times` and `values`, not by both");
        }
        (None, Some(list), None) => return refuse(list.span(), "the table has `times` without `values`; add them"),
        (None, None, Some(list)) => return refuse(list.span(), "the table has `values` without `times`; add them"),
        (None, None, None) => {
            let message = format!(
                "the table `{}` has no samples; add a file, as in csv = \"{}.csv\", or `times` and `values`",
                **name, **name
            );
            return refuse(table.span(), &message);
        }
    };
    let interpolation = match pieces {
        PiecesName::Held => Interpolation::Held,
        PiecesName::Linear => Interpolation::Linear,
        PiecesName::Cubic => Interpolation::Cubic,
    };
    Table::new(&times, &values, interpolation).map_err(|error| SceneError::at(text, span, error.to_string()))
}

/// A file of comma-separated values that a scene names.
struct File<'a> {
    text: &'a str,
    folder: &'a Path,
    csv: &'a Location<String>,
}

impl File<'_> {
    fn refuse<T>(&self, span: Span, message: impl Into<String>) -> Result<T, SceneError> {
        Err(SceneError::at(self.text, span, message))
    }

    /// The columns of times and of values.
    fn columns(
        &self,
        time: &Option<Location<String>>,
        value: &Option<Location<String>>,
        name: &Location<String>,
    ) -> Result<(Vec<f64>, Vec<f64>), SceneError> {
        let (csv, span) = (self.csv.as_str(), self.csv.span());
        let contents = match std::fs::read_to_string(self.folder.join(csv)) {
            Ok(contents) => contents,
            Err(cause) if cause.kind() == ErrorKind::NotFound => {
                let message =
                    format!("there is no file {csv:?}; give its path relative to the folder of the scene file");
                return self.refuse(span, message);
            }
            Err(cause) => return self.refuse(span, format!("the file {csv:?} cannot be read: {cause}")),
        };
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(contents.as_bytes());
        let header = match reader.headers() {
            Ok(header) => header.clone(),
            Err(cause) => return self.refuse(span, format!("the file {csv:?} is no table: {cause}")),
        };
        let place = |column: &str, span: Span, key: &str| {
            let found = header.iter().position(|known| known == column);
            found.ok_or_else(|| {
                let all = header.iter().collect::<Vec<_>>().join(", ");
                let message =
                    format!("the file {csv:?} has no column `{column}`; its columns are {all}: name one by `{key}`");
                SceneError::unknown(self.text, span, column, header.iter(), message)
            })
        };
        let of = |column: &Option<Location<String>>, default: &str, key: &str| {
            let (name, span) = column.as_ref().map_or((default, span), |name| (name.as_str(), name.span()));
            Ok((name.to_owned(), place(name, span, key)?))
        };
        let columns = [of(time, TIME, "time")?, of(value, name, "value")?];
        let mut numbers = [Vec::new(), Vec::new()];
        for row in reader.records() {
            let row = match row {
                Ok(row) => row,
                Err(cause) => return self.refuse(span, format!("the file {csv:?} is no table: {cause}")),
            };
            let line = row.position().map_or(0, csv::Position::line);
            for ((column, place), numbers) in columns.iter().zip(&mut numbers) {
                let entry = row.get(*place).unwrap_or_default();
                match entry.parse::<f64>() {
                    Ok(number) => numbers.push(number),
                    Err(_) => {
                        let message = format!(
                            "line {line} of the file {csv:?} has {entry:?} for `{column}`; it must be a number"
                        );
                        return self.refuse(span, message);
                    }
                }
            }
        }
        let [times, values] = numbers;
        Ok((times, values))
    }
}

/// A number that tells tables apart: the FNV-1a hash of their samples.
pub(super) fn fingerprint(tables: &[(Location<String>, Table)]) -> String {
    let of = |(name, table): &(Location<String>, Table)| {
        let bytes = format!("{table:?}");
        let hash = bytes
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
        format!("{} {hash:x}", **name)
    };
    tables.iter().map(of).collect::<Vec<_>>().join(", ")
}
