//! Derivatives of runs by splittings, quadrature rules and compositions.

use crate::gradients::forces::{Forces, Stirring};
use crate::gradients::runs::{Case, Method, weyl};
use crate::lagrangians::{ForcedOne, Two};
use contact_examples::systems::{
    CoupledInZ, DoublePendulum, HarmonicOscillator, Kepler, OneCoordinate, Pendulum, QuadraticInZ, System,
    SystemVisitor, TwoCoordinates, UniformField, visit_catalogue,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{Force, ForceStructure, Forced, Parametric, ParametricForce, Scalar, VelocityDrag, VelocityPoint};
use discrete_herglotz::sensitivity::{EndCovector, EndState, Loss, MotionState, SensitivityError, Variable};
use discrete_herglotz::{Integrator, Problem, SplittingScheme, Steps, Until, rules};

/// A run over 0.1, or back over 0.075, from a sampled state; the draw selects the direction, the number of steps, and whether
/// the start is given by its momentum. In this time no sampled orbit comes to a centre or a pole, where steps of rules have
/// no solution.
///
/// Not for more than two coordinates: the loops of rules and splittings over coordinates are the same for any number of
/// them, which is three in `rows`, and each type takes long to compile.
fn compare<const N: usize, S: System<N>, M: Method>(system: &S, method: M, draw: u32, name: &str) {
    if const { N > 2 } {
        return;
    }
    let (mut t0, start) = system.sample(&weyl(draw, 2 * N + 2));
    t0 += system.initial_time();
    let span = if draw % 4 == 3 { -0.075 } else { 0.1 };
    let (from_momentum, steps) = (draw % 2 == 1, 3 + draw as usize % 3);
    let case = Case { lagrangian: system, t0, start, from_momentum, t_end: t0 + span, steps, method };
    case.compare(&format!("{}, {name}, from {start:?}", system.name()), 3e-13, 1e-8);
}

/// Every splitting scheme for every system with one or two coordinates to which it applies: constant and time-dependent
/// linear drag, nonlinear drag.
#[test]
fn splittings() {
    struct Visit(u32);
    impl SystemVisitor for Visit {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for scheme in SplittingScheme::ALL {
                self.0 += 1;
                if Integrator::<'_, S, N>::check(&scheme, system).is_ok() {
                    compare(system, scheme, self.0, scheme.name());
                }
            }
        }
    }
    visit_catalogue(&mut Visit(0));
}

/// Every quadrature rule, and compositions of the symmetric ones, for every system with one or two coordinates.
#[test]
fn quadrature_rules() {
    struct Visit(u32);
    impl SystemVisitor for Visit {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for method in rules::Method::RULES {
                for _ in 0..2 {
                    self.0 += 1;
                    compare(system, *method, self.0, method.name());
                }
                if method.symmetric() {
                    let scheme = SplittingScheme::KAHAN_LI_8;
                    compare(system, (*method, scheme), self.0, &format!("{} by {}", method.name(), scheme.name()));
                }
            }
        }
    }
    visit_catalogue(&mut Visit(70));
}

/// A drag with equal coefficients of all velocities, `-c v - k |v| v`, beside a force of time and positions.
#[derive(Clone, Copy, Debug)]
pub struct EqualDrag {
    c: f64,
    k: f64,
    push: f64,
}

fn equal_drag<const N: usize, T: Scalar>([c, k, push]: [T; 3], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
    let speed = x.v.dot(&x.v).sqrt();
    SVector::from_fn(|i, _| push * (x.q[i] + t).sin() - (c + k * speed) * x.v[i])
}

impl<const N: usize> Force<N> for EqualDrag {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        equal_drag([self.c, self.k, self.push].map(T::from), t, x)
    }
    fn structure(&self) -> ForceStructure<N> {
        ForceStructure::Drag { linear: SVector::from_element(self.c), quadratic: self.k }
    }
}

impl<const N: usize> ParametricForce<N> for EqualDrag {
    fn parameter_names(&self) -> Vec<String> {
        ["c", "k", "push"].map(String::from).into()
    }
    fn parameters(&self) -> Vec<f64> {
        vec![self.c, self.k, self.push]
    }
    fn parameter_count(&self) -> usize {
        3
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let [c, k, push] = *theta else { return None };
        Some(EqualDrag { c, k, push })
    }
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        equal_drag([theta[0], theta[1], theta[2]], t, x)
    }
}

fn forced<const N: usize, S: System<N>, L: Parametric<N>, M: Method>(
    system: &S,
    lagrangian: &L,
    method: M,
    name: &str,
) {
    let mut start = system.initial();
    // No velocity vanishes, where |v| is not smooth.
    start.v = SVector::from_fn(|i, _| 0.6 + 0.2 * i as f64);
    for from_momentum in [false, true] {
        let case = Case { lagrangian, t0: 0.3, start, from_momentum, t_end: 0.6, steps: 3, method };
        case.compare(&format!("{}, {name}", system.name()), 3e-13, 1e-8);
    }
}

fn forced_line<M: Method>(system: impl Into<OneCoordinate>, force: impl Into<Forces<1>>, method: M, name: &str) {
    let system = system.into();
    forced(&system, &ForcedOne::new(system, force.into()), method, name);
}

fn forced_plane<M: Method>(system: impl Into<TwoCoordinates>, force: impl Into<Forces<2>>, method: M, name: &str) {
    let system = system.into();
    forced(&system, &Two::from(Forced::new(system, force.into())), method, name);
}

/// A linear drag with a coefficient for each velocity, which are its parameters.
#[derive(Clone, Copy, Debug)]
pub struct LinearDrag<const N: usize>([f64; N]);

impl<const N: usize> Force<N> for LinearDrag<N> {
    fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        SVector::from_fn(|i, _| -(x.v[i] * self.0[i]))
    }
    fn structure(&self) -> ForceStructure<N> {
        ForceStructure::Drag { linear: self.0.into(), quadratic: 0.0 }
    }
}

impl<const N: usize> ParametricForce<N> for LinearDrag<N> {
    fn parameter_names(&self) -> Vec<String> {
        (0..N).map(|i| format!("c{i}")).collect()
    }
    fn parameters(&self) -> Vec<f64> {
        self.0.to_vec()
    }
    fn parameter_count(&self) -> usize {
        N
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        theta.try_into().ok().map(LinearDrag)
    }
    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        SVector::from_fn(|i, _| -(x.v[i] * theta[i]))
    }
}

/// Splittings with kicks by forces, and with linear and quadratic drags of the velocity; also where the drag is 0, which its
/// parameters change.
#[test]
fn drags_of_the_velocity() {
    for scheme in SplittingScheme::ALL.into_iter().filter(|scheme| scheme.order() <= 8) {
        let name = scheme.name();
        for c in [0.3, 0.0] {
            forced_line(Pendulum { gamma: -0.2 }, LinearDrag([c]), scheme, name);
            forced_plane(UniformField::default(), LinearDrag([c, 0.1]), scheme, name);
        }
        if !scheme.is_nystrom() {
            for (c, k) in [(0.0, 0.0), (0.3, 0.0), (0.3, 0.2), (0.0, -0.2)] {
                forced_line(HarmonicOscillator::default(), EqualDrag { c, k, push: 0.4 }, scheme, name);
                let (kepler, force) = (Kepler::<2>::default(), EqualDrag { c, k, push: 0.2 });
                forced(&kepler, &Two::from(Forced::new(kepler, force.into())), scheme, name);
            }
        }
    }
}

/// Rules with a force that nothing simplifies.
#[test]
fn rules_with_forces() {
    let force = Stirring { a: 0.4, b: 0.3 };
    for method in rules::Method::RULES {
        forced_line(Pendulum::default(), force, *method, method.name());
        forced_line(QuadraticInZ::default(), force, *method, method.name());
        forced_line(CoupledInZ::default(), force, *method, method.name());
        forced_plane(DoublePendulum::default(), force, *method, method.name());
    }
}

/// A parameter in which a splitting is not differentiable: an error by name, NaN among all.
#[test]
fn parameters_that_a_splitting_excludes() {
    struct Mean;
    impl Loss<2> for Mean {
        fn value<T: Scalar>(&self, end: &EndState<2, T>) -> T {
            end.q[0] + end.q[1]
        }
    }
    let force = VelocityDrag { linear: [0.2, 0.2].into(), quadratic: 0.1 };
    let kepler = Kepler::<2>::default();
    let lagrangian = Two::from(Forced::new(kepler, force.into()));
    let problem = Problem::new(&lagrangian, 0.0, kepler.initial()).unwrap();
    let run = || problem.by(SplittingScheme::STRANG).steps(Steps::Count(10));
    let found = run().tangent(&[Variable::Parameter("linear[0]".into())], Until::Time(1.0)).unwrap_err();
    assert!(matches!(found, SensitivityError::NoTangent { .. }), "{found}");
    assert!(found.to_string().contains("different amounts"), "{found}");
    let (_, gradient) = run().gradient(&Mean, Until::Time(1.0)).unwrap().loss.unwrap();
    let names = lagrangian.parameter_names();
    for (name, of) in names.iter().zip(&gradient.parameters) {
        assert_eq!(of.is_nan(), name.starts_with("linear"), "{name}: {of}");
    }
    assert!(gradient.q.iter().chain(&gradient.rate).all(|x| x.is_finite()));
}

/// Rows of splittings and rules at step ends and within steps, forward and backward.
#[test]
fn rows() {
    fn check<M: Method>(method: M, name: &str) {
        let system = Kepler::<3>::default();
        let problem = Problem::new(&system, 0.1, system.initial()).unwrap();
        let run = || method.run(&problem).steps(Steps::Count(8));
        let times = [0.1, 0.35, 0.5, 0.77, 0.9];
        let variables = Variable::all(&problem);
        let tangent = run().tangent_at(&variables, &times, Until::Time(0.9)).unwrap();
        assert_eq!(tangent.rows.len(), times.len());
        let weight = |i: usize| 1.0 + 0.3 * i as f64;
        let loss = |states: &[MotionState]| {
            let value: f64 =
                states.iter().enumerate().map(|(i, state)| weight(i) * (state.q[1] * state.v[0] + state.z)).sum();
            let of = |(i, state): (usize, &MotionState)| {
                let mut covector = EndCovector::zero(3);
                covector.q[1] = weight(i) * state.v[0];
                covector.v[0] = weight(i) * state.q[1];
                covector.z = weight(i);
                covector
            };
            (value, states.iter().enumerate().map(of).collect::<Vec<_>>())
        };
        let (_, gradient) = run().gradient_at(&times, loss, Until::Time(0.9)).unwrap().loss.unwrap();
        let all = gradient
            .q
            .iter()
            .chain(&gradient.rate)
            .chain([&gradient.z])
            .chain(&gradient.parameters)
            .chain([&gradient.t0, &gradient.t_end]);
        for (k, found) in all.enumerate() {
            let of = |(i, row): (usize, &discrete_herglotz::sensitivity::TangentRow)| {
                let (state, column) = (&row.state, &row.columns[k]);
                weight(i) * (column.q[1] * state.v[0] + state.q[1] * column.v[0] + column.z)
            };
            let expected: f64 = tangent.rows.iter().enumerate().map(of).sum();
            assert!(
                (found - expected).abs() <= 1e-12 * (1.0 + expected.abs()),
                "{name}, {:?}: {found} and {expected}",
                variables[k]
            );
        }
    }
    check(SplittingScheme::BLANES_MOAN_6, "splitting");
    check(rules::Method::Midpoint, "rule");
    check((rules::Method::Trapezoidal, SplittingScheme::KAHAN_LI_8), "composition");
}
