//! `herglotz migrate`.

use crate::failure::Failure;
use crate::output::print;
use clap::{Args, ValueHint};
use herglotz::{SceneError, VERSION};
use std::path::PathBuf;
use toml_edit::{DocumentMut, Item, Table};

/// The tables of version 1 that are tables of `[system]` now.
const MOVED: [&str; 2] = ["lattice", "body"];

/// What a lattice of version 1 had that belongs to the system.
const OF_SYSTEM: [&str; 2] = ["coordinates", "parameters"];

#[derive(Args)]
pub(crate) struct Migrate {
    /// The scene files.
    #[arg(required = true, value_hint = ValueHint::FilePath)]
    files: Vec<PathBuf>,
    /// Write the files, in place of printing them.
    #[arg(long)]
    in_place: bool,
}

impl Migrate {
    pub fn run(&self) -> Result<(), Failure> {
        for file in &self.files {
            let text = std::fs::read_to_string(file).map_err(Failure::of_file(file))?;
            let named = |error: SceneError| error.in_file(file.display().to_string());
            let new = translated(&text).map_err(named)?;
            if self.in_place {
                std::fs::write(file, new).map_err(Failure::of_file(file))?;
            } else {
                print(new.trim_end())?;
            }
        }
        Ok(())
    }
}

/// A table that its header names, as an inline table is not.
fn with_header(item: Item) -> Option<Table> {
    item.into_table().ok()
}

/// The text of a scene in the current version, with its comments.
fn translated(text: &str) -> Result<String, SceneError> {
    let mut document: DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| SceneError::of_text(text, error.span(), error.message()))?;
    let has_system = document.contains_key("system");
    for name in MOVED {
        // A file with both is of no version, and nothing of it may be lost.
        if let (true, Some((key, _))) = (has_system, document.get_key_value(name)) {
            let why = format!("the scene has [system] and [{name}]; remove one of them");
            return Err(SceneError::of_text(text, key.span(), &why));
        }
        let Some(mut table) = document.remove(name).and_then(with_header) else { continue };
        let position = table.position();
        let mut system = Table::new();
        for key in OF_SYSTEM {
            if let Some((own, item)) = table.remove_entry(key) {
                system.insert_formatted(&own, item);
            }
        }
        // A table with no values of its own needs no header; one that has some takes the comments before the old one.
        let has_values = system.iter().any(|(_, item)| !item.is_table());
        system.set_implicit(!has_values);
        if has_values {
            *system.decor_mut() = table.decor().clone();
            table.decor_mut().clear();
        }
        system.set_position(position);
        table.set_position(position);
        system.insert(name, Item::Table(table));
        document.insert("system", Item::Table(system));
    }
    if let Some(version) = document.get_mut("version").and_then(Item::as_value_mut) {
        let decor = version.decor().clone();
        *version = VERSION.into();
        *version.decor_mut() = decor;
    }
    Ok(document.to_string())
}
