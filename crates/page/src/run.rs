//! A motion.

use crate::numbers::named;
use crate::recorder::Recorder;
use crate::request::{By, Deadline, Request, answer, at, of_motion, refusal};
use crate::runge_kutta;
use herglotz::runtime::{
    Body, BodyMotion, Column, Crossing, GroupStatus, Motion, Plan, SiteMotion, Status, StepControl, Steps,
};
use herglotz::{AnyScene, BodyScene, LatticeScene, Scene};
use serde_json::{Value, json};

/// The motion of a scene. Rows are passed to the host; the answer has the names of their columns, the plan, the events, and the
/// state at the end.
pub fn run(request: &str) -> Value {
    answer(request, |request| match request.any()? {
        AnyScene::Motion(scene) if request.by == By::RungeKutta => runge_kutta::run(&scene, request.evaluations),
        AnyScene::Motion(scene) => of_formula(&scene, request),
        AnyScene::Body(scene) => of_body(&scene),
        AnyScene::Lattice(scene) => of_lattice(&scene),
        AnyScene::Path(_) => Err(refusal(
            "a path between two positions is found by the program, and by hz.solve; give a motion from a start",
        )),
    })
}

/// The columns of the rows of a scene with a formula: the state, the energy, the logarithm of the conformal factor and the momenta of
/// symmetries, which figures show, and those of the scene.
pub fn columns(scene: &Scene) -> Vec<(String, Column)> {
    let formula = scene.system.formula();
    let mut all = Column::state(formula);
    let parsed = |name: &String| Some((name.clone(), Column::parse(name, formula).ok()?));
    let momenta = formula.momenta();
    let is_missing = |name: &String, all: &[(String, Column)]| all.iter().all(|(known, _)| known != name);
    let derived = ["energy", "log_factor"].map(str::to_owned);
    for name in momenta.iter().chain(&derived).chain(&scene.momenta()) {
        if is_missing(name, &all) {
            all.extend(parsed(name));
        }
    }
    for (name, column) in &scene.columns {
        if is_missing(name, &all) {
            all.push((name.clone(), column.clone()));
        }
    }
    all
}

/// The steps that a plan determined.
pub fn planned(plan: &Plan) -> Option<StepControl> {
    let by = plan.by()?;
    (!plan.integrator.in_transformed_time).then_some(StepControl::Steps { by, steps: Steps::Count(plan.steps) })
}

fn of_formula(scene: &Scene, request: &Request) -> Result<Value, Value> {
    let (deadline, columns) = (Deadline::new(), columns(scene));
    let motion = Motion { interrupt: Some(deadline.interrupt()), ..scene.motion() };
    let given = request.steps.as_ref().and_then(|(name, count)| Some((name.parse().ok()?, *count)));
    // While a slider moves, the steps are those of the motion before.
    let motion = match given {
        Some((by, count)) => Motion { step_control: StepControl::Steps { by, steps: Steps::Count(count) }, ..motion },
        None => motion,
    };
    let plan = scene.system.plan(&motion).map_err(of_motion(scene))?;
    let motion = Motion {
        step_control: planned(&plan).unwrap_or(motion.step_control),
        columns: columns.iter().map(|(_, column)| column.clone()).collect(),
        ..motion
    };
    let of_event = |crossing: &Crossing| scene.numbers_of_event(crossing);
    let mut recorder = Recorder::new(deadline, &of_event);
    let outcome = scene.system.run(&motion, &mut recorder);
    recorder.finish();
    let outcome = outcome.map_err(of_motion(scene))?;
    let cause = match &outcome.status {
        Status::Failed { cause, .. } => scene.accumulation(cause),
        _ => None,
    };
    let status = cause.unwrap_or_else(|| outcome.status.to_string());
    let is_right = matches!(outcome.status, Status::Completed | Status::Stopped { .. });
    let mut answer = result(&recorder, (&status, is_right), outcome.t);
    let more = json!({
        "columns": columns.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        "of_events": scene.columns_of_events(),
        "plan": of_plan(&plan),
        "steps": outcome.steps,
        "evaluations": outcome.evaluations,
        "unresolved": outcome.unresolved.map(|unresolved| unresolved.to_string()),
    });
    merge(&mut answer, more);
    Ok(answer)
}

fn of_body(scene: &BodyScene) -> Result<Value, Value> {
    let deadline = Deadline::new();
    let explain = |error| at(&scene.explain(&error));
    let motion = BodyMotion { interrupt: Some(deadline.interrupt()), ..scene.motion.clone() };
    let plan = scene.body.plan(&motion).map_err(explain)?;
    let motion = BodyMotion { step_control: planned(&plan).unwrap_or(motion.step_control), ..motion };
    let of_event = |crossing: &Crossing| crossing.columns.iter().map(|x| Some(*x)).collect();
    let mut recorder = Recorder::new(deadline, &of_event);
    let outcome = scene.body.run(&motion, &mut recorder);
    recorder.finish();
    let outcome = outcome.map_err(explain)?;
    let status = match outcome.status {
        GroupStatus::Event { event, t } => {
            let name = scene.events.get(event).map_or("", String::as_str);
            format!("stopped by the event {name} at t = {t}")
        }
        status => status.to_string(),
    };
    let is_right = !matches!(outcome.status, GroupStatus::Failed { .. });
    let mut answer = result(&recorder, (&status, is_right), outcome.t);
    let more = json!({
        "columns": Body::COLUMNS,
        "of_events": Body::COLUMNS,
        "plan": of_plan(&plan),
        "steps": outcome.steps,
        "gamma": scene.body.gamma,
    });
    merge(&mut answer, more);
    Ok(answer)
}

fn of_lattice(scene: &LatticeScene) -> Result<Value, Value> {
    let of_event = |_: &Crossing| Vec::new();
    let mut recorder = Recorder::new(Deadline::new(), &of_event);
    // The figures show all sites.
    let motion = SiteMotion { columns: None, conformal_factor: false, ..scene.motion.clone() };
    let outcome = scene.system.run(&motion, &mut recorder);
    recorder.finish();
    let outcome = outcome.map_err(|error| at(&scene.explain(&error)))?;
    let is_right = matches!(outcome.status, Status::Completed | Status::Stopped { .. });
    let mut answer = result(&recorder, (&outcome.status.to_string(), is_right), outcome.t);
    let more = json!({
        "columns": scene.columns_of_state(),
        "plan": { "text": scene.plan().unwrap_or_default(), "integrator": scene.motion.by.to_string() },
        "of_events": [],
        "steps": outcome.steps,
        "evaluations": outcome.evaluations,
    });
    merge(&mut answer, more);
    Ok(answer)
}

/// What the answers of all motions have.
fn result(recorder: &Recorder<'_>, (status, is_right): (&str, bool), t: f64) -> Value {
    let Recorder { rows, events, count, is_over, .. } = recorder;
    let status =
        if *is_over { format!("ended after 10 s at t = {t}; the rest is left out") } else { status.to_owned() };
    json!({ "status": status, "is_right": is_right, "is_over": is_over, "rows": rows, "events": events, "event_count": count, "end": named([("t", t)]) })
}

fn of_plan(plan: &Plan) -> Value {
    json!({
        "text": plan.text,
        "integrator": plan.integrator.name,
        "by": plan.by().map(|by| by.to_string()),
        "step_size": plan.step_size,
        "steps": plan.steps,
        "error": plan.error,
    })
}

fn merge(into: &mut Value, from: Value) {
    if let (Value::Object(into), Value::Object(from)) = (into, from) {
        into.extend(from);
    }
}
