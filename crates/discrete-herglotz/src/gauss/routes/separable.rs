//! Steps of contact Gauss collocation for `L = v.Mv/2 - V(t, q) + gamma z`.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::StepError;
use crate::gauss::resolution::tail::{FORETOLD, ROUNDINGS, Tail};
use crate::gauss::stages::fixed_point::{AGE, FixedPointIteration, IterationOutcome, SLOW};
use crate::gauss::stages::lagrangian_values::StageValues;
use crate::gauss::stages::position_newton::{At, PositionNewton, curvature};
use crate::gauss::stages::simplified_newton::SlopeNewton;
use crate::gauss::tables::condensed::{Condensed, Preconditioned};
use crate::numbers::compensated::{CompensatedSum, Unevaluated, add, finite};
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::{Lanes, branched, vector};
use crate::numbers::pair::{Registers, over_registers};
use crate::numbers::registers::{Stages, blocks};
use crate::numbers::state_words::{Saved, load_option, save_option, saved};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Derivatives, Lagrangian, VelocityPoint, numbers::max_abs_or_nan, support::gradient_rounding};
use pulp::Simd;
use std::sync::Arc;

mod slope;

/// How much worse than nothing what the step before foretells may be: its error is rough, and the first sweeps take it away, where that of
/// nothing is smooth and lasts.
const ROUGH: f64 = 16.0;

/// The steps after which what the step before foretells is tried again.
const UNFORETOLD: u32 = 31;

/// The largest relative change of a sweep after which its values are near enough for the parts that matrices' rounding leaves out.
const NEAR: f64 = 1e-3;

/// The tails of the matrices act in one of so many steps, with as many times their weight: what they add up to is the same, and is
/// had at that part of the price. An odd number, so that they meet all phases of a period that is a power of two of steps.
const TAILS: usize = 7;

/// The state and the workspace of the condensed step.
///
/// The matrix of the sweeps and what it multiplies lie together, within 4096 bytes in few dimensions: a processor takes a load for
/// one of what was just stored where the last twelve bits of their addresses agree, and waits.
#[repr(C)]
pub(crate) struct SeparableStages<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub table: Arc<Condensed>,
    pub left: Preconditioned,
    /// What the force adds to the linear one, `a_i + kappa Q_i`: the unknown of the iteration.
    rest: [Stages; N],
    pub x: [Stages; N],
    /// The accelerations of the last sweep.
    pub a: [Stages; N],
    /// What the positions begin with: what comes of the state, and of the parts that the matrices' rounding leaves out.
    base: [Stages; N],
    /// `M^-1`; `None` where M is the identity.
    inverse_mass: Option<Box<SMatrix<f64, N, N>>>,
    pub wants_z: bool,
    pub q: [CompensatedSum; N],
    pub v: [CompensatedSum; N],
    pub z: CompensatedSum,
    /// Whether guesses are far from the solution.
    far: bool,
    /// Whether `rest` belongs to the step before.
    warm: bool,
    /// Corrects the sweeps where they do not contract by themselves.
    pub newton: Option<Box<SlopeNewton<N>>>,
    /// The same while it is not used.
    suspended_newton: Option<Box<SlopeNewton<N>>>,
    /// Solves the steps for which that does not serve; made for the first step that the sweeps do not solve.
    positions: Option<Box<PositionNewton<N>>>,
    /// Whether the stages of the next step are solved, and `rest` is theirs.
    solved: bool,
    /// The steps left for which the guess is a motion by the linear force alone.
    unforetold: u32,
    /// The steps that Newton's Jacobian has served.
    age: u32,
    tail: Tail,
    /// Above one where the last step has not resolved the motion.
    pub defect: f64,
    /// Steps since the start, and the one at which the slope of the force is looked at again.
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
            q: std::array::from_fn(|i| start.q[i].into()),
            v: std::array::from_fn(|i| start.v[i].into()),
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
            unforetold: 0,
            age: 0,
            tail,
            defect: 0.0,
            taken: 0,
            review: 1,
            evaluations: 0,
        }
    }

    /// Has the sweeps corrected by Newton's method, with the second derivatives of L in q at a time and a position from now on;
    /// `false` where that is not possible.
    pub fn linearise(&mut self, t: f64, q: SVector<f64, N>) -> bool {
        if !self.prepare() {
            return false;
        }
        let mut slope = curvature(self.lagrangian, t, &q);
        if let Some(inverse) = &self.inverse_mass {
            slope = **inverse * slope;
        }
        self.newton.as_mut().is_some_and(|newton| newton.factorise(&slope))
    }

    /// Goes over to sweeps that Newton's method corrects; `false` where that is not possible. A frame of the stack by itself.
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

    /// Takes the sweeps as they are again.
    pub fn suspend_newton(&mut self) {
        self.suspended_newton = self.newton.take();
        self.look_again();
    }

    /// Guesses the next step to be a motion without forces.
    pub fn forget(&mut self) {
        self.rest = [Stages::ZERO; N];
        self.warm = false;
    }

    /// Makes the workspace of Newton's method, so that later steps allocate nothing.
    pub fn reserve(&mut self) {
        self.positions.get_or_insert_with(|| Box::new(PositionNewton::new(self.table.s)));
    }

    /// Solves the stages of the next step, from the time `t`, by Newton's method, and has it taken from them.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub fn solve(&mut self, t: f64) -> Result<(), StepError> {
        let positions = self.positions.get_or_insert_with(|| Box::new(PositionNewton::new(self.table.s)));
        let (q, v) = (SVector::from(self.q.map(|q| q.value)), SVector::from(self.v.map(|v| v.value)));
        let inverse_mass = self.inverse_mass.as_deref();
        positions.solve(&At { lagrangian: self.lagrangian, table: &self.table, inverse_mass, t, q, v })?;
        self.rest = [Stages::ZERO; N];
        for (i, (a, q)) in positions.stages().enumerate() {
            for d in 0..N {
                // Beyond the last stage it is repeated.
                self.rest[d].0[i..].fill(a[d] + self.left.kappa * q[d]);
            }
        }
        self.solved = true;
        Ok(())
    }

    /// Takes Newton's Jacobian anew, at the middle stage of the last step.
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

    /// Takes the forces at the positions of the blocks of stages that T holds, from the r-th on.
    #[inline(always)]
    fn take_forces<S: Simd, T: Registers<S>>(&mut self, t: f64, r: usize, most: &mut [Lanes<S>; 2]) -> usize {
        let x = VelocityPoint { q: vector(|d| T::of(&self.x[d], r)), v: vector(|_| T::zero()), z: T::zero() };
        let force = self.lagrangian.force(T::of(&self.table.times, r) + t, &x);
        for i in 0..T::COUNT {
            self.take(r + i, vector(|d| force[d].register(i)), most);
        }
        r + T::COUNT
    }

    /// The accelerations of forces.
    #[inline(always)]
    fn accelerations<S: Simd>(&self, force: SVector<Lanes<S>, N>) -> SVector<Lanes<S>, N> {
        let zero = Lanes::<S>::splat(0.0);
        match &self.inverse_mass {
            None => force,
            Some(inverse) => {
                let mut accelerations = vector(|_| zero);
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
    pub fn step<S: Simd>(&mut self, t: f64) -> IterationOutcome {
        if self.warm && self.newton.is_none() && self.taken >= self.review {
            self.review *= 2;
            self.look_again();
        }
        let s = self.table.s;
        let m = blocks::<S>(s);
        let solved = std::mem::take(&mut self.solved);
        let foretells = self.warm && !solved && (self.unforetold == 0 || self.newton.is_some());
        if foretells {
            for d in 0..N {
                let before = self.rest[d];
                self.table.extrapolation.apply(&before, s, &mut self.rest[d], |_| Lanes::<S>::splat(0.0));
            }
        } else if !solved {
            self.rest = [Stages::ZERO; N];
            self.unforetold = self.unforetold.saturating_sub(1);
        }
        if let Some(newton) = &mut self.newton {
            newton.a = self.rest;
        }
        // What is below round-off is added from the second sweep on: beside the first one's forces it costs little. Where the guess
        // is poor the tails of the matrices wait for the values of a later sweep.
        let at_once = solved || self.newton.is_some();
        let weight = match self.taken % TAILS {
            _ if at_once => 1.0,
            0 => TAILS as f64,
            _ => 0.0,
        };
        let tails = !at_once && weight > 0.0;
        let mut due = tails && self.far;
        let mut aside = !at_once && !due;
        let (mut small, mut again) = (at_once.then_some(weight), true);
        self.far &= !tails;
        // With sweeps ahead changes fall so fast that to leave less costs nothing.
        let mut sweeps =
            FixedPointIteration::until(1.0 / 16.0, if const { N == 1 } { 1.0 / 256.0 } else { 1.0 / 64.0 });
        // The positions and what the force adds there, of the sweep before.
        let mut before = [Stages::ZERO; 2];
        let outcome = loop {
            if again {
                self.begin::<S>(small);
                // Where Newton's method is needed the tails follow each of its corrections.
                (small, again) = (Some(weight), self.newton.is_some());
            }
            let base = &self.base;
            self.left.head.b.apply_to_each(&self.rest, s, &mut self.x, |d, r| base[d].block::<S>(r));
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
            let (mut change, size) = (change.max_abs_or_nan(), size.max_abs_or_nan());
            if solved {
                break IterationOutcome::Done;
            }
            if self.newton.is_some() {
                (change, sweeps.still) = self.correct();
            }
            match sweeps.judge(change, size) {
                IterationOutcome::Continue if tails && change > NEAR * size => (due, self.far) = (true, true),
                IterationOutcome::Continue => (again, due) = (again || due, false),
                IterationOutcome::Slow { .. } if self.is_rounding(t, change) => break IterationOutcome::Done,
                done => break done,
            }
            if const { N == 1 } && self.newton.is_none() {
                let extrapolation = sweeps.secant_step(change / size);
                self.sweep_ahead::<S>(&mut before, extrapolation);
            }
        };
        if const { N == 1 } && outcome == IterationOutcome::Done && sweeps.ends_ahead() {
            self.sweep_ahead::<S>(&mut before, true);
            let kappa = Lanes::<S>::splat(self.left.kappa);
            for r in 0..m {
                self.a[0].set(r, self.rest[0].block::<S>(r) - kappa * self.x[0].block(r));
            }
        }
        if let (IterationOutcome::Done, Some(_)) = (outcome, &self.newton) {
            // Stiff forces magnify the round-off of the positions, and the correction takes it back.
            self.a = self.rest;
        }
        let outcome = if outcome == IterationOutcome::Done { self.finish::<S>(t) } else { outcome };
        self.warm = outcome == IterationOutcome::Done;
        if !self.warm {
            // What an iteration leaves that does not contract is worse than nothing.
            self.rest = [Stages::ZERO; N];
            return outcome;
        }
        if foretells && const { N == 1 } && sweeps.first_change() > ROUGH * self.largest_rest::<S>() {
            self.unforetold = UNFORETOLD;
        }
        let foretold = sweeps.first() <= FORETOLD && !solved;
        let h = self.table.h;
        self.defect = if foretold { 0.0 } else { self.tail.defect::<S, N>(&self.a, None, &self.x, h * h) };
        if self.newton.is_some() {
            self.age = self.age.saturating_add(1);
            if sweeps.count() > SLOW && self.age > AGE {
                self.renew(t);
            }
            return IterationOutcome::Done;
        }
        self.taken += 1;
        IterationOutcome::Done
    }

    /// Takes the forces of one block of stages; what they have changed by most, and the largest of what they consist of, are kept.
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

    /// Whether a change of the accelerations is one of the rounding of forces: those that cancel beside an equilibrium are rounded like the terms
    /// that cancel.
    #[cold]
    #[inline(never)]
    fn is_rounding(&self, t: f64, change: f64) -> bool {
        let i = self.table.s / 2;
        let q = SVector::from_fn(|d, _| self.x[d].0[i]);
        let x = VelocityPoint { q, v: SVector::zeros(), z: 0.0 };
        let (_, once) = gradient_rounding(self.lagrangian, t + self.table.times.0[i], &x);
        let of_acceleration = self.inverse_mass.as_ref().map_or(once.x, |inverse| inverse.abs() * once.x);
        change <= ROUNDINGS * max_abs_or_nan(of_acceleration.iter().copied())
    }

    /// Corrects a sweep by Newton's method. Returns the change, and whether the positions have not moved but for their round-off.
    #[cold]
    #[inline(never)]
    fn correct(&mut self) -> (f64, bool) {
        let Some(newton) = &mut self.newton else { return (f64::NAN, false) };
        let (change, moved) = newton.correct(Instructions::new(), &mut self.rest);
        let width = max_abs_or_nan(self.x.iter().flat_map(|x| &x.0[..self.table.s]).copied());
        (change, moved <= 4.0 * f64::EPSILON * width)
    }

    /// What the sweeps of a step have in common: what comes of the state. With what is below its round-off where a weight is given:
    /// the rests of the state, which are not free of its direction, and as many times what comes of the tails of the matrices.
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
                // The small terms first: a sum that has been rounded would not know them.
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
        // The largest change over lanes may hide a NaN.
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
            table.d.apply(&self.a[d], s, &mut velocities[d], |r| table.inverse_rho.block(r) * v);
        }
        StageValues { lagrangian: self.lagrangian, times: &table.times, t, x: &self.x, v: &velocities }.all::<S>(s)
    }
}

saved!([L, const N: usize] SeparableStages<'_, L, N> {
    rest, x, a, base, q, v, z, far, warm, solved, unforetold, age, defect, taken, review, evaluations,
} and save_solution, load_solution);

impl<L, const N: usize> SeparableStages<'_, L, N> {
    /// The matrix by its slope and whether it has a tail, and Newton's Jacobian.
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
