//! Overrides of single values of a scene with a rigid body.

use super::SceneError;
use super::body_quantity::BodyQuantity;
use super::body_table::{BodyTable, InertiaTable};
use super::file::File;
use super::location::{Location, Named, Numbers};
use super::overrides::{self, OF_RUN, SOURCE};

/// The names of the vectors that are set as a whole.
const VECTORS: [&str; 5] = ["inertia", "centre", "gravity", "start.attitude", "start.omega"];

/// Overrides a value: a number such as `gamma=-0.2`, `inertia1=0.5` or `start.omega3=10`, a vector such as
/// `start.omega=[0.0, 0.0, 10.0]`, or a value of the run.
pub(super) fn apply(file: &mut File, text: &str) -> Result<(), SceneError> {
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
            Some(quaternion @ [_, _, _, _]) if name == "start.attitude" => {
                put_in_start(file, "attitude", quaternion);
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

/// Sets a vector of the start.
fn put_in_start(file: &mut File, name: &str, values: &[f64]) {
    let at_system = file.system.span();
    let start = file.start.get_or_insert(Location::new(Named::default(), at_system));
    let at = start.get(name).map_or(start.span(), Location::span);
    start.set(name, Location::new(Numbers::Many(values.iter().map(|x| Location::new(*x, at)).collect()), at));
}

fn put_vector(file: &mut File, name: &str, value: [f64; 3]) {
    if name == "start.omega" {
        return put_in_start(file, "omega", &value);
    }
    let Some(body) = &mut file.system.body else { return };
    let at = body.span();
    match name {
        "inertia" => *body.inertia = InertiaTable::Principal(value),
        "centre" => put(&mut body.centre, value, at),
        _ => put(&mut body.gravity, value, at),
    }
}

fn put_number(file: &mut File, quantity: BodyQuantity, value: f64) {
    match quantity {
        BodyQuantity::Omega(i) => {
            let given = file.start.as_ref().and_then(|start| start.get("omega"));
            let mut omega = match given.map(|given| &**given) {
                Some(Numbers::Many(list)) => list.iter().map(|x| **x).collect(),
                _ => vec![0.0; 3],
            };
            if let Some(entry) = omega.get_mut(i) {
                *entry = value;
            }
            put_in_start(file, "omega", &omega);
        }
        BodyQuantity::Action => put_number_in_start(file, "z", value),
        BodyQuantity::Time => put_number_in_start(file, "t", value),
        _ => {
            if let Some(body) = &mut file.system.body {
                put_in_body(body, quantity, value);
            }
        }
    }
}

fn put_number_in_start(file: &mut File, name: &str, value: f64) {
    let at_system = file.system.span();
    let start = file.start.get_or_insert(Location::new(Named::default(), at_system));
    let at = start.get(name).map_or(start.span(), Location::span);
    start.set(name, Location::new(Numbers::One(value), at));
}

fn put_in_body(body: &mut Location<BodyTable>, quantity: BodyQuantity, value: f64) {
    let at = body.span();
    match quantity {
        BodyQuantity::Inertia(i) => {
            let entry = match &mut *body.inertia {
                InertiaTable::Principal(moments) => moments.get_mut(i),
                InertiaTable::Matrix(rows) => rows.get_mut(i).and_then(|row| row.get_mut(i)),
            };
            if let Some(entry) = entry {
                *entry = value;
            }
        }
        BodyQuantity::Mass => put(&mut body.mass, value, at),
        BodyQuantity::Centre(i) => put_entry(&mut body.centre, i, value, at),
        BodyQuantity::Gravity(i) => put_entry(&mut body.gravity, i, value, at),
        BodyQuantity::Gamma => put(&mut body.gamma, value, at),
        // Those of the start.
        BodyQuantity::Omega(_) | BodyQuantity::Action | BodyQuantity::Time => {}
    }
}
