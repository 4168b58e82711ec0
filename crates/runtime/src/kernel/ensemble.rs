//! Ensembles: many motions at once.

use super::formula_system::Observed;
use super::observed::{MemberObserver, MemberRecord};
use super::recorder::{Crossings, check_events, number};
use super::sized::coordinates;
use crate::clock::Clock;
use crate::{
    Column, Ending, Ensemble, EnsembleMonitor, Event, Interrupt, MemberEnd, RuntimeError, Start, StepControl, Varied,
};
use discrete_herglotz::ensemble::{EnsembleError, Member, Tally};
use discrete_herglotz::{InputError, Row, Vector};
use formula_lagrangian::{Expression, FormulaError};
use std::borrow::Cow;
use std::ops::Range;
use std::time::Duration;

/// The number of members that are computed together in SIMD lanes: a multiple of every number of lanes.
const SHARD_MEMBERS: usize = 384;

/// The number of members in a shard whose members are observed, each in a run of its own: few, since their records are
/// stored until the shard ends.
const OBSERVED_SHARD_MEMBERS: usize = 16;

/// The maximal number of these shards between two polls, so that a block has no more than some thousand members.
const MAX_SHARDS_BETWEEN_POLLS: usize = 24;

/// The time between two polls above which blocks are made smaller: a user does not notice it.
const MAX_TIME_BETWEEN_POLLS: Duration = Duration::from_millis(100);

/// A system of which many motions are run.
pub(super) trait ManyMotions {
    /// The system with the parameters of the formula.
    fn system(&self) -> &dyn Observed;

    /// Checks that the formula has these parameters.
    ///
    /// # Errors
    /// [`FormulaError::UnknownParameter`].
    fn check_parameters(&self, names: &[&str]) -> Result<(), FormulaError>;

    /// Runs the members of a block, and passes them on.
    ///
    /// # Errors
    /// Those of [`Ensemble::run`](discrete_herglotz::Ensemble::run).
    fn run_block(&self, block: &Block<'_>, results: &mut Results<'_>) -> Result<Tally, EnsembleError>;
}

/// Runs an ensemble block by block, so that it can be interrupted and its memory does not grow.
pub(super) fn run(
    system: &dyn ManyMotions,
    ensemble: &Ensemble<'_>,
    monitor: &mut dyn EnsembleMonitor,
) -> Result<Tally, RuntimeError> {
    if ensemble.count == 0 {
        return Err(EnsembleError::Empty.into());
    }
    if let Some(varied) = &ensemble.varied {
        system.check_parameters(varied.names)?;
    }
    check_events(system.system(), ensemble.events)?;
    let has_factor = ensemble.columns.iter().any(Column::has_conformal_factor);
    let observed = ensemble.rows.is_some() || !ensemble.events.is_empty() || has_factor;
    // In lanes, the step for an accuracy is chosen for a block, so the size of a block must not depend on run times.
    let (shard, mut shards, fixed) = match (&ensemble.step_control, &ensemble.varied) {
        _ if observed => (OBSERVED_SHARD_MEMBERS, 2, false),
        (_, Some(_)) => (SHARD_MEMBERS, 1, true),
        (StepControl::Accuracy { .. }, None) => (SHARD_MEMBERS, MAX_SHARDS_BETWEEN_POLLS, true),
        (StepControl::Steps { .. }, None) => (SHARD_MEMBERS, 2, false),
    };
    let interrupt = monitor.interrupt();
    let (mut results, mut first) = (Results { tally: Tally::default(), monitor, ended: false }, 0);
    while first < ensemble.count {
        let (clock, size) = (Clock::new(), shards * shard);
        let members = first..ensemble.count.min(first + size);
        first = members.end;
        run_members(system, &Block::new(ensemble, members, observed, interrupt.as_ref()), &mut results)?;
        if results.ended || results.monitor.poll().is_break() {
            break;
        }
        if !fixed {
            shards = if clock.elapsed() > MAX_TIME_BETWEEN_POLLS {
                (shards / 2).max(2)
            } else {
                (2 * shards).min(MAX_SHARDS_BETWEEN_POLLS)
            };
        }
    }
    Ok(results.tally)
}

/// Runs the members of a block together, or each by itself if one of them cannot start.
fn run_members(system: &dyn ManyMotions, block: &Block<'_>, results: &mut Results<'_>) -> Result<(), RuntimeError> {
    let Block { ensemble, observed, interrupt, .. } = *block;
    match system.run_block(block, results) {
        // A member that is checked before the run cannot start.
        Err(EnsembleError::Member { cause, .. }) if !is_common(&cause) => {}
        Err(error) => return Err(error.into()),
        Ok(tally) => {
            results.add(block, tally);
            return Ok(());
        }
    }
    for index in block.members.clone() {
        if results.ended {
            break;
        }
        let alone = Block::new(ensemble, index..index + 1, observed, interrupt);
        match system.run_block(&alone, results) {
            Err(EnsembleError::Member { cause, .. }) => {
                results.tally.members += 1;
                results.tally.failed += 1;
                let planned = matches!(ensemble.step_control, StepControl::Accuracy { .. });
                results.tally.own_plans += usize::from(planned);
                results.tally.first_failed = results.tally.first_failed.or(Some(index));
                let member = MemberEnd { index, ending: Err(cause), rows: Vec::new(), crossings: Vec::new() };
                results.ended = results.monitor.member(member).is_break();
            }
            Err(error) => return Err(error.into()),
            Ok(tally) => results.add(&alone, tally),
        }
    }
    Ok(())
}

/// Members that are run together.
pub(super) struct Block<'b> {
    pub ensemble: &'b Ensemble<'b>,
    pub members: Range<usize>,
    pub interrupt: Option<&'b Interrupt>,
    /// Whether each member has an observer.
    pub observed: bool,
    /// The events with the parameters of each member, where parameters differ.
    events: Option<Vec<Vec<Event>>>,
}

impl<'b> Block<'b> {
    fn new(
        ensemble: &'b Ensemble<'b>,
        members: Range<usize>,
        observed: bool,
        interrupt: Option<&'b Interrupt>,
    ) -> Self {
        let of = |varied: &Varied<'_>, index: usize| {
            let (mut events, values) = (ensemble.events.to_vec(), (varied.values)(index));
            let expressions = events.iter_mut().flat_map(Event::expressions_mut);
            expressions.for_each(|expression| set(expression, varied.names, &values));
            events
        };
        let varied = ensemble.varied.as_ref().filter(|_| !ensemble.events.is_empty());
        let events = varied.map(|varied| members.clone().map(|index| of(varied, index)).collect());
        Block { ensemble, members, interrupt, observed, events }
    }

    /// The start of the i-th of these members.
    pub fn start(&self, i: usize) -> Start {
        (self.ensemble.start)(self.members.start + i)
    }

    /// The observer of the i-th of these members; `None` for one with invalid parameters.
    pub fn observer<'r>(
        &'r self,
        i: usize,
        system: Option<&'r dyn Observed>,
    ) -> Result<MemberObserver<'r>, InputError> {
        let Ensemble { rows, columns, events, .. } = self.ensemble;
        let events = self.events.as_ref().and_then(|own| own.get(i)).map_or(*events, Vec::as_slice);
        let crossings = system.and_then(|system| Crossings::of(system, events, None));
        MemberObserver::new(rows.as_ref(), columns, crossings)
    }

    /// The columns, with the parameters of the i-th of these members.
    fn columns(&self, i: usize) -> Cow<'b, [Column]> {
        let Ensemble { varied, columns, .. } = self.ensemble;
        match varied {
            Some(varied) if columns.iter().any(|c| matches!(c, Column::Expression(_))) => {
                Cow::Owned(with_parameters(columns, varied, self.members.start + i))
            }
            _ => Cow::Borrowed(columns),
        }
    }
}

/// The members that have been passed on.
pub(super) struct Results<'m> {
    tally: Tally,
    monitor: &'m mut dyn EnsembleMonitor,
    ended: bool,
}

impl Results<'_> {
    /// Passes on a member of a block, which has this system.
    pub fn pass_on(&mut self, block: &Block<'_>, system: &dyn Observed, member: &Member, record: MemberRecord) {
        if self.ended {
            return;
        }
        let (MemberRecord { rows, last, crossings }, n) = (record, system.formula().dimension());
        let columns = block.columns(member.index);
        let ending = member.ending.as_ref().map_err(|cause| *cause);
        let ending = ending.map(|ending| {
            let row = end_of(system, ending, last.as_ref());
            Ending {
                status: ending.status,
                unresolved: ending.unresolved,
                steps: ending.steps,
                t: ending.t,
                q: coordinates(&row.q, n).to_vec(),
                v: row.v.as_ref().map_or_else(|| vec![f64::NAN; n], |v| coordinates(v, n).to_vec()),
                p: coordinates(&row.p, n).to_vec(),
                z: ending.state.z,
                columns: columns.iter().map(|column| number(system, column, &row)).collect(),
            }
        });
        let rows = rows.iter().map(|row| columns.iter().map(|column| number(system, column, row)).collect());
        let index = block.members.start + member.index;
        let member = MemberEnd { index, ending, rows: rows.collect(), crossings };
        self.ended = self.monitor.member(member).is_break();
    }

    /// Adds the numbers of the members of a block.
    fn add(&mut self, block: &Block<'_>, of_block: Tally) {
        self.tally.members += of_block.members;
        self.tally.completed += of_block.completed;
        self.tally.stopped += of_block.stopped;
        self.tally.failed += of_block.failed;
        self.tally.unresolved += of_block.unresolved;
        self.tally.batch_kernel += of_block.batch_kernel;
        self.tally.own_plans += of_block.own_plans;
        let first_failed = of_block.first_failed.map(|index| block.members.start + index);
        self.tally.first_failed = self.tally.first_failed.or(first_failed);
    }
}

/// Whether an error concerns all members, independently of their starts and parameters.
fn is_common(cause: &InputError) -> bool {
    use InputError as E;
    matches!(
        cause,
        E::Step { .. }
            | E::Span { .. }
            | E::Tolerance { .. }
            | E::Scale { .. }
            | E::TooMany { .. }
            | E::NoSteps
            | E::NoIntegrator
            | E::Times { .. }
            | E::Stages { .. }
            | E::Count { .. }
            | E::Unclaimed { .. }
            | E::Hypothesis { .. }
            | E::NoTimeTransformation
            | E::Forced { .. }
            | E::KinksUnderConstraints
    )
}

/// Sets the parameters of a member in an expression.
fn set(expression: &mut Expression, names: &[&str], values: &[f64]) {
    for (name, value) in names.iter().zip(values) {
        // A value that cannot be set has already caused the member to be refused.
        let _ = expression.set(name, *value);
    }
}

/// The columns with the parameters of a member.
fn with_parameters(columns: &[Column], varied: &Varied<'_>, index: usize) -> Vec<Column> {
    let (mut own, values) = (columns.to_vec(), (varied.values)(index));
    for column in &mut own {
        if let Column::Expression(expression) = column {
            set(expression, varied.names, &values);
        }
    }
    own
}

/// The end of a member as a row.
fn end_of(system: &dyn Observed, ending: &discrete_herglotz::ensemble::Ending, last: Option<&Row>) -> Row {
    let (t, x) = (ending.t, &ending.state);
    // A row at another time belongs to the end of the step in which the member ended.
    let of_the_end = last.filter(|row| row.t == t);
    let v = of_the_end.and_then(|row| row.v.clone()).or_else(|| {
        let guess = last.map_or_else(|| Vector::zeros(x.q.len()), |row| row.p.clone());
        system.velocity(t, x, &guess)
    });
    let energy = system.energy(t, x, v.as_ref());
    Row {
        t,
        q: x.q.clone(),
        v,
        p: x.p.clone(),
        z: Some(x.z),
        energy,
        log_factor: of_the_end.and_then(|r| r.log_factor),
        columns: Vec::new(),
    }
}
