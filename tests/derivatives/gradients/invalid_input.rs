//! Input that cannot be differentiated.

use crate::lagrangians::{One, SwitchingOne};
use contact_examples::systems::{HarmonicOscillator, Kepler, OneCoordinate, Pendulum, System};
use contact_geom::{Hints, Lagrangian, Parametric, Scalar, VelocityPoint, nalgebra::SVector};
use discrete_herglotz::rules;
use discrete_herglotz::sensitivity::{EndState, Loss, SensitivityError, Variable};
use discrete_herglotz::{GaussCollocation, InputError, Problem, Status, Steps, TransformedGauss, Until};

struct Constant(f64);

impl<const N: usize> Loss<N> for Constant {
    fn value<T: Scalar>(&self, _end: &EndState<N, T>) -> T {
        T::from(self.0)
    }
}

#[test]
fn names_starts_and_coordinates() {
    let pendulum = OneCoordinate::from(Pendulum::default());
    let problem = Problem::new(&pendulum, 0.0, pendulum.initial()).unwrap();
    let tangent =
        |variable: Variable| problem.steps(Steps::Size(0.1)).tangent(&[variable], Until::Time(1.0)).unwrap_err();
    let unknown = tangent(Variable::Parameter("gama".into()));
    assert_eq!(unknown.to_string(), "there is no parameter `gama`; did you mean `gamma`?");
    let unknown = tangent(Variable::Parameter("mass".into()));
    assert_eq!(unknown.to_string(), "there is no parameter `mass`; the parameters are gamma");
    assert!(matches!(tangent(Variable::Momentum(0)), SensitivityError::Start { .. }));
    assert!(matches!(tangent(Variable::Velocity(1)), SensitivityError::Coordinate { index: 1, count: 1 }));
    let times = problem.steps(Steps::Size(0.1)).tangent_at(&[], &[0.5, 0.2], Until::Time(1.0)).unwrap_err();
    assert_eq!(times, InputError::Times { index: 1, t: 0.2 }.into());
}

#[test]
fn integrators_without_tangents() {
    let kepler = Kepler::<2>::default();
    let problem = Problem::new(&kepler, 0.0, kepler.initial()).unwrap();
    let transformed =
        problem.by(TransformedGauss { stages: 6 }).steps(Steps::Size(0.2)).gradient(&Constant(1.0), Until::Time(1.0));
    assert!(matches!(transformed, Err(SensitivityError::NoTangent { .. })));
    assert!(transformed.unwrap_err().to_string().contains("choose `GaussCollocation`"));
}

/// A Lagrangian with a kink, across which only collocation is differentiated.
pub struct Slope;

impl Lagrangian<1> for Slope {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 - q[0].abs()
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(x.q[0]);
    }
}

impl Parametric<1> for Slope {}

#[test]
fn switching_functions() {
    let system = SwitchingOne::from(Slope);
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let found =
        problem.by(rules::Method::Midpoint).steps(Steps::Size(0.1)).tangent(&[Variable::Action], Until::Time(2.0));
    assert!(found.unwrap_err().to_string().contains("switching functions"));
}

#[test]
fn losses_that_are_not_finite() {
    let oscillator = OneCoordinate::from(HarmonicOscillator::default());
    let problem = Problem::new(&oscillator, 0.0, oscillator.initial()).unwrap();
    let run = || problem.steps(Steps::Size(0.1));
    let found = run().gradient(&Constant(f64::NAN), Until::Time(1.0)).unwrap_err();
    assert!(matches!(found, SensitivityError::Loss { value } if value.is_nan()));
    let found = run().gradient(&Constant(2.0), Until::Time(1.0)).unwrap();
    let (value, gradient) = found.loss.unwrap();
    assert_eq!((value, gradient.q[0], gradient.parameters[0], gradient.t_end), (2.0, 0.0, 0.0, 0.0));
}

/// A fall where the square root of the height is defined.
pub struct Falling;

impl Lagrangian<1> for Falling {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 - q[0] + q[0].sqrt() * 1e-3
    }
}

impl Parametric<1> for Falling {}

/// A run that fails has a status and no gradient; its tangent is that of the last state. The square root is not defined
/// below 0, where a fall from 1 arrives after a time of 1.4.
#[test]
fn runs_that_end_early() {
    let system = One::from(Falling);
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let run = || problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.1));
    let found = run().gradient(&Constant(1.0), Until::Time(2.0)).unwrap();
    assert!(matches!(found.outcome.status, Status::Failed { .. }), "{}", found.outcome.status);
    assert!(found.loss.is_none());
    let tangent = run().tangent(&[Variable::Position(0)], Until::Time(2.0)).unwrap();
    assert!(tangent.outcome.status == found.outcome.status && tangent.columns[0].q[0].is_finite());
}
