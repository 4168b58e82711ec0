//! The steps of a contact Hamiltonian as a route.

use crate::StepError;
use crate::gauss::curve::Curve;
use crate::gauss::dense::{Solved, SolvedStep};
use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::routes::hamiltonian::simplified_newton::SimplifiedNewton;
use crate::gauss::routes::{RouteState, RouteStateMut, StageRoute};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::system::CollocationSystem;
use crate::gauss::work_summary::GaussRoute;
#[cfg(test)]
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::{Saved, load_option, save_option};

impl HamiltonianStages {
    /// Copies the right-hand sides of the last step.
    fn copy_stages(&self, [v, force]: [&mut [Stages]; 2], [rate, l]: [&mut Stages; 2]) {
        let unweighted = |x: &Stages| Solved::unweighted(x, &self.table.weights, self.table.s);
        for (to, x) in v.iter_mut().zip(self.rows.moved()).chain(force.iter_mut().zip(self.rows.force())) {
            *to = unweighted(x);
        }
        (*rate, *l) = (unweighted(self.rows.rate()), unweighted(self.rows.l()));
    }
}

impl StageRoute for HamiltonianStages {
    fn route(&self) -> GaussRoute {
        GaussRoute::Hamiltonian
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
        self.take_step(system, t)
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

    fn last_velocity(&self) -> Option<&[f64]> {
        Some(&self.known)
    }

    fn reserve_newton(&mut self, _system: &dyn CollocationSystem) {
        self.reserve();
    }

    fn linearise_at_state(&mut self, system: &dyn CollocationSystem, t: f64) -> bool {
        self.linearise_at(system, t)
    }

    fn suspend_newton(&mut self) {
        if let Some(newton) = self.newton.take() {
            self.suspended_newton = Some(newton);
        }
    }

    fn solve_stages(&mut self, system: &dyn CollocationSystem, t: f64) -> Result<(), StepError> {
        self.solve(system, t)
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
}

impl Saved for HamiltonianStages {
    fn save(&self, to: &mut Vec<u64>) {
        self.rows.right_hand_sides().save(to);
        self.pp.save(to);
        self.pp_age.save(to);
        self.rows.stages().save(to);
        self.q.save(to);
        self.p.save(to);
        self.z.save(to);
        self.one_minus_rho.save(to);
        self.warm.save(to);
        self.solved.save(to);
        self.age.save(to);
        self.defect.save(to);
        self.known.save(to);
        self.evaluations.save(to);
        save_option(self.newton.as_deref(), to);
    }

    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.rows.right_hand_sides_mut().load(from)?;
        self.pp.load(from)?;
        self.pp_age.load(from)?;
        self.rows.stages_mut().load(from)?;
        self.q.load(from)?;
        self.p.load(from)?;
        self.z.load(from)?;
        self.one_minus_rho.load(from)?;
        self.warm.load(from)?;
        self.solved.load(from)?;
        self.age.load(from)?;
        self.defect.load(from)?;
        self.known.load(from)?;
        self.evaluations.load(from)?;
        let components = self.components();
        self.newton = load_option(from, || SimplifiedNewton::new(&self.table, components))?.map(Box::new);
        Some(())
    }
}
