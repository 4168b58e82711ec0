//! Tangents that are carried forward along a run, and covectors that are carried back.

use crate::sensitivity::linear_stages::StageTangent;
use crate::{Components, State, Vector};
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};

/// The tangent `(dq, dp, dz)` of a motion along one variable.
pub(crate) struct Column {
    pub q: Vector,
    pub p: Vector,
    pub z: f64,
    /// The parameter that it is the derivative with respect to, if any.
    pub parameter: Option<usize>,
    /// The derivatives of the time at the start of the run and of the step size.
    pub dt0: f64,
    pub dh: f64,
    /// Empty before the first step.
    pub(super) rates: StageTangent,
    /// Whether the rates are those of a step before, from which the iteration starts.
    pub(super) warm: bool,
}

impl Column {
    pub fn new(q: Vector, p: Vector, z: f64) -> Self {
        Column { q, p, z, parameter: None, dt0: 0.0, dh: 0.0, rates: StageTangent::default(), warm: false }
    }

    /// The column of a parameter.
    pub fn of_parameter(self, index: usize) -> Self {
        Column { parameter: Some(index), ..self }
    }

    /// The column of a variable on which the time at the start and the step size depend with these derivatives.
    pub fn of_times(self, dt0: f64, dh: f64) -> Self {
        Column { dt0, dh, ..self }
    }

    /// The derivative of the time after this number of steps.
    pub fn time_after(&self, steps: usize) -> f64 {
        self.dt0 + steps as f64 * self.dh
    }

    /// The column for a step to a fixed time, where the time of its start has this derivative.
    pub fn to_fixed_time(&self, dt: f64) -> Self {
        self.copied().of_times(dt, -dt)
    }

    /// The derivative in the length of a step from a fixed state of n coordinates.
    pub fn of_length(n: usize) -> Self {
        Column::new(Vector::zeros(n), Vector::zeros(n), 0.0).of_times(0.0, 1.0)
    }

    /// Sets the tangent of the state.
    pub fn set_state(&mut self, to: Components) {
        (self.q, self.p, self.z, self.warm) = (to.x, to.y, to.z, false);
    }

    /// The tangent of the state.
    pub fn state(&self) -> Components {
        Components { x: self.q.clone(), y: self.p.clone(), z: self.z }
    }

    /// Carries the column over a step of length zero, with these rates of the state.
    pub fn push_at_once(&mut self, rates: &Components) {
        self.set_state(self.state().plus(&rates.scale(self.dh)));
    }

    /// The column at a fixed time, where the state after this number of steps has these rates.
    pub fn at_fixed_time(&self, steps: usize, rates: &State) -> Self {
        let (mut column, dt) = (self.copied(), self.time_after(steps));
        column.q -= &(&rates.q * dt);
        column.p -= &(&rates.p * dt);
        column.z -= rates.z * dt;
        column
    }

    /// Adds a multiple of another tangent, with that of its rates.
    pub fn add_multiple(&mut self, factor: f64, other: &Self) {
        self.q += &(&other.q * factor);
        self.p += &(&other.p * factor);
        self.z += other.z * factor;
        self.rates.add_multiple(factor, &other.rates);
    }

    /// Multiplies the tangent by a factor, with its rates.
    pub fn scale(&mut self, factor: f64) {
        self.q = &self.q * factor;
        self.p = &self.p * factor;
        self.z *= factor;
        self.rates.scale(factor);
    }

    /// The Euclidean product of the components `(q, p, z)` with those of another tangent.
    pub fn dot(&self, other: &Self) -> f64 {
        self.q.dot(&other.q) + self.p.dot(&other.p) + self.z * other.z
    }

    /// The same tangent without an initial guess of its rates.
    fn copied(&self) -> Self {
        let Column { q, p, z, parameter, dt0, dh, .. } = self;
        Column { parameter: *parameter, dt0: *dt0, dh: *dh, ..Column::new(q.clone(), p.clone(), *z) }
    }

    /// The largest component.
    pub fn size(&self) -> f64 {
        max_abs_or_nan(self.q.iter().chain(&self.p).copied().chain([self.z]))
    }
}

/// The derivatives `(g_q, g_p, g_z)` of a number in the state, with those in parameters, time and step size so far.
pub(crate) struct Covector {
    pub q: Vector,
    pub p: Vector,
    pub z: f64,
    pub parameters: Vec<f64>,
    /// The derivatives in the time of the start of the run, for fixed steps, and in the step size.
    pub time: f64,
    pub step: f64,
    /// The largest component so far.
    pub largest: f64,
    /// Empty before the first step.
    pub(super) rates: StageTangent,
    /// Whether the rates are those of a step before, from which the iteration starts.
    pub(super) warm: bool,
}

impl Covector {
    pub fn new(of_state: Components, parameters: Vec<f64>) -> Self {
        let largest = max_or_nan(of_state.max_abs_or_nan(), 0.0);
        Covector {
            largest,
            q: of_state.x,
            p: of_state.y,
            z: of_state.z,
            parameters,
            time: 0.0,
            step: 0.0,
            rates: StageTangent::default(),
            warm: false,
        }
    }

    /// The derivatives in the state.
    pub fn state(&self) -> Components {
        Components { x: self.q.clone(), y: self.p.clone(), z: self.z }
    }

    /// Sets the derivatives in the state.
    pub fn set_state(&mut self, to: Components) {
        (self.q, self.p, self.z, self.warm) = (to.x, to.y, to.z, false);
    }

    /// Carries the covector back over a step of length zero, with these rates of the state.
    pub fn pull_at_once(&mut self, rates: &Components) {
        self.step += self.q.dot(&rates.x) + self.p.dot(&rates.y) + self.z * rates.z;
    }

    /// Takes the derivatives in the time of the start and in the length, those for a fixed length and a fixed start.
    pub fn take_times(&mut self) -> [f64; 2] {
        [std::mem::take(&mut self.time), std::mem::take(&mut self.step)]
    }

    /// Adds a multiple of the derivatives in the state and in the parameters of another covector.
    pub fn add_multiple(&mut self, factor: f64, of: &Self) {
        let parameters: Vec<f64> = of.parameters.iter().map(|x| factor * x).collect();
        self.add_state(&of.state().scale(factor), &parameters);
    }

    /// Adds a covector of the state at a fixed time, which the motion has after this number of steps, with these rates.
    pub fn add_at_fixed_time(&mut self, of_state: &Components, parameters: &[f64], rates: &State, steps: usize) {
        self.add_state(of_state, parameters);
        self.add_time(-(of_state.x.dot(&rates.q) + of_state.y.dot(&rates.p) + of_state.z * rates.z), steps);
    }

    pub fn add_state(&mut self, of_state: &Components, parameters: &[f64]) {
        self.q += &of_state.x;
        self.p += &of_state.y;
        self.z += of_state.z;
        self.parameters.iter_mut().zip(parameters).for_each(|(sum, of)| *sum += of);
    }

    /// Adds a derivative in the time after this number of steps.
    pub fn add_time(&mut self, of_time: f64, steps: usize) {
        self.time += of_time;
        self.step += steps as f64 * of_time;
    }

    /// The largest component.
    pub fn size(&self) -> f64 {
        max_abs_or_nan(self.q.iter().chain(&self.p).copied().chain([self.z]))
    }
}
