//! Contact Gauss collocation for many motions in SIMD lanes; the stages of a step are computed in a loop.

mod pack;
mod step;
mod table;

use crate::ensemble::convergence::ConvergenceTest;
use crate::ensemble::lane::{Lane, LaneOptions, LaneStatus, interrupt};
use crate::ensemble::members::LaneKernel;
use crate::gauss::resolution::tail::of_sigma;
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::gauss::tables::condensed::Condensed;
use crate::integration::interrupt::STEPS_BETWEEN_QUERIES;
use crate::numbers::array::from_fn;
use crate::numbers::compensated_batch::CompensatedBatch;
use crate::numbers::instructions::Instructions;
use crate::numbers::simd_batch::SimdBatch;
use crate::splitting::separable::SeparableForm;
use crate::{InputError, Interrupt, State, StepError, Vector};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, VelocityPoint};
use num_traits::Zero;
use pack::Pack;
use pulp::{Simd, WithSimd};
use table::Table;

/// The steps of contact Gauss collocation condensed to the positions, for many motions of one Lagrangian; the equations
/// are those of [`Condensed`].
///
/// An iteration computes the stages in their order, each from the newest accelerations of the others (Gauss-Seidel
/// iteration). In the first iteration of a step the predictor of a stage is the polynomial through the newest
/// accelerations, which include those of the step before. The iteration ends in each lane separately, by the rules of
/// `gauss/stages/fixed_point.rs`; converged lanes keep their values while others continue.
pub(crate) struct GaussPacks<'a, L, const N: usize> {
    form: SeparableForm<&'a L, N>,
    table: Box<Table>,
    t0: f64,
    h: f64,
    steps: usize,
    interrupt: Option<Interrupt<'a>>,
}

impl<'a, L: Lagrangian<N>, const N: usize> GaussPacks<'a, L, N> {
    /// The kernel for a Lagrangian, whose constants are read at a start.
    pub fn new(
        lagrangian: &'a L,
        stages: usize,
        (h, steps): (f64, usize),
        t0: f64,
        state: &PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let form = SeparableForm::read(lagrangian, h, t0, state)?;
        let x = VelocityPoint { q: state.q, v: form.velocity(&state.p), z: state.z };
        let gamma = lagrangian.gradient(t0, &x).z;
        if !gamma.is_finite() {
            return Err(InputError::FirstStep(StepError::NonFinite));
        }
        let condensed = Condensed::new(stages, h, gamma)?;
        // The steps do not resolve the drag: each member has a run of its own, which reports this.
        if of_sigma(1.0 + condensed.grow.head, gamma * h) > 1.0 {
            return Err(InputError::Step { h });
        }
        let table = Box::new(Table::new(&condensed));
        Ok(GaussPacks { form, table, t0, h, steps, interrupt: None })
    }
}

impl<L: Lagrangian<N> + Sync, const N: usize> LaneKernel for GaussPacks<'_, L, N> {
    /// The kernel uses compensated sums.
    fn needs_single_run(&self, _state: &State) -> bool {
        false
    }

    /// Takes all steps of some motions in place, and records a state after every `rows` steps. Lanes in which the
    /// equations of a step could not be solved are flagged.
    fn run(&self, instructions: Instructions, lanes: &mut [Lane], action: bool, options: LaneOptions) {
        let stride = options.rows.unwrap_or(self.steps);
        if action {
            instructions.dispatch(All::<_, N, true> { packs: self, lanes, stride });
        } else {
            instructions.dispatch(All::<_, N, false> { packs: self, lanes, stride });
        }
    }
}

/// All motions of a slice in the lanes of one instruction set.
struct All<'s, 'a, L, const N: usize, const ACTION: bool> {
    packs: &'s GaussPacks<'a, L, N>,
    lanes: &'s mut [Lane],
    /// The number of steps from one recorded state to the next.
    stride: usize,
}

impl<L: Lagrangian<N>, const N: usize, const ACTION: bool> WithSimd for All<'_, '_, L, N, ACTION> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let All { packs, lanes, stride } = self;
        // The widths of the packs are those for splittings.
        if const { N == 1 } {
            packs.all::<S, 4, ACTION>(lanes, stride);
        } else {
            packs.all::<S, 2, ACTION>(lanes, stride);
        }
    }
}

/// The largest number of packs that compute a stage one after the other: while one waits for its results, the work of
/// the next ones fills the pipeline. Their data fit into the first-level cache.
const PACKS_IN_FLIGHT: usize = 2;

impl<'a, L: Lagrangian<N>, const N: usize> GaussPacks<'a, L, N> {
    /// Sets an interrupt that is polled during the steps; members that it ends count as not completed.
    pub fn with_interrupt(self, interrupt: Option<Interrupt<'a>>) -> Self {
        Self { interrupt, ..self }
    }

    #[inline(always)]
    fn all<S: Simd, const K: usize, const ACTION: bool>(&self, lanes: &mut [Lane], stride: usize) {
        let width = SimdBatch::<S, K>::COUNT;
        let mut in_flight = Vec::with_capacity(PACKS_IN_FLIGHT);
        for members in lanes.chunks_mut(PACKS_IN_FLIGHT * width) {
            in_flight.clear();
            for own in members.chunks(width) {
                in_flight.push(self.start::<S, K>(own));
            }
            for k in 0..self.steps {
                if k % STEPS_BETWEEN_QUERIES == 0 && self.interrupt.is_some_and(Interrupt::is_requested) {
                    interrupt(members);
                    break;
                }
                self.step::<S, K, ACTION>(&mut in_flight, self.t0 + k as f64 * self.h, k > 0);
                let taken = k + 1;
                if taken % stride == 0 || taken == self.steps {
                    for (own, m) in members.chunks_mut(width).zip(&in_flight) {
                        for (i, lane) in own.iter_mut().enumerate() {
                            lane.record(self.t0 + taken as f64 * self.h, self.state(m, i));
                            lane.suspect = m.suspect.lanes()[i] != 0.0;
                            if m.failed.lanes()[i] != 0.0 {
                                lane.status = LaneStatus::Failed;
                            }
                        }
                    }
                }
            }
        }
    }

    /// The pack of some motions; lanes beyond the last motion repeat it. Not inlined: it is called once for many steps.
    #[inline(never)]
    fn start<S: Simd, const K: usize>(&self, members: &[Lane]) -> Pack<S, K, N> {
        let zero = SimdBatch::zero();
        let of = |f: &dyn Fn(&State) -> f64| {
            CompensatedBatch::from(SimdBatch::from_lanes(|i| {
                members.get(i).or(members.last()).map_or(0.0, |lane| f(&lane.state))
            }))
        };
        Pack {
            q: from_fn(|d| of(&|state| state.q[d])),
            v: from_fn(|d| of(&|state| self.form.velocity(&state.p.fixed())[d])),
            z: of(&|state| state.z),
            a: [[zero; N]; MAX_STAGES],
            x: [[zero; N]; MAX_STAGES],
            base: [[zero; N]; MAX_STAGES],
            continuing: zero,
            failed: zero,
            open: false,
            whole: true,
            change: zero,
            size: zero,
            convergence: ConvergenceTest::new(),
            fast: zero,
            suspect: zero,
        }
    }

    /// The state in a lane. Not inlined: it is called for rows alone.
    #[inline(never)]
    fn state<S: Simd, const K: usize>(&self, m: &Pack<S, K, N>, i: usize) -> State {
        let v = SVector::from_fn(|d, _| m.v[d].value.lanes()[i]);
        State {
            q: Vector::from_fn(N, |d| m.q[d].value.lanes()[i]),
            p: self.form.momentum(&v).into(),
            z: m.z.value.lanes()[i],
        }
    }
}
