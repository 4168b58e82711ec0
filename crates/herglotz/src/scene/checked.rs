//! Checks of single values of a scene file.

use super::SceneError;
use super::file::{VERSION, span_of_table};
use super::location::Location;
use serde::Deserialize;

/// The oldest version whose files can be read, those that have none of the [`OLD_TABLES`].
const OLDEST: i64 = 1;

/// The tables of version 1 that are others now.
const OLD_TABLES: [(&str, &str); 2] = [("lattice", "system.lattice"), ("body", "system.body")];

/// Rejects a file of another version, before its new names are reported as unknown.
pub(super) fn check_version(text: &str) -> Result<(), SceneError> {
    #[derive(Deserialize)]
    struct Versioned {
        version: Option<Location<i64>>,
    }
    for (old, new) in OLD_TABLES {
        if let Some(span) = span_of_table(text, old) {
            let message = format!(
                "`[{old}]` is `[{new}]` from version {VERSION} of scene files on; `herglotz migrate` translates this file"
            );
            return Err(SceneError::at(text, span, message));
        }
    }
    // All other errors are left to the reader of the whole file.
    let Ok(Versioned { version: Some(version) }) = toml::from_str(text) else { return Ok(()) };
    if (OLDEST..=VERSION).contains(&*version) {
        return Ok(());
    }
    let found = *version;
    let what = if found > VERSION { "requires a newer program; update it, or" } else { "does not exist;" };
    let message = format!("version {found} of scene files {what} write the scene for version {VERSION}");
    Err(SceneError::at(text, version.span(), message))
}

/// Checks that a number is finite.
pub(super) fn finite(text: &str, x: &Location<f64>, name: &str) -> Result<f64, SceneError> {
    if x.is_finite() {
        return Ok(**x);
    }
    Err(SceneError::at(text, x.span(), format!("`{name}` is {:?}; it must be a finite number", **x)))
}

/// Checks that a number is positive and finite.
pub(super) fn positive(text: &str, x: &Location<f64>, name: &str) -> Result<f64, SceneError> {
    if **x > 0.0 {
        return finite(text, x, name);
    }
    Err(SceneError::at(text, x.span(), format!("`{name}` is {:?}; it must be a positive number", **x)))
}
