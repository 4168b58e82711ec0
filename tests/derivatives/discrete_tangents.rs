//! Tangents and gradients of runs by discrete Lagrangians of a user.

use crate::lagrangians::ForcedOne;
use contact_examples::systems::{CoupledInZ, Kepler, OneCoordinate, Pendulum, System};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::max_or_nan;
use contact_geom::{DiscretePoint, Parametric, Scalar, VelocityDrag, VelocityPoint};
use discrete_herglotz::rules::{Method, Rule};
use discrete_herglotz::sensitivity::{EndCovector, SensitivityError, StateDerivative, Variable};
use discrete_herglotz::{CustomMethod, DiscreteLagrangian, Problem, StepError, Steps, Until};

/// The components q, v, p, z.
fn numbers(x: &StateDerivative) -> Vec<f64> {
    x.q.iter().chain(&x.v).chain(&x.p).chain([&x.z]).copied().collect()
}

/// The components of the start.
fn start<L: Parametric<N>, const N: usize>(problem: &Problem<'_, L, N>) -> Vec<Variable> {
    Variable::all(problem)[..=2 * N].to_vec()
}

/// The largest distance of numbers, relative to the largest of them.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let largest = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0, |m, x| max_or_nan(m, x.abs()));
    assert_eq!(a.len(), b.len());
    largest(&mut a.iter().zip(b).map(|(a, b)| a - b)) / largest(&mut b.iter().copied())
}

/// The midpoint rule as a discrete Lagrangian of a user has the tangent, the rows and the gradient of the built-in rule.
///
/// Both linearise the same equations at ends that agree to round-off, in other variables. The mean velocities have errors
/// `eps |q| / h`, with which second derivatives at the nodes change: 100 eps / h.
#[test]
fn the_midpoint_rule() {
    fn compare<const N: usize, L: Parametric<N>>(system: &L, x: VelocityPoint<N>) {
        let h = 0.05;
        let problem = Problem::new(system, 0.3, x).unwrap();
        let (until, times) = (Until::Time(2.3), [0.3, 0.52, 1.3, 2.3]);
        let mine = || problem.by(CustomMethod::new("mine", 2, |h| Rule::MIDPOINT.of(system, h))).steps(Steps::Size(h));
        let built_in = || problem.by(Method::Midpoint).steps(Steps::Size(h));
        let variables = start(&problem);
        let [a, b] = [mine(), built_in()].map(|run| run.tangent_at(&variables, &times, until).unwrap());
        assert_eq!(a.rows.len(), times.len());
        let all = |columns: &[StateDerivative]| columns.iter().flat_map(numbers).collect::<Vec<_>>();
        let bound = 100.0 * f64::EPSILON / h;
        let found = apart(&all(&a.columns), &all(&b.columns));
        assert!(found <= bound, "{found:e}");
        for (a, b) in a.rows.iter().zip(&b.rows) {
            let found = apart(&all(&a.columns), &all(&b.columns));
            assert!(found <= bound, "row at {}: {found:e}", a.state.t);
        }
        let mut covector = EndCovector::zero(N);
        (covector.q[0], covector.v[0], covector.z) = (0.7, -0.3, 0.4);
        let [a, b] = [mine(), built_in()].map(|run| run.record(until).unwrap().pullback(&covector).unwrap());
        let all = |g: &discrete_herglotz::sensitivity::Gradient| {
            g.q.iter().chain(&g.rate).chain([&g.z]).copied().collect::<Vec<_>>()
        };
        let found = apart(&all(&a), &all(&b));
        assert!(found <= bound, "gradients: {found:e}");
        // What the discrete Lagrangian does not tell is no number.
        assert!(a.t0.is_nan() && a.t_end.is_nan() && a.parameters.iter().all(|x| x.is_nan()));
    }
    let pendulum = OneCoordinate::from(Pendulum { gamma: -0.1 });
    compare(&pendulum, VelocityPoint::new([1.0], [0.5], 0.2));
    compare(&Kepler::<2>::default(), Kepler::<2>::default().initial());
    compare(&OneCoordinate::from(CoupledInZ::default()), CoupledInZ::default().initial());
    let force = VelocityDrag { linear: SVector::from([0.2]), quadratic: 0.1 };
    compare(&ForcedOne::new(pendulum, force.into()), VelocityPoint::new([1.0], [0.5], 0.2));
}

/// A discrete Lagrangian of a pendulum that no rule of the library gives, nonlinear in z0, with discrete forces.
struct Mine {
    h: f64,
}

impl DiscreteLagrangian<1> for Mine {
    const FORCED: bool = true;

    fn step_size(&self) -> f64 {
        self.h
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<1, T>) -> Result<T, StepError> {
        let v = (x.q1[0] - x.q0[0]) / T::from(self.h);
        let potential = (x.q0[0] * 0.7 + x.q1[0] * 0.3).cos();
        Ok((v * v * 0.5 + potential - x.z0 * (x.z0 * 0.05 + 0.1) * (v * 0.1 + 1.0 + 0.1 * t)) * self.h)
    }

    fn forces<T: Scalar>(&self, _t: f64, x: &DiscretePoint<1, T>) -> Result<[SVector<T, 1>; 2], StepError> {
        let v = (x.q1[0] - x.q0[0]) / T::from(self.h);
        Ok([[v * v * v * (-0.02 * self.h)].into(), [v * x.z0 * (-0.03 * self.h)].into()])
    }
}

/// The tangent is the limit of differences of runs, and the gradient is its transpose: to the error of differences that
/// are extrapolated four times from the distances 1/16 to 1/256, and to round-off.
#[test]
fn a_discrete_lagrangian_of_a_user() {
    let pendulum = OneCoordinate::from(Pendulum { gamma: -0.1 });
    let x = [0.9, 0.4, 0.3];
    let until = Until::Time(2.0);
    let run = |x: &[f64; 3]| {
        let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([x[0]], [x[1]], x[2])).unwrap();
        let mine = || problem.by(CustomMethod::new("mine", 1, |h| Ok(Mine { h }))).steps(Steps::Size(0.1));
        let tangent = mine().tangent(&start(&problem), until).unwrap();
        let recorded = mine().record(until).unwrap();
        let unit = |i: usize| {
            let mut unit = EndCovector::zero(1);
            [&mut unit.q[0], &mut unit.v[0], &mut unit.p[0], &mut unit.z].into_iter().nth(i).map(|x| *x = 1.0).unwrap();
            recorded.pullback(&unit).unwrap()
        };
        (tangent, [0, 1, 2, 3].map(unit))
    };
    let (tangent, gradients) = run(&x);
    for (i, column) in tangent.columns.iter().enumerate() {
        let end = |by: f64| {
            let mut moved = x;
            moved[i] += by;
            let outcome = run(&moved).0.outcome;
            [outcome.q[0], outcome.v.unwrap()[0], outcome.p[0], outcome.z.unwrap()]
        };
        let mut table: Vec<[f64; 4]> = (0..5)
            .map(|level| {
                let by = 0.0625 * 0.5_f64.powi(level);
                let [a, b] = [end(by), end(-by)];
                std::array::from_fn(|k| (a[k] - b[k]) / (2.0 * by))
            })
            .collect();
        for order in 1..5 {
            for level in (order..5).rev() {
                let coarse = table[level - 1];
                let factor = 4.0_f64.powi(order as i32) - 1.0;
                table[level] = std::array::from_fn(|k| table[level][k] + (table[level][k] - coarse[k]) / factor);
            }
        }
        let found = numbers(column);
        // Newton's method ends at round-off of 1e-14, divided by the smallest distance.
        let distance = apart(&found, &table[4]);
        assert!(distance <= 1e-10, "{i}: {found:?}, {:?}, apart {distance:e}", table[4]);
        let backward: Vec<f64> = gradients.iter().map(|g| [g.q[0], g.rate[0], g.z][i]).collect();
        let distance = apart(&found, &backward);
        assert!(distance <= 64.0 * f64::EPSILON, "{i}: {found:?}, {backward:?}, apart {distance:e}");
    }
}

#[test]
fn variables_that_a_discrete_lagrangian_does_not_tell() {
    let pendulum = OneCoordinate::from(Pendulum { gamma: -0.1 });
    let problem = Problem::new(&pendulum, 0.0, pendulum.initial()).unwrap();
    let mine = || {
        let mine = CustomMethod::new("mine", 2, |h| Rule::MIDPOINT.of(&pendulum, h));
        problem.by(mine).steps(Steps::Size(0.1))
    };
    for (variable, named) in [
        (Variable::Parameter("gamma".into()), "the parameter `gamma`"),
        (Variable::StartTime, "the time of the start"),
        (Variable::EndTime, "the time of the end"),
    ] {
        let found = mine().tangent(&[Variable::Action, variable.clone()], Until::Time(1.0)).unwrap_err();
        assert_eq!(found, SensitivityError::OnlyInStart { method: "mine".into(), variable });
        assert!(
            found.to_string().contains(named) && found.to_string().contains("choose `GaussCollocation`"),
            "{found}"
        );
    }
}
