//! `herglotz run` for a rigid body.

use super::checkpoint::{Checkpoint, CheckpointWriter};
use super::run::{Run, read_numbers, steps};
use super::run_writer::{Headers, ROWS, RunOutput, RunWriter};
use crate::failure::Failure;
use crate::output::{Directory, exact, json, print, print_json, short};
use crate::plot_body;
use herglotz::BodyScene;
use herglotz::runtime::{Body, BodyMotion, BodyOutcome, BodyResumeState, Crossing, GroupStatus, Plan, RuntimeError};
use std::time::Duration;

/// The columns of events.csv.
pub(super) fn header_of_events(scene: &BodyScene) -> Option<Vec<String>> {
    let columns = ["event"].into_iter().chain(Body::COLUMNS).map(str::to_owned);
    (!scene.events.is_empty()).then(|| columns.collect())
}

/// The row of events.csv of a sign change.
pub(super) fn row_of_event(scene: &BodyScene, crossing: &Crossing) -> Vec<String> {
    let name = scene.events.get(crossing.event).cloned().unwrap_or_default();
    [name].into_iter().chain(crossing.columns.iter().map(|x| exact(*x))).collect()
}

/// The first rows of rows.csv as rows of all columns; those that are not in the file are NaN.
fn rows_before(scene: &BodyScene, directory: &Directory, count: usize) -> Result<Vec<Vec<f64>>, Failure> {
    let read = read_numbers(&directory.file(ROWS))?;
    let whole = |numbers: &Vec<f64>| {
        let mut row = vec![f64::NAN; Body::COLUMNS.len()];
        for (k, x) in scene.columns.iter().zip(numbers) {
            if let Some(entry) = row.get_mut(*k) {
                *entry = *x;
            }
        }
        row
    };
    Ok(read.iter().take(count).map(whole).collect())
}

impl Run {
    /// Runs a scene with `[body]`.
    pub(super) fn run_body(&self, text: &str) -> Result<(), Failure> {
        let scene = self.scene.read_body(text)?;
        let explain = |error: RuntimeError| self.scene.explain(scene.explain(&error));
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        let saved = if self.resume { Some(Checkpoint::read(&directory, &scene.fingerprint())?) } else { None };
        let mut motion = scene.motion.clone();
        if let Some(saved) = &saved {
            // The steps are known, and are not determined again.
            motion.step_control = steps(&saved.integrator, saved.count).unwrap_or(motion.step_control);
        }
        let plan = scene.body.plan(&motion).map_err(explain)?;
        // The run takes the steps of the plan, which are determined once.
        let step_control = steps(&plan.integrator.name, plan.steps).unwrap_or(motion.step_control);
        let motion = BodyMotion { step_control, ..motion };
        let from = saved.as_ref().map(|saved| saved.state(&directory, BodyResumeState::from_bytes)).transpose()?;
        let name = |k: &usize| Body::COLUMNS.get(*k).map(|name| (*name).to_owned());
        let headers =
            Headers { rows: scene.columns.iter().filter_map(name).collect(), events: header_of_events(&scene) };
        let row_of_event = |crossing: &Crossing| row_of_event(&scene, crossing);
        let before = match &saved {
            Some(saved) if self.plot => rows_before(&scene, &directory, saved.written.rows)?,
            _ => Vec::new(),
        };
        let mut writer = RunWriter::new(&directory, &headers, saved.as_ref(), !self.json)?;
        writer.columns = Some(&scene.columns);
        writer.row_of_event = &row_of_event;
        writer.interrupt_at = self.interrupt_at;
        writer.kept = self.plot.then_some(before);
        let every = Duration::from_secs(self.checkpoint_every.into());
        writer.checkpoints = Some(CheckpointWriter::new(&directory, scene.fingerprint(), &plan, every));
        if saved.is_none() {
            Checkpoint::remove(&directory)?;
        }
        let outcome = match from {
            Some(from) => scene.body.resume(&motion, from, &mut writer),
            None => scene.body.run(&motion, &mut writer),
        };
        writer.end_progress();
        let outcome = outcome.map_err(explain)?;
        let written = writer.finish(&directory, outcome.steps)?;
        for (name, figure) in written.kept.iter().flat_map(|rows| plot_body::of_body(&scene.body, rows)) {
            directory.write(name, &figure)?;
        }
        self.tell_body(&scene, &plan, &outcome, &written)
    }

    /// Prints the final state.
    fn tell_body(
        &self,
        scene: &BodyScene,
        plan: &Plan,
        outcome: &BodyOutcome,
        written: &RunOutput,
    ) -> Result<(), Failure> {
        let RunOutput { rows, events, is_resumable: interrupted, .. } = *written;
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
                "estimated_error": plan.error,
                "rows": rows,
                "events": events,
                "end": end,
            }))?;
        } else {
            let error = plan.error.map(|error| format!(", estimated error {error:.1e}")).unwrap_or_default();
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
                "interrupted at t = {}; the same command with --resume continues from there",
                outcome.t
            ))),
            GroupStatus::Completed | GroupStatus::Event { .. } => Ok(()),
            status => Err(Failure::Run(status.to_string())),
        }
    }
}
