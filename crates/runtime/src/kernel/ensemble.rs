//! Ensembles: many motions at once.

use super::formula_system::{FormulaSystem, Observed};
use super::observed::{MemberObserver, MemberRecord};
use super::recorder::{Crossings, check_events, number};
use super::sized::{Sized, coordinates};
use crate::{Column, Ending, EnsembleMonitor, Event, Interrupt, MemberEnd, RuntimeError, StepControl, Varied};
use contact_geom::VelocityPoint;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::{
    Ensemble, InputError, Row, Start, Until, Vector,
    ensemble::{EnsembleError, Member, Tally},
    theory::legendre_inverse,
};
use formula_lagrangian::Expression;
use std::borrow::Cow;
use std::ops::Range;
use std::time::{Duration, Instant};

/// The number of members that are computed together in SIMD lanes: a multiple of every number of lanes.
const SHARD_MEMBERS: usize = 384;

/// The number of members in a shard whose members are observed, each in a run of its own: few, since their records are
/// stored until the shard ends.
const OBSERVED_SHARD_MEMBERS: usize = 16;

/// The maximal number of these shards between two polls, so that a block has no more than some thousand members.
const MAX_SHARDS_BETWEEN_POLLS: usize = 24;

/// The time between two polls above which blocks are made smaller: a user does not notice it.
const MAX_TIME_BETWEEN_POLLS: Duration = Duration::from_millis(100);

/// Runs an ensemble block by block, so that it can be interrupted and its memory does not grow.
pub(super) fn run<L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    ensemble: &crate::Ensemble<'_>,
    monitor: &mut dyn EnsembleMonitor,
) -> Result<Tally, RuntimeError> {
    if ensemble.count == 0 {
        return Err(EnsembleError::Empty.into());
    }
    if let Some(varied) = &ensemble.varied {
        let mut lagrangian = system.0.clone();
        varied.names.iter().try_for_each(|name| lagrangian.set(name, 0.0))?;
    }
    check_events(&system.0, ensemble.events)?;
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
    let (mut tally, mut first) = (Tally::default(), 0);
    while first < ensemble.count {
        let (clock, size) = (Instant::now(), shards * shard);
        let members = first..ensemble.count.min(first + size);
        first = members.end;
        let mut block = Block {
            system,
            ensemble,
            members,
            tally: &mut tally,
            interrupt: interrupt.as_ref(),
            monitor,
            ended: false,
        };
        block.run(observed)?;
        if block.ended || monitor.poll().is_break() {
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
    Ok(tally)
}

/// Members that are run together.
struct Block<'b, L, const N: usize> {
    system: &'b Sized<L, N>,
    ensemble: &'b crate::Ensemble<'b>,
    members: Range<usize>,
    tally: &'b mut Tally,
    interrupt: Option<&'b Interrupt>,
    monitor: &'b mut dyn EnsembleMonitor,
    ended: bool,
}

impl<L: FormulaSystem<N>, const N: usize> Block<'_, L, N> {
    fn run(&mut self, observed: bool) -> Result<(), RuntimeError> {
        match self.run_as_one(self.members.clone(), observed) {
            // A member that is checked before the run cannot start: run each member by itself.
            Err(EnsembleError::Member { cause, .. }) if !is_common(&cause) => {}
            Err(error) => return Err(error.into()),
            Ok(()) => return Ok(()),
        }
        for index in self.members.clone() {
            if self.ended {
                break;
            }
            match self.run_as_one(index..index + 1, observed) {
                Err(EnsembleError::Member { cause, .. }) => {
                    self.tally.members += 1;
                    self.tally.failed += 1;
                    self.tally.first_failed = self.tally.first_failed.or(Some(index));
                    let member = MemberEnd { index, ending: Err(cause), rows: Vec::new(), crossings: Vec::new() };
                    self.ended = self.monitor.member(member).is_break();
                }
                Err(error) => return Err(error.into()),
                Ok(()) => {}
            }
        }
        Ok(())
    }

    fn run_as_one(&mut self, members: Range<usize>, observed: bool) -> Result<(), EnsembleError> {
        let Block { system, ensemble, .. } = *self;
        let crate::Ensemble { t0, end, step_control, columns, events, .. } = *ensemble;
        let (first, n) = (members.start, system.0.formula().dimension());
        let start = |i: usize| system.start_of_member(&(ensemble.start)(first + i));
        let own: Option<Vec<Option<MemberSystem<L>>>> = ensemble.varied.as_ref().map(|varied| {
            let with = |i: usize| {
                let mut lagrangian = system.0.clone();
                let values = (varied.values)(i);
                let all = varied.names.iter().zip(&values);
                all.clone().try_for_each(|(name, value)| lagrangian.set(name, *value)).ok()?;
                let mut events = events.to_vec();
                let expressions = events.iter_mut().flat_map(Event::expressions_mut);
                expressions.for_each(|expression| set(expression, varied.names, &values));
                Some(MemberSystem { lagrangian, events })
            };
            members.clone().map(with).collect()
        });
        let own_of = |i: usize| own.as_ref().map(|own| own.get(i).and_then(Option::as_ref));
        let lagrangian = |i: usize| own_of(i).map_or(Some(&system.0), |own| own.map(|own| &own.lagrangian));
        let many = match &own {
            None => Ensemble::new(&system.0, t0, members.len(), start),
            // A member with invalid parameters gets an invalid start, so that it is refused.
            Some(_) => Ensemble::of(t0, members.len(), |i| match lagrangian(i) {
                Some(lagrangian) => (lagrangian, start(i)),
                None => (&system.0, invalid_start()),
            }),
        };
        let refused = |cause| EnsembleError::Member { index: first, cause };
        let by = match step_control {
            StepControl::Accuracy { by, .. } => by,
            StepControl::Steps { by, .. } => Some(by),
        };
        let many = match (step_control, system.0.constrained(by).map_err(refused)?) {
            (StepControl::Accuracy { error, .. }, Some(method)) => many.by(method).accuracy(error),
            (StepControl::Steps { steps, .. }, Some(method)) => many.by(method).steps(steps),
            (StepControl::Accuracy { error, by: None }, None) => many.accuracy(error),
            (StepControl::Accuracy { error, by: Some(by) }, None) => {
                many.by(L::by(by).map_err(refused)?).accuracy(error)
            }
            (StepControl::Steps { by, steps }, None) => many.by(L::by(by).map_err(refused)?).steps(steps),
        };
        let many = match ensemble.threads {
            Some(threads) => many.threads(threads),
            None => many,
        };
        let many = match self.interrupt {
            Some(interrupt) => many.with_interrupt(interrupt.for_integrators()),
            None => many,
        };
        let own_columns = |i: usize| match &ensemble.varied {
            Some(varied) if columns.iter().any(|c| matches!(c, Column::Expression(_))) => {
                Cow::Owned(with_parameters(columns, varied, first + i))
            }
            _ => Cow::Borrowed(columns),
        };
        let (monitor, ended) = (&mut *self.monitor, &mut self.ended);
        let mut pass_on = |member: &Member<N>, MemberRecord { rows, last, crossings }: MemberRecord| {
            if *ended {
                return;
            }
            let ending = member.ending.as_ref().map_err(|cause| *cause);
            let ending = ending.map(|ending| {
                let l = lagrangian(member.index).unwrap_or(&system.0);
                let row = end_of(l, ending, last.as_ref());
                Ending {
                    status: ending.status,
                    unresolved: ending.unresolved,
                    steps: ending.steps,
                    t: ending.t,
                    q: coordinates(&row.q, n).to_vec(),
                    v: row.v.as_ref().map_or_else(|| vec![f64::NAN; n], |v| coordinates(v, n).to_vec()),
                    p: coordinates(&row.p, n).to_vec(),
                    z: ending.state.z,
                    columns: own_columns(member.index).iter().map(|column| number(l, column, &row)).collect(),
                }
            });
            let columns = own_columns(member.index);
            let l = lagrangian(member.index).unwrap_or(&system.0);
            let rows = rows.iter().map(|row| columns.iter().map(|column| number(l, column, row)).collect());
            let member = MemberEnd { index: first + member.index, ending, rows: rows.collect(), crossings };
            *ended = monitor.member(member).is_break();
        };
        let until = Until::Time(end);
        let of_block = if observed {
            let observer = |i: usize| {
                let events = own_of(i).map_or(Some(events), |own| own.map(|own| own.events.as_slice()));
                let crossings =
                    lagrangian(i).zip(events).and_then(|(l, events)| Crossings::of(l as &dyn Observed, events, None));
                MemberObserver::new(ensemble.rows.as_ref(), columns, crossings)
            };
            let many = many.observe(observer, MemberObserver::into_record);
            many.run(until, |member, record| pass_on(member, record.unwrap_or_default()))?
        } else {
            many.run(until, |member| pass_on(member, MemberRecord::default()))?
        };
        self.tally.members += of_block.members;
        self.tally.completed += of_block.completed;
        self.tally.stopped += of_block.stopped;
        self.tally.failed += of_block.failed;
        self.tally.unresolved += of_block.unresolved;
        self.tally.batch_kernel += of_block.batch_kernel;
        let first_failed = of_block.first_failed.map(|index| first + index);
        self.tally.first_failed = self.tally.first_failed.or(first_failed);
        Ok(())
    }
}

/// The Lagrangian and the events of a member with parameters of its own.
struct MemberSystem<L> {
    lagrangian: L,
    events: Vec<Event>,
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

/// An invalid start, which every run refuses.
pub(super) fn invalid_start<const N: usize>() -> Start<N> {
    let none = SVector::repeat(f64::NAN);
    VelocityPoint { q: none, v: none, z: f64::NAN }.into()
}

impl<L: FormulaSystem<N>, const N: usize> Sized<L, N> {
    pub(super) fn start_of_member(&self, start: &crate::Start) -> Start<N> {
        self.start(start).unwrap_or_else(|_| invalid_start())
    }
}

/// The end of a member as a row.
fn end_of<L: FormulaSystem<N>, const N: usize>(
    lagrangian: &L,
    ending: &discrete_herglotz::ensemble::Ending<N>,
    last: Option<&Row>,
) -> Row {
    let (t, x) = (ending.t, &ending.state);
    // A row at another time belongs to the end of the step in which the member ended.
    let of_the_end = last.filter(|row| row.t == t);
    let v = of_the_end.and_then(|row| row.v.as_ref().map(Vector::fixed)).or_else(|| {
        let guess = last.map_or_else(SVector::zeros, |row| row.p.fixed());
        legendre_inverse(lagrangian, t, x, &guess).ok().map(|x| x.v)
    });
    let energy = if const { L::HINTS.hamiltonian } {
        lagrangian.hamiltonian_with_gradient(t, x).map(|(h, _)| h)
    } else {
        v.map(|v| v.dot(&x.p) - lagrangian.value(t, &x.q, &v, x.z))
    };
    Row {
        t,
        q: x.q.into(),
        v: v.map(Vector::from),
        p: x.p.into(),
        z: Some(x.z),
        energy,
        log_factor: of_the_end.and_then(|r| r.log_factor),
        columns: Vec::new(),
    }
}
