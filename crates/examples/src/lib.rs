//! The gallery of [`systems`], and what the programs of the workspace share: output of results, figures, the record of
//! checked statements, and failures with their exit codes.
//!
//! Without features there is the gallery alone, which depends on `contact-geom`; `figure` adds the module of that name, and
//! `programs` all that the programs need.

#[cfg(feature = "programs")]
mod arguments;
#[cfg(feature = "programs")]
mod checks;
#[cfg(feature = "programs")]
mod failure;
#[cfg(feature = "figure")]
pub mod figure;
#[cfg(feature = "programs")]
mod output;
#[cfg(feature = "programs")]
mod report;
pub mod systems;
#[cfg(all(test, feature = "programs"))]
mod tables;

#[cfg(feature = "programs")]
pub use {
    arguments::{check_names, is_requested, progress_bar},
    checks::{Checks, Subject, TOLERANCE, fractions},
    failure::{Failure, finish},
    figure::{Axis, Curve, Line, Panel, draw, draw_row},
    output::{Directory, number, print},
    report::{Case, CaseArguments, Report, run_cases, short},
};

/// The programs of the guide, compiled and run.
#[cfg(all(doctest, feature = "programs"))]
#[doc = include_str!("../../../docs/guide.md")]
pub struct Guide;

/// The program of the README.
#[cfg(all(doctest, feature = "programs"))]
#[doc = include_str!("../../../README.md")]
pub struct Readme;
