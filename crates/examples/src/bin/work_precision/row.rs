//! Rows of the table, and the fastest row for an error.

use clap::ValueEnum;
use contact_examples::number;

/// Where a row comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A method of the library.
    Library,
    /// A peer measured in the same run.
    Peer,
    /// A peer measured by another program on the same machine.
    Recorded,
}

/// The result of a method on a problem, with one step or tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The problem.
    pub problem: &'static str,
    /// The method.
    pub method: String,
    /// Where the row comes from.
    pub origin: Origin,
    /// The order of the method, where it is known.
    pub order: Option<u32>,
    /// Whether the action was solved for.
    pub z: Action,
    /// The time step of a method with a fixed one.
    pub h: Option<f64>,
    /// The steps taken.
    pub steps: u64,
    /// The evaluations of right-hand sides, forces or gradients; 0 where a peer does not count them.
    pub evaluations: u64,
    /// The error of (q, v).
    pub error: f64,
    /// The error of z.
    pub error_z: Option<f64>,
    /// The wall time of the integration.
    pub seconds: f64,
}

/// The columns of the table.
pub const COLUMNS: [&str; 10] =
    ["problem", "method", "order", "z", "h", "steps", "evaluations", "error", "error_z", "seconds"];

/// Whether the action z is solved for; without it comes first in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Action {
    /// Only positions and velocities are solved for.
    Off,
    /// The action is solved for too.
    On,
}

impl Action {
    /// Both.
    pub const ALL: [Self; 2] = [Action::Off, Action::On];

    /// "on" or "off".
    pub fn name(self) -> &'static str {
        match self {
            Action::Off => "off",
            Action::On => "on",
        }
    }
}

impl Row {
    /// The fields, in the order of the columns; a missing value is empty.
    pub fn fields(&self) -> [String; 10] {
        let or_empty = |x: Option<f64>| x.map_or(String::new(), number);
        [
            self.problem.into(),
            self.method.clone(),
            self.order.map_or(String::new(), |order| order.to_string()),
            self.z.name().into(),
            or_empty(self.h),
            self.steps.to_string(),
            self.evaluations.to_string(),
            number(self.error),
            or_empty(self.error_z),
            number(self.seconds),
        ]
    }
}

/// Sorts rows by problem, action and method; the rows of a sweep keep their order.
pub fn sort(rows: &mut [Row]) {
    rows.sort_by(|a, b| (a.problem, a.z, &a.method).cmp(&(b.problem, b.z, &b.method)));
}

/// The fastest of the rows with an error at or below a level. A row with a smaller error may be faster than one with a
/// larger error.
pub fn fastest<'a>(rows: impl IntoIterator<Item = &'a Row>, level: f64) -> Option<&'a Row> {
    rows.into_iter().filter(|row| row.error <= level).min_by(|a, b| a.seconds.total_cmp(&b.seconds))
}

/// The row with the smallest error.
pub fn best<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Option<&'a Row> {
    rows.into_iter().min_by(|a, b| a.error.total_cmp(&b.error))
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// A row with the given method, error and time; the other fields are arbitrary.
    pub fn row(method: &str, error: f64, seconds: f64) -> Row {
        Row {
            problem: "P1",
            method: method.into(),
            origin: Origin::Library,
            order: None,
            z: Action::On,
            h: None,
            steps: 1,
            evaluations: 0,
            error,
            error_z: None,
            seconds,
        }
    }

    #[test]
    fn the_time_to_an_error_is_that_of_the_cheapest_row_below() {
        let rows = [row("a", 1e-5, 1.0), row("a", 1e-6, 3.0), row("b", 1e-8, 2.0), row("b", 1e-10, 4.0)];
        assert_eq!(fastest(&rows, 1e-6), Some(&rows[2]), "a better error at a smaller cost");
        assert_eq!(fastest(&rows, 1e-5), Some(&rows[0]), "the level itself counts");
        assert_eq!(fastest(&rows, 1e-9), Some(&rows[3]));
        assert_eq!(fastest(&rows, 1e-12), None);
        assert_eq!(best(&rows), Some(&rows[3]));
    }

    #[test]
    fn a_sweep_keeps_its_order() {
        let mut rows = [row("b", 1e-3, 1.0), row("b", 1e-9, 2.0), row("a", 1e-6, 3.0), row("b", 1e-8, 4.0)];
        sort(&mut rows);
        assert_eq!(rows.map(|row| row.seconds), [3.0, 1.0, 2.0, 4.0]);
    }

    #[test]
    fn what_a_row_does_not_have_is_empty() {
        let fields = row("a", 0.5, 2.0).fields();
        assert_eq!(fields[2..6], ["", "on", "", "1"]);
        assert_eq!((fields[7].as_str(), fields[8].as_str()), ("5.0000000000000000e-1", ""));
        assert_eq!(fields.len(), COLUMNS.len());
    }
}
