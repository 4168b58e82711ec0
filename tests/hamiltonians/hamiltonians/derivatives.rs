//! Derivatives of runs on a contact Hamiltonian: forward, adjoint and by differences, whatever the rank of `H_pp`.

use super::systems::{Family, One, Two};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::numbers::max_or_nan;
use contact_geom::{
    ContactHamiltonian, Dual, Lagrangian, OfHamiltonian, Parametric, ParametricHamiltonian, PhasePoint,
};
use contact_geom::{HamiltonianDerivatives, VelocityPoint};
use discrete_herglotz::sensitivity::{
    EndCovector, Gradient, MotionState, SensitivityError, StateDerivative, TangentRow, Variable,
};
use discrete_herglotz::{GaussCollocation, Problem, Run, Start, Status, Steps, Until};

const A: f64 = 0.8;
const B: f64 = 0.3;

fn family(family: Family) -> OfHamiltonian<One> {
    OfHamiltonian(One::Family(family, [A, B]))
}

/// The start of a motion with one coordinate.
fn one() -> Start<1> {
    Start::Momentum(PhasePoint::new([0.4], [0.7], 0.3), [0.0].into())
}

/// The start of a motion with two coordinates.
pub(super) fn two() -> Start<2> {
    Start::Momentum(PhasePoint::new([0.4, -0.2], [0.7, 0.5], 0.3), [0.0, 0.0].into())
}

/// The components q, v, p, z.
fn numbers(x: &StateDerivative) -> Vec<f64> {
    x.q.iter().chain(&x.v).chain(&x.p).chain([&x.z]).copied().collect()
}

/// The covectors of these components.
fn units<const N: usize>() -> Vec<EndCovector> {
    let unit = |index: usize| {
        let mut of = EndCovector::zero(N);
        match index / N {
            0 => of.q[index % N] = 1.0,
            1 => of.v[index % N] = 1.0,
            2 => of.p[index % N] = 1.0,
            _ => of.z = 1.0,
        }
        of
    };
    (0..=3 * N).map(unit).collect()
}

/// The derivatives in the order of [`Variable::all`].
fn entries(of: &Gradient) -> Vec<f64> {
    let start = of.q.iter().chain(&of.rate).chain([&of.z]);
    start.chain(&of.parameters).chain([&of.t0, &of.t_end]).copied().collect()
}

fn largest<'a>(of: impl IntoIterator<Item = &'a f64>) -> f64 {
    of.into_iter().fold(1e-30, |m, x| max_or_nan(m, x.abs()))
}

/// A run of seven steps over the span (0.2, 1.6).
pub(super) struct Case<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub start: Start<N>,
    pub stages: usize,
}

const SPAN: (f64, f64) = (0.2, 1.6);

impl<L: Parametric<N>, const N: usize> Case<'_, L, N> {
    fn problem(&self) -> Problem<'_, L, N> {
        Problem::new(self.lagrangian, SPAN.0, self.start).unwrap()
    }

    fn run<'p>(&self, problem: &'p Problem<'_, L, N>) -> Run<'p, 'p, Problem<'p, L, N>> {
        problem.by(GaussCollocation { stages: self.stages }).steps(Steps::Count(7))
    }

    /// The end `(q, v, p, z)` of the run with a variable moved by a distance.
    fn moved(&self, variable: &Variable, by: f64) -> Vec<f64> {
        let (mut start, (mut t0, mut t_end)) = (self.start, SPAN);
        let mut changed = None;
        let (Start::Velocity(VelocityPoint { q, v: rate, z }) | Start::Momentum(PhasePoint { q, p: rate, z }, _)) =
            &mut start;
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
        let problem = Problem::new(changed.as_ref().unwrap_or(self.lagrangian), t0, start).unwrap();
        let outcome = self.run(&problem).run(Until::Time(t_end)).unwrap();
        assert_eq!(outcome.status, Status::Completed);
        numbers(&StateDerivative { q: outcome.q, v: outcome.v.unwrap(), p: outcome.p, z: outcome.z.unwrap() })
    }

    /// Central differences, extrapolated once: the error is of order four in the distance 1/512, below 1e-9, and the
    /// round-off of a run over this distance is below 1e-11.
    fn difference(&self, variable: &Variable) -> Vec<f64> {
        let at = |by: f64| {
            let (a, b) = (self.moved(variable, by), self.moved(variable, -by));
            a.into_iter().zip(b).map(move |(a, b)| (a - b) / (2.0 * by)).collect::<Vec<_>>()
        };
        let [coarse, fine] = [at(1.0 / 256.0), at(1.0 / 512.0)];
        fine.into_iter().zip(coarse).map(|(fine, coarse)| fine + (fine - coarse) / 3.0).collect()
    }

    /// Forward derivatives, adjoint ones and differences, in all variables. Forward and adjoint derivatives are sums of the
    /// same products in another order; the bound is some hundred units of round-off.
    pub fn compare(&self, name: &str) {
        let problem = self.problem();
        let variables = Variable::all(&problem);
        assert_eq!(variables.len(), 2 * N + 1 + self.lagrangian.parameter_count() + 2);
        let until = Until::Time(SPAN.1);
        let tangent = self.run(&problem).tangent(&variables, until).unwrap();
        let gradients = self.run(&problem).record(until).unwrap().pullbacks(&units::<N>()).unwrap();
        let size = largest(tangent.columns.iter().flat_map(numbers).collect::<Vec<_>>().iter());
        for (k, (variable, column)) in variables.iter().zip(&tangent.columns).enumerate() {
            let differences = self.difference(variable);
            for (i, forward) in numbers(column).into_iter().enumerate() {
                let what = format!("{name}, {} stages, component {i} in {variable}", self.stages);
                let (backward, difference) = (entries(&gradients[i])[k], differences[i]);
                let apart = (forward - backward).abs() / size;
                assert!(apart <= 1e-13, "{what}: forward {forward:e}, adjoint {backward:e}, apart {apart:e}");
                let apart = (forward - difference).abs() / size;
                assert!(apart <= 1e-8, "{what}: {forward:e}, difference {difference:e}, apart {apart:e}");
            }
        }
        self.compare_rows(name, &variables);
    }

    /// The same for states within the run, at times within steps and at the end of one.
    fn compare_rows(&self, name: &str, variables: &[Variable]) {
        let (problem, until) = (self.problem(), Until::Time(SPAN.1));
        let times = [SPAN.0, 0.33, 0.47, SPAN.0 + 0.6, 1.5];
        let rows = self.run(&problem).tangent_at(variables, &times, until).unwrap().rows;
        assert_eq!(rows.len(), times.len());
        let units = units::<N>();
        let of = |i: usize| units[(2 * i + 1) % units.len()].clone();
        let value = |(i, state): (usize, &MotionState)| {
            let MotionState { q, v, p, z, .. } = state.clone();
            StateDerivative { q, v, p, z }.dot(&of(i))
        };
        let loss =
            |states: &[MotionState]| (states.iter().enumerate().map(value).sum(), (0..states.len()).map(of).collect());
        let (_, gradient) = self.run(&problem).gradient_at(&times, loss, until).unwrap().loss.unwrap();
        let size = largest(rows.iter().flat_map(|row| row.columns.iter().flat_map(numbers)).collect::<Vec<_>>().iter());
        for (k, (variable, backward)) in variables.iter().zip(entries(&gradient)).enumerate() {
            let of_row = |(i, row): (usize, &TangentRow)| row.columns[k].dot(&of(i));
            let forward: f64 = rows.iter().enumerate().map(of_row).sum();
            let apart = (forward - backward).abs() / size;
            assert!(apart <= 1e-13, "{name}, rows, {variable}: {forward:e} and {backward:e}");
        }
    }
}

#[test]
fn forward_backward_and_differences_agree() {
    for of in [Family::Nonlinear, Family::Linear, Family::Homogeneous] {
        for stages in [1, 2, 5, 12] {
            Case { lagrangian: &family(of), start: one(), stages }.compare(&format!("{of:?}"));
        }
    }
    let start = Start::Velocity(VelocityPoint::new([0.4], [0.7], 0.3));
    Case { lagrangian: &family(Family::Nonlinear), start, stages: 4 }.compare("from a velocity");
    let ray = OfHamiltonian(Two::Medium([0.25, 0.125]));
    Case { lagrangian: &ray, start: two(), stages: 3 }.compare("ray");
    Case { lagrangian: &OfHamiltonian(Two::Nonlinear), start: two(), stages: 4 }.compare("two coordinates");
}

/// The tangent in (q, p, z) has the determinant `sigma^(n+1)`, and maps vectors with `dz = p.dq` to such vectors. The bounds
/// are a thousand units of round-off.
#[test]
fn the_tangent_is_conformally_contact() {
    fn check<H: ParametricHamiltonian<N>, const N: usize>(name: &str, of: &OfHamiltonian<H>, start: Start<N>) {
        let case = Case { lagrangian: of, start, stages: 3 };
        let problem = case.problem();
        let variables: Vec<Variable> = Variable::all(&problem).into_iter().take(2 * N + 1).collect();
        let run = case.run(&problem).with_conformal_factor();
        let tangent = run.tangent(&variables, Until::Time(SPAN.1)).unwrap();
        let p = problem.state().p;
        let columns = &tangent.columns;
        let entry = |i: usize, j: usize| match i {
            i if i < N => columns[j].q[i],
            i if i < 2 * N => columns[j].p[i - N],
            _ => columns[j].z,
        };
        let matrix = DMatrix::from_fn(2 * N + 1, 2 * N + 1, entry);
        let expected = (tangent.outcome.log_factor.unwrap() * (N as f64 + 1.0)).exp();
        assert!((expected - 1.0).abs() > 1e-2, "{name}: the factor is {expected}");
        let off = (matrix.determinant() / expected - 1.0).abs();
        assert!(
            off <= 1e3 * f64::EPSILON * largest(matrix.iter()).powi(2),
            "{name}: the determinant is off by {off:e}"
        );
        for j in 0..2 * N {
            let dz = if j < N { p[j] } else { 0.0 };
            let (dq, dz) = (&columns[j].q + &columns[2 * N].q * dz, columns[j].z + columns[2 * N].z * dz);
            let defect = (dz - tangent.outcome.p.dot(&dq)).abs();
            assert!(defect <= 1e3 * f64::EPSILON * largest(matrix.iter()), "{name}: {defect:e} in column {j}");
        }
    }
    for of in [Family::Nonlinear, Family::Linear, Family::Homogeneous] {
        check(&format!("{of:?}"), &family(of), one());
    }
    check("ray", &OfHamiltonian(Two::Ray), two());
    check("two coordinates", &OfHamiltonian(Two::Nonlinear), two());
}

/// The pendulum by its Hamiltonian, with `a = 1` and `b = gamma`, over ten periods: the derivatives of `(q, v, z)` in q0, v0
/// and gamma that were computed with 30 digits, as for its Lagrangian in tests/derivatives/gradients/pendulum.rs.
#[test]
fn a_hamiltonian_has_the_derivatives_of_its_lagrangian() {
    const DERIVATIVES: [[f64; 3]; 3] = [
        [5.65210486970, -5.53295490161, -3.94604242032],
        [7.38154595869, -7.16085111397, -4.67301564412],
        [225.145071391822, -255.642934500038, -265.676953215921],
    ];
    let start = Start::Velocity(VelocityPoint::new([1.0], [1.0], 0.0));
    let pendulum = OfHamiltonian(One::Family(Family::Pendulum, [1.0, -0.01]));
    let problem = Problem::new(&pendulum, 0.0, start).unwrap();
    let variables = [Variable::Position(0), Variable::Velocity(0), Variable::Parameter("b".into())];
    let run = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.25));
    let tangent = run.tangent(&variables, Until::Time(100.0)).unwrap();
    for (column, expected) in tangent.columns.iter().zip(DERIVATIVES) {
        for (found, expected) in [column.q[0], column.v[0], column.z].into_iter().zip(expected) {
            assert!((found - expected).abs() <= 1e-11 * expected.abs(), "{found} and {expected}");
        }
    }
}

/// The Lagrangian of a regular Hamiltonian for any parameters: `L_theta = -H_theta` at the momentum of the velocity, and
/// `L_thetatheta` by differences.
#[test]
fn the_lagrangian_depends_on_the_parameters() {
    type Once = Dual<f64, SVector<f64, 1>>;
    type Twice = Dual<Once, SVector<Once, 1>>;
    let of = family(Family::Nonlinear);
    let (t, q, v, z) = (0.3, 0.4, 0.7, 0.2);
    let once = |a: f64| Once { re: a, d: [1.0].into() };
    let along = |a: f64| {
        let theta = [Twice { re: once(a), d: [Once::from(1.0)].into() }, Twice::from(B)];
        let [q, v] = [q, v].map(|x| SVector::from([Twice::from(x)]));
        of.value_at(&theta, t.into(), &q, &v, z.into())
    };
    let l = along(A);
    let plain = of.value(t, &[q].into(), &[v].into(), z);
    assert!((l.re.re - plain).abs() <= 4.0 * f64::EPSILON, "{} and {plain}", l.re.re);
    let p = contact_geom::momentum(of.hamiltonian(), t, &VelocityPoint::new([q], [v], z)).unwrap();
    // H_a = sin(q) (1 + z/5) + b p q cos(t)/5.
    let slope = -(q.sin() * (1.0 + 0.2 * z) + 0.2 * B * p[0] * q * t.cos());
    assert!((l.re.d[0] - slope).abs() <= 8.0 * f64::EPSILON, "{} and {slope}", l.re.d[0]);
    // p moves by -H_pa / H_pp, so that L_aa = H_pa^2 / H_pp.
    let second =
        (0.2 * B * q * t.cos()).powi(2) / of.hamiltonian().hessian(t, &PhasePoint { q: [q].into(), p, z }).vv[(0, 0)];
    assert!((l.d[0].d[0] - second).abs() <= 8.0 * f64::EPSILON, "{} and {second}", l.d[0].d[0]);
    assert!(family(Family::Linear).value_at(&[A, B], t, &[q].into(), &[v].into(), z).is_nan());
}

/// The exponents of a run with constant `H_z = 1/10` are paired, and their sum is twice the rate -1/10, to round-off.
#[test]
fn lyapunov_exponents_are_paired() {
    fn check<H: ContactHamiltonian<1> + ParametricHamiltonian<1>>(of: &OfHamiltonian<H>) {
        let case = Case { lagrangian: of, start: one(), stages: 6 };
        let problem = case.problem();
        let found = case.run(&problem).steps(Steps::Size(0.1)).lyapunov_exponents(Until::After(30.0)).unwrap();
        assert!((found.rate + 0.1).abs() <= 1e-13, "{found:?}");
        assert!(found.pairing_defect() <= 1e-13 && found.volume_defect() <= 1e-13, "{found:?}");
    }
    check(&family(Family::Homogeneous));
}

/// A parameter of another name is refused, and a velocity where the momentum is given.
#[test]
fn what_is_refused() {
    let of = family(Family::Linear);
    let case = Case { lagrangian: &of, start: one(), stages: 3 };
    let problem = case.problem();
    let until = Until::Time(SPAN.1);
    let refused = case.run(&problem).tangent(&[Variable::Parameter("c".into())], until).unwrap_err();
    assert!(matches!(refused, SensitivityError::Parameter(_)), "{refused}");
    let refused = case.run(&problem).tangent(&[Variable::Velocity(0)], until).unwrap_err();
    assert!(matches!(refused, SensitivityError::Start { .. }), "{refused}");
}
