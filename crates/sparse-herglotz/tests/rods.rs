//! Chains and nets of rods by RATTLE with drag: agreement with the library for small systems, the constraints, energy,
//! momenta, reversibility, forces, and invalid input.

use contact_geom::constraints::Constraint;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};
use discrete_herglotz::constraints::{ConstrainedStart, DragRattle, OffConstraint};
use discrete_herglotz::{InputError, SplittingScheme, StepError, Stepper};
use sparse_herglotz::systems::{RodChain, RodNet};
use sparse_herglotz::{
    Distance, FIXED, LocalConstraint, SparseError, SparseGauss, SparseMidpoint, SparseRattle, SparseSplitting,
    SparseSystem, State,
};

const G: f64 = 9.81;
const MASSES: [f64; 3] = [1.0, 2.0, 0.5];

/// Three rods of unequal lengths and masses as a single Lagrangian and constraint.
#[derive(Clone, Copy)]
struct Rods;

const LENGTHS: [f64; 3] = [1.0, 0.5, 0.75];

impl Lagrangian<6> for Rods {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 6>, v: &SVector<T, 6>, z: T) -> T {
        let mut l = -z * 0.3;
        for (i, m) in MASSES.iter().enumerate() {
            let [vx, vy] = [v[2 * i], v[2 * i + 1]];
            l += (vx * vx + vy * vy) * (0.5 * m) - q[2 * i + 1] * (m * G);
        }
        l
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, separable: true, z_affine: true, constant_mass: true, ..Structure::default() }
    }
}

impl Constraint<6, 3> for Rods {
    fn value<T: Scalar>(&self, q: &SVector<T, 6>) -> SVector<T, 3> {
        let at = |i: usize, k: usize| if i == 0 { T::zero() } else { q[2 * i - 2 + k] };
        SVector::from_fn(|i, _| {
            let [x, y] = [0, 1].map(|k| at(i + 1, k) - at(i, k));
            x * x + y * y - LENGTHS[i] * LENGTHS[i]
        })
    }
}

/// The same system of local terms.
fn three_rods() -> SparseSystem {
    let masses = MASSES.iter().flat_map(|m| [*m, *m]).collect();
    let rods = (0..3).map(|i| {
        let before = |k: usize| if i == 0 { FIXED } else { 2 * i - 2 + k };
        ([before(0), before(1), 2 * i, 2 * i + 1], [LENGTHS[i]])
    });
    SparseSystem::new(6)
        .unwrap()
        .with_masses(masses)
        .with_drag(-0.3)
        .with_potential(sparse_herglotz::systems::Weight, (0..3).map(|i| ([2 * i + 1], [MASSES[i] * G])))
        .unwrap()
        .with_constraint(Distance, rods)
        .unwrap()
}

/// A large system with its start.
fn start<'a>(q: &'a [f64], v: &'a [f64]) -> State<'a> {
    State { t: 0.0, q, v, z: Some(0.0) }
}

fn largest(x: impl IntoIterator<Item = f64>) -> f64 {
    x.into_iter().fold(0.0, |m: f64, x| if x.is_nan() { f64::NAN } else { m.max(x.abs()) })
}

/// States, action, conformal factor, multipliers and impulses agree with those of `DragRattle`. The round-off of 50 steps
/// of eight or more multiplier equations each, of a motion of size ten, whose neighbouring motions do not diverge in this
/// time.
#[test]
fn three_rods_agree_with_the_small_library() {
    let angles: [f64; 3] = [1.0, 0.4, 2.0];
    let mut q = [0.0; 6];
    for (i, (angle, l)) in angles.iter().zip(LENGTHS).enumerate() {
        let before = if i == 0 { [0.0; 2] } else { [q[2 * i - 2], q[2 * i - 1]] };
        (q[2 * i], q[2 * i + 1]) = (before[0] + l * angle.sin(), before[1] - l * angle.cos());
    }
    let system = three_rods();
    for (scheme, h) in [(SplittingScheme::STRANG, 0.01), (SplittingScheme::KAHAN_LI_8, -0.02)] {
        let begin = ConstrainedStart::new(VelocityPoint { q: q.into(), v: SVector::zeros(), z: 0.0 });
        let mut small = DragRattle::new(Rods, Rods, &scheme, h, &begin).unwrap();
        let mut large = SparseRattle::new(&system, &scheme, h, start(&q, &[0.0; 6]), OffConstraint::Refuse).unwrap();
        assert_eq!((small.advance(50), large.advance(50)), (Ok(()), Ok(())));
        let (x, found) = (small.velocity_point(), large.state());
        let differences = (0..6).flat_map(|i| [found.q[i] - x.q[i], found.v[i] - x.v[i]]);
        let difference = largest(differences.chain([found.z.unwrap() - x.z, found.t - small.time()]));
        assert!(difference <= 5e-13, "{}: {difference:e}", scheme.name());
        assert!((large.sigma() - small.sigma()).abs() <= f64::EPSILON);
        let impulse = small.impulse().unwrap();
        let difference = largest(large.impulses().iter().zip(impulse.iter()).map(|(a, b)| a - b));
        assert!(difference <= 1e-12, "{}: impulses {difference:e}", scheme.name());
        let multipliers = small.multipliers().unwrap();
        let difference = largest(large.multipliers().unwrap().iter().zip(multipliers.iter()).map(|(a, b)| a - b));
        assert!(difference <= 1e-11, "{}: multipliers {difference:e}", scheme.name());
    }
}

/// Over 1e4 steps the constraints hold to the round-off of the squares of positions of size one, velocities are tangent,
/// and Newton's method needs few iterations.
#[test]
fn constraints_hold() {
    let rods = RodChain { links: 8, length: 0.125, mass: 0.125, gravity: G };
    let (chain, q) = (rods.system(-0.2).unwrap(), rods.straight(1.2));
    let v = vec![0.0; q.len()];
    let mut motion =
        SparseRattle::new(&chain, &SplittingScheme::STRANG, 1e-3, start(&q, &v), OffConstraint::Refuse).unwrap();
    let mut off: f64 = 0.0;
    for _ in 0..100 {
        motion.advance(100).unwrap();
        off = largest([off, largest(motion.residuals().iter().copied())]);
    }
    assert!(off <= 1e-15 * 8.0, "{off:e}");
    assert!(motion.iterations() <= 12 * 10_000, "{} iterations", motion.iterations());
    assert!(motion.unresolved().is_none());
    let State { q, v, .. } = motion.state();
    let along =
        (1..8).map(|i| (0..2).map(|k| (q[2 * i + k] - q[2 * i - 2 + k]) * (v[2 * i + k] - v[2 * i - 2 + k])).sum());
    assert!(largest(along) <= 1e-14, "the velocities are not tangent");
}

/// Without drag the error of the energy of a chain of 32 rods has the order of the scheme, within 0.15.
#[test]
fn energy() {
    let rods = RodChain { links: 32, length: 1.0 / 32.0, mass: 1.0 / 32.0, gravity: G };
    let (chain, q) = (rods.system(0.0).unwrap(), rods.straight(0.5));
    let v = vec![0.0; q.len()];
    let error = |scheme: &SplittingScheme, steps: usize| {
        let mut motion =
            SparseRattle::new(&chain, scheme, 0.4 / steps as f64, start(&q, &v), OffConstraint::Refuse).unwrap();
        let before = chain.energy(motion.state()).unwrap();
        let mut found: f64 = 0.0;
        for _ in 0..8 {
            motion.advance(steps / 8).unwrap();
            found = largest([found, chain.energy(motion.state()).unwrap() - before]);
        }
        found
    };
    for (scheme, order, steps) in
        [(SplittingScheme::STRANG, 2.0, [512, 1024, 2048]), (SplittingScheme::SUZUKI_4, 4.0, [128, 256, 512])]
    {
        let errors = steps.map(|k| error(&scheme, k));
        let slope = (errors[0] / errors[2]).log2() / 2.0;
        assert!((slope - order).abs() <= 0.15, "{}: {slope}, {errors:?}", scheme.name());
        // Above the round-off of an energy of size five.
        assert!(errors[2] > 1e-13, "{errors:?}");
    }
}

/// The linear and angular momenta of a free chain without weight are multiplied by `e^(gamma t)`.
#[test]
fn momenta() {
    let rods = RodChain { links: 20, length: 0.05, mass: 1.0, gravity: 0.0 };
    let (chain, q) = (rods.free(-0.3).unwrap(), rods.straight(0.7));
    let v: Vec<f64> = (0..q.len()).map(|i| 0.3 + (1.3 * i as f64 + 0.2).sin()).collect();
    let mut motion =
        SparseRattle::new(&chain, &SplittingScheme::SUZUKI_4, 0.01, start(&q, &v), OffConstraint::Project).unwrap();
    let momenta = |at: State| {
        let mut sums = [0.0; 3];
        for (q, v) in at.q.chunks(2).zip(at.v.chunks(2)) {
            sums = [sums[0] + v[0], sums[1] + v[1], sums[2] + q[0] * v[1] - q[1] * v[0]];
        }
        sums
    };
    let before = momenta(motion.state());
    motion.advance(200).unwrap();
    let after = momenta(motion.state());
    let factor = (-0.3_f64 * 2.0).exp();
    for (before, after) in before.iter().zip(after) {
        assert!(before.abs() > 0.1, "{before} is no test");
        // 1000 substeps, each with some ten roundings of sums of 20 terms of size one, which add up like a random walk.
        let error = (after - factor * before).abs();
        assert!(error <= 1e-12, "{error:e}");
    }
    assert!((motion.sigma() - (-0.003_f64).exp()).abs() <= f64::EPSILON);
}

/// The steps are symmetric: the same number of steps backwards returns to the start.
#[test]
fn reversal() {
    let rods = RodNet { size: [4, 3], length: 0.5, mass: 1.0, gravity: G };
    let (net, q) = (rods.system(-0.2).unwrap(), rods.hanging(0.6));
    // A velocity out of the plane of the net and along its edge, projected to the tangent space.
    let v: Vec<f64> = (0..q.len()).map(|i| 0.3 * (2.1 * i as f64).sin()).collect();
    let scheme = SplittingScheme::SUZUKI_4;
    let mut there = SparseRattle::new(&net, &scheme, 0.01, start(&q, &v), OffConstraint::Project).unwrap();
    let (begin, begin_v) = (there.state().q.to_vec(), there.state().v.to_vec());
    there.advance(50).unwrap();
    let off = largest(there.residuals().iter().copied());
    assert!(off <= 1e-14, "{off:e}");
    let end = there.state();
    let mut back = SparseRattle::new(&net, &scheme, -0.01, end, OffConstraint::Refuse).unwrap();
    back.advance(50).unwrap();
    let State { t, q, v, z } = back.state();
    let difference = largest(q.iter().zip(&begin).chain(v.iter().zip(&begin_v)).map(|(a, b)| a - b));
    // The round-off of 500 substeps, amplified by the instability of the motion by some ten.
    assert!(difference <= 1e-11, "{difference:e}");
    assert!(z.unwrap().abs() <= 1e-10 && t.abs() <= 1e-14, "{z:?}, {t}");
}

/// In equilibrium the rods carry the weight below them: the multiplier of a rod is `-T/(2 l)` with its tension T, and the
/// constraint forces balance the weights. A constant rate given as a function of time yields the same motion.
#[test]
fn forces() {
    let rods = RodChain { links: 5, length: 0.5, mass: 2.0, gravity: G };
    let (chain, q) = (rods.system(-0.3).unwrap(), rods.straight(0.0));
    let v = vec![0.0; q.len()];
    let mut motion =
        SparseRattle::new(&chain, &SplittingScheme::STRANG, 0.01, start(&q, &v), OffConstraint::Refuse).unwrap();
    motion.advance(10).unwrap();
    for (i, found) in motion.multipliers().unwrap().iter().enumerate() {
        let tension = (5 - i) as f64 * 2.0 * G;
        assert!((found + tension).abs() <= 1e-12, "{found}");
    }
    for (i, found) in motion.constraint_forces().unwrap().iter().enumerate() {
        let weight = if i % 2 == 1 { 2.0 * G } else { 0.0 };
        assert!((found - weight).abs() <= 1e-12, "{found}");
    }
    let mean: Vec<f64> = motion.impulses().iter().map(|y| y / 0.01).collect();
    // Positions are solved to round-off, which the mean of a step contains divided by h^2.
    assert!(largest(mean.iter().zip(motion.multipliers().unwrap()).map(|(a, b)| a - b)) <= 1e-9);
    let timed = rods.system(0.0).unwrap().with_timed_drag(|_| -0.3);
    let q = rods.straight(0.4);
    let run = |system: &SparseSystem| {
        let mut motion =
            SparseRattle::new(system, &SplittingScheme::SUZUKI_4, 0.01, start(&q, &v), OffConstraint::Refuse).unwrap();
        motion.advance(20).unwrap();
        let end = motion.state();
        [end.q, end.v, &[end.z.unwrap(), motion.sigma()]].concat()
    };
    let difference = largest(run(&chain).iter().zip(run(&timed)).map(|(a, b)| a - b));
    assert!(difference <= 1e-12, "{difference:e}");
}

/// The rod without its closed forms.
struct Derived;

impl LocalConstraint<6, 1> for Derived {
    fn value<T: Scalar>(&self, q: &SVector<T, 6>, c: &[T; 1]) -> T {
        Distance.value(q, c)
    }
}

#[test]
fn derivatives_of_a_rod() {
    let q = SVector::from([0.3, -1.0, 0.2, 0.9, 0.1, 2.0]);
    let v = SVector::from([1.0, 0.5, -0.2, 0.3, 0.3, 0.1]);
    let closed = LocalConstraint::<6, 1>::gradient(&Distance, &q, &[1.5]);
    assert!(largest((closed - Derived.gradient(&q, &[1.5])).iter().copied()) <= 8.0 * f64::EPSILON);
    let relative = [-0.7, -0.2, 0.3];
    let curvature = 2.0 * relative.iter().map(|r: &f64| r * r).sum::<f64>();
    assert!((Derived.curvature(&q, &v, &[1.5]) - curvature).abs() <= 8.0 * f64::EPSILON);
}

#[test]
fn invalid_starts() {
    let rods = RodChain { links: 6, length: 0.5, mass: 1.0, gravity: G };
    let (chain, q) = (rods.system(-0.3).unwrap(), rods.straight(0.3));
    let v = vec![0.0; 12];
    let new = |system: &SparseSystem, q: &[f64], v: &[f64], off| {
        SparseRattle::new(system, &SplittingScheme::STRANG, 0.01, start(q, v), off).err()
    };
    // The last mass, moved along its rod by 1e-3: to first order this is its distance.
    let mut moved = q.clone();
    (moved[10], moved[11]) = (q[10] + 1e-3 * 0.3_f64.sin(), q[11] - 1e-3 * 0.3_f64.cos());
    match new(&chain, &moved, &v, OffConstraint::Refuse) {
        // Both ends of a rod move, so that the gradient is longer than that of one end by sqrt 2.
        Some(SparseError::OffConstraint { list: 1, element: 5, distance }) => {
            assert!((distance - 1e-3 / 2.0_f64.sqrt()).abs() <= 1e-5, "{distance}");
        }
        other => panic!("{other:?}"),
    }
    let mut motion =
        SparseRattle::new(&chain, &SplittingScheme::STRANG, 0.01, start(&moved, &v), OffConstraint::Project).unwrap();
    assert!(largest(motion.residuals().iter().copied()) <= 1e-14);
    let mut leaving = v.clone();
    leaving[5] = 0.1;
    let refused = new(&chain, &q, &leaving, OffConstraint::Refuse);
    assert!(matches!(refused, Some(SparseError::OffVelocity { list: 1, element: 2 | 3, .. })), "{refused:?}");
    // The third rod a second time.
    let twice = rods.system(0.0).unwrap().with_constraint(Distance, [([2, 3, 4, 5], [0.5])]).unwrap();
    for off in [OffConstraint::Refuse, OffConstraint::Project] {
        let refused = new(&twice, &q, &v, off);
        assert!(
            matches!(
                refused,
                Some(SparseError::Dependent { list: 1, element: 2 } | SparseError::Dependent { list: 2, .. })
            ),
            "{refused:?}"
        );
    }
    // The squares overflow.
    let refused = new(&chain, &[f64::MAX; 12], &v, OffConstraint::Project);
    assert!(matches!(refused, Some(SparseError::UndefinedConstraint { list: 1, element: 0 })), "{refused:?}");
    let long = SparseRattle::new(&chain, &SplittingScheme::BLANES_MOAN_4, 0.01, start(&q, &v), OffConstraint::Refuse);
    assert!(matches!(long.err(), Some(SparseError::Input(InputError::Hypothesis { .. }))));
    let free = SparseSystem::new(2).unwrap().with_mass(1.0);
    assert_eq!(new(&free, &[0.0; 2], &[0.0; 2], OffConstraint::Refuse), Some(SparseError::Unconstrained));
    let rubbed = rods.system(0.0).unwrap().with_friction(vec![0.1; 12]);
    assert!(matches!(new(&rubbed, &q, &v, OffConstraint::Refuse), Some(SparseError::Friction { .. })));
    let begin = start(&q, &v);
    let splitting = SparseSplitting::new(&chain, &SplittingScheme::STRANG, 0.01, begin).err();
    assert_eq!(splitting, Some(SparseError::Constrained { method: "`SparseSplitting`" }));
    assert!(matches!(SparseMidpoint::new(&chain, 0.01, begin, None).err(), Some(SparseError::Constrained { .. })));
    assert!(matches!(SparseGauss::new(&chain, 1, 0.01, begin, None).err(), Some(SparseError::Constrained { .. })));
    let outside = SparseSystem::new(3).unwrap().with_constraint(Distance, [([1, 3], [1.0])]).err();
    assert_eq!(outside, Some(SparseError::OutOfRange { list: 0, element: 0, unknown: 3, last: 2 }));
}

/// A step that is far too long fails, and keeps the state before it.
#[test]
fn a_failing_step() {
    let rods = RodChain { links: 6, length: 0.5, mass: 1.0, gravity: G };
    let (chain, q) = (rods.system(-0.3).unwrap(), rods.straight(1.0));
    let v = vec![0.0; 12];
    let mut motion =
        SparseRattle::new(&chain, &SplittingScheme::STRANG, 30.0, start(&q, &v), OffConstraint::Refuse).unwrap();
    let failure = motion.advance(5).unwrap_err();
    assert!(matches!(
        failure.cause,
        StepError::NotConverged { .. } | StepError::Singular { .. } | StepError::NonFinite
    ));
    assert_eq!(failure.taken, 0);
    assert_eq!(motion.state(), start(&q, &v));
    assert_eq!(motion.advance(1).unwrap_err().cause, failure.cause);
}
