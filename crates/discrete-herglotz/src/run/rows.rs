//! Rows: the states of a motion at steps or at times.

use super::{Course, Moment, Needs, Observer, Stop};
use crate::{InputError, StepError};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;
use std::cmp::Ordering;
use std::ops::ControlFlow;

/// A state of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Row<const N: usize> {
    /// The time.
    pub t: f64,
    /// The position.
    pub q: SVector<f64, N>,
    /// The velocity, where the rows are [with](Rows::with_velocity) it.
    pub v: Option<SVector<f64, N>>,
    /// The momentum.
    pub p: SVector<f64, N>,
    /// The action, if the rows are not [without](Rows::without_action) it.
    pub z: Option<f64>,
    /// The values of the [columns](Rows::column), in their order.
    pub columns: Vec<f64>,
}

/// A function of time and state.
type Column<'f, const N: usize> = Box<dyn FnMut(f64, &PhasePoint<N>) -> f64 + 'f>;

/// Which states are recorded.
#[derive(Clone, Debug)]
enum When {
    /// The start, every so many steps, and the end.
    Every(usize),
    /// These times, in the order of the run, of which so many are recorded.
    At { times: Vec<f64>, recorded: usize },
}

/// Records the states of a motion.
pub struct Rows<'f, const N: usize> {
    /// The rows so far.
    pub rows: Vec<Row<N>>,
    when: When,
    columns: Vec<Column<'f, N>>,
    action: bool,
    velocity: bool,
    course: Course,
}

/// The largest number of rows: a few gigabytes.
const MOST: usize = 1 << 26;

impl<'f, const N: usize> Rows<'f, N> {
    /// The start, the state after each `stride` steps, and the end.
    ///
    /// # Errors
    /// [`InputError::Count`] for a stride of 0.
    pub fn every(stride: usize) -> Result<Self, InputError> {
        if stride == 0 {
            return Err(InputError::Count { what: "the steps between two rows", least: 1, found: 0 });
        }
        Ok(Self::when(When::Every(stride)))
    }

    /// The states at these times exactly, ascending, or descending for a run that goes back; a run is refused that does not reach the
    /// last of them. States between the ends of steps are as exact as those at the ends; see [`LastStep::at`](super::LastStep::at).
    ///
    /// # Errors
    /// [`InputError::Times`] for times that are not finite or not in order.
    pub fn at(times: impl IntoIterator<Item = f64>) -> Result<Self, InputError> {
        let times: Vec<f64> = times.into_iter().collect();
        let wanted = if times.len() < 2 || times[0] < times[1] { Ordering::Less } else { Ordering::Greater };
        let out_of_order = |pair: &[f64]| pair[0].partial_cmp(&pair[1]) != Some(wanted);
        let out_of_order = times.windows(2).position(out_of_order).map(|index| index + 1);
        match times.iter().position(|t| !t.is_finite()).or(out_of_order) {
            Some(index) => Err(InputError::Times { index, t: times[index] }),
            None => Ok(Self::when(When::At { times, recorded: 0 })),
        }
    }

    fn when(when: When) -> Self {
        let course = Course { t0: 0.0, t_end: 0.0, h: None, count: None };
        Rows { rows: Vec::new(), when, columns: Vec::new(), action: true, velocity: false, course }
    }

    /// With one more column: a function of time and state.
    pub fn column(mut self, f: impl FnMut(f64, &PhasePoint<N>) -> f64 + 'f) -> Self {
        self.columns.push(Box::new(f));
        self
    }

    /// Without the action, so that a run of which no one else wants it need not compute it.
    pub fn without_action(self) -> Self {
        Rows { action: false, ..self }
    }

    /// With the velocity, which costs an inverse Legendre transformation a row.
    pub fn with_velocity(self) -> Self {
        Rows { velocity: true, ..self }
    }

    fn record(&mut self, at: &Moment<'_, N>, t: f64, state: &PhasePoint<N>) -> Result<(), StepError> {
        let v = if self.velocity { Some(at.velocity_at(t, state)?) } else { None };
        let columns = self.columns.iter_mut().map(|f| f(t, state)).collect();
        self.rows.push(Row { t, q: state.q, v, p: state.p, z: self.action.then_some(state.z), columns });
        Ok(())
    }

    /// Records the rows up to a moment.
    fn record_up_to(&mut self, at: &Moment<'_, N>) -> Result<(), StepError> {
        let (times, recorded) = match &self.when {
            When::Every(stride) if at.k.is_multiple_of(*stride) || at.last => return self.record(at, at.t, &at.state),
            When::Every(_) => return Ok(()),
            When::At { times, recorded } => (times, *recorded),
        };
        let backward = self.course.t_end < self.course.t0;
        let passed = |t: f64| if backward { t >= at.t } else { t <= at.t };
        // The last step ends where the span does but for its rounding.
        let due: Vec<f64> = times[recorded..].iter().copied().take_while(|t| at.last || passed(*t)).collect();
        for t in due {
            let state = if t == at.t || !passed(t) { at.state } else { at.inside(t)? };
            self.record(at, t, &state)?;
            if let When::At { recorded, .. } = &mut self.when {
                *recorded += 1;
            }
        }
        Ok(())
    }
}

impl<const N: usize> Observer<N> for Rows<'_, N> {
    fn needs(&self) -> Needs {
        Needs { action: self.action, conformal_factor: false }
    }

    fn prepare(&mut self, course: &Course) -> Result<(), InputError> {
        self.course = *course;
        self.rows.clear();
        if let When::At { recorded, .. } = &mut self.when {
            *recorded = 0;
        }
        let Course { t0, t_end, count, .. } = *course;
        let rows = match &self.when {
            // By a clock the number of steps shows at the end.
            When::Every(stride) => count.map_or(2, |count| count / stride + 2),
            When::At { times, .. } => {
                let inside = |t: f64| (t0.min(t_end)..=t0.max(t_end)).contains(&t);
                let forward = times.windows(2).all(|pair| pair[0] < pair[1]) == (t0 < t_end) || times.len() < 2;
                if let Some(index) = times.iter().position(|t| !inside(*t) || !forward) {
                    return Err(InputError::Times { index, t: times[index] });
                }
                times.len()
            }
        };
        if rows > MOST || self.rows.try_reserve_exact(rows).is_err() {
            return Err(too_many(rows));
        }
        Ok(())
    }

    fn next(&self, taken: usize) -> usize {
        match &self.when {
            When::Every(stride) => (taken / stride + 1) * stride,
            When::At { times, recorded } => {
                let Some(t) = times.get(*recorded) else { return usize::MAX };
                // The step in which it lies, or the one before by rounding, which then records nothing.
                let step =
                    self.course.h.map_or(0.0, |h| ((t - self.course.t0) / h * (1.0 - 4.0 * f64::EPSILON)).ceil());
                (step as usize).max(taken + 1)
            }
        }
    }

    fn start(&mut self, at: &Moment<'_, N>) -> ControlFlow<Stop<N>> {
        self.step(at)
    }

    fn step(&mut self, at: &Moment<'_, N>) -> ControlFlow<Stop<N>> {
        if self.rows.len() >= MOST {
            return ControlFlow::Break(Stop::here("the rows, which are too many"));
        }
        match self.record_up_to(at) {
            Ok(()) => ControlFlow::Continue(()),
            Err(cause) => ControlFlow::Break(Stop::failed(cause)),
        }
    }
}

fn too_many(count: usize) -> InputError {
    let (found, most, remedy) = (count as f64, MOST as f64, "record fewer rows");
    InputError::TooMany { what: "the number of rows", found, most, remedy }
}
