//! `herglotz fit`.

use super::run_writer::interrupt_flag;
use super::scene_arguments::SceneArguments;
use crate::failure::Failure;
use crate::output::{Directory, Table, Written, exact, json, print, print_json, short, table};
use crate::plot_fit;
use clap::Args;
use herglotz::Scene;
use herglotz::runtime::{Bound, Column, FittedMotion, Motion, OutputTimes, RunMonitor, RuntimeError};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The number of points of the fitted motion in a figure: more are not visible.
const DRAWN: usize = 1000;

#[derive(Args)]
pub(crate) struct Fit {
    #[command(flatten)]
    scene: SceneArguments,
    /// The directory of fit.csv and residuals.csv; by default one with the name of the scene.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Draw the data with the fitted motion in fit.svg, and the residuals in residuals.svg.
    #[arg(long)]
    plot: bool,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Ends a fit at an interrupt.
struct Interruptible(Arc<AtomicBool>);

impl RunMonitor for Interruptible {
    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl Fit {
    pub fn run(&self) -> Result<(), Failure> {
        let scene = self.scene.read()?;
        let Some(request) = scene.motion_fit() else {
            return Err(Failure::Input(format!(
                "{}: the scene has no data; add [fit], as in csv = \"data.csv\" and unknowns = [\"gamma\", \"start.x\"]",
                self.scene.file.display()
            )));
        };
        let explain = |error: RuntimeError| -> Failure { self.scene.explain(scene.explain(&error)) };
        let stop = interrupt_flag();
        let found = scene.system.fit(&request, &mut Interruptible(stop.clone()));
        if stop.load(Ordering::Relaxed) {
            return Err(Failure::Run("interrupted".to_owned()));
        }
        let fitted = found.map_err(explain)?;
        let directory = Directory::new(self.out.clone(), &self.scene.file);
        directory.create()?;
        write_unknowns(&fitted, &directory)?;
        write_residuals(&fitted, &directory)?;
        let mut files = Written::default();
        ["fit.csv", "residuals.csv"].into_iter().for_each(|name| files.push(directory.file(name)));
        if self.plot {
            let rows = drawn_rows(&scene, &fitted).map_err(explain)?;
            files.push(directory.write("fit.svg", &plot_fit::of_fit(&fitted, &rows))?);
            files.push(directory.write("residuals.svg", &plot_fit::of_residuals(&fitted))?);
        }
        if self.json {
            print_json(&of_json(&fitted))?
        } else {
            print(&format!("{}\n{}", summary(&fitted), files.line()))?
        }
        let status = &fitted.fit.status;
        if status.is_converged() { Ok(()) } else { Err(Failure::Run(status.to_string())) }
    }
}

/// The bound at which an unknown is held.
fn bound(of: Option<Bound>) -> &'static str {
    match of {
        None => "",
        Some(Bound::Lower) => "lower",
        Some(Bound::Upper) => "upper",
        Some(Bound::Fixed) => "fixed",
    }
}

/// The correlations of an unknown with all of them, where they are known.
fn correlations(fitted: &FittedMotion, i: usize) -> Vec<Option<f64>> {
    let all = fitted.fit.correlation();
    (0..fitted.fit.names.len()).map(|j| all.as_ref().map(|all| all[(i, j)])).collect()
}

/// Writes fit.csv: an unknown in each row.
fn write_unknowns(fitted: &FittedMotion, directory: &Directory) -> Result<(), Failure> {
    let fit = &fitted.fit;
    let of_names: Vec<String> = fit.names.iter().map(|name| format!("correlation with {name}")).collect();
    let header = ["unknown", "value", "standard_error", "bound"].into_iter().chain(of_names.iter().map(String::as_str));
    let mut csv = Table::new(directory.file("fit.csv"), header)?;
    let number = |x: Option<f64>| x.map(exact).unwrap_or_default();
    for (i, (name, error)) in fit.names.iter().zip(fit.standard_errors()).enumerate() {
        let own = [name.clone(), exact(fit.parameters[i]), number(error), bound(fit.at_bounds[i]).to_owned()];
        csv.record(own.into_iter().chain(correlations(fitted, i).into_iter().map(number)))?;
    }
    csv.finish()?;
    Ok(())
}

/// Writes residuals.csv: a measured value in each row.
fn write_residuals(fitted: &FittedMotion, directory: &Directory) -> Result<(), Failure> {
    let mut csv = Table::new(directory.file("residuals.csv"), ["quantity", "t", "measured", "fitted", "residual"])?;
    for series in &fitted.series {
        let numbers = series.times.iter().zip(&series.values).zip(&series.fitted).zip(&series.residuals);
        for (((t, measured), of_motion), residual) in numbers {
            let numbers = [t, measured, of_motion, residual].map(|x| exact(*x));
            csv.record([series.quantity.clone()].into_iter().chain(numbers))?;
        }
    }
    csv.finish()?;
    Ok(())
}

/// The quantities of the fitted motion at equal times.
fn drawn_rows(scene: &Scene, fitted: &FittedMotion) -> Result<Vec<Vec<f64>>, RuntimeError> {
    let parameters: Vec<(&str, f64)> = fitted.parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let system = scene.system.with_parameters(&parameters)?;
    let (t0, end) = (fitted.motion.start.t, fitted.motion.end);
    let quantities = fitted.series.iter().map(|series| Column::parse(&series.quantity, system.formula()));
    let columns = [Ok(Column::Time)].into_iter().chain(quantities).collect::<Result<Vec<_>, _>>()?;
    let times = (0..=DRAWN).map(|k| if k == DRAWN { end } else { t0 + (end - t0) * k as f64 / DRAWN as f64 });
    let motion = Motion { rows: Some(OutputTimes::At(times.collect())), columns, ..fitted.motion.clone() };
    Ok(system.record(&motion)?.1)
}

fn of_json(fitted: &FittedMotion) -> serde_json::Value {
    let fit = &fitted.fit;
    let number = |x: Option<f64>| x.map(json);
    let unknown = |(i, error): (usize, Option<f64>)| {
        serde_json::json!({
            "name": fit.names[i],
            "value": json(fit.parameters[i]),
            "standard_error": number(error),
            "at_bound": fit.at_bounds[i].map(|of| bound(Some(of))),
            "correlations": correlations(fitted, i).into_iter().map(number).collect::<Vec<_>>(),
        })
    };
    serde_json::json!({
        "status": fit.status.to_string(),
        "converged": fit.status.is_converged(),
        "unknowns": fit.standard_errors().into_iter().enumerate().map(unknown).collect::<Vec<_>>(),
        "cost": json(fit.cost),
        "residual_norm": json(fit.residuals.norm()),
        "residual_deviation": number(fit.residual_variance.map(f64::sqrt)),
        "values": fit.values.len(),
        "degrees_of_freedom": fit.degrees_of_freedom,
        "rank": fit.rank,
        "iterations": fit.iterations,
        "evaluations": fit.evaluations,
        "largest_defect": number(fitted.largest_defect),
        "starts": fitted.starts.len(),
        "best_start": fitted.best_start,
    })
}

fn summary(fitted: &FittedMotion) -> String {
    let fit = &fitted.fit;
    let has_several = fit.names.len() > 1;
    let header = ["unknown", "value", "standard error"].map(str::to_owned).into_iter();
    let of_names = fit.names.iter().filter(|_| has_several).map(|name| format!("corr. {name}"));
    let mut rows = vec![header.chain(of_names).collect::<Vec<_>>()];
    for (i, (name, error)) in fit.names.iter().zip(fit.standard_errors()).enumerate() {
        let error = match (fit.at_bounds[i], error) {
            (Some(Bound::Fixed), _) => "held fixed".to_owned(),
            (Some(of), _) => format!("at the {} bound", bound(Some(of))),
            (None, Some(error)) => format!("{error:.2e}"),
            (None, None) => "not known".to_owned(),
        };
        let of_others = correlations(fitted, i).into_iter().filter(|_| has_several);
        let of_others = of_others.map(|x| x.map_or_else(String::new, |x| format!("{x:.3}")));
        rows.push([name.clone(), short(fit.parameters[i]), error].into_iter().chain(of_others).collect());
    }
    let mut lines = vec![fit.status.to_string(), table(&rows)];
    lines.push(format!(
        "{} values, {} degrees of freedom; the norm of the residuals is {:.3e}; {}",
        fit.residuals.len(),
        fit.degrees_of_freedom,
        fit.residuals.norm(),
        fit.of_errors()
    ));
    lines.push(format!("{} iterations, {} evaluations", fit.iterations, fit.evaluations));
    if let Some(defect) = fitted.largest_defect {
        lines.push(format!("the pieces of the motion meet to {defect:.1e} of its size"));
    }
    if fitted.starts.len() > 1 {
        let of_start = |(i, found): (usize, &Result<herglotz::runtime::Fit, _>)| {
            let of = match found {
                Ok(fit) => format!("{:.3e}", fit.cost),
                Err(error) => format!("no fit: {error}"),
            };
            let best = if i == fitted.best_start { " (the best)" } else { "" };
            format!("  {}: {of}{best}", i + 1)
        };
        lines.push("the cost from each start:".to_owned());
        lines.extend(fitted.starts.iter().enumerate().map(of_start));
    }
    lines.join("\n")
}
