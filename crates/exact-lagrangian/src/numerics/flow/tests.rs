//! Narrow forces, forces that are not smooth, motions that come to rest, and subnormal numbers.

use super::*;
use contact_examples::systems::Duffing;
use contact_geom::Hints;

/// A feature that a free particle meets.
#[derive(Clone, Copy)]
enum Thing {
    /// A Gaussian hill of the potential.
    Hill,
    /// A hill of compact support.
    Bump,
    /// A pulse of force in time.
    Kick,
    /// A pulse of drag in time.
    Drag,
    /// A step of the potential.
    Step,
    /// The potential `c |q|`.
    Kink,
    /// The potential `c |q|^3`.
    Cusp,
}

/// A feature of height `c` and width `w` at a place or time `at`.
struct Meeting {
    thing: Thing,
    c: f64,
    at: f64,
    w: f64,
}

impl Lagrangian<1> for Meeting {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let (kinetic, q) = (v[0] * v[0] * 0.5, q[0]);
        let square = |x: T| ((x - self.at) / self.w).powi(2);
        let modulus = (q * q).sqrt();
        kinetic
            + match self.thing {
                Thing::Hill => (-square(q)).exp() * -self.c,
                Thing::Bump if square(q).re() >= 1.0 => T::zero(),
                Thing::Bump => (-(-square(q) + 1.0).recip()).exp() * -self.c,
                Thing::Kick => q * (-square(t)).exp() * self.c,
                Thing::Drag => z * (-square(t)).exp() * -self.c,
                Thing::Step => (((q - self.at) / self.w).tanh() + 1.0) * (-0.5 * self.c),
                Thing::Kink => modulus * -self.c,
                Thing::Cusp => modulus * q * q * -self.c,
            }
    }
}

fn motion(system: &impl Lagrangian<1>, [q, v, z]: [f64; 3], duration: f64) -> Result<Motion<1>, ExactError<1>> {
    herglotz_flow(system, 0.0, &VelocityPoint::new([q], [v], z), duration)
}

/// Positions that do not lie on any grid.
fn position(k: u32) -> f64 {
    1.0 + 8.0 * (f64::from(k) * std::f64::consts::SQRT_2).fract()
}

/// Forces and drags of widths down to a thousandth of the span, at a hundred positions each: at most one of them is
/// missed, and no motion is refused. From a hill higher than its energy the particle returns with its initial speed.
#[test]
fn what_is_narrow_is_met() {
    let root_pi = std::f64::consts::PI.sqrt();
    for w in [0.1, 0.03, 0.01] {
        for thing in [Thing::Hill, Thing::Bump, Thing::Kick, Thing::Drag] {
            let (mut missed, mut worst) = (0, 0.0);
            for k in 0..100 {
                let v = 1.0 + 0.01 * f64::from(k);
                // Over ten units of position or of time.
                let (c, end, duration) = match thing {
                    Thing::Hill | Thing::Bump => (40.0, -v, 10.0 / v),
                    Thing::Kick => (1.0, v + w * root_pi, 10.0),
                    _ => (1.0, v * (-w * root_pi).exp(), 10.0),
                };
                let system = Meeting { thing, c, at: position(k), w };
                let found = motion(&system, [0.0, v, 0.3], duration).unwrap().end.v[0];
                if (found - v).abs() < 1e-12 { missed += 1 } else { worst = max_or_nan(worst, (found - end).abs()) }
            }
            // A velocity that is reversed within the width w is determined up to the rounding of the positions there,
            // times c / w.
            assert!(missed <= 1 && worst < 64.0 * f64::EPSILON * 9.0 * 40.0 / w, "w = {w}: {missed} missed, {worst:e}");
        }
    }
}

/// A known limitation: a hill of width 1e-5 on a span of 10 lies between two points that are checked.
#[test]
fn what_is_too_narrow_is_not_met() {
    let system = Meeting { thing: Thing::Hill, c: 40.0, at: 5.0 + 1e-3, w: 1e-5 };
    assert_eq!(motion(&system, [0.0, 1.0, 0.0], 10.0).unwrap().end.v[0], 1.0);
}

/// Jumps of a force are passed to round-off: the motions in the potential `|q|` are parabolas of period `4 sqrt 2`.
#[test]
fn kinks_are_found() {
    let system = Meeting { thing: Thing::Kink, c: 1.0, at: 0.0, w: 1.0 };
    for periods in [0.25, 0.5, 1.0, 10.0] {
        let found = motion(&system, [1.0, 0.0, 0.0], periods * 32f64.sqrt());
        let [q, v] = match periods {
            0.25 => [0.0, -2f64.sqrt()],
            0.5 => [-1.0, 0.0],
            _ => [1.0, 0.0],
        };
        // A dozen roundings in each half of a period, of an increasing time.
        let found = found.unwrap();
        let apart = max_or_nan((found.end.q[0] - q).abs(), (found.end.v[0] - v).abs());
        assert!(apart < 128.0 * f64::EPSILON * (1.0 + periods), "{periods}: {apart:e}");
        assert!(found.evaluations < 6000 + 6000 * periods as u64, "{periods}: {}", found.evaluations);
    }
    let system = Meeting { thing: Thing::Cusp, ..system };
    let found = motion(&system, [1.0, 0.0, 0.0], 10.0).unwrap().end;
    let energy = 0.5 * found.v[0].powi(2) + found.q[0].abs().powi(3);
    assert!((energy - 1.0).abs() < 64.0 * f64::EPSILON, "{energy}");
}

/// A step of the potential that a rounded position does not resolve is refused, with the time; a wider one is passed.
#[test]
fn a_step_within_rounding_is_refused() {
    let step = |w: f64, c: f64| motion(&Meeting { thing: Thing::Step, c, at: 5.0, w }, [0.0, 1.0, 0.0], 10.0);
    for c in [0.3, 3.0] {
        match step(1e-12, c) {
            Err(ExactError::OutsideDomain { t, .. } | ExactError::Unfinished { t, .. }) => {
                assert!((t - 5.0).abs() < 1e-9, "{t}")
            }
            other => unreachable!("{other:?}"),
        }
    }
    // The acceleration is determined up to the rounding of the position in units of the width.
    let climbed = step(1e-4, 0.3).unwrap().end.v[0];
    assert!((climbed - 0.4f64.sqrt()).abs() < 5.0 * f64::EPSILON / 1e-4, "{climbed}");
}

/// `v^2/2 - q^2/2 - z^2/2 + 1`, which comes to rest at `z = sqrt 2`.
struct Settling;
impl Lagrangian<1> for Settling {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        (v[0] * v[0] - q[0] * q[0] - z * z) * 0.5 + 1.0
    }
}

/// A motion that comes to rest away from the origin is completed, with a number of evaluations that grows linearly with
/// the time.
#[test]
fn a_motion_comes_to_rest() {
    for time in [15.8, 80.0, 300.0, 1000.0] {
        let found = motion(&Settling, [0.5, 0.5, -0.2], time).unwrap();
        // The slow decay of the action, by e^(-sqrt 2 t), and of the oscillation.
        let left = (-0.7 * time).exp() + 4.0 * f64::EPSILON;
        assert!((found.end.z - 2f64.sqrt()).abs() < left && found.end.q[0].abs() < left, "{time}: {:?}", found.end);
        assert!(found.evaluations < 3000 + 500 * time as u64, "{time}: {}", found.evaluations);
    }
    let duffing = Duffing::default();
    for time in [100.0, 1000.0] {
        let found = motion(&duffing, [1.5, 0.0, 0.0], time).unwrap();
        assert!((found.end.q[0].abs() - 1.0).abs() < 1e-5 && found.evaluations < 200_000, "{time}: {found:?}");
    }
}

/// `v^2/2 - q^2/2`.
struct Spring;
impl Lagrangian<1> for Spring {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        (v[0] * v[0] - q[0] * q[0]) * 0.5
    }
}

/// Motions of normal and subnormal size, and one that overflows.
#[test]
fn hardly_numbers() {
    for size in [1e-150, 1e-160, 1e-290, 1e-305, 1e-310, 1e-320, 5e-324] {
        let found = motion(&Spring, [size, 0.0, 0.0], 10.0).unwrap();
        let apart = (found.end.q[0] - size * 10f64.cos()).abs();
        // A dozen roundings to the smallest number in each of a dozen panels.
        assert!(apart <= 1e-13 * size + 128.0 * SMALLEST, "{size:e}: {apart:e}");
        assert!(found.evaluations < 4000, "{size:e}: {}", found.evaluations);
    }
    let found = motion(&Spring, [1e150, 0.0, 0.0], 10.0).unwrap();
    assert!((found.end.q[0] / 1e150 - 10f64.cos()).abs() < 1e-13);
    assert!(motion(&Spring, [1e200, 0.0, 0.0], 10.0).is_err());
}

/// `v^2/2 - k q^2/2 + cos q`: a spring with a ripple, which far from the origin is a small part of the force.
struct Rippled {
    k: f64,
}
impl Lagrangian<1> for Rippled {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 - q[0] * q[0] * (0.5 * self.k) + q[0].cos()
    }
}

/// A fast force that is small compared with another is resolved, over a hundred of its periods and over ten thousand:
/// where it is a millionth of the other force, and where it is below the interpolation error of the other force.
#[test]
fn a_ripple_on_a_spring_is_met() {
    let (q, v) = (5e5, 8e5);
    for (k, longest) in [(1.0, 0.1), (1e3, 0.01)] {
        let system = Rippled { k };
        for duration in [0.01 * longest, 0.1 * longest, longest] {
            let whole = motion(&system, [-q, v, 0.0], duration).unwrap().end;
            // Substeps of at most a sixth of a period of the ripple.
            let (fastest, mut x) = (v + q * k.sqrt(), [-q, v]);
            let parts = (duration * fastest).ceil();
            for _ in 0..parts as u32 {
                let end = motion(&system, [x[0], x[1], 0.0], duration / parts).unwrap().end;
                x = [end.q[0], end.v[0]];
            }
            let apart = max_or_nan((whole.q[0] - x[0]).abs() / q, (whole.v[0] - x[1]).abs() / fastest);
            // The roundings of the substeps add up like a random walk; neighbouring motions separate no faster than q
            // k.sqrt() per unit of time.
            assert!(apart < 4.0 * f64::EPSILON * parts.sqrt(), "{k}, {duration}: {apart:e}");
        }
    }
}

/// The work is bounded, however long the time.
#[test]
fn the_work_is_bounded() {
    let found = motion(&Spring, [1.0, 0.0, 0.0], 1e9);
    assert!(matches!(found, Err(ExactError::Unfinished { t, .. }) if t > 1e3), "{found:?}");
}

/// A particle with drag and a step of the potential at q = 0.7, whose height is given.
struct Step(f64);

impl Lagrangian<1> for Step {
    const HINTS: Hints = Hints { switching_functions: true, ..Hints::NONE };

    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - q[0].if_less(T::from(0.7), T::zero(), T::from(self.0)) - z * 0.1
    }
    fn switching_functions(&self, _t: f64, x: &VelocityPoint<1>, values: &mut Vec<f64>) {
        values.push(x.q[0] - 0.7);
    }
}

/// A vector field has no flow across a jump of L: the motion is refused, while a run continues by the corner
/// conditions. A step of height zero is not refused.
#[test]
fn a_jump_of_the_lagrangian_is_refused() {
    use discrete_herglotz::{Problem, Steps, Until};
    let start = VelocityPoint::new([0.0], [1.0], 0.0);
    for height in [5.0, 0.2, -0.2] {
        let system = Step(height);
        let refused = herglotz_flow(&system, 0.0, &start, 2.0);
        assert!(matches!(refused, Err(ExactError::OutsideDomain { t, .. }) if t < 0.8), "{height}: {refused:?}");
        let problem = Problem::new(&system, 0.0, start).unwrap();
        let run = problem.by(crate::ExactFlow).steps(Steps::Count(4)).run(Until::Time(2.0)).unwrap();
        let eight = problem.accuracy(1e-12).run(Until::Time(2.0)).unwrap();
        assert!((run.q[0] - eight.q[0]).abs() <= 1e-11, "{height}: {} and {}", run.q[0], eight.q[0]);
        // Up to the step the drag reduces the velocity; the energy at the step decides whether the particle passes.
        assert!((run.q[0] > 0.7) == (height < 0.4), "{height}: {}", run.q[0]);
    }
    let flat = herglotz_flow(&Step(0.0), 0.0, &start, 2.0).unwrap();
    let expected = (1.0 - (-0.2_f64).exp()) / 0.1;
    assert!((flat.end.q[0] - expected).abs() <= 4.0 * f64::EPSILON * expected, "{}", flat.end.q[0]);
}
