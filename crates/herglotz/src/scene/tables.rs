//! The tables of a scene: functions of time by samples.

use super::SceneError;
use super::csv_file::CsvFile;
use super::file::{PiecesName, SamplesTable};
use super::location::{Location, Named};
use crate::runtime::{Interpolation, Table};
use std::path::Path;

/// The column of the times of a file.
pub(super) const TIME: &str = "t";

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
            let (times, values) = columns(&CsvFile::read(text, folder, csv)?, time, value, name)?;
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

/// The columns of times and of values of a file.
fn columns(
    file: &CsvFile<'_>,
    time: &Option<Location<String>>,
    value: &Option<Location<String>>,
    name: &Location<String>,
) -> Result<(Vec<f64>, Vec<f64>), SceneError> {
    let numbers = |column: &Option<Location<String>>, default: &str, key: &str| {
        let (name, span) = column.as_ref().map_or((default, file.span()), |name| (name.as_str(), name.span()));
        let place = file.place(name, span, key)?;
        file.entries(place).map(|(line, entry)| file.number(line, entry, name)).collect::<Result<Vec<_>, _>>()
    };
    Ok((numbers(time, TIME, "time")?, numbers(value, name, "value")?))
}

/// Refuses a table whose name occurs in none of these formulas.
pub(super) fn check_used<'f>(
    text: &str,
    tables: &[(Location<String>, Table)],
    formulas: impl Fn() -> Vec<&'f str>,
) -> Result<(), SceneError> {
    let is_used = |name: &str| formulas().iter().any(|formula| words(formula).any(|word| word == name));
    match tables.iter().find(|(name, _)| !is_used(name)) {
        None => Ok(()),
        Some((name, _)) => {
            let name_of = &**name;
            let message = format!(
                "the table `{name_of}` is used in no formula; write `{name_of}(t)` where it acts, or remove the table"
            );
            Err(SceneError::at(text, name.span(), message))
        }
    }
}

/// The identifiers in a formula.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_'))
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
