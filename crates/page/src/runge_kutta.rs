//! The classical Runge-Kutta method of order four, to which motions are compared: it knows nothing of contact.

use crate::host;
use crate::numbers::named;
use crate::request::{Deadline, refusal};
use herglotz::Scene;
use herglotz::runtime::{Expression, Formula, InitialVelocity, Start, System};
use serde_json::{Value, json};

/// The evaluations of the vector field in a step.
pub const EVALUATIONS_PER_STEP: usize = 4;

/// The maximal number of rows.
const MOST_ROWS: usize = 1000;

/// The number of steps between two looks at the clock.
const STEPS_BETWEEN_POLLS: usize = 256;

/// A step of a system in its variables `(q, v, z)`, or `(q, p, z)` for a Hamiltonian.
pub struct RungeKutta<'s> {
    system: &'s System,
    /// The variables.
    pub y: Vec<f64>,
    stages: [Vec<f64>; 4],
    at: Vec<f64>,
}

impl<'s> RungeKutta<'s> {
    /// At a start.
    ///
    /// # Errors
    /// An answer, where it has no velocity, and for systems of which the vector field is not all.
    pub fn new(system: &'s System, start: &Start) -> Result<Self, Value> {
        let formula = system.formula();
        if formula.resets() > 0 || formula.constraints() > 0 {
            return Err(refusal("the Runge-Kutta method has neither resets nor constraints"));
        }
        let of = match &start.velocity {
            InitialVelocity::Momentum(p) | InitialVelocity::MomentumNear { p, .. } if formula.is_hamiltonian() => {
                p.clone()
            }
            InitialVelocity::Velocity(v) if !formula.is_hamiltonian() => v.clone(),
            _ => {
                let geometry = system.geometry(start).map_err(|error| refusal(&error.to_string()))?;
                geometry.herglotz_field.get(..system.dimension()).unwrap_or_default().to_vec()
            }
        };
        let y = [start.q.as_slice(), &of, &[start.z]].concat();
        let none = || vec![0.0; y.len()];
        Ok(RungeKutta { system, at: none(), stages: [none(), none(), none(), none()], y })
    }

    /// Takes a step.
    pub fn step(&mut self, t: f64, h: f64) {
        let RungeKutta { system, y, stages: [a, b, c, d], at } = self;
        let mut moved = |by: f64, slope: &[f64]| -> Vec<f64> {
            at.clear();
            at.extend(y.iter().zip(slope).map(|(y, slope)| y + by * slope));
            at.clone()
        };
        system.rates(t, y, a);
        system.rates(t + h / 2.0, &moved(h / 2.0, a), b);
        system.rates(t + h / 2.0, &moved(h / 2.0, b), c);
        system.rates(t + h, &moved(h, c), d);
        for (k, y) in y.iter_mut().enumerate() {
            *y += h / 6.0 * (a[k] + 2.0 * (b[k] + c[k]) + d[k]);
        }
    }
}

/// Expressions of the state.
pub struct Quantities(Vec<Expression>);

impl Quantities {
    /// Those of some texts; texts that are none are left out.
    pub fn new<'t>(formula: &Formula, texts: impl Iterator<Item = &'t String>) -> Self {
        Quantities(texts.filter_map(|text| formula.expression(text).ok()).collect())
    }

    /// Their values at variables.
    pub fn at(&self, t: f64, y: &[f64]) -> impl Iterator<Item = f64> {
        let n = y.len() / 2;
        let (q, v, z) = (&y[..n], &y[n..2 * n], y[2 * n]);
        self.0.iter().map(move |of| of.at(t, q, v, z))
    }
}

/// The motion of a scene with this number of evaluations. Rows have the columns t, the variables, the momenta, the energy and the momenta of
/// symmetries.
pub fn run(scene: &Scene, evaluations: u64) -> Result<Value, Value> {
    let (deadline, motion, formula) = (Deadline::new(), scene.bare_motion(), scene.system.formula());
    let steps = (evaluations as usize / EVALUATIONS_PER_STEP).max(1);
    let (t0, h) = (motion.start.t, (motion.end - motion.start.t) / steps as f64);
    let mut method = RungeKutta::new(&scene.system, &motion.start)?;
    let (momenta, symmetries, energy) = (formula.momenta(), scene.momenta(), "energy".to_owned());
    let texts = || momenta.iter().chain([&energy]).chain(&symmetries);
    let quantities = Quantities::new(formula, texts());
    let stride = steps.div_ceil(MOST_ROWS);
    let (mut numbers, mut taken) = (Vec::new(), 0);
    while taken <= steps {
        let t = t0 + taken as f64 * h;
        if taken.is_multiple_of(stride) || taken == steps {
            numbers.push(t);
            numbers.extend(&method.y);
            numbers.extend(quantities.at(t, &method.y));
        }
        if taken == steps || taken.is_multiple_of(STEPS_BETWEEN_POLLS) && deadline.is_over() {
            break;
        }
        method.step(t, h);
        taken += 1;
    }
    host::rows(&numbers);
    let names = formula.coordinates();
    let second = if formula.is_hamiltonian() {
        momenta.clone()
    } else {
        names.iter().map(|x| herglotz::runtime::velocity_name(x)).collect()
    };
    let columns: Vec<&str> = ["t"]
        .into_iter()
        .chain(names.iter().chain(&second).map(String::as_str))
        .chain([formula.action()])
        .chain(texts().map(String::as_str))
        .collect();
    Ok(
        json!({ "columns": columns, "steps": taken, "step_size": h, "is_over": taken < steps, "end": named([("t", t0 + taken as f64 * h)]) }),
    )
}
