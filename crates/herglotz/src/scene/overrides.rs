//! Overrides of single values of a scene.

use super::SceneError;
use super::file::File;
use super::location::{Location, Named, Numbers};
use crate::runtime::CatalogueEntry;

/// The source that errors of overrides name.
const SOURCE: &str = "--set";

/// The names of the values of the run.
const OF_RUN: [&str; 5] = ["run.time", "run.accuracy", "run.step", "run.steps", "run.integrator"];

/// Overrides a value: `gamma=-0.2` for a parameter, `start.x=1`, `run.time=10`, `run.accuracy=1e-6`, `run.step=0.1`,
/// `run.steps=100`, `run.integrator=gauss_8`. An accuracy and steps exclude each other, so setting one removes the
/// other.
pub(crate) fn apply(file: &mut File, entry: Option<&CatalogueEntry>, text: &str) -> Result<(), SceneError> {
    let refuse = |message: &str| Err(SceneError::at(text, (0, text.len()), message).in_file(SOURCE));
    let at_run = file.run.span();
    let pair = text.split_once('=').map(|(name, value)| (name.trim(), value.trim()));
    if let Some(("run.integrator", name)) = pair {
        let at = file.run.integrator.as_ref().map_or(at_run, Location::span);
        file.run.integrator = Some(Location::new(name.trim_matches('"').to_owned(), at));
        return Ok(());
    }
    let parsed = pair.and_then(|(name, value)| Some((name, value.parse::<f64>().ok()?)));
    let Some((name, value)) = parsed.filter(|(_, value)| value.is_finite()) else {
        return refuse("an override must be a name, `=` and a finite number, as in gamma=-0.2");
    };
    // Later errors of the value are reported at the position of the value in the file.
    let put = |place: &mut Option<Location<f64>>, at| {
        *place = Some(Location::new(value, place.as_ref().map_or(at, Location::span)));
    };
    let run = &mut *file.run;
    match name {
        "run.time" => *run.time = value,
        "run.accuracy" => {
            (run.step, run.steps) = (None, None);
            put(&mut run.accuracy, at_run);
        }
        "run.step" => {
            (run.accuracy, run.steps) = (None, None);
            put(&mut run.step, at_run);
        }
        "run.steps" => {
            if value.fract() != 0.0 || !(0.0..=2f64.powi(53)).contains(&value) {
                return refuse("`run.steps` must be a whole number, as in run.steps=100");
            }
            let at = run.steps.as_ref().map_or(at_run, Location::span);
            (run.accuracy, run.step, run.steps) = (None, None, Some(Location::new(value as usize, at)));
        }
        _ => match name.strip_prefix("start.") {
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
        },
    }
    Ok(())
}
