//! The systems with the same number of coordinates as one type, for which runs are compiled once, and runs of them.

use crate::common::observers::Each;
use contact_examples::systems::hamiltonian::{
    Bregman, ContactThermostat, Containers, HeatedOscillator, NoseHoover, NosePoincare, Piston, Quartic, Ray,
    RelativisticDescent, SpinOrbit, TimeOfEnergy,
};
use contact_examples::systems::{LaneEmden, System, VanDerPol};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    AtEnergy, ChartVector, ContactHamiltonian, HamiltonianStructure, InTransformedTime, Lifted, OfHamiltonian,
    PhasePoint, Scalar,
};
use discrete_herglotz::{GaussCollocation, Outcome, Problem, Status, StepView, Steps, Until};

/// An enum of Hamiltonians that is one.
macro_rules! one_type {
    ($(#[$doc:meta])* $name:ident<$n:literal> { $($variant:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub enum $name { $($variant($type),)* }

        $(impl From<$type> for $name {
            fn from(of: $type) -> Self { $name::$variant(of) }
        })*

        impl ContactHamiltonian<$n> for $name {
            #[inline(never)]
            fn value<T: Scalar>(&self, t: T, q: &SVector<T, $n>, p: &SVector<T, $n>, z: T) -> T {
                match self { $($name::$variant(of) => of.value(t, q, p, z),)* }
            }
            fn structure(&self) -> HamiltonianStructure {
                match self { $($name::$variant(of) => ContactHamiltonian::<$n>::structure(of),)* }
            }
            #[inline(never)]
            fn closed_with_gradient<T: Scalar>(
                &self,
                t: T,
                x: &PhasePoint<$n, T>,
            ) -> Option<(T, ChartVector<$n, T>)> {
                match self { $($name::$variant(of) => of.closed_with_gradient(t, x),)* }
            }
        }
    };
}

one_type! {
    /// One coordinate.
    One<1> {
        VanDerPol: VanDerPol,
        Heat: AtEnergy<HeatedOscillator>,
        Piston: AtEnergy<Piston>,
        Thermostat: ContactThermostat<HeatedOscillator>,
        SpinOrbit: SpinOrbit,
        LaneEmden: OfSystem,
        Polytrope: Polytrope,
    }
}

one_type! {
    /// Two coordinates.
    Two<2> {
        VanDerPol: Lifted<VanDerPol>,
        Ray: Ray<2>,
        Bregman: Bregman<Quartic>,
        Descent: RelativisticDescent<Quartic>,
        NosePoincare: NosePoincare<HeatedOscillator, 1>,
        NoseHoover: NoseHoover<HeatedOscillator, 1>,
        Thermostat: InTransformedTime<ContactThermostat<HeatedOscillator>, TimeOfEnergy<HeatedOscillator>, 1>,
        Transformed: InTransformedTime<AtEnergy<HeatedOscillator>, HeatedOscillator, 1>,
    }
}

/// Four coordinates.
pub type Four = Lifted<Containers>;

/// The Hamiltonian of Lane-Emden's equation of the catalogue.
#[derive(Clone, Copy)]
pub struct OfSystem(pub LaneEmden);

impl ContactHamiltonian<1> for OfSystem {
    #[inline(never)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        self.0.hamiltonian(t, &PhasePoint { q: *q, p: *p, z }).unwrap_or_else(|| T::from(f64::NAN))
    }
}

/// Lane-Emden's equation of any index n, `H = p^2/2 + |q|^(n + 1)/(n + 1) + 2 z/t`.
#[derive(Clone, Copy)]
pub struct Polytrope(pub f64);

impl ContactHamiltonian<1> for Polytrope {
    #[inline(never)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        p[0] * p[0] * 0.5 + q[0].abs().powf(self.0 + 1.0) / (self.0 + 1.0) + z / t * 2.0
    }
}

/// A run of Gauss collocation with steps of one size, which calls a function at the start of the run and after each step
/// with the time, the state and the logarithm of the conformal factor.
pub fn run<H: ContactHamiltonian<N>, const N: usize>(
    hamiltonian: H,
    (t0, start): (f64, PhasePoint<N>),
    (stages, h): (usize, f64),
    end: f64,
    mut see: impl FnMut(f64, &PhasePoint<N>, f64),
) -> Outcome {
    let of = OfHamiltonian(hamiltonian);
    let problem = Problem::of_hamiltonian(&of, t0, start).unwrap();
    see(t0, &start, 0.0);
    let mut log_factor = 0.0;
    let mut observer = Each(|at: &StepView<'_>| {
        log_factor += at.sigma.ln();
        see(at.t, &at.state.fixed(), log_factor);
    });
    let run = problem.by(GaussCollocation { stages }).steps(Steps::Size(h)).observe(&mut observer);
    run.run(Until::Time(end)).unwrap()
}

/// The final state of a run that reaches its end.
pub fn end<H: ContactHamiltonian<N>, const N: usize>(
    hamiltonian: H,
    start: (f64, PhasePoint<N>),
    method: (usize, f64),
    end: f64,
) -> PhasePoint<N> {
    let outcome = run(hamiltonian, start, method, end, |_, _, _| ());
    assert_eq!(outcome.status, Status::Completed, "{outcome:?}");
    outcome.state().fixed()
}

/// The slope of the line of least squares through `(ln h, ln error)`.
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0.ln()), mean(&|p| p.1.ln()));
    mean(&|p| (p.0.ln() - x) * (p.1.ln() - y)) / mean(&|p| (p.0.ln() - x).powi(2))
}
