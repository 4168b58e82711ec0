//! `herglotz run`.

use super::checkpoint::{Checkpoint, CheckpointWriter, Written};
use super::scene_arguments::SceneArguments;
use crate::failure::Failure;
use crate::output::{Directory, Table, exact, json, print, print_json, read_rows, short};
use crate::plot;
use clap::Args;
use herglotz::runtime::{
    AnyIntegrator, Crossing, Outcome, Plan, ResumeState, RunMonitor, RuntimeError, Status, StepControl, Steps,
    velocity_name,
};
use herglotz::{BodyScene, EndsScene, LatticeScene, Scene};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

pub(super) const ROWS: &str = "rows.csv";
pub(crate) const EVENTS: &str = "events.csv";

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
    checkpoint_every: u32,
    /// Draw the columns against time, and phase portraits: columns.svg, phase.svg, path.svg, section.svg; for a lattice
    /// space-time.svg and sites.svg; for a rigid body polhode.svg and path.svg.
    #[arg(long)]
    pub(super) plot: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// Interrupt the run as Ctrl-C does, once this fraction of it is done: for tests.
    #[arg(long, hide = true)]
    interrupt_at: Option<f64>,
}

/// Observes a motion and writes its output.
struct Writer {
    scene: Scene,
    rows: Table,
    /// The table of events, where the scene has events.
    events: Option<Table>,
    row_count: usize,
    event_count: usize,
    /// For each column the number of rows in which it is not finite.
    not_finite: Vec<usize>,
    /// Whether the next row is already in the file.
    skip: bool,
    bar: ProgressBar,
    stop: Arc<AtomicBool>,
    interrupt_at: Option<f64>,
    interrupted: Option<ResumeState>,
    checkpoints: CheckpointWriter,
    failure: Option<Failure>,
}

impl Writer {
    /// Flushes the files and returns their lengths.
    fn written(&mut self) -> Result<Written, Failure> {
        let rows_bytes = self.rows.flush()?;
        let events_bytes = self.events.as_mut().map(Table::flush).transpose()?.unwrap_or(0);
        Ok(Written { rows: self.row_count, rows_bytes, events: self.event_count, events_bytes })
    }

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

impl RunMonitor for Writer {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        if std::mem::take(&mut self.skip) {
            return ControlFlow::Continue(());
        }
        self.row_count += 1;
        for (count, x) in self.not_finite.iter_mut().zip(numbers) {
            *count += usize::from(!x.is_finite());
        }
        let written = self.rows.numbers(numbers);
        self.continue_unless_failed(written)
    }

    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        let (Some(table), Some((name, _))) = (&mut self.events, self.scene.events.get(crossing.event)) else {
            return ControlFlow::Continue(());
        };
        self.event_count += 1;
        let written = table.record([name.clone()].into_iter().chain(numbers_of_event(&self.scene, crossing)));
        self.continue_unless_failed(written)
    }

    fn poll(&mut self, part: f64) -> ControlFlow<()> {
        self.bar.set_position((part * 1000.0) as u64);
        // At the end of the motion an interruption has no effect.
        let is_interrupted = self.stop.load(Ordering::Relaxed) || self.interrupt_at.is_some_and(|at| part >= at);
        if is_interrupted && part < 1.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn interrupted(&mut self, at: ResumeState) {
        self.interrupted = Some(at);
    }

    fn wants_checkpoint(&mut self) -> bool {
        self.checkpoints.is_due()
    }

    fn checkpoint(&mut self, taken: usize, at: ResumeState) -> ControlFlow<()> {
        let saved = self.written().and_then(|written| self.checkpoints.save(taken, written, &at));
        self.continue_unless_failed(saved)
    }
}

/// The entries of a row of events.csv after the name of the event.
pub(crate) fn numbers_of_event(scene: &Scene, crossing: &Crossing) -> impl Iterator<Item = String> {
    // The columns of other events are empty.
    scene.numbers_of_event(crossing).into_iter().map(|number| number.map(exact).unwrap_or_default())
}

/// A flag that Ctrl-C sets; a second one ends the program.
pub(crate) fn interrupt_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = flag.clone();
    let handler = move || {
        if set.swap(true, Ordering::Relaxed) {
            std::process::exit(1);
        }
    };
    // Without a handler Ctrl-C ends the program at once.
    if let Err(error) = ctrlc::set_handler(handler) {
        eprintln!("warning: a run that Ctrl-C interrupts will have no checkpoint: {error}");
    }
    flag
}

/// A progress bar in thousandths, on a terminal.
pub(crate) fn progress_bar(shown: bool) -> ProgressBar {
    if !(shown && std::io::stderr().is_terminal()) {
        return ProgressBar::hidden();
    }
    let style =
        ProgressStyle::with_template("{wide_bar} {percent}% {eta}").unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(1000).with_style(style)
}

/// The columns of events.csv.
pub(crate) fn header_of_events(scene: &Scene) -> Vec<String> {
    ["event".to_owned()].into_iter().chain(scene.columns_of_events()).collect()
}

impl Run {
    pub fn run(&self) -> Result<(), Failure> {
        let text = self.scene.text()?;
        if LatticeScene::is_one(&text) {
            return self.run_lattice(&text);
        }
        if BodyScene::is_one(&text) {
            return self.run_body(&text);
        }
        if EndsScene::is_one(&text) {
            return self.run_ends(&text);
        }
        let scene = self.scene.read()?;
        let explain = |error: RuntimeError| self.scene.explain(scene.explain(&error));
        let mut motion = scene.motion();
        motion.resumable = true;
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        let saved = if self.resume { Some(Checkpoint::read(&directory, &scene)?) } else { None };
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
        let from = saved.as_ref().map(|saved| saved.state(&directory)).transpose()?;
        let every = Duration::from_secs(self.checkpoint_every.into());
        let checkpoints = CheckpointWriter::new(&directory, &scene, &plan, every);
        let mut writer = self.writer(&directory, &scene, checkpoints, saved.as_ref())?;
        if saved.is_none() {
            Checkpoint::remove(&directory)?;
        }
        let outcome = match from {
            Some(from) => scene.system.resume(&motion, from, &mut writer),
            None => scene.system.run(&motion, &mut writer),
        };
        writer.bar.finish_and_clear();
        let outcome = outcome.map_err(explain)?;
        let written = writer.written()?;
        let Writer { not_finite, interrupted, mut checkpoints, failure, .. } = writer;
        if let Some(failure) = failure {
            return Err(failure);
        }
        for (count, (name, _)) in not_finite.iter().zip(&scene.columns).filter(|(count, _)| **count > 0) {
            eprintln!("warning: the column `{name}` is not a finite number in {count} rows");
        }
        match &interrupted {
            Some(state) => checkpoints.save(outcome.steps, written, state)?,
            None => Checkpoint::remove(&directory)?,
        }
        if self.plot {
            for (name, figure) in plot::of_rows(&scene, &read_numbers(&directory.file(ROWS))?) {
                directory.write(&name, &figure)?;
            }
            if !scene.events.is_empty()
                && let Some(figure) = plot::of_section(&scene, &read_crossings(&scene, &directory.file(EVENTS))?)
            {
                directory.write("section.svg", &figure)?;
            }
        }
        self.report(&scene, &plan, &outcome, (written.rows, written.events), interrupted.is_some())
    }

    /// The output files: new ones, or those of the run that is resumed.
    fn writer(
        &self,
        directory: &Directory,
        scene: &Scene,
        checkpoints: CheckpointWriter,
        saved: Option<&Checkpoint>,
    ) -> Result<Writer, Failure> {
        directory.create()?;
        let (rows_at, events_at) = (directory.file(ROWS), directory.file(EVENTS));
        let has_events = !scene.events.is_empty();
        let before = saved.map(|saved| saved.written);
        let (rows, events) = match before {
            Some(before) => {
                let events = has_events.then(|| Table::resume(events_at, before.events_bytes)).transpose()?;
                (Table::resume(rows_at, before.rows_bytes)?, events)
            }
            None => {
                let header = header_of_events(scene);
                let header = || header.iter().map(String::as_str);
                let events = has_events.then(|| Table::new(events_at, header())).transpose()?;
                (Table::new(rows_at, scene.columns.iter().map(|(name, _)| name.as_str()))?, events)
            }
        };
        // With rows given by steps, the first row after a resume is that of the step at which the motion continues.
        let stride = scene.rows_every_step();
        let skip = saved.zip(stride).is_some_and(|(saved, stride)| saved.taken.is_multiple_of(stride));
        let before = before.unwrap_or_default();
        Ok(Writer {
            scene: scene.clone(),
            rows,
            events,
            row_count: before.rows,
            event_count: before.events,
            not_finite: vec![0; scene.columns.len()],
            skip,
            bar: progress_bar(!self.json),
            stop: interrupt_flag(),
            interrupt_at: self.interrupt_at,
            interrupted: None,
            checkpoints,
            failure: None,
        })
    }

    /// Prints the final state.
    fn report(
        &self,
        scene: &Scene,
        plan: &Plan,
        outcome: &Outcome,
        (rows, events): (usize, usize),
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
                "end": end,
            }))?;
        } else {
            let Plan { integrator, step_size, .. } = plan;
            let error = plan
                .error
                .or(outcome.error_estimate)
                .map(|error| format!(", estimated error {error:.1e}"))
                .unwrap_or_default();
            let mut lines = vec![format!(
                "{status}: {steps} {} of {} by {}{error}",
                if *steps == 1 { "step" } else { "steps" },
                short(*step_size),
                integrator.name
            )];
            let crossings = if scene.events.is_empty() { String::new() } else { format!(", {events} events") };
            lines.push(format!("{rows} rows{crossings}; the final state:"));
            lines.extend(end.iter().map(|(name, x)| format!("  {name} = {}", short(*x))));
            print(&lines.join("\n"))?;
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

/// A number of steps with the integrator of this name.
fn steps(integrator: &str, count: usize) -> Option<StepControl> {
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
fn read_numbers(path: &std::path::Path) -> Result<Vec<Vec<f64>>, Failure> {
    let number = |x: &String| x.parse().unwrap_or(f64::NAN);
    Ok(read_rows(path)?.iter().map(|row| row.iter().map(number).collect()).collect())
}
