//! Reads the results of peers that were measured by another program on the same machine, from its CSV file.

use crate::problems::PROBLEMS;
use crate::row::{Action, Origin, Row};
use contact_examples::Failure;
use std::path::Path;

/// The columns of the file.
const COLUMNS: [&str; 15] = [
    "round",
    "problem",
    "variant",
    "peer",
    "method",
    "ctrl",
    "err_qv",
    "err_z",
    "wall_med_s",
    "wall_min_s",
    "reps",
    "compile_s",
    "nfev",
    "nsteps",
    "status",
];

/// Which peers of a file are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Peers {
    /// [`PEER`] alone.
    Heyoka,
    /// All peers.
    All,
}

/// The peer whose rows are used unless all are requested.
pub const PEER: &str = "heyoka";

/// A configuration of a peer, with the times of all rounds.
struct Configuration {
    /// The tolerance as text, which distinguishes the configurations of a method.
    control: String,
    row: Row,
    seconds: Vec<f64>,
}

/// Reads the rows of a peer, or of all peers; the time of a configuration is the median over the rounds. Rows of other
/// problems, and of runs that failed, are skipped.
pub fn read(path: &Path, peers: Peers) -> Result<Vec<Row>, Failure> {
    std::fs::read_to_string(path).map_err(|cause| cause.to_string()).and_then(|text| parse(&text, peers)).map_err(
        |cause| {
            Failure::input(format_args!(
                "cannot read the rows of {}: {cause}; --peers requires a CSV file with the columns {}, where problem is a \
                 name, variant is z or noz, err_qv, err_z, wall_med_s, nfev and nsteps are numbers, and status is ok \
                 for a valid row",
                path.display(),
                COLUMNS.join(",")
            ))
        },
    )
}

/// Parses the text of such a file; the error names the first invalid part.
fn parse(text: &str, peers: Peers) -> Result<Vec<Row>, String> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let found = reader.headers().map_err(|error| error.to_string())?;
    if found != COLUMNS.as_slice() {
        return Err(format!("its columns are {}", found.iter().collect::<Vec<_>>().join(",")));
    }
    let mut configurations: Vec<Configuration> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let Some(new) = configuration(&record, peers).map_err(|cause| format!("line {line}: {cause}"))? else {
            continue;
        };
        let same = |old: &&mut Configuration| {
            let key = |c: &Configuration| (c.row.problem, c.row.z, c.control.clone());
            key(old) == key(&new) && old.row.method == new.row.method
        };
        match configurations.iter_mut().find(same) {
            Some(old) => old.seconds.extend(new.seconds),
            None => configurations.push(new),
        }
    }
    let median = |mut c: Configuration| {
        c.seconds.sort_by(f64::total_cmp);
        Row { seconds: c.seconds.get(c.seconds.len() / 2).copied().unwrap_or(c.row.seconds), ..c.row }
    };
    Ok(configurations.into_iter().map(median).collect())
}

/// The configuration of a record; `None` if the record is skipped.
fn configuration(record: &csv::StringRecord, peers: Peers) -> Result<Option<Configuration>, String> {
    let field = |name: &str| {
        let place = COLUMNS.iter().position(|column| *column == name);
        place.and_then(|i| record.get(i)).ok_or_else(|| format!("the column {name} is missing"))
    };
    let number = |name: &str| {
        let text = field(name)?;
        text.parse::<f64>().map_err(|_| format!("{name} is {text:?}; it must be a number"))
    };
    let z = match field("variant")? {
        "z" => Action::On,
        "noz" => Action::Off,
        other => return Err(format!("variant is {other:?}; it must be z or noz")),
    };
    let (peer, error) = (field("peer")?, number("err_qv")?);
    let problem = field("problem")?;
    let is_used = field("status")? == "ok" && error.is_finite() && (peers == Peers::All || peer == PEER);
    let Some(problem) = PROBLEMS.iter().find(|p| is_used && p.name == problem) else {
        return Ok(None);
    };
    let seconds = number("wall_med_s")?;
    let row = Row {
        problem: problem.name,
        method: format!("{peer}_{}", field("method")?),
        origin: Origin::Recorded,
        order: None,
        z,
        h: None,
        steps: number("nsteps")? as u64,
        evaluations: number("nfev")? as u64,
        error,
        error_z: Some(number("err_z")?).filter(|e| e.is_finite()),
        seconds,
    };
    Ok(Some(Configuration { control: field("ctrl")?.into(), row, seconds: vec![seconds] }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with these lines.
    fn file(lines: &[&str]) -> String {
        format!("{}\n{}\n", COLUMNS.join(","), lines.join("\n"))
    }

    #[test]
    fn rounds_are_joined_by_their_median() -> Result<(), String> {
        let text = file(&[
            "1,P1,z,heyoka,taylor,1e-07,2.5e+01,5.6e+05,3e-05,1e-05,200,0.018,0,762,ok",
            "1,P1,noz,heyoka,taylor,1e-07,2.5e+01,nan,2e-05,1e-05,200,0.018,0,762,ok",
            "2,P1,z,heyoka,taylor,1e-07,2.5e+01,5.6e+05,9e-05,1e-05,200,0.018,0,762,ok",
            "3,P1,z,heyoka,taylor,1e-07,2.5e+01,5.6e+05,4e-05,1e-05,200,0.018,0,762,ok",
        ]);
        let rows = parse(&text, Peers::Heyoka)?;
        assert_eq!(rows.len(), 2);
        assert_eq!((rows[0].problem, rows[0].method.as_str(), rows[0].z), ("P1", "heyoka_taylor", Action::On));
        assert_eq!((rows[0].seconds, rows[0].steps, rows[0].error_z), (4e-5, 762, Some(5.6e5)));
        assert_eq!((rows[1].z, rows[1].error_z), (Action::Off, None));
        Ok(())
    }

    #[test]
    fn what_is_not_asked_for_is_skipped() -> Result<(), String> {
        let text = file(&[
            "1,P4,z,heyoka,taylor,1e-07,1e-9,1e-9,3e-05,1e-05,200,0,0,762,ok",
            "1,P1,z,heyoka,taylor,1e-07,nan,nan,nan,nan,0,0,0,0,fail",
            "1,P1,z,gsl,rk8pd,1e-07,1e-9,1e-9,3e-05,1e-05,200,0,0,762,ok",
        ]);
        assert_eq!(parse(&text, Peers::Heyoka)?, []);
        assert_eq!(parse(&text, Peers::All)?[0].method, "gsl_rk8pd");
        Ok(())
    }

    #[test]
    fn what_is_wrong_is_named() {
        let wrong = |text: &str| parse(text, Peers::Heyoka).err().unwrap_or_default();
        assert_eq!(wrong("problem,variant\nP1,z\n"), "its columns are problem,variant");
        let line = |line: &str| wrong(&file(&[line]));
        let error = line("1,P1,z,heyoka,taylor,1e-07,much,0,3e-05,1e-05,200,0,0,762,ok");
        assert_eq!(error, "line 2: err_qv is \"much\"; it must be a number");
        let error = line("1,P1,both,heyoka,taylor,1e-07,1e-9,0,3e-05,1e-05,200,0,0,762,ok");
        assert_eq!(error, "line 2: variant is \"both\"; it must be z or noz");
        assert!(line("1,P1,z").contains("line"));
    }

    #[test]
    fn a_file_that_is_not_there_says_what_is_expected() {
        let error = read(Path::new("no/such/file.csv"), Peers::Heyoka).err().map_or(String::new(), |e| e.to_string());
        assert!(error.contains("no/such/file.csv") && error.contains("wall_med_s"), "{error}");
    }
}
