//! Keys of a scene that do not apply to its kind.

use super::SceneError;
use super::location::{Location, Span};

/// The position of a key that is given.
pub(super) fn span<T>(key: &Option<Location<T>>) -> Option<Span> {
    key.as_ref().map(Location::span)
}

/// The position of a switch that is on.
pub(super) fn set(switch: &Option<Location<bool>>) -> Option<Span> {
    switch.as_ref().filter(|on| ***on).map(Location::span)
}

/// Refuses the first of some keys that is given.
pub(super) fn refuse_all(
    text: &str,
    given: impl IntoIterator<Item = (Option<Span>, &'static str)>,
    message: impl Fn(&str) -> String,
) -> Result<(), SceneError> {
    match given.into_iter().find_map(|(span, name)| Some((span?, name))) {
        Some((span, name)) => Err(SceneError::at(text, span, message(name))),
        None => Ok(()),
    }
}
