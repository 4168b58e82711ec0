//! `herglotz run` for a lattice.

use super::run::Run;
use super::run_writer::{Headers, ROWS, RunWriter};
use crate::failure::Failure;
use crate::output::{Directory, Written, json, print, print_json, short};
use crate::plot;
use herglotz::LatticeScene;
use herglotz::runtime::{Outcome, Status};

impl Run {
    /// Runs a scene of a lattice by sparse integrators.
    pub(super) fn run_lattice(&self, scene: &LatticeScene) -> Result<(), Failure> {
        self.refuse_resume("a lattice of many sites")?;
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        let headers = Headers { rows: scene.columns(), events: None };
        let mut writer = RunWriter::new(&directory, &headers, None, !self.json)?;
        writer.kept = self.plot.then(Vec::new);
        let outcome = scene.system.run(&scene.motion, &mut writer);
        writer.end_progress();
        let outcome = outcome.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let written = writer.finish(&directory, outcome.steps)?;
        let mut files = Written::default();
        files.push(directory.file(ROWS));
        for (name, figure) in written.kept.iter().flat_map(|rows| plot::of_lattice(scene, rows)) {
            files.push(directory.write(&name, &figure)?);
        }
        self.tell_lattice(scene, &outcome, (written.rows, &files))
    }

    /// Prints the final state.
    fn tell_lattice(
        &self,
        scene: &LatticeScene,
        outcome: &Outcome,
        (rows, files): (usize, &Written),
    ) -> Result<(), Failure> {
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
                "files": files.paths(),
                "end": { "t": json(*t), "z": json(z) },
            }))?;
        } else {
            let sites: usize = scene.sizes.iter().product();
            print(&format!(
                "{status}: {steps} steps of {sites} sites by {integrator}\n{rows} rows; the final state:\n  t = {}\n  \
                 z = {}\n{}",
                short(*t),
                short(z),
                files.line()
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
