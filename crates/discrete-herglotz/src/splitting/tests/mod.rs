//! Tests of splittings against an independent reference and against the theory.

mod discrete_lagrangians;
mod hypotheses;
mod orders;
mod steps;

use super::{
    ActionFlow, ActionMap, ActionSplitting, ActionStrang, Riccati, RiccatiMap, Splitting, Strang, action_flow,
};
use crate::{InputError, SplittingScheme, Stepper};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Lagrangian, PhasePoint, Scalar, Structure, numbers::MaxAbsOrNan};

type Outcome = Result<(), InputError>;

/// Two different masses with coupled inertia in a time-dependent quartic potential.
struct Inertia;

impl Lagrangian<2> for Inertia {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let kinetic = v[0] * v[0] + v[0] * v[1] * 0.6 + v[1] * v[1] * 1.5;
        let (a, b) = (q[0] - q[1] * 0.3, q[1] - t.sin() * 0.2);
        kinetic - a.powi(4) * 0.5 - b * b * 0.7 - q[0] * q[1] * 0.2 - z * 0.15
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, z_affine: true, constant_rate: true, constant_mass: true, ..Structure::default() }
    }
}

/// A pendulum with a drag of degree two in z, and a constant term in L.
struct Curved;

impl Lagrangian<1> for Curved {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.75 + q[0].cos() * (t.cos() * 0.2 + 0.8) + 0.4 - z * 0.2 - z * z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// A pendulum with a time-dependent drag.
struct Tides;

impl Lagrangian<1> for Tides {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].cos() * 2.0 - z * (t.sin() * 0.3 + 0.2)
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, z_affine: true, constant_mass: true, ..Structure::default() }
    }
}

fn distance<const N: usize>(a: PhasePoint<N>, b: PhasePoint<N>) -> f64 {
    ChartVector::from(a).minus(ChartVector::from(b)).max_abs_or_nan()
}

/// The state after this number of steps.
fn run<const N: usize>(mut motion: impl Stepper<N>, steps: usize) -> PhasePoint<N> {
    assert_eq!(motion.advance(steps), Ok(()));
    motion.state()
}

static SCHEMES: [SplittingScheme; 15] = SplittingScheme::ALL;
