//! A random system with a random start.

use super::random_numbers::RandomNumbers;
use super::system::RandomSystem;
use contact_geom::VelocityPoint;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::{AnyIntegrator, InputError, Until};

/// The integrators that may apply: random systems have no time transformation.
pub fn integrators() -> Vec<AnyIntegrator> {
    AnyIntegrator::all()
        .into_iter()
        .filter(|integrator| !matches!(integrator, AnyIntegrator::TransformedGauss { .. }))
        .collect()
}

/// A system with the initial time, the start and the span of a motion.
#[derive(Clone, Debug)]
pub struct Problem<const N: usize> {
    pub system: RandomSystem<N>,
    pub t0: f64,
    pub start: VelocityPoint<N>,
    pub span: f64,
    /// The factor by which the motion may be faster than others, since it starts so far away, where a quartic well is
    /// steeper by this factor.
    pub pace: f64,
}

impl<const N: usize> Problem<N> {
    pub fn draw(random: &mut RandomNumbers) -> Self {
        let system = RandomSystem::draw(random);
        let t0 = match random.below(20) {
            0 => random.scale(1e3, 1e9),
            1..5 => random.between(-10.0, 10.0),
            _ => 0.0,
        };
        let reach = match random.below(40) {
            0 => random.scale(1e-300, 1e-6),
            1 => random.scale(10.0, 1e6),
            _ => 1.0,
        };
        let mut vector = |still: f64| {
            let rests = random.chance(still);
            SVector::from_fn(|_, _| if rests { 0.0 } else { reach * random.between(-2.0, 2.0) })
        };
        let (q, v) = (vector(0.05), vector(0.15));
        let z = if random.chance(0.3) { 0.0 } else { reach * random.between(-1.0, 1.0) };
        let span = random.scale(0.05, 20.0);
        Problem { system, t0, start: VelocityPoint { q, v, z }, span, pace: if reach > 1.0 { reach } else { 1.0 } }
    }

    /// The problem as a type of the library.
    pub fn posed(&self) -> Result<discrete_herglotz::Problem<'_, RandomSystem<N>, N>, InputError> {
        discrete_herglotz::Problem::new(&self.system, self.t0, self.start)
    }

    /// The end of the span.
    pub fn until(&self) -> Until {
        Until::Time(self.t0 + self.span)
    }
}
