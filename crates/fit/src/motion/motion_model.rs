//! The model of observed quantities of a motion.

use crate::motion::observed::Observed;
use crate::motion::piecewise::{Observation, Piece, PieceValues, PiecewiseModel};
use crate::motion::tangent_rows::{StepChoice, state_variables, tangent_rows};
use crate::{FitError, Model, ModelFailure};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{Parametric, VelocityPoint};
use discrete_herglotz::sensitivity::{TangentRow, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Until};

/// Observed quantities of a motion as functions of parameters of its Lagrangian and of its start: the [`Model`] of a fit
/// of a motion to data.
///
/// The motion is integrated by contact Gauss collocation with fixed steps, and differentiated exactly: the Jacobian is
/// that of the computed motion, not an approximation of that of the true one. The unknowns start from the values that the
/// Lagrangian and the start have ([`start`](Self::start)).
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::sensitivity::{TangentRow, Variable};
/// use herglotz_fit::{LeastSquares, MotionModel, Observed};
/// let times = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0];
/// let angles = [0.886, 0.579, 0.152, -0.294, -0.657, -0.850];
/// let guess = Pendulum { gamma: -0.2 };
/// let unknowns = [Variable::Parameter("gamma".into()), Variable::Position(0)];
/// let model = MotionModel::new(&guess, 0.0, VelocityPoint::new([1.0], [0.0], 0.0), &unknowns, 0.5)?
///     .observe(Observed::Position(0), &times)?;
/// let fit = LeastSquares::new(&model, &angles)?.solve(&model.start())?;
/// println!("{fit}");
/// # Ok::<(), herglotz_fit::FitError>(())
/// ```
pub struct MotionModel<'a, L, const N: usize> {
    lagrangian: &'a L,
    t0: f64,
    initial: VelocityPoint<N>,
    unknowns: Vec<Variable>,
    /// The index of each unknown among the parameters, for those that are one.
    indices: Vec<Option<usize>>,
    names: Vec<String>,
    steps: StepChoice,
    /// The times of all observations, in order and without repetition.
    times: Vec<f64>,
    /// What is observed, and when, for each value.
    values: Vec<ObservedValue>,
    observed: Vec<Observed<'a, N>>,
}

/// An observed value: the index of its time, and of its quantity.
#[derive(Clone, Copy, Debug)]
struct ObservedValue {
    t: f64,
    time: usize,
    quantity: usize,
}

impl<'a, L: Parametric<N>, const N: usize> MotionModel<'a, L, N> {
    /// The model of the motion from a state at `t0`, with these unknowns: parameters of the Lagrangian, and positions,
    /// velocities and the action of the start. Its steps have at most this size.
    ///
    /// # Errors
    /// An unknown that the problem does not have, or that is not one of these; a Lagrangian whose parameters cannot be
    /// set; a step that is not positive and finite.
    pub fn new(
        lagrangian: &'a L,
        t0: f64,
        start: VelocityPoint<N>,
        unknowns: &[Variable],
        step_size: f64,
    ) -> Result<Self, FitError> {
        if !(step_size > 0.0 && step_size.is_finite()) {
            return Err(FitError::Option { what: "the step size", value: step_size });
        }
        let (mut names, mut indices) = (Vec::new(), Vec::new());
        let parameters = lagrangian.parameter_names();
        for unknown in unknowns {
            let (name, index) = match unknown {
                Variable::Parameter(name) => (name.clone(), Some(lagrangian.parameter_index(name)?)),
                Variable::Position(i) | Variable::Velocity(i) if *i >= N => {
                    return Err(FitError::Coordinate { index: *i, count: N });
                }
                Variable::Position(i) => (format!("q[{i}]"), None),
                Variable::Velocity(i) => (format!("v[{i}]"), None),
                Variable::Action => ("z".to_owned(), None),
                other => return Err(FitError::Unknown { variable: format!("{other:?}") }),
            };
            let is_taken = index.is_none() && parameters.contains(&name);
            names.push(if is_taken { format!("start.{name}") } else { name });
            indices.push(index);
        }
        if indices.iter().any(Option::is_some) && lagrangian.with_parameters(&lagrangian.parameters()).is_none() {
            return Err(FitError::FixedParameters);
        }
        let steps = StepChoice { stages: 8, h: step_size };
        let (times, values, observed) = (Vec::new(), Vec::new(), Vec::new());
        let unknowns = unknowns.to_vec();
        Ok(MotionModel { lagrangian, t0, initial: start, unknowns, indices, names, steps, times, values, observed })
    }

    /// Sets the number of stages of contact Gauss collocation; by default 8.
    #[must_use]
    pub fn with_stages(mut self, stages: usize) -> Self {
        self.steps.stages = stages;
        self
    }

    /// Adds values of a quantity at these times. The values of the model, and so the data, are in the order in which
    /// they were added.
    ///
    /// # Errors
    /// A time that is not finite or before the start; a coordinate that does not exist.
    pub fn observe(mut self, observed: Observed<'a, N>, times: &[f64]) -> Result<Self, FitError> {
        if let Some(index) = observed.index().filter(|i| *i >= N) {
            return Err(FitError::Coordinate { index, count: N });
        }
        if let Some(index) = times.iter().position(|t| !(t.is_finite() && *t >= self.t0)) {
            return Err(FitError::Time { index, t: times[index], t0: self.t0 });
        }
        self.times.extend(times);
        self.times.sort_by(f64::total_cmp);
        self.times.dedup();
        let quantity = self.observed.len();
        self.values.extend(times.iter().map(|t| ObservedValue { t: *t, time: 0, quantity }));
        for value in &mut self.values {
            value.time = self.times.partition_point(|t| *t < value.t);
        }
        self.observed.push(observed);
        Ok(self)
    }

    /// Selects the step size for a relative error of the motion from the start as it is given, by trial runs; see
    /// [`Run::accuracy`](discrete_herglotz::Run::accuracy). The steps then remain the same, since a cost whose steps
    /// change with the parameters has no derivative.
    ///
    /// # Errors
    /// Those of the trial runs.
    pub fn accuracy(mut self, wanted: f64) -> Result<Self, FitError> {
        let end = self.times.last().copied().unwrap_or(self.t0);
        if end > self.t0 {
            let problem = Problem::new(self.lagrangian, self.t0, self.initial).map_err(FitError::Motion)?;
            let run = problem.by(GaussCollocation { stages: self.steps.stages }).accuracy(wanted);
            self.steps.h = run.plan(Until::Time(end)).map_err(FitError::Motion)?.step_size();
        }
        Ok(self)
    }

    /// The largest step.
    pub fn step_size(&self) -> f64 {
        self.steps.h
    }

    /// The values of the unknowns in the Lagrangian and the state with which the model was made.
    pub fn start(&self) -> Vec<f64> {
        let parameters = self.lagrangian.parameters();
        let value = |(unknown, index): (&Variable, &Option<usize>)| match (unknown, index) {
            (_, Some(index)) => parameters.get(*index).copied().unwrap_or(f64::NAN),
            (Variable::Position(i), _) => self.initial.q[*i],
            (Variable::Velocity(i), _) => self.initial.v[*i],
            _ => self.initial.z,
        };
        self.unknowns.iter().zip(&self.indices).map(value).collect()
    }

    /// The start of the motion for these values of the unknowns.
    pub fn state_at(&self, theta: &[f64]) -> VelocityPoint<N> {
        let mut x = self.initial;
        for (unknown, value) in self.unknowns.iter().zip(theta) {
            match unknown {
                Variable::Position(i) => x.q[*i] = *value,
                Variable::Velocity(i) => x.v[*i] = *value,
                Variable::Action => x.z = *value,
                _ => {}
            }
        }
        x
    }

    /// The Lagrangian for these values of the unknowns; `None` if it does not accept its parameters, or no parameter is
    /// unknown.
    pub fn lagrangian_at(&self, theta: &[f64]) -> Option<L> {
        let mut parameters = self.lagrangian.parameters();
        let mut is_any = false;
        for (index, value) in self.indices.iter().zip(theta).filter_map(|(i, v)| i.map(|i| (i, v))) {
            *parameters.get_mut(index)? = *value;
            is_any = true;
        }
        if is_any { self.lagrangian.with_parameters(&parameters) } else { None }
    }

    /// The rows of a motion at times, with the derivatives with respect to variables.
    fn rows(
        &self,
        theta: &[f64],
        start: (f64, VelocityPoint<N>),
        times: &[f64],
        variables: &[Variable],
    ) -> Result<Vec<TangentRow>, ModelFailure> {
        if self.indices.iter().all(Option::is_none) {
            return tangent_rows(self.lagrangian, start, times, self.steps, variables);
        }
        let Some(lagrangian) = self.lagrangian_at(theta) else {
            return Err(ModelFailure::Undefined("the Lagrangian does not accept these parameters".to_owned()));
        };
        tangent_rows(&lagrangian, start, times, self.steps, variables)
    }
}

impl<L: Parametric<N>, const N: usize> Model for MotionModel<'_, L, N> {
    fn parameter_names(&self) -> Vec<String> {
        self.names.clone()
    }

    fn value_count(&self) -> usize {
        self.values.len()
    }

    fn evaluate(
        &self,
        theta: &[f64],
        values: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), ModelFailure> {
        let variables: &[Variable] = if jacobian.is_some() { &self.unknowns } else { &[] };
        let rows = self.rows(theta, (self.t0, self.state_at(theta)), &self.times, variables)?;
        let mut derivatives = Vec::with_capacity(variables.len());
        for (i, value) in self.values.iter().enumerate() {
            let TangentRow { state, columns } = &rows[value.time];
            values[i] = self.observed[value.quantity].at(state, columns, &mut derivatives);
            if let Some(jacobian) = &mut jacobian {
                jacobian.row_mut(i).copy_from_slice(&derivatives);
            }
        }
        Ok(())
    }
}

/// The numbers of a state are q, v and z, in this order.
impl<L: Parametric<N>, const N: usize> PiecewiseModel for MotionModel<'_, L, N> {
    fn state_names(&self) -> Vec<String> {
        let vectors = ["q", "v"].into_iter().flat_map(|letter| (0..N).map(move |i| format!("{letter}[{i}]")));
        vectors.chain(["z".to_owned()]).collect()
    }

    fn start_time(&self) -> f64 {
        self.t0
    }

    fn start_state(&self, theta: &[f64]) -> Vec<f64> {
        let x = self.state_at(theta);
        numbers(x.q.as_slice(), x.v.as_slice(), x.z).collect()
    }

    fn observations(&self) -> Vec<Observation> {
        let of = |value: &ObservedValue| {
            let (number, rate) = match self.observed[value.quantity] {
                Observed::Position(i) => (Some(i), Some(N + i)),
                Observed::Velocity(i) => (Some(N + i), None),
                Observed::Action => (Some(2 * N), None),
                _ => (None, None),
            };
            Observation { t: value.t, number, rate }
        };
        self.values.iter().map(of).collect()
    }

    fn piece(&self, theta: &[f64], piece: &Piece<'_>) -> Result<PieceValues, ModelFailure> {
        let count = self.unknowns.len();
        let unknowns = self.unknowns.iter().cloned().zip(0..);
        // The variables of the piece, and their places among the unknowns and the numbers of the state after them.
        let (start, (variables, places)): (_, (Vec<Variable>, Vec<usize>)) = match piece.from {
            None => ((self.t0, self.state_at(theta)), unknowns.unzip()),
            Some((t, state)) => {
                let parameters = unknowns.filter(|(unknown, _)| matches!(unknown, Variable::Parameter(_)));
                ((t, state_of(state)), state_variables::<N>().zip(count..).chain(parameters).unzip())
            }
        };
        let mut times: Vec<f64> = piece.values.iter().map(|i| self.values[*i].t).chain(piece.to).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let variables: &[Variable] = if piece.is_differentiated { &variables } else { &[] };
        let rows = self.rows(theta, start, &times, variables)?;
        let mut found = PieceValues::new(self, piece);
        let mut derivatives = Vec::with_capacity(variables.len());
        for (row, i) in piece.values.iter().enumerate() {
            let value = self.values[*i];
            let TangentRow { state, columns } = &rows[times.partition_point(|t| *t < value.t)];
            found.values[row] = self.observed[value.quantity].at(state, columns, &mut derivatives);
            for (place, derivative) in places.iter().zip(&derivatives) {
                found.derivatives[(row, *place)] = *derivative;
            }
        }
        if let (Some(_), Some(TangentRow { state, columns })) = (piece.to, rows.last()) {
            let row = piece.values.len();
            for (i, number) in numbers(&state.q, &state.v, state.z).enumerate() {
                found.values[row + i] = number;
            }
            for (place, column) in places.iter().zip(columns) {
                for (i, number) in numbers(&column.q, &column.v, column.z).enumerate() {
                    found.derivatives[(row + i, *place)] = number;
                }
            }
        }
        Ok(found)
    }
}

/// The numbers of a state, in the order q, v, z.
fn numbers<'s>(q: &'s [f64], v: &'s [f64], z: f64) -> impl Iterator<Item = f64> + 's {
    q.iter().chain(v.iter()).copied().chain([z])
}

/// The state with these numbers.
fn state_of<const N: usize>(numbers: &[f64]) -> VelocityPoint<N> {
    let number = |i: usize| numbers.get(i).copied().unwrap_or(f64::NAN);
    let q = SVector::from_fn(|i, _| number(i));
    VelocityPoint { q, v: SVector::from_fn(|i, _| number(N + i)), z: number(2 * N) }
}
