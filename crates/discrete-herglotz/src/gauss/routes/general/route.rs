//! The general step as a route in physical time.

use crate::StepError;
use crate::gauss::curve::Curve;
use crate::gauss::dense::{Solved, SolvedStep};
use crate::gauss::routes::general::{General, Point};
use crate::gauss::routes::{GuessedStage, RouteState, RouteStateMut, StageRoute};
use crate::gauss::stages::equations::{Given, StageEquations};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::system::{CollocationSystem, PointRef};
use crate::gauss::work_summary::GaussRoute;
#[cfg(test)]
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::Stages;

impl StageRoute for General {
    fn route(&self) -> GaussRoute {
        if let Mass::Constant(_) = self.mass { GaussRoute::ConstantMass } else { GaussRoute::General }
    }

    fn state(&self) -> RouteState<'_> {
        RouteState { q: &self.q, y: &self.p, z: self.z }
    }

    fn state_mut(&mut self) -> RouteStateMut<'_> {
        RouteStateMut { q: &mut self.q, y: &mut self.p, z: &mut self.z }
    }

    fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    fn step(&mut self, system: &dyn CollocationSystem, t: f64) -> IterationOutcome {
        self.take_step(system, system, t)
    }

    fn defect(&self) -> f64 {
        self.defect
    }

    fn sigma(&self) -> f64 {
        1.0 / (1.0 - self.one_minus_rho)
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn restart(&mut self, v: &[f64]) -> bool {
        if self.newton.is_some() || self.suspended_newton.is_some() || self.by_newton.is_some() {
            return false;
        }
        (self.age, self.solved, self.predicted, self.one_minus_rho) = (0, false, false, 0.0);
        for stages in [&mut self.l, &mut self.rate, &mut self.one_minus_rho_stages, &mut self.z_stages] {
            *stages = Stages::ZERO;
        }
        self.known.copy_from_slice(v);
        self.point.v.copy_from_slice(v);
        self.guess();
        true
    }

    /// The velocity at the last stage of the last successful step, or that at the start.
    fn last_velocity(&self) -> Option<&[f64]> {
        Some(&self.known)
    }

    fn predict_stages(&mut self, stage: GuessedStage<'_>) {
        let v = self.vectors.split().v;
        self.l = Stages::ZERO;
        for i in 0..self.table.s {
            let (l, rho) = stage(i, &mut self.point.v);
            // The last stage is repeated in the padding.
            for (stages, v) in v.iter_mut().zip(&self.point.v) {
                stages.0[i..].fill(*v);
            }
            self.l.0[i] = self.table.weights.0[i] * l;
            self.one_minus_rho_stages.0[i..].fill(1.0 - rho);
        }
        (self.warm, self.predicted) = (false, true);
    }

    fn reserve_newton(&mut self, system: &dyn CollocationSystem) {
        self.reserve(system);
    }

    fn linearise_at_state(&mut self, system: &dyn CollocationSystem, t: f64) -> bool {
        self.take_state();
        let Point { q, v, p, z } = &mut self.point;
        if system.velocity(t, PointRef { q, v: p, z: *z }, &self.known, v).is_err() {
            return false;
        }
        self.guess();
        self.linearise(system, t)
    }

    fn suspend_newton(&mut self) {
        self.suspended_newton = self.newton.take();
    }

    /// The initial guess is a motion of constant velocity.
    fn solve_stages(&mut self, system: &dyn CollocationSystem, t: f64) -> Result<(), StepError> {
        self.reserve(system);
        self.take_state();
        let Some(mut by_newton) = self.by_newton.take() else { return Ok(()) };
        let (products, work) = &mut *by_newton;
        let equations = StageEquations { system, products, t };
        let Point { q, v, p, z } = &mut self.point;
        let from = PointRef { q, v: p, z: *z };
        let solved = system
            .velocity(t, from, &self.known, v)
            .and_then(|()| equations.solve(&Given::Start(from), v, from.v, work));
        if solved.is_ok() {
            self.predict_stages(&mut |i, v| {
                v.copy_from_slice(work.unknowns().velocity(i));
                (work.value(i), work.unknowns().factor(i))
            });
            (self.predicted, self.solved) = (false, true);
        }
        self.by_newton = Some(by_newton);
        solved.map(|_| ())
    }

    fn solved(&self, _system: &dyn CollocationSystem, _step: &SolvedStep<'_>, _wants_l: bool, to: Solved<'_>) -> bool {
        self.copy_stages([to.v, to.force], [to.rate, to.l]);
        true
    }

    fn collect(&self, _system: &dyn CollocationSystem, _step: &SolvedStep<'_>, curve: &mut Curve) {
        self.copy_stages([&mut curve.v, &mut curve.force], [&mut curve.rate, &mut curve.l]);
    }

    #[cfg(test)]
    fn set_instructions(&mut self, arch: Instructions) {
        self.arch = arch;
    }

    #[cfg(test)]
    fn let_actions_lag(&mut self) {
        self.follows = false;
    }
}
