//! The choice of steps for a requested accuracy: motions that are refused, and motions that come to rest.

use crate::lagrangians::{One, one};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, Scalar, Structure, VelocityPoint, numbers::max_or_nan};
use discrete_herglotz::{AnyIntegrator, InputError, Outcome, Problem, SelectionFailure, Status, Until};
use std::time::Instant;

/// A whole run from t = 0 by an integrator with steps for an accuracy.
fn run_to<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    start: VelocityPoint<N>,
    span: f64,
    wanted: f64,
) -> Result<Outcome, InputError> {
    Problem::new(lagrangian, 0.0, start)?.accuracy(wanted).run(Until::Time(span))
}

/// `v^2/2 - V(q) + gamma (1 + swing cos t) z`.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    gamma: f64,
    swing: f64,
    potential: Potential,
}

#[derive(Clone, Copy, Debug)]
enum Potential {
    /// A jump so narrow that no gradient is evaluated in it.
    Jump { at: f64, height: f64 },
    /// `|q|`, with a kink at which no quadrature rule has its order.
    Kink,
    /// A well away from the origin, in which damped motions come to rest.
    Well,
    /// `-q^4`: motions blow up in a finite time.
    Pole,
}

impl Lagrangian<1> for Line {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let square = q[0] * q[0];
        let potential = match self.potential {
            Potential::Jump { at, height } => ((q[0] - at) * 1e10).tanh() * (0.5 * height),
            Potential::Kink => q[0].abs(),
            Potential::Well => q[0] * -0.386 + square * -0.379 + square * square * 0.158 + (q[0].cos() - 1.0) * -0.963,
            Potential::Pole => square * square * -1.0,
        };
        v[0] * v[0] * 0.5 - potential + z * (t.cos() * self.swing + 1.0) * self.gamma
    }

    fn structure(&self) -> Structure {
        Structure {
            autonomous: self.swing == 0.0,
            constant_rate: self.swing == 0.0,
            z_affine: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

fn at(q: f64, v: f64) -> VelocityPoint<1> {
    VelocityPoint::new([q], [v], 0.0)
}

/// Runs on both sides of a jump agree to the last digit; the jump shows in the values of L, within a step and between
/// two.
#[test]
fn jumps_of_the_potential_are_refused() {
    for i in 0..64 {
        // Some of the jumps are at the ends of steps.
        let place = if i % 4 == 0 { 10.0 * (i + 1) as f64 / 64.0 } else { 0.5 + 0.137 * i as f64 };
        let height = [-0.8, -0.02, 0.003, 0.3][i / 4 % 4];
        let line = One::from(Line { gamma: 0.0, swing: 0.0, potential: Potential::Jump { at: place, height } });
        let problem = Problem::new(&line, 0.0, at(0.0, 1.0)).unwrap();
        let cause = match problem.accuracy(1e-6).plan(Until::Time(10.0)) {
            Err(InputError::Accuracy { cause, .. }) => cause,
            other => panic!("{place}, {height}: {:?}", other.map(|plan| plan.count())),
        };
        let reported = matches!(
            cause,
            SelectionFailure::Order { .. }
                | SelectionFailure::DefectBetweenNodes { .. }
                | SelectionFailure::Unresolved { .. }
        );
        assert!(reported, "{place}, {height}: {cause:?}");
    }
}

/// Steps that end by chance where the motion passes a kink are exact, and other steps are not: agreement of such runs
/// says nothing about other steps.
#[test]
fn kinks_are_met_or_refused() {
    let line = One::from(Line { gamma: 0.0, swing: 0.0, potential: Potential::Kink });
    let mut met = 0;
    // A longer motion takes seconds, and up to half a million steps.
    for (wanted, spans) in [(1e-3, &[8.0, 32.0][..]), (1e-6, &[8.0]), (1e-9, &[8.0])] {
        for j in 1..=10 {
            // The motion consists of parabolas of duration 2 between the passages at `first` + 2n.
            let first = 0.5f64.powi(j);
            let start = at(0.5 * first * first - first, 1.0 - first);
            for &span in spans {
                let Ok(outcome) = run_to(&line, start, span, wanted) else { continue };
                met += 1;
                let s = 2.0 - first;
                let off = max_or_nan((outcome.q[0] + s - 0.5 * s * s).abs(), (outcome.p[0] + 1.0 - s).abs());
                assert!(off <= wanted, "{wanted:e}, {first}, {span}: off by {off:e}");
            }
        }
    }
    assert!(met > 0);
}

/// An accuracy that no number has is refused with the round-off of the motion, as one next to it: its first steps are no shorter.
#[test]
fn accuracies_below_round_off_are_refused_with_it() {
    let line = One::from(Line { gamma: -0.1, swing: 0.0, potential: Potential::Well });
    for wanted in [1e-17, 1e-30, 1e-300, f64::from_bits(1)] {
        let refused = run_to(&line, at(0.3, -0.5), 40.0, wanted).err();
        assert!(
            matches!(
                refused,
                Some(InputError::Accuracy { cause: SelectionFailure::RoundOff, reached, .. }) if reached < 1e-13
            ),
            "{wanted:e}: {refused:?}"
        );
    }
}

/// A motion that has come to rest, up to round-off, is continued to the end of the span.
#[test]
fn motions_that_come_to_rest_are_followed() {
    let line = One::from(Line { gamma: -0.89, swing: 0.0, potential: Potential::Well });
    for span in [40.0, 90.0, 400.0] {
        let outcome = run_to(&line, at(0.3, -0.5), span, 1e-8).unwrap();
        assert_eq!(outcome.status, Status::Completed, "{span}");
        // The minimum of the well, where the force is round-off.
        let x = VelocityPoint::new([outcome.q[0]], [outcome.p[0]], 0.0);
        let force = line.gradient(0.0, &x).x[0];
        assert!(span < 90.0 || (force.abs() <= 1e-14 && outcome.p[0].abs() <= 1e-14), "{span}: {force:e}, {outcome:?}");
    }
}

/// A position at rest stays at rest, while z changes.
#[test]
fn rest_is_followed() {
    let line = One::from(Line { gamma: -0.25, swing: 1.0, potential: Potential::Pole });
    let start = VelocityPoint::new([0.0], [0.0], -0.98);
    let outcome = run_to(&line, start, 20.0, 1e-8).unwrap();
    assert_eq!((outcome.status, outcome.q[0], outcome.p[0]), (Status::Completed, 0.0, 0.0));
    // z' = gamma (1 + cos t) z. The accuracy does not apply to z, but steps that do not resolve it to a twentieth are
    // refused.
    let z = -0.98 * (-0.25 * (20.0 + 20.0f64.sin())).exp();
    assert!(outcome.z.is_some_and(|found| (found - z).abs() <= 0.05 * z.abs()), "{:?}, not {z}", outcome.z);
}

/// A singularity is recognised in bounded work, by every method.
#[test]
fn singularities_end_the_search_soon() {
    let line = One::from(Line { gamma: 0.0, swing: 0.0, potential: Potential::Pole });
    for integrator in ["gauss_8", "midpoint", "strang", "midpoint_by_kahan_li_8"] {
        let integrator: AnyIntegrator = integrator.parse().unwrap();
        let clock = Instant::now();
        let problem = Problem::new(&line, 0.0, at(0.5, 0.5)).unwrap();
        let refused = problem.by(integrator).accuracy(1e-4).run(Until::Time(20.0)).err();
        assert!(
            matches!(
                refused,
                Some(InputError::Accuracy {
                    cause: SelectionFailure::StepFailed { .. } | SelectionFailure::Unresolved { .. },
                    ..
                })
            ),
            "{refused:?}"
        );
        // Half of the ten seconds that are allowed on a busy core.
        assert!(clock.elapsed().as_secs_f64() < 5.0, "{integrator}: {:?}", clock.elapsed());
    }
}

/// Where a motion decays below the normal numbers, to a few units of the smallest, runs differ by rounding and not by
/// chaos.
#[test]
fn what_decays_below_the_numbers_is_rounded() {
    let system = one(contact_examples::systems::HarmonicOscillator { gamma: -0.1 });
    let start = VelocityPoint::new([1e-300], [5e-301], 0.0);
    let refused = run_to(&system, start, 1e3, 1e-9).err();
    assert!(matches!(refused, Some(InputError::Accuracy { cause: SelectionFailure::RoundOff, .. })), "{refused:?}");
}
