//! Differences of runs, and the comparison of all derivatives with each other.

use contact_geom::numbers::max_or_nan;
use contact_geom::{Parametric, VelocityPoint, legendre};
use discrete_herglotz::rules::{self, CompositionMethod};
use discrete_herglotz::sensitivity::{EndCovector, StateDerivative, Tangent, Variable};
use discrete_herglotz::{
    GaussCollocation, Outcome, Problem, Run, SplittingScheme, Start, Status, Steps, Until, Vector,
};

/// An integrator whose runs are differentiated.
pub trait Method: Copy {
    fn run<'p, 'o, L: Parametric<N>, const N: usize>(
        self,
        problem: &'p Problem<'_, L, N>,
    ) -> Run<'p, 'o, Problem<'p, L, N>>;
}

impl Method for GaussCollocation {
    fn run<'p, 'o, L: Parametric<N>, const N: usize>(
        self,
        problem: &'p Problem<'_, L, N>,
    ) -> Run<'p, 'o, Problem<'p, L, N>> {
        problem.by(self)
    }
}

impl Method for SplittingScheme {
    fn run<'p, 'o, L: Parametric<N>, const N: usize>(
        self,
        problem: &'p Problem<'_, L, N>,
    ) -> Run<'p, 'o, Problem<'p, L, N>> {
        problem.by(self)
    }
}

impl Method for rules::Method {
    fn run<'p, 'o, L: Parametric<N>, const N: usize>(
        self,
        problem: &'p Problem<'_, L, N>,
    ) -> Run<'p, 'o, Problem<'p, L, N>> {
        problem.by(self)
    }
}

/// Compositions.
impl Method for (rules::Method, SplittingScheme) {
    fn run<'p, 'o, L: Parametric<N>, const N: usize>(
        self,
        problem: &'p Problem<'_, L, N>,
    ) -> Run<'p, 'o, Problem<'p, L, N>> {
        problem.by(CompositionMethod::new(self.0, self.1))
    }
}

/// A run of a system.
pub struct Case<'a, L, M, const N: usize> {
    pub lagrangian: &'a L,
    pub t0: f64,
    pub start: VelocityPoint<N>,
    pub from_momentum: bool,
    pub t_end: f64,
    pub steps: usize,
    pub method: M,
}

impl<L: Parametric<N>, M: Method, const N: usize> Case<'_, L, M, N> {
    fn start(&self) -> Start<N> {
        if self.from_momentum {
            Start::Momentum(legendre(self.lagrangian, self.t0, &self.start), self.start.v)
        } else {
            self.start.into()
        }
    }

    pub fn problem(&self) -> Problem<'_, L, N> {
        Problem::new(self.lagrangian, self.t0, self.start()).unwrap()
    }

    /// The end of the run with a variable moved by a distance.
    fn moved(&self, variable: &Variable, by: f64) -> Outcome {
        let (mut start, mut t0, mut t_end) = (self.start(), self.t0, self.t_end);
        let mut changed = None;
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
        let lagrangian = changed.as_ref().unwrap_or(self.lagrangian);
        let problem = Problem::new(lagrangian, t0, start).unwrap();
        let run = self.method.run(&problem).steps(Steps::Count(self.steps));
        let outcome = run.run(Until::Time(t_end)).unwrap();
        assert_eq!(outcome.status, Status::Completed);
        outcome
    }

    /// Central differences of the run, extrapolated four times: the error is of order ten in the distance, and round-off
    /// of the run is divided by the smallest distance, 1/2048 of a typical value.
    fn difference(&self, variable: &Variable) -> StateDerivative {
        const LEVELS: usize = 5;
        let mut table: Vec<StateDerivative> = (0..LEVELS)
            .map(|level| {
                let by = 0.5_f64.powi(7 + level as i32);
                let [a, b] = [by, -by].map(|by| self.moved(variable, by));
                let over = |a: &Vector, b: &Vector| (a - b) / (2.0 * by);
                StateDerivative {
                    q: over(&a.q, &b.q),
                    v: over(&a.v.unwrap(), &b.v.unwrap()),
                    p: over(&a.p, &b.p),
                    z: (a.z.unwrap() - b.z.unwrap()) / (2.0 * by),
                }
            })
            .collect();
        for order in 1..LEVELS {
            let factor = 4.0_f64.powi(order as i32);
            for level in (order..LEVELS).rev() {
                let (coarse, fine) = (&table[level - 1], &table[level]);
                let better = |fine: f64, coarse: f64| fine + (fine - coarse) / (factor - 1.0);
                let each =
                    |fine: &Vector, coarse: &Vector| fine.iter().zip(coarse).map(|(a, b)| better(*a, *b)).collect();
                table[level] = StateDerivative {
                    q: each(&fine.q, &coarse.q),
                    v: each(&fine.v, &coarse.v),
                    p: each(&fine.p, &coarse.p),
                    z: better(fine.z, coarse.z),
                };
            }
        }
        table.swap_remove(LEVELS - 1)
    }

    /// Whether the motion is completed, with an end that differs by at most a twentieth from that of a run with twice as
    /// many steps.
    pub fn is_resolved(&self) -> bool {
        let problem = self.problem();
        let end = |steps: usize| {
            let outcome = self.method.run(&problem).steps(Steps::Count(steps)).run(Until::Time(self.t_end)).ok()?;
            (outcome.status == Status::Completed).then_some(outcome.q.fixed::<N>())
        };
        match (end(self.steps), end(2 * self.steps)) {
            (Some(coarse), Some(fine)) => (coarse - fine).norm() <= 0.05 * (1.0 + fine.norm()),
            _ => false,
        }
    }

    /// Compares tangents with gradients, and both with differences, for every variable; the tolerances are relative to
    /// the largest derivative.
    pub fn compare(&self, name: &str, adjoint: f64, difference: f64) {
        let (variables, tangent, size) = self.agree(name, adjoint);
        for (variable, column) in variables.iter().zip(&tangent.columns) {
            let differences = numbers(&self.difference(variable));
            for (i, (of_column, of_difference)) in numbers(column).into_iter().zip(differences).enumerate() {
                let what = format!("{name}, component {i} in {variable:?}");
                let apart = (of_column - of_difference).abs() / size;
                assert!(apart <= difference, "{what}: {of_column:e}, difference {of_difference:e}, apart {apart:e}");
            }
        }
    }

    /// Compares tangents with gradients for every variable; the tolerance is relative to the largest derivative, which is
    /// returned with the tangent.
    pub fn agree(&self, name: &str, adjoint: f64) -> (Vec<Variable>, Tangent, f64) {
        let problem = self.problem();
        let run = || self.method.run(&problem).steps(Steps::Count(self.steps));
        let variables = Variable::all(&problem);
        let tangent = run().tangent(&variables, Until::Time(self.t_end)).unwrap();
        let plain = run().run(Until::Time(self.t_end)).unwrap();
        // The run that is differentiated is the run, bit for bit.
        assert_eq!(
            (&tangent.outcome.q, &tangent.outcome.p, tangent.outcome.z),
            (&plain.q, &plain.p, plain.z),
            "{name}"
        );
        let recorded = run().record(Until::Time(self.t_end)).unwrap();
        assert_eq!(
            (&recorded.outcome().q, &recorded.outcome().p, recorded.outcome().z),
            (&plain.q, &plain.p, plain.z),
            "{name}"
        );
        let units: Vec<EndCovector> = (0..3 * N + 1).map(unit::<N>).collect();
        let gradients = recorded.pullbacks(&units).unwrap();
        let size = tangent.columns.iter().flat_map(numbers).fold(1e-30, |m, x| max_or_nan(m, x.abs()));
        for (k, (variable, column)) in variables.iter().zip(&tangent.columns).enumerate() {
            assert_eq!(numbers(column).len(), 3 * N + 1, "{name}");
            for (i, of_column) in numbers(column).into_iter().enumerate() {
                let gradient = &gradients[i];
                let all: Vec<f64> = gradient
                    .q
                    .iter()
                    .chain(&gradient.rate)
                    .chain([&gradient.z])
                    .chain(&gradient.parameters)
                    .chain([&gradient.t0, &gradient.t_end])
                    .copied()
                    .collect();
                let of_gradient = all[k];
                let what = format!("{name}, component {i} in {variable:?}");
                let apart = (of_column - of_gradient).abs() / size;
                assert!(apart <= adjoint, "{what}: forward {of_column:e}, backward {of_gradient:e}, apart {apart:e}");
            }
        }
        (variables, tangent, size)
    }
}

/// The components q, v, p, z.
fn numbers(x: &StateDerivative) -> Vec<f64> {
    x.q.iter().chain(&x.v).chain(&x.p).chain([&x.z]).copied().collect()
}

/// The covector of a component, in the same order.
fn unit<const N: usize>(index: usize) -> EndCovector {
    let mut covector = EndCovector::zero(N);
    let part = index % N;
    match index / N {
        0 => covector.q[part] = 1.0,
        1 => covector.v[part] = 1.0,
        2 => covector.p[part] = 1.0,
        _ => covector.z = 1.0,
    }
    covector
}

/// Numbers of `[0, 1]` that are equidistributed: the fractional parts of multiples of roots of primes.
pub fn weyl(k: u32, length: usize) -> Vec<f64> {
    const PRIMES: [f64; 14] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0, 41.0, 43.0];
    PRIMES[..length].iter().map(|p| (f64::from(k + 1) * p.sqrt()).fract()).collect()
}
