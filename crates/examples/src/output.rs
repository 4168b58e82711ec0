//! Output of results: a directory of CSV and SVG files, and the terminal.

use crate::Failure;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The directory that `--out` names.
#[derive(Clone, Debug)]
pub struct Directory {
    path: PathBuf,
}

impl Directory {
    /// Creates the directory where it does not exist, and checks that files can be written into it, so that a program
    /// fails before it computes.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn create(path: impl Into<PathBuf>) -> Result<Self, Failure> {
        let path = path.into();
        let probe = path.join(".writable");
        let written =
            fs::create_dir_all(&path).and_then(|()| fs::write(&probe, "")).and_then(|()| fs::remove_file(&probe));
        match written {
            Ok(()) => Ok(Directory { path }),
            Err(cause) => Err(Failure::output(&path, cause)),
        }
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a table as a CSV file.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn table<R>(&self, name: &str, columns: &[&str], rows: impl IntoIterator<Item = R>) -> Result<(), Failure>
    where
        R: IntoIterator<Item = String>,
    {
        let path = self.path.join(name);
        let write = || -> Result<(), csv::Error> {
            let mut writer = csv::Writer::from_path(&path)?;
            writer.write_record(columns)?;
            for row in rows {
                writer.write_record(row)?;
            }
            writer.flush()?;
            Ok(())
        };
        write().map_err(|cause| Failure::output(&path, cause))
    }

    /// Writes a text file.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn text(&self, name: &str, text: &str) -> Result<(), Failure> {
        let path = self.path.join(name);
        fs::write(&path, text).map_err(|cause| Failure::output(&path, cause))
    }
}

/// A number with 17 significant digits: reading it back gives the same bits.
pub fn number(x: f64) -> String {
    format!("{x:.16e}")
}

/// Prints on the standard output. A closed pipe, for example to `head`, is not an error.
///
/// # Errors
/// Where the standard output cannot be written.
pub fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(cause) if cause.kind() != io::ErrorKind::BrokenPipe => Err(Failure::terminal(cause)),
        _ => Ok(()),
    }
}
