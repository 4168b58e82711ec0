//! `herglotz sweep`.

use super::run::{EVENTS, header_of_events, interrupt_flag, numbers_of_event, progress_bar};
use super::scene_arguments::SceneArguments;
use crate::failure::Failure;
use crate::output::{Directory, Table, exact, print, print_json};
use crate::plot;
use clap::Args;
use herglotz::Scene;
use herglotz::runtime::{Column, Ending, Ensemble, EnsembleMonitor, Event, MemberEnd, Status, Varied};
use indicatif::ProgressBar;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

#[derive(Args)]
pub(crate) struct Sweep {
    #[command(flatten)]
    scene: SceneArguments,
    /// The directory of sweep.csv, and of events.csv where the scene has events; by default one with the name of the
    /// scene.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The number of threads; the results do not depend on it.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Draw the columns at the end, and the coordinates and columns of the first event, against the first swept
    /// quantity.
    #[arg(long)]
    plot: bool,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// A swept value with the numbers that are drawn against it.
type Drawn = (f64, Vec<f64>);

/// Writes the members in the order of their index.
struct Writer<'s> {
    scene: &'s Scene,
    csv: Table,
    /// The table of events, where the scene has events.
    events: Option<Table>,
    /// The number of columns at the end.
    columns: usize,
    /// The data of the figures: the columns at the end of each member that started, and the coordinates and columns at
    /// each sign change of the first event, both with the swept value.
    drawn: Option<[Vec<Drawn>; 2]>,
    bar: ProgressBar,
    stop: Arc<AtomicBool>,
    members: usize,
    failure: Option<Failure>,
}

/// The status of a member in one word, and its reason.
fn words(ending: &Ending) -> (&'static str, String) {
    let why = ending.unresolved.map(|unresolved| unresolved.to_string()).unwrap_or_default();
    match ending.status {
        Status::Completed if ending.unresolved.is_some() => ("unresolved", why),
        Status::Completed => ("completed", why),
        status @ Status::Stopped { .. } => ("stopped", status.to_string()),
        status @ Status::FalseClaim { .. } => ("unreliable", status.to_string()),
        status => ("failed", status.to_string()),
    }
}

impl Writer<'_> {
    fn events_of(&mut self, member: &MemberEnd, values: &[f64]) -> Result<(), Failure> {
        let Some(table) = &mut self.events else { return Ok(()) };
        for crossing in &member.crossings {
            let name = self.scene.events.get(crossing.event).map(|(name, _)| name.clone()).unwrap_or_default();
            let which = [member.index.to_string()].into_iter().chain(values.iter().map(|x| exact(*x)));
            table.record(which.chain([name]).chain(numbers_of_event(self.scene, crossing)))?;
        }
        Ok(())
    }
}

impl EnsembleMonitor for Writer<'_> {
    fn member(&mut self, member: MemberEnd) -> ControlFlow<()> {
        let values = self.scene.members().values(member.index);
        let mut row = vec![member.index.to_string()];
        row.extend(values.iter().map(|x| exact(*x)));
        match &member.ending {
            Ok(ending) => {
                let (status, why) = words(ending);
                row.extend([status.to_owned(), why, ending.steps.to_string(), exact(ending.t)]);
                row.extend(ending.columns.iter().map(|x| exact(*x)));
                if let (Some([ends, events]), Some(value)) = (&mut self.drawn, values.first()) {
                    ends.push((*value, ending.columns.clone()));
                    let of_first = member.crossings.iter().filter(|crossing| crossing.event == 0);
                    events.extend(of_first.map(|crossing| (*value, [&crossing.q[..], &crossing.columns].concat())));
                }
            }
            Err(cause) => {
                row.extend(["refused".to_owned(), cause.to_string(), "0".to_owned(), String::new()]);
                row.extend(std::iter::repeat_n(String::new(), self.columns));
            }
        }
        self.members += 1;
        self.bar.set_position((1000 * self.members / self.scene.members().count().max(1)) as u64);
        match self.csv.record(&row).and_then(|()| self.events_of(&member, &values)) {
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
        if scene.swept.is_empty() {
            return Err(refuse(
                "the scene has no swept values; add [sweep] with a parameter, as in gamma = { from = -1.0, to = 0.0, \
                 count = 11 }",
            ));
        }
        let factor = scene.columns.iter().find(|(_, column)| column.has_conformal_factor());
        let terminal = scene.events.iter().find(|(_, event)| event.terminal);
        if let (Some((column, _)), Some((event, _))) = (factor, terminal) {
            return Err(refuse(&format!(
                "the column `{column}` of a sweep is known only at the ends of steps, but the terminal event \
                 `{event}` ends a motion within a step; remove one of them"
            )));
        }
        // The time is a column of its own.
        let shown = scene.columns.iter().filter(|(_, column)| !matches!(column, Column::Time));
        let (names, columns): (Vec<&str>, Vec<Column>) =
            shown.map(|(name, column)| (name.as_str(), column.clone())).unzip();
        let swept = scene.swept.iter().map(|quantity| quantity.name.as_str());
        let swept: Vec<&str> = ["index"].into_iter().chain(swept).collect();
        let header = swept.iter().copied().chain(["status", "why", "steps", "t"]).chain(names.iter().copied());
        let of_events = header_of_events(&scene);
        let header_of_events = swept.iter().copied().chain(of_events.iter().map(String::as_str));
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        directory.create()?;
        let mut writer = Writer {
            scene: &scene,
            csv: Table::new(directory.file("sweep.csv"), header)?,
            events: if scene.events.is_empty() {
                None
            } else {
                Some(Table::new(directory.file(EVENTS), header_of_events)?)
            },
            columns: columns.len(),
            drawn: self.plot.then(Default::default),
            bar: progress_bar(!self.json),
            stop: interrupt_flag(),
            members: 0,
            failure: None,
        };
        let motion = scene.bare_motion();
        let events: Vec<Event> = scene.events.iter().map(|(_, event)| event.clone()).collect();
        let parameters = members.parameters();
        let (start, values) = (|i: usize| members.start(i), |i: usize| members.parameter_values(i));
        let varied = Varied { names: &parameters, values: &values };
        let ensemble = Ensemble {
            count: members.count(),
            start: &start,
            t0: members.t0(),
            varied: (!parameters.is_empty()).then_some(varied),
            end: motion.end,
            step_control: motion.step_control,
            rows: None,
            columns: &columns,
            events: &events,
            threads: self.threads.map(usize::from),
        };
        let tally = scene.system.ensemble(&ensemble, &mut writer);
        writer.bar.finish_and_clear();
        let tally = tally.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let Writer { csv, events, drawn, stop, failure, members: written, .. } = writer;
        csv.finish()?;
        events.map(Table::finish).transpose()?;
        if let Some(failure) = failure {
            return Err(failure);
        }
        let quantity = scene.swept.first().map(|quantity| quantity.name.as_str()).unwrap_or_default();
        let at_first = scene.columns_of_first_event();
        let at_first: Vec<&str> = at_first.iter().map(String::as_str).collect();
        let [ends, at_events] = drawn.unwrap_or_default();
        for (file, names, points) in [("sweep", &names, ends), ("sweep_events", &at_first, at_events)] {
            for (i, name) in names.iter().enumerate() {
                let of = |(value, numbers): &Drawn| Some((*value, *numbers.get(i)?)).filter(|p| p.1.is_finite());
                if let Some(figure) = plot::of_sweep(&scene, quantity, name, points.iter().filter_map(of).collect()) {
                    directory.write(&format!("{file}_{i}.svg"), &figure)?;
                }
            }
        }
        let herglotz::runtime::Tally { completed, stopped, failed, unresolved, .. } = tally;
        if self.json {
            let summary = serde_json::json!({
                "members": written, "completed": completed, "stopped": stopped, "failed": failed, "unresolved": unresolved,
            });
            print_json(&summary)?;
        } else {
            let stopped = if stopped > 0 { format!(", {stopped} stopped by an event") } else { String::new() };
            print(&format!(
                "{written} members: {completed} completed ({unresolved} unresolved), {failed} failed{stopped}"
            ))?;
        }
        if stop.load(Ordering::Relaxed) && written < members.count() {
            return Err(Failure::Run(format!("interrupted after {written} of {} members", members.count())));
        }
        Ok(())
    }
}
