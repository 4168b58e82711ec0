//! Derivatives of runs under constraints in parameters, in the times of the run and in its start.

use super::runs::{METHODS, swung};
use contact_geom::constraints::{Constraint, Distribution};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, Parametric, Scalar, Structure, VelocityPoint};
use discrete_herglotz::constraints::{Constrained, ConstrainedMethod, LagrangeDAlembert};
use discrete_herglotz::sensitivity::{EndCovector, SensitivityError, Variable};
use discrete_herglotz::{Problem, SplittingScheme, Steps, Until};

/// A pendulum with two masses, one for each axis, in a field that changes with time, with drag; `bend` is the factor of
/// terms that are nonlinear in q, v and z, and is 0 for RATTLE.
#[derive(Clone, Copy, Debug)]
struct Swing {
    theta: [f64; 4],
    bend: f64,
}

const NAMES: [&str; 4] = ["mass", "ratio", "gravity", "gamma"];

impl Swing {
    fn new(bend: f64) -> Self {
        Swing { theta: [1.2, 0.7, 1.1, -0.15], bend }
    }

    fn of<C: Coefficient, T: ScalarOver<C>>(&self, theta: [C; 4], t: T, [q, v]: [&SVector<T, 2>; 2], z: T) -> T {
        let [mass, ratio, gravity, gamma] = theta;
        let kinetic = (v[0] * v[0] + v[1] * v[1] * ratio) * (mass * 0.5);
        let bent = v[0] * v[1] * q[0] * ratio - v.dot(v) * z * 0.3 - z * z * 0.2 * gravity + v[0] * q[1] * z;
        kinetic - q[1] * (t.sin() * 0.4 + 1.0) * gravity + z * gamma + bent * self.bend
    }
}

impl Lagrangian<2> for Swing {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        self.of(self.theta, t, [q, v], z)
    }
    fn structure(&self) -> Structure {
        let plain = self.bend == 0.0;
        Structure {
            z_affine: plain,
            constant_rate: plain,
            separable: plain,
            constant_mass: plain,
            ..Structure::default()
        }
    }
}

impl Parametric<2> for Swing {
    fn parameter_names(&self) -> Vec<String> {
        NAMES.map(str::to_owned).to_vec()
    }
    fn parameters(&self) -> Vec<f64> {
        self.theta.to_vec()
    }
    fn parameter_count(&self) -> usize {
        4
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        Some(Swing { theta: theta.try_into().ok()?, ..*self })
    }
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        self.of([theta[0], theta[1], theta[2], theta[3]], t, [q, v], z)
    }
}

/// The unit circle, as a constraint on positions and on velocities.
#[derive(Clone, Copy, Debug)]
struct Circle;

impl Constraint<2, 1> for Circle {
    fn value<T: Scalar>(&self, q: &SVector<T, 2>) -> SVector<T, 1> {
        SVector::from([q.dot(q) - T::one()])
    }
}

impl Distribution<2, 1> for Circle {
    fn omega<T: Scalar>(&self, q: &SVector<T, 2>) -> SMatrix<T, 1, 2> {
        q.transpose()
    }
}

const SPAN: [f64; 2] = [0.3, 1.5];
const START: [f64; 2] = [1.0, 0.8];

/// The numbers of the end of a run of twelve steps: q, v, p, z.
fn end(swing: &Swing, method: ConstrainedMethod, [t0, t1]: [f64; 2], [angle, speed]: [f64; 2]) -> SVector<f64, 7> {
    let problem = Problem::new(swing, t0, swung(angle, speed)).unwrap();
    let run =
        problem.by(Constrained::<_, 1>::new(Circle, method)).steps(Steps::Count(12)).run(Until::Time(t1)).unwrap();
    let (q, v, p) = (run.q, run.v.unwrap(), run.p);
    SVector::from([q[0], q[1], v[0], v[1], p[0], p[1], run.z.unwrap()])
}

/// The derivatives of a run in each parameter and in its times are those of differences of runs, and so is that along
/// the constraint; the gradient is their transpose.
#[test]
fn runs_are_differentiated_in_parameters_and_times() {
    let names = NAMES.map(|name| Variable::Parameter(name.to_owned()));
    let of_start = [Variable::Position(0), Variable::Position(1), Variable::Velocity(0), Variable::Velocity(1)];
    let variables: Vec<_> = names.into_iter().chain([Variable::StartTime, Variable::EndTime]).chain(of_start).collect();
    for method in METHODS {
        let bent = matches!(method, ConstrainedMethod::Lobatto { .. });
        let swing = Swing::new(if bent { 0.5 } else { 0.0 });
        let problem = Problem::new(&swing, SPAN[0], swung(START[0], START[1])).unwrap();
        let run = || problem.by(Constrained::<_, 1>::new(Circle, method)).steps(Steps::Count(12));
        let found = run().tangent(&variables, Until::Time(SPAN[1])).unwrap();
        let column = |k: usize| {
            let column = &found.columns[k];
            SVector::<f64, 7>::from_iterator(
                column.q.iter().chain(&column.v).chain(&column.p).copied().chain([column.z]),
            )
        };
        // Parameters, times, the angle of the start, which turns the velocity, and its speed.
        let shifted = |k: usize, by: f64| {
            let (mut swing, mut span, mut start) = (swing, SPAN, START);
            match k {
                0..4 => swing.theta[k] += by,
                4 | 5 => span[k - 4] += by,
                _ => start[k - 6] += by,
            }
            end(&swing, method, span, start)
        };
        let (s, c) = f64::sin_cos(START[0]);
        let along = |[x, y, u, v]: [f64; 4]| column(6) * x + column(7) * y + column(8) * u + column(9) * v;
        let derivatives: Vec<SVector<f64, 7>> =
            (0..6).map(column).chain([along([c, s, -START[1] * s, START[1] * c]), along([0.0, 0.0, c, s])]).collect();
        let d = 1e-3;
        for (k, derivative) in derivatives.iter().enumerate() {
            let slope =
                ((shifted(k, d) - shifted(k, -d)) * 8.0 - (shifted(k, 2.0 * d) - shifted(k, -2.0 * d))) / (12.0 * d);
            for i in 0..7 {
                let off = derivative[i] - slope[i];
                // Differences of fourth order: d^4/30 times fifth derivatives below 1e3, and the round-off of twelve
                // steps divided by d.
                assert!(off.abs() < 4e-11, "{method:?}, variable {k}, number {i}: {} and {}", derivative[i], slope[i]);
            }
            assert!(slope.norm() > 1e-2, "{method:?}, variable {k}");
        }
        // The transpose, to the round-off of sums of a hundred terms of order one.
        let covector =
            EndCovector { t: 0.0, q: [0.3, -0.8].into(), v: [0.5, 0.2].into(), p: [-0.4, 1.1].into(), z: 0.7 };
        let gradient = run().gradient_of(|_| (0.0, covector.clone()), Until::Time(SPAN[1])).unwrap().loss.unwrap().1;
        let times = [gradient.t0, gradient.t_end];
        for (k, by_adjoint) in gradient.parameters.iter().chain(&times).enumerate() {
            let forward = found.columns[k].dot(&covector);
            assert!(
                (by_adjoint - forward).abs() < 1e-13 * (1.0 + forward.abs()),
                "{method:?}, variable {k}: {by_adjoint} and {forward}"
            );
        }
    }
}

/// What is not implemented under constraints is refused by name.
#[test]
fn derivatives_that_are_not_implemented_are_refused() {
    let swing = Swing::new(0.0);
    let problem = Problem::new(&swing, 0.0, swung(START[0], START[1])).unwrap();
    let by = LagrangeDAlembert::<_, 1>::new(Circle, SplittingScheme::STRANG);
    let tangent = problem.by(by).steps(Steps::Count(4)).tangent(&[Variable::Action], Until::Time(0.1)).err().unwrap();
    assert!(matches!(tangent, SensitivityError::UnderConstraints { what: "derivatives", .. }), "{tangent}");
    assert!(tangent.to_string().contains("lagrange_d_alembert_midpoint_by_strang"), "{tangent}");
    let by = LagrangeDAlembert::<_, 1>::new(Circle, SplittingScheme::STRANG);
    let exponents = problem.by(by).steps(Steps::Count(4)).lyapunov_exponents(Until::Time(0.1)).err().unwrap();
    assert!(matches!(exponents, SensitivityError::UnderConstraints { what: "Lyapunov exponents", .. }), "{exponents}");
    // Those under a constraint on positions are of the three directions that it leaves.
    let rattle = Constrained::<_, 1>::new(Circle, METHODS[0]);
    let found = problem.by(rattle).steps(Steps::Count(4)).lyapunov_exponents(Until::Time(0.1)).unwrap();
    assert_eq!((found.exponents.len(), found.pairs.len()), (3, 0));
}

/// Under an integrable distribution the nonholonomic motion is that under the constraint, up to the orders of the
/// methods.
#[test]
fn an_integrable_distribution_gives_the_motion_under_the_constraint() {
    let swing = Swing::new(0.5);
    let holonomic = end(&swing, ConstrainedMethod::Lobatto { stages: 8 }, SPAN, START);
    let problem = Problem::new(&swing, SPAN[0], swung(START[0], START[1])).unwrap();
    let by = LagrangeDAlembert::<_, 1>::new(Circle, SplittingScheme::KAHAN_LI_8);
    let run = problem.by(by).steps(Steps::Count(24)).run(Until::Time(SPAN[1])).unwrap();
    let off = run.q.fixed::<2>() - SVector::from([holonomic[0], holonomic[1]]);
    // The step of 0.05 to the power of 8, times derivatives below 1e2.
    assert!(off.norm() < 4e-9, "{off}");
    let v: VelocityPoint<2> = VelocityPoint { q: run.q.fixed(), v: run.v.unwrap().fixed(), z: run.z.unwrap() };
    assert!(v.q.dot(&v.v).abs() < 1e-14 && (v.z - holonomic[6]).abs() < 4e-9, "{v:?}");
}
