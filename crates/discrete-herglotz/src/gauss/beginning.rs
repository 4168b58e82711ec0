//! What is found of a Lagrangian at the start of a run.

use crate::rules::step_equations::{inverted, kept_mass_matrix, mass_matrix};
use crate::{InputError, StepError, last_correction, verified};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Derivatives, GeometryError, Lagrangian, PhasePoint, Structure, VelocityPoint, largest, linear};

/// The start of a run.
pub(super) struct Beginning<const N: usize> {
    pub start: VelocityPoint<N>,
    pub structure: Structure,
    /// W and its inverse.
    pub w: Box<SMatrix<f64, N, N>>,
    pub inverse: Box<SMatrix<f64, N, N>>,
}

impl<const N: usize> Beginning<N> {
    /// With the structure that has been probed there, or after a probe.
    pub fn of(
        lagrangian: &impl Lagrangian<N>,
        probed: Option<Structure>,
        t0: f64,
        state: &PhasePoint<N>,
        guess: SVector<f64, N>,
    ) -> Result<Self, InputError> {
        state.check()?;
        if !t0.is_finite() {
            return Err(GeometryError::NonFinite { what: "t0", index: 0, value: t0 }.into());
        }
        let v = velocity(lagrangian, t0, state, guess)?;
        let start = VelocityPoint { q: state.q, v, z: state.z };
        let structure = probed.map_or_else(|| verified(lagrangian, t0, &start), Ok)?;
        let w = kept_mass_matrix(lagrangian, t0, &start);
        let inverse = inverted(&w).map_err(|e| InputError::FirstStep(StepError::Singular { pivot: e.pivot }))?;
        // Rows of different units are no matter: |W^-1| |W| is 1 for every diagonal W.
        let condition = condition_of(&inverse, &w);
        if condition.is_nan() || condition > 0.1 / f64::EPSILON {
            return Err(InputError::FirstStep(StepError::Singular { pivot: 1.0 / condition }));
        }
        Ok(Beginning { start, structure, w, inverse })
    }
}

/// The largest row sum of `|W^-1| |W|`; entry by entry, for the sake of the stack.
fn condition_of<const N: usize>(inverse: &SMatrix<f64, N, N>, w: &SMatrix<f64, N, N>) -> f64 {
    let product = |i: usize, j: usize| (0..N).map(|k| inverse[(i, k)].abs() * w[(k, j)].abs()).sum::<f64>();
    largest((0..N).map(|i| (0..N).map(|j| product(i, j)).sum()))
}

/// The velocity that belongs to a momentum, `L_v(t, q, v, z) = p`, by Newton's method.
#[inline(never)]
pub(crate) fn velocity<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    state: &PhasePoint<N>,
    guess: SVector<f64, N>,
) -> Result<SVector<f64, N>, InputError> {
    let mut x = VelocityPoint { q: state.q, v: guess, z: state.z };
    let mut before = f64::INFINITY;
    for _ in 0..crate::ITERATION_LIMIT {
        let momenta = lagrangian.gradient(t, &x).y;
        let mut change = momenta - state.p;
        let mut w = mass_matrix(lagrangian, t, &x);
        // To the round-off of its terms: where W is ill conditioned the velocity is determined no better.
        let of = |i: usize| (0..N).map(|j| (w[(i, j)] * x.v[j]).abs()).sum::<f64>() + state.p[i].abs();
        let terms: SVector<f64, N> = SVector::from_fn(|i, _| of(i));
        let held = change.iter().zip(&terms).all(|(off, term)| off.abs() <= 2.0 * N as f64 * f64::EPSILON * term);
        linear::solve(&mut w, &mut change)
            .map_err(|e| InputError::FirstStep(StepError::Singular { pivot: e.pivot }))?;
        x.v -= change;
        let (size, scale) = (largest(change.iter().copied()), largest(x.v.iter().copied()));
        if !(size + scale).is_finite() {
            return Err(InputError::FirstStep(StepError::NonFinite));
        }
        let round_off = f64::EPSILON * scale;
        if last_correction(size, before, round_off) || (size >= 0.5 * before && (held || size <= 64.0 * round_off)) {
            return Ok(x.v);
        }
        before = size;
    }
    Err(InputError::FirstStep(StepError::NotConverged { residual: before, iterations: crate::ITERATION_LIMIT }))
}
