//! Programs that run named cases: their arguments, figures with bounds, tables, diagrams.

use crate::figure::{Axis, Curve, Line, Panel, draw};
use crate::{Directory, Failure, check_names, is_requested, number, print};
use clap::Args;
use indicatif::ProgressBar;
use std::path::PathBuf;
use std::time::Instant;

/// The arguments of a program that runs cases.
#[derive(Args, Debug)]
pub struct CaseArguments {
    /// The cases, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_value = "all")]
    case: Vec<String>,
    /// Runs short forms of the cases.
    #[arg(long)]
    quick: bool,
    /// The directory for tables and figures; created where it does not exist. By default `out/` and the program's name.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// A case: its name, its title or the meaning of its sizes, and the function that runs it.
pub type Case = (&'static str, &'static str, fn(&mut Report) -> Result<(), Failure>);

/// A figure with its upper bound.
#[derive(Debug)]
struct Finding {
    case: &'static str,
    what: String,
    figure: f64,
    bound: f64,
    /// Whether it is a ratio of times, which differs from run to run and from machine to machine: it is printed and
    /// compared with its bound, but not written to `verdicts.csv`, and the program does not fail for it.
    timed: bool,
}

impl Finding {
    /// A NaN does not pass.
    fn passes(&self) -> bool {
        self.figure <= self.bound
    }

    /// The word for it in the tables.
    fn verdict(&self) -> &'static str {
        match (self.passes(), self.timed) {
            (true, _) => "pass",
            (false, true) => "slow",
            (false, false) => "fail",
        }
    }
}

/// A measurement at one size.
#[derive(Debug)]
struct Measurement {
    case: &'static str,
    what: String,
    size: usize,
    seconds: f64,
    bytes: Option<usize>,
}

/// All findings and measurements of a run, and the directory for them.
#[derive(Debug)]
pub struct Report {
    out: Directory,
    /// Whether the cases are to be short.
    pub quick: bool,
    /// The progress of the current case.
    pub bar: ProgressBar,
    case: &'static str,
    findings: Vec<Finding>,
    measurements: Vec<Measurement>,
    markdown: String,
}

/// A number as it is printed: short, and as an integer where it is a count.
pub fn short(x: f64) -> String {
    // Adding zero removes the sign of a negative zero.
    if x == x.round() && x.abs() < 1e6 { format!("{:.0}", x + 0.0) } else { format!("{x:.2e}") }
}

/// Runs the cases of a program that are requested, and writes the files of all together: `verdicts.csv`, the
/// measurements as a table with the name of the program and as diagrams, and the tables of [`Report::markdown`] as
/// `stability_tables.md`.
///
/// # Errors
/// Where a case is unknown or fails, the output cannot be written, or a figure other than a ratio of times is above its
/// bound.
pub fn run_cases(program: &str, arguments: &CaseArguments, cases: &[Case], bar: ProgressBar) -> Result<(), Failure> {
    let names: Vec<&str> = cases.iter().map(|(name, ..)| *name).collect();
    check_names("case", &arguments.case, &names)?;
    let out = arguments.out.clone().unwrap_or_else(|| PathBuf::from("out").join(program));
    let mut report = Report {
        out: Directory::create(out)?,
        quick: arguments.quick,
        bar,
        case: "",
        findings: Vec::new(),
        measurements: Vec::new(),
        markdown: String::new(),
    };
    for (name, title, case) in cases.iter().filter(|(name, ..)| is_requested(&arguments.case, name)) {
        let start = Instant::now();
        report.case = name;
        report.bar.set_message(*name);
        report.markdown += &format!("\n### {name}: {title}\n");
        report.say(&format!("\n{name}: {title}\n"))?;
        case(&mut report)?;
        report.diagrams(title)?;
        report.say(&format!("  {:.1} s\n", start.elapsed().as_secs_f64()))?;
    }
    report.bar.finish_and_clear();
    report.finish(program)
}

impl Report {
    /// Prints, above the bar.
    ///
    /// # Errors
    /// Where the terminal cannot be written.
    pub fn say(&self, text: &str) -> Result<(), Failure> {
        self.bar.suspend(|| print(text))
    }

    /// Adds a figure with its bound.
    ///
    /// # Errors
    /// Where the terminal cannot be written.
    pub fn at_most(&mut self, what: &str, figure: f64, bound: f64) -> Result<(), Failure> {
        self.find(Finding { case: self.case, what: what.into(), figure, bound, timed: false })
    }

    /// Adds a ratio of times with its bound.
    ///
    /// # Errors
    /// Where the terminal cannot be written.
    pub fn at_most_timed(&mut self, what: &str, figure: f64, bound: f64) -> Result<(), Failure> {
        self.find(Finding { case: self.case, what: what.into(), figure, bound, timed: true })
    }

    fn find(&mut self, finding: Finding) -> Result<(), Failure> {
        let Finding { what, figure, bound, .. } = &finding;
        let verdict = finding.verdict();
        self.say(&format!("  {verdict}  {:>9} <= {:<9} {what}\n", short(*figure), short(*bound)))?;
        self.findings.push(finding);
        Ok(())
    }

    /// Adds a measurement: the time in seconds at a size, and the peak memory in bytes where it was counted.
    ///
    /// # Errors
    /// Where the terminal cannot be written.
    pub fn row(&mut self, what: &str, size: usize, seconds: f64, bytes: Option<usize>) -> Result<(), Failure> {
        let memory = bytes.map_or(String::new(), |b| format!("  {:9.3} MB", b as f64 * 1e-6));
        self.say(&format!("  {what:<40} {size:>9}  {seconds:11.4e} s{memory}\n"))?;
        self.measurements.push(Measurement { case: self.case, what: what.into(), size, seconds, bytes });
        Ok(())
    }

    /// Writes a table of the case, as `CASE.csv` or, with the name of a part, `CASE_PART.csv`.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn table(
        &self,
        part: &str,
        columns: &[&str],
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Result<(), Failure> {
        let part = if part.is_empty() { String::new() } else { format!("_{part}") };
        self.out.table(&format!("{}{part}.csv", self.case), columns, rows)
    }

    /// Writes the diagram of the case.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn figure(&self, svg: &str) -> Result<(), Failure> {
        self.out.text(&format!("{}.svg", self.case), svg)
    }

    /// Writes a diagram of run times, which differ from run to run.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn timed_figure(&self, svg: &str) -> Result<(), Failure> {
        self.out.text(&format!("{}_times.svg", self.case), svg)
    }

    /// Adds a table to `stability_tables.md`.
    pub fn markdown(&mut self, columns: &[&str], rows: impl IntoIterator<Item = Vec<String>>) {
        self.markdown += &format!("\n| {} |\n|{}\n", columns.join(" | "), "---|".repeat(columns.len()));
        for row in rows {
            self.markdown += &format!("| {} |\n", row.join(" | "));
        }
    }

    /// Writes the files of all cases together; fails if a figure other than a ratio of times is above its bound.
    fn finish(self, program: &str) -> Result<(), Failure> {
        let columns = ["case", "what", "figure", "bound", "verdict"];
        let findings = |of: fn(f64) -> String, timed: fn(f64) -> String| {
            let row = move |f: &Finding| {
                let figure = if f.timed { timed(f.figure) } else { of(f.figure) };
                [f.case.into(), f.what.clone(), figure, of(f.bound), f.verdict().into()]
            };
            self.findings.iter().map(row)
        };
        self.out.table("verdicts.csv", &columns, findings(number, |_| String::new()))?;
        if self.measurements.is_empty() {
            let mut text = String::from("| case | what | figure | bound | verdict |\n|---|---|---|---|---|\n");
            findings(short, short).for_each(|row| text += &format!("| {} |\n", row.join(" | ")));
            self.out.text("stability_tables.md", &(text + &self.markdown))?;
        } else {
            let row = |m: &Measurement| {
                let bytes = m.bytes.map_or(String::new(), |b| b.to_string());
                [m.case.into(), m.what.clone(), m.size.to_string(), number(m.seconds), bytes]
            };
            let columns = ["case", "what", "size", "seconds", "peak_bytes"];
            self.out.table(&format!("{program}.csv"), &columns, self.measurements.iter().map(row))?;
        }
        print(&format!("\nTables and figures are in {}.\n", self.out.path().display()))?;
        let failing = self.findings.iter().filter(|f| !f.passes() && !f.timed);
        let line = |f: &Finding| format!("  {}: {}: {} > {}", f.case, f.what, short(f.figure), short(f.bound));
        let wrong: Vec<String> = failing.map(line).collect();
        Failure::unless_empty(&wrong, self.findings.len(), "figures are above their bounds")
    }

    /// Draws time, and memory where it was counted, against size, for everything of the case with more than one size.
    fn diagrams(&self, size: &str) -> Result<(), Failure> {
        type Value = fn(&Measurement) -> Option<f64>;
        let values: [(&str, &str, Value); 2] =
            [("", "time (s)", |m| Some(m.seconds)), ("_memory", "peak memory (bytes)", |m| m.bytes.map(|b| b as f64))];
        for (suffix, label, value) in values {
            // The names in the order of their first appearance.
            let mut named: Vec<(&str, Vec<(f64, f64)>)> = Vec::new();
            for m in self.measurements.iter().filter(|m| m.case == self.case) {
                let point = value(m).map(|y| (m.size as f64, y));
                match named.iter_mut().find(|(what, _)| *what == m.what) {
                    Some((_, points)) => points.extend(point),
                    None => named.push((&m.what, point.into_iter().collect())),
                }
            }
            named.retain(|(_, points)| points.windows(2).any(|p| p[0].0 != p[1].0));
            let numbered = named.into_iter().enumerate();
            let curves: Vec<Curve> =
                numbered.map(|(i, (what, points))| Curve::new(what, Line::Coloured(i), points)).collect();
            let points = || curves.iter().flat_map(|c| &c.points);
            let (x, y) = (decades(points().map(|p| p.0)), decades(points().map(|p| p.1)));
            if let (Some(x), Some(y)) = (x, y) {
                let panel = Panel::new((size, x), (label, y), (1.03, 1.0), curves);
                self.out.text(&format!("{}{suffix}.svg", self.case), &draw(&panel))?;
            }
        }
        Ok(())
    }
}

/// The range of powers of ten that contains all values; `None` without positive values.
fn decades(values: impl Iterator<Item = f64>) -> Option<Axis> {
    let logs: Vec<f64> = values.filter(|x| *x > 0.0).map(f64::log10).collect();
    let least = logs.iter().copied().reduce(f64::min)?.floor() as i32;
    let most = logs.iter().copied().reduce(f64::max)?.ceil() as i32;
    Some(Axis::Logarithmic(least, most.max(least + 1), 1))
}
