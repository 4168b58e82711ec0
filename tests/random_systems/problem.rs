//! A random system with a random start.

use super::dice::Dice;
use super::system::RandomSystem;
use contact_geom::VelocityPoint;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::{AnyIntegrator, InputError, Until};

/// The integrators that may apply: random systems state no clock.
pub fn integrators() -> Vec<AnyIntegrator> {
    AnyIntegrator::all()
        .into_iter()
        .filter(|integrator| !matches!(integrator, AnyIntegrator::TransformedGauss { .. }))
        .collect()
}

/// A system with the time, the place and the span of a motion.
#[derive(Clone, Debug)]
pub struct Problem<const N: usize> {
    pub system: RandomSystem<N>,
    pub t0: f64,
    pub start: VelocityPoint<N>,
    pub span: f64,
    /// How much faster than others the motion may be, for it starts so far away, where a quartic well is as many times steeper.
    pub pace: f64,
}

impl<const N: usize> Problem<N> {
    pub fn draw(dice: &mut Dice) -> Self {
        let system = RandomSystem::draw(dice);
        let t0 = match dice.below(20) {
            0 => dice.scale(1e3, 1e9),
            1..5 => dice.between(-10.0, 10.0),
            _ => 0.0,
        };
        let reach = match dice.below(40) {
            0 => dice.scale(1e-300, 1e-6),
            1 => dice.scale(10.0, 1e6),
            _ => 1.0,
        };
        let mut vector = |still: f64| {
            let rests = dice.chance(still);
            SVector::from_fn(|_, _| if rests { 0.0 } else { reach * dice.between(-2.0, 2.0) })
        };
        let (q, v) = (vector(0.05), vector(0.15));
        let z = if dice.chance(0.3) { 0.0 } else { reach * dice.between(-1.0, 1.0) };
        let span = dice.scale(0.05, 20.0);
        Problem { system, t0, start: VelocityPoint { q, v, z }, span, pace: if reach > 1.0 { reach } else { 1.0 } }
    }

    /// As the library takes it.
    pub fn posed(&self) -> Result<discrete_herglotz::Problem<'_, RandomSystem<N>, N>, InputError> {
        discrete_herglotz::Problem::new(&self.system, self.t0, self.start)
    }

    /// Its end.
    pub fn until(&self) -> Until {
        Until::Time(self.t0 + self.span)
    }
}
