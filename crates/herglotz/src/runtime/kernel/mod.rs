//! One kernel for each dimension: all code that is compiled for a fixed number of coordinates is in this module.

mod check;
mod ensemble;
mod geometry;
mod observed;
pub(crate) mod path;
mod recorder;
mod run;
mod theorems;

use crate::runtime::{
    Check, Ensemble, EnsembleMonitor, Geometry, InitialVelocity, Motion, Outcome, Plan, RunMonitor, RuntimeError,
    SeenSymmetry, Start,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, Structure, Symmetry, VelocityPoint};
use discrete_herglotz::{AnyIntegrator, InputError, Problem, ResumeState, StepError, ensemble::Tally};
use formula_lagrangian::{Formula, FormulaError, FormulaLagrangian};
use std::sync::Arc;

/// A system whose dimension is not part of its type.
pub(crate) trait Kernel: Send + Sync {
    fn formula(&self) -> &Formula;
    fn structure(&self) -> Structure;
    fn is_smooth(&self) -> bool;
    fn symmetries(&self) -> Vec<SeenSymmetry>;
    fn to_rust(&self, name: &str) -> Result<String, FormulaError>;
    fn with_parameters(&self, values: &[(&str, f64)]) -> Result<Arc<dyn Kernel>, FormulaError>;
    fn check_integrator(&self, integrator: AnyIntegrator) -> Result<(), InputError>;
    fn plan(&self, motion: &Motion) -> Result<Plan, RuntimeError>;
    fn run(
        &self,
        motion: &Motion,
        watch: &mut dyn RunMonitor,
        from: Option<ResumeState>,
    ) -> Result<Outcome, RuntimeError>;
    fn ensemble(&self, ensemble: &Ensemble<'_>, watch: &mut dyn EnsembleMonitor) -> Result<Tally, RuntimeError>;
    fn rates(&self, t: f64, y: &[f64], to: &mut [f64]);
    fn geometry(&self, at: &Start) -> Result<Geometry, RuntimeError>;
    fn check(&self, motion: &Motion, places: usize) -> Result<Check, RuntimeError>;
}

/// The kernel of a formula.
pub(crate) fn kernel_of(formula: &Formula) -> Result<Arc<dyn Kernel>, FormulaError> {
    macro_rules! of {
        ($($n:literal)*) => {
            match formula.dimension() {
                $(found if found <= $n => Ok(Arc::new(Sized(formula.lagrangian_within::<$n>()?)) as Arc<dyn Kernel>),)*
                found => Err(FormulaError::Dimension { found }),
            }
        };
    }
    // Each dimension is half a minute of compiling: a system of five coordinates is computed with one more at rest.
    of!(1 2 3 4 6 8 16)
}

/// A system compiled for N coordinates, at least as many as its formula has. The additional coordinates are at rest and
/// are not visible from outside.
struct Sized<const N: usize>(FormulaLagrangian<N>);

/// The first n coordinates of a vector.
fn coordinates<const N: usize>(x: &SVector<f64, N>, n: usize) -> &[f64] {
    x.as_slice().get(..n).unwrap_or(&[])
}

impl<const N: usize> Sized<N> {
    /// A vector with one finite number per coordinate.
    fn vector(&self, what: &'static str, numbers: &[f64]) -> Result<SVector<f64, N>, RuntimeError> {
        let expected = self.formula().dimension();
        if numbers.len() != expected {
            return Err(RuntimeError::Length { what, found: numbers.len(), expected });
        }
        match numbers.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            Some((i, value)) => Err(RuntimeError::NotFinite { what: format!("{what}[{i}]"), value: *value }),
            None => Ok(SVector::from_fn(|i, _| numbers.get(i).copied().unwrap_or(0.0))),
        }
    }

    fn start(&self, start: &Start) -> Result<discrete_herglotz::Start<N>, RuntimeError> {
        for (what, value) in [("t", start.t), ("z", start.z)] {
            if !value.is_finite() {
                return Err(RuntimeError::NotFinite { what: what.into(), value });
            }
        }
        let q = self.vector("q", &start.q)?;
        Ok(match &start.rate {
            InitialVelocity::Velocity(v) => VelocityPoint { q, v: self.vector("v", v)?, z: start.z }.into(),
            InitialVelocity::MomentumNear { p, v } => discrete_herglotz::Start::Momentum(
                PhasePoint { q, p: self.vector("p", p)?, z: start.z },
                self.vector("v", v)?,
            ),
            InitialVelocity::Momentum(p) => PhasePoint { q, p: self.vector("p", p)?, z: start.z }.into(),
        })
    }

    /// The problem of a start, validated.
    fn problem(&self, start: &Start) -> Result<Problem<'_, FormulaLagrangian<N>, N>, RuntimeError> {
        let at = self.start(start)?;
        Problem::new(&self.0, start.t, at).map_err(|error| self.explained(error, start.t, &at))
    }

    /// The problem of a motion, with the interrupt of the motion for its trial runs.
    fn problem_of<'m>(&'m self, motion: &'m Motion) -> Result<Problem<'m, FormulaLagrangian<N>, N>, RuntimeError> {
        let problem = self.problem(&motion.start)?;
        Ok(match &motion.interrupt {
            Some(interrupt) => problem.with_interrupt(interrupt.asked()),
            None => problem,
        })
    }

    /// Replaces the error of a singular start by one that names the velocities in which L is linear, if there are any.
    fn explained(&self, error: InputError, t: f64, at: &discrete_herglotz::Start<N>) -> RuntimeError {
        if let (InputError::FirstStep(StepError::Singular { .. }), discrete_herglotz::Start::Velocity(x)) = (&error, at)
        {
            let w = self.0.closed_hessian(t, x).map(|h| h.vv);
            let names = self.formula().coordinates();
            let flat = |i: &usize| w.is_some_and(|w| w.row(*i).iter().all(|e| *e == 0.0));
            let flat: Vec<String> =
                (0..names.len()).filter(flat).map(|i| crate::runtime::velocity_name(&names[i])).collect();
            if !flat.is_empty() {
                return RuntimeError::NotRegular { velocities: flat.join(", ") };
            }
        }
        error.into()
    }
}

impl<const N: usize> Kernel for Sized<N> {
    fn formula(&self) -> &Formula {
        self.0.formula()
    }

    fn structure(&self) -> Structure {
        *self.0.proved()
    }

    fn is_smooth(&self) -> bool {
        self.0.is_smooth()
    }

    fn symmetries(&self) -> Vec<SeenSymmetry> {
        let seen = |symmetry: &Symmetry<N>| match symmetry {
            Symmetry::Translation(a) => Some(SeenSymmetry::Translation((0..N).filter(|i| a[*i] != 0.0).collect())),
            Symmetry::Rotation(i, j) => Some(SeenSymmetry::Rotation(vec![(*i, *j)])),
            Symmetry::Rotations(planes) => {
                Some(SeenSymmetry::Rotation(planes.iter().enumerate().filter_map(|(i, j)| j.map(|j| (i, j))).collect()))
            }
            _ => None,
        };
        self.0.symmetries().iter().filter_map(seen).collect()
    }

    fn to_rust(&self, name: &str) -> Result<String, FormulaError> {
        self.0.to_rust(name)
    }

    fn with_parameters(&self, values: &[(&str, f64)]) -> Result<Arc<dyn Kernel>, FormulaError> {
        let mut lagrangian = self.0.clone();
        values.iter().try_for_each(|(name, value)| lagrangian.set(name, *value))?;
        Ok(Arc::new(Sized(lagrangian)))
    }

    fn check_integrator(&self, integrator: AnyIntegrator) -> Result<(), InputError> {
        integrator.check(&self.0)
    }

    fn plan(&self, motion: &Motion) -> Result<Plan, RuntimeError> {
        run::plan(self, motion)
    }

    fn run(
        &self,
        motion: &Motion,
        watch: &mut dyn RunMonitor,
        from: Option<ResumeState>,
    ) -> Result<Outcome, RuntimeError> {
        run::run(self, motion, watch, from)
    }

    fn ensemble(&self, ensemble: &Ensemble<'_>, watch: &mut dyn EnsembleMonitor) -> Result<Tally, RuntimeError> {
        ensemble::run(self, ensemble, watch)
    }

    fn rates(&self, t: f64, y: &[f64], to: &mut [f64]) {
        geometry::rates(self, t, y, to);
    }

    fn geometry(&self, at: &Start) -> Result<Geometry, RuntimeError> {
        geometry::at(self, at)
    }

    fn check(&self, motion: &Motion, places: usize) -> Result<Check, RuntimeError> {
        with_room(|| check::check(self, motion, places))
    }
}

/// Stack size for computations with third derivatives: in 16 coordinates a number that carries them takes 300 kB.
const ROOM: usize = 1 << 26;

/// Runs a closure on a thread with a large stack, whatever the stack of the caller.
fn with_room<R: Send>(work: impl FnOnce() -> Result<R, RuntimeError> + Send) -> Result<R, RuntimeError> {
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new().stack_size(ROOM).spawn_scoped(scope, work)?;
        worker.join().unwrap_or_else(|panicked| std::panic::resume_unwind(panicked))
    })
}
