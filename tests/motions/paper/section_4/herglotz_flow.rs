//! The flow of the Herglotz vector field: against closed forms, against an integrator of another library, and at the
//! boundary of its domain.

use crate::common::lagrangians::LogarithmicWall;
use crate::common::oracle::motion;
use contact_examples::systems::{
    Chain, FreeParticle, HarmonicOscillator, LaneEmden, OneCoordinate, Pendulum, System, SystemVisitor, visit_catalogue,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, Dual, GeometryError, Lagrangian, Scalar, VelocityPoint,
    numbers::{MaxAbsOrNan, MaxOrNan},
};
use discrete_herglotz::InputError;
use exact_lagrangian::{ExactError, herglotz_flow};

/// The largest error of q and v relative to the amplitude, and of z relative to |z| and to the square of the amplitude.
fn error(found: &VelocityPoint<1>, truth: &VelocityPoint<1>) -> f64 {
    let size = truth.q.max_abs_or_nan().max_or_nan(truth.v.max_abs_or_nan());
    let state = (found.q - truth.q).max_abs_or_nan().max_or_nan((found.v - truth.v).max_abs_or_nan()) / size;
    state.max_or_nan((found.z - truth.z).abs() / truth.z.abs().max_or_nan(size * size))
}

/// Free particle and oscillator for `gamma h` from -50 to 5, without drag and with drag close to zero, and near the
/// critical drag; for the free particle the velocity also relative to itself.
#[test]
fn linear_motions() {
    let start = VelocityPoint::new([0.7], [1.3], 0.4);
    for gamma in [-50.0, -5.0, -2.0 - 1e-12, -2.0, -2.0 + 1e-12, -0.1, -1e-9, 0.0, 1e-9, 0.5, 5.0] {
        for t in [1e-8, 1e-3, 0.3, 1.0, 10.0, -0.5] {
            let reach: f64 = gamma * t;
            if !(-50.0..=5.0).contains(&reach) {
                continue;
            }
            let (free, spring) = (FreeParticle { gamma }, HarmonicOscillator { gamma });
            let of = |system: OneCoordinate| herglotz_flow(&system, 0.0, &start, t);
            let (a, b) = (of(free.into()), of(spring.into()));
            let (a, b) = (a.unwrap(), b.unwrap());
            let truth = free.solution(t, &start);
            let each = (a.end.v[0] - truth.v[0]).abs() / truth.v[0].abs();
            for (what, e) in [
                ("free", error(&a.end, &truth).max_or_nan(each)),
                ("spring", error(&b.end, &spring.solution(t, &start))),
                ("b", (a.b - reach).abs().max_or_nan((b.b - reach).abs()) / (1.0 + reach.abs())),
            ] {
                assert!(e <= 1e-13, "{what}, gamma = {gamma}, t = {t}: {e:e}");
            }
        }
    }
}

/// The regular solutions of the Lane-Emden equation, whose drag is singular in time, up to t = 10.
#[test]
fn lane_emden() {
    for n in [0, 1, 5] {
        let system = LaneEmden { n };
        for t in [0.2, 1.0, 5.0, 10.0] {
            let found = herglotz_flow(&OneCoordinate::from(system), 0.1, &system.initial(), t - 0.1);
            let truth = system.solution(t);
            let (Ok(found), Some(truth)) = (found, truth) else { unreachable!("known for n = {n}") };
            let e = error(&found.end, &truth);
            assert!(e <= 1e-13, "n = {n}, t = {t}: {e:e}");
            // sigma = (t0/t)^2.
            let sigma = (0.1 / t).powi(2);
            assert!((found.sigma() - sigma).abs() <= 1e-13 * sigma);
        }
    }
}

/// Every system from its natural start over two units of time, against dop853 with its smallest tolerance. The error is
/// relative to the state, and includes that of both integrators.
#[test]
fn against_dop853() {
    struct Visitor;
    impl SystemVisitor for Visitor {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let (t, x) = (system.initial_time(), system.initial());
            let oracle = ChartVector::from(motion(system, t, &x, 2.0));
            let found = herglotz_flow(system, t, &x, 2.0).map(|m| ChartVector::from(m.end));
            let apart = found.map_or(f64::NAN, |f| f.minus(oracle).max_abs_or_nan() / oracle.max_abs_or_nan());
            assert!(apart <= 2e-13, "{}: {apart:e}", system.name());
        }
    }
    visit_catalogue(&mut Visitor);
}

/// Forward and backward.
#[test]
fn reversible() {
    let (system, x) = (OneCoordinate::from(Pendulum::default()), VelocityPoint::new([1.0], [0.7], 0.1));
    let back = herglotz_flow(&system, 0.5, &x, 3.0).and_then(|m| herglotz_flow(&system, 3.5, &m.end, -3.0));
    let apart = back.map_or(f64::NAN, |b| ChartVector::from(b.end).minus(x.into()).max_abs_or_nan());
    assert!(apart < 1e-14, "{apart:e}");
}

/// `q'' = 6 q^2` blows up, and `L = ln q` ends at `q = 0`: the error has the time and the last state before it.
#[test]
fn outside_the_domain() {
    struct BlowUp;
    impl Lagrangian<1> for BlowUp {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
            v[0] * v[0] * 0.5 + q[0] * q[0] * q[0] * 2.0
        }
    }
    // q = 1/(1 - t)^2 solves q'' = 6 q^2.
    let blown = herglotz_flow(&BlowUp, 0.0, &VelocityPoint::new([1.0], [2.0], 0.0), 3.0);
    match blown {
        Err(ExactError::OutsideDomain { t, reached, .. }) => {
            assert!((t - 1.0).abs() < 1e-6 && t <= 1.0, "{t}");
            assert!(reached.check().is_ok() && reached.q[0] > 1e6);
        }
        other => unreachable!("{other:?}"),
    }
    let walled = herglotz_flow(&LogarithmicWall, 0.0, &VelocityPoint::new([1.0], [-1.0], 0.0), 3.0);
    let ok = matches!(walled, Err(ExactError::OutsideDomain { t, reached, .. }) if t > 0.5 && t < 3.0 && reached.q[0] >= 0.0);
    assert!(ok, "{walled:?}");
}

/// `W = 1 - v` vanishes during the motion.
#[test]
fn a_singular_mass() {
    struct Fading;
    impl Lagrangian<1> for Fading {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
            v[0] * v[0] * 0.5 - v[0] * v[0] * v[0] / 6.0 + q[0]
        }
    }
    // (1 - v) v' = 1: v = 1 - sqrt(1 - 2t).
    let ended = herglotz_flow(&Fading, 0.0, &VelocityPoint::new([0.0], [0.0], 0.0), 2.0);
    let ok = matches!(ended, Err(ExactError::OutsideDomain { t, .. }) if (t - 0.5).abs() < 1e-6);
    assert!(ok, "{ended:?}");
    let at_once = herglotz_flow(&Fading, 0.0, &VelocityPoint::new([0.0], [1.0], 0.0), 2.0);
    let ok = matches!(at_once, Err(ExactError::Input(InputError::Geometry(GeometryError::Singular { .. }))));
    assert!(ok, "{at_once:?}");
}

/// Numbers that are not finite are refused by name.
#[test]
fn not_finite() {
    let (system, x) = (OneCoordinate::from(Pendulum::default()), VelocityPoint::new([1.0], [0.7], 0.1));
    let of = |x: VelocityPoint<1>, t0: f64, d: f64| match herglotz_flow(&system, t0, &x, d) {
        Err(ExactError::Input(InputError::Geometry(GeometryError::NonFinite { what, .. }))) => what,
        _ => "accepted",
    };
    assert_eq!(of(x, f64::NAN, 1.0), "t0");
    assert_eq!(of(x, 0.0, f64::INFINITY), "the duration");
    assert_eq!(of(VelocityPoint { v: [f64::NAN].into(), ..x }, 0.0, 1.0), "v");
    assert_eq!(of(VelocityPoint { z: f64::INFINITY, ..x }, 0.0, 1.0), "z");
    assert!(herglotz_flow(&system, 0.0, &x, 0.0).is_ok_and(|m| m.end == x && m.b == 0.0));
}

/// Two oscillators, slow and fast.
struct SlowAndFast;
impl Lagrangian<2> for SlowAndFast {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        (v[0] * v[0] + v[1] * v[1] - q[0] * q[0] * 1e-2 - q[1] * q[1] * 1e2) * 0.5
    }
}

/// The values converge as they would alone, however large the differentials are.
#[test]
fn values_do_not_hide_behind_differentials() {
    for size in [1.0, 1e6, 1e12] {
        let still = Dual::<f64, SVector<f64, 1>>::constant;
        let mut x = VelocityPoint {
            q: SVector::from([still(0.0), still(0.0)]),
            v: SVector::from([still(1.0), still(1.0)]),
            z: still(0.0),
        };
        x.v[0].d[0] = size;
        let end = herglotz_flow(&SlowAndFast, 0.0, &x, 1.0).map_or(f64::NAN, |m| m.end.q[1].re);
        let truth = 0.1 * 10f64.sin();
        assert!((end - truth).abs() < 1e-13, "{size:e}: {end} for {truth}");
    }
}

/// A force that depends on time alone.
struct Driven;
impl Lagrangian<1> for Driven {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 + q[0] * t.sin()
    }
}

/// The sums over thousands of panels are rounded once, so that the end and the displacement are consistent.
#[test]
fn many_panels_round_once() {
    let start = VelocityPoint::new([1e6], [0.0], 0.0);
    let motion = herglotz_flow(&Driven, 0.0, &start, 20000.0).unwrap();
    let rounding = f64::EPSILON * motion.end.q[0];
    let lost = (motion.end.q[0] - start.q[0] - motion.displacement[0]).abs();
    assert!(motion.panels > 100 && lost <= rounding, "{} panels: {} units", motion.panels, lost / rounding);
}

/// The longest wave of a linear chain, a damped oscillator of frequency `2 sin(pi/(2 (N + 1)))`, in a stack of two
/// mebibytes.
#[test]
fn many_coordinates() {
    fn follow<const N: usize>(duration: f64) {
        let chain = Chain::<N> { beta: 0.0, gamma: -0.01, ..Chain::default() };
        let start = chain.initial();
        let omega = 2.0 * (0.5 * std::f64::consts::PI / (N as f64 + 1.0)).sin();
        let rate = (omega * omega - 0.25 * chain.gamma * chain.gamma).sqrt();
        let (s, c) = (rate * duration).sin_cos();
        let decay = (0.5 * chain.gamma * duration).exp();
        let (q, v) = (decay * (c - 0.5 * chain.gamma / rate * s), -decay * omega * omega / rate * s);
        let end = herglotz_flow(&chain, 0.0, &start, duration).unwrap().end;
        let off = (end.q - start.q * q).max_abs_or_nan().max_or_nan((end.v - start.q * v).max_abs_or_nan());
        // A few roundings of positions of size one.
        assert!(off <= 16.0 * f64::EPSILON, "N = {N}: {off:e}");
    }
    for run in [|| follow::<40>(5.0), || follow::<128>(0.2)] {
        let thread = std::thread::Builder::new().stack_size(2 << 20).spawn(run).unwrap();
        assert!(thread.join().is_ok());
    }
}
