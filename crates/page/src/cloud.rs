//! Many starts on a circle in a plane of position and momentum. A flow of contact transformations multiplies the area within it, the
//! integral of `p dq` over all coordinates, by the conformal factor, where the rate of this is constant.

use crate::host;
use crate::numbers::number;
use crate::request::{By, Deadline, Request, answer, of_motion, refusal};
use crate::run::planned;
use crate::runge_kutta::{EVALUATIONS_PER_STEP, Quantities, RungeKutta};
use herglotz::Scene;
use herglotz::runtime::{Column, InitialVelocity, Motion, OutputTimes, RunMonitor, Start};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::ops::ControlFlow;

/// The maximal number of members, and of times.
const MOST: usize = 1000;

/// The motions of starts on a circle. Positions and momenta in all coordinates are passed to the host, for each member time by time; the
/// answer has the times, and the logarithm of the conformal factor at each of them for the motion of the scene.
pub fn cloud(request: &str) -> Value {
    answer(request, |request| {
        let scene = request.formula("a cloud of starts")?;
        if scene.system.formula().constraints() > 0 {
            return Err(refusal("starts on a circle would violate the constraints"));
        }
        of(&scene, request)
    })
}

/// Keeps the rows of a member.
struct Rows {
    numbers: Vec<f64>,
    deadline: Deadline,
}

impl RunMonitor for Rows {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        self.numbers.extend(numbers);
        ControlFlow::Continue(())
    }

    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        if self.deadline.is_over() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

fn of(scene: &Scene, request: &Request) -> Result<Value, Value> {
    let Request { coordinate, radii, members, times, .. } = *request;
    let formula = scene.system.formula();
    if coordinate >= formula.dimension() || !(1..=MOST).contains(&members) || !(1..=MOST).contains(&times) {
        return Err(refusal("the request has another number of coordinates, members or times"));
    }
    let (deadline, n) = (Deadline::new(), formula.dimension());
    let motion = Motion { interrupt: Some(deadline.interrupt()), ..scene.bare_motion() };
    let plan = scene.system.plan(&motion).map_err(of_motion(scene))?;
    let (t0, span) = (motion.start.t, motion.end - motion.start.t);
    let at: Vec<f64> = (0..=times).map(|k| t0 + span * (k as f64 / times as f64)).collect();
    let motion = Motion {
        step_control: planned(&plan).unwrap_or(motion.step_control),
        rows: Some(OutputTimes::At(at.clone())),
        columns: (0..n).map(Column::Position).chain((0..n).map(Column::Momentum)).collect(),
        ..motion
    };
    let momentum = momentum(scene, &motion.start)?;
    let start = |k: usize| {
        let (sine, cosine) = (TAU * k as f64 / members as f64).sin_cos();
        let (mut q, mut p) = (motion.start.q.clone(), momentum.clone());
        q[coordinate] += radii[0] * cosine;
        p[coordinate] += radii[1] * sine;
        Start { q, velocity: InitialVelocity::Momentum(p), ..motion.start.clone() }
    };
    let mut failed = 0;
    for k in 0..members {
        if deadline.is_over() {
            failed += members - k;
            break;
        }
        let mut rows = match request.by {
            By::Herglotz => {
                let mut rows = Rows { numbers: Vec::new(), deadline };
                let outcome = scene.system.run(&Motion { start: start(k), ..motion.clone() }, &mut rows);
                failed += usize::from(outcome.is_err());
                rows.numbers
            }
            By::RungeKutta => by_runge_kutta(scene, &start(k), (&at, request.evaluations))?,
        };
        // A motion that ended early has no place at the times after it.
        failed += usize::from(rows.len() < 2 * n * at.len());
        rows.resize(2 * n * at.len(), f64::NAN);
        host::rows(&rows);
    }
    let mut factors = Rows { numbers: Vec::new(), deadline };
    let of_scene = Motion { columns: vec![Column::LogFactor], ..motion };
    scene.system.run(&of_scene, &mut factors).map_err(of_motion(scene))?;
    Ok(json!({
        "times": at,
        "members": members,
        "dimension": n,
        "failed": failed,
        "log_factor": factors.numbers.into_iter().map(number).collect::<Vec<_>>(),
        "is_constant": scene.properties().iter().any(|property| property.name == "constant_rate" && property.is_proved),
    }))
}

/// The momentum of a start.
fn momentum(scene: &Scene, start: &Start) -> Result<Vec<f64>, Value> {
    Ok(match &start.velocity {
        InitialVelocity::Momentum(p) | InitialVelocity::MomentumNear { p, .. } => p.clone(),
        InitialVelocity::Velocity(_) if scene.system.formula().is_hamiltonian() => {
            return Err(refusal("a cloud of a Hamiltonian starts at a momentum"));
        }
        InitialVelocity::Velocity(_) => scene.system.geometry(start).map_err(of_motion(scene))?.momentum,
    })
}

/// Positions and momenta of a member at some times, by the Runge-Kutta method.
fn by_runge_kutta(scene: &Scene, start: &Start, (at, evaluations): (&[f64], u64)) -> Result<Vec<f64>, Value> {
    let formula = scene.system.formula();
    let mut method = RungeKutta::new(&scene.system, start)?;
    let momenta = Quantities::new(formula, formula.momenta().iter());
    let steps = (evaluations as usize / EVALUATIONS_PER_STEP).div_ceil(at.len().max(2) - 1).max(1);
    let mut numbers = Vec::with_capacity(2 * formula.dimension() * at.len());
    let mut push = |t: f64, y: &[f64]| {
        numbers.extend(y.iter().take(formula.dimension()));
        numbers.extend(momenta.at(t, y));
    };
    push(at.first().copied().unwrap_or(f64::NAN), &method.y);
    for (from, to) in at.iter().zip(at.iter().skip(1)) {
        let h = (to - from) / steps as f64;
        (0..steps).for_each(|k| method.step(from + k as f64 * h, h));
        push(*to, &method.y);
    }
    Ok(numbers)
}
