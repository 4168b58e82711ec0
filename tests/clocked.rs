//! Contact Gauss collocation in the time of a clock.

#![allow(clippy::unwrap_used)]

use contact_geom::nalgebra::SVector;
use contact_geom::systems::{Kepler, PerturbedKepler, Radial, System};
use contact_geom::{Clock, Larger, PhasePoint, Scalar, VelocityPoint, legendre};
use discrete_herglotz::{ClockedStepper, Gauss, InputError, StepError, Stepper};

type Planar = Kepler<2>;

/// The pericentre of an orbit of semi-major axis 1.
fn pericentre(e: f64) -> VelocityPoint<2> {
    VelocityPoint::new([1.0 - e, 0.0], [0.0, ((1.0 + e) / (1.0 - e)).sqrt()], 0.0)
}

fn clocked<'a, C: Clock<2>>(
    gauss: &'a Gauss<Planar>,
    kepler: &Planar,
    clock: C,
    e: f64,
) -> ClockedStepper<'a, Planar, C, 2> {
    let start = pericentre(e);
    gauss.clocked_stepper(clock, 0.0, legendre(kepler, 0.0, &start), start.v).unwrap()
}

fn distance(a: &PhasePoint<2>, b: &PhasePoint<2>) -> f64 {
    (a.q - b.q).norm().larger((a.p - b.p).norm()).larger((a.z - b.z).abs())
}

fn angular_momentum(x: &PhasePoint<2>) -> f64 {
    x.q[0] * x.p[1] - x.q[1] * x.p[0]
}

fn energy(kepler: &Planar, x: &PhasePoint<2>) -> f64 {
    kepler.hamiltonian(0.0, x).unwrap()
}

/// The clock of a constant rate, and of any sign.
struct Steady(f64);

impl Clock<2> for Steady {
    fn rate<T: Scalar>(&self, _q: &SVector<T, 2>) -> T {
        T::from(self.0)
    }
}

#[test]
fn a_steady_clock_is_the_physical_time() {
    let kepler = Planar { gamma: -0.05, mu: 1.0 };
    let start = pericentre(0.5);
    let gauss = Gauss::new(kepler, 8, 0.1).unwrap();
    let mut plain = gauss.stepper(0.0, legendre(&kepler, 0.0, &start), start.v).unwrap();
    plain.advance(100).unwrap();
    for rate in [1.0, 2.0] {
        let gauss = Gauss::new(kepler, 8, 0.1 / rate).unwrap();
        let mut run = clocked(&gauss, &kepler, Steady(rate), 0.5);
        run.advance(100).unwrap();
        assert!((run.time() - plain.time()).abs() < 1e-14);
        let off = distance(&run.state(), &plain.state());
        assert!(off < 2e-13, "rate {rate}: {off:e}");
        assert!((run.sigma() - plain.sigma()).abs() < 1e-15);
    }
}

#[test]
fn order_two_s_at_a_physical_time() {
    let kepler = Planar { gamma: -0.05, mu: 1.0 };
    let at = |s: usize, h: f64, t: f64| {
        let gauss = Gauss::new(kepler, s, h).unwrap();
        let mut run = clocked(&gauss, &kepler, kepler.clock(), 0.5);
        run.advance_to(t).unwrap();
        assert!((run.time() - t).abs() <= 1e-15 * t, "{} for {t}", run.time());
        run.state()
    };
    let t = 7.0;
    // From the plain method, so that a clock's error cannot hide in both.
    let start = pericentre(0.5);
    let gauss = Gauss::new(kepler, 12, t / 100.0).unwrap();
    let mut reference = gauss.stepper(0.0, legendre(&kepler, 0.0, &start), start.v).unwrap();
    reference.advance(100).unwrap();
    for (s, h) in [(2, 0.05), (3, 0.1), (4, 0.25)] {
        let error = |h: f64| distance(&at(s, h, t), &reference.state());
        let (coarse, fine) = (error(h), error(h / 2.0));
        let order = (coarse / fine).log2();
        assert!((order - 2.0 * s as f64).abs() < 0.15, "s = {s}: {order} from {coarse:e} and {fine:e}");
    }
}

#[test]
fn momenta_contract_by_sigma() {
    let kepler = Planar { gamma: -0.01, mu: 1.0 };
    let gauss = Gauss::new(kepler, 4, 0.2).unwrap();
    let mut run = clocked(&gauss, &kepler, kepler.clock(), 0.5);
    let (start, p_t) = (run.state(), run.time_momentum());
    let (mut contracted, mut defect) = (1.0, 0.0_f64);
    for _ in 0..1000 {
        run.advance(1).unwrap();
        contracted *= run.sigma();
        // K / g, which is 0 for the motion.
        defect = defect.larger((energy(&kepler, &run.state()) + run.time_momentum()).abs() / run.time_momentum().abs());
    }
    let off = angular_momentum(&run.state()) / (contracted * angular_momentum(&start)) - 1.0;
    assert!(off.abs() < 1e-13, "{off:e}");
    assert!((run.time_momentum() / (contracted * p_t) - 1.0).abs() < 1e-13);
    assert!(contracted < 0.7);
    assert!(defect < 1e-5 && defect > 1e-13, "{defect:e}");
}

#[test]
fn eccentric_orbits_cost_less() {
    let kepler = Planar { gamma: -1e-4, mu: 1.0 };
    let (t, start) = (20.0, pericentre(0.9));
    let plain = |s: usize, n: usize| {
        let gauss = Gauss::new(kepler, s, t / n as f64).unwrap();
        let mut run = gauss.stepper(0.0, legendre(&kepler, 0.0, &start), start.v).unwrap();
        run.advance(n).unwrap();
        (run.state(), run.evaluations())
    };
    let (reference, _) = plain(12, 8000);
    let (fixed, most) = plain(8, 800);
    let gauss = Gauss::new(kepler, 8, 0.5).unwrap();
    let mut run = clocked(&gauss, &kepler, kepler.clock(), 0.9);
    run.advance_to(t).unwrap();
    let (error, of_fixed) = (distance(&run.state(), &reference), distance(&fixed, &reference));
    println!("{error:e} with {}, {of_fixed:e} with {most}", run.evaluations());
    assert!(run.evaluations() < most, "{} and {most}", run.evaluations());
    assert!(error < 1e-3 * of_fixed, "{error:e} and {of_fixed:e}");
}

#[test]
fn bad_input_is_refused() {
    let kepler = Planar::default();
    let start = pericentre(0.5);
    let state = legendre(&kepler, 0.0, &start);
    let gauss = Gauss::new(kepler, 3, 0.1).unwrap();
    for bad in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        let refused = gauss.clocked_stepper(Steady(bad), 0.0, state, start.v).err();
        assert!(matches!(refused, Some(InputError::Clock { .. })), "{bad}: {refused:?}");
    }
    let driven = Gauss::new(PerturbedKepler::default(), 3, 0.1).unwrap();
    let refused = driven.clocked_stepper(Radial { exponent: 1.0 }, 0.0, state, start.v).err();
    assert_eq!(refused, Some(InputError::Unclaimed { claim: "autonomous" }));
    let mut run = gauss.clocked_stepper(kepler.clock(), 0.0, state, start.v).unwrap();
    assert_eq!(run.advance_to(f64::NAN).map_err(|halt| halt.cause), Err(StepError::NonFinite));
    assert_eq!((run.advance_to(-1.0), run.time()), (Ok(()), 0.0));
}

#[test]
fn a_clock_that_is_not_defined_ends_the_run() {
    /// Not defined beyond `x = 0`.
    struct Ending;
    impl Clock<2> for Ending {
        fn rate<T: Scalar>(&self, q: &SVector<T, 2>) -> T {
            q[0].sqrt() + 1.0
        }
    }
    let kepler = Planar::default();
    let gauss = Gauss::new(kepler, 3, 0.1).unwrap();
    let mut run = clocked(&gauss, &kepler, Ending, 0.5);
    let halt = run.advance_to(10.0).unwrap_err();
    assert_eq!(halt.cause, StepError::NonFinite);
    assert!(run.state().q[0] > 0.0 && run.time() < 10.0 && halt.taken > 3);
}

#[test]
fn powers_of_the_distance() {
    let q = SVector::from([0.3, -0.4]);
    for exponent in [-1.0, 0.0, 0.7, 1.0, 1.5, 2.0] {
        let rate: f64 = Radial { exponent }.rate(&q);
        assert!((rate / 0.5_f64.powf(exponent) - 1.0).abs() < 1e-15, "{exponent}");
    }
}
