//! Splittings: orders, contact, symmetry, sigma, bitwise resume.

use super::{Coefficients, assert_order, distance, pullback, random_point, runge_kutta};
use crate::hamiltonian::splitting::HamiltonianSplitting;
use crate::hamiltonian::{
    Kinetic, PieceStepper, PieceSum, PointFlow, PolynomialInAction, Potential, Prolonged, SeparableSplitting,
    separable_pieces,
};
use crate::{InputError, Integrator, Problem, RunSupport, SplittingScheme, Stepper, StepperOptions};
use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, OfHamiltonian, PhasePoint, Scalar};

/// Parts in one coordinate.
#[derive(Clone, Copy, Debug)]
enum Part {
    /// A relativistic kinetic energy.
    Kinetic,
    /// A pendulum whose support shakes.
    Potential,
}

impl ContactHamiltonian<1> for Part {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T {
        match self {
            Part::Kinetic => (p[0] * p[0] + 1.0).sqrt(),
            Part::Potential => -(q[0] - (t * 2.0).sin() * 0.3).cos() * 1.5,
        }
    }
}

/// `H = p sin(q)/2`: `tan(q/2)` grows exponentially.
#[derive(Clone, Copy, Debug)]
struct Lift;

impl PointFlow<1> for Lift {
    type Map = f64;

    fn field<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _z: T) -> (SVector<T, 1>, T) {
        (q.map(|e| e.sin() * 0.5), T::zero())
    }
    /// `e^(tau/2) - 1`.
    fn over(&self, tau: f64) -> f64 {
        (0.5 * tau).exp_m1()
    }
    /// `tan((q1 - q0)/2) = g tan(q0/2)/(1 + (1 + g) tan^2(q0/2))`.
    fn change<T: Scalar>(&self, growth: &f64, _t: f64, q: &SVector<T, 1>, _z: T) -> (SVector<T, 1>, T) {
        let (s, c) = (q[0] * 0.5).sin_cos();
        ([(s * c * *growth / (s * s * *growth + 1.0)).atan() * 2.0].into(), T::zero())
    }
}

type Pieces = (Prolonged<PolynomialInAction<Coefficients>>, Prolonged<Lift>, Kinetic<Part>, Potential<Part>);

const PIECES: Pieces = (
    Prolonged(PolynomialInAction(Coefficients(0.3))),
    Prolonged(Lift),
    Kinetic(Part::Kinetic),
    Potential(Part::Potential),
);

const DURATION: f64 = 3.0;

fn start() -> PhasePoint<1> {
    PhasePoint::new([0.8], [0.6], 0.2)
}

fn stepper(scheme: &SplittingScheme, h: f64, start: PhasePoint<1>) -> PieceStepper<Pieces, 1> {
    PieceStepper::new(PIECES, scheme, h, 0.0, start).unwrap()
}

fn compositions() -> impl Iterator<Item = SplittingScheme> {
    SplittingScheme::ALL.into_iter().filter(|s| !s.is_nystrom())
}

/// The state after a duration by the composition of order 10 with small steps, which agrees with the Runge-Kutta method.
fn reference(duration: f64) -> PhasePoint<1> {
    let (exact, _) = runge_kutta(&PieceSum(PIECES), (0.0, duration), &start(), 20_000, false);
    let mut fine = stepper(&SplittingScheme::SOFRONIOU_SPALETTA_10, duration / 400.0, start());
    fine.advance(400).unwrap();
    let end = fine.state().fixed();
    assert!(distance(&end, &exact) < 1e-11, "{end:?}, {exact:?}");
    end
}

#[test]
fn compositions_have_their_orders() {
    let exact = reference(DURATION);
    for scheme in compositions().filter(|s| s.stages() <= 17) {
        assert_order(scheme.name(), scheme.order(), (DURATION, &exact), |h| Box::new(stepper(&scheme, h, start())));
    }
}

/// The errors of the longest compositions are above round-off, and their next terms below them, only for a longer motion.
#[test]
fn the_longest_compositions_have_their_orders() {
    let duration = 4.0 * DURATION;
    let exact = reference(duration);
    for scheme in [SplittingScheme::SOFRONIOU_SPALETTA_8, SplittingScheme::SOFRONIOU_SPALETTA_10] {
        assert_order(scheme.name(), scheme.order(), (duration, &exact), |h| Box::new(stepper(&scheme, h, start())));
    }
}

#[test]
fn steps_are_contact_symmetric_and_have_their_factor() {
    for (k, scheme) in compositions().enumerate() {
        let x = random_point::<1>(k);
        let mut motion = stepper(&scheme, 0.2, x);
        motion.advance(1).unwrap();
        let flows = super::super::splitting::flows(&PIECES, &scheme, 0.2).unwrap();
        let (defect, sigma) =
            pullback(&x, |x| Ok::<_, ()>(super::super::splitting::step(&PIECES, &flows, (0.0, 0.2), x).0));
        // The Jacobians of 35 substeps, some of them backward, are larger than their product.
        assert!(defect < 1e-13, "{} {defect:e}", scheme.name());
        assert!((motion.sigma() - sigma).abs() < 1e-13 * sigma, "{} {} {sigma}", scheme.name(), motion.sigma());
        let mut back = PieceStepper::new(PIECES, &scheme, -0.2, motion.time(), motion.state().fixed::<1>()).unwrap();
        back.advance(1).unwrap();
        assert!(distance(&back.state().fixed(), &x) < 1e-13, "{} {:?} {x:?}", scheme.name(), back.state());
    }
}

/// A sequence of the pieces in another order is another method of the same order.
#[test]
fn pieces_may_be_a_vector_and_a_run_resumes_bitwise() {
    let scheme = SplittingScheme::KAHAN_LI_6;
    let list = vec![super::pieces::quadratic(); 2];
    let mut motion = PieceStepper::new(list.clone(), &scheme, 0.1, 0.0, random_point::<2>(1)).unwrap();
    let mut other = motion.clone();
    motion.advance(7).unwrap();
    assert!(other.restore(&motion.save().unwrap()) && !other.restore(&[1, 2]));
    let mut other = PieceStepper::new(list, &scheme, 0.1, 0.0, random_point::<2>(1)).unwrap();
    assert!(other.restore(&motion.save().unwrap()));
    motion.advance(5).unwrap();
    (0..5).for_each(|_| other.advance(1).unwrap());
    assert_eq!(motion.save(), other.save());
    assert_eq!((motion.evaluations(), motion.time()), (12 * 19, 0.1 * 12.0));
}

/// By the entry points of problems: a stepper, and the derivative of a step, compared with differences.
#[test]
fn problems_take_a_splitting() {
    let hamiltonian = OfHamiltonian(PieceSum(PIECES));
    let integrator = HamiltonianSplitting { pieces: PIECES, scheme: SplittingScheme::KAHAN_LI_6 };
    let problem = Problem::new(&hamiltonian, 0.0, start()).unwrap();
    let mut of_problem = integrator.stepper(&problem, 0.1, StepperOptions::default()).unwrap();
    of_problem.advance(30).unwrap();
    let mut motion = stepper(&integrator.scheme, 0.1, start());
    motion.advance(30).unwrap();
    assert_eq!(of_problem.state(), motion.state());

    let jacobian = integrator.step_jacobian(&problem, 0.1, (0.0, &start(), &start())).unwrap().unwrap();
    let end = |x: PhasePoint<1>| {
        let mut stepper =
            integrator.stepper(&Problem::new(&hamiltonian, 0.0, x).unwrap(), 0.1, StepperOptions::default()).unwrap();
        stepper.advance(1).unwrap();
        stepper.state()
    };
    // The error of the quotient is 1e-8 times third derivatives.
    let moved = |d: f64| end(PhasePoint { z: 0.2 + d, ..start() });
    let slope = (moved(1e-4).p[0] - moved(-1e-4).p[0]) / 2e-4;
    assert!((jacobian[(1, 2)] - slope).abs() < 1e-7 && slope.abs() > 1e-3, "{slope} {jacobian}");
}

/// `p^2/2 + p^4/20 - cos(q - sin(t)/5) + z/10 + z^2/20 + mixed p q`, which claims to be separable.
#[derive(Clone, Copy, Debug)]
struct Parted {
    mixed: f64,
}

impl ContactHamiltonian<1> for Parted {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        let (q, p) = (q[0], p[0]);
        let parts = p * p * 0.5 + p.powi(4) * 0.05 - (q - t.sin() * 0.2).cos() + z * 0.1 + z * z * 0.05;
        parts + p * q * self.mixed
    }
    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure { separable: true, ..HamiltonianStructure::default() }
    }
}

#[test]
fn the_pieces_of_a_separable_hamiltonian_are_found() {
    let parted = Parted { mixed: 0.0 };
    let (exact, _) = runge_kutta(&parted, (0.0, DURATION), &start(), 20_000, false);
    let hamiltonian = OfHamiltonian(parted);
    let problem = Problem::new(&hamiltonian, 0.0, start()).unwrap();
    for scheme in [SplittingScheme::STRANG, SplittingScheme::MCLACHLAN_4, SplittingScheme::KAHAN_LI_6] {
        let pieces = separable_pieces(&parted, 0.0, &start()).unwrap();
        let stepper = |h: f64| PieceStepper::new(pieces, &scheme, h, 0.0, start()).unwrap();
        assert_order(scheme.name(), scheme.order(), (DURATION, &exact), |h| Box::new(stepper(h)));
        let options = StepperOptions::default();
        let mut of_problem = SeparableSplitting { scheme }.stepper(&problem, 0.1, options).unwrap();
        let mut motion = stepper(0.1);
        of_problem.advance(7).unwrap();
        motion.advance(7).unwrap();
        assert_eq!(of_problem.state(), motion.state());
    }
    let mixed = OfHamiltonian(Parted { mixed: 0.1 });
    let false_claim = Problem::new(&mixed, 0.0, start()).err();
    assert!(matches!(false_claim, Some(InputError::FalseClaim { claim: "separable", .. })), "{false_claim:?}");
    let splitting = SeparableSplitting { scheme: SplittingScheme::STRANG };
    let unclaimed = OfHamiltonian(PieceSum(PIECES));
    assert!(matches!(splitting.check(&unclaimed), Err(InputError::Hypothesis { .. })));
}
