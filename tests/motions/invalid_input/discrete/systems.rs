//! Systems of a user: what is wrong with their code ends a run with a status, and never with a panic.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EXTREME, Report};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{Arguments, GeometryError, Scalar, ScalarSystem, Slopes};
use discrete_herglotz::ensemble::Systems;
use discrete_herglotz::sensitivity::Variable;
use discrete_herglotz::{
    Components, Ensemble, GaussCollocation, InitialState, InputError, Kernels, Outcome, Point, SecondDerivatives,
    State, Status, Steps, System, SystemProblem, Until, Vector,
};
use std::sync::Arc;

pub const TESTS: &[InputTest] = &[
    InputTest { entries: &["SystemProblem::new"], run: starts },
    InputTest { entries: &["SystemProblem::by", "SystemProblem::steps", "SystemProblem::accuracy"], run: runs },
    InputTest { entries: &["System::value", "System::gradient", "System::hessian"], run: faults },
    InputTest { entries: &["Kernels::of", "Kernels::of_motions"], run: kernels },
    InputTest { entries: &["Ensemble::of_systems"], run: ensembles },
    InputTest { entries: &["State::check", "$name::new", "$name::fixed", "$name::is_finite"], run: states },
    InputTest { entries: &["Vector::dot", "Vector::component_div", "Vector::fixed"], run: vectors },
];

/// What is wrong with a system from a time on; that it has no coordinates, at all times.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    Empty,
    Nan,
    Longer,
    Shorter,
    Panics,
}

/// A pendulum with drag, `L = v^2/2 + cos q - z/10`, with a fault after a time.
struct Pendulum(Fault, f64);

impl Pendulum {
    fn fault(&self, t: f64) -> Fault {
        let fault = if t > self.1 { self.0 } else { Fault::None };
        assert!(fault != Fault::Panics, "this panic is part of a test");
        fault
    }

    /// A vector with the fault.
    fn vector(&self, t: f64, x: f64) -> Vector {
        match self.fault(t) {
            Fault::Longer => [x, x].into(),
            Fault::Shorter => Vector::zeros(0),
            Fault::Nan => [f64::NAN].into(),
            _ => [x].into(),
        }
    }
}

impl System for Pendulum {
    fn dimension(&self) -> usize {
        usize::from(self.0 != Fault::Empty)
    }
    fn value(&self, t: f64, x: &Point) -> f64 {
        let fault = if self.fault(t) == Fault::Nan { f64::NAN } else { 0.0 };
        0.5 * x.v[0] * x.v[0] + x.q[0].cos() - 0.1 * x.z + fault
    }
    fn gradient(&self, t: f64, x: &Point) -> Components {
        Components { x: self.vector(t, -x.q[0].sin()), y: self.vector(t, x.v[0]), z: -0.1 }
    }
    fn hessian(&self, t: f64, x: &Point) -> SecondDerivatives {
        let n = self.vector(t, 0.0).len();
        let matrix = |x: f64| DMatrix::from_element(n, n, x);
        let line = Vector::zeros(n);
        SecondDerivatives {
            qq: matrix(-x.q[0].cos()),
            qv: matrix(0.0),
            vv: matrix(1.0),
            qz: line.clone(),
            vz: line,
            zz: 0.0,
        }
    }
}

/// How kernels are made.
type Made = fn(Arc<FaultyKernels>) -> Kernels;

/// The same pendulum without a fault, with kernels that have one from the start.
struct WithKernels(Fault, Made);

impl System for WithKernels {
    fn dimension(&self) -> usize {
        1
    }
    fn value(&self, t: f64, x: &Point) -> f64 {
        Pendulum(Fault::None, 0.0).value(t, x)
    }
    fn gradient(&self, t: f64, x: &Point) -> Components {
        Pendulum(Fault::None, 0.0).gradient(t, x)
    }
    fn hessian(&self, t: f64, x: &Point) -> SecondDerivatives {
        Pendulum(Fault::None, 0.0).hessian(t, x)
    }
    fn kernels(&self) -> Option<Kernels> {
        Some((self.1)(Arc::new(FaultyKernels(self.0))))
    }
}

struct FaultyKernels(Fault);

impl FaultyKernels {
    fn number<T: Scalar>(&self, x: T) -> T {
        assert!(self.0 != Fault::Panics, "this panic is part of a test");
        if self.0 == Fault::Nan { T::from(f64::NAN) } else { x }
    }
}

impl ScalarSystem for FaultyKernels {
    fn dimension(&self) -> usize {
        if self.0 == Fault::Longer { 2 } else { 1 }
    }
    fn value<T: Scalar, const N: usize>(&self, _t: T, q: &[T], v: &[T], z: T) -> T {
        self.number(v[0] * v[0] * 0.5 + q[0].cos() - z * 0.1)
    }
    fn with_gradient<T: Scalar, const N: usize>(&self, t: T, q: &[T], v: &[T], z: T, to: Slopes<'_, T>) -> T {
        (to.q[0], to.v[0], *to.z) = (self.number(-q[0].sin()), v[0], T::from(-0.1));
        self.value::<T, N>(t, q, v, z)
    }
    fn force<T: Scalar, const N: usize>(&self, _t: T, q: &[T], to: &mut [T]) {
        to[0] = self.number(-q[0].sin());
    }
    fn mass_matrix<T: Scalar, const N: usize>(&self, _t: T, _q: &[T], _v: &[T], _z: T, to: &mut [T]) {
        to[0] = self.number(T::one());
    }
    fn with_second_derivatives<T: Scalar, const N: usize>(
        &self,
        Arguments { t, q, v, z }: Arguments<'_, T>,
        to: Slopes<'_, T>,
        second: [&mut [T]; 6],
    ) -> T {
        let [qq, qv, vv, qz, vz, zz] = second;
        let zero = T::zero();
        (qq[0], qv[0], vv[0]) = (self.number(-q[0].cos()), zero, T::one());
        (qz[0], vz[0], zz[0]) = (zero, zero, zero);
        self.with_gradient::<T, N>(t, q, v, z, to)
    }
}

fn finite(outcome: &Outcome) -> bool {
    outcome.state().is_finite() && outcome.t.is_finite()
}

fn starts(report: &mut Report) {
    let sound = Pendulum(Fault::None, 0.0);
    for value in EXTREME {
        for (t, x) in [
            (value, Point::new([0.3], [0.7], 0.2)),
            (0.0, Point::new([value], [0.7], 0.2)),
            (0.0, Point::new([0.3], [value], 0.2)),
            (0.0, Point::new([0.3], [0.7], value)),
        ] {
            let of_momentum = State { q: x.q.clone(), p: x.v.clone(), z: x.z };
            let momentum = SystemProblem::new(&sound, t, of_momentum);
            let made = SystemProblem::new(&sound, t, x.clone());
            // For a speed of 1e200 L is infinite.
            let good = t.is_finite() && x.is_finite() && sound.value(t, &x).is_finite();
            report.check(made.is_ok() == good && momentum.is_ok() == good, || format!("{t}, {x:?}"));
            let Ok(problem) = made else { continue };
            for run in [problem.steps(Steps::Size(0.1)), problem.accuracy(1e-6)] {
                let outcome = run.run(Until::Time(t + 0.5));
                report.check(outcome.as_ref().map_or(true, finite), || format!("{t}, {x:?}: {outcome:?}"));
            }
        }
    }
    for wrong in [Vector::zeros(0), Vector::zeros(2)] {
        let right = Vector::from([0.3]);
        for (q, y) in [(&wrong, &right), (&right, &wrong), (&wrong, &wrong)] {
            let point = Point { q: q.clone(), v: y.clone(), z: 0.0 };
            let state = State { q: q.clone(), p: y.clone(), z: 0.0 };
            for start in [InitialState::from(point), InitialState::from(state)] {
                let refused = SystemProblem::new(&sound, 0.0, start).err();
                let sizes = match &refused {
                    Some(InputError::Geometry(GeometryError::WrongSize { expected, found, .. })) => (*expected, *found),
                    _ => (0, 0),
                };
                report.check(sizes == (1, wrong.len()), || format!("{q:?}, {y:?}: {refused:?}"));
            }
        }
        let guessed = InitialState::Momentum(State::new([0.3], [0.7], 0.2), wrong);
        report.check(SystemProblem::new(&sound, 0.0, guessed).is_err(), || "a guess of a wrong length".into());
    }
    for guess in EXTREME {
        // A poor guess costs iterations, or the start is refused.
        let made =
            SystemProblem::new(&sound, 0.0, InitialState::Momentum(State::new([0.3], [0.7], 0.2), [guess].into()));
        report.check(made.map_or(true, |problem| problem.start().is_finite()), || format!("the guess {guess}"));
    }
    let nowhere = Point { q: Vector::zeros(0), v: Vector::zeros(0), z: 0.3 };
    let refused = SystemProblem::new(&Pendulum(Fault::Empty, 0.0), 0.0, nowhere).err();
    report.check(refused == Some(InputError::Dimension), || format!("empty: {refused:?}"));
}

fn runs(report: &mut Report) {
    let sound = Pendulum(Fault::None, 0.0);
    let problem = SystemProblem::new(&sound, 0.0, Point::new([0.3], [0.7], 0.2)).unwrap();
    for h in EXTREME {
        let ended = problem.steps(Steps::Size(h)).run(Until::Steps(7));
        let refused = h == 0.0 || !h.is_finite();
        report.check(refused == matches!(ended, Err(InputError::Step { .. })), || format!("steps of {h}: {ended:?}"));
        report.entry_point(&h, ended.map(|o| o.state()));
    }
    for span in EXTREME {
        let ended = problem.steps(Steps::Count(7)).run(Until::Time(span));
        report.entry_point(&span, ended.map(|o| (o.t, o.state())));
    }
    // Steps for an error of 1e-300 are searched for a long time; those of a typed Lagrangian are in the tests of runs.
    for error in EXTREME.into_iter().filter(|error| !(*error > 0.0 && *error < 1e-100)) {
        let ended = problem.accuracy(error).run(Until::Time(0.5));
        let refused = !(error > 0.0 && error.is_finite());
        report.check(refused == matches!(ended, Err(InputError::Tolerance { .. })), || format!("{error}: {ended:?}"));
        report.entry_point(&error, ended.map(|o| o.state()));
    }
    for stages in [0, 1, 16, 17, usize::MAX] {
        let outcome = problem.by(GaussCollocation { stages }).steps(Steps::Size(0.1)).run(Until::Steps(3));
        let good = match &outcome {
            Ok(outcome) => (1..=16).contains(&stages) && outcome.status == Status::Completed,
            Err(error) => *error == InputError::Stages { found: stages },
        };
        report.check(good, || format!("{stages} stages: {outcome:?}"));
    }
}

/// A fault at the start is refused; one after it is the status of the run, which keeps what was computed.
fn faults(report: &mut Report) {
    for fault in [Fault::Nan, Fault::Longer, Fault::Shorter, Fault::Panics] {
        let start = Point::new([0.3], [0.7], 0.2);
        let at_once = Pendulum(fault, f64::NEG_INFINITY);
        let refused = SystemProblem::new(&at_once, 0.0, start.clone());
        report.check(refused.is_err(), || format!("{fault:?} at the start is accepted"));
        // Within the sixth step, before the node of one stage.
        let later = Pendulum(fault, 0.53);
        let problem = SystemProblem::new(&later, 0.0, start).unwrap();
        for stages in [1, 2, 8] {
            let run = problem.by(GaussCollocation { stages }).steps(Steps::Size(0.1));
            let outcome = run.run(Until::Time(2.0)).unwrap();
            let kept = matches!(outcome.status, Status::Failed { step: 5, .. }) && outcome.steps == 5;
            report.check(kept && finite(&outcome), || format!("{fault:?}, {stages} stages: {outcome:?}"));
        }
        let outcome = problem.accuracy(1e-6).run(Until::Time(2.0));
        report.check(outcome.is_err(), || format!("{fault:?} to an accuracy: {outcome:?}"));
    }
}

/// Kernels that panic, are undefined, or have another number of coordinates fail the first step; sound ones take the steps
/// and have the derivatives of the same system without kernels, to round-off.
fn kernels(report: &mut Report) {
    let start = Point::new([0.3], [0.7], 0.2);
    let (by, steps, until) = (GaussCollocation { stages: 3 }, Steps::Size(0.1), Until::Steps(5));
    let made: [Made; 2] = [Kernels::of, Kernels::of_motions];
    for (fault, made) in [Fault::Nan, Fault::Panics].into_iter().flat_map(|fault| made.map(|made| (fault, made))) {
        let system = WithKernels(fault, made);
        let problem = SystemProblem::new(&system, 0.0, start.clone()).unwrap();
        let outcome = problem.by(by).steps(steps).run(until).unwrap();
        let kept = matches!(outcome.status, Status::Failed { step: 0, .. }) && finite(&outcome);
        report.check(kept, || format!("kernels, {fault:?}: {outcome:?}"));
        let tangent = problem.by(by).steps(steps).tangent(&[Variable::Position(0)], until);
        let failed = tangent.as_ref().map_or(true, |tangent| tangent.outcome.status != Status::Completed);
        report.check(failed, || format!("derivatives of kernels, {fault:?}: {tangent:?}"));
    }
    let plain = Pendulum(Fault::None, 0.0);
    let variables = [Variable::Position(0), Variable::Velocity(0), Variable::Action, Variable::StartTime];
    let of = |system: &dyn System| {
        let problem = SystemProblem::new(system, 0.0, start.clone()).unwrap();
        problem.by(by).steps(steps).tangent(&variables, until).unwrap()
    };
    for made in made {
        let (one, other) = (of(&WithKernels(Fault::None, made)), of(&plain));
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-13;
        let same = one.columns.iter().zip(&other.columns).all(|(a, b)| near(a.q[0], b.q[0]) && near(a.z, b.z));
        report.check(same && near(one.outcome.q[0], other.outcome.q[0]), || format!("{one:?} and {other:?}"));
    }
}

/// A member whose system or start is faulty is refused, or ends with a status; the others are its single runs.
fn ensembles(report: &mut Report) {
    let (sound, start) = (Pendulum(Fault::None, 0.0), || Point::new([0.3], [0.7], 0.2));
    let by = GaussCollocation { stages: 4 };
    let problem = SystemProblem::new(&sound, 0.0, start()).unwrap();
    let single = problem.by(by).steps(Steps::Size(0.1)).run(Until::Time(2.0)).unwrap();
    let wrong = [
        Point::new([f64::NAN], [0.7], 0.2),
        Point::new([0.3], [0.7], f64::INFINITY),
        Point { q: Vector::zeros(2), v: Vector::zeros(1), z: 0.0 },
    ];
    let faulty = [Fault::Nan, Fault::Longer, Fault::Shorter, Fault::Panics].map(|fault| Pendulum(fault, 0.53));
    let of = |i: usize| -> (&(dyn System + Sync), Point) {
        match i {
            0..3 => (&sound, wrong[i].clone()),
            3..7 => (&faulty[i - 3], start()),
            _ => (&sound, start()),
        }
    };
    // Members that cannot start among others, of which the last has all checks.
    let many = Ensemble::of_systems(0.0, 9, of).by(by).steps(Steps::Size(0.1)).threads(2);
    let mut ends = Vec::new();
    let tally = many.run(Until::Time(2.0), |member| ends.push(member.ending.clone()));
    let good = tally.as_ref().is_ok_and(|tally| (tally.members, tally.completed, tally.failed) == (9, 2, 7));
    report.check(good, || format!("{tally:?}"));
    for (i, end) in ends.iter().enumerate() {
        let good = match end {
            Err(_) => i < 3,
            Ok(end) if i < 7 => matches!(end.status, Status::Failed { .. }) && end.steps == 5 && end.state.is_finite(),
            Ok(end) => end.status == Status::Completed && end.state == single.state(),
        };
        report.check(good, || format!("member {i}: {end:?}"));
    }
    for number in EXTREME {
        let of = || Ensemble::of_systems(0.0, 2, |_| (&sound as &(dyn System + Sync), start()));
        let finite = |members: Ensemble<'_, Systems<'_>>, until: Until| {
            let mut all_finite = true;
            let tally = members.run(until, |member| {
                all_finite &= member.ending.as_ref().map_or(true, |end| end.state.is_finite());
            });
            (tally.is_ok(), all_finite)
        };
        let (ok, all_finite) = finite(of().by(by).steps(Steps::Count(3)), Until::Time(number));
        report.check(all_finite && (number.is_finite() || !ok), || format!("until {number}"));
        if !(number > 0.0 && number < 1e-100) {
            let (ok, all_finite) = finite(of().accuracy(number), Until::Time(0.5));
            report.check(all_finite && (number > 0.0 || !ok), || format!("accuracy {number}"));
        }
    }
    let refused = |members: Ensemble<'_, Systems<'_>>| members.run(Until::Time(1.0), |_| ()).is_err();
    let of = |count| Ensemble::of_systems(0.0, count, |_| (&sound as &(dyn System + Sync), start()));
    report.check(refused(of(0).accuracy(1e-6)) && refused(of(1)), || "no member, or no steps".into());
    report.check(refused(of(1).by(GaussCollocation { stages: 17 }).accuracy(1e-6)), || "17 stages".into());
}

fn states(report: &mut Report) {
    for value in EXTREME {
        for state in [
            State::new([value], [0.7], 0.2),
            State::new([0.3], [value], 0.2),
            State::new([0.3], [0.7], value),
            State { q: Vector::zeros(0), p: Vector::zeros(0), z: value },
        ] {
            let good = state.check().is_ok();
            report.check(good == value.is_finite() && good == state.is_finite(), || format!("{state:?}"));
            let fixed = state.fixed::<1>().check().is_ok() == (good && !state.q.is_empty());
            report.check(fixed && state.fixed::<2>().check().is_err(), || format!("{state:?} as a point"));
        }
    }
}

/// Vectors of different lengths give NaN, and never a number that hides it.
fn vectors(report: &mut Report) {
    let many = |n: usize| Vector::from_fn(n, |i| 1.0 + i as f64);
    for (n, m) in [(0, 0), (1, 1), (4, 4), (5, 5), (300, 300), (0, 1), (1, 0), (4, 5), (5, 4), (2, 300)] {
        let (a, b) = (many(n), many(m));
        let all = [(&a - &b).amax(), (&a + &b).amax(), a.dot(&b)];
        let good = if n == m { all.iter().all(|x| x.is_finite()) } else { all.iter().all(|x| x.is_nan()) };
        report.check(good, || format!("{n} and {m}: {all:?}"));
        let quotients = a.component_div(&b);
        report.check(quotients.len() == n && (n <= m || quotients.amax().is_nan()), || format!("{n} by {m}"));
        report.check(a.len() == n && (n == m) == (a == b), || format!("{a:?}"));
        report.check((0..n).all(|i| a[i] == 1.0 + i as f64), || format!("{a:?}"));
        let fixed = a.fixed::<3>();
        report.check((0..3).all(|i| fixed[i].is_nan() == (i >= n)), || format!("{n} as 3: {fixed}"));
    }
}
