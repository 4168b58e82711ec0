//! Kernels of contact Hamiltonians: the part of a kernel that they need, for two dimensions, so that they take little
//! time to compile.

use super::sized::{Sized, coordinates};
use super::work_thread::on_large_stack;
use super::{Differentiated, ENSEMBLES, Kernel, check, ensemble, run, sensitivity};
use crate::full::{FULL, not_compiled};
use crate::kernel::formula_system::{FormulaSystem, Observed};
use crate::{
    Check, Ensemble, EnsembleMonitor, FormulaSymmetry, HamiltonianGeometry, InitialVelocity, Loss, LossGradient,
    LyapunovExponents, Motion, Outcome, Plan, RunMonitor, RuntimeError, Sensitivity, Start,
};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{
    ContactHamiltonian, HamiltonianDerivatives, HamiltonianStructure, Lagrangian, OfHamiltonian, PhasePoint,
    Regularity, Structure,
};
use discrete_herglotz::hamiltonian::ModifiedDefect;
use discrete_herglotz::{AnyIntegrator, InputError, Integrator, ResumeState, ensemble::Tally};
use formula_lagrangian::{Formula, FormulaError, FormulaHamiltonian};
use std::sync::Arc;

/// A Hamiltonian in the place of a Lagrangian.
type Hamiltonian<const N: usize> = OfHamiltonian<FormulaHamiltonian<N>>;

/// The largest number of coordinates of a Hamiltonian that is compiled.
const MOST: usize = 4;

/// The kernel of a Hamiltonian.
pub(super) fn kernel_of(formula: &Formula) -> Result<Arc<dyn Kernel>, RuntimeError> {
    fn of<const N: usize>(formula: &Formula) -> Result<Arc<dyn Kernel>, RuntimeError> {
        Ok(Arc::new(Sized(OfHamiltonian(formula.hamiltonian_within::<N>()?))))
    }
    match formula.dimension() {
        1..=2 => of::<2>(formula),
        3..=MOST => of::<MOST>(formula),
        found => Err(RuntimeError::HamiltonianDimension { found, most: MOST }),
    }
}

impl<const N: usize> Sized<Hamiltonian<N>, N> {
    /// The system with as many coordinates as any: derivatives are compiled for these alone.
    fn differentiable(&self) -> Result<Sized<Hamiltonian<MOST>, MOST>, RuntimeError> {
        Ok(Sized(OfHamiltonian(self.0.formula().hamiltonian_within::<MOST>()?)))
    }
}

impl<const N: usize> Kernel for Sized<Hamiltonian<N>, N> {
    fn formula(&self) -> &Formula {
        self.0.formula()
    }

    fn structure(&self) -> Structure {
        Lagrangian::structure(&self.0)
    }

    fn hamiltonian_structure(&self) -> Option<HamiltonianStructure> {
        Some(self.0.hamiltonian().structure())
    }

    fn is_smooth(&self) -> bool {
        self.0.hamiltonian().is_smooth()
    }

    fn has_force(&self) -> bool {
        false
    }

    fn symmetries(&self) -> Vec<FormulaSymmetry> {
        self.0.hamiltonian().cyclic().into_iter().map(|i| FormulaSymmetry::Translation(vec![i])).collect()
    }

    fn with_parameters(&self, values: &[(&str, f64)]) -> Result<Arc<dyn Kernel>, FormulaError> {
        let mut hamiltonian = self.0.clone();
        values.iter().try_for_each(|(name, value)| FormulaSystem::set(&mut hamiltonian, name, *value))?;
        Ok(Arc::new(Sized(hamiltonian)))
    }

    fn check_integrator(&self, integrator: AnyIntegrator) -> Result<(), InputError> {
        Hamiltonian::<N>::by(integrator)?.check(&self.0)
    }

    fn plan(&self, motion: &Motion) -> Result<Plan, RuntimeError> {
        run::plan(self, motion)
    }

    fn run(
        &self,
        motion: &Motion,
        monitor: &mut dyn RunMonitor,
        from: Option<ResumeState>,
    ) -> Result<Outcome, RuntimeError> {
        run::run(self, motion, monitor, from)
    }

    fn ensemble(&self, ensemble: &Ensemble<'_>, monitor: &mut dyn EnsembleMonitor) -> Result<Tally, RuntimeError> {
        if const { FULL } { ensemble::run(self, ensemble, monitor) } else { Err(not_compiled(ENSEMBLES)) }
    }

    fn sensitivity(
        &self,
        motion: &Motion,
        of: Differentiated<'_>,
        monitor: &mut dyn RunMonitor,
    ) -> Result<Sensitivity, RuntimeError> {
        sensitivity::tangent(&self.differentiable()?, motion, of, monitor)
    }

    fn gradient(
        &self,
        motion: &Motion,
        times: &[f64],
        loss: &mut Loss<'_>,
        monitor: &mut dyn RunMonitor,
    ) -> Result<LossGradient, RuntimeError> {
        sensitivity::gradient(&self.differentiable()?, motion, times, loss, monitor)
    }

    fn lyapunov_exponents(
        &self,
        motion: &Motion,
        monitor: &mut dyn RunMonitor,
    ) -> Result<LyapunovExponents, RuntimeError> {
        sensitivity::lyapunov_exponents(&self.differentiable()?, motion, monitor)
    }

    /// The contact Hamiltonian vector field at `y = (q, p, z)`.
    fn rates(&self, t: f64, y: &[f64], to: &mut [f64]) {
        let n = self.0.formula().dimension();
        let part = |first: usize| {
            SVector::<f64, N>::from_fn(|i, _| if i < n { y.get(first + i).copied().unwrap_or(f64::NAN) } else { 0.0 })
        };
        let state = PhasePoint { q: part(0), p: part(n), z: y.get(2 * n).copied().unwrap_or(f64::NAN) };
        let field = self.0.hamiltonian().contact_field(t, &state);
        let all = coordinates(field.x.as_slice(), n).iter().chain(coordinates(field.y.as_slice(), n)).chain([&field.z]);
        to.iter_mut().zip(all).for_each(|(to, from)| *to = *from);
    }

    /// The geometry at a momentum, or at a velocity that has one.
    fn hamiltonian_geometry(&self, at: &Start) -> Result<HamiltonianGeometry, RuntimeError> {
        let (n, t, h) = (self.0.formula().dimension(), at.t, self.0.hamiltonian());
        let state = match &at.velocity {
            InitialVelocity::Velocity(_) => *self.problem(at)?.state(),
            InitialVelocity::Momentum(p) | InitialVelocity::MomentumNear { p, .. } => {
                PhasePoint { q: self.vector("q", &at.q)?, p: self.vector("p", p)?, z: at.z }
            }
        };
        let ((value, d), second, field) =
            (h.with_gradient(t, &state), h.hessian(t, &state).vv, h.contact_field(t, &state));
        if !(value.is_finite() && d.is_finite()) {
            return Err(RuntimeError::HamiltonianUndefined);
        }
        let all = |x: &SVector<f64, N>, y: &SVector<f64, N>, z: f64| {
            [coordinates(x.as_slice(), n), coordinates(y.as_slice(), n), &[z]].concat()
        };
        let still = SVector::zeros();
        let square = DMatrix::from_fn(n, n, |i, j| second[(i, j)]);
        Ok(HamiltonianGeometry {
            hamiltonian: value,
            velocity: coordinates(d.y.as_slice(), n).to_vec(),
            rate: if d.z == 0.0 { 0.0 } else { -d.z },
            condition: Regularity::of(square.clone()).condition(),
            hessian: square.row_iter().map(|row| row.iter().copied().collect()).collect(),
            eta: all(&-state.p, &still, 1.0),
            reeb: all(&still, &still, 1.0),
            field: all(&field.x, &field.y, field.z),
            // Cartan's formula with eta(X_H) = -H: i_X d eta - dH, where i_X d eta = q' dp - p' dq.
            lie_derivative: all(&(-field.y - d.x), &(field.x - d.y), -d.z),
            // {H, f} = X_H(f) + f H_z, for f = q, p, z.
            brackets: all(&(field.x + state.q * d.z), &(field.y + state.p * d.z), field.z + state.z * d.z),
        })
    }

    fn check(&self, motion: &Motion, samples: usize) -> Result<Check, RuntimeError> {
        on_large_stack(|| check::of_steps(self, motion, samples))
    }

    fn modified_defects(&self, motion: &Motion, most: usize) -> Result<Vec<ModifiedDefect>, RuntimeError> {
        check::modified_defects(self, motion, most)
    }
}
