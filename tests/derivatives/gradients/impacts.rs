//! Derivatives of runs with impacts.

use crate::gradients::runs::{Case, weyl};
use crate::lagrangians::{SwitchingOne, SwitchingTwo};
use contact_examples::systems::UniformField;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::max_or_nan;
use contact_geom::switching::{Impact, Impacts, Surface};
use contact_geom::{Scalar, VelocityPoint};
use discrete_herglotz::sensitivity::{
    DifferentiableProblem, EndCovector, EndState, Loss, MotionState, SensitivityError, TangentRow, Variable,
};
use discrete_herglotz::{GaussCollocation, Problem, Status, Steps, Until};

/// The half line `q >= 0`.
#[derive(Clone, Copy, Debug)]
pub struct Floor;

impl<const N: usize> Surface<N> for Floor {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>) -> T {
        q.iter().last().copied().unwrap_or(T::zero())
    }
}

/// A curved floor that moves, with two parameters.
#[derive(Clone, Copy, Debug)]
pub struct Ground {
    slope: f64,
    velocity: f64,
}

impl Ground {
    fn formula<T: Scalar>([slope, velocity]: [T; 2], t: T, q: &SVector<T, 2>) -> T {
        q[1] - (q[0] + q[0].sin() * 0.1) * slope - t * velocity
    }
}

impl Surface<2> for Ground {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>) -> T {
        Self::formula([self.slope, self.velocity].map(T::from), t, q)
    }
    fn parameter_names(&self) -> Vec<String> {
        ["slope", "velocity"].map(String::from).into()
    }
    fn parameters(&self) -> Vec<f64> {
        vec![self.slope, self.velocity]
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let [slope, velocity] = *theta else { return None };
        Some(Ground { slope, velocity })
    }
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, 2>) -> T {
        Self::formula([theta[0], theta[1]], t, q)
    }
}

fn ball(field: f64, gamma: f64, law: Impact) -> SwitchingOne {
    Impacts::new(UniformField { field: [field], gamma }, Floor, law).into()
}

/// The derivatives of q and v in variables, forward and by the adjoint, with the end.
fn both(system: &SwitchingOne, steps: Steps, t: f64, variables: &[Variable]) -> ([f64; 2], Vec<[[f64; 2]; 2]>) {
    let problem = Problem::new(system, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let run = || problem.by(GaussCollocation { stages: 8 }).steps(steps);
    let tangent = run().tangent(variables, Until::Time(t)).unwrap();
    assert_eq!(tangent.outcome.status, Status::Completed);
    let recorded = run().record(Until::Time(t)).unwrap();
    let mut units = [0, 1].map(|_| EndCovector::zero(1));
    (units[0].q[0], units[1].v[0]) = (1.0, 1.0);
    let gradients = recorded.pullbacks(&units).unwrap();
    let all = Variable::all(&problem);
    let columns = variables.iter().zip(&tangent.columns).map(|(variable, column)| {
        let index = all.iter().position(|x| x == variable).unwrap();
        let backward = [0, 1].map(|i| {
            let g = &gradients[i];
            let all: Vec<f64> = g.q.iter().chain(&g.rate).chain([&g.z]).chain(&g.parameters).copied().collect();
            all[index]
        });
        [[column.q[0], column.v[0]], backward]
    });
    ([tangent.outcome.q[0], tangent.outcome.v.unwrap()[0]], columns.collect())
}

/// An elastic ball with drag after two impacts, against the closed motion with 30 digits.
#[test]
fn the_ball_of_the_issue() {
    let gamma = [Variable::Parameter("gamma".into())];
    for steps in [Steps::Size(0.5), Steps::Size(0.37), Steps::Count(7), Steps::Count(1)] {
        let ([q, v], columns) = both(&ball(-1.0, -0.1, Impact::Elastic), steps, 5.0, &gamma);
        assert!((q - 0.687239291673724).abs() <= 1e-12 && (v - 0.20210194335121757).abs() <= 1e-12, "{q}, {v}");
        for [dq, dv] in columns[0] {
            assert!((dq - 1.46611558087703).abs() <= 1e-12 * 4.0, "{steps:?}: {dq}");
            assert!((dv - 3.98147247892459).abs() <= 1e-12 * 4.0, "{steps:?}: {dv}");
        }
    }
}

/// A drop with restitution, in the field and in the coefficient.
#[test]
fn a_drop_with_restitution() {
    let variables = ["field[0]", "restitution"].map(|name| Variable::Parameter(name.into()));
    let (_, columns) = both(&ball(-9.81, 0.0, Impact::Restitution(0.8)), Steps::Size(0.1), 1.0, &variables);
    for ([dq, _], expected) in columns.iter().flat_map(|both| both.iter().copied()).zip([1.0, 1.0, 2.0, 2.0]) {
        let expected = if expected == 1.0 { 0.09362872311284 } else { 2.42944691807002 };
        assert!((dq - expected).abs() <= 1e-12, "{dq} and {expected}");
    }
}

/// The time of an impact `sqrt(2 q0 / g)`, with the field -g, and its derivatives, as a switch and as an event.
#[test]
fn times_of_impacts() {
    struct Height;
    impl Loss<1> for Height {
        fn value<T: Scalar>(&self, at: &EndState<1, T>) -> T {
            at.q[0] - 0.25
        }
    }
    let system = ball(-2.0, 0.0, Impact::Elastic);
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let variables = [Variable::Position(0), Variable::Parameter("field[0]".into()), Variable::StartTime];
    let event = 0.75_f64.sqrt();
    let run = || problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.3));
    let tangent = run().tangent_at(&variables, &[event], Until::Time(1.5)).unwrap();
    let [impact] = tangent.switches.as_slice() else { panic!("{:?}", tangent.switches) };
    assert!((impact.t - 1.0).abs() <= 1e-15 && impact.index == 0);
    for (found, expected) in impact.derivatives.iter().zip([0.5, 0.25, 1.0]) {
        assert!((found - expected).abs() <= 1e-14, "{found} and {expected}");
    }
    // q = q0 - g t^2 / 2 is 1/4 at t^2 = 2 (q0 - 1/4) / g.
    let TangentRow { state, columns } = &tangent.rows[0];
    let of_time = state.event_time((&problem.differentiable(), None), &state.differentiate(&Height).1).unwrap();
    let expected = [0.5 / event, 0.25 * event, 1.0];
    for (column, expected) in columns.iter().zip(expected) {
        let found = of_time.along(column, 0.0);
        assert!((found - expected).abs() <= 1e-14, "{found} and {expected}");
    }
    let gradient = run().record(Until::Time(1.5)).unwrap().pullback_at(&[event], &[of_time.of_state]).unwrap();
    assert!((gradient.q[0] - expected[0]).abs() <= 1e-14 && (gradient.t0 - 1.0).abs() <= 1e-14);
}

/// Random impacts on a curved floor that moves, by every law: forward derivatives, adjoint and differences.
#[test]
fn random_impacts() {
    let mut impacts = 0;
    for k in 0..48 {
        let u = weyl(k, 9);
        let law = match k % 3 {
            0 => Impact::Elastic,
            1 => Impact::Restitution(0.6 + 0.3 * u[0]),
            _ => Impact::Conformal(0.7 + 0.2 * u[0]),
        };
        let ground = Ground { slope: 0.3 * (u[1] - 0.5), velocity: 0.1 * (u[2] - 0.5) };
        let system = Impacts::new(UniformField { field: [0.2 * u[3], -1.0], gamma: -0.2 * u[4] }, ground, law);
        let system = SwitchingTwo::from(system);
        let start = VelocityPoint::new([u[5], 0.8 + 0.3 * u[6]], [u[7] - 0.5, 0.3 * (u[8] - 0.5)], 0.1);
        let case = Case {
            lagrangian: &system,
            t0: 0.0,
            start,
            from_momentum: k % 2 == 1,
            t_end: 2.4,
            steps: 3 + k as usize % 5,
            method: GaussCollocation { stages: 4 + k as usize % 9 },
        };
        let (_, tangent, _) = case.agree(&format!("case {k}, {law:?}"), 1e-12);
        impacts += tangent.switches.len();
        if tangent.switches.len() == 1 {
            case.compare(&format!("case {k}, {law:?}"), 1e-12, 1e-6);
        }
    }
    assert!(impacts >= 40, "{impacts}");
}

/// Rows before and after an impact, and one at a step end: the gradient of a loss of them is that of their tangents.
#[test]
fn losses_of_rows_across_impacts() {
    let system = ball(-1.0, -0.1, Impact::Restitution(0.9));
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let run = || problem.by(GaussCollocation { stages: 6 }).steps(Steps::Size(0.5));
    let times = [0.3, 1.0, 1.2, 1.46, 1.49, 2.0, 3.7, 4.3, 5.0];
    let variables = Variable::all(&problem);
    let tangent = run().tangent_at(&variables, &times, Until::Time(5.0)).unwrap();
    assert_eq!(tangent.rows.iter().map(|row| row.state.t).collect::<Vec<_>>(), times);
    let of_row = |i: usize, state: &MotionState| {
        let q = [2.0 * state.q[0] * (1.0 + i as f64)].into();
        EndCovector { q, v: state.q.clone(), z: 1.0, ..EndCovector::zero(1) }
    };
    let loss = |states: &[MotionState]| {
        let value = |(i, x): (usize, &MotionState)| x.q[0].powi(2) * (1.0 + i as f64) + x.z;
        let covectors = states.iter().enumerate().map(|(i, x)| of_row(i, x)).collect();
        (states.iter().enumerate().map(value).sum(), covectors)
    };
    let gradient = run().gradient_at(&times, loss, Until::Time(5.0)).unwrap().loss.unwrap().1;
    let of_gradient = gradient.q.iter().chain(&gradient.rate).chain([&gradient.z]).chain(&gradient.parameters);
    for (k, found) in of_gradient.chain([&gradient.t0, &gradient.t_end]).enumerate() {
        let of = |(i, row): (usize, &TangentRow)| row.columns[k].dot(&of_row(i, &row.state));
        let expected: f64 = tangent.rows.iter().enumerate().map(of).sum();
        assert!((found - expected).abs() <= 1e-11 * (1.0 + expected.abs()), "{:?}: {found}, {expected}", variables[k]);
    }
}

/// The half line below a height.
#[derive(Clone, Copy)]
pub struct Ceiling(f64);

impl Surface<1> for Ceiling {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>) -> T {
        -q[0] + self.0
    }
}

/// A ball that just reaches a ceiling: either the derivative is refused, or its growth tells how ill-conditioned it is.
#[test]
fn grazing_impacts() {
    for exponent in 2..=16 {
        let height = 0.5 - 10.0_f64.powi(-exponent);
        let system = Impacts::new(UniformField { field: [-1.0], gamma: 0.0 }, Ceiling(height), Impact::Elastic);
        let system = SwitchingOne::from(system);
        let problem = Problem::new(&system, 0.0, VelocityPoint::new([0.0], [1.0], 0.0)).unwrap();
        let run = || problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.3));
        match run().tangent(&[Variable::Velocity(0)], Until::Time(1.7)) {
            // The motion did not reach the ceiling: the derivative is that of the flight.
            Ok(tangent) if tangent.switches.is_empty() => {
                assert!((tangent.columns[0].q[0] - 1.7).abs() <= 1e-13, "{exponent}");
                assert!(exponent >= 15, "{exponent}");
            }
            // The velocity at the ceiling is sqrt(2 delta), and the derivative of its time has this denominator.
            Ok(tangent) => {
                let rate = (2.0 * 10.0_f64.powi(-exponent)).sqrt();
                let found = tangent.switches[0].derivatives[0];
                let expected = -(1.0 - rate) / rate;
                assert!((found / expected - 1.0).abs() <= 1e-15 / (rate * rate), "{exponent}: {found} and {expected}");
                assert!(max_or_nan(tangent.growth, tangent.columns[0].v[0].abs()) >= 0.1 / rate, "{exponent}");
            }
            Err(SensitivityError::Grazing { .. }) => assert!(exponent >= 15, "{exponent}"),
            Err(other) => panic!("{exponent}: {other}"),
        }
    }
}
