//! Steps of contact Gauss collocation for every regular Lagrangian.

mod acceptance;
mod by_points;
mod evaluation;
mod iteration;
mod kernel;
mod route;
mod start;
mod state_words;
mod vectors;

use crate::gauss::limits::{MIN_JACOBIAN_AGE, SLOW_NEWTON};
use crate::gauss::resolution::tail::Tail;
use crate::gauss::stages::equations::{Products, Workspace};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::increments::Increments;
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::stages::stage_newton::StageNewton;
use crate::gauss::system::{PointGradient, PointRef, SystemAtPoints};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::compensated::{CompensatedSum, copy_values};
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{StageMap, Stages};
use acceptance::FinishStep;
pub(crate) use kernel::{GeneralKernel, GivenStages, InTransformedTime};
use start::StartStep;
use vectors::{StageVectors, Vectors};

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
/// The matrix of the iteration and the vectors that it multiplies are adjacent for few coordinates, see
/// [`StageVectors`].
#[repr(C)]
pub(crate) struct General {
    /// The matrix M of the [`StageTable`].
    m: StageMap,
    /// L and `rho L_z`, multiplied by the weights `h b`, and by g in transformed time.
    l: Stages,
    rate: Stages,
    /// `1 - rho`.
    one_minus_rho_stages: Stages,
    z_stages: Stages,
    vectors: StageVectors,
    /// Whether the steps are equal in transformed time.
    transformed: bool,
    pub extension: Extension,
    pub table: StageTable,
    arch: Instructions,
    mass: Mass,
    /// Whether the stage actions are updated by `L_v dQ` within an iteration.
    follows: bool,
    q: Vec<CompensatedSum>,
    p: Vec<CompensatedSum>,
    z: CompensatedSum,
    /// `1 - rho` at the end of the last step.
    pub one_minus_rho: f64,
    warm: bool,
    /// Simplified Newton iteration, used while the fixed-point iteration does not converge.
    newton: Option<Box<StageNewton>>,
    /// The number of steps since the Jacobian of the simplified Newton iteration was computed.
    age: u32,
    tail: Tail,
    /// The defect of the last step; above one if it does not resolve the motion, or its conformal factor.
    pub defect: f64,
    /// The simplified Newton iteration while it is not used.
    suspended_newton: Option<Box<StageNewton>>,
    /// The workspace of Newton's method; made for the first step in which the fixed-point iteration does not converge.
    by_newton: Option<Box<(Products, Workspace)>>,
    /// Whether the stages of the next step are solved already, with their solution in the velocities, `l` and
    /// `one_minus_rho_stages`.
    solved: bool,
    /// Whether the velocities, `l` and `one_minus_rho_stages` are a prediction of the next step.
    predicted: bool,
    /// The velocity at the last stage of the last successful step, or at the start of the run; kept separately, since a
    /// failed iteration overwrites the stages.
    known: Vec<f64>,
    pub evaluations: u64,
    /// See [`set_tolerance`](crate::gauss::routes::StageRoute::set_tolerance).
    tolerance: f64,
    /// The point at which the system is evaluated outside of the iteration.
    point: Point,
    /// Bounds of the round-off of the gradient there.
    rounding: PointGradient,
    increments: Increments,
}

/// The additional variables of a step in transformed time.
pub(crate) struct Extension {
    pub t: CompensatedSum,
    /// The momentum conjugate to t.
    pub p_t: CompensatedSum,
    /// The rates g of the stages.
    pub g: Stages,
}

impl Extension {
    pub fn new(t: f64, p_t: f64) -> Self {
        Extension { t: t.into(), p_t: p_t.into(), g: Stages::ZERO }
    }
}

/// A position, velocity, momentum and action.
struct Point {
    q: Vec<f64>,
    v: Vec<f64>,
    p: Vec<f64>,
    z: f64,
}

impl Point {
    fn at(&self) -> PointRef<'_> {
        PointRef { q: &self.q, v: &self.v, z: self.z }
    }
}

/// The state with the compensation terms of its sums.
pub(crate) struct Values {
    pub q: Vec<CompensatedSum>,
    pub p: Vec<CompensatedSum>,
    pub z: CompensatedSum,
    pub t: CompensatedSum,
    pub p_t: CompensatedSum,
    pub one_minus_rho: f64,
}

impl General {
    /// The step from a state `(q, p, z)` with its velocity, or a guess of it, in physical time or in transformed time;
    /// `z_drives` states that L is not affine in z.
    pub fn new(
        (extension, transformed): (Extension, bool),
        table: StageTable,
        mass: Mass,
        z_drives: bool,
        state: PointRef<'_>,
        v: &[f64],
    ) -> Self {
        let n = state.q.len();
        let sums = |x: &[f64]| x.iter().map(|x| CompensatedSum::from(*x)).collect();
        let line = || vec![0.0; n];
        let mut general = General {
            m: table.m.clone(),
            l: Stages::ZERO,
            rate: Stages::ZERO,
            one_minus_rho_stages: Stages::ZERO,
            z_stages: Stages::ZERO,
            vectors: StageVectors::zeros(n),
            transformed,
            extension,
            tail: Tail::new(table.s),
            table,
            arch: Instructions::new(),
            mass,
            // In transformed time the times of the stages change too.
            follows: z_drives && !transformed,
            q: sums(state.q),
            p: sums(state.v),
            z: state.z.into(),
            one_minus_rho: 0.0,
            warm: false,
            newton: None,
            age: 0,
            defect: 0.0,
            suspended_newton: None,
            by_newton: None,
            solved: false,
            predicted: false,
            known: v.to_vec(),
            evaluations: 0,
            tolerance: 0.0,
            point: Point { q: line(), v: v.to_vec(), p: line(), z: 0.0 },
            rounding: PointGradient::zeros(n),
            increments: Increments::zeros(n),
        };
        general.guess();
        general
    }

    /// Takes a motion with the constant velocity of `point` as the initial guess of the next step.
    fn guess(&mut self) {
        for (stages, v) in self.vectors.split().v.iter_mut().zip(&self.point.v) {
            *stages = Stages([*v; MAX_STAGES]);
        }
        self.warm = false;
    }

    /// Switches to simplified Newton iteration with the derivatives of L at `point`; `false` if the Jacobian is singular
    /// or not finite.
    fn linearise(&mut self, system: &dyn SystemAtPoints, t: f64) -> bool {
        self.reserve(system);
        if self.newton.is_none() {
            let new = || Some(Box::new(StageNewton::new(self.q.len(), &self.table)));
            self.newton = self.suspended_newton.take().or_else(new);
        }
        let (Some(newton), Some(by_newton)) = (&mut self.newton, &mut self.by_newton) else { return false };
        let derivatives = by_newton.1.derivatives();
        system.derivatives(t, self.point.at(), derivatives);
        newton.factorise(derivatives)
    }

    /// Allocates the workspace of Newton's method.
    fn reserve(&mut self, system: &dyn SystemAtPoints) {
        if self.by_newton.is_none() {
            let products = Products::new(self.table.s, self.table.h);
            self.by_newton = Some(Box::new((products, Workspace::new(system, self.table.s, false))));
        }
    }

    /// Recomputes the Jacobian of the simplified Newton iteration at the middle stage of the last step.
    #[cold]
    #[inline(never)]
    fn renew(&mut self, system: &dyn SystemAtPoints, t: f64) {
        self.age = 0;
        let i = self.table.s / 2;
        self.take_stage(i);
        if !self.linearise(system, t + self.table.times.0[i]) {
            self.warm = false;
        }
    }

    /// Sets `point` to a stage.
    fn take_stage(&mut self, i: usize) {
        let Vectors { x, v, .. } = self.vectors.split();
        for d in 0..x.len() {
            (self.point.q[d], self.point.v[d]) = (x[d].0[i], v[d].0[i]);
        }
        self.point.z = self.z_stages.0[i];
    }

    /// Sets the position, momentum and action of `point` to those of the state.
    fn take_state(&mut self) {
        copy_values(&self.q, &mut self.point.q);
        copy_values(&self.p, &mut self.point.p);
        self.point.z = self.z.value;
    }

    pub fn values(&self) -> Values {
        let Extension { t, p_t, .. } = self.extension;
        let (q, p) = (self.q.clone(), self.p.clone());
        Values { q, p, z: self.z, t, p_t, one_minus_rho: self.one_minus_rho }
    }

    /// The same without an allocation.
    pub fn copy_values_to(&self, values: &mut Values) {
        values.q.copy_from_slice(&self.q);
        values.p.copy_from_slice(&self.p);
        values.z = self.z;
        (values.t, values.p_t) = (self.extension.t, self.extension.p_t);
        values.one_minus_rho = self.one_minus_rho;
    }

    /// Continues from other values; the velocities of the stages are the initial guess.
    pub fn reset(&mut self, values: &Values) {
        self.q.copy_from_slice(&values.q);
        self.p.copy_from_slice(&values.p);
        self.z = values.z;
        (self.extension.t, self.extension.p_t) = (values.t, values.p_t);
        self.one_minus_rho = values.one_minus_rho;
        self.forget_stages();
    }

    /// Does not extrapolate the next step from the last one; the velocities of the stages are its initial guess.
    pub fn forget_stages(&mut self) {
        self.warm = false;
    }

    /// The rate dt/dtau at the state.
    pub fn rate(&mut self, system: &dyn SystemAtPoints) -> f64 {
        copy_values(&self.q, &mut self.point.q);
        system.dt_dtau(&self.point.q)
    }

    /// Takes one step from the time `t`; on failure the state is unchanged. The kernel evaluates L of the system in the
    /// time in which the steps are equal.
    pub fn take_step(&mut self, system: &dyn SystemAtPoints, kernel: &dyn GeneralKernel, t: f64) -> IterationOutcome {
        let (solved, predicted) = (std::mem::take(&mut self.solved), std::mem::take(&mut self.predicted));
        let extrapolates = self.warm && !solved;
        if !self.warm && !solved && !predicted {
            // Without a preceding step the initial guess is a motion of constant velocity.
            self.l = Stages::ZERO;
            self.one_minus_rho_stages = Stages::ZERO;
            if self.transformed {
                self.extension.g = Stages([self.rate(system); MAX_STAGES]);
            }
        }
        let given = match () {
            () if solved => GivenStages::Solution,
            () if self.warm && self.newton.is_none() => GivenStages::WithGradients,
            () => GivenStages::Guess,
        };
        self.warm = false;
        self.arch.dispatch(StartStep { general: self, extrapolates });
        if self.mass.is_inverted_by_stages() && !self.invert_one_by_one(system, t) {
            return IterationOutcome::NonFinite;
        }
        let (outcome, iteration) = kernel.solve_general_stages(self.arch, t, given, self);
        match outcome {
            IterationOutcome::Done if solved => self.finish(Some(f64::INFINITY)),
            IterationOutcome::Done => {
                let outcome = self.finish(Some(iteration.first()));
                self.age = self.age.saturating_add(1);
                if self.newton.is_some() && iteration.count() > SLOW_NEWTON && self.age > MIN_JACOBIAN_AGE {
                    self.renew(system, t);
                }
                outcome
            }
            IterationOutcome::Slow { .. } if self.holds(system, t) => self.finish(None),
            refused => refused,
        }
    }

    /// The end of the step from its stages, and its defect if the relative error of its predictor is given.
    fn finish(&mut self, first: Option<f64>) -> IterationOutcome {
        self.arch.dispatch(FinishStep { general: self, first })
    }

    /// Inverts W at one stage after another; `false` if it is singular.
    fn invert_one_by_one(&mut self, system: &dyn SystemAtPoints, t: f64) -> bool {
        (0..self.table.s).all(|i| {
            self.take_stage(i);
            self.mass.invert_stage(system, i, t + self.table.times.0[i], self.point.at())
        })
    }
}
