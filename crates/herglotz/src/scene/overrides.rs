//! Overrides of single values of a scene.

use super::SceneError;
use super::file::{File, RunTable};
use super::location::{Location, Named, Numbers};
use crate::runtime::CatalogueEntry;

/// The source that errors of overrides name.
pub(super) const SOURCE: &str = "--set";

/// The names of the values of the run.
pub(super) const OF_RUN: [&str; 5] = ["run.time", "run.accuracy", "run.step", "run.steps", "run.integrator"];

/// Overrides a value: `gamma=-0.2` for a parameter, `start.x=1`, `run.time=10`, `run.accuracy=1e-6`, `run.step=0.1`,
/// `run.steps=100`, `run.integrator=gauss_8`. An accuracy and steps exclude each other, so setting one removes the
/// other.
pub(crate) fn apply(file: &mut File, entry: Option<&CatalogueEntry>, text: &str) -> Result<(), SceneError> {
    let pair = text.split_once('=').map(|(name, value)| (name.trim(), value.trim()));
    if let Some((name, value)) = pair.filter(|(name, _)| OF_RUN.contains(name)) {
        return apply_to_run(&mut file.run, name, value, text);
    }
    let (name, value) = number(pair, text)?;
    match name.strip_prefix("start.") {
        Some(of_start) => {
            let at = file.system.span();
            let start = file.start.get_or_insert(Location::new(Named::default(), at));
            let at = start.get(of_start).map_or(start.span(), Location::span);
            start.set(of_start, Location::new(Numbers::One(value), at));
        }
        None => {
            let own = file.system.parameters.0.iter().map(|(name, _)| name.as_str());
            let of_entry = entry.map(|entry| entry.parameters).unwrap_or_default().iter().map(|(name, _)| *name);
            let known: Vec<String> = own.chain(of_entry).map(str::to_owned).collect();
            if !known.iter().any(|parameter| parameter == name) {
                let known = known.iter().map(String::as_str);
                let all = known.clone().chain(["start.NAME"]).chain(OF_RUN);
                let message = format!(
                    "unknown name `{name}`; the names that can be set are {}",
                    all.collect::<Vec<_>>().join(", ")
                );
                let near = known.chain(OF_RUN);
                return Err(SceneError::unknown(text, (0, name.len()), name, near, message).in_file(SOURCE));
            }
            let at = file.system.parameters.get(name).map_or(file.system.span(), Location::span);
            file.system.parameters.set(name, Location::new(value, at));
        }
    }
    Ok(())
}

/// The name and the finite number of an override.
fn number<'t>(pair: Option<(&'t str, &str)>, text: &str) -> Result<(&'t str, f64), SceneError> {
    let parsed = pair.and_then(|(name, value)| Some((name, value.parse::<f64>().ok()?)));
    parsed.filter(|(_, value)| value.is_finite()).ok_or_else(|| {
        let message = "an override must be a name, `=` and a finite number, as in gamma=-0.2";
        SceneError::at(text, (0, text.len()), message).in_file(SOURCE)
    })
}

/// Overrides one of the values [`OF_RUN`].
pub(super) fn apply_to_run(
    run: &mut Location<RunTable>,
    name: &str,
    value: &str,
    text: &str,
) -> Result<(), SceneError> {
    let at_run = run.span();
    if name == "run.integrator" {
        let at = run.integrator.as_ref().map_or(at_run, Location::span);
        run.integrator = Some(Location::new(value.trim_matches('"').to_owned(), at));
        return Ok(());
    }
    let (name, value) = number(Some((name, value)), text)?;
    // Later errors of the value are reported at the position of the value in the file.
    let put = |place: &mut Option<Location<f64>>| {
        *place = Some(Location::new(value, place.as_ref().map_or(at_run, Location::span)));
    };
    match name {
        "run.time" => put(&mut run.time),
        "run.accuracy" => {
            (run.step, run.steps) = (None, None);
            put(&mut run.accuracy);
        }
        "run.step" => {
            (run.accuracy, run.steps) = (None, None);
            put(&mut run.step);
        }
        _ => {
            if value.fract() != 0.0 || !(0.0..=2f64.powi(53)).contains(&value) {
                let message = "`run.steps` must be a whole number, as in run.steps=100";
                return Err(SceneError::at(text, (0, text.len()), message).in_file(SOURCE));
            }
            let at = run.steps.as_ref().map_or(at_run, Location::span);
            (run.accuracy, run.step, run.steps) = (None, None, Some(Location::new(value as usize, at)));
        }
    }
    Ok(())
}
