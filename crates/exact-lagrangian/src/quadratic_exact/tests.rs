//! Comparison with the closed forms of the catalogue, and with the flow to round-off.

use super::*;
use crate::herglotz_flow;
use contact_examples::systems::{
    Chain, ChargedParticle, Ends, FreeParticle, HarmonicOscillator, Pendulum, UniformField,
};
use contact_geom::{
    Derivatives, GeometryError, Structure,
    numbers::{MaxAbsOrNan, MaxOrNan},
};

const GAMMAS: [f64; 12] = [-40.0, -2.5, -2.0 - 1e-12, -2.0, -2.0 + 1e-12, -1.999, -1e-9, 0.0, 1e-15, 0.3, 2.0, 2.5];
const STEPS: [f64; 5] = [1e-8, 1e-5, 1e-3, 0.1, 0.8];
const EPS: f64 = f64::EPSILON;

/// The largest errors of a comparison, in units of round-off.
#[derive(Debug, Default)]
struct Units {
    /// The error of q and v relative to the largest coordinate, and of z relative to its square.
    motion: f64,
    /// The error of the action between given points, relative to the action.
    value: f64,
    /// The error of the momenta, which are its derivatives, relative to the largest.
    momenta: f64,
}

impl Units {
    /// Includes the errors of the motion from a start to an end known to round-off; the action is given separately.
    fn compare<const N: usize>(
        &mut self,
        lagrangian: &impl Lagrangian<N>,
        h: f64,
        start: &VelocityPoint<N>,
        end: &VelocityPoint<N>,
        action: f64,
    ) {
        let found = QuadraticExact::new(lagrangian, h).map(|ld| {
            let x = DiscretePoint { q0: start.q, q1: end.q, z0: start.z };
            (ld.motion(start), ld.jet(0.0, &x))
        });
        let Ok((motion, Ok(jet))) = found else { unreachable!("{h}: {found:?}") };
        let size = start
            .q
            .max_abs_or_nan()
            .max_or_nan(start.v.max_abs_or_nan())
            .max_or_nan(end.q.max_abs_or_nan())
            .max_or_nan(end.v.max_abs_or_nan());
        let of_motion = ((motion.q - end.q).max_abs_or_nan().max_or_nan((motion.v - end.v).max_abs_or_nan()) / size)
            .max_or_nan((motion.z - end.z).abs() / end.z.abs().max_or_nan(size * size));
        let (p0, p1) = (lagrangian.gradient(0.0, start).y, lagrangian.gradient(0.0, end).y);
        // A rounding of q0 changes the momenta by about p/|q1 - q0| times itself, and the action by p times itself.
        let ill = start.q.max_abs_or_nan() / (end.q - start.q).max_abs_or_nan();
        let largest = p0.max_abs_or_nan().max_or_nan(p1.max_abs_or_nan());
        let of_momenta = (jet.d1 / jet.sigma() + p0).max_abs_or_nan().max_or_nan((jet.d2 - p1).max_abs_or_nan())
            / ((1.0 + ill) * largest);
        let of_value = (jet.value - action).abs() / (action.abs() + ill * p1.dot(&(end.q - start.q)).abs());
        self.motion = self.motion.max_or_nan(of_motion / EPS);
        self.value = self.value.max_or_nan(of_value / EPS);
        self.momenta = self.momenta.max_or_nan(of_momenta / EPS);
    }

    fn assert_below(&self, motion: f64, value: f64, momenta: f64, what: &str) {
        println!("{what}: {self:?}");
        assert!(self.motion <= motion && self.value <= value && self.momenta <= momenta, "{what}: {self:?}");
    }
}

/// All pairs of drags and steps, with shorter steps for strong drag.
fn cases() -> impl Iterator<Item = (f64, f64)> {
    GAMMAS.into_iter().flat_map(|gamma| STEPS.map(|h| (gamma, if gamma < -2.5 { h * 0.05 } else { h })))
}

/// Starts with and without an initial position and action. For a start at the origin no digit of q1 - q0 is lost.
const STARTS: [[f64; 3]; 3] = [[0.0, 1.7, 0.0], [0.3, 1.7, -0.4], [-1.0, 0.5, 2.0]];

#[test]
fn it_is_the_oscillator_and_the_free_particle_at_every_drag_and_step() {
    for [q, v, z] in STARTS {
        let start = VelocityPoint::new([q], [v], z);
        let bare = VelocityPoint { z: 0.0, ..start };
        let (mut oscillator, mut free) = (Units::default(), Units::default());
        for (gamma, h) in cases() {
            let z_change = z * (gamma * h).exp_m1();
            let system = HarmonicOscillator { gamma };
            oscillator.compare(&system, h, &start, &system.solution(h, &start), system.solution(h, &bare).z + z_change);
            let system = FreeParticle { gamma };
            free.compare(&system, h, &start, &system.solution(h, &start), system.solution(h, &bare).z + z_change);
        }
        // Some twenty roundings in each entry, at most two doublings, and ten roundings of the closed form.
        oscillator.assert_below(16.0, 16.0, 16.0, "oscillator");
        free.assert_below(16.0, 16.0, 16.0, "free particle");
    }
}

#[test]
fn it_is_the_fall_in_a_uniform_field() {
    for [q, v, z] in STARTS {
        let start = VelocityPoint::new([q, 0.5 * q], [v, -v], z);
        let bare = VelocityPoint { z: 0.0, ..start };
        let mut units = Units::default();
        for (gamma, h) in cases() {
            let system = UniformField { field: [0.6, -1.3], gamma };
            let action = system.solution(h, &bare).z + z * (gamma * h).exp_m1();
            units.compare(&system, h, &start, &system.solution(h, &start), action);
        }
        units.assert_below(16.0, 16.0, 16.0, "uniform field");
    }
}

#[test]
fn the_value_away_from_the_origin_keeps_all_digits_of_the_displacement() {
    let (mut worst, q0) = (0.0_f64, SVector::from([0.25, -0.5]));
    for (gamma, h) in cases() {
        let system = UniformField { field: [0.6, -1.3], gamma };
        // Exact in binary, so that q1 - q0 is exact as well.
        let step = h.log2().floor().exp2();
        let q1 = q0 + SVector::from([1.5 * step, -0.75 * step]);
        let (ld, v0) = (QuadraticExact::new(&system, h), system.velocity_through(&q0, &q1, h));
        let (Ok(ld), Some(v)) = (ld, v0) else { unreachable!("{gamma}, {h}") };
        let action = system.solution(h, &VelocityPoint { q: q0, v, z: 0.0 }).z;
        let Ok(found) = ld.value(0.0, &DiscretePoint { q0, q1, z0: 0.0 }) else { unreachable!("{gamma}, {h}") };
        worst = worst.max_or_nan((found - action).abs() / (action.abs() * EPS));
    }
    println!("away from the origin: {worst}");
    assert!(worst <= 16.0, "{worst}");
}

#[test]
fn the_small_part_that_the_start_has_in_the_displacement_is_not_lost() {
    let mut worst = 0.0_f64;
    for (gamma, h) in cases().filter(|(_, h)| *h <= 1e-5) {
        let (system, step) = (HarmonicOscillator { gamma }, h.log2().floor().exp2());
        let Ok(ld) = QuadraticExact::new(&system, h) else { unreachable!("{gamma}, {h}") };
        // The displacement from q = 1 at rest, by the series of q'' = -q + gamma q'; that by a unit of velocity has a
        // closed form.
        let of_start = -h * h * (0.5 + gamma * h / 6.0 + (gamma * gamma - 1.0) * h * h / 24.0);
        let by_velocity = system.solution(h, &VelocityPoint::new([0.0], [1.0], 0.0)).q[0];
        let Ok(jet) = ld.jet(0.0, &DiscretePoint::new([1.0], [1.0 + step], 0.0)) else { unreachable!("{gamma}, {h}") };
        let v0 = (step - of_start) / by_velocity;
        worst = worst.max_or_nan((jet.d1[0] / jet.sigma() + v0).abs() / (v0 * EPS));
    }
    println!("part of the start: {worst}");
    assert!(worst <= 16.0, "{worst}");
}

/// A quadratic Lagrangian in the plane with all coefficients non-zero; W is symmetric, and there is no other symmetry.
struct General {
    gamma: f64,
}

impl Lagrangian<2> for General {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let mass = v[0] * v[0] * 0.7 + v[0] * v[1] * 0.4 + v[1] * v[1] * 1.1;
        let mixed = q[0] * (v[0] * 0.3 - v[1] * 0.8) + q[1] * (v[0] * 0.5 + v[1] * 0.2);
        let potential = q[0] * q[0] * 0.6 - q[0] * q[1] * 0.3 - q[1] * q[1] * 0.2;
        mass + mixed - potential + q[0] * 0.9 - q[1] * 0.4 + v[0] * 0.6 - v[1] * 0.1 + z * self.gamma + 0.35
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, quadratic: true, ..Structure::default() }
    }
}

#[test]
fn it_is_the_flow_of_gyroscopic_and_many_body_systems() {
    fn with_flow<const N: usize>(system: &impl Lagrangian<N>, start: &VelocityPoint<N>, units: &mut Units) {
        for h in STEPS {
            let Ok(motion) = herglotz_flow(system, 0.0, start, h) else { unreachable!("linear motions go on forever") };
            units.compare(system, h, start, &motion.end, motion.action);
        }
    }
    let mut units = Units::default();
    for gamma in GAMMAS.into_iter().filter(|gamma| *gamma > -40.0) {
        for b in [0.0, 1e-9, 1.0, 3.0] {
            let system = ChargedParticle { b, k: 0.5, gamma };
            with_flow(&system, &VelocityPoint::new([0.4, -0.2], [0.3, 1.1], 0.3), &mut units);
        }
        let fixed = Chain::<4> { ends: Ends::Fixed, beta: 0.0, gamma };
        with_flow(&fixed, &VelocityPoint::new([0.5, -0.2, 0.9, 0.1], [1.0, 0.3, -0.7, 0.2], 0.3), &mut units);
        with_flow(&General { gamma }, &VelocityPoint::new([0.4, -0.2], [0.3, 1.1], 0.3), &mut units);
        let free = Chain::<3> { ends: Ends::Free, beta: 0.0, gamma };
        with_flow(&free, &VelocityPoint::new([0.5, -0.2, 0.9], [1.0, 0.3, -0.7], 0.3), &mut units);
    }
    units.assert_below(32.0, 32.0, 32.0, "systems");
}

#[test]
fn fast_oscillations_and_strong_drags_keep_their_digits_over_long_steps() {
    let start = VelocityPoint::new([0.3], [1.7], -0.4);
    let (mut oscillator, mut strong) = (Units::default(), Units::default());
    let weak = [-0.1, 0.0, 0.05].into_iter().flat_map(|gamma| [4.0, 20.0, 50.0].map(|h| (gamma, h)));
    // These motions decay far below the rounding of the start.
    let decayed = [-1.0, -0.4].into_iter().flat_map(|gamma| [90.0, 300.0, 1000.0].map(|h| (gamma, h)));
    for (gamma, h) in weak.chain(decayed) {
        let system = HarmonicOscillator { gamma };
        let end = system.solution(h, &start);
        let Ok(ld) = QuadraticExact::new(&system, h) else { unreachable!() };
        let (found, size) = (ld.motion(&start), end.q[0].hypot(end.v[0]));
        let error = (found.q - end.q).max_abs_or_nan().max_or_nan((found.v - end.v).max_abs_or_nan()) / size;
        oscillator.motion = oscillator.motion.max_or_nan(error / (EPS * (1.0 + h)));
        // The motion between the positions is the same, as long as the action is above the smallest number.
        if gamma * h >= -300.0 {
            let Ok(jet) = ld.jet(0.0, &DiscretePoint { q0: start.q, q1: end.q, z0: start.z }) else { unreachable!() };
            let off = (jet.d2 - end.v).max_abs_or_nan() / size;
            oscillator.momenta = oscillator.momenta.max_or_nan(off / (EPS * (1.0 + h)));
        }
    }
    for (gamma, h) in [-40.0, -1e3, -1e6].into_iter().flat_map(|gamma| [0.1, 0.8, 10.0].map(|h| (gamma, h))) {
        let system = FreeParticle { gamma };
        let start = VelocityPoint::new([0.0], [1.7], 0.0);
        let end = system.solution(h, &start);
        let Ok(ld) = QuadraticExact::new(&system, h) else { unreachable!("{gamma}, {h}") };
        let found = ld.motion(&start);
        strong.motion = strong.motion.max_or_nan(((found.q - end.q) / (end.q[0] * EPS)).max_abs_or_nan());
        // Decaying quantities are accurate to the rounding of the exponent, but below the smallest normal number not
        // relative to themselves.
        let decayed =
            [(found.v[0], end.v[0]), (found.z, end.z)].map(|(a, b)| (a - b).abs() / b.max_or_nan(f64::MIN_POSITIVE));
        strong.value = strong.value.max_or_nan(decayed[0].max_or_nan(decayed[1]) / (EPS * (1.0 + (gamma * h).abs())));
    }
    // In units of the rounding of the phase, and of the size of the remaining slow motion.
    oscillator.assert_below(8.0, 0.0, 8.0, "phase");
    strong.assert_below(16.0, 8.0, 0.0, "strong drag");
}

/// A Lagrangian with given coefficients and given claims.
struct Claimed([f64; 5], Structure);

impl Lagrangian<1> for Claimed {
    /// `a v^2/2 - q^2/2 + b q^4 + (c + d t) z + e z^2`.
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let [a, b, c, d, e] = self.0;
        v[0] * v[0] * (0.5 * a) - q[0] * q[0] * 0.5 + q[0].powi(4) * b + z * c + t * z * d + z * z * e
    }
    fn structure(&self) -> Structure {
        self.1
    }
}

#[test]
fn what_is_not_quadratic_is_refused() {
    let claims = Structure { autonomous: true, quadratic: true, ..Structure::default() };
    let build = |coefficients, claims| QuadraticExact::new(&Claimed(coefficients, claims), 0.1).map(|_| ());
    assert_eq!(build([1.0, 0.0, -0.1, 0.0, 0.0], claims), Ok(()));
    for coefficients in [[1.0, 1e-3, -0.1, 0.0, 0.0], [1.0, 0.0, -0.1, 0.0, 1e-3]] {
        let refused = build(coefficients, claims);
        assert!(matches!(refused, Err(InputError::FalseClaim { claim: "quadratic", .. })), "{refused:?}");
    }
    let refused = build([1.0, 0.0, -0.1, 1e-3, 0.0], claims);
    assert!(matches!(refused, Err(InputError::FalseClaim { claim: "autonomous", .. })), "{refused:?}");
    let unclaimed = Structure { autonomous: false, ..claims };
    let refused = build([1.0, 0.0, -0.1, 0.0, 0.0], unclaimed);
    assert_eq!(refused, Err(InputError::Unclaimed { claim: "autonomous" }));
    let refused = QuadraticExact::new(&Pendulum::default(), 0.1).map(|_| ());
    assert_eq!(refused, Err(InputError::Unclaimed { claim: "quadratic" }));
    let refused = build([0.0, 0.0, -0.1, 0.0, 0.0], claims);
    assert!(matches!(refused, Err(InputError::Geometry(GeometryError::Singular { .. }))), "{refused:?}");
    let refused = build([f64::NAN, 0.0, -0.1, 0.0, 0.0], claims);
    assert!(matches!(refused, Err(InputError::Geometry(GeometryError::Undefined { .. }))), "{refused:?}");
    let refused = build([1.0, 0.0, 1e9, 0.0, 0.0], claims);
    assert_eq!(refused, Err(InputError::FirstStep(StepError::NonFinite)));
}

#[test]
fn a_conjugate_point_and_a_bad_step_are_refused() {
    for (gamma, k) in [-1.999, -0.7, 0.0, 0.3].into_iter().flat_map(|g| (1..20).map(move |k| (g, f64::from(k)))) {
        let (system, half) = (HarmonicOscillator { gamma }, gamma * 0.5_f64);
        let h = k * std::f64::consts::PI / ((1.0 - half) * (1.0 + half)).sqrt();
        let refused = QuadraticExact::new(&system, h).map(|_| ());
        let conjugate = matches!(refused, Err(InputError::FirstStep(StepError::ConjugatePoint { .. })));
        // Below the smallest normal number divided by a rounding no conjugate point can be detected.
        let decayed = half * h < -671.0 && matches!(refused, Err(InputError::Hypothesis { .. }));
        assert!(conjugate || decayed, "gamma = {gamma}, k = {k}: {refused:?}");
        // A step beside it is accepted, unless the motion has decayed to zero: near critical drag the phase changes by
        // 1e3 times a rounding of gamma.
        assert!(
            half * h < -671.0 || QuadraticExact::new(&system, h * (1.0 - 1e-9)).is_ok(),
            "gamma = {gamma}, k = {k}"
        );
    }
    for h in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        let refused = QuadraticExact::new(&FreeParticle::default(), h).map(|_| ());
        assert!(matches!(refused, Err(InputError::Step { .. })), "{refused:?}");
    }
}

/// From complete decay to growth by 5e21: the action between two points is that of the motion in closed form, in units
/// of the rounding of the exponents. Where it is below the smallest number the value is refused, and so are NaN and
/// infinite arguments.
#[test]
fn every_drag_over_the_step() {
    let start = VelocityPoint::new([0.0, 0.0], [1.7, -0.4], 0.3);
    for reach in
        [-1e6, -1e5, -1e4, -1e3, -800.0, -746.0, -744.0, -700.0, -300.0, -50.0, -1.0, -1e-9, 1e-9, 1.0, 20.0, 50.0]
    {
        for h in [1e-3, 1.0, 100.0] {
            let gamma: f64 = reach / h;
            let system = UniformField { field: [0.6, -1.3], gamma };
            let ld = QuadraticExact::new(&system, h).unwrap();
            let (end, bare) = (system.solution(h, &start), system.solution(h, &VelocityPoint { z: 0.0, ..start }));
            let found = ld.motion(&start);
            let size = f64::EPSILON * (1.0 + reach.abs().min(800.0));
            assert!((found.q - end.q).amax() <= 8.0 * size * end.q.amax(), "{reach}, {h}: {found:?}, {end:?}");
            assert!((found.z - end.z).abs() <= 64.0 * size * end.z.abs(), "{reach}, {h}: {found:?}, {end:?}");
            let value = ld.value(0.0, &DiscretePoint { q0: start.q, q1: end.q, z0: start.z }).unwrap();
            let truth = bare.z + start.z * reach.exp_m1();
            assert!(
                (value - truth).abs() <= 64.0 * size * (truth.abs() + bare.z.abs()),
                "{reach}, {h}: {value} for {truth}"
            );
        }
        let ld = QuadraticExact::new(&FreeParticle { gamma: reach }, 1.0).unwrap();
        // The action from z0 = 0: v0^2/2 e^(gamma h) times an integral.
        match ld.value(0.0, &DiscretePoint::new([0.1], [0.4], 0.0)) {
            Ok(value) => assert!(reach > -740.0 && value > 0.0, "{reach}: {value}"),
            Err(cause) => {
                assert!(reach < -700.0 && matches!(cause, StepError::SigmaVanished { .. }), "{reach}: {cause}");
            }
        }
    }
    let ld = QuadraticExact::new(&HarmonicOscillator { gamma: -0.1 }, 0.5).unwrap();
    for bad in [f64::NAN, f64::INFINITY] {
        for x in [([bad], [0.1], 0.2), ([0.1], [bad], 0.2), ([0.1], [0.1], bad)] {
            let refused = ld.value(0.0, &DiscretePoint::new(x.0, x.1, x.2));
            assert_eq!(refused, Err(StepError::NonFinite), "{x:?}");
        }
        assert_eq!(ld.value(bad, &DiscretePoint::new([0.1], [0.2], 0.3)), Err(StepError::NonFinite));
    }
    // A decayed motion is not reported as a conjugate point.
    let refused = QuadraticExact::new(&HarmonicOscillator { gamma: -1.0 }, 1500.0).map(|_| ());
    assert!(matches!(refused, Err(InputError::Hypothesis { .. })), "{refused:?}");
}
