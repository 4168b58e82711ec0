//! `herglotz run` for a path between ends.

use super::run::Run;
use super::run_writer::ROWS;
use crate::failure::Failure;
use crate::output::{Directory, Table, Written, json, print, print_json, short};
use crate::plot;
use herglotz::EndsScene;
use herglotz::runtime::FoundPath;

impl Run {
    /// Finds the path of a scene with `[ends]`.
    pub(super) fn run_path(&self, scene: &EndsScene) -> Result<(), Failure> {
        self.refuse_resume("a path between two ends")?;
        let searched = scene.system.path(&scene.problem);
        let found = searched.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        let rows = rows(scene.system.dimension(), &found);
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        directory.create()?;
        let mut table = Table::new(directory.file(ROWS), scene.columns.iter().map(|(name, _)| name.as_str()))?;
        rows.iter().try_for_each(|row| table.numbers(row))?;
        table.finish()?;
        let mut files = Written::default();
        files.push(directory.file(ROWS));
        if self.plot {
            for (name, figure) in plot::of_path(scene, &rows) {
                files.push(directory.write(&name, &figure)?);
            }
        }
        self.tell_path(scene, &found, &files)
    }

    /// Prints how the search ended, and the quality of the path.
    fn tell_path(&self, scene: &EndsScene, found: &FoundPath, files: &Written) -> Result<(), Failure> {
        let FoundPath { residual, log_factor, regularity, iterations, .. } = found;
        let (by, steps) = (scene.problem.by, scene.problem.steps);
        let (t0, t1) = scene.problem.span;
        let step_size = (t1 - t0) / steps as f64;
        let n = scene.system.dimension();
        let at_start = |of: &[f64]| of.get(..n).unwrap_or_default().to_vec();
        // The velocity and the momentum with which the motion starts.
        let start = [at_start(&found.v), at_start(&found.p)].concat();
        let columns = scene.columns.iter().map(|(name, _)| name.as_str());
        let start: Vec<(&str, f64)> = columns.skip(1 + n).zip(start).collect();
        if self.json {
            let start: serde_json::Map<_, _> = start.iter().map(|(name, x)| ((*name).to_owned(), json(*x))).collect();
            print_json(&serde_json::json!({
                "status": found.status.to_string(),
                "unresolved": found.unresolved.map(|unresolved| unresolved.to_string()),
                "integrator": by.to_string(),
                "step_size": step_size,
                "steps": steps,
                "iterations": iterations,
                "estimated_error": found.error_estimate,
                "regularity": json(*regularity),
                "residual": json(*residual),
                "log_factor": json(*log_factor),
                "action": json(found.action()),
                "rows": steps + 1,
                "files": files.paths(),
                "start": start,
            }))?;
        } else {
            let status = if found.is_found() { "found" } else { "not found" };
            let error = match found.error_estimate {
                Some(error) => format!("the estimated truncation error is {error:.1e} of the range of the path"),
                None if found.is_found() => {
                    "this integrator gives no estimate of the truncation error; midpoint and other rules of order 2 \
                     give one"
                        .to_owned()
                }
                None => "this is the last path of the search".to_owned(),
            };
            let mut lines = vec![
                format!(
                    "{status}: a path of {steps} steps of {} by {by}, in {iterations} iterations",
                    short(step_size)
                ),
                format!("{error}; the regularity of its ends is {regularity:.1e}"),
                format!("{} rows; the start of the path:", steps + 1),
            ];
            lines.extend(start.iter().map(|(name, x)| format!("  {name} = {}", short(*x))));
            lines.push(format!(
                "the whole path:\n  action = {}\n  log_factor = {}",
                short(found.action()),
                short(*log_factor)
            ));
            lines.push(files.line());
            print(&lines.join("\n"))?;
        }
        if let Some(unresolved) = found.unresolved {
            eprintln!("warning: {unresolved}");
        }
        if found.is_found() { Ok(()) } else { Err(Failure::Run(found.status.to_string())) }
    }
}

/// The points of a path as rows: time, coordinates, velocities, momenta and action.
fn rows(n: usize, found: &FoundPath) -> Vec<Vec<f64>> {
    let of = |(k, t): (usize, &f64)| {
        let vectors = [&found.q, &found.v, &found.p].into_iter();
        let state = vectors.flat_map(|all| all.get(k * n..(k + 1) * n).unwrap_or_default()).copied();
        [*t].into_iter().chain(state).chain(found.z.get(k).copied()).collect()
    };
    found.t.iter().enumerate().map(of).collect()
}
