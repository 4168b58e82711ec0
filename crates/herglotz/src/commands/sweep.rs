//! `herglotz sweep`.

use super::SceneArguments;
use super::run::{progress_bar, stop_flag};
use crate::failure::Failure;
use crate::output::{Directory, Table, exact, print, print_json};
use crate::plot;
use clap::Args;
use herglotz::Scene;
use indicatif::ProgressBar;
use runtime_herglotz::{Column, Ending, Ensemble, EnsembleWatch, MemberEnd, Status, Varied};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

#[derive(Args)]
pub(crate) struct Sweep {
    #[command(flatten)]
    scene: SceneArguments,
    /// The directory of sweep.csv; that with the name of the scene otherwise.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The number of threads; the results do not depend on it.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Draw the columns at the end against the first swept value.
    #[arg(long)]
    plot: bool,
    /// Tell how it ended as JSON.
    #[arg(long)]
    json: bool,
}

/// Writes the members as they come.
struct Writer<'s> {
    scene: &'s Scene,
    csv: Table,
    /// The number of columns at the end.
    columns: usize,
    /// The swept values of those that began with their columns, where they are drawn.
    drawn: Option<Vec<(f64, Vec<f64>)>>,
    bar: ProgressBar,
    stop: Arc<AtomicBool>,
    members: usize,
    failure: Option<Failure>,
}

/// How a member ended: a word, and why.
fn words(ending: &Ending) -> (&'static str, String) {
    let why = ending.suspicion.map(|suspicion| suspicion.to_string()).unwrap_or_default();
    match ending.status {
        Status::Completed if ending.suspicion.is_some() => ("suspicious", why),
        Status::Completed => ("completed", why),
        status @ Status::Stopped { .. } => ("stopped", status.to_string()),
        status @ Status::FalseClaim { .. } => ("unreliable", status.to_string()),
        status @ Status::Failed { .. } => ("failed", status.to_string()),
    }
}

impl EnsembleWatch for Writer<'_> {
    fn member(&mut self, member: MemberEnd) -> ControlFlow<()> {
        let values = self.scene.members().values(member.index);
        let mut row = vec![member.index.to_string()];
        row.extend(values.iter().map(|x| exact(*x)));
        match &member.ending {
            Ok(ending) => {
                let (status, why) = words(ending);
                row.extend([status.to_owned(), why, ending.steps.to_string(), exact(ending.t)]);
                row.extend(ending.columns.iter().map(|x| exact(*x)));
                if let (Some(drawn), Some(value)) = (&mut self.drawn, values.first()) {
                    drawn.push((*value, ending.columns.clone()));
                }
            }
            Err(cause) => {
                row.extend(["refused".to_owned(), cause.to_string(), "0".to_owned(), String::new()]);
                row.extend(std::iter::repeat_n(String::new(), self.columns));
            }
        }
        self.members += 1;
        self.bar.set_position((1000 * self.members / self.scene.members().count().max(1)) as u64);
        match self.csv.record(&row) {
            _ if self.stop.load(Ordering::Relaxed) => ControlFlow::Break(()),
            Ok(()) => ControlFlow::Continue(()),
            Err(failure) => {
                self.failure = Some(failure);
                ControlFlow::Break(())
            }
        }
    }
}

impl Sweep {
    pub fn run(&self) -> Result<(), Failure> {
        let scene = self.scene.read()?;
        let members = scene.members();
        let refuse = |why: &str| Failure::Input(format!("{}: {why}", self.scene.file.display()));
        if scene.knobs.is_empty() {
            return Err(refuse(
                "there is nothing to sweep; add [sweep] with a parameter, as in gamma = { from = -1.0, to = 0.0, count = 11 }",
            ));
        }
        if let Some((name, _)) = scene.events.iter().find(|(_, event)| event.terminal) {
            return Err(refuse(&format!(
                "all members of a sweep end at one time, and the event `{name}` is terminal; leave `terminal` out"
            )));
        }
        // The time has a column of its own.
        let shown = scene.columns.iter().filter(|(_, column)| !matches!(column, Column::Time));
        let (names, columns): (Vec<&str>, Vec<Column>) =
            shown.map(|(name, column)| (name.as_str(), column.clone())).unzip();
        let knobs = scene.knobs.iter().map(|knob| knob.name.as_str());
        let header =
            ["index"].into_iter().chain(knobs).chain(["status", "why", "steps", "t"]).chain(names.iter().copied());
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        directory.create()?;
        let mut writer = Writer {
            scene: &scene,
            csv: Table::new(directory.file("sweep.csv"), header)?,
            columns: columns.len(),
            drawn: self.plot.then(Vec::new),
            bar: progress_bar(!self.json),
            stop: stop_flag(),
            members: 0,
            failure: None,
        };
        let motion = scene.bare_motion();
        let parameters = members.parameters();
        let (start, values) = (|i: usize| members.start(i), |i: usize| members.parameter_values(i));
        let varied = Varied { names: &parameters, values: &values };
        let ensemble = Ensemble {
            count: members.count(),
            start: &start,
            t0: members.t0(),
            varied: (!parameters.is_empty()).then_some(varied),
            end: motion.end,
            way: motion.way,
            rows: None,
            columns: &columns,
            threads: self.threads.map(usize::from),
        };
        let tally = scene.system.ensemble(&ensemble, &mut writer);
        writer.bar.finish_and_clear();
        let tally = tally.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let Writer { csv, drawn, stop, failure, members: written, .. } = writer;
        csv.finish()?;
        if let Some(failure) = failure {
            return Err(failure);
        }
        let knob = scene.knobs.first().map(|knob| knob.name.as_str()).unwrap_or_default();
        for (i, name) in names.iter().enumerate().filter(|_| drawn.is_some()) {
            let of = |(value, columns): &(f64, Vec<f64>)| Some((*value, *columns.get(i)?)).filter(|p| p.1.is_finite());
            let points = drawn.iter().flatten().filter_map(of).collect();
            if let Some(figure) = plot::of_sweep(knob, name, points) {
                directory.write(&format!("sweep_{i}.svg"), &figure)?;
            }
        }
        let runtime_herglotz::Tally { completed, failed, suspicious, .. } = tally;
        if self.json {
            let told = serde_json::json!({
                "members": written, "completed": completed, "failed": failed, "suspicious": suspicious,
            });
            print_json(&told)?;
        } else {
            print(&format!("{written} members: {completed} completed ({suspicious} suspicious), {failed} failed"))?;
        }
        if stop.load(Ordering::Relaxed) && written < members.count() {
            return Err(Failure::Run(format!("interrupted after {written} of {} members", members.count())));
        }
        Ok(())
    }
}
