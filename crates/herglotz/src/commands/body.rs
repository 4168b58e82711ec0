//! `herglotz run` for a rigid body.

use super::run::{EVENTS, ROWS, Run, interrupt_flag, progress_bar};
use crate::failure::Failure;
use crate::output::{Directory, Table, exact, json, print, print_json, short};
use crate::plot_body;
use herglotz::BodyScene;
use herglotz::runtime::{Body, BodyOutcome, Crossing, GroupStatus, RunMonitor};
use indicatif::ProgressBar;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Writes the rows and the events of a motion, and keeps the rows that are drawn.
struct Writer<'s> {
    scene: &'s BodyScene,
    rows: Table,
    events: Option<Table>,
    counts: (usize, usize),
    drawn: Option<Vec<Vec<f64>>>,
    bar: ProgressBar,
    stop: Arc<AtomicBool>,
    failure: Option<Failure>,
}

impl Writer<'_> {
    fn continue_unless_failed(&mut self, written: Result<(), Failure>) -> ControlFlow<()> {
        match written {
            Ok(()) => ControlFlow::Continue(()),
            Err(failure) => {
                self.failure = Some(failure);
                ControlFlow::Break(())
            }
        }
    }
}

impl RunMonitor for Writer<'_> {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        self.counts.0 += 1;
        if let Some(drawn) = &mut self.drawn {
            drawn.push(numbers.to_vec());
        }
        let chosen: Vec<f64> = self.scene.columns.iter().filter_map(|k| numbers.get(*k).copied()).collect();
        let written = self.rows.numbers(&chosen);
        self.continue_unless_failed(written)
    }

    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        let Some(table) = &mut self.events else { return ControlFlow::Continue(()) };
        self.counts.1 += 1;
        let name = self.scene.events.get(crossing.event).cloned().unwrap_or_default();
        let written = table.record([name].into_iter().chain(crossing.columns.iter().map(|x| exact(*x))));
        self.continue_unless_failed(written)
    }

    fn poll(&mut self, part: f64) -> ControlFlow<()> {
        self.bar.set_position((part * 1000.0) as u64);
        if self.stop.load(Ordering::Relaxed) && part < 1.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl Run {
    /// Runs a scene with `[body]`.
    pub(super) fn run_body(&self, text: &str) -> Result<(), Failure> {
        if self.resume || !self.scene.changes.is_empty() {
            return Err(Failure::Input(
                "--resume and --set do not apply to a scene with [body]; run it without them".into(),
            ));
        }
        let scene = BodyScene::read(text).map_err(|error| self.scene.explain(error))?;
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        directory.create()?;
        let header = scene.columns.iter().filter_map(|k| Body::COLUMNS.get(*k).copied());
        let rows = Table::new(directory.file(ROWS), header)?;
        let header = ["event"].into_iter().chain(Body::COLUMNS);
        let events = (!scene.events.is_empty()).then(|| Table::new(directory.file(EVENTS), header)).transpose()?;
        let mut writer = Writer {
            scene: &scene,
            rows,
            events,
            counts: (0, 0),
            drawn: self.plot.then(Vec::new),
            bar: progress_bar(!self.json),
            stop: interrupt_flag(),
            failure: None,
        };
        let outcome = scene.body.run(&scene.motion, &mut writer);
        writer.bar.finish_and_clear();
        let outcome = outcome.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let Writer { rows, events, counts, drawn, failure, .. } = writer;
        rows.finish()?;
        events.map(Table::finish).transpose()?;
        if let Some(failure) = failure {
            return Err(failure);
        }
        for (name, figure) in drawn.iter().flat_map(|rows| plot_body::of_body(&scene.body, rows)) {
            directory.write(name, &figure)?;
        }
        self.tell_body(&scene, &outcome, counts)
    }

    /// Prints the final state.
    fn tell_body(&self, scene: &BodyScene, outcome: &BodyOutcome, counts: (usize, usize)) -> Result<(), Failure> {
        let (rows, events) = counts;
        let interrupted = matches!(outcome.status, GroupStatus::Stopped { .. });
        let status = match outcome.status {
            _ if interrupted => "interrupted".to_owned(),
            // The cause is printed as an error.
            GroupStatus::Failed { .. } if !self.json => "failed".to_owned(),
            GroupStatus::Event { event, t } => {
                let name = scene.events.get(event).map_or("", String::as_str);
                format!("stopped by the event {name} at t = {t}")
            }
            status => status.to_string(),
        };
        let end: Vec<(&str, f64)> = Body::COLUMNS.iter().copied().zip(outcome.row()).collect();
        if self.json {
            let end: serde_json::Map<_, _> = end.iter().map(|(name, x)| ((*name).to_owned(), json(*x))).collect();
            print_json(&serde_json::json!({
                "status": status,
                "integrator": outcome.by.to_string(),
                "step_size": outcome.step_size,
                "steps": outcome.steps,
                "estimated_error": outcome.error_estimate,
                "rows": rows,
                "events": events,
                "end": end,
            }))?;
        } else {
            let error =
                outcome.error_estimate.map(|error| format!(", estimated error {error:.1e}")).unwrap_or_default();
            let crossings = if scene.events.is_empty() { String::new() } else { format!(", {events} events") };
            let mut lines = vec![
                format!("{status}: {} steps of {} by {}{error}", outcome.steps, short(outcome.step_size), outcome.by),
                format!("{rows} rows{crossings}; the final state:"),
            ];
            lines.extend(end.iter().map(|(name, x)| format!("  {name} = {}", short(*x))));
            print(&lines.join("\n"))?;
        }
        match outcome.status {
            _ if interrupted => Err(Failure::Run(format!(
                "interrupted at t = {}; the rows up to this time have been written",
                outcome.t
            ))),
            GroupStatus::Completed | GroupStatus::Event { .. } => Ok(()),
            status => Err(Failure::Run(status.to_string())),
        }
    }
}
