//! Rows: the states of a motion at steps or at times.

use crate::run::{Observer, OutputRequest, RunInfo, StepView, Stop};
use crate::{InputError, State, StepError, Vector};
use std::cmp::Ordering;
use std::ops::ControlFlow;

/// A recorded state of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The time.
    pub t: f64,
    /// The position.
    pub q: Vector,
    /// The velocity, if it is [requested](Rows::with_velocity).
    pub v: Option<Vector>,
    /// The momentum.
    pub p: Vector,
    /// The action, unless it is [omitted](Rows::without_action).
    pub z: Option<f64>,
    /// The energy `E_L = v.p - L`, if it is [requested](Rows::with_energy).
    pub energy: Option<f64>,
    /// The logarithm of the conformal factor of the motion since the start, if it is
    /// [requested](Rows::with_conformal_factor).
    pub log_factor: Option<f64>,
    /// The values of the [columns](Rows::column), in their order.
    pub columns: Vec<f64>,
}

impl Row {
    /// All numbers of the row, in the order of [`Rows::header`].
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let vectors = self.q.iter().chain(self.v.iter().flatten()).chain(self.p.iter());
        let numbers = [self.z, self.energy, self.log_factor].into_iter().flatten();
        [self.t].into_iter().chain(vectors.copied()).chain(numbers).chain(self.columns.iter().copied())
    }
}

/// A function of time and state, with the name of its column.
type Column<'f> = (String, Box<dyn FnMut(f64, &State) -> f64 + 'f>);

/// The times at which states are recorded.
#[derive(Clone, Debug)]
enum RowTimes {
    /// The start, the ends of every n-th step, and the end.
    Every(usize),
    /// These times, in the order of the run, and how many of them have been recorded.
    At { times: Vec<f64>, recorded: usize },
}

/// Records the states of a motion.
pub struct Rows<'f> {
    /// The rows so far.
    pub rows: Vec<Row>,
    when: RowTimes,
    columns: Vec<Column<'f>>,
    needs: OutputRequest,
    velocity: bool,
    energy: bool,
    run: RunInfo,
}

/// The largest number of rows: some tens of gigabytes.
const MAX_ROWS: usize = 1 << 26;

impl<'f> Rows<'f> {
    /// The start, the state after each `stride` steps, and the end.
    ///
    /// # Errors
    /// [`InputError::Count`] for a stride of 0.
    pub fn every(stride: usize) -> Result<Self, InputError> {
        if stride == 0 {
            return Err(InputError::Count { what: "the number of steps between two rows", least: 1, found: 0 });
        }
        Ok(Self::when(RowTimes::Every(stride)))
    }

    /// The states at exactly these times, which ascend, or descend for a run backward in time; a run that does not
    /// contain all of them is refused. States between the ends of steps are as accurate as those at the ends; see
    /// [`LastStep::at`](crate::run::LastStep::at). A [resumed](crate::run::Run::resume) run records the times after
    /// that at which it resumes, so that each time is recorded by one of the two runs.
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
            None => Ok(Self::when(RowTimes::At { times, recorded: 0 })),
        }
    }

    fn when(when: RowTimes) -> Self {
        Rows {
            rows: Vec::new(),
            when,
            columns: Vec::new(),
            needs: OutputRequest::ACTION,
            velocity: false,
            energy: false,
            run: RunInfo::NONE,
        }
    }

    /// Adds a column: a function of time and state, with a name.
    pub fn column(mut self, name: impl Into<String>, f: impl FnMut(f64, &State) -> f64 + 'f) -> Self {
        self.columns.push((name.into(), Box::new(f)));
        self
    }

    /// Omits the action, which a run does not compute unless it is requested elsewhere.
    pub fn without_action(self) -> Self {
        Rows { needs: OutputRequest { action: false, ..self.needs }, ..self }
    }

    /// Includes the conformal factor.
    pub fn with_conformal_factor(self) -> Self {
        Rows { needs: OutputRequest { conformal_factor: true, ..self.needs }, ..self }
    }

    /// Includes the energy, which costs an inverse Legendre transformation and an evaluation of L per row.
    pub fn with_energy(self) -> Self {
        Rows { energy: true, ..self }
    }

    /// Includes the velocity, which costs an inverse Legendre transformation per row.
    pub fn with_velocity(self) -> Self {
        Rows { velocity: true, ..self }
    }

    /// The names of the [numbers](Row::numbers) of a row: `t`, `q0`, .. `v0`, .. `p0`, .. `z`, `energy`, `log_factor`,
    /// and those of the columns.
    ///
    /// The number of coordinates is that of the run for which the rows were prepared; before a run that of the first
    /// row, and 0 if there is none.
    pub fn header(&self) -> Vec<String> {
        let n = match self.run.dimension {
            0 => self.rows.first().map_or(0, |row| row.q.len()),
            n => n,
        };
        let of =
            |letter: &'static str, there: bool| (0..if there { n } else { 0 }).map(move |i| format!("{letter}{i}"));
        let one = |name: &str, there: bool| there.then(|| name.to_owned());
        let vectors = of("q", true).chain(of("v", self.velocity)).chain(of("p", true));
        let numbers =
            [one("z", self.needs.action), one("energy", self.energy), one("log_factor", self.needs.conformal_factor)];
        let columns = self.columns.iter().map(|(name, _)| name.clone());
        one("t", true).into_iter().chain(vectors).chain(numbers.into_iter().flatten()).chain(columns).collect()
    }

    fn record(&mut self, at: &StepView<'_>) -> Result<(), StepError> {
        let (v, energy) = match (self.velocity, self.energy) {
            (_, true) => at.velocity_and_energy().map(|(v, energy)| (self.velocity.then_some(v), Some(energy)))?,
            (true, false) => (Some(at.velocity()?), None),
            (false, false) => (None, None),
        };
        let StepView { t, state, log_factor, .. } = at;
        let columns = self.columns.iter_mut().map(|(_, f)| f(*t, state)).collect();
        let z = self.needs.action.then_some(state.z);
        let log_factor = log_factor.filter(|_| self.needs.conformal_factor);
        self.rows.push(Row { t: *t, q: state.q.clone(), v, p: state.p.clone(), z, energy, log_factor, columns });
        Ok(())
    }

    /// Records the rows up to the time of the view.
    fn record_up_to(&mut self, at: &StepView<'_>) -> Result<(), StepError> {
        let (times, recorded) = match &self.when {
            RowTimes::Every(stride) if at.ends_multiple_of(*stride) || at.last => return self.record(at),
            RowTimes::Every(_) => return Ok(()),
            RowTimes::At { times, recorded } => (times, *recorded),
        };
        let backward = self.run.t_end < self.run.t0;
        let passed = |t: f64| if backward { t >= at.t } else { t <= at.t };
        // The last step ends at the end of the span up to round-off.
        let due: Vec<f64> = times[recorded..].iter().copied().take_while(|t| at.last || passed(*t)).collect();
        let step = at.last_step();
        for t in due {
            if t == at.t {
                self.record(at)?;
            } else if passed(t) {
                let step = step.as_ref().ok_or(StepError::NonFinite)?;
                self.record(&at.within(step, t)?)?;
            } else {
                self.record(&StepView { t, state: at.state.clone(), before: None, ..*at })?;
            }
            if let RowTimes::At { recorded, .. } = &mut self.when {
                *recorded += 1;
            }
        }
        Ok(())
    }
}

impl Observer for Rows<'_> {
    fn needs(&self) -> OutputRequest {
        // The energy depends on L, and so on z.
        OutputRequest { action: self.needs.action || self.energy, ..self.needs }
    }

    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        self.run = *info;
        self.rows.clear();
        if let RowTimes::At { recorded, .. } = &mut self.when {
            *recorded = 0;
        }
        let RunInfo { t0, t_end, count, .. } = *info;
        let rows = match &self.when {
            // In transformed time the number of steps is not known in advance.
            RowTimes::Every(stride) => count.map_or(2, |count| count / stride + 2),
            RowTimes::At { times, .. } => {
                let inside = |t: f64| (t0.min(t_end)..=t0.max(t_end)).contains(&t);
                let forward = times.windows(2).all(|pair| pair[0] < pair[1]) == (t0 < t_end) || times.len() < 2;
                if let Some(index) = times.iter().position(|t| !inside(*t) || !forward) {
                    return Err(InputError::Times { index, t: times[index] });
                }
                times.len()
            }
        };
        check(rows)?;
        self.rows.try_reserve_exact(rows).map_err(|_| too_many(rows))
    }

    fn next(&self, taken: usize) -> usize {
        match &self.when {
            RowTimes::Every(stride) => (taken / stride + 1) * stride,
            RowTimes::At { times, recorded } => {
                let Some(t) = times.get(*recorded) else { return usize::MAX };
                // The step that contains the time or, by round-off, the one before it, which then records nothing.
                let step = self.run.h.map_or(0.0, |h| ((t - self.run.t0) / h * (1.0 - 4.0 * f64::EPSILON)).ceil());
                (step as usize).max(taken + 1)
            }
        }
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        let backward = self.run.t_end < self.run.t0;
        if let RowTimes::At { times, recorded } = &mut self.when
            && at.k > 0
        {
            // A resumed run: the times up to here were recorded by the run before it.
            *recorded = times.partition_point(|t| if backward { *t >= at.t } else { *t <= at.t });
        }
        self.step(at)
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if self.rows.len() >= MAX_ROWS {
            return ControlFlow::Break(Stop::here("the limit on the number of rows"));
        }
        match self.record_up_to(at) {
            Ok(()) => ControlFlow::Continue(()),
            Err(cause) => ControlFlow::Break(Stop::failed(cause)),
        }
    }
}

/// Returns an error if more rows would be kept in memory than [`MAX_ROWS`].
pub(crate) fn check(rows: usize) -> Result<(), InputError> {
    if rows > MAX_ROWS { Err(too_many(rows)) } else { Ok(()) }
}

fn too_many(count: usize) -> InputError {
    let (found, most, remedy) = (count as f64, MAX_ROWS as f64, "record fewer rows");
    InputError::TooMany { what: "the number of rows", found, most, remedy }
}
