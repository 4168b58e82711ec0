//! Systems whose number of coordinates is known at run time: their steps are those of the typed Lagrangian, and systems
//! with many coordinates run.

use crate::common::{on_some, relative_distance, slope, step_from};
use contact_examples::systems::{SystemVisitor, visit_catalogue};
use contact_geom::nalgebra::{DMatrix, DVector, SymmetricEigen};
use contact_geom::numbers::max_or_nan;
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};
use discrete_herglotz::sensitivity::{EndState, Loss, SensitivityError, StateDerivative, Variable};
use discrete_herglotz::{
    Components, GaussCollocation, Point, Problem, SecondDerivatives, Status, Steps, System, SystemProblem, TypedSystem,
    Until, Vector,
};

/// A typed Lagrangian, by its value and its derivatives alone.
struct Seen<'a, const N: usize>(&'a dyn TypedSystem<N>);

impl<const N: usize> System for Seen<'_, N> {
    fn dimension(&self) -> usize {
        N
    }
    fn structure(&self) -> Structure {
        Structure { constant_mass: self.0.structure().constant_mass, ..Structure::default() }
    }
    fn value(&self, t: f64, x: &Point) -> f64 {
        self.0.value(t, &x.fixed())
    }
    fn gradient(&self, t: f64, x: &Point) -> Components {
        self.0.gradient(t, &x.fixed()).into()
    }
    fn hessian(&self, t: f64, x: &Point) -> SecondDerivatives {
        (&self.0.hessian(t, &x.fixed())).into()
    }
}

/// The steps of each system of the catalogue are those of its typed Lagrangian, with every number of stages: to 1e-11,
/// which is round-off times its growth in five steps of these motions.
#[test]
fn steps_are_those_of_the_typed_lagrangian() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: contact_examples::systems::System<N>>(&mut self, system: &S) {
            for stages in [1, 2, 3, 8] {
                on_some(6, &format!("{} with {stages} stages", system.name()), 2 * N + 3, |u| {
                    let (t, x) = system.sample(&u[1..]);
                    compare(system, stages, step_from(u[0]), t, &x)
                });
            }
        }
    }
    fn compare<const N: usize>(
        system: &impl Lagrangian<N>,
        stages: usize,
        h: f64,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> Result<(), String> {
        let by = GaussCollocation { stages };
        let run = |error: discrete_herglotz::InputError| error.to_string();
        let typed = Problem::new(system, t, *x).map_err(run)?;
        let typed = typed.by(by).steps(Steps::Size(h)).run(Until::Steps(5)).map_err(run)?;
        let seen = Seen(system);
        let problem = SystemProblem::new(&seen, t, Point::from(x)).map_err(run)?;
        let found = problem.by(by).steps(Steps::Size(h)).run(Until::Steps(5)).map_err(run)?;
        let off = relative_distance(found.state(), typed.state());
        let same = found.status == Status::Completed && typed.status == Status::Completed && off <= 1e-11;
        if same { Ok(()) } else { Err(format!("h = {h}: {} and {}, off by {off:e}", found.status, typed.status)) }
    }
    visit_catalogue(&mut Visitor);
}

/// The derivatives of a run of each system, in its start and in its times, are those of the typed Lagrangian: to 1e-8, the
/// accuracy of the differences by which a system without closed ones is differentiated in time, times their growth.
#[test]
fn derivatives_are_those_of_the_typed_lagrangian() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: contact_examples::systems::System<N>>(&mut self, system: &S) {
            on_some(4, system.name(), 2 * N + 3, |u| {
                let (t, x) = system.sample(&u[1..]);
                let from = |error: SensitivityError| error.to_string();
                let (by, steps, until) =
                    (GaussCollocation { stages: 4 }, Steps::Size(step_from(u[0])), Until::Steps(5));
                let typed = Problem::new(system, t, x).map_err(|error| error.to_string())?;
                let mut variables: Vec<Variable> = (0..N).map(Variable::Position).collect();
                variables.extend((0..N).map(Variable::Velocity));
                variables.extend([Variable::Action, Variable::StartTime, Variable::EndTime]);
                let one = typed.by(by).steps(steps).tangent(&variables, until).map_err(from)?;
                let seen = Seen(system);
                let problem = SystemProblem::new(&seen, t, Point::from(x)).map_err(|error| error.to_string())?;
                let other = problem.by(by).steps(steps).tangent(&variables, until).map_err(from)?;
                let numbers = |of: &StateDerivative| -> Vec<f64> {
                    of.q.iter().chain(&of.v).chain(&of.p).chain([&of.z]).copied().collect()
                };
                for ((a, b), variable) in one.columns.iter().zip(&other.columns).zip(&variables) {
                    let (a, b) = (numbers(a), numbers(b));
                    let size = a.iter().fold(1.0, |m, x| max_or_nan(m, x.abs())) * one.growth;
                    let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, max_or_nan);
                    if !(a.len() == 3 * N + 1 && b.len() == a.len() && off <= 1e-8 * size) {
                        return Err(format!("in {variable}: {a:?} and {b:?}, off by {off:e}"));
                    }
                }
                Ok(())
            });
        }
    }
    visit_catalogue(&mut Visitor);
}

/// The gradient of a run of many coordinates is the transpose of its tangent, to round-off, and a loss of another number of
/// coordinates is refused.
#[test]
fn gradients_with_many_coordinates() {
    struct Energy;
    impl Loss<24> for Energy {
        fn value<T: Scalar>(&self, end: &EndState<24, T>) -> T {
            end.q.dot(&end.q) + end.v.dot(&end.p) + end.z * end.q[3]
        }
    }
    let system = Dense::new(24, false);
    let problem = SystemProblem::new(&system, 0.0, system.start()).unwrap();
    let run = || problem.by(GaussCollocation { stages: 3 }).steps(Steps::Size(0.2));
    let found = run().gradient(&Energy, Until::Time(2.0)).unwrap();
    let (_, gradient) = found.loss.unwrap();
    let variables = Variable::all(&problem);
    let tangent = run().tangent(&variables, Until::Time(2.0)).unwrap();
    let end = run().record(Until::Time(2.0)).unwrap().end().unwrap();
    let (_, covector) = end.differentiate(&Energy);
    let times = [gradient.t0, gradient.t_end];
    let all = gradient.q.iter().chain(&gradient.rate).chain([&gradient.z]).chain(&times);
    assert_eq!((variables.len(), tangent.columns.len()), (51, 51));
    for ((a, column), variable) in all.zip(&tangent.columns).zip(&variables) {
        let b = column.dot(&covector);
        assert!((a - b).abs() <= 1e-11 * (1.0 + b.abs()), "in {variable}: {a} and {b}");
    }
    struct One;
    impl Loss<1> for One {
        fn value<T: Scalar>(&self, end: &EndState<1, T>) -> T {
            end.q[0]
        }
    }
    let error = run().gradient(&One, Until::Time(2.0)).unwrap_err().to_string();
    assert!(error.contains("24") && error.contains("the argument of the loss"), "{error}");
}

/// Coupled oscillators with drag, `L = v^2/2 - q.Kq/2 + gamma z`, with a dense matrix K; the claim that the mass is
/// constant saves its inverses.
struct Dense {
    k: DMatrix<f64>,
    gamma: f64,
    claims: bool,
}

impl Dense {
    /// Frequencies between 1 and 2, in directions that mix all coordinates.
    fn new(n: usize, claims: bool) -> Self {
        let u = DVector::from_fn(n, |i, _| (1.3 * i as f64 + 0.4).sin()).normalize();
        let mirror = DMatrix::identity(n, n) - &u * u.transpose() * 2.0;
        let squares = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| (1.0 + i as f64 / n as f64).powi(2)));
        Dense { k: &mirror * squares * &mirror, gamma: -0.2, claims }
    }

    fn start(&self) -> Point {
        let n = self.k.nrows();
        Point {
            q: Vector::from_fn(n, |i| (0.7 * i as f64).cos()),
            v: Vector::from_fn(n, |i| (0.3 * i as f64).sin()),
            z: 0.1,
        }
    }

    /// The position at a time, mode by mode: `x = e^(gamma t/2) (x0 cos wt + (v0 - gamma x0/2)/w sin wt)`.
    fn solution(&self, t: f64) -> DVector<f64> {
        let SymmetricEigen { eigenvectors: modes, eigenvalues } = self.k.clone().symmetric_eigen();
        let Point { q, v, .. } = self.start();
        let [q, v] = [&q, &v].map(|x| modes.transpose() * DVector::from_column_slice(x));
        let half = 0.5 * self.gamma;
        modes
            * DVector::from_fn(q.len(), |i, _| {
                let w = (eigenvalues[i] - half * half).sqrt();
                (half * t).exp() * (q[i] * (w * t).cos() + (v[i] - half * q[i]) / w * (w * t).sin())
            })
    }
}

impl System for Dense {
    fn dimension(&self) -> usize {
        self.k.nrows()
    }
    fn structure(&self) -> Structure {
        Structure { constant_mass: self.claims, ..Structure::default() }
    }
    fn value(&self, _t: f64, x: &Point) -> f64 {
        let q = DVector::from_column_slice(&x.q);
        0.5 * (x.v.norm_squared() - q.dot(&(&self.k * &q))) + self.gamma * x.z
    }
    fn gradient(&self, _t: f64, x: &Point) -> Components {
        let force = &self.k * DVector::from_column_slice(&x.q) * -1.0;
        Components { x: force.as_slice().into(), y: x.v.clone(), z: self.gamma }
    }
    fn hessian(&self, _t: f64, x: &Point) -> SecondDerivatives {
        let n = x.q.len();
        let (zeros, line) = (DMatrix::zeros(n, n), Vector::zeros(n));
        SecondDerivatives { qq: -&self.k, qv: zeros, vv: DMatrix::identity(n, n), qz: line.clone(), vz: line, zz: 0.0 }
    }
}

fn error(system: &Dense, steps: Option<(usize, f64)>, t: f64) -> f64 {
    let problem = SystemProblem::new(system, 0.0, system.start()).unwrap();
    let run = match steps {
        Some((stages, h)) => problem.by(GaussCollocation { stages }).steps(Steps::Size(h)),
        None => problem.accuracy(1e-9),
    };
    let outcome = run.run(Until::Time(t)).unwrap();
    assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None));
    let exact = system.solution(t);
    (DVector::from_column_slice(&outcome.q) - &exact).norm() / exact.norm()
}

/// A dense system of 200 coordinates runs, to the accuracy that is requested.
#[test]
fn a_dense_system_of_two_hundred_coordinates() {
    let system = Dense::new(200, true);
    let found = error(&system, None, 3.0);
    assert!(found <= 1e-9, "{found:e}");
}

/// The order of the steps, with W constant and with W inverted at each stage: within 0.15 of twice the number of stages.
#[test]
fn the_order_is_twice_the_number_of_stages() {
    for claims in [false, true] {
        let system = Dense::new(24, claims);
        for stages in [1, 2, 3] {
            let points: Vec<_> = [0.2, 0.1, 0.05].map(|h| (h, error(&system, Some((stages, h)), 2.0))).into();
            let order = slope(&points);
            assert!((order - 2.0 * stages as f64).abs() <= 0.15, "{stages} stages: order {order}, {points:?}");
        }
    }
}

/// A false claim that the mass is constant is found before the run.
#[test]
fn a_false_claim_of_a_constant_mass_is_refused() {
    struct Heavier;
    impl System for Heavier {
        fn dimension(&self) -> usize {
            1
        }
        fn structure(&self) -> Structure {
            Structure { constant_mass: true, ..Structure::default() }
        }
        fn value(&self, _t: f64, x: &Point) -> f64 {
            0.5 * (1.0 + x.q[0] * x.q[0]) * x.v[0] * x.v[0]
        }
        fn gradient(&self, _t: f64, x: &Point) -> Components {
            let (q, v) = (x.q[0], x.v[0]);
            Components { x: [q * v * v].into(), y: [(1.0 + q * q) * v].into(), z: 0.0 }
        }
        fn hessian(&self, _t: f64, x: &Point) -> SecondDerivatives {
            let (q, v, one) = (x.q[0], x.v[0], |x: f64| DMatrix::from_element(1, 1, x));
            let zero = Vector::zeros(1);
            SecondDerivatives {
                qq: one(v * v),
                qv: one(2.0 * q * v),
                vv: one(1.0 + q * q),
                qz: zero.clone(),
                vz: zero,
                zz: 0.0,
            }
        }
    }
    let found = SystemProblem::new(&Heavier, 0.0, Point::new([1.0], [0.5], 0.0)).err();
    let refused = matches!(found, Some(discrete_herglotz::InputError::FalseClaim { claim: "constant_mass", .. }));
    assert!(refused, "{found:?}");
}
