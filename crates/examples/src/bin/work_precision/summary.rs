//! The printed summary: the run time that the library and its peers need for an error.

use crate::problems::Problem;
use crate::recorded::PEER;
use crate::row::{Action, Origin, Row, best, fastest};

/// The errors at which times are compared.
const LEVELS: [f64; 3] = [1e-6, 1e-9, 1e-12];

/// The two peers with which the library is compared, by a part of the names of their methods.
const PEERS: [&str; 2] = [PEER, "dop853"];

/// A time with a suitable unit.
fn time(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{:.1} us", s * 1e6),
        s if s < 1.0 => format!("{:.2} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}

/// The summary of a problem, with or without the action, from all its rows.
pub fn of(problem: &Problem, z: Action, rows: &[Row]) -> String {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.problem == problem.name && row.z == z).collect();
    let library = || rows.iter().copied().filter(|row| row.origin == Origin::Library);
    // Of the implementations of dop853, only those measured in the same run.
    let peer = |name: &str| {
        let origin = if name == PEER { Origin::Recorded } else { Origin::Peer };
        rows.iter().copied().filter(|row| row.origin == origin && row.method.contains(name)).collect::<Vec<_>>()
    };

    let mut levels: Vec<(f64, String)> = LEVELS.iter().map(|level| (*level, format!("{level:.0e}"))).collect();
    // Where the recorded peer does not reach all levels, its smallest error is a further level.
    let floor = best(peer(PEER)).map(|row| row.error).filter(|error| LEVELS.iter().any(|level| error > level));
    levels.extend(floor.map(|error| (error, format!("{error:.1e} *"))));

    let mut text = format!("\n{}, {}, z {}: time to an error of (q, v)\n\n", problem.name, problem.title, z.name());
    text += &format!("  {:<10}{:<32}{:>10}{:>9}", "error", "fastest of the library", "time", "error z");
    for name in PEERS {
        text += &format!("  {name:>10}{:>9}{:>8}", "error z", "ratio");
    }
    text += "\n";
    for (level, name) in levels {
        let ours = fastest(library(), level);
        text += &format!("  {name:<10}{:<32}{}", ours.map_or("-", |row| &row.method), cell(ours));
        for peer_name in PEERS {
            let theirs = fastest(peer(peer_name), level);
            let ratio = ours.zip(theirs).map_or("-".into(), |(ours, theirs)| ratio(theirs.seconds / ours.seconds));
            text += &format!("  {}{ratio:>8}", cell(theirs));
        }
        text += "\n";
    }
    let mut bests = format!("  {:<10}{}", "best", smallest(best(library()), "of the library"));
    for name in PEERS {
        bests += &format!("; {}", smallest(best(peer(name)), name));
    }
    text += &format!("{bests}\n");
    if floor.is_some() {
        text += &format!("  * the smallest error that {PEER} reached\n");
    }
    text
}

/// The time and the error of z of a row.
fn cell(row: Option<&Row>) -> String {
    let seconds = row.map_or("-".into(), |row| time(row.seconds));
    let error_z = row.and_then(|row| row.error_z).map_or("-".into(), |error| format!("{error:.0e}"));
    format!("{seconds:>10}{error_z:>9}")
}

/// A ratio of times; above 1 the library is faster.
fn ratio(ratio: f64) -> String {
    match ratio {
        r if r < 0.1 => format!("{r:.0e}"),
        r if r < 10.0 => format!("{r:.2}"),
        r => format!("{r:.1}"),
    }
}

/// The smallest error among the rows of one origin, with its method and time.
fn smallest(row: Option<&Row>, whose: &str) -> String {
    row.map_or_else(
        || format!("none {whose}"),
        |row| format!("{:.0e} {whose} ({}, {})", row.error, row.method, time(row.seconds)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problems::PROBLEMS;
    use crate::row::tests::row;

    #[test]
    fn ratios_are_of_times_to_the_same_error() {
        let of_peer = |method: &str, origin, error, seconds| Row { origin, ..row(method, error, seconds) };
        let rows = [
            row("midpoint", 1e-6, 1e-3),
            row("gauss", 1e-10, 4e-3),
            of_peer("heyoka_taylor", Origin::Recorded, 1e-11, 2e-3),
            of_peer("ode_solvers_dop853", Origin::Peer, 1e-6, 5e-3),
            of_peer("boost_dop853", Origin::Recorded, 1e-6, 1e-6),
        ];
        let text = of(&PROBLEMS[0], Action::On, &rows);
        let words = |start: &str| -> Vec<&str> {
            text.lines()
                .find(|line| line.trim_start().starts_with(start))
                .map_or(Vec::new(), |l| l.split_whitespace().collect())
        };
        assert_eq!(words("1e-6").join(" "), "1e-6 midpoint 1.00 ms - 2.00 ms - 2.00 5.00 ms - 5.00");
        assert_eq!(words("1e-9").join(" "), "1e-9 gauss 4.00 ms - 2.00 ms - 0.50 - - -");
        assert_eq!(words("1e-12").join(" "), "1e-12 - - - - - - - - -");
        assert_eq!(words("1.0e-11").join(" "), "1.0e-11 * - - - 2.00 ms - - - - -");
        assert!(text.contains("best      1e-10 of the library (gauss, 4.00 ms); 1e-11 heyoka"));
    }

    #[test]
    fn times_have_units() {
        assert_eq!([2.5e-6, 0.25, 3.0].map(time), ["2.5 us", "250.00 ms", "3.00 s"]);
    }
}
