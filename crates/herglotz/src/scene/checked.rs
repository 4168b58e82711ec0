//! Checks of single values of a scene file.

use super::SceneError;
use super::file::VERSION;
use super::location::Location;
use serde::Deserialize;

/// Rejects a file of another version, before its new names are reported as unknown.
pub(super) fn check_version(text: &str) -> Result<(), SceneError> {
    #[derive(Deserialize)]
    struct Versioned {
        version: Option<Location<i64>>,
    }
    // All other errors are left to the reader of the whole file.
    let Ok(Versioned { version: Some(version) }) = toml::from_str(text) else { return Ok(()) };
    if *version == VERSION {
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
