//! The condensed step as a route.

use crate::StepError;
use crate::gauss::dense::{Solved, SolvedStep, StepStart};
use crate::gauss::resolution::defect_sample::Curve;
use crate::gauss::routes::separable::SeparableStages;
use crate::gauss::routes::{RouteState, StageRoute, set_compensation};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::position_newton::{At, PositionNewton};
use crate::gauss::work_summary::GaussRoute;
use crate::numbers::compensated::values;
use crate::numbers::registers::Stages;
use contact_geom::Lagrangian;
use contact_geom::nalgebra::SVector;
use pulp::Simd;

impl<L: Lagrangian<N>, const N: usize> StageRoute<N> for SeparableStages<'_, L, N> {
    fn route(&self) -> GaussRoute {
        GaussRoute::Condensed
    }

    #[inline(always)]
    fn state(&self) -> RouteState<'_, N> {
        RouteState { q: &self.q, y: &self.v, z: self.z }
    }

    fn set_compensation(&mut self, terms: &StepStart<N>) {
        set_compensation((&mut self.q, &mut self.v, &mut self.z), terms);
    }

    #[inline(always)]
    fn step<S: Simd>(&mut self, t: f64) -> IterationOutcome {
        self.take_step::<S>(t)
    }

    #[inline(always)]
    fn defect(&self) -> f64 {
        self.defect
    }

    fn sigma(&self) -> f64 {
        1.0 + self.table.grow.head
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn reserve_newton(&mut self) {
        self.positions.get_or_insert_with(|| Box::new(PositionNewton::new(self.table.s)));
    }

    fn linearise_at_state(&mut self, t: f64) -> bool {
        self.forget();
        self.linearise(t, values(&self.q).into())
    }

    fn suspend_newton(&mut self) {
        self.suspended_newton = self.newton.take();
        self.update_matrix();
    }

    /// The initial guess uses the forces of the step before, if they are known; otherwise it is a motion without forces.
    fn solve_stages(&mut self, t: f64) -> Result<(), StepError> {
        let positions = self.positions.get_or_insert_with(|| Box::new(PositionNewton::new(self.table.s)));
        let (q, v) = (SVector::from(values(&self.q)), SVector::from(values(&self.v)));
        let inverse_mass = self.inverse_mass.as_deref();
        positions.solve(&At { lagrangian: self.lagrangian, table: &self.table, inverse_mass, t, q, v })?;
        self.rest = [Stages::ZERO; N];
        for (i, (a, q)) in positions.stages().enumerate() {
            for d in 0..N {
                // The last stage is repeated in the padding.
                self.rest[d].0[i..].fill(a[d] + self.left.kappa * q[d]);
            }
        }
        self.solved = true;
        Ok(())
    }

    fn solved(&self, step: &SolvedStep<'_, N>) -> Solved<N> {
        Solved::from_accelerations(
            self.lagrangian,
            step,
            &self.table,
            [&self.a.map(|a| a.0), &self.x.map(|x| x.0)],
            self.wants_z,
        )
    }

    fn solved_without_action(&self, step: &SolvedStep<'_, N>) -> Option<Solved<N>> {
        let stages = [&self.a.map(|a| a.0), &self.x.map(|x| x.0)];
        Some(Solved::from_accelerations(self.lagrangian, step, &self.table, stages, false))
    }

    #[inline(always)]
    fn collect<S: Simd>(&self, step: &SolvedStep<'_, N>, curve: &mut Curve<N>) {
        curve.of_accelerations::<S, L>(self.lagrangian, step, &self.table, [&self.a, &self.x]);
    }
}
