//! Many motions at once.

use super::Sized;
use super::recorder::{number, rows};
use crate::{Column, Ending, EnsembleWatch, MemberEnd, RuntimeError, Way, When};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, VelocityPoint};
use discrete_herglotz::{
    Ensemble, EnsembleError, InputError, Member, Row, Rows, Start, Tally, Until, legendre_inverse,
};
use formula_lagrangian::FormulaLagrangian;
use std::ops::Range;

/// The members between two polls: whole shards of the lanes.
const BLOCK: usize = 24 * 384;

/// Those where each has a Lagrangian or rows of its own.
const OWN_BLOCK: usize = 384;

/// Runs it block by block, so that it can be ended and its memory does not grow.
pub(super) fn run<const N: usize>(
    system: &Sized<N>,
    ensemble: &crate::Ensemble<'_>,
    watch: &mut dyn EnsembleWatch,
) -> Result<Tally, RuntimeError> {
    if ensemble.count == 0 {
        return Err(EnsembleError::Empty.into());
    }
    if let Some(varied) = &ensemble.varied {
        let mut lagrangian = system.0.clone();
        varied.names.iter().try_for_each(|name| lagrangian.set(name, 0.0))?;
    }
    let observed = ensemble.rows.is_some() || ensemble.columns.iter().any(|c| matches!(c, Column::LogFactor));
    let size = if ensemble.varied.is_some() || observed { OWN_BLOCK } else { BLOCK };
    let (mut tally, mut first) = (Tally::default(), 0);
    while first < ensemble.count {
        let members = first..ensemble.count.min(first + size);
        first = members.end;
        let mut block = Block { system, ensemble, members, tally: &mut tally, watch, ended: false };
        block.run(observed)?;
        if block.ended || watch.poll().is_break() {
            break;
        }
    }
    Ok(tally)
}

/// Members that are run together.
struct Block<'b, const N: usize> {
    system: &'b Sized<N>,
    ensemble: &'b crate::Ensemble<'b>,
    members: Range<usize>,
    tally: &'b mut Tally,
    watch: &'b mut dyn EnsembleWatch,
    ended: bool,
}

impl<const N: usize> Block<'_, N> {
    fn run(&mut self, observed: bool) -> Result<(), RuntimeError> {
        match self.run_as_one(self.members.clone(), observed) {
            // Some members that were looked at before cannot begin: each by itself.
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
                    let member = MemberEnd { index, ending: Err(cause), rows: Vec::new() };
                    self.ended = self.watch.member(member).is_break();
                }
                Err(error) => return Err(error.into()),
                Ok(()) => {}
            }
        }
        Ok(())
    }

    fn run_as_one(&mut self, members: Range<usize>, observed: bool) -> Result<(), EnsembleError> {
        let Block { system, ensemble, .. } = *self;
        let crate::Ensemble { t0, end, way, columns, .. } = *ensemble;
        let first = members.start;
        let start = |i: usize| system.start_of_member(&(ensemble.start)(first + i));
        let own: Option<Vec<Option<FormulaLagrangian<N>>>> = ensemble.varied.as_ref().map(|varied| {
            let with = |i: usize| {
                let mut lagrangian = system.0.clone();
                let values = (varied.values)(i);
                let set = varied.names.iter().zip(values).try_for_each(|(name, value)| lagrangian.set(name, value));
                set.is_ok().then_some(lagrangian)
            };
            members.clone().map(with).collect()
        });
        let lagrangian = |i: usize| own.as_ref().map_or(Some(&system.0), |own| own.get(i).and_then(Option::as_ref));
        let many = match &own {
            None => Ensemble::new(&system.0, t0, members.len(), start),
            // One whose parameters are no numbers has no start either.
            Some(_) => Ensemble::of(t0, members.len(), |i| match lagrangian(i) {
                Some(lagrangian) => (lagrangian, start(i)),
                None => (&system.0, no_start()),
            }),
        };
        let many = match way {
            Way::Accuracy { wanted, by: None } => many.accuracy(wanted),
            Way::Accuracy { wanted, by: Some(by) } => many.by(by).accuracy(wanted),
            Way::Steps { by, steps } => many.by(by).steps(steps),
        };
        let many = match ensemble.threads {
            Some(threads) => many.threads(threads),
            None => many,
        };
        let (watch, ended) = (&mut *self.watch, &mut self.ended);
        let mut hand_on = |member: &Member<N>, recorded: Vec<Row<N>>| {
            if *ended {
                return;
            }
            // Expressions have the parameters of the member.
            let of_member = ensemble.varied.as_ref().and_then(|varied| {
                let values = (varied.values)(first + member.index);
                let pairs = || varied.names.iter().copied().zip(values.iter().copied());
                let is_expression = |column: &Column| matches!(column, Column::Expression(_));
                columns.iter().any(is_expression).then(|| columns.iter().map(|c| with(c, pairs())).collect::<Vec<_>>())
            });
            let columns = of_member.as_deref().unwrap_or(columns);
            let last = recorded.last();
            let ending = member.ending.as_ref().map_err(|cause| *cause);
            let ending = ending.map(|ending| {
                let l = lagrangian(member.index).unwrap_or(&system.0);
                let row = end_of(l, ending, last);
                Ending {
                    status: ending.status,
                    suspicion: ending.suspicion,
                    steps: ending.steps,
                    t: ending.t,
                    q: row.q.as_slice().to_vec(),
                    v: row.v.unwrap_or_else(|| SVector::repeat(f64::NAN)).as_slice().to_vec(),
                    p: row.p.as_slice().to_vec(),
                    z: ending.state.z,
                    columns: columns.iter().map(|column| number(column, &row)).collect(),
                }
            });
            let rows = if ensemble.rows.is_some() { recorded } else { Vec::new() };
            let rows = rows.iter().map(|row| columns.iter().map(|column| number(column, row)).collect());
            let member = MemberEnd { index: first + member.index, ending, rows: rows.collect() };
            *ended = watch.member(member).is_break();
        };
        let until = Until::Time(end);
        let of_block = if observed {
            let when = ensemble.rows.clone().unwrap_or(When::Every(usize::MAX));
            let seen = |rows: Rows<'_, N>| rows.rows;
            let many = many.observe(|_| rows::<N>(&when, columns), seen);
            many.run(until, |member, rows| hand_on(member, rows.unwrap_or_default()))?
        } else {
            many.run(until, |member| hand_on(member, Vec::new()))?
        };
        self.tally.members += of_block.members;
        self.tally.completed += of_block.completed;
        self.tally.failed += of_block.failed;
        self.tally.suspicious += of_block.suspicious;
        self.tally.in_lanes += of_block.in_lanes;
        let first_failed = of_block.first_failed.map(|index| first + index);
        self.tally.first_failed = self.tally.first_failed.or(first_failed);
        Ok(())
    }
}

/// Whether what is wrong holds for all members, whatever their starts and parameters.
fn is_common(cause: &InputError) -> bool {
    use InputError as E;
    matches!(
        cause,
        E::Step { .. }
            | E::Span { .. }
            | E::Tolerance { .. }
            | E::TooMany { .. }
            | E::NoSteps
            | E::NoIntegrator
            | E::Times { .. }
            | E::Stages { .. }
            | E::Count { .. }
            | E::Unclaimed { .. }
            | E::Hypothesis { .. }
    )
}

/// A column with other values of parameters.
fn with<'v>(column: &Column, values: impl Iterator<Item = (&'v str, f64)>) -> Column {
    let mut column = column.clone();
    if let Column::Expression(expression) = &mut column {
        for (name, value) in values {
            // A member whose parameters are no numbers does not begin.
            let _ = expression.set(name, value);
        }
    }
    column
}

/// No start, which a run refuses.
fn no_start<const N: usize>() -> Start<N> {
    let none = SVector::repeat(f64::NAN);
    VelocityPoint { q: none, v: none, z: f64::NAN }.into()
}

impl<const N: usize> Sized<N> {
    fn start_of_member(&self, start: &crate::Start) -> Start<N> {
        self.start(start).unwrap_or_else(|_| no_start())
    }
}

/// The end of a member as a row.
fn end_of<const N: usize>(
    lagrangian: &FormulaLagrangian<N>,
    ending: &discrete_herglotz::Ending<N>,
    last: Option<&Row<N>>,
) -> Row<N> {
    let (t, x) = (ending.t, &ending.state);
    let v = last.and_then(|row| row.v).or_else(|| {
        let guess = last.map_or_else(SVector::zeros, |row| row.p);
        legendre_inverse(lagrangian, t, x, &guess).ok().map(|x| x.v)
    });
    let energy = v.map(|v| v.dot(&x.p) - lagrangian.value(t, &x.q, &v, x.z));
    Row { t, q: x.q, v, p: x.p, z: Some(x.z), energy, log_factor: last.and_then(|r| r.log_factor), columns: Vec::new() }
}
