//! What the binaries share: where results go, how figures look, which checks of statements passed, how a failure ends a program.
//!
//! No mechanics is computed here; that is what the library crates are for.

mod checks;
mod failure;
mod output;
#[cfg(test)]
mod tables;

pub use checks::{Checks, Subject, TOLERANCE, fractions};
pub use contact_figure::{Axis, Curve, Line, Panel, draw, draw_row};
pub use failure::{Failure, finish};
pub use output::{Directory, number, print};

/// The tasks of the guide, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide.md")]
pub struct Guide;

/// The program of the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
pub struct Readme;
