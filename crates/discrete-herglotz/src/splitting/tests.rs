//! Splittings against a fine reference, and against what the theory says of them.

use super::{Splitting, SplittingScheme};
use crate::{Halt, InputError, StepError, Stepper};
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{Duffing, HarmonicOscillator, Kepler, Pendulum, QuadraticInZ, System};
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure, Triple, VelocityPoint, legendre};

/// The distance of two states.
fn distance<const N: usize>(a: PhasePoint<N>, b: PhasePoint<N>) -> f64 {
    Triple::from(a).minus(Triple::from(b)).amax()
}

/// The state `(q, p, z)` of a system's start.
fn start<const N: usize>(system: &impl System<N>) -> PhasePoint<N> {
    legendre(system, 0.0, &system.initial())
}

/// The state after time `duration` in `steps` steps.
fn end<const N: usize>(
    system: &impl System<N>,
    scheme: &SplittingScheme,
    duration: f64,
    steps: usize,
) -> Result<PhasePoint<N>, InputError> {
    let mut motion = Splitting::new(system, scheme, duration / steps as f64, 0.0, start(system))?.compensated();
    assert_eq!(motion.advance(steps), Ok(()), "{}", scheme.name());
    Ok(motion.state())
}

/// The slope of the error in the step, from the two smallest steps with errors well above round-off.
fn order<const N: usize>(
    system: &impl System<N>,
    scheme: &SplittingScheme,
    duration: f64,
    steps: [usize; 3],
) -> Result<f64, InputError> {
    let reference = end(system, &SplittingScheme::SOFRONIOU_SPALETTA_10, duration, 8 * steps[2])?;
    let mut errors = [0.0; 3];
    for (error, n) in errors.iter_mut().zip(steps) {
        *error = distance(end(system, scheme, duration, n)?, reference);
        println!("{} {}: {n} steps, error {error:e}", system.name(), scheme.name());
    }
    let log = |n: usize| (n as f64).ln();
    Ok((errors[0] / errors[2]).ln() / (log(steps[2]) - log(steps[0])))
}

#[test]
fn orders() -> Result<(), InputError> {
    for scheme in &SplittingScheme::ALL {
        let forced = order(&Duffing::forced(), scheme, 4.0, [40, 60, 80])?;
        let found = order(&Pendulum::default(), scheme, 4.0, [20, 30, 40])?;
        println!("{} {found} {forced}", scheme.name());
    }
    Ok(())
}
