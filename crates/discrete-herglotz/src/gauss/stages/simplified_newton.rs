//! Simplified Newton iteration for the stage equations: the derivatives of L are taken at one point for all stages, so
//! that the Jacobian decouples into one small complex matrix for each eigenvalue of the Butcher matrix.
//!
//! It converges for stiff forces, where fixed-point iteration does not, at about twice the cost of an iteration.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::stages::applied_force::AppliedForce;
use crate::gauss::tables::condensed::Condensed;
use crate::gauss::tables::modes::Modes;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use crate::numbers::state_words::saved;
use crate::solve::inverse::invert_complex;
use contact_geom::nalgebra::linalg::try_invert_to;
use contact_geom::nalgebra::{Complex, SMatrix, SVector};
use contact_geom::{ChartVector, Hessian, Scalar, numbers::max_or_nan};
use pulp::{Simd, WithSimd};

type Matrix<const N: usize> = SMatrix<Complex<f64>, N, N>;
type Vector<const N: usize> = SVector<Complex<f64>, N>;

/// Simplified Newton iteration for the accelerations of [`Condensed`] stages, `a = f(q0 + u v0 + B a)`. With `J = f'`
/// at one point, the change `r` of the accelerations in a fixed-point iteration becomes `(1 - B (x) J)^-1 r`. Here B is
/// replaced by `(hA)^2 / (1 - gamma hA)`, which agrees with it up to the error of the collocation.
pub(crate) struct SlopeNewton<const N: usize> {
    modes: &'static Modes,
    s: usize,
    /// The step size h and the rate gamma.
    h: f64,
    gamma: f64,
    /// `(1 - b J)^-1` for each eigenvalue b of B, together with b.
    inverses: Vec<(Matrix<N>, Complex<f64>)>,
    /// The accelerations from which the next iteration starts.
    pub a: [Stages; N],
}

impl<const N: usize> SlopeNewton<N> {
    pub fn new(table: &Condensed) -> Self {
        let modes = Modes::of(table.s);
        let inverses = vec![(Matrix::zeros(), Complex::new(0.0, 0.0)); modes.iter().count()];
        SlopeNewton { modes, s: table.s, h: table.h, gamma: table.gamma, inverses, a: [Stages::ZERO; N] }
    }

    /// Inverts the matrices of the modes for a new J; `false` if one of them is singular.
    pub fn factorise(&mut self, slope: &SMatrix<f64, N, N>) -> bool {
        self.modes.iter().zip(&mut self.inverses).all(|(mode, (inverse, b))| {
            let mu = mode.value * self.h;
            *b = mu * mu / (-mu * self.gamma + 1.0);
            // In place, to save stack space.
            for j in 0..N {
                for i in 0..N {
                    inverse[(i, j)] = Complex::from(if i == j { 1.0 } else { 0.0 }) - *b * slope[(i, j)];
                }
            }
            invert(inverse)
        })
    }

    /// Corrects the accelerations `found` that a fixed-point iteration gives for `self.a`; returns the largest change
    /// of the accelerations, and that of the positions.
    pub fn correct(&mut self, arch: Instructions, found: &mut [Stages; N]) -> (f64, f64) {
        arch.dispatch(CorrectSlope { newton: self, found })
    }
}

/// The kernel of [`SlopeNewton::correct`]; it does not depend on the Lagrangian, so that it is compiled once.
struct CorrectSlope<'a, const N: usize> {
    newton: &'a mut SlopeNewton<N>,
    found: &'a mut [Stages; N],
}

/// The corrections of the accelerations and of the positions, in the coordinates of the modes. Not inlined, since complex
/// numbers gain nothing from vector instructions.
#[inline(never)]
fn solve_modes<const N: usize>(
    modes: &Modes,
    inverses: &[(Matrix<N>, Complex<f64>)],
    found: &mut [Stages; N],
    moved: &mut [Stages; N],
) {
    for (mode, (inverse, b)) in modes.iter().zip(inverses) {
        let change = *inverse * Vector::<N>::from_fn(|d, _| mode.of(&found[d]));
        for d in 0..N {
            mode.set(&mut found[d], change[d]);
            mode.set(&mut moved[d], change[d] * *b);
        }
    }
}

impl<const N: usize> WithSimd for CorrectSlope<'_, N> {
    type Output = (f64, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> (f64, f64) {
        let CorrectSlope { newton: SlopeNewton { modes, s, inverses, a, .. }, found } = self;
        for (found, a) in found.iter_mut().zip(a.iter()) {
            for r in 0..blocks::<S>(*s) {
                found.set(r, found.block::<S>(r) - a.block(r));
            }
            modes.enter::<S>(found);
        }
        let mut moved = [Stages::ZERO; N];
        solve_modes(modes, inverses, found, &mut moved);
        let mut far = Lanes::<S>::splat(0.0);
        for moved in &mut moved {
            modes.leave::<S>(moved);
            for r in 0..blocks::<S>(*s) {
                far = far.max(moved.block::<S>(r).abs());
            }
        }
        let mut largest = Lanes::<S>::splat(0.0);
        for (found, a) in found.iter_mut().zip(a) {
            modes.leave::<S>(found);
            for r in 0..blocks::<S>(*s) {
                let change = found.block::<S>(r);
                largest = largest.max(change.abs());
                found.set(r, a.block::<S>(r) + change);
            }
            *a = *found;
        }
        (largest.reduce_max(), far.reduce_max())
    }
}

/// Simplified Newton iteration for the velocities V, actions Z and integrating factors rho of the stages of the general
/// step. With an eigenvalue `mu` of hA, and the derivatives of L at one point, where rho = 1, the equations of a mode
/// are
///
/// `(W + mu (L_vq - L_qv) - mu^2 L_qq) dV + (L_vz - mu L_qz) dZ + (L_v - mu L_q) drho = r_V`,
/// `dZ - mu ((L_v + mu L_q) dV + L_z dZ) = r_Z`, `drho + mu ((L_vz + mu L_qz) dV + L_zz dZ + L_z drho) = r_rho`.
///
/// With an applied force f, `L_q + f` and its derivatives are in the place of `L_q` and its derivatives in the first
/// equation.
pub(crate) struct StageNewton<const N: usize> {
    modes: &'static Modes,
    h: f64,
    blocks: Vec<Block<N>>,
}

/// The linear equations of one mode, with dZ and drho eliminated.
struct Block<const N: usize> {
    inverse: Matrix<N>,
    /// `dZ = z (r_Z + z_v dV)`, `drho = rho (r_rho - rho_v dV - rho_z dZ)`.
    z: Complex<f64>,
    z_v: Vector<N>,
    rho: Complex<f64>,
    rho_v: Vector<N>,
    rho_z: Complex<f64>,
    /// The coefficients of dZ and drho in the first equation.
    of_z: Vector<N>,
    of_rho: Vector<N>,
}

impl<const N: usize> Block<N> {
    /// `None` if the matrix is singular.
    fn new(
        mu: Complex<f64>,
        g: &ChartVector<N>,
        hessian: &Hessian<N>,
        applied: Option<&AppliedForce<N>>,
    ) -> Option<Self> {
        let Hessian { qq, qv, vv, qz, vz, zz } = hessian;
        let with = |at: &SVector<f64, N>, slope: &SVector<f64, N>, factor: Complex<f64>| {
            Vector::<N>::from_fn(|d, _| factor * slope[d] + at[d])
        };
        let (z, rho) = ((-mu * g.z + 1.0).inv(), (mu * g.z + 1.0).inv());
        let (z_v, rho_v) = (with(&g.y, &g.x, mu) * mu, with(vz, qz, mu) * mu);
        let (mut of_z, mut of_rho, rho_z) = (with(vz, qz, -mu), with(&g.y, &g.x, -mu), mu * *zz);
        if let Some(applied) = applied {
            (of_z, of_rho) = (of_z - applied.z.map(|e| mu * e), of_rho - applied.value.map(|e| mu * e));
        }
        let (z_of_v, rho_of_v) = (z_v * z, (rho_v + z_v * (rho_z * z)) * rho);
        // Entry by entry, to save stack space.
        let mut inverse = Matrix::<N>::from_fn(|d, e| {
            let mut own = mu * (qv[(e, d)] - qv[(d, e)]) - mu * mu * qq[(d, e)] + vv[(d, e)];
            if let Some(applied) = applied {
                own -= mu * applied.v[(d, e)] + mu * mu * applied.q[(d, e)];
            }
            own + of_z[d] * z_of_v[e] - of_rho[d] * rho_of_v[e]
        });
        invert(&mut inverse).then_some(Block { inverse, z, z_v, rho, rho_v, rho_z, of_z, of_rho })
    }

    #[inline(always)]
    fn solve(&self, r_v: Vector<N>, r_z: Complex<f64>, r_rho: Complex<f64>) -> (Vector<N>, Complex<f64>, Complex<f64>) {
        let z = self.z * r_z;
        let rho = self.rho * (r_rho - self.rho_z * z);
        let dv = self.inverse * (r_v - self.of_z * z - self.of_rho * rho);
        let dot = |a: &Vector<N>| (0..N).fold(Complex::new(0.0, 0.0), |sum, d| sum + a[d] * dv[d]);
        let dz = self.z * (r_z + dot(&self.z_v));
        (dv, dz, self.rho * (r_rho - dot(&self.rho_v) - self.rho_z * dz))
    }
}

impl<const N: usize> StageNewton<N> {
    pub fn new(table: &StageTable) -> Self {
        let modes = Modes::of(table.s);
        StageNewton { modes, h: table.h, blocks: Vec::with_capacity(modes.iter().count()) }
    }

    /// Factorises the equations of the modes with new derivatives of L and of the applied force; `false` if one of the
    /// matrices is singular.
    pub fn factorise(
        &mut self,
        gradient: &ChartVector<N>,
        hessian: &Hessian<N>,
        applied: Option<&AppliedForce<N>>,
    ) -> bool {
        self.blocks.clear();
        for mode in self.modes.iter() {
            match Block::new(mode.value * self.h, gradient, hessian, applied) {
                Some(block) => self.blocks.push(block),
                None => return false,
            }
        }
        true
    }

    /// Replaces the residuals of the stages by their corrections.
    #[inline(always)]
    fn solve<S: Simd>(&self, v: &mut [Stages; N], z: &mut Stages, rho: &mut Stages) {
        for x in v.iter_mut().chain([&mut *z, &mut *rho]) {
            self.modes.enter::<S>(x);
        }
        self.solve_modes(v, z, rho);
        for x in v.iter_mut().chain([z, rho]) {
            self.modes.leave::<S>(x);
        }
    }

    /// The same in the coordinates of the modes. Not inlined, since complex numbers gain nothing from vector instructions.
    #[inline(never)]
    fn solve_modes(&self, v: &mut [Stages; N], z: &mut Stages, rho: &mut Stages) {
        for (mode, block) in self.modes.iter().zip(&self.blocks) {
            let r_v = Vector::<N>::from_fn(|d, _| mode.of(&v[d]));
            let (dv, dz, drho) = block.solve(r_v, mode.of(z), mode.of(rho));
            for d in 0..N {
                mode.set(&mut v[d], dv[d]);
            }
            mode.set(z, dz);
            mode.set(rho, drho);
        }
    }
}

/// One simplified Newton iteration of the general step, from the start of the step, L and its gradient at the stages,
/// and the stages. It does not depend on the type of the Lagrangian, so that it is compiled once.
pub(crate) struct CorrectStages<'a, const N: usize> {
    pub newton: &'a StageNewton<N>,
    pub table: &'a StageTable,
    pub start: ([f64; N], [f64; N], f64),
    pub l_v: &'a [Stages; N],
    /// L, force and rate are multiplied by the weights `h b`.
    pub l: &'a Stages,
    pub force: &'a [Stages; N],
    pub rate: &'a Stages,
    pub v: &'a mut [Stages; N],
    pub z: &'a mut Stages,
    /// `1 - rho`.
    pub one_minus_rho_stages: &'a mut Stages,
    /// The velocities multiplied by the weights, and the positions.
    pub moved: &'a mut [Stages; N],
    pub x: &'a mut [Stages; N],
}

impl<const N: usize> WithSimd for CorrectStages<'_, N> {
    /// The largest relative change of velocities, actions and factors, each kind relative to its largest value; and the
    /// largest relative change of the positions.
    type Output = (f64, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> (f64, f64) {
        let CorrectStages {
            newton,
            table,
            start: (q0, p0, z0),
            l_v,
            l,
            force,
            rate,
            v,
            z,
            one_minus_rho_stages,
            moved,
            x,
        } = self;
        let (s, m) = (table.s, blocks::<S>(table.s));
        let (zero, one) = (Lanes::<S>::splat(0.0), Lanes::<S>::splat(1.0));
        let (mut dv, mut dz, mut drho) = ([Stages::ZERO; N], Stages::ZERO, Stages::ZERO);
        table.m.apply(rate, s, &mut drho, zero);
        table.m.apply(l, s, &mut dz, Lanes::<S>::splat(z0));
        for d in 0..N {
            table.m.apply(&force[d], s, &mut dv[d], Lanes::<S>::splat(p0[d]));
        }
        for r in 0..m {
            let one_minus_rho_stages = one_minus_rho_stages.block::<S>(r);
            let inverse = (one - one_minus_rho_stages).recip();
            drho.set(r, one_minus_rho_stages - drho.block::<S>(r));
            dz.set(r, dz.block::<S>(r) - z.block(r));
            for d in 0..N {
                let l_v = l_v[d].block::<S>(r);
                dv[d].set(r, l_v.mul_add(one_minus_rho_stages, dv[d].block::<S>(r) - l_v) * inverse);
            }
        }
        newton.solve::<S>(&mut dv, &mut dz, &mut drho);
        for r in 0..m {
            drho.set(r, -drho.block::<S>(r));
        }
        // Changes of the factors are relative to 1.
        let mut largest = [[zero, zero], [zero, zero], [zero, one]];
        let velocities = v.iter_mut().zip(&dv).map(|(v, dv)| (v, dv, 0));
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
        for d in 0..N {
            let before = x[d];
            for r in 0..m {
                moved[d].set(r, table.weights.block::<S>(r) * v[d].block(r));
            }
            table.m.apply(&moved[d], s, &mut x[d], Lanes::<S>::splat(q0[d]));
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

/// Inverts a matrix in place; `false` if it is singular or not finite. Uses the heap for more than eight rows.
fn invert<const N: usize>(m: &mut Matrix<N>) -> bool {
    if !m.iter().all(|e| e.is_finite()) {
        return false;
    }
    let inverted =
        if const { N > 4 && N <= 8 } { try_invert_to(m.clone_owned(), m) } else { invert_complex(m.as_mut_slice(), N) };
    inverted && m.iter().all(|e| e.is_finite())
}

saved!([const N: usize] SlopeNewton<N> { inverses, a });
saved!([const N: usize] StageNewton<N> { blocks });
saved!([const N: usize] Block<N> { inverse, z, z_v, rho, rho_v, rho_z, of_z, of_rho });
