//! The derivatives of L and of the force at the solved stages of a step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::integration::{SolvedStages, depends_on_action};
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{MAX_STAGES, StageMap, Stages, blocks};
use crate::sensitivity::parametric_system::Differentiable;
use crate::sensitivity::stage_matrix::{StageMatrix, StageVector, stage_vector};
use crate::sensitivity::step_maps::StepMaps;
use crate::{Point, SystemProblem, Vector};
use contact_geom::nalgebra::DMatrix;
use pulp::Simd;

/// The points of the stages, with the integrating factor there and at the end, and the derivatives of L and of the
/// applied force f.
pub(crate) struct StageDerivatives {
    pub s: usize,
    pub times: Stages,
    pub q: StageVector,
    pub v: StageVector,
    pub z: Stages,
    pub rho: Stages,
    /// `rho` and the momentum at the end of the step.
    pub end_rho: f64,
    pub end_p: Vector,
    /// `(rho W)^-1`.
    pub inverse_mass: StageMatrix,
    pub l: Stages,
    pub l_q: StageVector,
    pub l_v: StageVector,
    pub l_z: Stages,
    /// Second derivatives: `qv` is `d2L / dq_i dv_j`.
    pub qq: StageMatrix,
    pub qv: StageMatrix,
    pub qz: StageVector,
    pub vz: StageVector,
    pub zz: Stages,
    pub force: Option<Box<StageForces>>,
    pub form: Form,
}

/// What the structure of L makes unnecessary.
pub(crate) struct Form {
    /// Whether `L_qv = 0` and W is constant.
    pub separable: bool,
    /// Whether `L_qz`, `L_vz` and `L_zz` vanish, and the force does not depend on z.
    pub affine: bool,
    /// `W^-1`, if it is constant.
    pub inverse_mass: Option<DMatrix<f64>>,
}

/// The applied force at each stage, with its derivatives.
pub(crate) struct StageForces {
    pub value: StageVector,
    pub q: StageMatrix,
    pub v: StageMatrix,
    pub z: StageVector,
}

impl StageDerivatives {
    /// The workspace.
    pub fn new(problem: &Differentiable<'_>) -> Self {
        let SystemProblem { system, t0, start, structure, .. } = &problem.problem;
        let n = problem.dimension();
        let (vector, matrix) = (|| stage_vector(n), || StageMatrix::zeros(n));
        let constant_mass = structure.constant_mass || structure.separable;
        let force = || StageForces { value: vector(), q: matrix(), v: matrix(), z: vector() };
        StageDerivatives {
            s: 0,
            times: Stages::ZERO,
            q: vector(),
            v: vector(),
            z: Stages::ZERO,
            rho: Stages::ZERO,
            end_rho: 1.0,
            end_p: Vector::zeros(n),
            inverse_mass: matrix(),
            l: Stages::ZERO,
            l_q: vector(),
            l_v: vector(),
            l_z: Stages::ZERO,
            qq: matrix(),
            qv: matrix(),
            qz: vector(),
            vz: vector(),
            zz: Stages::ZERO,
            force: system.has_force().then(|| Box::new(force())),
            form: Form {
                separable: structure.separable,
                affine: !depends_on_action(&**system, structure),
                inverse_mass: if constant_mass { system.hessian(*t0, start).vv.try_inverse() } else { None },
            },
        }
    }

    /// Sets the points of the stages of a step, except z where the step does not have its values of L, with the integrating
    /// factor, and what is known at the end; `forward` are the maps of the step.
    #[inline(always)]
    pub fn set_points<S: Simd>(&mut self, forward: &StepMaps, step: &SolvedStages) {
        let (s, n) = (step.s, self.q.len());
        self.s = s;
        self.times = forward.times.map(|time| step.t + time);
        self.v.copy_from_slice(&step.v);
        let (v, q, q0) = (&mut self.v[..n], &mut self.q[..n], &step.start.q[..n]);
        for d in 0..n {
            let last = v[d].0[s - 1];
            v[d].0[s..].fill(last);
            q[d] = stage_values::<S>(forward, &v[d], q0[d]);
        }
        self.z = if step.knows_l { stage_values::<S>(forward, &step.l, step.start.z) } else { Stages::ZERO };
        let fallen = stage_values::<S>(forward, &step.rate, 0.0);
        self.rho = fallen.map(|fallen| 1.0 - fallen);
        self.end_rho = 1.0 - end_value::<S>(forward, &step.rate);
        let (end_p, p0, force) = (&mut self.end_p[..n], &step.start.p[..n], &step.force[..n]);
        for d in 0..n {
            end_p[d] = (p0[d] + end_value::<S>(forward, &force[d])) / self.end_rho;
        }
    }

    /// Sets z, and adds `gamma z` to L, at the stages of a step that does not have its values of L: L is then `L_0 + gamma z`
    /// with constant gamma, and `actions` maps `z0 + A L_0` to z.
    #[inline(always)]
    pub fn set_actions<S: Simd>(&mut self, forward: &StepMaps, step: &SolvedStages, actions: &StageMap) {
        let without = stage_values::<S>(forward, &self.l, step.start.z);
        actions.apply::<S>(&without, step.s, &mut self.z, Lanes::<S>::splat(0.0));
        for i in 0..MAX_STAGES {
            self.l.0[i] += self.l_z.0[i] * self.z.0[i];
        }
    }

    /// The point of a stage.
    #[inline(always)]
    pub fn point(&self, i: usize) -> (f64, Point) {
        let n = self.q.len();
        let mut x = Point { q: Vector::zeros(n), v: Vector::zeros(n), z: 0.0 };
        (self.move_point(i, &mut x), x)
    }

    /// Moves a point to a stage; returns its time.
    #[inline(always)]
    pub fn move_point(&self, i: usize, x: &mut Point) -> f64 {
        for (to, from) in x.q.iter_mut().zip(&self.q) {
            *to = from.0[i];
        }
        for (to, from) in x.v.iter_mut().zip(&self.v) {
            *to = from.0[i];
        }
        x.z = self.z.0[i];
        self.times.0[i]
    }
}

/// `start + A rates` at the stages.
#[inline(always)]
pub(crate) fn stage_values<S: Simd>(maps: &StepMaps, rates: &Stages, start: f64) -> Stages {
    let (mut values, start) = (Stages::ZERO, Lanes::<S>::splat(start));
    maps.to_stages.apply::<S>(rates, maps.s, &mut values, start);
    values
}

/// `weights . rates`.
#[inline(always)]
pub(crate) fn end_value<S: Simd>(maps: &StepMaps, rates: &Stages) -> f64 {
    let mut sum = Lanes::<S>::splat(0.0);
    for r in 0..blocks::<S>(maps.s) {
        sum = maps.weights.block::<S>(r).mul_add(rates.block(r), sum);
    }
    sum.sum()
}
