//! The steps of a contact Hamiltonian as a route.

use crate::StepError;
use crate::gauss::dense::{Solved, SolvedStep, StepStart};
use crate::gauss::resolution::defect_sample::Curve;
use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::hamiltonian::newton::SimplifiedNewton;
use crate::gauss::routes::{RouteState, StageRoute, set_compensation};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::gauss::work_summary::GaussRoute;
use crate::numbers::array::from_fn;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::{load_option, save_option, saved};
use contact_geom::Lagrangian;
use contact_geom::nalgebra::SVector;
use pulp::Simd;

impl<L: Lagrangian<N>, const N: usize> HamiltonianStages<'_, L, N> {
    /// Divides stage values by the weights, and pads them with 0.
    fn unweighted(&self, x: &Stages) -> [f64; MAX_STAGES] {
        from_fn(|i| if i < self.table.s { x.0[i] / self.table.weights.0[i] } else { 0.0 })
    }

    /// The stages of the last step.
    fn solution(&self) -> Solved<N> {
        Solved {
            v: self.moved.each_ref().map(|x| self.unweighted(x)),
            force: self.force.each_ref().map(|x| self.unweighted(x)),
            rate: self.unweighted(&self.rate),
            l: self.unweighted(&self.l),
        }
    }
}

impl<L: Lagrangian<N>, const N: usize> StageRoute<N> for HamiltonianStages<'_, L, N> {
    fn route(&self) -> GaussRoute {
        GaussRoute::Hamiltonian
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
        Some(SVector::from(self.known))
    }

    fn reserve_newton(&mut self) {
        self.reserve();
    }

    fn linearise_at_state(&mut self, t: f64) -> bool {
        let x = self.phase_point();
        self.linearise(t, &x)
    }

    fn suspend_newton(&mut self) {
        self.suspended_newton = self.newton.take();
    }

    fn solve_stages(&mut self, t: f64) -> Result<(), StepError> {
        self.solve(t)
    }

    fn solved(&self, _step: &SolvedStep<'_, N>) -> Solved<N> {
        self.solution()
    }

    #[inline(always)]
    fn collect<S: Simd>(&self, _step: &SolvedStep<'_, N>, curve: &mut Curve<N>) {
        curve.of_solved(&self.solution());
    }
}

saved!([L, const N: usize] HamiltonianStages<'_, L, N> {
    moved, force, l, rate, pp, pp_age, v, x, p_stages, z_stages, one_minus_rho_stages, q, p, z, one_minus_rho, warm, solved, age,
    defect, known, evaluations,
} and save_newton, load_newton);

impl<L, const N: usize> HamiltonianStages<'_, L, N> {
    fn save_newton(&self, to: &mut Vec<u64>) {
        save_option(self.newton.as_deref(), to);
    }

    fn load_newton(&mut self, from: &mut &[u64]) -> Option<()> {
        self.newton = load_option(from, || SimplifiedNewton::new(&self.table, 2 * N + 2))?.map(Box::new);
        Some(())
    }
}
