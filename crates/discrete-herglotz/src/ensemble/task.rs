//! An ensemble after its checks, which is computed shard by shard.

use crate::ensemble::error::EnsembleError;
use crate::ensemble::lane::{Lane, LaneOptions, LaneStatus};
use crate::ensemble::member::{Ending, Member};
use crate::ensemble::members::{LaneKernel, MemberSteps, Members};
use crate::ensemble::settings::Settings;
use crate::ensemble::single::{Common, LongestPlan};
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::{branched, forget_branches};
use crate::numbers::state_words::digest;
use crate::run::{may_drift, rows};
use crate::{InputError, Interrupt, Observer, Rows, State, Status, Steps, Until, Vector};
use std::ops::Range;

/// The number of members that are computed, saved and handed on together: whole packs of one to four registers of at
/// most eight lanes.
pub(crate) const MEMBERS_PER_SHARD: usize = 384;

/// The kernels for the members of one Lagrangian: for the steps and, if an error is requested, for twice as many steps.
/// Without a kernel each member has a run of its own.
pub(crate) type LaneKernels<'a> = [Option<Box<dyn LaneKernel + 'a>>; 2];

/// The number of steps for which one is added to the largest number of the checked members: an eighth, since other
/// members may need more. The few that need still more have a run of their own.
const STEPS_PER_EXTRA_STEP: usize = 8;

/// An ensemble after its checks.
pub(crate) struct Task<'e> {
    pub members: &'e dyn Members,
    pub count: usize,
    pub instructions: Instructions,
    pub check_resolution: bool,
    pub common: Common,
    /// The step size and the number of steps.
    pub plan: (f64, usize),
    /// Whether there are steps for lanes: not where equal steps suit none of the checked members, or one of them comes to
    /// rest, since lanes would take steps after that, and have no accuracy there.
    pub takes_lanes: bool,
    pub interrupt: Option<Interrupt<'e>>,
    /// The kernels of all members, if they have one Lagrangian.
    pub kernels: Option<LaneKernels<'e>>,
    pub fingerprint: u64,
}

/// The members of a shard, with their results.
pub(crate) struct Shard {
    pub members: Vec<Member>,
    pub batch_kernel: usize,
    /// Whether members that have not completed contain the cause; those that were decoded from words do not.
    pub with_causes: bool,
}

/// A member before its run: its index, the address of its Lagrangian, and the state of its start if it is finite.
type Before = (usize, *const (), Option<State>);

/// A time and a state.
type At<'s> = (f64, &'s State);

impl<'e> Task<'e> {
    /// Checks the common input of all members, and all input of some of them. Members with observers have runs of their
    /// own.
    pub(crate) fn checked(
        members: &'e dyn Members,
        settings: &'e Settings<'_>,
        until: Until,
        observed: bool,
    ) -> Result<Self, EnsembleError> {
        let Settings { count, instructions, interrupt, .. } = *settings;
        let common = Common { until, action: settings.action, rows: settings.rows };
        if let Some(stride) = settings.rows {
            Rows::every(stride).map_err(|cause| EnsembleError::Member { index: 0, cause })?;
        }
        let longest_plan = |steps| common.longest_plan(members, settings.sample(), (steps, interrupt));
        let mut takes_lanes = members.batch_kernel().is_some() && !observed;
        let LongestPlan { mut planned, rests } =
            longest_plan(if takes_lanes { MemberSteps::Common } else { MemberSteps::Own })?;
        if planned.is_err() && takes_lanes && members.selects_integrator() {
            // Equal steps suit none of these members; runs of their own may have others.
            takes_lanes = false;
            planned = longest_plan(MemberSteps::Own)?.planned;
        }
        takes_lanes &= !rests;
        if observed && let Err(EnsembleError::Member { index, cause: InputError::Accuracy { .. } }) = planned {
            // The observer of a member may end its motion before it becomes too difficult.
            planned = Ok((index, (0.0, 0)));
        }
        let (index, mut plan) = planned?;
        let refused = |cause| EnsembleError::Member { index, cause };
        let to_accuracy = members.requested_error().is_some();
        if to_accuracy && takes_lanes {
            let steps = Steps::Count(plan.1 + plan.1.div_ceil(STEPS_PER_EXTRA_STEP));
            plan = common.plan(members, index, (MemberSteps::Given(steps), interrupt)).map_err(refused)?.0;
        }
        rows::check(common.rows_of(plan.1).saturating_mul(count.min(MEMBERS_PER_SHARD))).map_err(refused)?;
        let check_resolution = settings.check_resolution && !to_accuracy;
        let mut task = Task {
            members,
            count,
            instructions,
            check_resolution,
            common,
            plan,
            takes_lanes,
            interrupt,
            kernels: None,
            fingerprint: 0,
        };
        task.fingerprint = task.fingerprint_of(settings.sample());
        if settings.shared {
            task.kernels = Some(task.kernels_of(index, members.start(index).1.as_ref()));
        }
        Ok(task)
    }

    /// Whether so many motions of one Lagrangian take less time by runs of their own than in lanes.
    fn has_few(&self, count: usize) -> bool {
        self.members.batch_kernel().is_some_and(|kernel| count < kernel.fewest())
    }

    /// The kernels for the Lagrangian of a member, whose constants are read at a state.
    pub(crate) fn kernels_of(&self, index: usize, state: Option<&State>) -> LaneKernels<'e> {
        let (h, steps) = self.plan;
        let Some(state) = state.filter(|_| self.takes_lanes) else { return [None, None] };
        let kernel = |plan| self.members.kernel((index, state), plan, self.interrupt);
        [kernel(self.plan), self.members.requested_error().and_then(|_| kernel((0.5 * h, 2 * steps)))]
    }

    /// A digest that identifies the ensemble: of the integrator, the steps, and the starts and L of some members.
    pub(crate) fn fingerprint_of(&self, sample: impl Iterator<Item = usize>) -> u64 {
        let (Common { action, rows, .. }, members) = (self.common, self.members);
        let n = members.dimension() as u64;
        let mut words = vec![n, self.count as u64, members.t0().to_bits(), action.into(), self.plan.0.to_bits()];
        words.extend([self.plan.1, rows.unwrap_or(0)].map(|x| x as u64));
        words.push(members.requested_error().unwrap_or(0.0).to_bits());
        words.extend(members.info().name.bytes().map(u64::from));
        // The steps of other members are not those of this integrator.
        words.extend(members.selects_integrator().then_some(1));
        words.extend(sample.flat_map(|index| members.digits(index)).map(f64::to_bits));
        digest(&words)
    }

    /// The indices of the members of a shard; empty if there is no such shard.
    pub(crate) fn members_of(&self, shard: usize) -> Range<usize> {
        let first = shard.saturating_mul(MEMBERS_PER_SHARD).min(self.count);
        first..self.count.min(first.saturating_add(MEMBERS_PER_SHARD))
    }

    /// Runs the members again that have not completed.
    pub(crate) fn run_again(&self, shard: &mut Shard) {
        for member in shard.members.iter_mut().filter(|member| member.ending.is_err()) {
            *member = self.run_single(member.index, None::<&mut Rows<'_>>);
        }
    }

    /// How many of so many members with runs of their own have plans of their own.
    pub(crate) fn own_plans(&self, runs: usize) -> usize {
        if self.members.requested_error().is_some() { runs } else { 0 }
    }

    /// Runs a member with a run of its own, and with an observer if there is one.
    pub(crate) fn run_single(&self, index: usize, observer: Option<&mut impl Observer>) -> Member {
        self.common.run(self.members, index, observer, self.interrupt)
    }

    /// Runs the members of a shard.
    pub(crate) fn shard(&self, shard: usize) -> Shard {
        let range = self.members_of(shard);
        let before = |index| {
            let (lagrangian, state) = self.members.start(index);
            (index, lagrangian, state)
        };
        let starts: Vec<Before> = range.clone().map(before).collect();
        let member = |index| Member { index, ending: Err(InputError::NoSteps), rows: Vec::new() };
        let mut members: Vec<_> = range.map(member).collect();
        let mut batch_kernel = 0;
        let mut from = 0;
        // Consecutive members with the same Lagrangian.
        for group in starts.chunk_by(|a, b| a.1 == b.1) {
            batch_kernel += self.group(group, &mut members[from..from + group.len()]);
            from += group.len();
        }
        Shard { members, batch_kernel, with_causes: true }
    }

    /// Runs members of one Lagrangian; returns how many of them were completed in lanes.
    fn group(&self, starts: &[Before], members: &mut [Member]) -> usize {
        let Some(first) = starts.first().map(|start| start.0) else { return 0 };
        let mut own = None;
        let [kernel, finer] = self.kernels.as_ref().unwrap_or_else(|| {
            let state = starts.iter().find_map(|(_, _, state)| state.as_ref());
            own.insert(self.kernels_of(first, state.filter(|_| !self.has_few(starts.len()))))
        });
        let mut done = [false; MEMBERS_PER_SHARD];
        let (kernel, finer) = (kernel.as_deref(), finer.as_deref());
        let mut batch_kernel = 0;
        if kernel.is_some() {
            self.members.with_system(first, &mut |system| {
                let (structure, action) = (system.structure(), self.common.action);
                let dissipates = structure.autonomous && structure.has_constant_rate() && (structure.z_free || action);
                let order = self.members.info().order;
                let drifts = |from: At<'_>, to: At<'_>| dissipates && may_drift(system, order, from, to);
                batch_kernel = self.in_lanes([kernel, finer], starts, (&mut *members, &mut done), &drifts);
            });
        }
        for (member, _) in members.iter_mut().zip(done).filter(|(_, done)| !done) {
            *member = self.run_single(member.index, None::<&mut Rows<'_>>);
        }
        batch_kernel
    }

    /// Runs members of one Lagrangian in lanes; returns how many of them were completed. `done` notes which have a result.
    fn in_lanes(
        &self,
        [kernel, finer]: [Option<&dyn LaneKernel>; 2],
        starts: &[Before],
        (members, done): (&mut [Member], &mut [bool]),
        may_drift: &dyn Fn(At<'_>, At<'_>) -> bool,
    ) -> usize {
        let (Common { action, rows, .. }, t0, (h, steps)) = (self.common, self.members.t0(), self.plan);
        let Some(kernel) = kernel else { return 0 };
        let all =
            starts.iter().enumerate().filter_map(|(place, (_, _, state))| state.as_ref().map(|state| (place, state)));
        let states: Vec<(usize, &State)> = all.filter(|(_, state)| !kernel.needs_single_run(state)).collect();
        let most_rows = rows.map(|_| self.common.rows_of(steps));
        let lanes = |rows, action| -> Vec<Lane> {
            states.iter().map(|(_, state)| Lane::new(t0, (*state).clone(), rows, action)).collect()
        };
        let mut ended = lanes(most_rows, action);
        let options = LaneOptions { rows, check_resolution: self.check_resolution };
        forget_branches();
        match (self.members.requested_error(), finer) {
            (None, _) => kernel.run(self.instructions, &mut ended, action, options),
            (Some(_), None) => return 0,
            (Some(wanted), Some(finer)) => {
                let mut ends = lanes(None, false);
                finer.run(self.instructions, &mut ends, false, LaneOptions { rows: None, check_resolution: false });
                kernel.run(self.instructions, &mut ended, action, options);
                flag_inaccurate(wanted, &mut ended, &ends);
            }
        }
        if branched() {
            return 0;
        }
        let mut batch_kernel = 0;
        for ((place, from), Lane { state, rows, suspect, status, .. }) in states.into_iter().zip(ended) {
            if status != LaneStatus::Valid || !state.is_finite() {
                continue;
            }
            let t = t0 + steps as f64 * h;
            let suspect = suspect || self.check_resolution && may_drift((t0, from), (t, &state));
            let member = &mut members[place];
            let mut unresolved = None;
            if suspect && self.check_resolution {
                let own = self.run_single(member.index, None::<&mut Rows<'_>>);
                match own.ending {
                    Ok(ending) if ending.status == Status::Completed => unresolved = ending.unresolved,
                    _ => {
                        (*member, done[place]) = (own, true);
                        continue;
                    }
                }
            }
            member.ending = Ok(Ending { status: Status::Completed, unresolved, steps, t, state });
            member.rows = rows.unwrap_or_default();
            done[place] = true;
            batch_kernel += 1;
        }
        batch_kernel
    }
}

/// Flags members whose distance from the result with twice as many steps exceeds the requested error.
fn flag_inaccurate(wanted: f64, lanes: &mut [Lane], finer: &[Lane]) {
    let square = |q: &Vector, p: &Vector| q.norm_squared() + p.norm_squared();
    for (Lane { state: x, status, .. }, Lane { state: fine, .. }) in lanes.iter_mut().zip(finer) {
        let apart = square(&(&x.q - &fine.q), &(&x.p - &fine.p));
        // Written so that a NaN is not within the bound.
        let within = apart <= wanted * wanted * square(&fine.q, &fine.p);
        if !within {
            *status = LaneStatus::Inaccurate;
        }
    }
}
