//! Runs with a requested accuracy: the error is at most the requested one, or the run is refused with the cause; and
//! false declarations of structure, which are found along the motion.

use crate::lagrangians::One;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint, legendre};
use discrete_herglotz::{
    AnyIntegrator, InputError, Problem, Rows, Run, SelectionFailure, Status, StepError, Steps, Until,
};
use exact_lagrangian::herglotz_flow;

/// A mechanical system, and others with a false structure.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// The formula of [`Bench`].
    Mechanical,
    /// `v q - q^2/2 - z/10`: W vanishes.
    Singular,
    /// A rate that depends on time, with vanishing derivative at t = 0.
    Rate,
    /// A force that depends on time in the same way.
    Force,
    /// Drag beyond q = 1.
    Region,
    /// A wall away from q = 0.
    Wall,
    /// A cubic potential, all of it scaled by 1e-12.
    Small,
}

/// `v^2/2 - k q^2/2 - quartic q^4/4 + gamma z - c z^2 + q (force sin(omega t) + kick e^(-((t - at)/width)^2))`.
#[derive(Clone, Copy, Debug)]
pub struct Bench {
    gamma: f64,
    c: f64,
    k: f64,
    quartic: f64,
    force: f64,
    omega: f64,
    kick: f64,
    at: f64,
    width: f64,
    kind: Kind,
    claims: Option<Structure>,
}

const FREE: Bench = Bench {
    gamma: 0.0,
    c: 0.0,
    k: 0.0,
    quartic: 0.0,
    force: 0.0,
    omega: 0.0,
    kick: 0.0,
    at: 0.0,
    width: 1.0,
    kind: Kind::Mechanical,
    claims: None,
};
const OSCILLATOR: Bench = Bench { k: 1.0, ..FREE };
const DUFFING: Bench = Bench { k: -1.0, quartic: 1.0, gamma: -0.25, ..FREE };

impl Lagrangian<1> for Bench {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let (square, u) = (q[0] * q[0], (t - self.at) * (1.0 / self.width));
        let kinetic = v[0] * v[0] * 0.5;
        match self.kind {
            Kind::Mechanical => {
                let force = (t * self.omega).sin() * self.force + (-(u * u)).exp() * self.kick;
                let potential = square * (square * (0.25 * self.quartic) + 0.5 * self.k);
                kinetic - potential + z * self.gamma - z * z * self.c + q[0] * force
            }
            Kind::Singular => v[0] * q[0] - square * 0.5 - z * 0.1,
            Kind::Rate => kinetic - square * 0.5 - z * t.cos() * 0.3,
            Kind::Force => kinetic - square * 0.5 + q[0] * (t * 0.7).cos() * 0.5,
            Kind::Region => kinetic - z * ((q[0] - 1.0) * 20.0).tanh() * 0.1,
            Kind::Wall => kinetic - square * 0.5 - (q[0] * (1.0 / 1.5)).powi(40),
            Kind::Small => (kinetic - square * q[0] * 0.5) * 1e-12,
        }
    }
    fn structure(&self) -> Structure {
        if let Some(claims) = self.claims {
            return claims;
        }
        let affine = self.c == 0.0;
        Structure {
            autonomous: self.force == 0.0 && self.kick == 0.0,
            z_free: affine && self.gamma == 0.0,
            z_affine: affine,
            constant_rate: affine,
            separable: true,
            quadratic: affine && self.quartic == 0.0,
            constant_mass: true,
        }
    }
}

/// (q, p) after a span by the exact flow.
fn truth(system: &One, start: &VelocityPoint<1>, span: f64) -> [f64; 2] {
    let end = herglotz_flow(system, 0.0, start, span).unwrap().end;
    let end = legendre(system, span, &end);
    [end.q[0], end.p[0]]
}

fn problem(system: &One, start: VelocityPoint<1>) -> Problem<'_, One, 1> {
    Problem::new(system, 0.0, start).unwrap()
}

/// The error in (q, p) of a run up to a time, relative to their size.
fn error(run: Run<'_, '_, Problem<'_, One, 1>>, t: f64, truth: [f64; 2]) -> Result<f64, InputError> {
    let outcome = run.run(Until::Time(t))?;
    assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None));
    let size = truth[0].hypot(truth[1]);
    Ok(if size == 0.0 {
        outcome.q[0].hypot(outcome.p[0])
    } else {
        (outcome.q[0] - truth[0]).hypot(outcome.p[0] - truth[1]) / size
    })
}

fn by(name: &str) -> AnyIntegrator {
    name.parse().unwrap()
}

/// The steps of the first trial runs resonate with the drive: runs of 4 and 8 steps evaluate no force at all.
#[test]
fn steps_that_resonate_with_the_drive() {
    let driven = One::from(Bench { gamma: -0.1, force: 1.0, omega: std::f64::consts::TAU, ..FREE });
    let start = VelocityPoint::new([0.3], [0.0], 0.0);
    let truth = truth(&driven, &start, 16.0);
    for name in ["strang", "midpoint", "gauss_2", "gauss_8", "blanes_moan_6"] {
        let problem = problem(&driven, start);
        let error = error(problem.by(by(name)).accuracy(1e-6), 16.0, truth).unwrap();
        assert!(error <= 1e-6, "{name}: {error:e}");
    }
}

/// With steps of a thousand periods an oscillator does not move; spans of a thousand to a million periods.
#[test]
fn steps_far_beyond_the_period() {
    let (oscillator, start) = (One::from(OSCILLATOR), VelocityPoint::new([1.0], [0.0], 0.0));
    for span in [1e3, 3.3e4, 1.7e6, 9.1e6] {
        let (sin, cos) = f64::sin_cos(span);
        let problem = problem(&oscillator, start);
        let to = |wanted| problem.accuracy(wanted);
        for (run, wanted) in [(to(1e-2).by(by("gauss_8")), 1e-2), (to(1e-7), 1e-7)] {
            let error = error(run, span, [cos, -sin]).unwrap();
            assert!(error <= wanted, "{span}: {error:e}");
        }
    }
}

/// A run with a relative error of a millionth, by a named integrator or by the default.
fn to_a_millionth<'p, 'o>(problem: &'p Problem<'p, One, 1>, name: Option<&str>) -> Run<'p, 'o, Problem<'p, One, 1>> {
    let run = problem.accuracy(1e-6);
    if let Some(name) = name { run.by(by(name)) } else { run }
}

/// A short kick is found by methods of low and high order, down to a thousandth of the span.
#[test]
fn short_kicks() {
    let start = VelocityPoint::new([1.0], [0.0], 0.0);
    for width in [1.0, 0.1, 0.016] {
        let kicked = One::from(Bench { gamma: -0.1, kick: 1.0 / width, at: 7.3, width, ..OSCILLATOR });
        // In three parts, so that the exact flow cannot miss the kick.
        let (before, after) = (7.3 - 6.0 * width, 7.3 + 6.0 * width);
        let mut x = start;
        for (from, to) in [(0.0, before), (before, after), (after, 16.0)] {
            x = herglotz_flow(&kicked, from, &x, to - from).unwrap().end;
        }
        let problem = problem(&kicked, start);
        for name in [None, Some("strang"), Some("gauss_3")] {
            let error = error(to_a_millionth(&problem, name), 16.0, [x.q[0], x.v[0]]).unwrap();
            assert!(error <= 1e-6, "{width}, {name:?}: {error:e}");
        }
    }
}

/// Amplitudes near the smallest numbers, and a start at rest in an equilibrium.
#[test]
fn tiny_motions_and_none() {
    let damped = One::from(Bench { gamma: -0.1, quartic: 1.0, ..OSCILLATOR });
    for size in [1e-160, 1e-300, 0.0] {
        let start = VelocityPoint::new([size], [0.0], 0.0);
        // The quartic term is below round-off, so that the closed form is that of the oscillator.
        let w = (1.0f64 - 0.0025).sqrt();
        let (sin, cos) = (10.0 * w).sin_cos();
        let decay = size * (-0.5f64).exp();
        let truth = [decay * (cos + 0.05 / w * sin), -decay * sin / w];
        let problem = problem(&damped, start);
        for name in [None, Some("strang")] {
            let error = error(to_a_millionth(&problem, name), 10.0, truth).unwrap();
            assert!(error <= 1e-6, "{size:e}: {error:e}");
        }
    }
}

/// A run backward is as accurate as one forward: damped motion grows there, and the kick is met from its other side.
#[test]
fn spans_that_go_back() {
    let start = VelocityPoint::new([1.0], [0.5], 0.0);
    let kicked = Bench { gamma: -0.1, kick: 1.0, at: -4.0, ..OSCILLATOR };
    for (system, span) in [(DUFFING, -5.0), (kicked, -12.0)] {
        let system = One::from(system);
        let (problem, truth) = (problem(&system, start), truth(&system, &start, span));
        for name in [None, Some("strang"), Some("midpoint"), Some("gauss_3"), Some("gauss_8")] {
            let error = error(to_a_millionth(&problem, name), span, truth).unwrap();
            assert!(error <= 1e-6, "{span}, {name:?}: {error:e}");
        }
    }
}

/// An accuracy that cannot be reached is refused with the cause.
#[test]
fn causes() {
    let start = VelocityPoint::new([1.0], [0.0], 0.0);
    let refused = |system: Bench, start: VelocityPoint<1>, span: f64| {
        let system = One::from(system);
        let problem = Problem::new(&system, 0.0, start);
        problem.and_then(|problem| to_a_millionth(&problem, None).plan(Until::Time(span)).map(drop)).err()
    };
    let chaotic = Bench { gamma: -0.1, force: 0.35, omega: 1.4, ..DUFFING };
    let cause = refused(chaotic, start, 500.0);
    let Some(InputError::Accuracy { cause: SelectionFailure::Chaos { t }, .. }) = cause else { panic!("{cause:?}") };
    assert!(t < 500.0);
    // Up to half of that time the run is accepted and accurate: the round-off of the exact flow grows to at most 1e-7
    // there.
    let trusted = 0.5 * t;
    let chaotic = One::from(chaotic);
    let problem = problem(&chaotic, start);
    let error = error(to_a_millionth(&problem, None), trusted, truth(&chaotic, &start, trusted));
    assert!(error.as_ref().is_ok_and(|e| *e <= 1e-6), "{trusted}: {error:?}");
    // Blow-up of z in a finite time.
    let pole = Bench { c: -1.0, ..FREE };
    let cause = refused(pole, VelocityPoint::new([0.0], [1.0], 1.0), 3.0);
    let Some(InputError::Accuracy { cause: SelectionFailure::StepFailed { t, .. }, .. }) = cause else {
        panic!("{cause:?}")
    };
    // v' = 2 z v and z' = v^2/2 + z^2: with w = z + v/sqrt(2) and u = z - v/sqrt(2), w' = w^2 and u' = u^2, so w has
    // its pole at 1/w0.
    let pole = 1.0 / (1.0 + 0.5f64.sqrt());
    assert!((t - pole).abs() < 1e-3, "{t}, not {pole}");
    let nan = Bench { gamma: f64::NAN, ..OSCILLATOR };
    assert_eq!(refused(nan, start, 10.0), Some(InputError::Undefined));
    let singular = Bench { kind: Kind::Singular, claims: Some(Structure::default()), ..FREE };
    let refused = refused(singular, start, 10.0);
    assert!(matches!(refused, Some(InputError::FirstStep(StepError::Singular { .. }))), "{refused:?}");
}

/// Declared properties that hold at the start and not elsewhere are found: before the run, at times of the whole span
/// and along its first steps, or during the run, as a status; with given steps and with steps that are chosen.
#[test]
fn claims_are_checked_along_the_motion() {
    let mechanical = Structure { separable: true, constant_mass: true, ..Structure::default() };
    let at = |q: f64, v: f64| VelocityPoint::new([q], [v], 0.0);
    let cases = [
        (Kind::Rate, Structure { constant_rate: true, z_affine: true, ..mechanical }, at(1.0, 0.0), "constant_rate"),
        (Kind::Force, Structure { autonomous: true, z_free: true, ..mechanical }, at(1.0, 0.0), "autonomous"),
        (Kind::Region, Structure { z_affine: true, autonomous: true, ..mechanical }, at(-1.0, 0.5), "z_affine"),
        (
            Kind::Wall,
            Structure { quadratic: true, autonomous: true, z_free: true, ..mechanical },
            at(0.0, 1.5),
            "quadratic",
        ),
        (
            Kind::Small,
            Structure { quadratic: true, autonomous: true, z_free: true, ..mechanical },
            at(0.5, 0.1),
            "quadratic",
        ),
    ];
    for (kind, structure, start, claim) in cases {
        let system = One::from(Bench { kind, claims: Some(structure), ..FREE });
        for steps in [Some(Steps::Count(400)), Some(Steps::Size(0.01)), None] {
            for integrator in ["gauss_6", "strang"] {
                let run = |problem: Problem<'_, One, 1>| {
                    let run = problem.by(by(integrator));
                    let run = if let Some(steps) = steps { run.steps(steps) } else { run.accuracy(1e-6) };
                    run.run(Until::Time(8.0))
                };
                let found = match Problem::new(&system, 0.0, start).and_then(run) {
                    Err(InputError::FalseClaim { claim, .. }) => Some(claim),
                    Ok(outcome) => match outcome.status {
                        Status::FalseClaim { claim, step, .. } => {
                            assert!(step > 0 && step <= outcome.steps);
                            Some(claim)
                        }
                        _ => None,
                    },
                    Err(_) => None,
                };
                assert!(found.is_some(), "{kind:?} by {integrator}, {steps:?}: not found");
                let separable = kind == Kind::Region && found == Some("separable");
                assert!(found == Some(claim) || separable, "{kind:?} by {integrator}: {found:?}");
            }
        }
    }
}

/// The error estimate is that of the run, and outputs in addition to the final state do not change it.
#[test]
fn the_estimate_is_of_the_run() {
    let start = VelocityPoint::new([1.5], [0.0], 0.0);
    let duffing = One::from(DUFFING);
    let truth = truth(&duffing, &start, 20.0);
    let (problem, until) = (problem(&duffing, start), Until::Time(20.0));
    for wanted in [1e-4, 1e-8] {
        let plan = problem.accuracy(wanted).plan(until).unwrap();
        assert!(plan.error().is_some_and(|e| e <= wanted));
        let mut rows = Rows::every(3).unwrap();
        let with_all = problem.accuracy(wanted).with_conformal_factor().observe(&mut rows);
        let planned = with_all.plan(until).unwrap();
        assert_eq!((plan.integrator(), plan.count()), (planned.integrator(), planned.count()));
        assert_eq!(plan.run().unwrap().q, with_all.run(until).unwrap().q);
        assert_eq!(rows.rows.len(), plan.count().div_ceil(3) + 1);
        assert!(error(problem.accuracy(wanted), 20.0, truth).unwrap() <= wanted);
    }
}
