//! Many motions of rigid bodies.

use super::integrator::BodyMethod;
use super::{Body, BodyMotion, BodyOutcome};
use crate::{Crossing, Interrupt, RunMonitor, RuntimeError, StepControl};
use discrete_herglotz::ensemble::{EnsembleError, Tally};
use discrete_herglotz::groups::GroupStatus;
use std::num::NonZero;
use std::ops::{ControlFlow, Range};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{Builder, available_parallelism, scope};

/// The number of members for each thread whose results are kept until they are handed on in their order.
const MEMBERS_PER_THREAD: usize = 32;

/// Many motions of rigid bodies, run on several threads: the body and the motion of a member are functions of its index.
/// The results do not depend on the number of threads.
///
/// ```
/// use herglotz_runtime::{Body, BodyEnsemble, BodyMember, BodyMotion, StepControl};
/// use std::ops::ControlFlow;
/// let member = |i: usize| {
///     let body = Body { inertia: Body::principal([1.0, 2.0, 3.0]), gamma: -0.1 * i as f64, ..Body::default() };
///     let accuracy = StepControl::Accuracy { error: 1e-6, by: None };
///     (body, BodyMotion::new([1.0, 0.0, 0.0, 0.0], [1.0, 0.5, 0.25], 1.0, accuracy))
/// };
/// let ensemble = BodyEnsemble { count: 4, member: &member, threads: None, interrupt: None };
/// let tally = ensemble.run(&mut |_: BodyMember| ControlFlow::Continue(()))?;
/// assert_eq!(tally.completed, 4);
/// # Ok::<(), herglotz_runtime::RuntimeError>(())
/// ```
pub struct BodyEnsemble<'a> {
    /// The number of members.
    pub count: usize,
    /// The body and the motion of each member.
    pub member: &'a (dyn Fn(usize) -> (Body, BodyMotion) + Sync),
    /// The number of threads; the number of processors where it is `None`.
    pub threads: Option<usize>,
    /// A condition that ends the ensemble and the running members, which are not handed on.
    pub interrupt: Option<Interrupt>,
}

/// The result of a member of an ensemble of rigid bodies.
#[derive(Debug)]
pub struct BodyMember {
    /// The index of the member, counted from 0.
    pub index: usize,
    /// The final state; an error where the motion could not start.
    pub outcome: Result<BodyOutcome, RuntimeError>,
    /// The recorded rows.
    pub rows: Vec<Vec<f64>>,
    /// The sign changes of events that were found, in order of occurrence.
    pub crossings: Vec<Crossing>,
}

/// Keeps the rows and the sign changes of a member.
struct Record<'i> {
    rows: Vec<Vec<f64>>,
    crossings: Vec<Crossing>,
    interrupt: Option<&'i Interrupt>,
}

impl RunMonitor for Record<'_> {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        self.rows.push(numbers.to_vec());
        ControlFlow::Continue(())
    }

    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.crossings.push(crossing.clone());
        ControlFlow::Continue(())
    }

    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        if self.interrupt.is_some_and(Interrupt::is_wanted) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

impl BodyEnsemble<'_> {
    /// Runs the members and hands them on in the order of their index, on the calling thread, until `hand_on` breaks. A
    /// member that cannot start is handed on with its error.
    ///
    /// # Errors
    /// [`RuntimeError::Ensemble`] without members or threads; [`RuntimeError::Argument`] for an integrator that rigid
    /// bodies do not have.
    pub fn run(&self, hand_on: &mut dyn FnMut(BodyMember) -> ControlFlow<()>) -> Result<Tally, RuntimeError> {
        if self.count == 0 {
            return Err(EnsembleError::Empty.into());
        }
        let threads = self.threads.unwrap_or_else(|| available_parallelism().map_or(1, NonZero::get));
        if threads == 0 {
            return Err(EnsembleError::Threads.into());
        }
        // The integrator of all members is refused once.
        let (body, motion) = (self.member)(0);
        let is_forced = body.torque.is_some();
        let by = match motion.step_control {
            StepControl::Accuracy { by, .. } => by.unwrap_or(BodyMethod::default_for(is_forced)),
            StepControl::Steps { by, .. } => by,
        };
        BodyMethod::check(by, is_forced)?;
        let (mut tally, mut first) = (Tally::default(), 0);
        while first < self.count {
            let members = first..self.count.min(first + MEMBERS_PER_THREAD * threads);
            first = members.end;
            for (member, planned) in self.block(members, threads) {
                if self.is_interrupted() {
                    return Ok(tally);
                }
                count(&mut tally, &member, planned);
                if hand_on(member).is_break() {
                    return Ok(tally);
                }
            }
        }
        Ok(tally)
    }

    fn is_interrupted(&self) -> bool {
        self.interrupt.as_ref().is_some_and(Interrupt::is_wanted)
    }

    /// Runs some members on several threads, the calling thread among them. With each, whether its steps were selected
    /// for it.
    fn block(&self, members: Range<usize>, threads: usize) -> Vec<(BodyMember, bool)> {
        let next = AtomicUsize::new(members.start);
        let work = || {
            let mut done = Vec::new();
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= members.end || self.is_interrupted() {
                    return done;
                }
                done.push(self.run_member(index));
            }
        };
        let mut all = scope(|scope| {
            // If a thread cannot be started, the others do its work.
            let start = |_| Builder::new().spawn_scoped(scope, work).ok();
            let others: Vec<_> = (1..threads.min(members.len())).filter_map(start).collect();
            let mut all = work();
            for other in others {
                match other.join() {
                    Ok(members) => all.extend(members),
                    Err(panicked) => std::panic::resume_unwind(panicked),
                }
            }
            all
        });
        all.sort_by_key(|(member, _)| member.index);
        all
    }

    fn run_member(&self, index: usize) -> (BodyMember, bool) {
        let (body, motion) = (self.member)(index);
        // The trial runs of the member are interrupted too.
        let motion = BodyMotion { interrupt: self.interrupt.clone().or(motion.interrupt.clone()), ..motion };
        let mut record = Record { rows: Vec::new(), crossings: Vec::new(), interrupt: self.interrupt.as_ref() };
        let outcome = body.run(&motion, &mut record);
        let planned = matches!(motion.step_control, StepControl::Accuracy { .. });
        (BodyMember { index, outcome, rows: record.rows, crossings: record.crossings }, planned)
    }
}

/// Counts a member by the way in which it ended, and by whether its steps were selected for it.
fn count(tally: &mut Tally, member: &BodyMember, planned: bool) {
    tally.members += 1;
    tally.own_plans += usize::from(planned);
    match member.outcome.as_ref().map(|outcome| outcome.status) {
        Ok(GroupStatus::Completed) => tally.completed += 1,
        Ok(GroupStatus::Event { .. } | GroupStatus::Stopped { .. }) => tally.stopped += 1,
        Ok(GroupStatus::Failed { .. }) | Err(_) => {
            tally.failed += 1;
            tally.first_failed = tally.first_failed.or(Some(member.index));
        }
    }
}
