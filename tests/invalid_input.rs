//! Input that no one means: not numbers, infinite, subnormal, huge, empty, wrong; at every public entry, and by every variant
//! of every error.

#![allow(missing_docs)]
// What a test cannot go on without is a failure of it.
#![allow(clippy::panic, clippy::unwrap_used, clippy::expect_used)]
// `!(x <= bound)` is true of a NaN, which is what is asked.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

#[path = "hostile/discrete.rs"]
mod discrete;
#[path = "hostile/entries.rs"]
mod entries;
#[path = "hostile/geometry.rs"]
mod geometry;
#[path = "hostile/known_issues.rs"]
mod known_issues;
#[path = "hostile/numbers.rs"]
mod numbers;
#[path = "hostile/sentences.rs"]
mod sentences;

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// An attack, and the entries that it is one on.
pub struct Attack {
    pub on: &'static [&'static str],
    pub run: fn(&mut numbers::Report),
}

/// Entries that are left alone, with the reason. A name may end in `*`.
type Exceptions = &'static [(&'static str, &'static str)];

/// That attacks and exceptions are all entries of a crate, and no others.
fn complete(name: &str, attacks: &[&[Attack]], exceptions: Exceptions) {
    let entries = entries::of_crate(name);
    assert!(entries.len() > 50, "only {} entries of {name} found: {entries:?}", entries.len());
    let attacked: BTreeSet<&str> = attacks.iter().copied().flatten().flat_map(|a| a.on).copied().collect();
    let excepted = |entry: &str| {
        exceptions
            .iter()
            .any(|(name, _)| name.strip_suffix('*').map_or(*name == entry, |start| entry.starts_with(start)))
    };
    let missing: Vec<_> = entries.iter().filter(|e| !attacked.contains(e.as_str()) && !excepted(e)).collect();
    assert!(missing.is_empty(), "public entries of {name} that no attack is on: {missing:#?}");
    let gone: Vec<_> = attacked.iter().filter(|e| !entries.contains(**e)).collect();
    assert!(gone.is_empty(), "attacks on what {name} does not have: {gone:#?}");
    for (exception, _) in exceptions {
        let used = entries.iter().any(|e| exception.strip_suffix('*').map_or(e == exception, |s| e.starts_with(s)));
        assert!(used, "an exception for what {name} does not have: {exception}");
    }
}

/// Runs all attacks; a panic is a finding as others.
fn attack(attacks: &[&[Attack]]) {
    let mut report = numbers::Report::default();
    for attack in attacks.iter().copied().flatten() {
        report.on = attack.on.join(", ");
        let ran = catch_unwind(AssertUnwindSafe(|| (attack.run)(&mut report)));
        report.check(ran.is_ok(), || "panics".into());
    }
    report.end();
}

#[test]
fn every_entry_of_the_geometry_is_attacked() {
    complete("contact-geom", geometry::ATTACKS, geometry::EXCEPTIONS);
}

#[test]
fn every_entry_of_the_discretisations_is_attacked() {
    complete("discrete-herglotz", discrete::ATTACKS, discrete::EXCEPTIONS);
}

#[test]
fn the_geometry_loses_no_nan() {
    attack(geometry::ATTACKS);
}

#[test]
fn the_discretisations_refuse_or_answer() {
    attack(discrete::ATTACKS);
}
