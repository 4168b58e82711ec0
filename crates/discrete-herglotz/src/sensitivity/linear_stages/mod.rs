//! The linear stage equations of the tangent of a step, forward or backward: their coefficients, and which of the
//! solutions in the modules applies.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

mod condensed;
mod direct;
mod iteration;

use crate::StepError;
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use crate::sensitivity::stage_derivatives::StageDerivatives;
use crate::sensitivity::stage_matrix::{StageMatrix, StageVector, stage_vector};
use crate::sensitivity::step_maps::{Direction, StepMaps};
use condensed::CondensedMaps;
use contact_geom::nalgebra::DMatrix;
use direct::Fallback;
use iteration::Kinds;
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
pub(crate) struct LinearStages {
    pub direction: Direction,
    /// Whether z and r act on the motion of q and P.
    coupled: bool,
    inverse_mass: StageMatrix,
    l_v: StageVector,
    l_z: Stages,
    v_q: StageMatrix,
    v_z: StageVector,
    p_r: StageVector,
    p_q: StageMatrix,
    p_v: StageMatrix,
    p_z: StageVector,
    z_q: StageVector,
    r_q: StageVector,
    r_v: StageVector,
    r_z: Stages,
    /// Whether the equations have the terms `v_q`, `p_v`.
    has_velocity_terms: bool,
    condensed: Option<Box<CondensedMaps>>,
    /// The number of iterations of the condensed equations, after the first, whose changes are not looked at.
    unchecked: u32,
    /// The equations are solved by LU factorisation where their iteration does not converge.
    fallback: Option<Box<Fallback>>,
    /// `rho W v`, and the positions and the P' of the condensed equations without those that an iteration changes.
    momentum: StageVector,
    fixed_q: StageVector,
    fixed_p_rate: StageVector,
}

/// The rates of a tangent at the stages, and its values there.
#[derive(Clone, Debug)]
pub(crate) struct StageTangent {
    pub v: StageVector,
    pub p_rate: StageVector,
    pub z_rate: Stages,
    pub r_rate: Stages,
    pub q: StageVector,
    pub p: StageVector,
    pub z: Stages,
    pub r: Stages,
}

/// Without coordinates.
impl Default for StageTangent {
    fn default() -> Self {
        StageTangent::zeros(0)
    }
}

impl StageTangent {
    /// The tangent 0 of n coordinates.
    pub fn zeros(n: usize) -> Self {
        let vector = || stage_vector(n);
        StageTangent {
            v: vector(),
            p_rate: vector(),
            z_rate: Stages::ZERO,
            r_rate: Stages::ZERO,
            q: vector(),
            p: vector(),
            z: Stages::ZERO,
            r: Stages::ZERO,
        }
    }

    /// Makes it a tangent of n coordinates, if it is not.
    #[inline(always)]
    pub fn reserve(&mut self, n: usize) {
        if self.v.len() != n {
            *self = StageTangent::zeros(n);
        }
    }

    /// Adds a multiple of the rates of another tangent; the values at the stages follow from the rates.
    #[inline(always)]
    pub fn add_multiple(&mut self, factor: f64, other: &Self) {
        self.reserve(other.v.len());
        for d in 0..self.v.len() {
            add_scaled(&mut self.v[d], factor, &other.v[d]);
            add_scaled(&mut self.p_rate[d], factor, &other.p_rate[d]);
        }
        add_scaled(&mut self.z_rate, factor, &other.z_rate);
        add_scaled(&mut self.r_rate, factor, &other.r_rate);
    }

    /// Whether the rates at all stages are finite.
    #[inline(always)]
    fn is_finite<S: Simd>(&self, s: usize) -> bool {
        let mut sum = Lanes::<S>::splat(0.0);
        for rates in self.v.iter().chain([&self.z_rate, &self.r_rate]) {
            for r in 0..blocks::<S>(s) {
                // 0 for a finite number, NaN otherwise.
                sum += rates.block::<S>(r) * 0.0;
            }
        }
        sum.sum() == 0.0
    }

    /// Multiplies the rates by a factor.
    #[inline(always)]
    pub fn scale(&mut self, factor: f64) {
        for rates in self.v.iter_mut().chain(&mut self.p_rate) {
            scale(rates, factor);
        }
        scale(&mut self.z_rate, factor);
        scale(&mut self.r_rate, factor);
    }
}

/// `to += factor from`.
#[inline(always)]
fn add_scaled(to: &mut Stages, factor: f64, from: &Stages) {
    for (to, from) in to.0.iter_mut().zip(&from.0) {
        *to += factor * from;
    }
}

#[inline(always)]
fn scale(to: &mut Stages, factor: f64) {
    for to in &mut to.0 {
        *to *= factor;
    }
}

/// The inhomogeneous terms: the values without the rates, and sources of the rates (`rho W v` contains `-v`).
pub(crate) struct Inhomogeneity {
    pub q: StageVector,
    pub p: StageVector,
    pub z: Stages,
    pub r: Stages,
    pub v_source: StageVector,
    pub p_source: StageVector,
    pub z_source: Stages,
    pub r_source: Stages,
    /// Whether there is a tangent of rho: r or its source is not 0.
    pub has_r: bool,
}

impl Inhomogeneity {
    /// No inhomogeneous terms, for n coordinates.
    pub fn zeros(n: usize) -> Self {
        let vector = || stage_vector(n);
        Inhomogeneity {
            q: vector(),
            p: vector(),
            z: Stages::ZERO,
            r: Stages::ZERO,
            v_source: vector(),
            p_source: vector(),
            z_source: Stages::ZERO,
            r_source: Stages::ZERO,
            has_r: false,
        }
    }

    /// Sets the sources to 0.
    #[inline(always)]
    pub fn forget_sources(&mut self) {
        self.v_source.fill(Stages::ZERO);
        self.p_source.fill(Stages::ZERO);
        self.z_source = Stages::ZERO;
        self.r_source = Stages::ZERO;
    }
}

impl LinearStages {
    /// The workspace for n coordinates; `coupled` states that z acts on the motion by more than a rate that depends on
    /// time alone.
    pub fn new(n: usize, direction: Direction, coupled: bool, has_velocity_terms: bool) -> Self {
        let (vector, matrix) = (|| stage_vector(n), || StageMatrix::zeros(n));
        LinearStages {
            direction,
            coupled,
            inverse_mass: matrix(),
            l_v: vector(),
            l_z: Stages::ZERO,
            v_q: matrix(),
            v_z: vector(),
            p_r: vector(),
            p_q: matrix(),
            p_v: matrix(),
            p_z: vector(),
            z_q: vector(),
            r_q: vector(),
            r_v: vector(),
            r_z: Stages::ZERO,
            has_velocity_terms,
            condensed: None,
            unchecked: 0,
            fallback: None,
            momentum: vector(),
            fixed_q: vector(),
            fixed_p_rate: vector(),
        }
    }

    /// Prepares the maps for constant mass and rate, where the derivatives at the stages are set and L is separable.
    #[cold]
    pub fn condense(&mut self, maps: &StepMaps, at: &StageDerivatives, inverse_mass: &DMatrix<f64>) {
        let gamma = at.l_z.0[0];
        let (z, r) = (maps.resolvent(-gamma), maps.resolvent(gamma));
        self.condensed = z.zip(r).map(|(z, r)| {
            Box::new(CondensedMaps { inverse_mass: inverse_mass.clone(), positions: maps.twice(&at.rho), z, r })
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
    pub fn set(&mut self, at: &StageDerivatives) {
        let n = self.l_v.len();
        self.inverse_mass.copy_from(&at.inverse_mass);
        self.l_v.copy_from_slice(&at.l_v);
        self.l_z = at.l_z;
        self.p_r.copy_from_slice(&at.l_q);
        self.z_q.copy_from_slice(&at.l_q);
        for d in 0..n {
            for e in 0..n {
                self.p_q[(d, e)] = product(&at.rho, &at.qq[(d, e)]);
                if self.has_velocity_terms {
                    self.v_q[(d, e)] = product(&at.rho, &at.qv[(e, d)]);
                    self.p_v[(d, e)] = product(&at.rho, &at.qv[(d, e)]);
                }
            }
        }
        if self.coupled {
            self.r_z = product(&at.rho, &at.zz);
            for d in 0..n {
                self.v_z[d] = product(&at.rho, &at.vz[d]);
                self.p_z[d] = product(&at.rho, &at.qz[d]);
                (self.r_q[d], self.r_v[d]) = (self.p_z[d], self.v_z[d]);
            }
        }
        let Some(force) = &at.force else { return };
        for d in 0..n {
            match self.direction {
                Direction::Forward => {
                    add(&mut self.p_r[d], &force.value[d]);
                    add(&mut self.p_z[d], &product(&at.rho, &force.z[d]));
                    for e in 0..n {
                        add(&mut self.p_q[(d, e)], &product(&at.rho, &force.q[(d, e)]));
                        add(&mut self.p_v[(d, e)], &product(&at.rho, &force.v[(d, e)]));
                    }
                }
                Direction::Backward => {
                    add(&mut self.z_q[d], &force.value[d]);
                    add(&mut self.r_q[d], &product(&at.rho, &force.z[d]));
                    for e in 0..n {
                        add(&mut self.p_q[(d, e)], &product(&at.rho, &force.q[(e, d)]));
                        add(&mut self.v_q[(d, e)], &product(&at.rho, &force.v[(e, d)]));
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
        given: &Inhomogeneity,
        x: &mut StageTangent,
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

    #[inline(always)]
    fn solve_for<S: Simd>(
        &mut self,
        kinds: Kinds,
        maps: &StepMaps,
        given: &Inhomogeneity,
        x: &mut StageTangent,
    ) -> Result<(), StepError> {
        if !self.iterate::<S>(kinds, maps, given, x) {
            self.solve_directly::<S>(kinds, maps, given, x)?;
        }
        Ok(())
    }
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
