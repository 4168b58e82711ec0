//! Lyapunov exponents: those of a linear motion in closed form, and their pairing.

use crate::gradients::impacts::Floor;
use crate::gradients::runs::Method;
use crate::lagrangians::{One, SwitchingOne};
use contact_examples::systems::{
    Chain, CoupledInZ, Duffing, HarmonicOscillator, Kepler, OneCoordinate, Pendulum, QuadraticInZ, System,
    SystemVisitor, TwoCoordinates, UniformField, visit_catalogue,
};
use contact_geom::numbers::max_or_nan;
use contact_geom::switching::{Impact, Impacts};
use contact_geom::{Parametric, VelocityPoint};
use discrete_herglotz::sensitivity::{LyapunovExponents, SensitivityError};
use discrete_herglotz::{
    GaussCollocation, InputError, Problem, SplittingScheme, Status, Steps, TransformedGauss, Until, rules,
};

fn exponents<const N: usize, S: System<N>, M: Method>(
    system: &S,
    start: VelocityPoint<N>,
    method: M,
    steps: (f64, usize),
) -> LyapunovExponents {
    exponents_from(system, (system.initial_time(), start), method, steps)
}

fn exponents_from<const N: usize, L: Parametric<N>, M: Method>(
    lagrangian: &L,
    (t0, start): (f64, VelocityPoint<N>),
    method: M,
    (h, steps): (f64, usize),
) -> LyapunovExponents {
    let problem = Problem::new(lagrangian, t0, start).unwrap();
    let run = method.run(&problem).steps(Steps::Count(steps));
    let found = run.lyapunov_exponents(Until::Time(t0 + h * steps as f64)).unwrap();
    assert_eq!(found.exponents.len(), 2 * N + 1);
    found
}

/// An overdamped oscillator: the exponents are the roots of `x^2 - gamma x + 1`, and gamma. In the second half the
/// frame has the directions of the motion, so that the exponents are those of the discrete motion to round-off.
#[test]
fn a_linear_motion() {
    let gamma = -2.5;
    let oscillator = OneCoordinate::from(HarmonicOscillator { gamma });
    let (h, steps) = (0.1, 600);
    let found =
        exponents(&oscillator, VelocityPoint::new([1.0], [0.3], 0.2), GaussCollocation { stages: 8 }, (h, steps));
    // The roots are -1/2 and -2.
    for (exponent, expected) in found.of_second_half.iter().zip([-0.5, -2.0, -2.5]) {
        assert!((exponent - expected).abs() <= 1e-12, "{exponent} and {expected}");
    }
    for (exponent, expected) in found.exponents.iter().zip([-0.5, -2.0, -2.5]) {
        // The initial directions are within a factor 10 of those of the motion.
        assert!((exponent - expected).abs() <= 10.0_f64.ln() / (h * steps as f64), "{exponent} and {expected}");
    }
    assert!((found.rate - gamma).abs() <= 1e-13, "{}", found.rate);
}

/// For a constant rate, one exponent is the rate, and the others are pairs whose sum is the rate: after any number of steps,
/// regular or chaotic, of every method. Each step contributes round-off of its tangent.
#[test]
fn the_exponents_are_paired() {
    fn check<const N: usize, S: System<N>, M: Method>(system: &S, method: M, name: &str) {
        for (h, steps) in [(0.1, 1), (0.1, 100), (0.05, 2000)] {
            let found = exponents(system, system.initial(), method, (h, steps));
            let name = format!("{}, {name}, {steps} steps", system.name());
            let tolerance = 1e-13 / h;
            assert!(found.pairing_defect() <= tolerance, "{name}: {:?}", found.pairs);
            let mut others = found.exponents.clone();
            let apart = |x: &f64| (x - found.rate).abs();
            let nearest = (0..others.len()).min_by(|i, j| apart(&others[*i]).total_cmp(&apart(&others[*j]))).unwrap();
            let of_action = others.remove(nearest);
            assert!(apart(&of_action) <= tolerance, "{name}: {of_action} and {}", found.rate);
            for i in 0..N {
                let sum = others[i] + others[2 * N - 1 - i];
                assert!((sum - found.rate).abs() <= tolerance, "{name}: {sum} and {}", found.rate);
            }
        }
    }
    fn all<const N: usize, S: System<N>>(system: &S) {
        check(system, GaussCollocation { stages: 4 }, "Gauss");
        check(system, GaussCollocation { stages: 9 }, "Gauss");
        check(system, SplittingScheme::STRANG, "strang");
        check(system, SplittingScheme::BLANES_MOAN_6, "blanes_moan_6");
        check(system, rules::Method::Midpoint, "midpoint");
    }
    all(&OneCoordinate::from(Duffing::forced()));
    all(&OneCoordinate::from(Pendulum { gamma: -0.1 }));
    all(&TwoCoordinates::from(Chain::default()));
}

/// The sum of all exponents is `(n + 1) ln sigma_d / h`, as the volume form is scaled by `sigma_d^(n+1)`: for every system.
#[test]
fn their_sum_is_the_contraction_of_volume() {
    struct Visit;
    impl SystemVisitor for Visit {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for stages in [2, 6] {
                let h = 0.02;
                let found = exponents(system, system.initial(), GaussCollocation { stages }, (h, 40));
                let sum: f64 = found.exponents.iter().sum();
                let expected = (N as f64 + 1.0) * found.rate;
                let size = found.exponents.iter().fold(1.0, |m, x| max_or_nan(m, x.abs()));
                assert!((sum - expected).abs() <= 1e-12 / h * size, "{}: {sum} and {expected}", system.name());
            }
        }
    }
    visit_catalogue(&mut Visit);
    let nonlinear = OneCoordinate::from(QuadraticInZ::default());
    let found = exponents(&nonlinear, nonlinear.initial(), SplittingScheme::KAHAN_LI_8, (0.05, 200));
    assert!((found.exponents.iter().sum::<f64>() - 2.0 * found.rate).abs() <= 1e-11);
    let coupled = OneCoordinate::from(CoupledInZ::default());
    let found = exponents(&coupled, coupled.initial(), rules::Method::Trapezoidal, (0.05, 200));
    assert!((found.exponents.iter().sum::<f64>() - 2.0 * found.rate).abs() <= 1e-11);
}

/// The forced double well is chaotic: a positive exponent, the same in both halves and by both methods within the error of
/// a finite run.
#[test]
fn a_chaotic_motion() {
    let duffing = OneCoordinate::from(Duffing::forced());
    let start = VelocityPoint::new([0.5], [0.1], 0.0);
    let gauss = exponents(&duffing, start, GaussCollocation { stages: 6 }, (0.1, 5000));
    let splitting = exponents(&duffing, start, SplittingScheme::BLANES_MOAN_6, (0.1, 5000));
    for found in [&gauss, &splitting] {
        assert!(found.exponents[0] > 0.05 && found.of_second_half[0] > 0.05, "{:?}", found.exponents);
    }
    assert!(
        (gauss.exponents[0] - splitting.exponents[0]).abs() <= 0.03,
        "{:?}, {:?}",
        gauss.exponents,
        splitting.exponents
    );
}

/// Coordinates at rest that act on nothing can be left out: the others have the exponents that they have alone.
#[test]
fn some_of_the_coordinates() {
    let one = One::from(UniformField { field: [-1.0], gamma: -0.3 });
    let two = TwoCoordinates::from(UniformField { field: [-1.0, 0.0], gamma: -0.3 });
    let until = Until::Time(4.0);
    let start = VelocityPoint::new([1.0], [0.3], 0.2);
    let alone = exponents_from(&one, (0.0, start), GaussCollocation { stages: 4 }, (0.1, 40));
    let problem = Problem::new(&two, 0.0, VelocityPoint::new([1.0, 0.5], [0.3, 0.0], 0.2)).unwrap();
    let within = |n| {
        let run = problem.by(GaussCollocation { stages: 4 }).steps(Steps::Count(40));
        run.lyapunov_exponents_within(n, until)
    };
    let found = within(1).unwrap();
    assert_eq!((found.exponents.len(), found.pairs.len()), (3, 1));
    for (a, b) in found.exponents.iter().zip(&alone.exponents) {
        assert!((a - b).abs() <= 1e-13 / 0.1, "{a} and {b}");
    }
    // The exponents of all are those of the parts: the pair of the second coordinate is 0 and the rate, but for the
    // directions with which the frame starts.
    let all = within(2).unwrap();
    assert_eq!(all.pairs.len(), 2);
    assert!(all.pairing_defect() <= 1e-12 && all.volume_defect() <= 1e-12, "{all:?}");
    assert!(matches!(within(3), Err(SensitivityError::Coordinate { index: 2, count: 2 })));
    assert!(matches!(within(0), Err(SensitivityError::Input(InputError::Count { least: 1, found: 0, .. }))));
}

/// A ball with drag above a floor: an elastic impact preserves the contact structure, so that the exponents of q and p have the
/// sum of the drag's rate, up to the error of the steps that end at impacts.
#[test]
fn elastic_impacts_keep_the_pairing() {
    let ball = Impacts::new(UniformField { field: [-1.0], gamma: -0.1 }, Floor, Impact::Elastic);
    let ball = SwitchingOne::from(ball);
    let problem = Problem::new(&ball, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let run = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.37));
    let found = run.lyapunov_exponents(Until::Time(14.8)).unwrap();
    assert_eq!(found.outcome.status, Status::Completed);
    assert!((found.rate + 0.1).abs() <= 1e-12, "{}", found.rate);
    let sum: f64 = found.exponents.iter().sum();
    assert!((sum - 2.0 * found.rate).abs() <= 1e-11, "{sum} and twice {}", found.rate);
}

#[test]
fn integrators_without_a_tangent() {
    let kepler = Kepler::<2>::default();
    let problem = Problem::new(&kepler, 0.0, kepler.initial()).unwrap();
    let run = problem.by(TransformedGauss { stages: 6 }).steps(Steps::Size(0.2));
    let found = run.lyapunov_exponents(Until::Time(1.0));
    assert!(matches!(found, Err(SensitivityError::NoTangent { .. })));
}
