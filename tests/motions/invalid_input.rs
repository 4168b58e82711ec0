//! Invalid input: not numbers, infinite, subnormal, huge, empty, wrong; at every public entry point, and by every
//! variant of every error.

pub mod discrete;
mod entries;
mod exact;
mod geometry;
pub mod known_issues;
pub mod numbers;
pub mod refusals;
pub mod sentences;

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Checks of invalid input, and the entry points that they call.
pub struct InputTest {
    pub entries: &'static [&'static str],
    pub run: fn(&mut numbers::Report),
}

/// Entry points that need no checks, with the reason. A name may end in `*`.
type Exceptions = &'static [(&'static str, &'static str)];

/// Asserts that checks and exceptions together are exactly the entry points of a crate.
fn complete(name: &str, entries: &BTreeSet<String>, tests: &[&[InputTest]], exceptions: Exceptions) {
    assert!(entries.len() > 50, "only {} entries of {name} found: {entries:?}", entries.len());
    let tested: BTreeSet<&str> = tests.iter().copied().flatten().flat_map(|t| t.entries).copied().collect();
    let excepted = |entry: &str| {
        exceptions
            .iter()
            .any(|(name, _)| name.strip_suffix('*').map_or(*name == entry, |start| entry.starts_with(start)))
    };
    let missing: Vec<_> = entries.iter().filter(|e| !tested.contains(e.as_str()) && !excepted(e)).collect();
    assert!(missing.is_empty(), "public entry points of {name} without a test: {missing:#?}");
    let gone: Vec<_> = tested.iter().filter(|e| !entries.contains(**e)).collect();
    assert!(gone.is_empty(), "tests of entry points that {name} does not have: {gone:#?}");
    for (exception, _) in exceptions {
        let used = entries.iter().any(|e| exception.strip_suffix('*').map_or(e == exception, |s| e.starts_with(s)));
        assert!(used, "an exception for an entry point that {name} does not have: {exception}");
    }
}

/// Runs all checks; a panic counts as a failed check.
fn run(tests: &[&[InputTest]]) {
    let mut report = numbers::Report::default();
    for test in tests.iter().copied().flatten() {
        report.entries = test.entries.join(", ");
        let ran = catch_unwind(AssertUnwindSafe(|| (test.run)(&mut report)));
        report.check(ran.is_ok(), || "panics".into());
    }
    report.end();
}

#[test]
fn every_entry_point_of_contact_geom_and_of_the_gallery_is_tested() {
    let mut entries = entries::of_crate("contact-geom");
    entries.append(&mut entries::of_folder("examples", "systems"));
    complete("contact-geom", &entries, geometry::TESTS, geometry::EXCEPTIONS);
}

#[test]
fn every_entry_point_of_discrete_herglotz_is_tested() {
    complete("discrete-herglotz", &entries::of_crate("discrete-herglotz"), discrete::TESTS, discrete::EXCEPTIONS);
}

#[test]
fn contact_geom_loses_no_nan() {
    run(geometry::TESTS);
}

#[test]
fn discrete_herglotz_refuses_or_answers() {
    run(discrete::TESTS);
}
