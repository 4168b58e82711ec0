//! Simplified Newton iteration for the stage equations of the general step: the derivatives of L are taken at one point
//! for all stages, so that the Jacobian decouples into one small complex matrix for each eigenvalue of the Butcher
//! matrix.
//!
//! It converges for stiff forces, where fixed-point iteration does not, at about twice the cost of an iteration.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::stages::slope_newton::invert;
use crate::gauss::system::PointDerivatives;
use crate::gauss::tables::modes::Modes;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use crate::numbers::state_words::saved;
use contact_geom::nalgebra::Complex;
use contact_geom::{Scalar, numbers::max_or_nan};
use pulp::{Simd, WithSimd};

const ZERO: Complex<f64> = Complex::new(0.0, 0.0);

/// Simplified Newton iteration for the velocities V, actions Z and integrating factors rho of the stages of the general
/// step. With an eigenvalue `mu` of hA, and the derivatives of L at one point, where rho = 1, the equations of a mode
/// are
///
/// `(W + mu (L_vq - L_qv) - mu^2 L_qq) dV + (L_vz - mu L_qz) dZ + (L_v - mu L_q) drho = r_V`,
/// `dZ - mu ((L_v + mu L_q) dV + L_z dZ) = r_Z`, `drho + mu ((L_vz + mu L_qz) dV + L_zz dZ + L_z drho) = r_rho`.
///
/// With an applied force f, `L_q + f` and its derivatives are in the place of `L_q` and its derivatives in the first
/// equation.
pub(crate) struct StageNewton {
    modes: &'static Modes,
    h: f64,
    blocks: Vec<Block>,
    /// The number of blocks that are factorised: all of them, unless a matrix was singular.
    factorised: usize,
    /// The corrections of the velocities.
    dv: Vec<Stages>,
    /// The residual and the correction of the velocities in one mode.
    of_mode: [Vec<Complex<f64>>; 2],
}

/// The linear equations of one mode, with dZ and drho eliminated.
struct Block {
    /// By columns.
    inverse: Vec<Complex<f64>>,
    /// `dZ = z (r_Z + z_v dV)`, `drho = rho (r_rho - rho_v dV - rho_z dZ)`.
    z: Complex<f64>,
    z_v: Vec<Complex<f64>>,
    rho: Complex<f64>,
    rho_v: Vec<Complex<f64>>,
    rho_z: Complex<f64>,
    /// The coefficients of dZ and drho in the first equation.
    of_z: Vec<Complex<f64>>,
    of_rho: Vec<Complex<f64>>,
}

impl Block {
    fn zeros(n: usize) -> Self {
        let line = || vec![ZERO; n];
        Block {
            inverse: vec![ZERO; n * n],
            z: ZERO,
            z_v: line(),
            rho: ZERO,
            rho_v: line(),
            rho_z: ZERO,
            of_z: line(),
            of_rho: line(),
        }
    }

    /// Sets the equations of the mode with the eigenvalue `mu`; `false` if the matrix is singular.
    fn factorise(&mut self, mu: Complex<f64>, at: &PointDerivatives) -> bool {
        let PointDerivatives { gradient: g, qq, qv, vv, qz, vz, zz, force, .. } = at;
        let n = self.z_v.len();
        (self.z, self.rho) = ((-mu * g.z + 1.0).inv(), (mu * g.z + 1.0).inv());
        self.rho_z = mu * *zz;
        for d in 0..n {
            self.z_v[d] = (mu * g.q[d] + g.v[d]) * mu;
            self.rho_v[d] = (mu * qz[d] + vz[d]) * mu;
            self.of_z[d] = -mu * qz[d] + vz[d];
            self.of_rho[d] = -mu * g.q[d] + g.v[d];
            if let Some(applied) = force {
                self.of_z[d] -= mu * applied.z[d];
                self.of_rho[d] -= mu * applied.value[d];
            }
        }
        for e in 0..n {
            let z_of_v = self.z_v[e] * self.z;
            let rho_of_v = (self.rho_v[e] + self.z_v[e] * (self.rho_z * self.z)) * self.rho;
            for d in 0..n {
                let mut own = mu * (qv[(e, d)] - qv[(d, e)]) - mu * mu * qq[(d, e)] + vv[(d, e)];
                if let Some(applied) = force {
                    own -= mu * applied.v[(d, e)] + mu * mu * applied.q[(d, e)];
                }
                self.inverse[e * n + d] = own + self.of_z[d] * z_of_v - self.of_rho[d] * rho_of_v;
            }
        }
        invert(&mut self.inverse, n)
    }

    /// The corrections of a mode from its residuals: that of the velocities is written, those of the action and of the
    /// integrating factor are returned. `r_v` is overwritten.
    fn solve(
        &self,
        r_v: &mut [Complex<f64>],
        r_z: Complex<f64>,
        r_rho: Complex<f64>,
        dv: &mut [Complex<f64>],
    ) -> [Complex<f64>; 2] {
        let n = dv.len();
        let z = self.z * r_z;
        let rho = self.rho * (r_rho - self.rho_z * z);
        for d in 0..n {
            r_v[d] = r_v[d] - self.of_z[d] * z - self.of_rho[d] * rho;
        }
        for d in 0..n {
            dv[d] = self.inverse[d] * r_v[0];
        }
        for e in 1..n {
            for d in 0..n {
                dv[d] = self.inverse[e * n + d] * r_v[e] + dv[d];
            }
        }
        let dot = |a: &[Complex<f64>]| a.iter().zip(&*dv).fold(ZERO, |sum, (a, dv)| sum + a * dv);
        let dz = self.z * (r_z + dot(&self.z_v));
        [dz, self.rho * (r_rho - dot(&self.rho_v) - self.rho_z * dz)]
    }
}

impl StageNewton {
    /// The iteration for `n` coordinates.
    pub fn new(n: usize, table: &StageTable) -> Self {
        let modes = Modes::of(table.s);
        StageNewton {
            modes,
            h: table.h,
            blocks: modes.iter().map(|_| Block::zeros(n)).collect(),
            factorised: modes.iter().count(),
            dv: vec![Stages::ZERO; n],
            of_mode: [vec![ZERO; n], vec![ZERO; n]],
        }
    }

    /// Factorises the equations of the modes with new derivatives of L and of the applied force; `false` if one of the
    /// matrices is singular.
    pub fn factorise(&mut self, at: &PointDerivatives) -> bool {
        self.factorised = 0;
        for (mode, block) in self.modes.iter().zip(&mut self.blocks) {
            if !block.factorise(mode.value * self.h, at) {
                return false;
            }
            self.factorised += 1;
        }
        true
    }

    /// One iteration. Returns the largest relative change of velocities, actions and factors, each kind relative to its
    /// largest value; and the largest relative change of the positions.
    #[cold]
    #[inline(never)]
    pub fn correct(&mut self, arch: Instructions, stages: StagesInIteration<'_>) -> (f64, f64) {
        arch.dispatch(CorrectStages { newton: self, stages })
    }

    /// Replaces the residuals of the stages by their corrections; those of the velocities are in `dv`.
    #[inline(always)]
    fn solve<S: Simd>(&mut self, z: &mut Stages, rho: &mut Stages) {
        for x in self.dv.iter_mut().chain([&mut *z, &mut *rho]) {
            self.modes.enter::<S>(x);
        }
        self.solve_modes(z, rho);
        for x in self.dv.iter_mut().chain([z, rho]) {
            self.modes.leave::<S>(x);
        }
    }

    /// The same in the coordinates of the modes. Not inlined, since complex numbers gain nothing from vector instructions.
    #[inline(never)]
    fn solve_modes(&mut self, z: &mut Stages, rho: &mut Stages) {
        let [r_v, dv] = &mut self.of_mode;
        for (mode, block) in self.modes.iter().zip(&self.blocks[..self.factorised]) {
            for (r, v) in r_v.iter_mut().zip(&self.dv) {
                *r = mode.of(v);
            }
            let [dz, drho] = block.solve(r_v, mode.of(z), mode.of(rho), dv);
            for (v, dv) in self.dv.iter_mut().zip(&*dv) {
                mode.set(v, *dv);
            }
            mode.set(z, dz);
            mode.set(rho, drho);
        }
    }
}

/// The start of the step, L and its gradient at the stages, and the stages, which an iteration changes.
pub(crate) struct StagesInIteration<'a> {
    pub table: &'a StageTable,
    /// The state `(q, p, z)` at the start.
    pub start: (&'a [CompensatedSum], &'a [CompensatedSum], f64),
    pub l_v: &'a [Stages],
    /// L, force and rate are multiplied by the weights `h b`.
    pub l: &'a Stages,
    pub force: &'a [Stages],
    pub rate: &'a Stages,
    pub v: &'a mut [Stages],
    pub z: &'a mut Stages,
    /// `1 - rho`.
    pub one_minus_rho_stages: &'a mut Stages,
    /// The velocities multiplied by the weights, and the positions.
    pub moved: &'a mut [Stages],
    pub x: &'a mut [Stages],
}

/// One simplified Newton iteration of the general step.
struct CorrectStages<'a> {
    newton: &'a mut StageNewton,
    stages: StagesInIteration<'a>,
}

impl WithSimd for CorrectStages<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> (f64, f64) {
        let CorrectStages { newton, stages } = self;
        let StagesInIteration { table, start: (q0, p0, z0), l_v, l, force, rate, v, z, one_minus_rho_stages, moved, x } =
            stages;
        let (n, s, m) = (v.len(), table.s, blocks::<S>(table.s));
        let (zero, one) = (Lanes::<S>::splat(0.0), Lanes::<S>::splat(1.0));
        let (mut dz, mut drho) = (Stages::ZERO, Stages::ZERO);
        newton.dv.fill(Stages::ZERO);
        table.m.apply(rate, s, &mut drho, zero);
        table.m.apply(l, s, &mut dz, Lanes::<S>::splat(z0));
        for d in 0..n {
            table.m.apply(&force[d], s, &mut newton.dv[d], Lanes::<S>::splat(p0[d].value));
        }
        for r in 0..m {
            let one_minus_rho_stages = one_minus_rho_stages.block::<S>(r);
            let inverse = (one - one_minus_rho_stages).recip();
            drho.set(r, one_minus_rho_stages - drho.block::<S>(r));
            dz.set(r, dz.block::<S>(r) - z.block(r));
            for (dv, l_v) in newton.dv.iter_mut().zip(l_v) {
                let l_v = l_v.block::<S>(r);
                dv.set(r, l_v.mul_add(one_minus_rho_stages, dv.block::<S>(r) - l_v) * inverse);
            }
        }
        newton.solve::<S>(&mut dz, &mut drho);
        for r in 0..m {
            drho.set(r, -drho.block::<S>(r));
        }
        // Changes of the factors are relative to 1.
        let mut largest = [[zero, zero], [zero, zero], [zero, one]];
        let velocities = v.iter_mut().zip(&newton.dv).map(|(v, dv)| (v, dv, 0));
        for (to, change, kind) in velocities.chain([(z, &dz, 1), (one_minus_rho_stages, &drho, 2)]) {
            let [of_change, size] = &mut largest[kind];
            for r in 0..m {
                let change = change.block::<S>(r);
                let sum = to.block::<S>(r) + change;
                *of_change = of_change.max(change.abs());
                *size = size.max(sum.abs());
                to.set(r, sum);
            }
        }
        let (mut far, mut position) = (zero, zero);
        for d in 0..n {
            let before = x[d];
            for r in 0..m {
                moved[d].set(r, table.weights.block::<S>(r) * v[d].block(r));
            }
            table.m.apply(&moved[d], s, &mut x[d], Lanes::<S>::splat(q0[d].value));
            for r in 0..m {
                let now = x[d].block::<S>(r);
                far = far.max((now - before.block(r)).abs());
                position = position.max(now.abs());
            }
        }
        let mut change = 0.0;
        for [of_change, size] in &largest {
            let (of_change, size) = (of_change.reduce_max(), size.reduce_max());
            change = max_or_nan(change, if of_change > 0.0 { of_change / size } else { of_change });
        }
        (change, far.reduce_max() / position.reduce_max())
    }
}

saved!([] StageNewton { blocks });
saved!([] Block { inverse, z, z_v, rho, rho_v, rho_z, of_z, of_rho });
