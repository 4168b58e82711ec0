//! The condensed step as a route.

use crate::StepError;
use crate::gauss::curve::Curve;
use crate::gauss::dense::{Solved, SolvedStep};
use crate::gauss::routes::separable::Separable;
use crate::gauss::routes::separable::vectors::Parts;
use crate::gauss::routes::{RouteState, RouteStateMut, StageRoute};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::position_newton::{At, PositionNewton};
use crate::gauss::system::CollocationSystem;
use crate::gauss::work_summary::GaussRoute;
use crate::numbers::compensated::copy_values;
#[cfg(test)]
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::Stages;

impl StageRoute for Separable {
    fn route(&self) -> GaussRoute {
        GaussRoute::Condensed
    }

    fn state(&self) -> RouteState<'_> {
        RouteState { q: &self.q, y: &self.v, z: self.z }
    }

    fn state_mut(&mut self) -> RouteStateMut<'_> {
        RouteStateMut { q: &mut self.q, y: &mut self.v, z: &mut self.z }
    }

    fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    fn step(&mut self, system: &dyn CollocationSystem, t: f64) -> IterationOutcome {
        self.take_step(system, t)
    }

    fn defect(&self) -> f64 {
        self.defect
    }

    fn sigma(&self) -> f64 {
        1.0 + self.table.grow.head
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn restart(&mut self, _v: &[f64]) -> bool {
        let left = self.vectors.left();
        let has_matrix = left.kappa != 0.0 || left.tail.is_some();
        if has_matrix || self.newton.is_some() || self.suspended_newton.is_some() || self.positions.is_some() {
            return false;
        }
        (self.far, self.warm, self.solved) = (false, false, false);
        (self.steps_without_predictor, self.age, self.taken, self.review) = (0, 0, 0, 1);
        true
    }

    fn reserve_newton(&mut self, _system: &dyn CollocationSystem) {
        let (s, n) = (self.table.s, self.q.len());
        self.positions.get_or_insert_with(|| Box::new(PositionNewton::new(s, n)));
    }

    fn linearise_at_state(&mut self, system: &dyn CollocationSystem, t: f64) -> bool {
        self.forget();
        copy_values(&self.q, &mut self.point.q);
        self.linearise(system, t)
    }

    fn suspend_newton(&mut self) {
        self.suspended_newton = self.newton.take();
        self.update_matrix();
    }

    /// The initial guess uses the forces of the step before, if they are known; otherwise it is a motion without forces.
    fn solve_stages(&mut self, system: &dyn CollocationSystem, t: f64) -> Result<(), StepError> {
        let n = self.q.len();
        copy_values(&self.q, &mut self.point.q);
        copy_values(&self.v, &mut self.point.v);
        let positions = self.positions.get_or_insert_with(|| Box::new(PositionNewton::new(self.table.s, n)));
        let (table, inverse_mass, q, v) = (&*self.table, self.inverse_mass.as_ref(), &self.point.q, &self.point.v);
        positions.solve(&At { system, table, inverse_mass, t, q, v })?;
        let Parts { left, rest, .. } = self.vectors.parts(n);
        rest.fill(Stages::ZERO);
        for (i, (a, q)) in positions.stages().enumerate() {
            for ((rest, a), q) in rest.iter_mut().zip(a).zip(q) {
                // The last stage is repeated in the padding.
                rest.0[i..].fill(a + left.kappa * q);
            }
        }
        self.solved = true;
        Ok(())
    }

    /// The values of L are known if z is advanced.
    fn solved(&self, system: &dyn CollocationSystem, step: &SolvedStep<'_>, wants_l: bool, to: Solved<'_>) -> bool {
        let knows_l = wants_l && self.wants_z;
        to.set_accelerations(system, step, &self.table, self.vectors.solved(), knows_l);
        knows_l
    }

    fn collect(&self, system: &dyn CollocationSystem, step: &SolvedStep<'_>, curve: &mut Curve) {
        curve.of_accelerations(system, step, &self.table, self.vectors.solved());
    }

    #[cfg(test)]
    fn set_instructions(&mut self, arch: Instructions) {
        self.arch = arch;
    }
}
