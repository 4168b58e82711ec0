//! The names, values and symmetries of a scene.

use crate::numbers::{named, number};
use crate::request::{answer, at};
use herglotz::runtime::{AnyIntegrator, Body, InitialVelocity, StepControl, Steps, velocity_name};
use herglotz::{AnyScene, BodyScene, LatticeScene, Property, Scene};
use serde_json::{Value, json};

/// The names, values and symmetries of a scene: what sliders and choices are about.
pub fn describe(request: &str) -> Value {
    answer(request, |request| {
        Ok(match request.any()? {
            AnyScene::Motion(scene) => of_formula(&scene),
            AnyScene::Body(scene) => of_body(&scene).map_err(|error| at(&scene.explain(&error)))?,
            AnyScene::Lattice(scene) => of_lattice(&scene),
            AnyScene::Path(_) => json!({ "kind": "path" }),
        })
    })
}

fn of_formula(scene: &Scene) -> Value {
    let (formula, motion) = (scene.system.formula(), scene.bare_motion());
    let names = formula.coordinates();
    let (momenta, start) = (formula.momenta(), &motion.start);
    let velocities: Vec<String> = names.iter().map(|name| velocity_name(name)).collect();
    let (of_second, second) = match &start.velocity {
        InitialVelocity::Velocity(v) => (&velocities, v),
        InitialVelocity::Momentum(p) | InitialVelocity::MomentumNear { p, .. } => (&momenta, p),
    };
    // Modes of friction and of contact are not given.
    let given = names.iter().take(formula.given_dimension());
    let values = given.zip(&start.q).chain(of_second.iter().take(formula.given_dimension()).zip(second));
    let integrators = AnyIntegrator::all().into_iter().filter(|by| scene.system.check_integrator(*by).is_ok());
    json!({
        "kind": "motion",
        "is_hamiltonian": formula.is_hamiltonian(),
        "coordinates": names,
        "velocities": velocities,
        "momenta": momenta,
        "action": formula.action(),
        "parameters": named(formula.parameters()),
        "start": named(values.map(|(name, x)| (name.clone(), *x)).chain([(formula.action().to_owned(), start.z)])),
        "t": number(start.t),
        "end": number(motion.end),
        "control": control(&motion.step_control),
        "columns": scene.columns.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "events": scene.events.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "properties": properties(scene.properties()),
        "symmetries": scene.momenta(),
        "has_constraints": formula.constraints() > 0,
        "has_resets": formula.resets() > 0,
        "is_forced": !scene.system.losses().is_empty(),
        "integrators": integrators.map(|by| by.to_string()).collect::<Vec<_>>(),
        "warning": scene.gain_of_energy(),
    })
}

fn of_body(scene: &BodyScene) -> Result<Value, herglotz::runtime::RuntimeError> {
    let (body, motion) = (&scene.body, &scene.motion);
    let omega = motion.omega.iter().enumerate().map(|(i, x)| (format!("omega{}", i + 1), *x));
    Ok(json!({
        "kind": "body",
        "parameters": named([("gamma", body.gamma), ("mass", body.mass)]),
        "start": named(omega),
        "t": number(motion.t),
        "end": number(motion.end),
        "control": control(&motion.step_control),
        "columns": scene.columns.iter().map(|k| Body::COLUMNS[*k]).collect::<Vec<_>>(),
        "events": scene.events,
        "properties": properties(scene.properties()),
        "symmetries": body.momenta()?,
    }))
}

fn of_lattice(scene: &LatticeScene) -> Value {
    let motion = &scene.motion;
    json!({
        "kind": "lattice",
        "coordinates": scene.coordinates,
        "sizes": scene.sizes,
        "parameters": {},
        "start": {},
        "t": number(motion.start.t),
        "end": number(motion.end),
        "control": control(&StepControl::Steps { by: motion.by, steps: motion.steps }),
        "columns": [],
        "events": [],
        "properties": [],
        "symmetries": [],
    })
}

/// How a motion is advanced, by the keys of a scene.
fn control(of: &StepControl) -> Value {
    match of {
        StepControl::Accuracy { error, by } => {
            json!({ "accuracy": error, "integrator": by.map(|by| by.to_string()) })
        }
        StepControl::Steps { by, steps: Steps::Size(h) } => json!({ "step": h, "integrator": by.to_string() }),
        StepControl::Steps { by, steps: Steps::Count(count) } => {
            json!({ "steps": count, "integrator": by.to_string() })
        }
    }
}

fn properties(of: Vec<Property>) -> Value {
    let one = |of: Property| json!({ "name": of.name, "is_proved": of.is_proved, "meaning": of.meaning });
    of.into_iter().map(one).collect()
}
