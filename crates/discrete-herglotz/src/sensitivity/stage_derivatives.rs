//! The derivatives of L and of the force at the solved stages of a step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::StepError;
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::registers::Stages;
use crate::sensitivity::SolvedStages;
use crate::sensitivity::step_maps::StepMaps;
use crate::gauss::stages::applied_force::AppliedForce;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Derivatives, Hessian, Lagrangian, VelocityPoint};

/// A matrix, or a vector, at each stage.
pub(crate) type StageMatrix<const N: usize> = [[Stages; N]; N];
pub(crate) type StageVector<const N: usize> = [Stages; N];

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
}

/// The applied force at each stage, with its derivatives.
pub(crate) struct StageForces<const N: usize> {
    pub value: StageVector<N>,
    pub q: StageMatrix<N>,
    pub v: StageMatrix<N>,
    pub z: StageVector<N>,
}

impl<const N: usize> StageDerivatives<N> {
    /// The workspace, for Lagrangians with or without an applied force.
    pub fn new(forced: bool) -> Self {
        let (vector, matrix) = ([Stages::ZERO; N], [[Stages::ZERO; N]; N]);
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
            force: forced.then(|| Box::new(StageForces { value: vector, q: matrix, v: matrix, z: vector })),
        }
    }

    /// Evaluates the derivatives at the stages of a step; `forward` are its maps.
    ///
    /// # Errors
    /// [`StepError::Singular`] where W is singular at a stage, [`StepError::NonFinite`] where a derivative is not finite.
    pub fn evaluate<L: Lagrangian<N>>(
        &mut self,
        lagrangian: &L,
        forward: &StepMaps,
        step: &SolvedStages<N>,
    ) -> Result<(), StepError> {
        let s = step.s;
        self.s = s;
        let g = crate::gauss::tables::coefficients::Coefficients::of(s);
        for i in 0..s {
            self.times.0[i] = step.t + step.h * g.c[i].0;
        }
        self.v = step.v;
        for d in 0..N {
            self.q[d] = stage_values(forward, &step.v[d], step.start.q[d]);
        }
        self.z = stage_values(forward, &step.l, step.start.z);
        let fallen = stage_values(forward, &step.rate, 0.0);
        self.rho = fallen.map(|fallen| 1.0 - fallen);
        self.end_rho = 1.0 - end_value(forward, &step.rate);
        self.end_p = SVector::from_fn(|d, _| (step.start.p[d] + end_value(forward, &step.force[d])) / self.end_rho);
        for i in 0..s {
            self.evaluate_stage(lagrangian, i)?;
        }
        Ok(())
    }

    #[inline(never)]
    fn evaluate_stage<L: Lagrangian<N>>(&mut self, lagrangian: &L, i: usize) -> Result<(), StepError> {
        let at = |x: &StageVector<N>| SVector::<f64, N>::from_fn(|d, _| x[d].0[i]);
        let (t, x) = (self.times.0[i], VelocityPoint { q: at(&self.q), v: at(&self.v), z: self.z.0[i] });
        let (l, gradient) = lagrangian.with_gradient(t, &x);
        let Hessian { qq, qv, vv, qz, vz, zz } = lagrangian.hessian(t, &x);
        let inverse: SMatrix<f64, N, N> =
            (vv * self.rho.0[i]).try_inverse().ok_or(StepError::Singular { pivot: 0.0 })?;
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
        Ok(())
    }

    /// The point of a stage.
    pub fn point(&self, i: usize) -> (f64, VelocityPoint<N>) {
        let at = |x: &StageVector<N>| SVector::<f64, N>::from_fn(|d, _| x[d].0[i]);
        (self.times.0[i], VelocityPoint { q: at(&self.q), v: at(&self.v), z: self.z.0[i] })
    }
}

/// `start + A rates` at the stages.
#[inline(always)]
pub(crate) fn stage_values(maps: &StepMaps, rates: &Stages, start: f64) -> Stages {
    let mut values = Stages([start; MAX_STAGES]);
    for (column, rate) in maps.to_stages.0.iter().zip(&rates.0).take(maps.s) {
        for (value, entry) in values.0.iter_mut().zip(&column.0) {
            *value += entry * rate;
        }
    }
    values
}

/// `weights . rates`.
#[inline(always)]
pub(crate) fn end_value(maps: &StepMaps, rates: &Stages) -> f64 {
    maps.weights.0.iter().zip(&rates.0).take(maps.s).map(|(weight, rate)| weight * rate).sum()
}
