//! `herglotz compare`.

use super::run_writer::progress_bar;
use super::scene_arguments::SceneArguments;
use crate::failure::Failure;
use crate::output::{Directory, Table, exact, json, print, print_json, short};
use crate::peer::Dop853;
use crate::plot;
use clap::Args;
use herglotz::runtime::{Comparison, Work};
use std::path::PathBuf;

/// The errors for which the best integrator is reported: from a figure's to nearly round-off.
const ERRORS: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];

#[derive(Args)]
pub(crate) struct Compare {
    #[command(flatten)]
    scene: SceneArguments,
    /// The directory of compare.csv and compare.svg; by default one with the name of the scene.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the best integrators as JSON.
    #[arg(long)]
    json: bool,
}

impl Compare {
    pub fn run(&self) -> Result<(), Failure> {
        let scene = self.scene.read()?;
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        let bar = progress_bar(!self.json);
        let compared = scene.system.compare(&scene.bare_motion(), &[&Dop853], &mut |part| {
            bar.set_position((part * 1000.0) as u64);
            true
        });
        bar.finish_and_clear();
        let comparison = compared.map_err(|error| self.scene.explain(scene.explain(&error)))?;
        directory.create()?;
        let header = ["integrator", "order", "step_size", "steps", "evaluations", "error", "seconds"];
        let mut csv = Table::new(directory.file("compare.csv"), header)?;
        for Work { integrator, order, step_size, steps, evaluations, error, seconds } in
            comparison.rows.iter().chain(&comparison.peers)
        {
            let counts = [order.to_string(), exact(*step_size), steps.to_string(), evaluations.to_string()];
            csv.record([integrator.clone()].into_iter().chain(counts).chain([exact(*error), exact(*seconds)]))?;
        }
        csv.finish()?;
        if let Some(figure) = plot::of_comparison(&comparison) {
            directory.write("compare.svg", &figure)?;
        }
        if self.json { print_json(&of_json(&comparison)) } else { print(&in_words(&comparison)) }
    }
}

fn of_json(comparison: &Comparison) -> serde_json::Value {
    let of = |error: f64, work: Option<&Work>| {
        let work = work?;
        Some(serde_json::json!({
            "error": error,
            "integrator": work.integrator,
            "step_size": work.step_size,
            "seconds": json(work.seconds),
        }))
    };
    let left_out = comparison.left_out.iter().map(|(name, why)| serde_json::json!({ "integrator": name, "why": why }));
    serde_json::json!({
        "reference": comparison.reference,
        "best": ERRORS.map(|error| of(error, comparison.best(error))),
        "best_of_peers": ERRORS.map(|error| of(error, comparison.best_of_peers(error))),
        "left_out": left_out.collect::<Vec<_>>(),
    })
}

fn in_words(comparison: &Comparison) -> String {
    let best = |error: f64| match comparison.best(error) {
        Some(work) => {
            format!("{error:.0e}: {} with h = {} in {:.2e} s", work.integrator, short(work.step_size), work.seconds)
        }
        None => format!("{error:.0e}: none"),
    };
    let mut lines = vec![format!("reference: {}", comparison.reference)];
    // Integrators with the same reason share a line.
    for same in comparison.left_out.chunk_by(|a, b| a.1 == b.1) {
        let names: Vec<&str> = same.iter().map(|(name, _)| name.as_str()).collect();
        let why = same.first().map_or("", |(_, why)| why);
        lines.push(format!("not applicable: {}: {why}", names.join(", ")));
    }
    lines.push(format!("fastest integrator for an error of {}", ERRORS.map(best).join("; ")));
    // Peers have variable steps, so only their number is given.
    let of_peer = |error: f64| match comparison.best_of_peers(error) {
        Some(work) => format!("{error:.0e}: {} with {} steps in {:.2e} s", work.integrator, work.steps, work.seconds),
        None => format!("{error:.0e}: none"),
    };
    lines.push(format!("fastest method of another library for an error of {}", ERRORS.map(of_peer).join("; ")));
    lines.join("\n")
}
