//! Runs and directions without second derivatives.

use crate::gradients::invalid_input::Falling;
use crate::lagrangians::One;
use contact_geom::numbers::max_abs_or_nan;
use contact_geom::systems::{Pendulum, System};
use contact_geom::{Scalar, VelocityPoint};
use discrete_herglotz::rules::Method;
use discrete_herglotz::sensitivity::{EndState, Loss, SensitivityError, Variable};
use discrete_herglotz::{GaussCollocation, Problem, SplittingScheme, Status, Steps, Until};

struct Constant(f64);

impl<const N: usize> Loss<N> for Constant {
    fn value<T: Scalar>(&self, _end: &EndState<N, T>) -> T {
        T::from(self.0)
    }
}

#[test]
fn integrators_without_second_derivatives() {
    let pendulum = Pendulum::default();
    let (pendulum, start) = (One::from(pendulum), pendulum.initial());
    let problem = Problem::new(&pendulum, 0.0, start).unwrap();
    let variables = Variable::all(&problem);
    let (steps, until) = (Steps::Size(0.1), Until::Time(1.0));
    let found = problem.by(SplittingScheme::STRANG).steps(steps).second_tangent(&variables, until).unwrap_err();
    assert!(matches!(found, SensitivityError::NoSecondTangent { .. }), "{found}");
    assert!(found.to_string().contains("choose `GaussCollocation`"), "{found}");
    let found = problem.by(Method::Midpoint).steps(steps).hessian(&Constant(1.0), &variables, until).unwrap_err();
    assert!(matches!(found, SensitivityError::NoSecondTangent { .. }), "{found}");
}

#[test]
fn directions_and_losses() {
    let pendulum = Pendulum::default();
    let (pendulum, start) = (One::from(pendulum), pendulum.initial());
    let problem = Problem::new(&pendulum, 0.0, start).unwrap();
    let run = || problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.1));
    let (variables, until) = ([Variable::Position(0), Variable::Action], Until::Time(1.0));
    for direction in [vec![1.0], vec![1.0, f64::NAN], vec![1.0, f64::INFINITY]] {
        let components = direction.len();
        let along = [vec![1.0, 2.0], direction];
        let expected = SensitivityError::Direction { index: 1, components, variables: 2 };
        assert_eq!(run().second_tangent_along(&variables, &along, until).unwrap_err(), expected);
        assert_eq!(run().hessian_along(&Constant(1.0), &variables, &along, until).unwrap_err(), expected);
    }
    let found = run().hessian(&Constant(f64::NAN), &variables, until).unwrap_err();
    assert!(matches!(found, SensitivityError::Loss { value } if value.is_nan()), "{found}");
    let found = run().second_tangent(&[Variable::Momentum(0)], until).unwrap_err();
    assert!(matches!(found, SensitivityError::Start { .. }), "{found}");
    let found = run().hessian(&Constant(2.0), &variables, until).unwrap().loss.unwrap();
    assert_eq!(
        (found.value, max_abs_or_nan(found.gradient.iter().copied()), max_abs_or_nan(found.hessian.iter().copied())),
        (2.0, 0.0, 0.0)
    );
}

/// A run that fails has a status, and no derivatives. The square root is not defined below 0, where a fall from 1 arrives
/// after a time of 1.4.
#[test]
fn runs_that_end_early() {
    let falling = One::from(Falling);
    let problem = Problem::new(&falling, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let run = || problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.1));
    let (variables, until) = ([Variable::Position(0)], Until::Time(2.0));
    let found = run().hessian(&Constant(1.0), &variables, until).unwrap();
    assert!(matches!(found.outcome.status, Status::Failed { .. }), "{}", found.outcome.status);
    assert!(found.loss.is_none());
    let found = run().second_tangent(&variables, until).unwrap();
    assert!(matches!(found.outcome.status, Status::Failed { .. }), "{}", found.outcome.status);
    assert!(found.end.is_none());
}
