//! One-sided limits of L, or of a contact Hamiltonian, at a surface where they jump.

use super::step_curve::TimedState;
use crate::system::products::times;
use crate::{Point, State, StepError, System, Vector};
use contact_geom::nalgebra::{DMatrix, DVectorViewMut};
use contact_geom::{numbers::max_abs_or_nan, support::linear};

/// The size of a correction, relative to the number, below which corrections that no longer decrease are the round-off
/// of the extrapolation to the surface.
pub(super) const STAGNATION_ROUND_OFF: f64 = 1e-10;

/// The largest number of Newton iterations for one number or one velocity: bisection would need as many.
pub(super) const MAX_ITERATIONS: usize = 60;

/// The one-sided limit of L, or of the contact Hamiltonian H by which it is given, at a surface, extrapolated from three
/// points on that side with an error of third order in their distance.
pub(super) struct OneSided<'a> {
    system: &'a dyn System,
    is_hamiltonian: bool,
    t: f64,
    z: f64,
    points: [Vector; 3],
}

/// The weights of the extrapolation from the distances 1, 2, 3 to 0.
const WEIGHTS: [f64; 3] = [3.0, -3.0, 1.0];

impl<'a> OneSided<'a> {
    /// The limit at a point from a side; `toward` is the distance of the first point.
    pub fn new(system: &'a dyn System, at: &TimedState, toward: &Vector) -> Self {
        let points = [1.0, 2.0, 3.0].map(|k| &at.state.q + toward * k);
        OneSided { system, is_hamiltonian: system.hints().hamiltonian, t: at.t, z: at.state.z, points }
    }

    fn points<'s>(&'s self, v: &'s Vector) -> impl Iterator<Item = (f64, Point)> + 's {
        let point = |q: &Vector| Point { q: q.clone(), v: v.clone(), z: self.z };
        WEIGHTS.into_iter().zip(&self.points).map(move |(weight, q)| (weight, point(q)))
    }

    fn states<'s>(&'s self, p: &'s Vector) -> impl Iterator<Item = (f64, State)> + 's {
        self.points(p).map(|(weight, Point { q, v: p, z })| (weight, State { q, p, z }))
    }

    /// L at a velocity, or H at a momentum.
    pub fn value(&self, y: &Vector) -> f64 {
        if self.is_hamiltonian {
            return self.hamiltonian(y).1;
        }
        self.points(y).map(|(weight, x)| weight * self.system.value(self.t, &x)).sum()
    }

    /// `H_p` and H at a momentum.
    fn hamiltonian(&self, p: &Vector) -> (Vector, f64) {
        let (mut v, mut energy) = (Vector::zeros(p.len()), 0.0);
        for (weight, state) in self.states(p) {
            let Some((h, d)) = self.system.hamiltonian_with_gradient(self.t, &state) else { return (v, f64::NAN) };
            v += d.y * weight;
            energy += weight * h;
        }
        (v, energy)
    }

    fn momentum(&self, v: &Vector) -> Vector {
        let of = |(weight, x): (f64, Point)| self.system.gradient(self.t, &x).y * weight;
        self.points(v).map(of).fold(Vector::zeros(v.len()), |sum, p| sum + p)
    }

    fn mass(&self, v: &Vector) -> DMatrix<f64> {
        let of = |(weight, x): (f64, Point)| self.system.hessian(self.t, &x).vv * weight;
        self.points(v).map(of).fold(DMatrix::zeros(v.len(), v.len()), |sum, w| sum + w)
    }

    /// The velocity of a momentum, by Newton's method from a guess for a Lagrangian, and the energy.
    pub fn velocity(&self, p: &Vector, guess: &Vector) -> Result<(Vector, f64), StepError> {
        if self.is_hamiltonian {
            let (v, energy) = self.hamiltonian(p);
            let is_finite = energy.is_finite() && v.iter().all(|v| v.is_finite());
            return if is_finite { Ok((v, energy)) } else { Err(StepError::NonFinite) };
        }
        let (mut v, mut before) = (guess.clone(), f64::INFINITY);
        for _ in 0..MAX_ITERATIONS {
            let mut change = self.momentum(&v) - p;
            solve(self.mass(&v), &mut change)?;
            v -= &change;
            let size = max_abs_or_nan(change.iter().copied());
            if !size.is_finite() {
                return Err(StepError::NonFinite);
            }
            // The corrections decrease down to the round-off of the extrapolation.
            if size <= f64::EPSILON * max_abs_or_nan(v.iter().copied())
                || (size >= before && size <= STAGNATION_ROUND_OFF * max_abs_or_nan(v.iter().copied()))
            {
                let energy = p.dot(&v) - self.value(&v);
                return Ok((v, energy));
            }
            before = size;
        }
        Err(StepError::NotConverged { residual: before, iterations: MAX_ITERATIONS as u32 })
    }

    /// The derivative of the velocity v of a momentum p along a direction of momenta: `W^-1` or `H_pp` times it.
    pub fn velocity_along(&self, (v, p): (&Vector, &Vector), mut direction: Vector) -> Result<Vector, StepError> {
        if !self.is_hamiltonian {
            solve(self.mass(v), &mut direction)?;
            return Ok(direction);
        }
        let mut sum = Vector::zeros(p.len());
        for (weight, state) in self.states(p) {
            let second = self.system.hamiltonian_hessian(self.t, &state).ok_or(StepError::NonFinite)?;
            sum += times(&second.vv, &direction) * weight;
        }
        Ok(sum)
    }
}

/// Solves a linear system; the solution overwrites the right-hand side.
fn solve(mut w: DMatrix<f64>, x: &mut Vector) -> Result<(), StepError> {
    let n = x.len();
    linear::solve(&mut w, &mut DVectorViewMut::from_slice(x, n)).map_err(|e| StepError::Singular { pivot: e.pivot })?;
    Ok(())
}
