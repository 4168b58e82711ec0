//! Overrides of single values of a scene with a rigid body.

use super::SceneError;
use super::body_file::{BodyFile, InertiaTable};
use super::body_quantity::BodyQuantity;
use super::location::Location;
use super::overrides::{self, OF_RUN, SOURCE};

/// The names of the vectors that are set as a whole.
const VECTORS: [&str; 5] = ["inertia", "centre", "gravity", "start.attitude", "start.omega"];

/// Overrides a value: a number such as `gamma=-0.2`, `inertia1=0.5` or `start.omega3=10`, a vector such as
/// `start.omega=[0.0, 0.0, 10.0]`, or a value of the run.
pub(super) fn apply(file: &mut BodyFile, text: &str) -> Result<(), SceneError> {
    let refuse = |message: String| Err(SceneError::at(text, (0, text.len()), message).in_file(SOURCE));
    let pair = text.split_once('=').map(|(name, value)| (name.trim(), value.trim()));
    let Some((name, value)) = pair else {
        return refuse("an override must be a name, `=` and a value, as in gamma=-0.2".to_owned());
    };
    if OF_RUN.contains(&name) {
        return overrides::apply_to_run(&mut file.run, name, value, text);
    }
    if VECTORS.contains(&name) {
        return match parsed(value).as_deref() {
            Some([a, b, c]) if name != "start.attitude" => {
                put_vector(file, name, [*a, *b, *c]);
                Ok(())
            }
            Some([w, x, y, z]) if name == "start.attitude" => {
                let at = file.start.attitude.as_ref().map_or(file.start.span(), Location::span);
                file.start.attitude = Some(Location::new([*w, *x, *y, *z], at));
                Ok(())
            }
            _ if name == "start.attitude" => {
                refuse(format!("`{name}` must be a list of 4 finite numbers, as in {name}=[1.0, 0.0, 0.0, 0.0]"))
            }
            _ => refuse(format!("`{name}` must be a list of 3 finite numbers, as in {name}=[1.0, 2.0, 3.0]")),
        };
    }
    let Some(quantity) = BodyQuantity::named(name) else {
        let known = || BodyQuantity::ALL.iter().map(|(name, _)| *name).chain(VECTORS).chain(OF_RUN);
        let all = known().collect::<Vec<_>>().join(", ");
        let message = format!("unknown name `{name}`; the names that can be set are {all}");
        return Err(SceneError::unknown(text, (0, name.len()), name, known(), message).in_file(SOURCE));
    };
    let Some(value) = value.parse().ok().filter(|x: &f64| x.is_finite()) else {
        return refuse(format!("`{name}` must be a finite number, as in {name}=0.5"));
    };
    put_number(file, quantity, value);
    Ok(())
}

/// A list of finite numbers.
fn parsed(value: &str) -> Option<Vec<f64>> {
    let entries = value.strip_prefix('[')?.strip_suffix(']')?;
    let number = |entry: &str| entry.trim().parse().ok().filter(|x: &f64| x.is_finite());
    entries.split(',').map(number).collect()
}

/// A value at the position of the old one in the file, where later errors are reported, or at that of its table.
fn put<T>(place: &mut Option<Location<T>>, value: T, at: (usize, usize)) {
    *place = Some(Location::new(value, place.as_ref().map_or(at, Location::span)));
}

/// Sets an entry of a vector that is 0 where it is not given.
fn put_entry(place: &mut Option<Location<[f64; 3]>>, i: usize, value: f64, at: (usize, usize)) {
    let mut vector = place.as_ref().map_or([0.0; 3], |vector| **vector);
    if let Some(entry) = vector.get_mut(i) {
        *entry = value;
    }
    put(place, vector, at);
}

fn put_vector(file: &mut BodyFile, name: &str, value: [f64; 3]) {
    let at = file.body.span();
    match name {
        "inertia" => *file.body.inertia = InertiaTable::Principal(value),
        "centre" => put(&mut file.body.centre, value, at),
        "gravity" => put(&mut file.body.gravity, value, at),
        _ => *file.start.omega = value,
    }
}

fn put_number(file: &mut BodyFile, quantity: BodyQuantity, value: f64) {
    let (of_body, of_start) = (file.body.span(), file.start.span());
    let set = |entry: Option<&mut f64>| {
        if let Some(entry) = entry {
            *entry = value;
        }
    };
    match quantity {
        BodyQuantity::Inertia(i) => set(match &mut *file.body.inertia {
            InertiaTable::Principal(moments) => moments.get_mut(i),
            InertiaTable::Matrix(rows) => rows.get_mut(i).and_then(|row| row.get_mut(i)),
        }),
        BodyQuantity::Mass => put(&mut file.body.mass, value, of_body),
        BodyQuantity::Centre(i) => put_entry(&mut file.body.centre, i, value, of_body),
        BodyQuantity::Gravity(i) => put_entry(&mut file.body.gravity, i, value, of_body),
        BodyQuantity::Gamma => put(&mut file.body.gamma, value, of_body),
        BodyQuantity::Omega(i) => set(file.start.omega.get_mut(i)),
        BodyQuantity::Action => put(&mut file.start.z, value, of_start),
        BodyQuantity::Time => put(&mut file.start.t, value, of_start),
    }
}
