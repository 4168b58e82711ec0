//! `herglotz run`.

use super::checkpoint::{Checkpoint, CheckpointWriter};
use super::run_writer::{EVENTS, Headers, ROWS, RunWriter};
use super::scene_arguments::SceneArguments;
use crate::failure::Failure;
use crate::output::{Directory, Written, exact, json, print, print_json, read_rows, short};
use crate::plot;
use clap::Args;
use herglotz::runtime::{
    AnyIntegrator, Crossing, Outcome, Plan, ResumeState, RuntimeError, Status, StepControl, Steps, velocity_name,
};
use herglotz::{AnyScene, Scene};
use std::path::PathBuf;
use std::time::Duration;

#[derive(Args)]
pub(crate) struct Run {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// The directory of the results; by default one with the name of the scene.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Resume from the last checkpoint of a run that was interrupted by Ctrl-C or killed.
    #[arg(long)]
    pub(super) resume: bool,
    /// The time between two checkpoints, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 60)]
    pub(super) checkpoint_every: u32,
    /// Draw the columns against time, and phase portraits: columns.svg, phase.svg, path.svg, section.svg; for a lattice
    /// space-time.svg and sites.svg; for a rigid body polhode.svg and path.svg.
    #[arg(long)]
    pub(super) plot: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// Interrupt the run as Ctrl-C does, once this fraction of it is done: for tests.
    #[arg(long, hide = true)]
    pub(super) interrupt_at: Option<f64>,
}

/// The entries of a row of events.csv after the name of the event.
pub(crate) fn numbers_of_event(scene: &Scene, crossing: &Crossing) -> impl Iterator<Item = String> {
    // The columns of other events are empty.
    scene.numbers_of_event(crossing).into_iter().map(|number| number.map(exact).unwrap_or_default())
}

/// The columns of events.csv.
pub(crate) fn header_of_events(scene: &Scene) -> Vec<String> {
    ["event".to_owned()].into_iter().chain(scene.columns_of_events()).collect()
}

impl Run {
    pub fn run(&self) -> Result<(), Failure> {
        let scene = match self.scene.read_any()? {
            AnyScene::Motion(scene) => scene,
            AnyScene::Lattice(scene) => return self.run_lattice(&scene),
            AnyScene::Body(scene) => return self.run_body(&scene),
            AnyScene::Path(scene) => return self.run_path(&scene),
        };
        let explain = |error: RuntimeError| self.scene.explain(scene.explain(&error));
        let mut motion = scene.motion();
        motion.resumable = true;
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        let saved = if self.resume { Some(Checkpoint::read(&directory, &scene.fingerprint())?) } else { None };
        let plan = match &saved {
            // The steps are known, and are not determined again.
            Some(saved) if !saved.in_transformed_time => {
                motion.step_control = steps(&saved.integrator, saved.count).unwrap_or(motion.step_control);
                scene.system.plan(&motion).map_err(explain)?
            }
            _ => scene.system.plan(&motion).map_err(explain)?,
        };
        // The run takes the steps of the plan, which are determined once.
        if !plan.integrator.in_transformed_time {
            motion.step_control = steps(&plan.integrator.name, plan.steps).unwrap_or(motion.step_control);
        }
        let from = saved.as_ref().map(|saved| saved.state(&directory, ResumeState::from_bytes)).transpose()?;
        let every = Duration::from_secs(self.checkpoint_every.into());
        let headers = Headers {
            rows: scene.columns.iter().map(|(name, _)| name.clone()).collect(),
            events: (!scene.events.is_empty()).then(|| header_of_events(&scene)),
        };
        let row_of_event = |crossing: &Crossing| {
            let name = scene.events.get(crossing.event).map(|(name, _)| name.clone()).unwrap_or_default();
            [name].into_iter().chain(numbers_of_event(&scene, crossing)).collect()
        };
        let mut writer = RunWriter::new(&directory, &headers, saved.as_ref(), !self.json)?;
        // With rows given by steps, the first row after a resume is that of the step at which the motion continues.
        let stride = scene.rows_every_step();
        writer.skip = saved.as_ref().zip(stride).is_some_and(|(saved, stride)| saved.taken.is_multiple_of(stride));
        writer.row_of_event = &row_of_event;
        writer.interrupt_at = self.interrupt_at;
        writer.checkpoints = Some(CheckpointWriter::new(&directory, scene.fingerprint(), &plan, every));
        if saved.is_none() {
            Checkpoint::remove(&directory)?;
        }
        let outcome = match from {
            Some(from) => scene.system.resume(&motion, from, &mut writer),
            None => scene.system.run(&motion, &mut writer),
        };
        writer.end_progress();
        let outcome = outcome.map_err(explain)?;
        let written = writer.finish(&directory, outcome.steps)?;
        for (count, (name, _)) in written.not_finite.iter().zip(&scene.columns).filter(|(count, _)| **count > 0) {
            eprintln!("warning: the column `{name}` is not a finite number in {count} rows");
        }
        let mut files = Written::default();
        files.push(directory.file(ROWS));
        if !scene.events.is_empty() {
            files.push(directory.file(EVENTS));
        }
        if self.plot {
            for (name, figure) in plot::of_rows(&scene, &read_numbers(&directory.file(ROWS))?) {
                files.push(directory.write(&name, &figure)?);
            }
            if !scene.events.is_empty()
                && let Some(figure) = plot::of_section(&scene, &read_crossings(&scene, &directory.file(EVENTS))?)
            {
                files.push(directory.write("section.svg", &figure)?);
            }
        }
        self.report(&scene, &plan, &outcome, (written.rows, written.events, &files), written.is_resumable)
    }

    /// Refuses to resume what has no checkpoints.
    pub(super) fn refuse_resume(&self, what: &str) -> Result<(), Failure> {
        match self.resume {
            true => Err(Failure::Input(format!("--resume does not apply to {what}; run it without it"))),
            false => Ok(()),
        }
    }

    /// Prints the final state.
    fn report(
        &self,
        scene: &Scene,
        plan: &Plan,
        outcome: &Outcome,
        (rows, events, files): (usize, usize, &Written),
        interrupted: bool,
    ) -> Result<(), Failure> {
        let end = end_of(scene, outcome);
        let status = match outcome.status {
            _ if interrupted => "interrupted".to_owned(),
            // The cause is printed as an error.
            Status::Failed { .. } if !self.json => "failed".to_owned(),
            Status::FalseClaim { .. } if !self.json => "unreliable".to_owned(),
            status => status.to_string(),
        };
        let Outcome { t, steps, evaluations, .. } = outcome;
        if self.json {
            let end: serde_json::Map<_, _> = end.iter().map(|(name, x)| (name.clone(), json(*x))).collect();
            print_json(&serde_json::json!({
                "status": status,
                "unresolved": outcome.unresolved.map(|unresolved| unresolved.to_string()),
                "integrator": plan.integrator.name,
                "step_size": plan.step_size,
                "steps": steps,
                "evaluations": evaluations,
                "estimated_error": plan.error.or(outcome.error_estimate.filter(|e| e.is_finite())),
                "rows": rows,
                "events": events,
                "files": files.paths(),
                "end": end,
            }))?;
        } else {
            let Plan { integrator, step_size, .. } = plan;
            let error = plan
                .error
                .or(outcome.error_estimate)
                .map(|error| format!(", estimated error {error:.1e}"))
                .unwrap_or_default();
            let instead = match scene.motion().step_control {
                StepControl::Steps { steps: Steps::Size(given), .. } if is_another(given, *step_size) => {
                    format!(" (in place of {}, so that they fill the span)", short(given))
                }
                _ => String::new(),
            };
            let mut lines = vec![format!(
                "{status}: {steps} {} of {}{instead} by {}{error}",
                if *steps == 1 { "step" } else { "steps" },
                short(*step_size),
                integrator.name
            )];
            let crossings = if scene.events.is_empty() { String::new() } else { format!(", {events} events") };
            lines.push(format!("{rows} rows{crossings}; the final state:"));
            lines.extend(end.iter().map(|(name, x)| format!("  {name} = {}", short(*x))));
            lines.push(files.line());
            print(&lines.join("\n"))?;
        }
        if let Some(warning) = scene.gain_of_energy() {
            eprintln!("warning: {warning}");
        }
        if let Some(unresolved) = outcome.unresolved {
            eprintln!("warning: {unresolved}");
        }
        match outcome.status {
            _ if interrupted => Err(Failure::Run(format!(
                "interrupted at t = {t}; the same command with --resume continues from there"
            ))),
            Status::Completed | Status::Stopped { .. } => Ok(()),
            status => {
                let accumulation = match &status {
                    Status::Failed { cause, .. } => scene.accumulation(cause),
                    _ => None,
                };
                Err(Failure::Run(accumulation.unwrap_or_else(|| status.to_string())))
            }
        }
    }
}

/// Whether a given step differs from one that was taken by more than round-off.
fn is_another(given: f64, taken: f64) -> bool {
    (taken.abs() / given.abs() - 1.0).abs() > 1e-9
}

/// A number of steps with the integrator of this name.
pub(super) fn steps(integrator: &str, count: usize) -> Option<StepControl> {
    let by: AnyIntegrator = integrator.parse().ok()?;
    Some(StepControl::Steps { by, steps: Steps::Count(count) })
}

/// The state at the end with its names.
pub(crate) fn end_of(scene: &Scene, outcome: &Outcome) -> Vec<(String, f64)> {
    let names = scene.system.formula().coordinates();
    let mut end = vec![("t".to_owned(), outcome.t)];
    end.extend(names.iter().cloned().zip(outcome.q.iter().copied()));
    if let Some(v) = &outcome.v {
        end.extend(names.iter().map(|name| velocity_name(name)).zip(v.iter().copied()));
    }
    end.extend(scene.system.formula().momenta().into_iter().zip(outcome.p.iter().copied()));
    end.extend(outcome.z.map(|z| (scene.system.formula().action().to_owned(), z)));
    end.extend(outcome.log_factor.map(|x| ("log_factor".to_owned(), x)));
    end
}

/// The events in the file: the index of each, and its numbers.
fn read_crossings(scene: &Scene, path: &std::path::Path) -> Result<Vec<(usize, Vec<f64>)>, Failure> {
    let index = |name: &str| scene.events.iter().position(|(known, _)| known == name).unwrap_or(usize::MAX);
    let rows = read_rows(path)?;
    let of = |row: Vec<String>| {
        let (name, numbers) = row.split_first()?;
        Some((index(name), numbers.iter().map(|x| x.parse().unwrap_or(f64::NAN)).collect()))
    };
    Ok(rows.into_iter().filter_map(of).collect())
}

/// The rows in the file.
pub(super) fn read_numbers(path: &std::path::Path) -> Result<Vec<Vec<f64>>, Failure> {
    let number = |x: &String| x.parse().unwrap_or(f64::NAN);
    Ok(read_rows(path)?.iter().map(|row| row.iter().map(number).collect()).collect())
}
