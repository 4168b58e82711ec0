//! Steps of contact Gauss collocation for every regular Lagrangian.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

mod acceptance;
mod evaluation;
mod iteration;
mod route;
mod state_words;

use crate::gauss::limits::{MAX_DIMENSION_IN_LANES, MIN_JACOBIAN_AGE, SLOW_NEWTON};
use crate::gauss::resolution::tail::Tail;
use crate::gauss::stages::applied_force::AppliedForce;
use crate::gauss::stages::equations::{Products, Workspace};
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::stages::parametrization::{Extension, Parametrization, Values};
use crate::gauss::stages::simplified_newton::{CorrectStages, StageNewton};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::array::from_fn;
use crate::numbers::compensated::{CompensatedSum, Unevaluated, add, finite, values};
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::{Lanes, branched};
use crate::numbers::registers::{StageMap, Stages, blocks};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, VelocityPoint};
use pulp::Simd;

/// The state and the workspace of the general step.
///
/// The unknowns are the velocities V, the actions Z and the integrating factors rho of the stages: `Q = q0 + hA V`,
/// `Z = z0 + hA L`, `rho = 1 - hA (rho L_z)`, `rho L_v = p0 + hA (rho L_q)`. A fixed-point iteration computes the
/// right-hand sides from the last gradients of L, and corrects the velocities by `W^-1` times the residual of the
/// momenta.
///
/// In transformed time the equations are those of `K = g (H + p_t)`: `Q = q0 + hA (g V)`, `Z = z0 + hA (g L)`,
/// `t = t0 + hA g`, `rho = 1 - hA (rho g L_z)`, `rho L_v = p0 + hA (rho g L_q - grad g (rho E + p_t0))`. Here
/// `rho p_t = p_t0`, the momentum conjugate to t at the start, since L does not depend on t.
///
/// By Herglotz' principle the actions of curves with the same start near a motion satisfy `dZ = L_v dQ`. An iteration
/// that changes the stage positions by dQ therefore changes their actions by `L_v dQ` to first order, which is added
/// without an evaluation of L. If L is not affine in z this saves ten to twenty per cent of the iterations.
///
/// A rate that is the same in every step has the same round-off in every step. Therefore `1 - rho`, which is small if
/// the rate is small, is stored instead of rho, and enters through sums whose round-off depends on the motion.
///
/// The matrix of the iteration and the vectors that it multiplies are adjacent, as in
/// [`SeparableStages`](crate::gauss::routes::separable::SeparableStages).
#[repr(C)]
pub(crate) struct General<'a, L, P, const N: usize> {
    /// The matrix M of the [`StageTable`].
    pub(crate) m: StageMap,
    /// The velocities of the stages, and `L_v`.
    pub(crate) v: [Stages; N],
    pub(crate) l_v: [Stages; N],
    /// V, `rho L_q`, L and `rho L_z`, multiplied by the weights `h b`, and by g in transformed time.
    pub(crate) moved: [Stages; N],
    pub(crate) force: [Stages; N],
    pub(crate) l: Stages,
    pub(crate) rate: Stages,
    /// `1 - rho`.
    pub(crate) one_minus_rho_stages: Stages,
    pub(crate) z_stages: Stages,
    pub(crate) x: [Stages; N],
    pub lagrangian: &'a L,
    pub extension: Extension<P>,
    pub table: StageTable,
    pub mass: Mass<N>,
    /// Whether the stage actions are updated by `L_v dQ` within an iteration.
    pub(crate) follows: bool,
    pub q: [CompensatedSum; N],
    pub p: [CompensatedSum; N],
    pub z: CompensatedSum,
    /// `1 - rho` at the end of the last step.
    pub one_minus_rho: f64,
    pub(crate) warm: bool,
    /// Simplified Newton iteration, used while the fixed-point iteration does not converge.
    pub newton: Option<Box<StageNewton<N>>>,
    /// The number of steps since the Jacobian of the simplified Newton iteration was computed.
    pub(crate) age: u32,
    pub(crate) tail: Tail,
    /// The defect of the last step; above one if it does not resolve the motion, or its conformal factor.
    pub defect: f64,
    /// The simplified Newton iteration while it is not used.
    suspended_newton: Option<Box<StageNewton<N>>>,
    /// The workspace of Newton's method; made for the first step in which the fixed-point iteration does not converge.
    by_newton: Option<Box<(Products, Workspace<N>)>>,
    /// Whether the stages of the next step are solved already, with their solution in `v`, `l` and
    /// `one_minus_rho_stages`.
    pub(crate) solved: bool,
    /// Whether `v`, `l` and `one_minus_rho_stages` are a prediction of the next step.
    predicted: bool,
    /// The velocity at the last stage of the last successful step, or at the start of the run; kept separately, since a
    /// failed iteration overwrites the stages.
    pub(crate) known: [f64; N],
    pub evaluations: u64,
}

impl<'a, L: Lagrangian<N>, P: Parametrization<N>, const N: usize> General<'a, L, P, N> {
    /// The step from a state with its velocity, or a guess of it; `z_drives` states that L is not affine in z.
    pub fn new(
        lagrangian: &'a L,
        extension: Extension<P>,
        table: StageTable,
        mass: Mass<N>,
        z_drives: bool,
        state: &PhasePoint<N>,
        v: &SVector<f64, N>,
    ) -> Self {
        let tail = Tail::new(table.s);
        let mut general = General {
            m: table.m.clone(),
            lagrangian,
            extension,
            table,
            mass,
            // In transformed time the times of the stages change too.
            follows: z_drives && P::PHYSICAL,
            q: [0.0.into(); N],
            p: [0.0.into(); N],
            z: 0.0.into(),
            v: [Stages::ZERO; N],
            l_v: [Stages::ZERO; N],
            moved: [Stages::ZERO; N],
            force: [Stages::ZERO; N],
            l: Stages::ZERO,
            rate: Stages::ZERO,
            one_minus_rho_stages: Stages::ZERO,
            z_stages: Stages::ZERO,
            x: [Stages::ZERO; N],
            one_minus_rho: 0.0,
            warm: false,
            newton: None,
            age: 0,
            tail,
            defect: 0.0,
            suspended_newton: None,
            by_newton: None,
            solved: false,
            predicted: false,
            known: (*v).into(),
            evaluations: 0,
        };
        general.q = from_fn(|i| state.q[i].into());
        general.p = from_fn(|i| state.p[i].into());
        general.z = state.z.into();
        general.guess(v);
        general
    }

    /// The velocity at the last stage of the last successful step, or that at the start.
    pub fn last_velocity(&self) -> SVector<f64, N> {
        SVector::from(self.known)
    }

    /// Takes a motion of constant velocity as the initial guess of the next step.
    pub fn guess(&mut self, v: &SVector<f64, N>) {
        self.v = from_fn(|i| Stages([v[i]; MAX_STAGES]));
        self.warm = false;
    }

    /// Switches to simplified Newton iteration with the derivatives of L at a point; `false` if the Jacobian is singular
    /// or not finite.
    fn linearise(&mut self, t: f64, x: &VelocityPoint<N>) -> bool {
        if self.newton.is_none() {
            self.newton = self.suspended_newton.take().or_else(|| Some(Box::new(StageNewton::new(&self.table))));
        }
        let (gradient, hessian) = (self.lagrangian.gradient(t, x), self.lagrangian.hessian(t, x));
        let applied = AppliedForce::of(self.lagrangian, t, x);
        self.newton.as_mut().is_some_and(|newton| newton.factorise(&gradient, &hessian, applied.as_ref()))
    }

    /// Sets the solved stages of the next step: their velocities, values of L and integrating factors.
    fn accept(&mut self, stages: impl Iterator<Item = (SVector<f64, N>, f64, f64)>) {
        self.predict(stages);
        (self.predicted, self.solved) = (false, true);
    }

    /// Sets the initial guess of the next step: velocities, values of L and integrating factors of the stages.
    pub fn predict(&mut self, stages: impl Iterator<Item = (SVector<f64, N>, f64, f64)>) {
        self.l = Stages::ZERO;
        for (i, (v, l, rho)) in stages.enumerate() {
            // The last stage is repeated in the padding.
            for d in 0..N {
                self.v[d].0[i..].fill(v[d]);
            }
            self.l.0[i] = self.table.weights.0[i] * l;
            self.one_minus_rho_stages.0[i..].fill(1.0 - rho);
        }
        (self.warm, self.predicted) = (false, true);
    }

    /// Recomputes the Jacobian of the simplified Newton iteration at the middle stage of the last step.
    #[cold]
    #[inline(never)]
    fn renew(&mut self, t: f64) {
        self.age = 0;
        let i = self.table.s / 2;
        let (q, v) = (SVector::from_fn(|d, _| self.x[d].0[i]), SVector::from_fn(|d, _| self.v[d].0[i]));
        let (t, x) = (t + self.table.times.0[i], VelocityPoint { q, v, z: self.z_stages.0[i] });
        if !self.linearise(t, &x) {
            self.warm = false;
        }
    }

    pub fn values(&self) -> Values<N> {
        let Extension { t, p_t, .. } = self.extension;
        Values { q: self.q, p: self.p, z: self.z, t, p_t, one_minus_rho: self.one_minus_rho }
    }

    /// Continues from other values; the velocities of the stages are the initial guess.
    pub fn reset(&mut self, values: &Values<N>) {
        Values {
            q: self.q,
            p: self.p,
            z: self.z,
            t: self.extension.t,
            p_t: self.extension.p_t,
            one_minus_rho: self.one_minus_rho,
        } = *values;
        self.warm = false;
    }

    /// The rate dt/dtau at the state.
    pub fn rate(&self) -> f64 {
        self.extension.transformation.rate(&SVector::from(values(&self.q)))
    }

    /// Computes the stage velocities multiplied by the weights, and by g in transformed time.
    #[inline(always)]
    fn weighted_velocities<S: Simd>(&mut self) {
        for r in 0..blocks::<S>(self.table.s) {
            let mut weight = self.table.weights.block::<S>(r);
            if !P::PHYSICAL {
                weight *= self.extension.g.block(r);
            }
            for d in 0..N {
                self.moved[d].set(r, weight * self.v[d].block(r));
            }
        }
    }

    /// Inverts W at the stages if it is not constant; `false` if it is singular.
    #[inline(always)]
    fn invert_mass<S: Simd>(&mut self, t: f64) -> bool {
        if matches!(self.mass, Mass::Constant(_)) {
            return true;
        }
        if const { N > MAX_DIMENSION_IN_LANES } {
            return self.invert_one_by_one(t);
        }
        for r in 0..blocks::<S>(self.table.s) {
            let at = self.table.times.block::<S>(r) + t;
            let w = self.lagrangian.mass_matrix(at, &self.point::<S>(r));
            if !self.mass.invert(r, &w) {
                return false;
            }
        }
        true
    }

    /// Computes the positions and the actions of the stages from their velocities and values of L.
    #[inline(always)]
    fn stage_positions<S: Simd>(&mut self) {
        self.weighted_velocities::<S>();
        let (m, s) = (&self.m, self.table.s);
        for ((q, moved), x) in self.q.iter().zip(&self.moved).zip(&mut self.x) {
            let q = Lanes::<S>::splat(q.value);
            m.apply(moved, s, x, q);
        }
        let z = Lanes::<S>::splat(self.z.value);
        m.apply(&self.l, s, &mut self.z_stages, z);
    }

    /// The predictor of a step: extrapolates the polynomials of the last step.
    #[inline(always)]
    fn extrapolate<S: Simd>(&mut self) {
        let s = self.table.s;
        let renewed = 1.0 / (1.0 - self.one_minus_rho);
        let rates = if P::PHYSICAL { None } else { Some(&mut self.extension.g) };
        let StageTable { extrapolation, extrapolation_weighted, .. } = &self.table;
        for x in self.v.iter_mut().chain(&mut self.l_v).chain(rates) {
            let before = *x;
            extrapolation.apply(&before, s, x, Lanes::<S>::splat(0.0));
        }
        // rho is 1 at the start of each step.
        let scaled = self.force.iter_mut().chain([&mut self.rate]).map(|x| (x, renewed));
        for (x, factor) in scaled.chain([(&mut self.l, 1.0)]) {
            let before = *x;
            extrapolation_weighted.apply(&before, s, x, Lanes::<S>::splat(0.0));
            for r in 0..blocks::<S>(s) {
                x.set(r, x.block::<S>(r) * factor);
            }
        }
    }

    /// Takes one step from the time `t`; on failure the state is unchanged.
    #[inline(always)]
    pub fn take_step<S: Simd>(&mut self, t: f64) -> IterationOutcome {
        let (solved, predicted) = (std::mem::take(&mut self.solved), std::mem::take(&mut self.predicted));
        // Without a preceding step the initial guess is a motion of constant velocity.
        let mut cold = !self.warm || self.newton.is_some();
        if self.warm && !solved {
            self.extrapolate::<S>();
            if self.newton.is_some() {
                self.table.m.apply(&self.rate, self.table.s, &mut self.one_minus_rho_stages, Lanes::<S>::splat(0.0));
            }
        } else if !solved && !predicted {
            self.l = Stages::ZERO;
            self.one_minus_rho_stages = Stages::ZERO;
            if !P::PHYSICAL {
                self.extension.g = Stages([self.rate(); MAX_STAGES]);
            }
        }
        self.warm = false;
        self.stage_positions::<S>();
        if !self.invert_mass::<S>(t) {
            return IterationOutcome::NonFinite;
        }
        let mut iteration = FixedPointIteration::until(1.0, 0.25);
        // The extrapolated L_v are not those of the extrapolated velocities. A small first change is then no sign
        // of convergence, and the convergence test starts again with the next iteration.
        let mut carried = !cold && !solved;
        // L is evaluated at one place in the code, so that it is inlined into this loop and compiled for its
        // instruction set.
        loop {
            let change = if cold || solved {
                f64::INFINITY
            } else if self.newton.is_some() {
                let (change, moved) = self.correct();
                iteration.still = moved <= 4.0 * f64::EPSILON;
                change
            } else {
                self.iterate::<S>()
            };
            let of_transformed = self.evaluate::<S>(t);
            if solved {
                let outcome = self.finish::<S>();
                self.assess_resolution::<S>(f64::INFINITY);
                return outcome;
            }
            if cold {
                cold = false;
                continue;
            }
            // `f64::max` would hide a NaN.
            let change = if !P::PHYSICAL && (of_transformed > change || of_transformed.is_nan()) {
                of_transformed
            } else {
                change
            };
            match iteration.assess(change, 1.0) {
                IterationOutcome::Continue => {}
                IterationOutcome::Done if carried => iteration = FixedPointIteration::until(1.0, 0.25),
                IterationOutcome::Done => {
                    let outcome = self.finish::<S>();
                    self.assess_resolution::<S>(iteration.first());
                    self.age = self.age.saturating_add(1);
                    if self.newton.is_some() && iteration.count() > SLOW_NEWTON && self.age > MIN_JACOBIAN_AGE {
                        self.renew(t);
                    }
                    return outcome;
                }
                IterationOutcome::Slow { .. } if self.holds::<S>(t) => return self.finish::<S>(),
                refused => return refused,
            }
            carried = false;
        }
    }

    /// One simplified Newton iteration, in place of [`iterate`](Self::iterate).
    #[cold]
    #[inline(never)]
    fn correct(&mut self) -> (f64, f64) {
        let Some(newton) = &self.newton else { return (f64::NAN, f64::NAN) };
        Instructions::new().dispatch(CorrectStages {
            newton,
            table: &self.table,
            start: (values(&self.q), values(&self.p), self.z.value),
            l_v: &self.l_v,
            l: &self.l,
            force: &self.force,
            rate: &self.rate,
            v: &mut self.v,
            z: &mut self.z_stages,
            one_minus_rho_stages: &mut self.one_minus_rho_stages,
            moved: &mut self.moved,
            x: &mut self.x,
        })
    }

    /// The end of the step from its stages.
    #[inline(always)]
    fn finish<S: Simd>(&mut self) -> IterationOutcome {
        if !P::PHYSICAL {
            // With the rates of the last evaluation.
            self.weighted_velocities::<S>();
        }
        let s = self.table.s;
        let (one_minus_rho, dz) = (self.rate.sum::<S>(s), self.l.sum::<S>(s));
        let mut deepest = Lanes::<S>::splat(f64::NEG_INFINITY);
        for r in 0..blocks::<S>(s) {
            deepest = deepest.max(self.one_minus_rho_stages.block::<S>(r));
        }
        let rho = 1.0 - deepest.reduce_max();
        if rho <= 0.0 {
            return IterationOutcome::StageFactor { rho };
        }
        if one_minus_rho >= 1.0 {
            return IterationOutcome::SigmaVanished { sigma: 1.0 / (1.0 - one_minus_rho) };
        }
        // sigma_d - 1: adding this to 1 would round it if the rate is small.
        let grow = one_minus_rho / (1.0 - one_minus_rho);
        let single = |head| Unevaluated { head, tail: 0.0 };
        let (mut dq, mut dp) = ([Unevaluated::default(); N], [Unevaluated::default(); N]);
        for d in 0..N {
            dq[d] = single(self.moved[d].sum::<S>(s));
            let pushed = self.force[d].sum::<S>(s);
            dp[d] = Unevaluated { head: pushed, tail: grow * (pushed + self.p[d].value) };
        }
        if branched() {
            return IterationOutcome::Branched;
        }
        // The maximum over lanes may hide a NaN; a NaN in `one_minus_rho` shows in `dp`.
        if !finite(&dq, &dp, single(dz)) {
            return IterationOutcome::NonFinite;
        }
        if !P::PHYSICAL {
            let mut dt = Stages::ZERO;
            for r in 0..blocks::<S>(s) {
                dt.set(r, self.table.weights.block::<S>(r) * self.extension.g.block(r));
            }
            let dt = dt.sum::<S>(s);
            let runs = self.extension.g.0[..s].iter().all(|g| *g > 0.0);
            if !(runs && dt.is_finite()) {
                return IterationOutcome::NonFinite;
            }
            self.extension.t.add(single(dt));
            self.extension.p_t.add(single(grow * self.extension.p_t.value));
        }
        add(&mut self.q, &dq);
        add(&mut self.p, &dp);
        self.z.add(single(dz));
        self.one_minus_rho = one_minus_rho;
        for d in 0..N {
            self.known[d] = self.v[d].0[s - 1];
        }
        self.warm = true;
        IterationOutcome::Done
    }
}
