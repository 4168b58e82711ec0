//! Results of the cases: times and memory against size, and figures with their bounds.

use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw, number, print};

/// A measurement at one size.
struct Row {
    case: String,
    what: String,
    size: usize,
    seconds: f64,
    bytes: Option<usize>,
}

/// A figure with its upper bound.
struct Verdict {
    case: String,
    what: String,
    figure: f64,
    bound: f64,
}

impl Verdict {
    /// A NaN does not pass.
    fn passes(&self) -> bool {
        self.figure <= self.bound
    }
}

/// All measurements of a run, and the directory for them.
pub struct Report {
    out: Directory,
    /// Whether only small sizes are run.
    pub quick: bool,
    rows: Vec<Row>,
    verdicts: Vec<Verdict>,
    /// The cases, with what the size of each counts.
    cases: Vec<(&'static str, &'static str)>,
}

impl Report {
    /// A report of full sizes.
    pub fn new(out: Directory) -> Self {
        Report { out, quick: false, rows: Vec::new(), verdicts: Vec::new(), cases: Vec::new() }
    }

    /// Begins a case; `size` is the meaning of its sizes.
    pub fn begin(&mut self, case: &'static str, size: &'static str) {
        self.cases.push((case, size));
    }

    /// Adds a measurement: the time in seconds at a size, and the peak memory in bytes where it was counted.
    pub fn row(&mut self, case: &str, what: &str, size: usize, seconds: f64, bytes: Option<usize>) {
        let memory = bytes.map_or(String::new(), |b| format!("  {:9.3} MB", b as f64 * 1e-6));
        // A failure to print is ignored, since the table has the same data.
        let _ = print(&format!("{case:>10}  {what:<40} {size:>9}  {seconds:11.4e} s{memory}\n"));
        self.rows.push(Row { case: case.into(), what: what.into(), size, seconds, bytes });
    }

    /// Adds a figure with its bound.
    pub fn verdict(&mut self, case: &str, what: &str, figure: f64, bound: f64) {
        let verdict = Verdict { case: case.into(), what: what.into(), figure, bound };
        let word = if verdict.passes() { "pass" } else { "FAIL" };
        let _ = print(&format!("{case:>10}  {word}  {figure:10.3e} <= {bound:<10.3e} {what}\n"));
        self.verdicts.push(verdict);
    }

    /// Writes a table of a case to a file.
    pub fn table(&self, file: &str, columns: &[&str], rows: Vec<Vec<String>>) -> Result<(), Failure> {
        self.out.table(file, columns, rows)
    }

    /// Writes tables and diagrams; fails if a figure is above its bound.
    pub fn finish(self) -> Result<(), Failure> {
        let row = |r: &Row| {
            let bytes = r.bytes.map_or(String::new(), |b| b.to_string());
            vec![r.case.clone(), r.what.clone(), r.size.to_string(), number(r.seconds), bytes]
        };
        self.out.table("scale.csv", &["case", "what", "size", "seconds", "peak_bytes"], self.rows.iter().map(row))?;
        let word = |v: &Verdict| if v.passes() { "pass" } else { "fail" };
        let verdict =
            |v: &Verdict| vec![v.case.clone(), v.what.clone(), number(v.figure), number(v.bound), word(v).into()];
        let columns = ["case", "what", "figure", "bound", "verdict"];
        self.out.table("verdicts.csv", &columns, self.verdicts.iter().map(verdict))?;
        for (case, size) in &self.cases {
            self.figures(case, size)?;
        }
        print(&format!("\nTables and figures are in {}.\n", self.out.path().display()))?;
        let failing: Vec<&Verdict> = self.verdicts.iter().filter(|v| !v.passes()).collect();
        if failing.is_empty() {
            return Ok(());
        }
        let line = |v: &&Verdict| format!("  {}: {}: {:.3e} > {:.3e}", v.case, v.what, v.figure, v.bound);
        let list: Vec<String> = failing.iter().map(line).collect();
        Err(Failure::Bounds { count: failing.len(), total: self.verdicts.len(), list: list.join("\n") })
    }

    /// Draws time, and memory where it was counted, against size, for everything with more than one size.
    fn figures(&self, case: &str, size: &str) -> Result<(), Failure> {
        let rows: Vec<&Row> = self.rows.iter().filter(|r| r.case == case).collect();
        let figure = |label: &str, of: fn(&Row) -> Option<f64>| {
            let mut curves = Vec::new();
            for what in distinct(rows.iter().map(|r| r.what.as_str())) {
                let of_it = rows.iter().filter(|r| r.what == what);
                let points: Vec<(f64, f64)> = of_it.filter_map(|r| Some((r.size as f64, of(r)?))).collect();
                if points.iter().any(|p| p.0 != points[0].0) {
                    curves.push(Curve::new(what, Line::Coloured(curves.len()), points));
                }
            }
            let points = || curves.iter().flat_map(|c| &c.points);
            let (x, y) = (decades(points().map(|p| p.0)), decades(points().map(|p| p.1)));
            let (x_label, y_label) = (size.into(), label.into());
            Some(draw(&Panel { x_label, y_label, x: x?, y: y?, legend: (1.03, 1.0), curves, marks: Vec::new() }))
        };
        if let Some(time) = figure("time (s)", |r| Some(r.seconds)) {
            self.out.text(&format!("{case}.svg"), &time)?;
        }
        if let Some(memory) = figure("peak memory (bytes)", |r| r.bytes.map(|b| b as f64)) {
            self.out.text(&format!("{case}_memory.svg"), &memory)?;
        }
        Ok(())
    }
}

/// The distinct names, in the order of their first appearance.
fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = Vec::new();
    for name in names {
        if !seen.contains(&name) {
            seen.push(name);
        }
    }
    seen
}

/// The range of powers of ten that contains all values; `None` without positive values.
fn decades(values: impl Iterator<Item = f64>) -> Option<Axis> {
    let logs: Vec<f64> = values.filter(|x| *x > 0.0).map(f64::log10).collect();
    let least = logs.iter().copied().reduce(f64::min)?.floor() as i32;
    let most = logs.iter().copied().reduce(f64::max)?.ceil() as i32;
    Some(Axis::Logarithmic(least, most.max(least + 1), 1))
}
