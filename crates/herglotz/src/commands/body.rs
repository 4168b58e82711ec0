//! `herglotz run` for a rigid body.

use super::checkpoint::{Checkpoint, CheckpointWriter};
use super::run::{Run, read_numbers, steps};
use super::run_writer::{EVENTS, Headers, ROWS, RunOutput, RunWriter};
use crate::failure::Failure;
use crate::output::{Directory, Written, exact, json, print, print_json, short};
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

/// The rows of a file as rows of all columns, where the file has all of them.
fn whole_rows(scene: &BodyScene, directory: &Directory) -> Result<Vec<Vec<f64>>, Failure> {
    let place = |k: usize| scene.columns.iter().position(|column| *column == k);
    let Some(places) = (0..Body::COLUMNS.len()).map(place).collect::<Option<Vec<usize>>>() else {
        eprintln!("warning: rows.csv has not all columns, so that the figures show the rest of the motion only");
        return Ok(Vec::new());
    };
    let read = read_numbers(&directory.file(ROWS))?;
    let whole = |numbers: &Vec<f64>| places.iter().map(|k| numbers.get(*k).copied().unwrap_or(f64::NAN)).collect();
    Ok(read.iter().map(whole).collect())
}

impl Run {
    /// Runs a scene of a rigid body.
    pub(super) fn run_body(&self, scene: &BodyScene) -> Result<(), Failure> {
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
            Headers { rows: scene.columns.iter().filter_map(name).collect(), events: header_of_events(scene) };
        let row_of_event = |crossing: &Crossing| row_of_event(scene, crossing);
        let mut writer = RunWriter::new(&directory, &headers, saved.as_ref(), !self.json)?;
        writer.columns = Some(&scene.columns);
        writer.row_of_event = &row_of_event;
        writer.interrupt_at = self.interrupt_at;
        // The file ends where the motion is resumed.
        writer.kept = match &saved {
            _ if !self.plot => None,
            Some(_) => Some(whole_rows(scene, &directory)?),
            None => Some(Vec::new()),
        };
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
        let mut files = Written::default();
        files.push(directory.file(ROWS));
        if !scene.events.is_empty() {
            files.push(directory.file(EVENTS));
        }
        for (name, figure) in written.kept.iter().flat_map(|rows| plot_body::of_body(&scene.body, rows)) {
            files.push(directory.write(name, &figure)?);
        }
        self.tell_body(scene, &plan, &outcome, (&written, &files))
    }

    /// Prints the final state.
    fn tell_body(
        &self,
        scene: &BodyScene,
        plan: &Plan,
        outcome: &BodyOutcome,
        (written, files): (&RunOutput, &Written),
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
        if scene.body.gamma > 0.0 {
            eprintln!(
                "warning: gamma is {}, so that the motion gains energy: for a drag it is negative",
                scene.body.gamma
            );
        }
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
                "files": files.paths(),
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
            lines.push(files.line());
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
