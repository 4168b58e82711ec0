//! Results of the cases: figures with their bounds, tables, diagrams.

use contact_examples::{Directory, Failure, number, print};
use indicatif::ProgressBar;

/// A figure with its upper bound.
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

/// All findings of a run, and the directory for them.
pub struct Report {
    out: Directory,
    /// Whether the cases are to be short.
    pub quick: bool,
    /// The progress of the current case.
    pub bar: ProgressBar,
    case: &'static str,
    findings: Vec<Finding>,
    markdown: String,
}

/// A number as it is printed: short, and as an integer where it is a count.
pub fn short(x: f64) -> String {
    // Adding zero removes the sign of a negative zero.
    if x == x.round() && x.abs() < 1e6 { format!("{:.0}", x + 0.0) } else { format!("{x:.2e}") }
}

impl Report {
    /// A report of full cases.
    pub fn new(out: Directory, bar: ProgressBar) -> Self {
        Report { out, quick: false, bar, case: "", findings: Vec::new(), markdown: String::new() }
    }

    /// Begins a case.
    pub fn begin(&mut self, case: &'static str, title: &str) -> Result<(), Failure> {
        self.case = case;
        self.bar.set_message(case);
        self.markdown += &format!("\n### {case}: {title}\n");
        self.say(&format!("\n{case}: {title}\n"))
    }

    /// Prints, above the bar.
    pub fn say(&self, text: &str) -> Result<(), Failure> {
        self.bar.suspend(|| print(text))
    }

    /// Adds a figure with its bound.
    pub fn at_most(&mut self, what: &str, figure: f64, bound: f64) -> Result<(), Failure> {
        self.find(Finding { case: self.case, what: what.into(), figure, bound, timed: false })
    }

    /// Adds a ratio of times with its bound.
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

    /// Writes the CSV file of the case.
    pub fn table(&self, columns: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> Result<(), Failure> {
        self.out.table(&format!("{}.csv", self.case), columns, rows)
    }

    /// Writes the diagram of the case.
    pub fn figure(&self, svg: &str) -> Result<(), Failure> {
        self.out.text(&format!("{}.svg", self.case), svg)
    }

    /// Writes a diagram of run times, which differ from run to run.
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
    pub fn finish(self) -> Result<(), Failure> {
        self.out.table(
            "verdicts.csv",
            &["case", "what", "figure", "bound", "verdict"],
            self.findings.iter().map(|f| {
                vec![
                    f.case.into(),
                    f.what.clone(),
                    if f.timed { String::new() } else { number(f.figure) },
                    number(f.bound),
                    f.verdict().into(),
                ]
            }),
        )?;
        let mut text = String::from("| case | what | figure | bound | verdict |\n|---|---|---|---|---|\n");
        for f in &self.findings {
            text +=
                &format!("| {} | {} | {} | {} | {} |\n", f.case, f.what, short(f.figure), short(f.bound), f.verdict());
        }
        self.out.text("stability_tables.md", &(text + &self.markdown))?;
        let failing: Vec<&Finding> = self.findings.iter().filter(|f| !f.passes() && !f.timed).collect();
        print(&format!("\nTables and figures are in {}.\n", self.out.path().display()))?;
        if failing.is_empty() {
            return Ok(());
        }
        let line = |f: &&Finding| format!("  {}: {}: {} > {}", f.case, f.what, short(f.figure), short(f.bound));
        let list: Vec<String> = failing.iter().map(line).collect();
        Err(Failure::Bounds { count: failing.len(), total: self.findings.len(), list: list.join("\n") })
    }
}
