//! Second derivatives against differences of first ones, forward and by the adjoint; and their symmetry.

use crate::lagrangians::{One, Two};
use crate::second_derivatives::systems::General;
use contact_geom::nalgebra::{DVector, SVector};
use contact_geom::numbers::max_or_nan;
use contact_geom::systems::{Kepler, Pendulum, System};
use contact_geom::{Forced, Parametric, Scalar, VelocityDrag, VelocityPoint, legendre};
use discrete_herglotz::sensitivity::{EndState, Gradient, Loss, StateDerivative, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Start, Status, Steps, Until};

/// A run whose derivatives are compared.
struct Case<'a, L, const N: usize> {
    lagrangian: &'a L,
    t0: f64,
    start: VelocityPoint<N>,
    from_momentum: bool,
    t_end: f64,
    steps: usize,
    stages: usize,
    /// The first distance of the differences.
    distance: f64,
}

/// A loss that is nonlinear in all components of the end.
struct Mixture;

impl<const N: usize> Loss<N> for Mixture {
    fn value<T: Scalar>(&self, end: &EndState<N, T>) -> T {
        let EndState { t, q, v, p, z } = end;
        let mut sum = (*t * 0.3 + *z).sin();
        for i in 0..N {
            sum += q[i] * q[i] * v[i] + (p[i] * 0.5).cos() * *z + q[i] * p[(i + 1) % N] * *t;
        }
        sum
    }
}

impl<L: Parametric<N>, const N: usize> Case<'_, L, N> {
    /// Applies a function to the problem with a variable moved by a distance, and to its end time.
    fn moved<T>(&self, variable: &Variable, by: f64, f: impl Fn(&Problem<'_, L, N>, f64) -> T) -> T {
        let mut start = if self.from_momentum {
            Start::Momentum(legendre(self.lagrangian, self.t0, &self.start), self.start.v)
        } else {
            self.start.into()
        };
        let (mut t0, mut t_end, mut changed) = (self.t0, self.t_end, None);
        let (Start::Velocity(VelocityPoint { q, v: rate, z })
        | Start::Momentum(contact_geom::PhasePoint { q, p: rate, z }, _)) = &mut start;
        match variable {
            Variable::Position(i) => q[*i] += by,
            Variable::Velocity(i) | Variable::Momentum(i) => rate[*i] += by,
            Variable::Action => *z += by,
            Variable::StartTime => t0 += by,
            Variable::EndTime => t_end += by,
            Variable::Parameter(name) => {
                let mut theta = self.lagrangian.parameters();
                theta[self.lagrangian.parameter_index(name).unwrap()] += by;
                changed = Some(self.lagrangian.with_parameters(&theta).unwrap());
            }
        }
        f(&Problem::new(changed.as_ref().unwrap_or(self.lagrangian), t0, start).unwrap(), t_end)
    }

    /// Central differences, extrapolated four times.
    fn difference(&self, variable: &Variable, f: impl Fn(&Problem<'_, L, N>, f64) -> DVector<f64>) -> DVector<f64> {
        const LEVELS: usize = 5;
        let mut table: Vec<DVector<f64>> = (0..LEVELS)
            .map(|level| {
                let by = self.distance * 0.5_f64.powi(level as i32);
                let [a, b] = [by, -by].map(|by| self.moved(variable, by, &f));
                (a - b) / (2.0 * by)
            })
            .collect();
        for order in 1..LEVELS {
            let factor = 4.0_f64.powi(order as i32);
            for level in (order..LEVELS).rev() {
                table[level] = &table[level] + (&table[level] - &table[level - 1]) / (factor - 1.0);
            }
        }
        table.pop().unwrap()
    }

    /// Compares second derivatives with differences of tangents, and the Hessian matrix of a loss with differences of
    /// gradients by the adjoint. Tolerances are relative to the largest second derivative.
    ///
    /// First derivatives have errors of 3e-13 by round-off, which differences divide by the smallest distance, 1/16 of the
    /// first one. The derivatives of the end of other orders amplify it, and the last extrapolation is in error by the tenth
    /// power of the distances: `difference`.
    ///
    /// Second derivatives along two directions in either order have different round-off, which is amplified as that of the
    /// first ones: 1e-12.
    fn compare(&self, name: &str, difference: f64) {
        let steps = |problem: &Problem<'_, L, N>, f: &dyn Fn(discrete_herglotz::Run<'_, '_, L, N>) -> DVector<f64>| {
            f(problem.by(GaussCollocation { stages: self.stages }).steps(Steps::Count(self.steps)))
        };
        let still = Variable::Action;
        let variables = self.moved(&still, 0.0, |problem, _| Variable::all(problem));
        let count = variables.len();
        let units: Vec<Vec<f64>> =
            (0..count).map(|i| (0..count).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        let run = |problem: &Problem<'_, L, N>, until: f64| {
            let run = || problem.by(GaussCollocation { stages: self.stages }).steps(Steps::Count(self.steps));
            let until = Until::Time(until);
            let all = run().second_tangent(&variables, until).unwrap();
            assert_eq!(all.outcome.status, Status::Completed, "{name}");
            // The run that is differentiated is the run, bit for bit.
            let plain = run().tangent(&variables, until).unwrap();
            assert_eq!(
                (all.outcome.q, all.outcome.p, all.outcome.z),
                (plain.outcome.q, plain.outcome.p, plain.outcome.z)
            );
            assert_eq!(all.end.as_ref().unwrap().columns, plain.columns, "{name}");
            let along = run().second_tangent_along(&variables, &units, until).unwrap();
            let hessian = run().hessian(&Mixture, &variables, until).unwrap();
            let direction: Vec<f64> = (0..count).map(|i| 0.4 - 0.3 * i as f64).collect();
            let product = run().hessian_along(&Mixture, &variables, std::slice::from_ref(&direction), until).unwrap();
            assert_eq!(all.outcome.status, Status::Completed, "{name}");
            (all.end.unwrap(), along.end.unwrap(), hessian.loss.unwrap(), product.loss.unwrap(), direction)
        };
        let (all, along, hessian, product, direction) = self.moved(&still, 0.0, run);
        let rows = |second: &[StateDerivative<N>]| DVector::from_vec(second.iter().flat_map(numbers).collect());
        let size = all.second.iter().flatten().flat_map(numbers).fold(0.0, |m, x| max_or_nan(m, x.abs()));
        let of_hessian = hessian.hessian.iter().fold(0.0, |m, x| max_or_nan(m, x.abs()));
        assert!(size > 0.1 && of_hessian > 0.1, "{name}: {size}, {of_hessian}");
        let close = |a: &DVector<f64>, b: &DVector<f64>, size: f64, bound: f64, what: &str| {
            let apart = (a - b).iter().fold(0.0, |m, x| max_or_nan(m, x.abs())) / size;
            assert!(apart <= bound, "{name}: {what}: apart {apart:e}\n{a}{b}");
        };
        for (i, variable) in variables.iter().enumerate() {
            let column: Vec<_> = along.second.iter().map(|row| row[i]).collect();
            close(&rows(&along.second[i]), &rows(&column), size, 1e-12, &format!("symmetry, {variable}"));
            close(&rows(&all.second[i]), &rows(&column), size, 1e-12, &format!("pairs, {variable}"));
            let differences = self.difference(variable, |problem, until| {
                let until = Until::Time(until);
                steps(problem, &|run| rows(&run.tangent(&variables, until).unwrap().columns))
            });
            close(&rows(&all.second[i]), &differences, size, difference, &format!("tangents, {variable}"));
            let differences = self.difference(variable, |problem, until| {
                let until = Until::Time(until);
                steps(problem, &|run| gradient(&run.gradient(&Mixture, until).unwrap().loss.unwrap().1))
            });
            let row = hessian.hessian.row(i).transpose();
            close(&row, &differences, of_hessian, difference, &format!("gradients, {variable}"));
        }
        let expected = &hessian.hessian * DVector::from_vec(direction);
        let scale = of_hessian * count as f64;
        close(&product.hessian.row(0).transpose(), &expected, scale, 1e-12, "the product with a direction");
    }
}

/// The components q, v, p, z.
fn numbers<const N: usize>(x: &StateDerivative<N>) -> Vec<f64> {
    x.q.iter().chain(&x.v).chain(&x.p).chain([&x.z]).copied().collect()
}

/// The components in the order of [`Variable::all`].
fn gradient<const N: usize>(of: &Gradient<N>) -> DVector<f64> {
    let start = of.q.iter().chain(&of.rate).chain([&of.z]);
    DVector::from_vec(start.chain(&of.parameters).chain([&of.t0, &of.t_end]).copied().collect())
}

/// The pendulum `v^2/2 - 1 + cos q + gamma z` over one period and a half.
#[test]
fn the_pendulum_of_the_issue() {
    let pendulum = One::from(Pendulum { gamma: -0.01 });
    for (from_momentum, stages, steps) in [(false, 8, 40), (true, 12, 20), (false, 2, 60)] {
        let start = VelocityPoint::new([1.0], [1.0], 0.0);
        let (t0, t_end, distance) = (0.0, 10.0, 1.0 / 32.0);
        let case = Case { lagrangian: &pendulum, t0, start, from_momentum, t_end, steps, stages, distance };
        case.compare(&format!("{stages} stages"), 1e-8);
    }
}

/// The Kepler problem with the drag `gamma z`, and with a drag of the velocity as well.
#[test]
fn kepler_with_drag() {
    let kepler = Kepler::<2>::default();
    let (t0, t_end, distance) = (0.0, 3.0, 1.0 / 64.0);
    let case = Case {
        lagrangian: &Two::from(kepler),
        t0,
        start: kepler.initial(),
        from_momentum: false,
        t_end,
        steps: 30,
        stages: 6,
        distance,
    };
    case.compare("Kepler", 1e-8);
    // A stronger drag leads to the centre.
    let force = VelocityDrag { linear: SVector::from([0.02, 0.05]), quadratic: 0.1 };
    let forced = Two::from(Forced::new(kepler, force.into()));
    let start = VelocityPoint::new([1.0, 0.1], [0.2, 0.9], 0.3);
    for from_momentum in [false, true] {
        let distance = 1.0 / 128.0;
        let case = Case { lagrangian: &forced, t0, start, from_momentum, t_end, steps: 30, stages: 5, distance };
        case.compare("Kepler with a drag of the velocity", 1e-8);
    }
}

/// All terms of the equations; forward and backward in time.
#[test]
fn a_general_lagrangian() {
    let general = Two::from(General { m: 1.3, k: 0.7 });
    for (from_momentum, stages, span) in [(false, 1, 0.8), (true, 4, 0.8), (false, 9, -0.8)] {
        let (t0, start) = (0.2, VelocityPoint::new([0.3, -0.4], [0.5, 0.2], 0.6));
        let (t_end, distance) = (t0 + span, 1.0 / 32.0);
        let case = Case { lagrangian: &general, t0, start, from_momentum, t_end, steps: 3, stages, distance };
        case.compare(&format!("{stages} stages"), 1e-8);
    }
}
