//! Names in arguments, and progress bars.

use crate::Failure;
use indicatif::{ProgressBar, ProgressStyle};

/// Refuses names that are neither known nor `all`.
///
/// # Errors
/// With the first such name and the known ones.
pub fn check_names(what: &str, names: &[String], known: &[&str]) -> Result<(), Failure> {
    match names.iter().find(|name| *name != "all" && !known.contains(&name.as_str())) {
        Some(name) => {
            Err(Failure::input(format_args!("unknown {what} {name:?}; the known names are all, {}", known.join(", "))))
        }
        None => Ok(()),
    }
}

/// Whether a name is requested, by itself or by `all`.
pub fn is_requested(names: &[String], name: &str) -> bool {
    names.iter().any(|requested| requested == "all" || requested == name)
}

/// A progress bar with a text before it.
pub fn progress_bar(before: &str, length: usize, after: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(&format!("{before} {{bar:30}} {{pos}}/{{len}}{after}"));
    ProgressBar::new(length as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
