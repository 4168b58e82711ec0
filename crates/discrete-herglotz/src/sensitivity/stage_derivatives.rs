//! The derivatives of L and of the force at the solved stages of a step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::limits::MAX_DIMENSION_IN_LANES;
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::integration::OfTyped;
use crate::integration::depends_on_action;
use crate::numbers::lanes::{Lanes, branched, forget_branches};
use crate::numbers::registers::{StageMap, Stages, blocks};
use crate::sensitivity::fixed_stages::FixedStages;
use crate::sensitivity::step_maps::StepMaps;
use crate::system::applied_force::AppliedForce;
use crate::{Problem, StepError};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::support::{KernelDual, linear};
use contact_geom::{
    ChartVector, Derivatives, Hessian, Lagrangian, Scalar, VelocityPoint, numbers::TangentVector, vector,
};
use num_traits::{One, Zero};
use pulp::Simd;

/// A matrix, or a vector, at each stage.
pub(crate) type StageMatrix<const N: usize> = [[Stages; N]; N];
pub(crate) type StageVector<const N: usize> = [Stages; N];

/// The largest dimension for which second derivatives without closed ones are computed in SIMD lanes: the nested dual
/// numbers do not fit in registers.
const MAX_DIMENSION_OF_NESTED_LANES: usize = 3;

/// The points of the stages, with the integrating factor there and at the end, and the derivatives of L and of the
/// applied force f.
pub(crate) struct StageDerivatives<const N: usize> {
    pub s: usize,
    pub times: Stages,
    pub q: StageVector<N>,
    pub v: StageVector<N>,
    pub z: Stages,
    pub rho: Stages,
    /// `rho` and the momentum at the end of the step.
    pub end_rho: f64,
    pub end_p: SVector<f64, N>,
    /// `(rho W)^-1`.
    pub inverse_mass: StageMatrix<N>,
    pub l: Stages,
    pub l_q: StageVector<N>,
    pub l_v: StageVector<N>,
    pub l_z: Stages,
    /// Second derivatives: `qv` is `d2L / dq_i dv_j`.
    pub qq: StageMatrix<N>,
    pub qv: StageMatrix<N>,
    pub qz: StageVector<N>,
    pub vz: StageVector<N>,
    pub zz: Stages,
    pub force: Option<Box<StageForces<N>>>,
    pub form: Form<N>,
}

/// What the structure of L makes unnecessary.
pub(crate) struct Form<const N: usize> {
    /// Whether `L_qv = 0` and W is constant.
    pub separable: bool,
    /// Whether `L_qz`, `L_vz` and `L_zz` vanish, and the force does not depend on z.
    pub affine: bool,
    /// `W^-1`, if it is constant.
    pub inverse_mass: Option<Box<SMatrix<f64, N, N>>>,
}

/// The applied force at each stage, with its derivatives.
pub(crate) struct StageForces<const N: usize> {
    pub value: StageVector<N>,
    pub q: StageMatrix<N>,
    pub v: StageMatrix<N>,
    pub z: StageVector<N>,
}

impl<const N: usize> StageDerivatives<N> {
    /// The workspace.
    pub fn new<L: Lagrangian<N>>(problem: &Problem<'_, L, N>) -> Self {
        let (vector, matrix) = ([Stages::ZERO; N], [[Stages::ZERO; N]; N]);
        let structure = &problem.structure;
        let constant_mass = structure.constant_mass || structure.separable;
        let w = || problem.lagrangian.hessian(problem.t0, &problem.start).vv;
        let force = StageForces { value: vector, q: matrix, v: matrix, z: vector };
        StageDerivatives {
            s: 0,
            times: Stages::ZERO,
            q: vector,
            v: vector,
            z: Stages::ZERO,
            rho: Stages::ZERO,
            end_rho: 1.0,
            end_p: SVector::zeros(),
            inverse_mass: matrix,
            l: Stages::ZERO,
            l_q: vector,
            l_v: vector,
            l_z: Stages::ZERO,
            qq: matrix,
            qv: matrix,
            qz: vector,
            vz: vector,
            zz: Stages::ZERO,
            force: const { L::HINTS.forced }.then(|| Box::new(force)),
            form: Form {
                separable: structure.separable,
                affine: !depends_on_action(&OfTyped::<N>(problem.lagrangian), structure),
                inverse_mass: if constant_mass { w().try_inverse().map(Box::new) } else { None },
            },
        }
    }

    /// Evaluates the derivatives at the stages of a step; `forward` are its maps. Where the step does not have its
    /// values of L, L is `L_0 + gamma z` with constant gamma, and `actions` maps `z0 + A L_0` to z.
    ///
    /// # Errors
    /// [`StepError::Singular`] where W is singular at a stage, [`StepError::NonFinite`] where a derivative is not finite.
    #[inline(always)]
    pub fn evaluate<S: Simd, L: Lagrangian<N>>(
        &mut self,
        lagrangian: &L,
        forward: &StepMaps,
        step: &FixedStages<'_, N>,
        actions: Option<&StageMap>,
    ) -> Result<(), StepError> {
        let s = step.s;
        self.s = s;
        self.times = forward.times.map(|time| step.t + time);
        self.v = *step.v;
        for d in 0..N {
            let last = self.v[d].0[s - 1];
            self.v[d].0[s..].fill(last);
            self.q[d] = stage_values::<S>(forward, &step.v[d], step.start.q[d]);
        }
        self.z = if step.knows_l { stage_values::<S>(forward, step.l, step.start.z) } else { Stages::ZERO };
        let fallen = stage_values::<S>(forward, step.rate, 0.0);
        self.rho = fallen.map(|fallen| 1.0 - fallen);
        self.end_rho = 1.0 - end_value::<S>(forward, step.rate);
        for d in 0..N {
            self.end_p[d] = (step.start.p[d] + end_value::<S>(forward, &step.force[d])) / self.end_rho;
        }
        forget_branches();
        if !self.evaluate_in_lanes::<S, L>(lagrangian) || branched() {
            for i in 0..s {
                self.evaluate_stage(lagrangian, i)?;
            }
        }
        if let (false, Some(actions)) = (step.knows_l, actions) {
            let without = stage_values::<S>(forward, &self.l, step.start.z);
            actions.apply::<S>(&without, s, &mut self.z, Lanes::<S>::splat(0.0));
            for i in 0..MAX_STAGES {
                self.l.0[i] += self.l_z.0[i] * self.z.0[i];
            }
        }
        if const { L::HINTS.forced } {
            for i in 0..s {
                self.evaluate_force(lagrangian, i);
            }
        }
        Ok(())
    }

    /// Evaluates all stages in SIMD lanes, if L has closed derivatives or few coordinates; `false` if it has not, or if
    /// W is singular.
    #[inline(always)]
    fn evaluate_in_lanes<S: Simd, L: Lagrangian<N>>(&mut self, lagrangian: &L) -> bool {
        if const { N > MAX_DIMENSION_IN_LANES } {
            return false;
        }
        for r in 0..blocks::<S>(self.s) {
            let t = self.times.block::<S>(r);
            let x = VelocityPoint { q: block(&self.q, r), v: block(&self.v, r), z: self.z.block(r) };
            let (l, gradient) = lagrangian.with_gradient(t, &x);
            self.l.set(r, l);
            self.l_z.set(r, gradient.z);
            for d in 0..N {
                self.l_q[d].set(r, gradient.x[d]);
                self.l_v[d].set(r, gradient.y[d]);
            }
            let rho = self.rho.block::<S>(r);
            let known = match &self.form.inverse_mass {
                Some(_) if self.form.separable && self.form.affine => self.positions_in_lanes(lagrangian, t, &x, r),
                _ => self.hessian_in_lanes(lagrangian, t, &x, r),
            };
            if !known {
                return false;
            }
            if let Some(inverse) = &self.form.inverse_mass {
                let scale = Lanes::<S>::splat(1.0) / rho;
                for i in 0..N {
                    for j in 0..N {
                        self.inverse_mass[i][j].set(r, scale * inverse[(i, j)]);
                    }
                }
            }
        }
        true
    }

    /// `L_qq` at a block of stages.
    #[inline(always)]
    fn positions_in_lanes<S: Simd, L: Lagrangian<N>>(
        &mut self,
        lagrangian: &L,
        t: Lanes<S>,
        x: &VelocityPoint<N, Lanes<S>>,
        r: usize,
    ) -> bool {
        type Along<S, const N: usize> = KernelDual<Lanes<S>, SVector<Lanes<S>, N>>;
        let mut y = VelocityPoint::<N, Along<S, N>> { q: still(&x.q), v: still(&x.v), z: KernelDual::constant(x.z) };
        for d in 0..N {
            y.q[d].d[d] = Lanes::one();
        }
        let time = KernelDual::constant(t);
        if let Some(force) = lagrangian.closed_force(time, &y) {
            for i in 0..N {
                for j in 0..N {
                    self.qq[i][j].set(r, force[i].d[j]);
                }
            }
            return true;
        }
        if const { L::HINTS.proved || N > MAX_DIMENSION_OF_NESTED_LANES } {
            return false;
        }
        type Nested<S, const N: usize> = KernelDual<Along<S, N>, SVector<Along<S, N>, N>>;
        let mut q: SVector<Nested<S, N>, N> = still(&y.q);
        for d in 0..N {
            q[d].d[d] = KernelDual::one();
        }
        let l = lagrangian.value(KernelDual::constant(time), &q, &still(&y.v), KernelDual::constant(y.z));
        for i in 0..N {
            for j in 0..N {
                self.qq[i][j].set(r, l.d[i].d[j]);
            }
        }
        true
    }

    /// All second derivatives at a block of stages, with `(rho W)^-1`, unless W is constant.
    #[inline(always)]
    fn hessian_in_lanes<S: Simd, L: Lagrangian<N>>(
        &mut self,
        lagrangian: &L,
        t: Lanes<S>,
        x: &VelocityPoint<N, Lanes<S>>,
        r: usize,
    ) -> bool {
        type Along<S, const N: usize> = KernelDual<Lanes<S>, ChartVector<N, Lanes<S>>>;
        let mut y = VelocityPoint::<N, Along<S, N>> { q: still(&x.q), v: still(&x.v), z: KernelDual::constant(x.z) };
        for d in 0..N {
            y.q[d].d.x[d] = Lanes::one();
            y.v[d].d.y[d] = Lanes::one();
        }
        y.z.d.z = Lanes::one();
        let time = KernelDual::constant(t);
        let gradient = if let Some(gradient) = lagrangian.closed_gradient(time, &y) {
            gradient
        } else if const { L::HINTS.proved || N > MAX_DIMENSION_OF_NESTED_LANES } {
            return false;
        } else {
            lagrangian.with_gradient(time, &y).1
        };
        let mut w = SMatrix::<Lanes<S>, N, N>::from_element(Lanes::zero());
        for i in 0..N {
            self.qz[i].set(r, gradient.x[i].d.z);
            self.vz[i].set(r, gradient.y[i].d.z);
            for j in 0..N {
                self.qq[i][j].set(r, gradient.x[i].d.x[j]);
                self.qv[i][j].set(r, gradient.x[i].d.y[j]);
                w[(i, j)] = gradient.y[i].d.y[j] * self.rho.block::<S>(r);
            }
        }
        self.zz.set(r, gradient.z.d.z);
        if self.form.inverse_mass.is_some() {
            return true;
        }
        for j in 0..N {
            let mut column: SVector<Lanes<S>, N> = vector!(|i| Lanes::splat(if i == j { 1.0 } else { 0.0 }));
            if linear::solve_in_kernel(&mut w.clone(), &mut column).is_err() {
                return false;
            }
            for i in 0..N {
                self.inverse_mass[i][j].set(r, column[i]);
            }
        }
        true
    }

    #[inline(never)]
    fn evaluate_stage<L: Lagrangian<N>>(&mut self, lagrangian: &L, i: usize) -> Result<(), StepError> {
        let (t, x) = self.point(i);
        let (l, gradient) = lagrangian.with_gradient(t, &x);
        let Hessian { qq, qv, vv, qz, vz, zz } = lagrangian.hessian(t, &x);
        let inverse = match &self.form.inverse_mass {
            Some(inverse) => **inverse / self.rho.0[i],
            None => (vv * self.rho.0[i]).try_inverse().ok_or(StepError::Singular { pivot: 0.0 })?,
        };
        let finite = inverse.iter().chain(&qq).chain(&qv).chain(&qz).chain(&vz).chain([&zz, &l]).all(|e| e.is_finite());
        if !(finite && gradient.is_finite()) {
            return Err(StepError::NonFinite);
        }
        self.l.0[i] = l;
        self.l_z.0[i] = gradient.z;
        self.zz.0[i] = zz;
        for d in 0..N {
            self.l_q[d].0[i] = gradient.x[d];
            self.l_v[d].0[i] = gradient.y[d];
            self.qz[d].0[i] = qz[d];
            self.vz[d].0[i] = vz[d];
            for e in 0..N {
                self.inverse_mass[d][e].0[i] = inverse[(d, e)];
                self.qq[d][e].0[i] = qq[(d, e)];
                self.qv[d][e].0[i] = qv[(d, e)];
            }
        }
        Ok(())
    }

    #[inline(never)]
    fn evaluate_force<L: Lagrangian<N>>(&mut self, lagrangian: &L, i: usize) {
        let (t, x) = self.point(i);
        if let (Some(forces), Some(applied)) = (&mut self.force, AppliedForce::of(lagrangian, t, &x)) {
            for d in 0..N {
                forces.value[d].0[i] = applied.value[d];
                forces.z[d].0[i] = applied.z[d];
                for e in 0..N {
                    forces.q[d][e].0[i] = applied.q[(d, e)];
                    forces.v[d][e].0[i] = applied.v[(d, e)];
                }
            }
        }
    }

    /// The point of a stage.
    #[inline(always)]
    pub fn point(&self, i: usize) -> (f64, VelocityPoint<N>) {
        let at = |x: &StageVector<N>| SVector::<f64, N>::from_fn(|d, _| x[d].0[i]);
        (self.times.0[i], VelocityPoint { q: at(&self.q), v: at(&self.v), z: self.z.0[i] })
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

/// A block of the stages of a vector.
#[inline(always)]
fn block<S: Simd, const N: usize>(x: &StageVector<N>, r: usize) -> SVector<Lanes<S>, N> {
    vector!(|d| x[d].block(r))
}

/// The coordinates as constants, whose differentials vanish.
#[inline(always)]
fn still<T: Scalar, D: TangentVector<T>, const N: usize>(x: &SVector<T, N>) -> SVector<KernelDual<T, D>, N> {
    vector!(|d| KernelDual::constant(x[d]))
}
