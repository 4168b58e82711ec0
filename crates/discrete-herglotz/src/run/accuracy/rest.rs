//! Motions that have come to rest.

use crate::resolution::monitor::size;
use crate::run::accuracy::first_guess;
use crate::run::{Plan, Request};
use crate::{GaussCollocation, Integrator, StepperOptions};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, VelocityPoint, gradient_rounding, max_or_nan};

/// Who ends a run that has come to rest.
pub(crate) const REST: &str = "rest";

/// Positions and momenta below this are at rest: the smallest number that has products with all its digits is some ten powers of ten
/// below, and errors relative to what is smaller still tell nothing.
const SMALLEST: f64 = 1e-280;

/// The roundings that the rate of the action may hold.
const ROUNDINGS: f64 = 256.0;

/// The logarithm by which the conformal factor of a motion falls, at the least, before it is at rest: its oscillations fall by half of it.
const FALLS: f64 = 1000.0;

/// The steps of the search for the time of rest, and those between two looks.
const SEARCHED: usize = 1 << 20;
const STRIDE: usize = 64;

impl<L: Lagrangian<N>, const N: usize> Request<'_, L, N> {
    /// Whether `q = v = 0` is an equilibrium to which a motion falls and where it stays, with this action: L does not depend on time, has no
    /// slope there, a positive mass and a potential with a minimum, and a drag that takes energy. Then nothing moves it away again,
    /// as it would from a hill.
    fn rests_at_the_origin(&self, z: f64) -> bool {
        let problem = self.problem;
        if !problem.structure.autonomous {
            return false;
        }
        let origin = VelocityPoint { q: SVector::zeros(), v: SVector::zeros(), z };
        let (slope, h) =
            (problem.lagrangian.gradient(problem.t0, &origin), problem.lagrangian.hessian(problem.t0, &origin));
        let still = slope.x.iter().chain(&slope.y).all(|e| *e == 0.0);
        // A momentum is steady where the action does not move it.
        let free = h.qz.iter().chain(&h.vz).all(|e| *e == 0.0);
        still && free && slope.z < 0.0 && h.vv.cholesky().is_some() && (-h.qq).cholesky().is_some()
    }

    /// Whether a motion from this problem's start is at rest in a state: see [`SMALLEST`]. The action, where it is requested, is steady too.
    pub(crate) fn is_at_rest(&self, t: f64, state: &PhasePoint<N>) -> bool {
        if max_or_nan(size(&state.q), size(&state.p)) >= SMALLEST || self.starts_at_rest() {
            return false;
        }
        let origin = VelocityPoint { q: SVector::zeros(), v: SVector::zeros(), z: state.z };
        let steady = || {
            let lagrangian = self.problem.lagrangian;
            let rate = lagrangian.value(t, &origin.q, &origin.v, origin.z).abs();
            rate <= ROUNDINGS * gradient_rounding(lagrangian, t, &origin).0
        };
        self.rests_at_the_origin(state.z) && (!self.needs.action || steady())
    }

    /// What begins so small has no motion that is seen.
    fn starts_at_rest(&self) -> bool {
        let state = &self.problem.state;
        max_or_nan(size(&state.q), size(&state.p)) < SMALLEST
    }

    /// The time at which the motion comes to rest, where that is within the span: by steps of eight stages, for a motion that has long
    /// enough.
    #[inline(never)]
    pub(crate) fn time_of_rest(&self) -> Option<f64> {
        let problem = self.problem;
        let fall = problem.lagrangian.gradient(problem.t0, &problem.start).z * self.span;
        // A NaN is not below.
        let falls = fall < -FALLS;
        if !falls || self.starts_at_rest() || !self.rests_at_the_origin(problem.start.z) {
            return None;
        }
        let gauss = GaussCollocation { stages: 8 };
        let h = self.span / first_guess(self, gauss.stages, 1e-3) as f64;
        let wants = StepperOptions { action: self.needs.action, watched: false };
        let mut stepper = Integrator::stepper(&gauss, problem, h, wants).ok()?;
        for _ in 0..SEARCHED / STRIDE {
            stepper.advance(STRIDE).ok()?;
            let t = stepper.time();
            if (t - problem.t0).abs() >= self.span.abs() {
                return None;
            }
            if self.is_at_rest(t, &stepper.state()) {
                return Some(t);
            }
        }
        None
    }
}

impl<L: Lagrangian<N>, const N: usize> Plan<'_, L, N> {
    /// Whether the run has come to rest in a state.
    pub(crate) fn is_at_rest(&self, t: f64, state: &PhasePoint<N>) -> bool {
        if max_or_nan(size(&state.q), size(&state.p)) >= SMALLEST {
            return false;
        }
        let span = self.t_end - self.problem.t0;
        let Self { problem, t_end, needs, scales, .. } = *self;
        let request = Request { problem, t_end, span, integrator: None, needs, scales };
        request.is_at_rest(t, state)
    }
}
