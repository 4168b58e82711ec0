//! Systems of a user: what is wrong with their code ends a run with a status, and never with a panic.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EXTREME, Report};
use contact_geom::nalgebra::DMatrix;
use discrete_herglotz::{
    Components, GaussCollocation, InputError, Outcome, Point, SecondDerivatives, State, Status, Steps, System,
    SystemProblem, Until, Vector,
};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &["SystemProblem::new", "SystemProblem::by", "SystemProblem::steps", "SystemProblem::accuracy"],
        run: starts,
    },
    InputTest { entries: &["System::value", "System::gradient", "System::hessian"], run: faults },
    InputTest { entries: &["State::check", "$name::is_finite"], run: states },
    InputTest { entries: &["Vector::dot", "Vector::component_div", "Vector::fixed"], run: vectors },
];

/// What a system does from a time on.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
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
        1
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
            let good = t.is_finite() && x.is_finite();
            report.check(made.is_ok() == good && (momentum.is_ok() == good || !good), || format!("{t}, {x:?}"));
            let Ok(problem) = made else { continue };
            for run in [problem.steps(Steps::Size(0.1)), problem.accuracy(1e-6)] {
                let outcome = run.run(Until::After(0.5));
                report.check(outcome.as_ref().map_or(true, finite), || format!("{t}, {x:?}: {outcome:?}"));
            }
        }
    }
    for wrong in [Vector::zeros(0), Vector::zeros(2)] {
        let right = Vector::from([0.3]);
        for (q, v) in [(&wrong, &right), (&right, &wrong), (&wrong, &wrong)] {
            let made = SystemProblem::new(&sound, 0.0, Point { q: q.clone(), v: v.clone(), z: 0.0 });
            let sentence = made.as_ref().err().map(InputError::to_string).unwrap_or_default();
            let both = sentence.contains('1') && sentence.contains(&wrong.len().to_string());
            report.check(both, || format!("{q:?}, {v:?}: {sentence}"));
        }
    }
    for stages in [0, 1, 16, 17, usize::MAX] {
        let problem = SystemProblem::new(&sound, 0.0, Point::new([0.3], [0.7], 0.2)).unwrap();
        let outcome = problem.by(GaussCollocation { stages }).steps(Steps::Size(0.1)).run(Until::Steps(3));
        report.check(outcome.is_ok() == (1..=16).contains(&stages), || format!("{stages} stages: {outcome:?}"));
    }
}

/// A fault at the start is refused; one after it is the status of the run, which keeps what was computed.
fn faults(report: &mut Report) {
    for fault in [Fault::Nan, Fault::Longer, Fault::Shorter, Fault::Panics] {
        let start = Point::new([0.3], [0.7], 0.2);
        let at_once = Pendulum(fault, f64::NEG_INFINITY);
        let refused = SystemProblem::new(&at_once, 0.0, start.clone());
        report.check(refused.is_err(), || format!("{fault:?} at the start is accepted"));
        let later = Pendulum(fault, 0.55);
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
        }
    }
}

/// Vectors of different lengths give NaN, and never a number that hides it.
fn vectors(report: &mut Report) {
    let many = |n: usize| Vector::from_fn(n, |i| 1.0 + i as f64);
    for (n, m) in [(0, 0), (1, 1), (6, 6), (7, 7), (300, 300), (0, 1), (1, 0), (6, 7), (7, 6), (2, 300)] {
        let (a, b) = (many(n), many(m));
        let all = [(&a - &b).amax(), (&a + &b).amax(), a.dot(&b)];
        let good = if n == m { all.iter().all(|x| x.is_finite()) } else { all.iter().all(|x| x.is_nan()) };
        report.check(good, || format!("{n} and {m}: {all:?}"));
        let quotients = a.component_div(&b);
        report.check(quotients.len() == n && (n <= m || quotients.amax().is_nan()), || format!("{n} by {m}"));
        report.check(a.len() == n && a == a.clone() && (n == m) == (a == b), || format!("{a:?}"));
        report.check((0..n).all(|i| a[i] == 1.0 + i as f64), || format!("{a:?}"));
        let fixed = a.fixed::<3>();
        report.check((0..3).all(|i| fixed[i].is_nan() == (i >= n)), || format!("{n} as 3: {fixed}"));
    }
}
