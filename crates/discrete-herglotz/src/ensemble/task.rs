//! An ensemble after its checks, which is computed shard by shard.

use crate::ensemble::gauss::GaussPacks;
use crate::ensemble::lane::{Lane, LaneOptions, LaneStatus};
use crate::ensemble::member::{Ending, Member};
use crate::ensemble::single::Common;
use crate::ensemble::splitting::SplittingPacks;
use crate::integration::OfTyped;
use crate::integration::{BatchKernel, is_separable};
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::{branched, forget_branches};
use crate::numbers::state_words::digest;
use crate::run::may_drift;
use crate::switching::has_switching_functions;
use crate::{InputError, Integrator, Interrupt, Observer, Point, Rows, Start, Status};
use contact_geom::{ChartVector, Derivatives, Lagrangian, PhasePoint, VelocityPoint, legendre};
use std::ops::Range;

/// The number of members that are computed, saved and handed on together: whole packs of one to four registers of at
/// most eight lanes.
pub(crate) const MEMBERS_PER_SHARD: usize = 384;

/// How the members of one Lagrangian are advanced.
pub(crate) enum Kernel<'a, L, const N: usize> {
    OneByOne,
    Splitting(SplittingPacks<'a, L, N>),
    Gauss(GaussPacks<'a, L, N>),
}

impl<L: Lagrangian<N>, const N: usize> Kernel<'_, L, N> {
    /// Whether a motion needs a run of its own, since sums in lanes would lose the increments of its steps.
    pub(crate) fn needs_single_run(&self, state: &PhasePoint<N>) -> bool {
        match self {
            Kernel::Splitting(packs) => packs.is_tiny(state),
            // The collocation kernel uses compensated sums.
            Kernel::Gauss(_) | Kernel::OneByOne => false,
        }
    }

    pub(crate) fn run(&self, instructions: Instructions, lanes: &mut [Lane<N>], action: bool, options: LaneOptions) {
        match self {
            Kernel::Splitting(packs) if const { !L::HINTS.hamiltonian } => {
                packs.run(instructions, lanes, action, options);
            }
            Kernel::Gauss(packs) if const { !L::HINTS.hamiltonian } => packs.run(instructions, lanes, action, options),
            _ => {}
        }
    }
}

/// An ensemble after its checks.
pub(crate) struct Task<'e, 'a, L, const N: usize> {
    pub members: &'e (dyn Fn(usize) -> (&'a L, Start<N>) + Sync + 'a),
    pub count: usize,
    pub instructions: Instructions,
    pub check_resolution: bool,
    pub integrator: &'e (dyn Integrator<'a, L, N> + Sync + 'a),
    pub common: Common<L, N>,
    /// The step size and the number of steps.
    pub plan: (f64, usize),
    pub interrupt: Option<Interrupt<'a>>,
    /// The kernels of all members, if they have one Lagrangian.
    pub kernels: Option<[Kernel<'a, L, N>; 2]>,
    pub fingerprint: u64,
}

/// The members of a shard, with their results.
pub(crate) struct Shard<const N: usize> {
    pub members: Vec<Member<N>>,
    pub batch_kernel: usize,
    /// Whether members that have not completed contain the cause; those that were decoded from words do not.
    pub with_causes: bool,
}

impl<'a, L: Lagrangian<N> + Sync, const N: usize> Task<'_, 'a, L, N> {
    /// The kernels for a Lagrangian, whose constants are read at a state: for the steps and, if an error is requested,
    /// for twice as many steps.
    pub(crate) fn kernels_of(&self, lagrangian: &'a L, state: Option<&PhasePoint<N>>) -> [Kernel<'a, L, N>; 2] {
        let (h, steps) = self.plan;
        let finer =
            self.common.length.requested_error().map(|_| self.kernel_of(lagrangian, state, (0.5 * h, 2 * steps)));
        [self.kernel_of(lagrangian, state, self.plan), finer.unwrap_or(Kernel::OneByOne)]
    }

    pub(crate) fn kernel_of(
        &self,
        lagrangian: &'a L,
        state: Option<&PhasePoint<N>>,
        plan: (f64, usize),
    ) -> Kernel<'a, L, N> {
        let (structure, Some(state)) = (lagrangian.structure(), state) else { return Kernel::OneByOne };
        // With switching functions, steps end on kinks, at different times for each member.
        // The kernels evaluate L.
        if const { L::HINTS.hamiltonian } {
            return Kernel::OneByOne;
        }
        let (system, start) = (OfTyped(lagrangian), Point::new(state.q, state.p, state.z));
        if has_switching_functions(&system, self.common.t0, &start) != Ok(false) {
            return Kernel::OneByOne;
        }
        let separable = is_separable(&system, &structure);
        let kernel = match self.integrator.batch_kernel() {
            Some(BatchKernel::Splitting(scheme)) if separable && structure.is_affine_in_z() => {
                SplittingPacks::new(lagrangian, &scheme, plan, self.common.t0, state)
                    .map(|packs| Kernel::Splitting(packs.with_interrupt(self.interrupt)))
            }
            Some(BatchKernel::Gauss { stages }) if separable && structure.has_constant_rate() => {
                GaussPacks::new(lagrangian, stages, plan, self.common.t0, state)
                    .map(|packs| Kernel::Gauss(packs.with_interrupt(self.interrupt)))
            }
            _ => Ok(Kernel::OneByOne),
        };
        // If the kernel cannot be created, the runs of the members report the cause.
        kernel.unwrap_or(Kernel::OneByOne)
    }

    /// A digest that identifies the ensemble: of the integrator, the steps, and the starts and L of some members.
    pub(crate) fn fingerprint_of(&self, sample: impl Iterator<Item = usize>) -> u64 {
        let Common { t0, action, length, .. } = self.common;
        let mut words = vec![N as u64, self.count as u64, t0.to_bits(), action.into(), self.plan.0.to_bits()];
        words.extend([self.plan.1, self.common.rows.unwrap_or(0)].map(|x| x as u64));
        words.push(length.requested_error().unwrap_or(0.0).to_bits());
        words.extend(self.integrator.info().name.bytes().map(u64::from));
        for index in sample {
            let (lagrangian, start) = (self.members)(index);
            let (q, y, z) = match start {
                Start::Velocity(x) => (x.q, x.v, x.z),
                Start::Momentum(x, _) => (x.q, x.p, x.z),
            };
            let (value, slope) = lagrangian.with_gradient_and_force(t0, &VelocityPoint { q, v: y, z });
            let vectors = [&q, &y, &slope.x, &slope.y];
            let numbers = vectors.into_iter().flat_map(|x| x.iter().copied()).chain([z, value, slope.z]);
            words.extend(numbers.map(f64::to_bits));
        }
        digest(&words)
    }

    /// The indices of the members of a shard; empty if there is no such shard.
    pub(crate) fn members_of(&self, shard: usize) -> Range<usize> {
        let first = shard.saturating_mul(MEMBERS_PER_SHARD).min(self.count);
        first..self.count.min(first.saturating_add(MEMBERS_PER_SHARD))
    }

    /// Runs the members again that have not completed.
    pub(crate) fn run_again(&self, shard: &mut Shard<N>) {
        for member in shard.members.iter_mut().filter(|member| member.ending.is_err()) {
            *member = self.run_single(member.index, None::<&mut Rows<'_>>);
        }
    }

    /// Runs a member with a run of its own, and with an observer if there is one.
    pub(crate) fn run_single(&self, index: usize, observer: Option<&mut impl Observer>) -> Member<N> {
        let (lagrangian, start) = (self.members)(index);
        self.common.run(self.integrator, lagrangian, (index, start), observer, self.interrupt)
    }

    /// Runs the members of a shard.
    pub(crate) fn shard(&self, shard: usize) -> Shard<N> {
        let range = self.members_of(shard);
        let starts: Vec<_> = range.clone().map(self.members).collect();
        let member = |index| Member { index, ending: Err(InputError::NoSteps), rows: Vec::new() };
        let mut members: Vec<_> = range.map(member).collect();
        let mut batch_kernel = 0;
        let mut from = 0;
        // Consecutive members with the same Lagrangian.
        for group in starts.chunk_by(|a, b| std::ptr::eq(a.0, b.0)) {
            batch_kernel += self.group(group, &mut members[from..from + group.len()]);
            from += group.len();
        }
        Shard { members, batch_kernel, with_causes: true }
    }

    /// Runs members of one Lagrangian; returns how many of them were completed in lanes.
    pub(crate) fn group(&self, starts: &[(&'a L, Start<N>)], members: &mut [Member<N>]) -> usize {
        let Some(lagrangian) = starts.first().map(|start| start.0) else { return 0 };
        let (Common { t0, action, rows, length, .. }, (h, steps)) = (self.common, self.plan);
        let (mut places, mut states) = (Vec::with_capacity(starts.len()), Vec::with_capacity(starts.len()));
        let mut own = None;
        let [kernel, finer] = self.kernels.as_ref().unwrap_or_else(|| {
            let state = starts.iter().find_map(|(_, start)| start.state(lagrangian, t0));
            own.insert(self.kernels_of(lagrangian, state.as_ref()))
        });
        if !matches!(kernel, Kernel::OneByOne) {
            for (place, (_, start)) in starts.iter().enumerate() {
                if let Some(state) = start.state(lagrangian, t0)
                    && !kernel.needs_single_run(&state)
                {
                    places.push(place);
                    states.push(state);
                }
            }
        }
        let most_rows = rows.map(|_| self.common.rows_of(steps));
        let mut lanes: Vec<_> = states.iter().map(|state| Lane::new(t0, *state, most_rows, action)).collect();
        let mut done = [false; MEMBERS_PER_SHARD];
        let mut batch_kernel = 0;
        let options = LaneOptions { rows, check_resolution: self.check_resolution };
        forget_branches();
        if let Some(wanted) = length.requested_error() {
            let mut ends: Vec<_> = states.iter().map(|state| Lane::new(t0, *state, None, false)).collect();
            finer.run(self.instructions, &mut ends, false, LaneOptions { rows: None, check_resolution: false });
            kernel.run(self.instructions, &mut lanes, action, options);
            flag_inaccurate(wanted, &mut lanes, &ends);
        } else {
            kernel.run(self.instructions, &mut lanes, action, options);
        }
        if !branched() {
            let order = self.integrator.info().order;
            let (system, structure) = (OfTyped(lagrangian), lagrangian.structure());
            let dissipates = structure.autonomous && structure.has_constant_rate() && (structure.z_free || action);
            for ((place, from), Lane { state, rows, suspect, status, .. }) in places.into_iter().zip(&states).zip(lanes)
            {
                if status == LaneStatus::Valid && ChartVector::from(state).is_finite() {
                    let t = t0 + steps as f64 * h;
                    let check_resolution = self.check_resolution && dissipates;
                    let may_drift = || may_drift(&system, order, (t0, &from.into()), (t, &state.into()));
                    let suspect = suspect || check_resolution && may_drift();
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
            }
        }
        for ((_, start), (member, _)) in starts.iter().zip(members.iter_mut().zip(done)).filter(|(_, (_, done))| !done)
        {
            let of = (member.index, *start);
            *member = self.common.run(self.integrator, lagrangian, of, None::<&mut Rows<'_>>, self.interrupt);
        }
        batch_kernel
    }
}

impl<const N: usize> Start<N> {
    /// The state `(q, p, z)`, if it is finite.
    pub(crate) fn state<L: Lagrangian<N>>(&self, lagrangian: &L, t0: f64) -> Option<PhasePoint<N>> {
        let state = match self {
            Start::Velocity(x) => legendre(lagrangian, t0, x),
            Start::Momentum(x, _) => *x,
        };
        ChartVector::from(state).is_finite().then_some(state)
    }
}

/// Flags members whose distance from the result with twice as many steps exceeds the requested error.
fn flag_inaccurate<const N: usize>(wanted: f64, lanes: &mut [Lane<N>], finer: &[Lane<N>]) {
    let square = |x: &PhasePoint<N>| x.q.norm_squared() + x.p.norm_squared();
    for (Lane { state: x, status, .. }, Lane { state: fine, .. }) in lanes.iter_mut().zip(finer) {
        let apart = square(&PhasePoint { q: x.q - fine.q, p: x.p - fine.p, z: 0.0 });
        // Written so that a NaN is not within the bound.
        let within = apart <= wanted * wanted * square(fine);
        if !within {
            *status = LaneStatus::Inaccurate;
        }
    }
}
