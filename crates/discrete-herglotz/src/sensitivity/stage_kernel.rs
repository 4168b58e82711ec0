//! The evaluation of L and of the force at the solved stages of a step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::StepError;
use crate::gauss::limits::MAX_DIMENSION_IN_LANES;
use crate::integration::SolvedStages;
use crate::numbers::lanes::{Lanes, branched, forget_branches};
use crate::numbers::registers::{StageMap, Stages, blocks};
use crate::sensitivity::stage_derivatives::StageDerivatives;
use crate::sensitivity::step_maps::StepMaps;
use crate::system::applied_force::AppliedForce;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::support::{KernelDual, linear};
use contact_geom::{
    ChartVector, Derivatives, Hessian, Lagrangian, Scalar, VelocityPoint, numbers::TangentVector, vector,
};
use num_traits::{One, Zero};
use pulp::{Simd, WithSimd};

/// The largest dimension for which second derivatives without closed ones are computed in SIMD lanes: the nested dual
/// numbers do not fit in registers.
const MAX_DIMENSION_OF_NESTED_LANES: usize = 3;

/// The kernel that evaluates the derivatives at the stages of a step; `forward` are its maps. Where the step does not have
/// its values of L, L is `L_0 + gamma z` with constant gamma, and `actions` maps `z0 + A L_0` to z. It fails with
/// [`StepError::Singular`] where W is singular at a stage, and with [`StepError::NonFinite`] where a derivative is not
/// finite.
pub(crate) struct StageKernel<'e, L, const N: usize> {
    pub lagrangian: &'e L,
    pub at: &'e mut StageDerivatives,
    pub forward: &'e StepMaps,
    pub step: &'e SolvedStages,
    pub actions: Option<&'e StageMap>,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for StageKernel<'_, L, N> {
    type Output = Result<(), StepError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let StageKernel { lagrangian, at, forward, step, actions } = self;
        at.set_points::<S>(forward, step);
        forget_branches();
        if !at.evaluate_in_lanes::<S, L, N>(lagrangian) || branched() {
            for i in 0..step.s {
                at.evaluate_stage(lagrangian, i)?;
            }
        }
        if let (false, Some(actions)) = (step.knows_l, actions) {
            at.set_actions::<S>(forward, step, actions);
        }
        if const { L::HINTS.forced } {
            for i in 0..step.s {
                at.evaluate_force(lagrangian, i);
            }
        }
        Ok(())
    }
}

impl StageDerivatives {
    /// Evaluates all stages in SIMD lanes, if L has closed derivatives or few coordinates; `false` if it has not, or if
    /// W is singular.
    #[inline(always)]
    fn evaluate_in_lanes<S: Simd, L: Lagrangian<N>, const N: usize>(&mut self, lagrangian: &L) -> bool {
        if const { N > MAX_DIMENSION_IN_LANES } {
            return false;
        }
        for r in 0..blocks::<S>(self.s) {
            let t = self.times.block::<S>(r);
            let x = VelocityPoint::<N, _> { q: block(&self.q, r), v: block(&self.v, r), z: self.z.block(r) };
            let (l, gradient) = lagrangian.with_gradient(t, &x);
            self.l.set(r, l);
            self.l_z.set(r, gradient.z);
            let (l_q, l_v) = (&mut self.l_q[..N], &mut self.l_v[..N]);
            for d in 0..N {
                l_q[d].set(r, gradient.x[d]);
                l_v[d].set(r, gradient.y[d]);
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
                        self.inverse_mass[(i, j)].set(r, scale * inverse[(i, j)]);
                    }
                }
            }
        }
        true
    }

    /// `L_qq` at a block of stages.
    #[inline(always)]
    fn positions_in_lanes<S: Simd, L: Lagrangian<N>, const N: usize>(
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
                    self.qq[(i, j)].set(r, force[i].d[j]);
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
                self.qq[(i, j)].set(r, l.d[i].d[j]);
            }
        }
        true
    }

    /// All second derivatives at a block of stages, with `(rho W)^-1`, unless W is constant.
    #[inline(always)]
    fn hessian_in_lanes<S: Simd, L: Lagrangian<N>, const N: usize>(
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
        let (qz, vz) = (&mut self.qz[..N], &mut self.vz[..N]);
        let mut w = SMatrix::<Lanes<S>, N, N>::from_element(Lanes::zero());
        for i in 0..N {
            qz[i].set(r, gradient.x[i].d.z);
            vz[i].set(r, gradient.y[i].d.z);
            for j in 0..N {
                self.qq[(i, j)].set(r, gradient.x[i].d.x[j]);
                self.qv[(i, j)].set(r, gradient.x[i].d.y[j]);
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
                self.inverse_mass[(i, j)].set(r, column[i]);
            }
        }
        true
    }

    #[inline(never)]
    fn evaluate_stage<L: Lagrangian<N>, const N: usize>(&mut self, lagrangian: &L, i: usize) -> Result<(), StepError> {
        let (t, x) = self.fixed_point(i);
        let (l, gradient) = lagrangian.with_gradient(t, &x);
        let Hessian { qq, qv, vv, qz, vz, zz } = lagrangian.hessian(t, &x);
        let rho = self.rho.0[i];
        let inverse = match &self.form.inverse_mass {
            Some(inverse) => SMatrix::<f64, N, N>::from_fn(|d, e| inverse[(d, e)] / rho),
            None => (vv * rho).try_inverse().ok_or(StepError::Singular { pivot: 0.0 })?,
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
                self.inverse_mass[(d, e)].0[i] = inverse[(d, e)];
                self.qq[(d, e)].0[i] = qq[(d, e)];
                self.qv[(d, e)].0[i] = qv[(d, e)];
            }
        }
        Ok(())
    }

    #[inline(never)]
    fn evaluate_force<L: Lagrangian<N>, const N: usize>(&mut self, lagrangian: &L, i: usize) {
        let (t, x) = self.fixed_point(i);
        if let (Some(forces), Some(applied)) = (&mut self.force, AppliedForce::of(lagrangian, t, &x)) {
            for d in 0..N {
                forces.value[d].0[i] = applied.value[d];
                forces.z[d].0[i] = applied.z[d];
                for e in 0..N {
                    forces.q[(d, e)].0[i] = applied.q[(d, e)];
                    forces.v[(d, e)].0[i] = applied.v[(d, e)];
                }
            }
        }
    }

    /// The point of a stage, for a number of coordinates that is known at compile time.
    #[inline(always)]
    fn fixed_point<const N: usize>(&self, i: usize) -> (f64, VelocityPoint<N>) {
        let at = |x: &[Stages]| SVector::<f64, N>::from_fn(|d, _| x[d].0[i]);
        (self.times.0[i], VelocityPoint { q: at(&self.q), v: at(&self.v), z: self.z.0[i] })
    }
}

/// A block of the stages of a vector.
#[inline(always)]
fn block<S: Simd, const N: usize>(x: &[Stages], r: usize) -> SVector<Lanes<S>, N> {
    let x = &x[..N];
    vector!(|d| x[d].block(r))
}

/// The coordinates as constants, whose differentials vanish.
#[inline(always)]
fn still<T: Scalar, D: TangentVector<T>, const N: usize>(x: &SVector<T, N>) -> SVector<KernelDual<T, D>, N> {
    vector!(|d| KernelDual::constant(x[d]))
}
