//! Steps of contact Gauss collocation for a contact Hamiltonian.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

mod iteration;
mod newton;
mod route;
mod tangent;

use crate::gauss::limits::{MAX_UNCHECKED_FACTOR_CHANGE, MIN_JACOBIAN_AGE, SLOW_NEWTON};
use crate::gauss::resolution::tail::{Tail, of_sigma};
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::array::from_fn;
use crate::numbers::compensated::{CompensatedSum, Unevaluated, add, finite, values};
use crate::numbers::lanes::{Lanes, branched};
use crate::numbers::registers::{Stages, blocks};
use crate::resolution::thresholds::MIN_CHECKED_CHANGE;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{
    Lagrangian, PhasePoint, VelocityPoint, numbers::max_abs_or_nan, numbers::max_or_nan, support::rounding_at_state,
};
use newton::{FullNewton, SimplifiedNewton};
use pulp::Simd;
pub(crate) use tangent::{StepDerivatives, step_derivatives, step_jacobian};

/// The number of steps for which `H_pp` is kept: its evaluation by dual numbers costs up to as much as a step.
const PP_AGE: u32 = 8;

/// The state and the workspace of a step.
///
/// The method is Gauss collocation of the symplectified motion, that of `rho H(t, q, P / rho, z)` in the canonical
/// variables (q, P) and (z, -rho), with rho = 1 at the start of each step:
///
/// `Q = q0 + hA H_p`, `P = p0 - hA (rho H_q)`, `Z = z0 + hA (p . H_p - H)`, `rho = 1 + hA (rho H_z)`, `p = P / rho`.
///
/// It is symplectic there and commutes with the scaling of (P, rho), so that its reduction to T\*Q x R is conformally
/// contact with `sigma_d = 1 / rho`, whatever the rank of `H_pp`. The equations are solved by fixed-point iteration,
/// with the values of the right-hand sides at the stages as the unknowns.
///
/// With an applied force f, `f - H_q` is in the place of `-H_q`.
pub(crate) struct HamiltonianStages<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub table: StageTable,
    /// The right-hand sides, multiplied by the weights `h b`: `H_p`, `-rho H_q`, `p . H_p - H` and `-rho H_z`.
    moved: [Stages; N],
    force: [Stages; N],
    l: Stages,
    rate: Stages,
    /// The velocities `H_p`.
    v: [Stages; N],
    /// The stages: positions, momenta, actions, `1 - rho`.
    x: [Stages; N],
    p_stages: [Stages; N],
    z_stages: Stages,
    one_minus_rho_stages: Stages,
    pub q: [CompensatedSum; N],
    pub p: [CompensatedSum; N],
    pub z: CompensatedSum,
    /// `1 - rho` at the end of the last step.
    one_minus_rho: f64,
    /// `H_pp` at an earlier state, by which velocities follow momenta within an iteration, and the number of steps since.
    pp: Box<SMatrix<f64, N, N>>,
    pp_age: u32,
    /// The least values with which changes of momenta and of the action are compared: 0, and in a step whose iteration does
    /// not converge otherwise, those of which the round-off of `h H_q` and `h (p . H_p - H)` is one unit.
    least: [f64; 2],
    /// Whether the right-hand sides are those of the last step.
    warm: bool,
    /// Whether the right-hand sides are the solution of the next step.
    solved: bool,
    /// Simplified Newton iteration, used while the fixed-point iteration does not converge.
    newton: Option<Box<SimplifiedNewton>>,
    suspended_newton: Option<Box<SimplifiedNewton>>,
    /// The number of steps since the Jacobian of the simplified Newton iteration was computed.
    age: u32,
    full_newton: Option<Box<FullNewton>>,
    tail: Tail,
    defect: f64,
    /// The velocity at the last stage of the last successful step, or at the start.
    known: [f64; N],
    evaluations: u64,
}

impl<'a, L: Lagrangian<N>, const N: usize> HamiltonianStages<'a, L, N> {
    /// The steps from a state with its velocity.
    pub fn new(lagrangian: &'a L, table: StageTable, state: &PhasePoint<N>, v: &SVector<f64, N>) -> Self {
        let tail = Tail::new(table.s);
        HamiltonianStages {
            lagrangian,
            table,
            moved: [Stages::ZERO; N],
            force: [Stages::ZERO; N],
            l: Stages::ZERO,
            rate: Stages::ZERO,
            v: [Stages::ZERO; N],
            x: [Stages::ZERO; N],
            p_stages: [Stages::ZERO; N],
            z_stages: Stages::ZERO,
            one_minus_rho_stages: Stages::ZERO,
            q: from_fn(|d| state.q[d].into()),
            p: from_fn(|d| state.p[d].into()),
            z: state.z.into(),
            one_minus_rho: 0.0,
            pp: Box::new(SMatrix::zeros()),
            pp_age: PP_AGE,
            least: [0.0; 2],
            warm: false,
            solved: false,
            newton: None,
            suspended_newton: None,
            age: 0,
            full_newton: None,
            tail,
            defect: 0.0,
            known: (*v).into(),
            evaluations: 0,
        }
    }

    /// The state at the start of the next step.
    pub fn phase_point(&self) -> PhasePoint<N> {
        PhasePoint { q: values(&self.q).into(), p: values(&self.p).into(), z: self.z.value }
    }

    /// Takes one step from the time `t`; on failure the state is unchanged.
    #[inline(always)]
    pub fn take_step<S: Simd>(&mut self, t: f64) -> IterationOutcome {
        let (solved, warm) = (std::mem::take(&mut self.solved), std::mem::take(&mut self.warm));
        if !solved {
            self.renew_pp(t);
            if warm {
                self.extrapolate::<S>();
            }
            if self.newton.is_some() {
                self.keep_iterate(warm);
            }
        }
        let new_iteration = || FixedPointIteration::until(1.0, 0.25);
        let mut iteration = new_iteration();
        let mut first = true;
        self.least = [0.0; 2];
        // H is evaluated at one place in the code, so that it is inlined into this loop and compiled for its instruction
        // set.
        loop {
            let by_newton = !first && self.newton.is_some();
            if by_newton {
                self.correct();
            }
            let change = if first && !solved && !warm {
                self.rest_stages();
                f64::INFINITY
            } else {
                self.move_stages::<S>(!first && !by_newton)
            };
            self.evaluate::<S>(t);
            if solved {
                let outcome = self.finish::<S>();
                self.assess_resolution::<S>(f64::INFINITY);
                return outcome;
            }
            if std::mem::take(&mut first) {
                continue;
            }
            match iteration.assess(change, 1.0) {
                IterationOutcome::Continue => {}
                IterationOutcome::Done => {
                    let outcome = self.finish::<S>();
                    self.assess_resolution::<S>(iteration.first());
                    self.age = self.age.saturating_add(1);
                    if self.newton.is_some() && iteration.count() > SLOW_NEWTON && self.age > MIN_JACOBIAN_AGE {
                        self.renew(t);
                    }
                    return outcome;
                }
                IterationOutcome::Slow { .. } if self.least == [0.0; 2] && self.admit_round_off(t) => {
                    iteration = new_iteration();
                }
                refused => return refused,
            }
        }
    }

    /// Admits changes of the size of the round-off of the forces and of L at the start of the step, as at an equilibrium,
    /// where forces cancel and momenta vanish. Returns whether there is any.
    #[cold]
    #[inline(never)]
    fn admit_round_off(&mut self, t: f64) -> bool {
        let state = self.phase_point();
        let x = VelocityPoint { q: state.q, v: SVector::from(self.known), z: state.z };
        let (of_l, of_gradient) = rounding_at_state(self.lagrangian, t, &x, &state);
        let least =
            [max_abs_or_nan(of_gradient.x.iter().copied()), of_l].map(|once| self.table.h.abs() * once / f64::EPSILON);
        let is_usable = least.iter().all(|e| e.is_finite()) && least.iter().any(|e| *e > 0.0);
        if is_usable {
            self.least = least;
        }
        is_usable
    }

    /// Evaluates `H_pp` at the state, where it is old.
    #[inline(always)]
    fn renew_pp(&mut self, t: f64) {
        self.pp_age += 1;
        if self.pp_age > PP_AGE {
            self.pp_age = 0;
            self.evaluate_pp(t);
        }
    }

    #[cold]
    #[inline(never)]
    fn evaluate_pp(&mut self, t: f64) {
        let pp = self.lagrangian.hamiltonian_hessian(t, &self.phase_point()).map_or(SMatrix::zeros(), |h| h.vv);
        // Where it is not finite, velocities follow in the next evaluation.
        *self.pp = if pp.iter().all(|e| e.is_finite()) { pp } else { SMatrix::zeros() };
    }

    /// The stages of a motion at rest, from which the iteration of a first step starts.
    fn rest_stages(&mut self) {
        for d in 0..N {
            self.x[d] = Stages([self.q[d].value; MAX_STAGES]);
            self.p_stages[d] = Stages([self.p[d].value; MAX_STAGES]);
        }
        self.z_stages = Stages([self.z.value; MAX_STAGES]);
        self.one_minus_rho_stages = Stages::ZERO;
    }

    /// The predictor of a step: extrapolates the polynomials of the last step. rho is 1 at the start of each step.
    #[inline(always)]
    fn extrapolate<S: Simd>(&mut self) {
        let (s, renewed) = (self.table.s, 1.0 / (1.0 - self.one_minus_rho));
        let map = self.table.extrapolation_weighted;
        let scaled = self.force.iter_mut().chain([&mut self.rate]).map(|x| (x, renewed));
        for (x, factor) in scaled.chain(self.moved.iter_mut().chain([&mut self.l]).map(|x| (x, 1.0))) {
            let before = *x;
            map.apply(&before, s, x, Lanes::<S>::splat(0.0));
            for r in 0..blocks::<S>(s) {
                x.set(r, x.block::<S>(r) * factor);
            }
        }
    }

    /// The end of the step from its stages.
    #[inline(always)]
    fn finish<S: Simd>(&mut self) -> IterationOutcome {
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
        let (mut dq, mut dp) = ([Unevaluated::default(); N], [Unevaluated::default(); N]);
        for d in 0..N {
            dq[d] = Unevaluated { head: self.moved[d].sum::<S>(s), tail: 0.0 };
            let pushed = self.force[d].sum::<S>(s);
            dp[d] = Unevaluated { head: pushed, tail: grow * (pushed + self.p[d].value) };
        }
        if branched() {
            return IterationOutcome::Branched;
        }
        let dz = Unevaluated { head: dz, tail: 0.0 };
        // The maximum over lanes may hide a NaN; a NaN in `one_minus_rho` shows in `dp`.
        if !finite(&dq, &dp, dz) || !one_minus_rho.is_finite() {
            return IterationOutcome::NonFinite;
        }
        add(&mut self.q, &dq);
        add(&mut self.p, &dp);
        self.z.add(dz);
        self.one_minus_rho = one_minus_rho;
        for d in 0..N {
            self.known[d] = self.v[d].0[s - 1];
        }
        self.warm = true;
        IterationOutcome::Done
    }

    /// Sets the defect of the last step, of velocities, momenta and the conformal factor. `first` is the relative error
    /// of its predictor; the stages are checked only if it is large.
    #[inline(always)]
    fn assess_resolution<S: Simd>(&mut self, first: f64) {
        self.defect = 0.0;
        if first > MIN_CHECKED_CHANGE {
            let of_velocities = self.tail.defect::<S>(&self.v, None, &self.x, self.table.h);
            let of_momenta = self.tail.defect::<S>(&self.p_stages, None, &self.p_stages, 1.0);
            self.defect = max_or_nan(of_velocities, of_momenta);
        }
        if first > MIN_CHECKED_CHANGE || self.one_minus_rho.abs() > MAX_UNCHECKED_FACTOR_CHANGE {
            let one = Lanes::<S>::splat(1.0);
            let mut integral = Lanes::<S>::splat(0.0);
            for r in 0..blocks::<S>(self.table.s) {
                integral += self.rate.block::<S>(r) / (one - self.one_minus_rho_stages.block(r));
            }
            self.defect = max_or_nan(self.defect, of_sigma(1.0 / (1.0 - self.one_minus_rho), integral.sum()));
        }
    }
}
