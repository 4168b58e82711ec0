//! The statements of the paper, section by section, over every system and every method; and what they are built on:
//! derivatives, the table of methods, and steps.

mod derivatives;
pub mod forces;
mod legendrian;
mod methods;
mod section_2;
mod section_3;
mod section_4;
mod section_5;
mod section_6;
mod steps;
mod table;

use contact_geom::{Statement, statements as continuous};
use discrete_herglotz::statements as discrete;
use exact_lagrangian::statements as exact;
use std::collections::BTreeSet;
use table::Row;

/// A section: its name, its tables, and the statements that have tests of their own.
type Section = (&'static str, &'static [&'static [Row]], &'static [Statement]);

/// The sections of the paper, and the statements on forces, impacts and graphs of flows, which it does not contain.
const SECTIONS: [Section; 8] = [
    ("2", &[section_2::AT_POINTS, section_2::WITH_METHODS, section_2::ALONG_MOTIONS], section_2::BY_NAME),
    ("3", &[section_3::WITH_METHODS], section_3::BY_NAME),
    ("4", &[section_4::ALONG_MOTIONS], &[]),
    ("5", &[section_5::WITH_METHODS], section_5::BY_NAME),
    ("6", &[], section_6::BY_NAME),
    ("forces", &[forces::AT_POINTS, forces::WITH_FORCES], &[]),
    ("impacts", &[forces::AT_IMPACTS], &[]),
    ("legendrian", &[legendrian::ALONG_MOTIONS], &[]),
];

/// Every statement is in a table of its section or has a test of its own, and the tables hold all that the libraries
/// evaluate.
#[test]
fn every_statement_is_tested() {
    let mut tested = BTreeSet::new();
    for (section, tables, by_name) in SECTIONS {
        for statement in tables.iter().copied().flatten().map(|row| row.statement).chain(by_name.iter().copied()) {
            assert!(statement.section().starts_with(section), "statement {statement} is not of section {section}");
            tested.insert(statement);
        }
    }
    assert_eq!(tested, BTreeSet::from(Statement::ALL));

    let of = |tables: &[&[Row]]| -> BTreeSet<Statement> {
        tables.iter().copied().flatten().map(|row| row.statement).collect()
    };
    assert_eq!(
        of(&[section_2::AT_POINTS, forces::AT_POINTS, forces::AT_IMPACTS]),
        BTreeSet::from(continuous::STATEMENTS)
    );
    assert_eq!(of(&[forces::WITH_FORCES]), BTreeSet::from(discrete::FORCED_STATEMENTS));
    let with_methods = [section_2::WITH_METHODS, section_3::WITH_METHODS, section_5::WITH_METHODS];
    assert_eq!(of(&with_methods), BTreeSet::from(discrete::STATEMENTS));
    let along_motions = [section_2::ALONG_MOTIONS, section_4::ALONG_MOTIONS, legendrian::ALONG_MOTIONS];
    assert_eq!(of(&along_motions), BTreeSet::from(exact::STATEMENTS));
}
