//! Output formats: numbers with 17 digits, tables, JSON.

use crate::failure::Failure;
use serde_json::Value;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// A number with 17 significant digits, from which it can be read back exactly.
pub(crate) fn exact(x: f64) -> String {
    format!("{x:.16e}")
}

/// A number in a short form.
pub(crate) fn short(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || (1e-3..1e6).contains(&size) {
        format!("{x:.10}").trim_end_matches('0').trim_end_matches('.').into()
    } else {
        format!("{x:.6e}")
    }
}

/// A number as JSON; a string where it is not finite.
pub(crate) fn json(x: f64) -> Value {
    if x.is_finite() { x.into() } else { x.to_string().into() }
}

/// Writes a text to the standard output, with a line end.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.trim_end_matches('\n').as_bytes())?;
    out.write_all(b"\n")?;
    Ok(out.flush()?)
}

/// Writes a JSON value to the standard output.
pub(crate) fn print_json(value: &Value) -> Result<(), Failure> {
    print(&format!("{value:#}"))
}

/// A table whose columns are as wide as their widest entry.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width =
        |i: usize| rows.iter().filter_map(|row| row.get(i)).map(|entry| entry.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let padded = row.iter().zip(&widths).map(|(entry, width)| format!("{entry:<width$}"));
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// The files that a command has written.
#[derive(Debug, Default)]
pub(crate) struct Written(Vec<PathBuf>);

impl Written {
    /// Adds a file.
    pub fn push(&mut self, path: PathBuf) {
        self.0.push(path);
    }

    /// Their paths.
    pub fn paths(&self) -> Vec<String> {
        self.0.iter().map(|path| path.display().to_string()).collect()
    }

    /// The line that names them.
    pub fn line(&self) -> String {
        format!("written: {}", self.paths().join(", "))
    }
}

/// The directory of the results.
#[derive(Clone, Debug)]
pub(crate) struct Directory(PathBuf);

impl Directory {
    /// The requested directory, or one in the current directory with the name of the scene.
    pub fn new(requested: Option<PathBuf>, scene: &Path) -> Self {
        Directory(requested.unwrap_or_else(|| scene.file_stem().map(PathBuf::from).unwrap_or_else(|| "scene".into())))
    }

    /// Creates the directory; called when there is output to write.
    pub fn create(&self) -> Result<(), Failure> {
        std::fs::create_dir_all(&self.0).map_err(Failure::of_file(&self.0))
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, text: &str) -> Result<PathBuf, Failure> {
        let path = self.file(name);
        std::fs::write(&path, text).map_err(Failure::of_file(&path))?;
        Ok(path)
    }

    /// Replaces a file atomically: the text is written to another file, which is then renamed.
    pub fn replace(&self, name: &str, text: &str) -> Result<(), Failure> {
        let (path, part) = (self.file(name), self.file(&format!("{name}.part")));
        let write = || -> std::io::Result<()> {
            let mut file = File::create(&part)?;
            file.write_all(text.as_bytes())?;
            file.sync_all()?;
            std::fs::rename(&part, &path)
        };
        write().map_err(Failure::of_file(&path))
    }

    /// Removes a file if it exists.
    pub fn remove(&self, name: &str) -> Result<(), Failure> {
        let path = self.file(name);
        match std::fs::remove_file(&path) {
            Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => Err(Failure::of_file(&path)(cause)),
            _ => Ok(()),
        }
    }
}

/// A CSV table that is written row by row.
pub(crate) struct Table {
    out: csv::Writer<BufWriter<File>>,
    path: PathBuf,
}

impl Table {
    /// A new file with a header.
    pub fn new<'h>(path: PathBuf, header: impl IntoIterator<Item = &'h str>) -> Result<Self, Failure> {
        let file = File::create(&path).map_err(Failure::of_file(&path))?;
        let mut table = Table { out: csv::Writer::from_writer(BufWriter::new(file)), path };
        table.record(header)?;
        Ok(table)
    }

    /// Continues a file after a number of bytes; anything after them is dropped.
    pub fn resume(path: PathBuf, bytes: u64) -> Result<Self, Failure> {
        let open = || -> std::io::Result<File> {
            let file = OpenOptions::new().append(true).open(&path)?;
            if file.metadata()?.len() < bytes {
                return Err(std::io::Error::other(
                    "the file is shorter than when the run was interrupted; run without --resume",
                ));
            }
            file.set_len(bytes)?;
            Ok(file)
        };
        let file = open().map_err(Failure::of_file(&path))?;
        Ok(Table { out: csv::Writer::from_writer(BufWriter::new(file)), path })
    }

    /// Writes a row.
    pub fn record<T: AsRef<[u8]>>(&mut self, entries: impl IntoIterator<Item = T>) -> Result<(), Failure> {
        self.out.write_record(entries).map_err(|error| Failure::of_file(&self.path)(error.into()))
    }

    /// Writes a row of numbers.
    pub fn numbers(&mut self, numbers: &[f64]) -> Result<(), Failure> {
        self.record(numbers.iter().map(|x| exact(*x)))
    }

    /// Writes all buffered rows to the file and returns its length.
    pub fn finish(mut self) -> Result<u64, Failure> {
        self.flush()
    }

    /// Writes all buffered rows so far to the file and returns its length.
    pub fn flush(&mut self) -> Result<u64, Failure> {
        let flushed = self.out.flush().and_then(|()| std::fs::metadata(&self.path));
        Ok(flushed.map_err(Failure::of_file(&self.path))?.len())
    }
}

/// The rows of a table in a file.
pub(crate) fn read_rows(path: &Path) -> Result<Vec<Vec<String>>, Failure> {
    let broken = |error: csv::Error| Failure::of_file(path)(error.into());
    let mut reader = csv::Reader::from_path(path).map_err(broken)?;
    reader.records().map(|row| row.map(|row| row.iter().map(str::to_owned).collect()).map_err(broken)).collect()
}
