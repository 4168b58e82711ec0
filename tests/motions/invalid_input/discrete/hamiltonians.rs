//! Invalid input to the methods for contact Hamiltonians: a start that is not finite is refused, and steps are finite or
//! an error.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EXTREME, Report, places, triples};
use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, OfHamiltonian, PhasePoint, Scalar};
use discrete_herglotz::hamiltonian::{
    ContactEuler, PieceStepper, PieceSum, Quadratic, modified_defects, modified_hamiltonian, separable_pieces,
};
use discrete_herglotz::{GaussCollocation, Integrator, Problem, SplittingScheme, Stepper, StepperOptions};

pub const TESTS: &[InputTest] = &[
    InputTest { entries: &["Problem::of_hamiltonian"], run: problems },
    InputTest { entries: &["PieceStepper::new", "Quadratic::new"], run: steppers },
    InputTest { entries: &["hamiltonian::separable_pieces"], run: separable },
    InputTest { entries: &["hamiltonian::modified_defects", "hamiltonian::modified_hamiltonian"], run: modified },
];

/// Linear in p, and nonlinear in q and z; it depends on time.
struct Linear;

impl ContactHamiltonian<1> for Linear {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        p[0] * (q[0].cos() + z * 0.2 + t * 0.1) + (q[0] * q[0] * 0.5 + z * 0.1) * z
    }
}

fn problems(report: &mut Report) {
    let of = OfHamiltonian(Linear);
    for (t, x) in places() {
        let problem = Problem::of_hamiltonian(&of, t, PhasePoint::from(x));
        report.entry_point(&(t, x), problem.map(|problem| problem.start().v[0]));
    }
}

fn steppers(report: &mut Report) {
    let half = |x: f64| [[x]].into();
    let piece =
        |numbers: &[f64; 4]| Quadratic::<1>::new(half(numbers[0]), half(numbers[1]), half(numbers[2]), numbers[3]);
    for (t, x) in places() {
        let state = PhasePoint::from(x);
        let by_pieces = PieceStepper::new((piece(&[1.0, 0.2, 1.0, -0.1]),), &SplittingScheme::STRANG, 0.1, t, state);
        report.entry_point(&(t, x), by_pieces.map(|stepper| stepper.state().q[0]));
        for by in [ContactEuler::TypeTwo, ContactEuler::TypeThree] {
            let of = OfHamiltonian(Linear);
            let found = Problem::of_hamiltonian(&of, t, state)
                .and_then(|problem| Ok(by.stepper(&problem, 0.1, StepperOptions::default())?.state().q[0]));
            report.entry_point(&(t, x), found);
        }
    }
    let state = PhasePoint::new([0.3], [0.7], 0.2);
    for value in EXTREME {
        for i in 0..4 {
            let mut numbers = [1.0, 0.2, 1.0, -0.1];
            numbers[i] = value;
            let stepper = PieceStepper::new((piece(&numbers),), &SplittingScheme::STRANG, 0.1, 0.0, state);
            let stepped = stepper.map_err(|e| e.to_string()).and_then(|mut stepper| {
                stepper.advance(1).map_err(|e| e.to_string())?;
                Ok(stepper.state())
            });
            report.entry_point(&value, stepped.map(|x| (x.q[0], (x.p[0], x.z))));
        }
        let of = OfHamiltonian(Linear);
        let problem = Problem::of_hamiltonian(&of, 0.0, state).unwrap();
        let stepper = ContactEuler::TypeTwo.stepper(&problem, value, StepperOptions::default());
        report.entry_point(&value, stepper.map(|stepper| stepper.state().q[0]));
    }
}

/// A pendulum with a drag, and its potential alone.
struct Separable {
    kinetic: bool,
}

impl ContactHamiltonian<1> for Separable {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        let potential = (q[0] - t * 0.1).cos() + 2.0 + z * z * 0.1;
        if self.kinetic { p[0] * p[0] * 0.5 + potential + z * 0.1 } else { potential }
    }
    fn structure(&self) -> contact_geom::HamiltonianStructure {
        contact_geom::HamiltonianStructure { separable: true, ..Default::default() }
    }
}

fn separable(report: &mut Report) {
    let h = Separable { kinetic: true };
    for (t, x) in places() {
        let state = PhasePoint::from(x);
        let pieces = separable_pieces(&h, t, &state);
        report.formula(&(t, x), pieces.map(|of| PieceSum(of).value(t, &state.q, &state.p, state.z)));
    }
}

fn modified(report: &mut Report) {
    for x in triples() {
        let states = [PhasePoint::new([0.3], [0.7], 0.2), x.into(), PhasePoint::new([0.2], [0.6], 0.1)];
        let found = modified_hamiltonian(&states, 0.1).ok_or("none");
        report.formula(&x, found);
    }
    let none: [PhasePoint<1>; 0] = [];
    report.check(modified_hamiltonian(&none, 0.1).is_none(), || "a Hamiltonian of no states".into());
    /// Without the time.
    struct Autonomous;
    impl ContactHamiltonian<1> for Autonomous {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
            p[0] * (q[0].cos() + z * 0.2) + z
        }
        fn structure(&self) -> contact_geom::HamiltonianStructure {
            contact_geom::HamiltonianStructure { autonomous: true, ..Default::default() }
        }
    }
    let of = OfHamiltonian(Autonomous);
    let problem = Problem::of_hamiltonian(&of, 0.0, PhasePoint::new([0.3], [0.7], 0.2));
    for h in EXTREME {
        let defects = problem.as_ref().map_err(|e| e.to_string()).and_then(|problem| {
            modified_defects(problem, &GaussCollocation { stages: 1 }, 0.0, &[h], 2).map_err(|e| e.to_string())
        });
        report.entry_point(&h, defects.map(|all| all.iter().map(|d| d.defect).sum::<f64>()));
    }
}
