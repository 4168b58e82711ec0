//! What is compiled: all, or what a small program needs.

use crate::RuntimeError;

/// Whether the feature `full` is on. Conditions on it are constants of the compiler, so that nothing behind them is compiled.
pub(crate) const FULL: bool = cfg!(feature = "full");

/// The error of what is left out without the feature.
pub(crate) fn not_compiled(what: &'static str) -> RuntimeError {
    RuntimeError::NotCompiled { what }
}
