//! Code that the binaries share: output of results, figures, the record of checked statements, and failures with their
//! exit codes.
//!
//! It computes no mechanics; the library crates do.

mod checks;
mod failure;
mod output;
#[cfg(test)]
mod tables;

pub use checks::{Checks, Subject, TOLERANCE, fractions};
pub use contact_figure::{Axis, Curve, Line, Panel, draw, draw_row};
pub use failure::{Failure, finish};
pub use output::{Directory, number, print};

/// The programs of the guide, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide.md")]
pub struct Guide;

/// The program of the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
pub struct Readme;
