//! `herglotz run` for a lattice.

use super::run::{ROWS, Run, interrupt_flag, progress_bar};
use crate::failure::Failure;
use crate::output::{Directory, Table, json, print, print_json, short};
use crate::plot;
use herglotz::LatticeScene;
use herglotz::runtime::{Outcome, RunMonitor, Status};
use indicatif::ProgressBar;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Writes the rows of a motion, and keeps those that are drawn.
struct Writer {
    rows: Table,
    count: usize,
    drawn: Option<Vec<Vec<f64>>>,
    bar: ProgressBar,
    stop: Arc<AtomicBool>,
    failure: Option<Failure>,
}

impl RunMonitor for Writer {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        self.count += 1;
        if let Some(drawn) = &mut self.drawn {
            drawn.push(numbers.to_vec());
        }
        match self.rows.numbers(numbers) {
            Ok(()) => ControlFlow::Continue(()),
            Err(failure) => {
                self.failure = Some(failure);
                ControlFlow::Break(())
            }
        }
    }

    fn poll(&mut self, part: f64) -> ControlFlow<()> {
        self.bar.set_position((part * 1000.0) as u64);
        if self.stop.load(Ordering::Relaxed) && part < 1.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl Run {
    /// Runs a scene with `[lattice]`.
    pub(super) fn run_lattice(&self, text: &str) -> Result<(), Failure> {
        if self.resume || !self.scene.changes.is_empty() {
            return Err(Failure::Input(
                "--resume and --set do not apply to a scene with [lattice]; run it without them".into(),
            ));
        }
        let scene = LatticeScene::read(text).map_err(|error| self.scene.explain(error))?;
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        directory.create()?;
        let header = scene.columns();
        let mut writer = Writer {
            rows: Table::new(directory.file(ROWS), header.iter().map(String::as_str))?,
            count: 0,
            drawn: self.plot.then(Vec::new),
            bar: progress_bar(!self.json),
            stop: interrupt_flag(),
            failure: None,
        };
        let outcome = scene.system.run(&scene.motion, &mut writer);
        writer.bar.finish_and_clear();
        let outcome = outcome.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let Writer { rows, count, drawn, failure, .. } = writer;
        rows.finish()?;
        if let Some(failure) = failure {
            return Err(failure);
        }
        for (name, figure) in drawn.iter().flat_map(|rows| plot::of_lattice(&scene, rows)) {
            directory.write(&name, &figure)?;
        }
        self.tell_lattice(&scene, &outcome, count)
    }

    /// Prints the final state.
    fn tell_lattice(&self, scene: &LatticeScene, outcome: &Outcome, rows: usize) -> Result<(), Failure> {
        let interrupted = matches!(outcome.status, Status::Stopped { .. });
        let status = match outcome.status {
            _ if interrupted => "interrupted".to_owned(),
            // The cause is printed as an error.
            Status::Failed { .. } if !self.json => "failed".to_owned(),
            status => status.to_string(),
        };
        let Outcome { t, steps, evaluations, z, .. } = outcome;
        let z = z.unwrap_or(f64::NAN);
        let integrator = scene.motion.by.to_string();
        if self.json {
            print_json(&serde_json::json!({
                "status": status,
                "integrator": integrator,
                "steps": steps,
                "evaluations": evaluations,
                "rows": rows,
                "sites": scene.sizes,
                "end": { "t": json(*t), "z": json(z) },
            }))?;
        } else {
            let sites: usize = scene.sizes.iter().product();
            print(&format!(
                "{status}: {steps} steps of {sites} sites by {integrator}\n{rows} rows; the final state:\n  t = {}\n \
                  z = {}",
                short(*t),
                short(z)
            ))?;
        }
        match outcome.status {
            _ if interrupted => {
                Err(Failure::Run(format!("interrupted at t = {t}; the rows up to this time have been written")))
            }
            Status::Completed => Ok(()),
            status => Err(Failure::Run(status.to_string())),
        }
    }
}
