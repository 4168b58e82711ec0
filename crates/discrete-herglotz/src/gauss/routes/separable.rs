//! Steps of contact Gauss collocation for `L = v.Mv/2 - V(t, q) + gamma z`.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::limits::{
    MAX_CHANGE_FOR_TAILS, MAX_PREDICTOR_ERROR, MIN_JACOBIAN_AGE, PREDICTOR_PAUSE, SLOW_NEWTON, TAIL_PERIOD,
};
use crate::gauss::resolution::tail::Tail;
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::stages::lagrangian_values::StageValues;
use crate::gauss::stages::position_newton::{PositionNewton, curvature};
use crate::gauss::stages::simplified_newton::SlopeNewton;
use crate::gauss::tables::condensed::{Condensed, Preconditioned};
use crate::numbers::array::from_fn;
use crate::numbers::compensated::{CompensatedSum, Unevaluated, add, finite};
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::{Lanes, branched};
use crate::numbers::pair::{Registers, over_registers};
use crate::numbers::registers::{Scaled, Stages, blocks};
use crate::numbers::state_words::{Saved, load_option, save_option, saved};
use crate::resolution::thresholds::{COLLOCATION_ROUNDINGS, MIN_CHECKED_CHANGE};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{
    Derivatives, Lagrangian, VelocityPoint, numbers::max_abs_or_nan, support::gradient_rounding, vector,
};
use pulp::Simd;
use std::sync::Arc;

mod route;
mod slope;

/// The state and the workspace of the condensed step.
///
/// The matrix of the iteration and the vectors that it multiplies are adjacent, within 4096 bytes for few dimensions: a
/// processor delays a load if the last twelve bits of its address agree with those of a recent store (4K aliasing).
#[repr(C)]
pub(crate) struct SeparableStages<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub table: Arc<Condensed>,
    pub left: Preconditioned,
    /// The unknown of the iteration: the acceleration without the linear force, `a_i + kappa Q_i`.
    rest: [Stages; N],
    pub x: [Stages; N],
    /// The accelerations of the last iteration.
    pub a: [Stages; N],
    /// The part of the stage positions that is constant in an iteration: the terms of the state, and the terms with the
    /// tails of the matrices.
    base: [Stages; N],
    /// `M^-1`; `None` where M is the identity.
    inverse_mass: Option<Box<SMatrix<f64, N, N>>>,
    pub wants_z: bool,
    pub q: [CompensatedSum; N],
    pub v: [CompensatedSum; N],
    pub z: CompensatedSum,
    /// Whether the initial guesses are too inaccurate for the terms with the tails of the matrices.
    far: bool,
    /// Whether `rest` is the solution of the step before.
    warm: bool,
    /// Simplified Newton iteration, used while the fixed-point iteration does not converge.
    pub newton: Option<Box<SlopeNewton<N>>>,
    /// Its workspace while it is not used.
    suspended_newton: Option<Box<SlopeNewton<N>>>,
    /// Newton's method in the stage positions, for steps in which simplified Newton iteration does not converge; made
    /// for the first step in which the fixed-point iteration does not converge.
    positions: Option<Box<PositionNewton<N>>>,
    /// Whether the stages of the next step are solved already, with their solution in `rest`.
    solved: bool,
    /// The number of further steps whose initial guess is a motion by the linear force alone.
    steps_without_predictor: u32,
    /// The number of steps since the Jacobian of the simplified Newton iteration was computed.
    age: u32,
    tail: Tail,
    /// The defect of the last step; above one if it does not resolve the motion.
    pub defect: f64,
    /// The number of steps taken, and the number at which the slope of the force is estimated again.
    taken: usize,
    review: usize,
    pub evaluations: u64,
}

impl<'a, L: Lagrangian<N>, const N: usize> SeparableStages<'a, L, N> {
    pub fn new(
        lagrangian: &'a L,
        table: Arc<Condensed>,
        left: Preconditioned,
        inverse_mass: Option<Box<SMatrix<f64, N, N>>>,
        start: &VelocityPoint<N>,
        wants_z: bool,
    ) -> Self {
        let tail = Tail::new(table.s);
        SeparableStages {
            lagrangian,
            table,
            left,
            inverse_mass,
            wants_z,
            q: from_fn(|i| start.q[i].into()),
            v: from_fn(|i| start.v[i].into()),
            z: start.z.into(),
            rest: [Stages::ZERO; N],
            a: [Stages::ZERO; N],
            x: [Stages::ZERO; N],
            base: [Stages::ZERO; N],
            far: false,
            warm: false,
            newton: None,
            suspended_newton: None,
            positions: None,
            solved: false,
            steps_without_predictor: 0,
            age: 0,
            tail,
            defect: 0.0,
            taken: 0,
            review: 1,
            evaluations: 0,
        }
    }

    /// Switches to simplified Newton iteration with `L_qq` at a time and a position; `false` if the Jacobian is
    /// singular or not finite.
    fn linearise(&mut self, t: f64, q: SVector<f64, N>) -> bool {
        if !self.prepare() {
            return false;
        }
        let mut slope = curvature(self.lagrangian, t, &q);
        if let Some(inverse) = &self.inverse_mass {
            slope = **inverse * slope;
        }
        self.newton.as_mut().is_some_and(|newton| newton.factorise(&slope))
    }

    /// Allocates simplified Newton iteration and sets kappa = 0; `false` if that is not possible. Not inlined, so that
    /// its matrices have a stack frame of their own.
    #[inline(never)]
    fn prepare(&mut self) -> bool {
        if self.newton.is_none() {
            let Some(mut left) = self.table.preconditioned(0.0) else { return false };
            left.refine(&self.table);
            self.left = left;
            self.newton = self.suspended_newton.take().or_else(|| Some(Box::new(SlopeNewton::new(&self.table))));
            self.forget();
        }
        true
    }

    /// Takes a motion without forces as the initial guess of the next step.
    fn forget(&mut self) {
        self.rest = [Stages::ZERO; N];
        self.warm = false;
    }

    /// Recomputes the Jacobian of the simplified Newton iteration at the middle stage of the last step.
    #[cold]
    #[inline(never)]
    fn renew(&mut self, t: f64) {
        self.age = 0;
        let i = self.table.s / 2;
        let q = SVector::from_fn(|d, _| self.x[d].0[i]);
        if !self.linearise(t + self.table.times.0[i], q) {
            self.forget();
        }
    }

    /// Evaluates the forces at the blocks of stages that T holds, from the r-th on; returns the index of the next
    /// block.
    #[inline(always)]
    fn take_forces<S: Simd, T: Registers<S>>(&mut self, t: f64, r: usize, most: &mut [Lanes<S>; 2]) -> usize {
        let x = VelocityPoint { q: vector!(|d| T::of(&self.x[d], r)), v: vector!(|_| T::zero()), z: T::zero() };
        let force = self.lagrangian.force(T::of(&self.table.times, r) + t, &x);
        for i in 0..T::COUNT {
            self.take(r + i, vector!(|d| force[d].register(i)), most);
        }
        r + T::COUNT
    }

    /// The accelerations `M^-1` times the forces.
    #[inline(always)]
    fn accelerations<S: Simd>(&self, force: SVector<Lanes<S>, N>) -> SVector<Lanes<S>, N> {
        let zero = Lanes::<S>::splat(0.0);
        match &self.inverse_mass {
            None => force,
            Some(inverse) => {
                let mut accelerations = vector!(|_| zero);
                for i in 0..N {
                    for j in 0..N {
                        accelerations[i] += force[j] * inverse[(i, j)];
                    }
                }
                accelerations
            }
        }
    }

    /// Takes one step from the time `t`; on failure the state is unchanged.
    #[inline(always)]
    fn take_step<S: Simd>(&mut self, t: f64) -> IterationOutcome {
        if self.warm && self.newton.is_none() && self.taken >= self.review {
            self.review *= 2;
            self.update_matrix();
        }
        let s = self.table.s;
        let m = blocks::<S>(s);
        let solved = std::mem::take(&mut self.solved);
        let predicts = self.warm && !solved && (self.steps_without_predictor == 0 || self.newton.is_some());
        if predicts {
            for d in 0..N {
                let before = self.rest[d];
                self.table.extrapolation.apply(&before, s, &mut self.rest[d], Lanes::<S>::splat(0.0));
            }
        } else if !solved {
            self.rest = [Stages::ZERO; N];
            self.steps_without_predictor = self.steps_without_predictor.saturating_sub(1);
        }
        if let Some(newton) = &mut self.newton {
            newton.a = self.rest;
        }
        // Terms below round-off are added from the second iteration on; computed beside the forces of the first one
        // they cost little. If the initial guess is poor, the terms with the tails of the matrices use the values of a
        // later iteration.
        let at_once = solved || self.newton.is_some();
        let weight = match self.taken % TAIL_PERIOD {
            _ if at_once => 1.0,
            0 => TAIL_PERIOD as f64,
            _ => 0.0,
        };
        let tails = !at_once && weight > 0.0;
        let mut due = tails && self.far;
        let mut aside = !at_once && !due;
        let (mut small, mut again) = (at_once.then_some(weight), true);
        self.far &= !tails;
        // With secant steps the changes decrease so fast that a smaller tolerance costs no further iteration.
        let mut iteration =
            FixedPointIteration::until(1.0 / 16.0, if const { N == 1 } { 1.0 / 256.0 } else { 1.0 / 64.0 });
        // The positions and `rest` of the iteration before.
        let mut before = [Stages::ZERO; 2];
        let outcome = loop {
            if again {
                self.begin::<S>(small);
                // In simplified Newton iteration the terms with the tails are updated after each correction.
                (small, again) = (Some(weight), self.newton.is_some());
            }
            let base = &self.base;
            self.left.head.b.apply_to_each::<S>(&self.rest, s, &mut self.x, base);
            if aside {
                aside = false;
                self.begin::<S>(small);
            }
            let mut most = [Lanes::<S>::splat(0.0); 2];
            let mut r = 0;
            while r < m {
                r = over_registers!(self.take_forces(t, r, &mut most); L, S, m - r);
            }
            let [change, size] = most;
            self.evaluations += s as u64;
            let (mut change, size) = (change.reduce_max(), size.reduce_max());
            if solved {
                break IterationOutcome::Done;
            }
            if self.newton.is_some() {
                (change, iteration.still) = self.correct();
            }
            match iteration.assess(change, size) {
                IterationOutcome::Continue if tails && change > MAX_CHANGE_FOR_TAILS * size => {
                    (due, self.far) = (true, true)
                }
                IterationOutcome::Continue => (again, due) = (again || due, false),
                IterationOutcome::Slow { .. } if self.is_rounding(t, change) => break IterationOutcome::Done,
                done => break done,
            }
            if const { N == 1 } && self.newton.is_none() {
                let extrapolation = iteration.secant_step(change / size);
                self.store_values::<S>(&mut before, extrapolation);
            }
        };
        if const { N == 1 } && outcome == IterationOutcome::Done && iteration.ends_with_secant() {
            self.store_values::<S>(&mut before, true);
            let kappa = Lanes::<S>::splat(self.left.kappa);
            for r in 0..m {
                self.a[0].set(r, self.rest[0].block::<S>(r) - kappa * self.x[0].block(r));
            }
        }
        if let (IterationOutcome::Done, Some(_)) = (outcome, &self.newton) {
            // Stiff forces magnify the round-off of the positions; the corrected accelerations do not contain it.
            self.a = self.rest;
        }
        let outcome = if outcome == IterationOutcome::Done { self.finish::<S>(t) } else { outcome };
        self.warm = outcome == IterationOutcome::Done;
        if !self.warm {
            // The result of a diverged iteration is a worse initial guess than a motion by the linear force alone.
            self.rest = [Stages::ZERO; N];
            return outcome;
        }
        if predicts && const { N == 1 } && iteration.first_change() > MAX_PREDICTOR_ERROR * self.largest_rest::<S>() {
            self.steps_without_predictor = PREDICTOR_PAUSE;
        }
        let predicted_well = iteration.first() <= MIN_CHECKED_CHANGE && !solved;
        let h = self.table.h;
        self.defect = if predicted_well { 0.0 } else { self.tail.defect::<S>(&self.a, None, &self.x, h * h) };
        if self.newton.is_some() {
            self.age = self.age.saturating_add(1);
            if iteration.count() > SLOW_NEWTON && self.age > MIN_JACOBIAN_AGE {
                self.renew(t);
            }
            return IterationOutcome::Done;
        }
        self.taken += 1;
        IterationOutcome::Done
    }

    /// Stores the forces of one block of stages, and updates the largest change of `rest` and the largest of its terms.
    #[inline(always)]
    fn take<S: Simd>(&mut self, r: usize, force: SVector<Lanes<S>, N>, [change, size]: &mut [Lanes<S>; 2]) {
        let (a, kappa) = (self.accelerations(force), Lanes::<S>::splat(self.left.kappa));
        for d in 0..N {
            let linear = kappa * self.x[d].block(r);
            let rest = a[d] + linear;
            *change = change.max((rest - self.rest[d].block(r)).abs());
            *size = size.max(a[d].abs()).max(linear.abs());
            self.rest[d].set(r, rest);
            self.a[d].set(r, a[d]);
        }
    }

    /// Whether a change of the accelerations is round-off of the forces: where terms of a force cancel, near an
    /// equilibrium, its round-off is that of the terms.
    #[cold]
    #[inline(never)]
    fn is_rounding(&self, t: f64, change: f64) -> bool {
        let i = self.table.s / 2;
        let q = SVector::from_fn(|d, _| self.x[d].0[i]);
        let x = VelocityPoint { q, v: SVector::zeros(), z: 0.0 };
        let (_, once) = gradient_rounding(self.lagrangian, t + self.table.times.0[i], &x);
        let of_acceleration = self.inverse_mass.as_ref().map_or(once.x, |inverse| inverse.abs() * once.x);
        change <= COLLOCATION_ROUNDINGS * max_abs_or_nan(of_acceleration.iter().copied())
    }

    /// Corrects a fixed-point iteration by the simplified Newton method. Returns the largest change of the
    /// accelerations, and whether the positions have changed by no more than their round-off.
    #[cold]
    #[inline(never)]
    fn correct(&mut self) -> (f64, bool) {
        let Some(newton) = &mut self.newton else { return (f64::NAN, false) };
        let (change, moved) = newton.correct(Instructions::new(), &mut self.rest);
        let width = max_abs_or_nan(self.x.iter().flat_map(|x| &x.0[..self.table.s]).copied());
        (change, moved <= 4.0 * f64::EPSILON * width)
    }

    /// Computes `base`, the terms of the stage positions from the state. If a weight is given, terms below round-off
    /// are included: those of the compensation terms of the state, whose direction is not random, and the weight times
    /// those of the tails of the matrices.
    #[inline(always)]
    fn begin<S: Simd>(&mut self, small: Option<f64>) {
        let (head, s) = (&self.left.head, self.table.s);
        for d in 0..N {
            let (q, v) = (Lanes::<S>::splat(self.q[d].value), Lanes::<S>::splat(self.v[d].value));
            let base = &mut self.base[d];
            let Some(weight) = small else {
                for r in 0..blocks::<S>(s) {
                    base.set(r, head.of_state(q, v, r));
                }
                continue;
            };
            let (q_rest, v_rest) = (Lanes::<S>::splat(self.q[d].rest), Lanes::<S>::splat(self.v[d].rest));
            let tail = self.left.tail.as_ref().filter(|_| weight > 0.0);
            if let Some(tail) = tail {
                for r in 0..blocks::<S>(s) {
                    base.set(r, tail.of_state(q, v, r));
                }
                tail.b.add::<S>(&self.rest[d], s, base);
            }
            let weight = Lanes::<S>::splat(weight);
            for r in 0..blocks::<S>(s) {
                let mut small = head.of_state(q_rest, v_rest, r);
                if tail.is_some() {
                    small = weight.mul_add(base.block(r), small);
                }
                // The small terms are added first, since they are below the round-off of the full sum.
                base.set(r, head.q.block::<S>(r).mul_add(q, head.u.block::<S>(r).mul_add(v, small)));
            }
        }
    }

    /// The end of the step from its accelerations.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, t: f64) -> IterationOutcome {
        let (table, s) = (&self.table, self.table.s);
        let (mut dq, mut dv, mut dz) =
            ([Unevaluated::default(); N], [Unevaluated::default(); N], Unevaluated::default());
        if self.wants_z {
            dz = table.grow * self.z.value + table.end_v.sum::<S>(&self.action::<S>(t), s);
        }
        for d in 0..N {
            let v = self.v[d];
            dq[d] = table.end_b.sum::<S>(&self.a[d], s) + table.end_u.times(v);
            dv[d] = table.end_v.sum::<S>(&self.a[d], s) + table.grow.times(v);
        }
        if branched() {
            return IterationOutcome::Branched;
        }
        // The maximum over lanes may hide a NaN.
        if !finite(&dq, &dv, dz) {
            return IterationOutcome::NonFinite;
        }
        add(&mut self.q, &dq);
        add(&mut self.v, &dv);
        self.z.add(dz);
        IterationOutcome::Done
    }

    /// `L - gamma z` at the stages.
    #[inline(always)]
    fn action<S: Simd>(&self, t: f64) -> Stages {
        let (table, s) = (&self.table, self.table.s);
        let mut velocities = [Stages::ZERO; N];
        for d in 0..N {
            let v = Lanes::<S>::splat(self.v[d].value);
            table.d.apply(&self.a[d], s, &mut velocities[d], Scaled(&table.inverse_rho, v));
        }
        StageValues { lagrangian: self.lagrangian, times: &table.times, t, x: &self.x, v: &velocities }.all::<S>(s)
    }
}

saved!([L, const N: usize] SeparableStages<'_, L, N> {
    rest, x, a, base, q, v, z, far, warm, solved, steps_without_predictor, age, defect, taken, review, evaluations,
} and save_solution, load_solution);

impl<L, const N: usize> SeparableStages<'_, L, N> {
    /// Saves kappa and whether the tail is present, which determine the matrices, and the simplified Newton iteration.
    fn save_solution(&self, to: &mut Vec<u64>) {
        self.left.kappa.save(to);
        self.left.tail.is_some().save(to);
        save_option(self.newton.as_deref(), to);
    }

    fn load_solution(&mut self, from: &mut &[u64]) -> Option<()> {
        let (mut kappa, mut refined) = (0.0, false);
        kappa.load(from)?;
        refined.load(from)?;
        self.left = self.table.preconditioned(kappa)?;
        if refined {
            self.left.refine(&self.table);
        }
        self.newton = load_option(from, || SlopeNewton::new(&self.table))?.map(Box::new);
        Some(())
    }
}
