//! Derivatives with applied forces and their parameters.

use crate::gradients::flows::{EqualDrag, LinearDrag};
use crate::gradients::runs::Case;
use crate::lagrangians::{ForcedOne, Two};
use contact_examples::systems::{
    CoupledInZ, CoupledPlane, DoublePendulum, OneCoordinate, Pendulum, QuadraticInZ, System, TwoCoordinates,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{Force, ForceStructure, Forced, Parametric, ParametricForce, Scalar, VelocityDrag, VelocityPoint};
use discrete_herglotz::GaussCollocation;

/// A force of time, positions, velocities and action, that no structure simplifies, with two parameters.
#[derive(Clone, Copy, Debug)]
pub struct Stirring {
    pub a: f64,
    pub b: f64,
}

fn stirring<const N: usize, T: Scalar>([a, b]: [T; 2], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
    SVector::from_fn(|i, _| {
        let next = x.v[(i + 1) % N];
        a * (t + x.q[i]).sin() * x.z.cos() - b * x.v[i] * (next * next + 1.0) + a * b * next * x.q[i]
    })
}

impl<const N: usize> Force<N> for Stirring {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        stirring([self.a, self.b].map(T::from), t, x)
    }
}

impl<const N: usize> ParametricForce<N> for Stirring {
    fn parameter_names(&self) -> Vec<String> {
        ["a", "b"].map(String::from).into()
    }
    fn parameters(&self) -> Vec<f64> {
        vec![self.a, self.b]
    }
    fn parameter_count(&self) -> usize {
        2
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let [a, b] = *theta else { return None };
        Some(Stirring { a, b })
    }
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        stirring([theta[0], theta[1]], t, x)
    }
}

/// The forces of these tests, as one type.
#[derive(Clone, Copy, Debug)]
pub enum Forces<const N: usize> {
    Stirring(Stirring),
    EqualDrag(EqualDrag),
    LinearDrag(LinearDrag<N>),
    VelocityDrag(VelocityDrag<N>),
}

/// An expression in the force that it is.
macro_rules! of_each {
    ($self:ident, $force:ident => $value:expr) => {
        match $self {
            Forces::Stirring($force) => $value,
            Forces::EqualDrag($force) => $value,
            Forces::LinearDrag($force) => $value,
            Forces::VelocityDrag($force) => $value,
        }
    };
}

impl<const N: usize> Force<N> for Forces<N> {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        of_each!(self, force => force.value(t, x))
    }
    fn structure(&self) -> ForceStructure<N> {
        of_each!(self, force => Force::structure(force))
    }
}

impl<const N: usize> ParametricForce<N> for Forces<N> {
    fn parameter_names(&self) -> Vec<String> {
        of_each!(self, force => ParametricForce::<N>::parameter_names(force))
    }
    fn parameters(&self) -> Vec<f64> {
        of_each!(self, force => ParametricForce::<N>::parameters(force))
    }
    fn parameter_count(&self) -> usize {
        of_each!(self, force => ParametricForce::<N>::parameter_count(force))
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        of_each!(self, force => ParametricForce::<N>::with_parameters(force, theta).map(Forces::from))
    }
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        of_each!(self, force => force.value_at(theta, t, x))
    }
}

macro_rules! from {
    ($($variant:ident($force:ty)),*) => {
        $(impl<const N: usize> From<$force> for Forces<N> {
            fn from(force: $force) -> Self {
                Forces::$variant(force)
            }
        })*
    };
}

from!(Stirring(Stirring), EqualDrag(EqualDrag), LinearDrag(LinearDrag<N>), VelocityDrag(VelocityDrag<N>));

/// As for the systems of the catalogue, with a force.
#[test]
fn a_general_force() {
    fn run<const N: usize, S: System<N>, L: Parametric<N>>(system: &S, forced: &L) {
        for stages in [1, 2, 3, 5, 8, 12, 16] {
            let (t0, t_end, steps) = (0.3, 1.1, 4);
            let case = Case {
                lagrangian: forced,
                t0,
                start: system.initial(),
                from_momentum: stages % 2 == 0,
                t_end,
                steps,
                method: GaussCollocation { stages },
            };
            case.compare(&format!("{}, {stages} stages", system.name()), 3e-13, 1e-8);
        }
    }
    fn line(system: OneCoordinate) {
        run(&system, &ForcedOne::new(system, Stirring { a: 0.4, b: 0.3 }.into()));
    }
    fn plane(system: TwoCoordinates) {
        run(&system, &Two::from(Forced::new(system, Forces::from(Stirring { a: 0.4, b: 0.3 }))));
    }
    line(Pendulum::default().into());
    line(QuadraticInZ::default().into());
    line(CoupledInZ::default().into());
    plane(DoublePendulum::default().into());
    plane(CoupledPlane::default().into());
}

/// Linear and quadratic drag; names that the Lagrangian has too are told apart.
#[test]
fn drag() {
    let force = VelocityDrag { linear: [0.2, 0.1].into(), quadratic: 0.3 };
    let once = Forced::new(TwoCoordinates::from(DoublePendulum::default()), Forces::from(force));
    let forced = Two::from(once);
    let start = VelocityPoint::new([1.0, 0.4], [0.5, -0.7], 0.2);
    let case = Case {
        lagrangian: &forced,
        t0: 0.0,
        start,
        from_momentum: false,
        t_end: 0.8,
        steps: 4,
        method: GaussCollocation { stages: 8 },
    };
    case.compare("drag", 3e-13, 1e-8);
    let nested = Two::from(Forced::new(once, Forces::from(Stirring { a: 0.4, b: 0.3 })));
    assert_eq!(
        Parametric::<2>::parameter_names(&nested)[4..],
        ["gamma", "linear[0]", "linear[1]", "quadratic", "a", "b"]
    );
    let case = Case {
        lagrangian: &nested,
        t0: 0.0,
        start,
        from_momentum: false,
        t_end: 0.8,
        steps: 4,
        method: GaussCollocation { stages: 6 },
    };
    case.compare("drag and stirring", 3e-13, 1e-8);
}
