//! The general step as a route in physical time.

use crate::gauss::dense::{Solved, SolvedStep, StepStart};
use crate::gauss::resolution::defect_sample::Curve;
use crate::gauss::routes::general::General;
use crate::gauss::routes::{RouteState, StageRoute, set_compensation};
use crate::gauss::stages::equations::{Given, Products, StageEquations, Workspace};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::stages::parametrization::Physical;
use crate::gauss::work_summary::GaussRoute;
use crate::numbers::compensated::values;
use crate::{StepError, theory::legendre_inverse};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, VelocityPoint};
use pulp::Simd;

impl<L: Lagrangian<N>, const N: usize> General<'_, L, Physical, N> {
    fn phase_point(&self) -> PhasePoint<N> {
        PhasePoint { q: values(&self.q).into(), p: values(&self.p).into(), z: self.z.value }
    }
}

impl<L: Lagrangian<N>, const N: usize> StageRoute<N> for General<'_, L, Physical, N> {
    fn route(&self) -> GaussRoute {
        if let Mass::Constant(_) = self.mass { GaussRoute::ConstantMass } else { GaussRoute::General }
    }

    #[inline(always)]
    fn state(&self) -> RouteState<'_, N> {
        RouteState { q: &self.q, y: &self.p, z: self.z }
    }

    fn set_compensation(&mut self, terms: &StepStart<N>) {
        set_compensation((&mut self.q, &mut self.p, &mut self.z), terms);
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
        1.0 / (1.0 - self.one_minus_rho)
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn last_velocity(&self) -> Option<SVector<f64, N>> {
        Some(General::last_velocity(self))
    }

    fn predict_stages(&mut self, stages: impl Iterator<Item = (SVector<f64, N>, f64, f64)>) {
        self.predict(stages);
    }

    fn reserve_newton(&mut self) {
        if self.by_newton.is_none() {
            let products = Products::new(self.table.s, self.table.h);
            let equations = StageEquations { lagrangian: self.lagrangian, products: &products, t: 0.0 };
            let work = equations.workspace(&Given::Start(self.phase_point()));
            self.by_newton = Some(Box::new((products, work)));
        }
    }

    fn linearise_at_state(&mut self, t: f64) -> bool {
        let near = General::last_velocity(self);
        let Ok(x) = legendre_inverse(self.lagrangian, t, &self.phase_point(), &near) else { return false };
        self.guess(&x.v);
        self.linearise(t, &x)
    }

    fn suspend_newton(&mut self) {
        self.suspended_newton = self.newton.take();
    }

    /// The initial guess is a motion of constant velocity.
    fn solve_stages(&mut self, t: f64) -> Result<(), StepError> {
        StageRoute::reserve_newton(self);
        let (from, near) = (self.phase_point(), General::last_velocity(self));
        let Some(mut by_newton) = self.by_newton.take() else { return Ok(()) };
        let (products, work) = &mut *by_newton;
        let equations = StageEquations { lagrangian: self.lagrangian, products, t };
        let solved = legendre_inverse(self.lagrangian, t, &from, &near)
            .and_then(|VelocityPoint { v, .. }| equations.solve(&Given::Start(from), &v, &from.p, work));
        if solved.is_ok() {
            let Workspace { x, l, .. } = &*work;
            self.accept((0..products.s).map(|i| (x.v[i], l[i].l.re, x.rho[i])));
        }
        self.by_newton = Some(by_newton);
        solved.map(|_| ())
    }

    fn solved(&self, _step: &SolvedStep<'_, N>) -> Solved<N> {
        General::solved(self)
    }

    #[inline(always)]
    fn collect<S: Simd>(&self, _step: &SolvedStep<'_, N>, curve: &mut Curve<N>) {
        curve.of_solved(&General::solved(self));
    }
}
