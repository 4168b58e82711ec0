//! The linear stage equations of the tangent of a step, forward or backward.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::StepError;
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{StageMap, Stages, blocks};
use crate::sensitivity::stage_derivatives::{StageDerivatives, StageMatrix, StageVector, stage_values};
use crate::sensitivity::step_maps::{Direction, StepMaps};
use crate::solve::DenseLu;
use contact_geom::nalgebra::SMatrix;
use contact_geom::numbers::max_or_nan;
use pulp::Simd;

/// The coefficients of the linearised motion on the symplectification at the stages of a step. For the tangent
/// `(q, P, z, r)` of `(q, P, z, rho)`, with the rates `(v, P', z', r')`:
///
/// `rho W v = P - r L_v - rho (v_q q + v_z z)`, `q' = v`, `P' = r p_r + rho (p_q q + p_v v + p_z z)`,
/// `z' = z_q.q + L_v.v + L_z z`, `r' = -r L_z - rho (r_q.q + r_v.v + r_z z)`.
///
/// For the tangent of the step `v_q = L_vq`, `v_z = L_vz`, `p_r = L_q + f`, `p_q = L_qq + f_q`, `p_v = L_qv + f_v`,
/// `p_z = L_qz + f_z`, `z_q = L_q`, `r_q = L_zq`, `r_v = L_zv`, `r_z = L_zz`. For its adjoint, the tangent of the step
/// backward, the terms of the force are transposed: `v_q = L_vq + f_v^T`, `p_r = L_q`, `p_q = L_qq + f_q^T`,
/// `p_v = L_qv`, `p_z = L_qz`, `z_q = L_q + f`, `r_q = L_zq + f_z`. The matrices are stored with the factor rho.
pub(crate) struct LinearStages<const N: usize> {
    pub direction: Direction,
    /// Whether z and r act on the motion of q and P.
    coupled: bool,
    inverse_mass: StageMatrix<N>,
    l_v: StageVector<N>,
    l_z: Stages,
    v_q: StageMatrix<N>,
    v_z: StageVector<N>,
    p_r: StageVector<N>,
    p_q: StageMatrix<N>,
    p_v: StageMatrix<N>,
    p_z: StageVector<N>,
    z_q: StageVector<N>,
    r_q: StageVector<N>,
    r_v: StageVector<N>,
    r_z: Stages,
    /// Whether the equations have the terms `v_q`, `p_v`.
    has_velocity_terms: bool,
    condensed: Option<Box<CondensedMaps<N>>>,
    /// The equations are solved by LU factorisation where their iteration does not converge.
    fallback: Option<Box<Fallback<N>>>,
}

/// The rates of a tangent at the stages, and its values there.
#[derive(Clone)]
pub(crate) struct StageTangent<const N: usize> {
    pub v: StageVector<N>,
    pub p_rate: StageVector<N>,
    pub z_rate: Stages,
    pub r_rate: Stages,
    pub q: StageVector<N>,
    pub p: StageVector<N>,
    pub z: Stages,
    pub r: Stages,
}

impl<const N: usize> StageTangent<N> {
    pub const ZERO: Self = StageTangent {
        v: [Stages::ZERO; N],
        p_rate: [Stages::ZERO; N],
        z_rate: Stages::ZERO,
        r_rate: Stages::ZERO,
        q: [Stages::ZERO; N],
        p: [Stages::ZERO; N],
        z: Stages::ZERO,
        r: Stages::ZERO,
    };
}

/// The inhomogeneous terms: the values without the rates, and sources of the rates (`rho W v` contains `-v`).
#[derive(Clone)]
pub(crate) struct Inhomogeneity<const N: usize> {
    pub q: StageVector<N>,
    pub p: StageVector<N>,
    pub z: Stages,
    pub r: Stages,
    pub v_source: StageVector<N>,
    pub p_source: StageVector<N>,
    pub z_source: Stages,
    pub r_source: Stages,
    /// Whether there is a tangent of rho: r or its source is not 0.
    pub has_r: bool,
}

impl<const N: usize> Inhomogeneity<N> {
    pub const ZERO: Self = Inhomogeneity {
        q: [Stages::ZERO; N],
        p: [Stages::ZERO; N],
        z: Stages::ZERO,
        r: Stages::ZERO,
        v_source: [Stages::ZERO; N],
        p_source: [Stages::ZERO; N],
        z_source: Stages::ZERO,
        r_source: Stages::ZERO,
        has_r: false,
    };
}

/// The maps of a step for constant mass and constant rate, where L is separable and there is no force: with
/// `a = W^-1 P'`, the positions are `q = q_without_a + A (1/rho) A a`; z and r are images of their terms without rates.
struct CondensedMaps<const N: usize> {
    inverse_mass: SMatrix<f64, N, N>,
    positions: StageMap,
    z: StageMap,
    r: StageMap,
}

/// The rates that an iteration determines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Kinds {
    motion: bool,
    z: bool,
    r: bool,
}

struct Fallback<const N: usize> {
    kinds: Kinds,
    s: usize,
    lu: DenseLu,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
}

impl<const N: usize> LinearStages<N> {
    /// The workspace; `coupled` states that z acts on the motion by more than a rate that depends on time alone.
    pub fn new(direction: Direction, coupled: bool, has_velocity_terms: bool) -> Self {
        let (vector, matrix) = ([Stages::ZERO; N], [[Stages::ZERO; N]; N]);
        LinearStages {
            direction,
            coupled,
            inverse_mass: matrix,
            l_v: vector,
            l_z: Stages::ZERO,
            v_q: matrix,
            v_z: vector,
            p_r: vector,
            p_q: matrix,
            p_v: matrix,
            p_z: vector,
            z_q: vector,
            r_q: vector,
            r_v: vector,
            r_z: Stages::ZERO,
            has_velocity_terms,
            condensed: None,
            fallback: None,
        }
    }

    /// Prepares the maps for constant mass and rate, where the derivatives at the stages are set and L is separable.
    #[cold]
    pub fn condense(&mut self, maps: &StepMaps, at: &StageDerivatives<N>, inverse_mass: &SMatrix<f64, N, N>) {
        let gamma = at.l_z.0[0];
        let (z, r) = (maps.resolvent(-gamma), maps.resolvent(gamma));
        self.condensed = z.zip(r).map(|(z, r)| {
            Box::new(CondensedMaps { inverse_mass: *inverse_mass, positions: maps.twice(&at.rho), z, r })
        });
    }

    /// Forgets the maps, for steps of another length.
    pub fn forget(&mut self) {
        self.condensed = None;
    }

    /// Whether the maps were prepared.
    pub fn is_condensed(&self) -> bool {
        self.condensed.is_some()
    }

    /// Sets the coefficients from the derivatives at the stages.
    #[inline(always)]
    pub fn set(&mut self, at: &StageDerivatives<N>) {
        let rho = &at.rho.0;
        let times = |a: &Stages| Stages(std::array::from_fn(|i| rho[i] * a.0[i]));
        self.inverse_mass = at.inverse_mass;
        self.l_v = at.l_v;
        self.l_z = at.l_z;
        self.p_r = at.l_q;
        self.z_q = at.l_q;
        for d in 0..N {
            for e in 0..N {
                self.p_q[d][e] = times(&at.qq[d][e]);
                if self.has_velocity_terms {
                    self.v_q[d][e] = times(&at.qv[e][d]);
                    self.p_v[d][e] = times(&at.qv[d][e]);
                }
            }
        }
        if self.coupled {
            self.r_z = times(&at.zz);
            for d in 0..N {
                self.v_z[d] = times(&at.vz[d]);
                self.p_z[d] = times(&at.qz[d]);
                (self.r_q[d], self.r_v[d]) = (self.p_z[d], self.v_z[d]);
            }
        }
        let Some(force) = &at.force else { return };
        for d in 0..N {
            match self.direction {
                Direction::Forward => {
                    add(&mut self.p_r[d], &force.value[d]);
                    add(&mut self.p_z[d], &times(&force.z[d]));
                    for e in 0..N {
                        add(&mut self.p_q[d][e], &times(&force.q[d][e]));
                        add(&mut self.p_v[d][e], &times(&force.v[d][e]));
                    }
                }
                Direction::Backward => {
                    add(&mut self.z_q[d], &force.value[d]);
                    add(&mut self.r_q[d], &times(&force.z[d]));
                    for e in 0..N {
                        add(&mut self.p_q[d][e], &times(&force.q[e][d]));
                        add(&mut self.v_q[d][e], &times(&force.v[e][d]));
                    }
                }
            }
        }
    }

    /// Solves the stage equations for a tangent, whose rates are the initial guess.
    ///
    /// # Errors
    /// [`StepError::Singular`], [`StepError::NonFinite`], [`StepError::NotConverged`].
    #[inline(always)]
    pub fn solve<S: Simd>(
        &mut self,
        maps: &StepMaps,
        given: &Inhomogeneity<N>,
        x: &mut StageTangent<N>,
    ) -> Result<(), StepError> {
        if self.coupled {
            return self.solve_for::<S>(Kinds { motion: true, z: true, r: true }, maps, given, x);
        }
        if let Some(condensed) = self.condensed.take() {
            let solved = self.solve_condensed::<S>(&condensed, maps, given, x);
            self.condensed = Some(condensed);
            if solved {
                return Ok(());
            }
        }
        // The tangents of rho, of the motion, and of z, each of which depends on those before it.
        if given.has_r {
            self.solve_for::<S>(Kinds { motion: false, z: false, r: true }, maps, given, x)?;
        } else {
            (x.r, x.r_rate) = (Stages::ZERO, Stages::ZERO);
        }
        x.z = Stages::ZERO;
        self.solve_for::<S>(Kinds { motion: true, z: false, r: false }, maps, given, x)?;
        self.solve_for::<S>(Kinds { motion: false, z: true, r: false }, maps, given, x)
    }

    /// Solves the equations for constant mass and rate by fixed-point iteration for the positions; `false` if it does
    /// not converge.
    #[inline(always)]
    fn solve_condensed<S: Simd>(
        &self,
        condensed: &CondensedMaps<N>,
        maps: &StepMaps,
        given: &Inhomogeneity<N>,
        x: &mut StageTangent<N>,
    ) -> bool {
        let s = maps.s;
        let zero = Lanes::<S>::splat(0.0);
        let gamma = self.l_z.0[0];
        (x.r, x.r_rate) = (Stages::ZERO, Stages::ZERO);
        if given.has_r {
            let mut without = Stages::ZERO;
            maps.to_stages.apply::<S>(&given.r_source, s, &mut without, |_| zero);
            for i in 0..MAX_STAGES {
                without.0[i] = given.r.0[i] - without.0[i];
            }
            condensed.r.apply::<S>(&without, s, &mut x.r, |_| zero);
            for i in 0..MAX_STAGES {
                x.r_rate.0[i] = -gamma * x.r.0[i] - given.r_source.0[i];
            }
        }
        // The velocities without the rates of P, and the positions that they give.
        let (mut u, mut q0) = ([Stages::ZERO; N], [Stages::ZERO; N]);
        for d in 0..N {
            let mut momentum = given.p[d];
            for i in 0..MAX_STAGES {
                momentum.0[i] -= given.v_source[d].0[i] + x.r.0[i] * self.l_v[d].0[i];
            }
            for e in 0..N {
                add_product(&mut u[e], &momentum, &self.inverse_mass[e][d]);
            }
        }
        for d in 0..N {
            maps.to_stages.apply::<S>(&u[d], s, &mut q0[d], |r| given.q[d].block(r));
        }
        let mut fixed = [Stages::ZERO; N];
        for d in 0..N {
            fixed[d] = product(&x.r, &self.p_r[d]);
            add(&mut fixed[d], &given.p_source[d]);
        }
        let (mut iteration, mut is_first) = (FixedPointIteration::until(1.0, 0.25), true);
        loop {
            let mut a = [Stages::ZERO; N];
            let (mut change, mut size) = (zero, zero);
            for d in 0..N {
                for e in 0..N {
                    for i in 0..MAX_STAGES {
                        a[d].0[i] += condensed.inverse_mass[(d, e)] * x.p_rate[e].0[i];
                    }
                }
                let mut q = Stages::ZERO;
                condensed.positions.apply::<S>(&a[d], s, &mut q, |r| q0[d].block(r));
                for r in 0..blocks::<S>(s) {
                    let new = q.block::<S>(r);
                    change = change.max((new - x.q[d].block::<S>(r)).abs());
                    size = size.max(new.abs());
                }
                x.q[d] = q;
            }
            for d in 0..N {
                x.p_rate[d] = fixed[d];
                for e in 0..N {
                    add_product(&mut x.p_rate[d], &x.q[e], &self.p_q[d][e]);
                }
            }
            // The first rates are a guess that does not belong to the positions before it.
            if std::mem::take(&mut is_first) {
                continue;
            }
            let (change, size) = (change.reduce_max(), size.reduce_max());
            match iteration.assess(change, size) {
                IterationOutcome::Continue => {}
                IterationOutcome::Done => break,
                _ => return false,
            }
        }
        for d in 0..N {
            maps.to_stages.apply::<S>(&x.p_rate[d], s, &mut x.p[d], |r| given.p[d].block(r));
        }
        let mut z_rate = given.z_source;
        let mut finite = 0.0;
        for d in 0..N {
            let mut v = Stages::ZERO;
            for e in 0..N {
                let mut momentum = x.p[e];
                for i in 0..MAX_STAGES {
                    momentum.0[i] -= given.v_source[e].0[i] + x.r.0[i] * self.l_v[e].0[i];
                }
                add_product(&mut v, &momentum, &self.inverse_mass[d][e]);
            }
            x.v[d] = v;
            add_product(&mut z_rate, &x.q[d], &self.z_q[d]);
            add_product(&mut z_rate, &x.v[d], &self.l_v[d]);
            for i in 0..s {
                finite += v.0[i] + x.q[d].0[i];
            }
        }
        let mut without = Stages::ZERO;
        maps.to_stages.apply::<S>(&z_rate, s, &mut without, |r| given.z.block(r));
        condensed.z.apply::<S>(&without, s, &mut x.z, |_| zero);
        for i in 0..MAX_STAGES {
            z_rate.0[i] += gamma * x.z.0[i];
        }
        x.z_rate = z_rate;
        // The maxima over lanes may hide a NaN.
        finite.is_finite()
    }

    #[inline(always)]
    fn solve_for<S: Simd>(
        &mut self,
        kinds: Kinds,
        maps: &StepMaps,
        given: &Inhomogeneity<N>,
        x: &mut StageTangent<N>,
    ) -> Result<(), StepError> {
        if !self.iterate::<S>(kinds, maps, given, x) {
            self.solve_directly::<S>(kinds, maps, given, x)?;
        }
        Ok(())
    }

    /// Fixed-point iteration to round-off; `false` if it does not converge.
    #[inline(always)]
    fn iterate<S: Simd>(
        &self,
        kinds: Kinds,
        maps: &StepMaps,
        given: &Inhomogeneity<N>,
        x: &mut StageTangent<N>,
    ) -> bool {
        let mut iteration = FixedPointIteration::until(1.0, 0.25);
        loop {
            match iteration.assess(self.update::<S>(kinds, maps, Some(given), x), 1.0) {
                IterationOutcome::Continue => {}
                IterationOutcome::Done => return true,
                _ => return false,
            }
        }
    }

    /// Computes the values at the stages from the rates, and the rates from these values; without the inhomogeneous
    /// terms, if none are given. Returns the largest change of a rate, relative to the size of the terms.
    #[inline(always)]
    fn update<S: Simd>(
        &self,
        kinds: Kinds,
        maps: &StepMaps,
        given: Option<&Inhomogeneity<N>>,
        x: &mut StageTangent<N>,
    ) -> f64 {
        let Kinds { motion, z, r } = kinds;
        let s = maps.s;
        let sum = |rates: &Stages, start: Option<&Stages>| {
            let mut values = stage_values::<S>(maps, rates, 0.0);
            if let Some(start) = start {
                add(&mut values, start);
            }
            values
        };
        if r {
            x.r = sum(&x.r_rate, given.map(|g| &g.r));
        }
        if z {
            x.z = sum(&x.z_rate, given.map(|g| &g.z));
        }
        let mut worst = 0.0;
        if motion {
            for d in 0..N {
                x.q[d] = sum(&x.v[d], given.map(|g| &g.q[d]));
            }
            for d in 0..N {
                let mut rate = product(&x.r, &self.p_r[d]);
                if self.coupled {
                    add_product(&mut rate, &x.z, &self.p_z[d]);
                }
                for e in 0..N {
                    add_product(&mut rate, &x.q[e], &self.p_q[d][e]);
                    if self.has_velocity_terms {
                        add_product(&mut rate, &x.v[e], &self.p_v[d][e]);
                    }
                }
                if let Some(given) = given {
                    add(&mut rate, &given.p_source[d]);
                }
                x.p_rate[d] = rate;
                x.p[d] = sum(&x.p_rate[d], given.map(|g| &g.p[d]));
            }
            let mut momentum = [Stages::ZERO; N];
            for d in 0..N {
                momentum[d] = x.p[d];
                subtract_product(&mut momentum[d], &x.r, &self.l_v[d]);
                if self.coupled {
                    subtract_product(&mut momentum[d], &x.z, &self.v_z[d]);
                }
                if self.has_velocity_terms {
                    for e in 0..N {
                        subtract_product(&mut momentum[d], &x.q[e], &self.v_q[d][e]);
                    }
                }
                if let Some(given) = given {
                    for i in 0..MAX_STAGES {
                        momentum[d].0[i] -= given.v_source[d].0[i];
                    }
                }
            }
            let (mut change, mut size, mut length) = (0.0, 0.0, 0.0);
            for d in 0..N {
                let mut v = Stages::ZERO;
                for e in 0..N {
                    add_product(&mut v, &momentum[e], &self.inverse_mass[d][e]);
                }
                compare(s, &v, &x.v[d], &mut change, &mut size);
                let mut none = 0.0;
                compare(s, &x.q[d], &x.q[d], &mut none, &mut length);
                x.v[d] = v;
            }
            worst = relative(change, max_or_nan(size, length / maps.h.abs()));
        }
        let (mut z_rate, mut r_rate) = (Stages::ZERO, Stages::ZERO);
        if z {
            z_rate = product(&x.z, &self.l_z);
            for d in 0..N {
                add_product(&mut z_rate, &x.q[d], &self.z_q[d]);
                add_product(&mut z_rate, &x.v[d], &self.l_v[d]);
            }
            if let Some(given) = given {
                add(&mut z_rate, &given.z_source);
            }
            worst = max_or_nan(worst, apart(maps, &z_rate, &x.z_rate, &x.z));
        }
        if r {
            subtract_product(&mut r_rate, &x.r, &self.l_z);
            if motion {
                subtract_product(&mut r_rate, &x.z, &self.r_z);
                for d in 0..N {
                    subtract_product(&mut r_rate, &x.q[d], &self.r_q[d]);
                    subtract_product(&mut r_rate, &x.v[d], &self.r_v[d]);
                }
            }
            if let Some(given) = given {
                for i in 0..MAX_STAGES {
                    r_rate.0[i] -= given.r_source.0[i];
                }
            }
            worst = max_or_nan(worst, apart(maps, &r_rate, &x.r_rate, &x.r));
        }
        if z {
            x.z_rate = z_rate;
        }
        if r {
            x.r_rate = r_rate;
        }
        worst
    }

    /// Solves the stage equations by LU factorisation of their matrix, whose columns are the images of unit vectors.
    #[cold]
    #[inline(never)]
    fn solve_directly<S: Simd>(
        &mut self,
        kinds: Kinds,
        maps: &StepMaps,
        given: &Inhomogeneity<N>,
        x: &mut StageTangent<N>,
    ) -> Result<(), StepError> {
        let s = maps.s;
        let n = s * (if kinds.motion { N } else { 0 } + usize::from(kinds.z) + usize::from(kinds.r));
        let mut fallback = match self.fallback.take() {
            Some(fallback) if fallback.kinds == kinds && fallback.s == s => fallback,
            _ => Box::new(Fallback { kinds, s, lu: DenseLu::new(n), matrix: vec![0.0; n * n], rhs: vec![0.0; n] }),
        };
        let Fallback { lu, matrix, rhs, .. } = &mut *fallback;
        let mut unit = StageTangent::ZERO;
        if !kinds.r {
            unit.r = Stages::ZERO;
        }
        for j in 0..n {
            set_unknowns(kinds, s, &mut unit, |k| f64::from(u8::from(k == j)));
            self.update::<S>(kinds, maps, None, &mut unit);
            let column = &mut matrix[j * n..][..n];
            unknowns(kinds, s, &unit, |k, value| column[k] = f64::from(u8::from(k == j)) - value);
        }
        lu.factorise(|i, j| matrix[j * n + i])?;
        // Two refinements: the second shows that the first has reached round-off.
        for _ in 0..3 {
            unknowns(kinds, s, x, |k, value| rhs[k] = -value);
            self.update::<S>(kinds, maps, Some(given), x);
            unknowns(kinds, s, x, |k, value| rhs[k] += value);
            let mut before = std::mem::take(rhs);
            // x is now F(x0) = x0 + rhs; the solution is x0 + (1 - T)^-1 rhs.
            let shifted: Vec<f64> = before.clone();
            lu.solve(&mut before)?;
            add_to_unknowns(kinds, s, x, |k| before[k] - shifted[k]);
            *rhs = before;
        }
        self.update::<S>(kinds, maps, Some(given), x);
        self.fallback = Some(fallback);
        Ok(())
    }
}

/// Applies a function to the unknowns of an iteration, in the order: v, z', r'.
fn for_each_unknown<const N: usize>(
    kinds: Kinds,
    s: usize,
    x: &mut StageTangent<N>,
    mut f: impl FnMut(usize, &mut f64),
) {
    let mut k = 0;
    let motion = if kinds.motion { &mut x.v[..] } else { &mut [] };
    let others = [(kinds.z, &mut x.z_rate), (kinds.r, &mut x.r_rate)];
    for rates in motion.iter_mut().chain(others.into_iter().filter(|(is, _)| *is).map(|(_, rates)| rates)) {
        for rate in rates.0.iter_mut().take(s) {
            f(k, rate);
            k += 1;
        }
    }
}

fn set_unknowns<const N: usize>(kinds: Kinds, s: usize, x: &mut StageTangent<N>, to: impl Fn(usize) -> f64) {
    for_each_unknown(kinds, s, x, |k, rate| *rate = to(k));
}

fn add_to_unknowns<const N: usize>(kinds: Kinds, s: usize, x: &mut StageTangent<N>, by: impl Fn(usize) -> f64) {
    for_each_unknown(kinds, s, x, |k, rate| *rate += by(k));
}

fn unknowns<const N: usize>(kinds: Kinds, s: usize, x: &StageTangent<N>, mut f: impl FnMut(usize, f64)) {
    for_each_unknown(kinds, s, &mut x.clone(), |k, rate| f(k, *rate));
}

#[inline(always)]
fn add(to: &mut Stages, x: &Stages) {
    for i in 0..MAX_STAGES {
        to.0[i] += x.0[i];
    }
}

#[inline(always)]
pub(crate) fn product(a: &Stages, b: &Stages) -> Stages {
    let mut out = Stages::ZERO;
    add_product(&mut out, a, b);
    out
}

#[inline(always)]
pub(crate) fn add_product(to: &mut Stages, a: &Stages, b: &Stages) {
    for i in 0..MAX_STAGES {
        to.0[i] += a.0[i] * b.0[i];
    }
}

#[inline(always)]
pub(crate) fn subtract_product(to: &mut Stages, a: &Stages, b: &Stages) {
    for i in 0..MAX_STAGES {
        to.0[i] -= a.0[i] * b.0[i];
    }
}

/// The largest difference and the largest value at the stages; infinite where one is NaN.
#[inline(always)]
fn compare(s: usize, new: &Stages, old: &Stages, change: &mut f64, size: &mut f64) {
    for i in 0..s {
        *change = max_or_nan(*change, (new.0[i] - old.0[i]).abs());
        *size = max_or_nan(*size, new.0[i].abs());
    }
}

/// A change relative to a size; 0 where both vanish.
#[inline(always)]
fn relative(change: f64, size: f64) -> f64 {
    if change == 0.0 { 0.0 } else { change / size }
}

/// The relative change of the rates of values at the stages.
#[inline(always)]
fn apart(maps: &StepMaps, new: &Stages, old: &Stages, values: &Stages) -> f64 {
    let (mut change, mut size, mut none, mut length) = (0.0, 0.0, 0.0, 0.0);
    compare(maps.s, new, old, &mut change, &mut size);
    compare(maps.s, values, values, &mut none, &mut length);
    relative(change, max_or_nan(size, length / maps.h.abs()))
}
