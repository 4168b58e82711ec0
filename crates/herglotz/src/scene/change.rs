//! Changes of single values of a scene from outside.

use super::SceneError;
use super::at::{At, Named, Numbers};
use super::file::File;
use runtime_herglotz::CatalogueEntry;

/// Where errors of changes are.
const SOURCE: &str = "--set";

/// Changes a value: `gamma=-0.2` of a parameter, `start.x=1`, `run.time=10`, `run.accuracy=1e-6`, `run.step=0.1`.
pub(crate) fn apply(file: &mut File, entry: Option<&CatalogueEntry>, text: &str) -> Result<(), SceneError> {
    let parsed = text.split_once('=').and_then(|(name, value)| Some((name.trim(), value.trim().parse::<f64>().ok()?)));
    let Some((name, value)) = parsed.filter(|(_, value)| value.is_finite()) else {
        let message = "a change is a name, `=` and a finite number, as in gamma=-0.2";
        return Err(SceneError::at(text, (0, text.len()), message).in_file(SOURCE));
    };
    // What is wrong with the value later is shown where that of the file is.
    let put = |place: &mut Option<At<f64>>, at| {
        *place = Some(At::new(value, place.as_ref().map_or(at, At::span)));
    };
    let at_run = file.run.span();
    match name {
        "run.time" => *file.run.time = value,
        "run.accuracy" => put(&mut file.run.accuracy, at_run),
        "run.step" => put(&mut file.run.step, at_run),
        _ => match name.strip_prefix("start.") {
            Some(of_start) => {
                let at = file.system.span();
                let start = file.start.get_or_insert(At::new(Named::default(), at));
                let at = start.get(of_start).map_or(start.span(), At::span);
                start.set(of_start, At::new(Numbers::One(value), at));
            }
            None => {
                let own = file.system.parameters.0.iter().map(|(name, _)| name.as_str());
                let of_entry = entry.map(|entry| entry.parameters).unwrap_or_default().iter().map(|(name, _)| *name);
                let known: Vec<String> = own.chain(of_entry).map(str::to_owned).collect();
                if !known.iter().any(|parameter| parameter == name) {
                    let known = known.iter().map(String::as_str);
                    let all = known.clone().chain(["start.NAME", "run.time", "run.accuracy", "run.step"]);
                    let message = format!(
                        "there is no `{name}` that can be set; there are {}",
                        all.collect::<Vec<_>>().join(", ")
                    );
                    return Err(SceneError::unknown(text, (0, name.len()), name, known, message).in_file(SOURCE));
                }
                let at = file.system.parameters.get(name).map_or(file.system.span(), At::span);
                file.system.parameters.set(name, At::new(value, at));
            }
        },
    }
    Ok(())
}
