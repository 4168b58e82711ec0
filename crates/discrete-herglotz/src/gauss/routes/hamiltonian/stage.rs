//! The right-hand side of the stage equations at one stage, and its derivatives.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::stages::product::dot;
use crate::gauss::system::{PointDerivatives, PointGradient, PointRef, SystemAtPoints};
use contact_geom::nalgebra::DMatrix;

/// A stage: time, position, momentum `P = rho p`, action and `1 - rho`.
#[derive(Clone)]
pub(super) struct Stage {
    pub t: f64,
    pub q: Vec<f64>,
    pub scaled_p: Vec<f64>,
    pub z: f64,
    pub one_minus_rho: f64,
    /// The momentum `P / rho`.
    p: Vec<f64>,
}

impl Stage {
    pub fn zeros(n: usize) -> Self {
        let line = || vec![0.0; n];
        Stage { t: 0.0, q: line(), scaled_p: line(), z: 0.0, one_minus_rho: 0.0, p: line() }
    }

    pub fn rho(&self) -> f64 {
        1.0 - self.one_minus_rho
    }

    /// Sets the momentum from `P` and `1 - rho`.
    pub fn set_momentum(&mut self) {
        let rho = self.rho();
        for (p, scaled) in self.p.iter_mut().zip(&self.scaled_p) {
            *p = scaled / rho;
        }
    }

    pub fn phase_point(&self) -> PointRef<'_> {
        PointRef { q: &self.q, v: &self.p, z: self.z }
    }
}

/// The workspace of evaluations at one stage.
pub(super) struct Evaluation {
    pub derivatives: PointDerivatives,
    /// `f - H_q`.
    force: Vec<f64>,
    /// The derivatives of one column: the changes of q and p, and those of `H_p` and of `f - H_q`.
    dq: Vec<f64>,
    dp: Vec<f64>,
    of_v: Vec<f64>,
    of_force: Vec<f64>,
}

impl Evaluation {
    /// The workspace for a system.
    pub fn of(system: &dyn SystemAtPoints) -> Self {
        let line = || vec![0.0; system.dimension()];
        Evaluation {
            derivatives: PointDerivatives::of(system),
            force: line(),
            dq: line(),
            dp: line(),
            of_v: line(),
            of_force: line(),
        }
    }

    /// The right-hand side at a stage, in the order of y.
    pub fn right_hand_side(&mut self, system: &dyn SystemAtPoints, stage: &Stage, weight: f64, out: &mut [f64]) {
        let (n, x) = (stage.q.len(), stage.phase_point());
        let Evaluation { derivatives: PointDerivatives { gradient, .. }, force, .. } = self;
        let Some(h) = system.hamiltonian(stage.t, x, gradient) else { return out.fill(f64::NAN) };
        let PointGradient { q: slope, v, z } = gradient;
        if system.is_forced() {
            system.applied_force(stage.t, PointRef { v, ..x }, force);
            for d in 0..n {
                force[d] += -slope[d];
            }
        } else {
            for d in 0..n {
                force[d] = -slope[d];
            }
        }
        let rho = stage.rho();
        for d in 0..n {
            out[d] = weight * v[d];
            out[n + d] = weight * rho * force[d];
        }
        out[2 * n] = weight * (dot(x.v, v) - h);
        out[2 * n + 1] = -weight * rho * *z;
    }

    /// The derivatives of the right-hand side at a stage in y, by columns. With `p = P / rho`,
    /// `dp = dP / rho + p d(1 - rho) / rho`.
    pub fn jacobian(&mut self, system: &dyn SystemAtPoints, stage: &Stage, out: &mut [f64]) {
        let (n, x, rho) = (stage.q.len(), stage.phase_point(), stage.rho());
        let Evaluation { derivatives, force, dq, dp, of_v, of_force } = self;
        if !system.hamiltonian_derivatives(stage.t, x, derivatives) {
            return out.fill(f64::NAN);
        }
        let PointDerivatives { gradient: d, qq, qv: qp, vv: pp, qz, vz: pz, zz, force: applied, .. } = derivatives;
        for i in 0..n {
            force[i] = -d.q[i];
            if let Some(applied) = applied {
                force[i] += applied.value[i];
            }
        }
        for (index, out) in out.chunks_exact_mut(2 * n + 2).enumerate() {
            // The derivatives along (dq, dp, dz, d(1 - rho)) of one column.
            dq.fill(0.0);
            dp.fill(0.0);
            let (mut dz, mut fallen) = (0.0, 0.0);
            match index {
                j if j < n => dq[j] = 1.0,
                j if j < 2 * n => {
                    for i in 0..n {
                        dp[i] = f64::from(u8::from(n + i == j)) / rho;
                    }
                }
                j if j == 2 * n => dz = 1.0,
                _ => {
                    for i in 0..n {
                        dp[i] = x.v[i] / rho;
                    }
                    fallen = 1.0;
                }
            }
            for i in 0..n {
                of_v[i] = column_times(qp, i, dq) + row_times(pp, i, dp) + pz[i] * dz;
                of_force[i] = -(row_times(qq, i, dq) + row_times(qp, i, dp) + qz[i] * dz);
            }
            if let Some(applied) = applied {
                for i in 0..n {
                    of_force[i] += row_times(&applied.q, i, dq) + row_times(&applied.v, i, of_v) + applied.z[i] * dz;
                }
            }
            let of_rate = dot(qz, dq) + dot(pz, dp) + *zz * dz;
            for i in 0..n {
                out[i] = of_v[i];
                out[n + i] = rho * of_force[i] - fallen * force[i];
            }
            out[2 * n] = dot(x.v, of_v) - dot(&d.q, dq) - d.z * dz;
            out[2 * n + 1] = fallen * d.z - rho * of_rate;
        }
    }
}

/// A row of a matrix times a vector.
fn row_times(m: &DMatrix<f64>, i: usize, x: &[f64]) -> f64 {
    let mut sum = m[(i, 0)] * x[0];
    for j in 1..x.len() {
        sum += m[(i, j)] * x[j];
    }
    sum
}

/// A column of a matrix times a vector.
fn column_times(m: &DMatrix<f64>, i: usize, x: &[f64]) -> f64 {
    let mut sum = m[(0, i)] * x[0];
    for j in 1..x.len() {
        sum += m[(j, i)] * x[j];
    }
    sum
}
