//! Simple thermodynamic systems: motions of the evolution field.

use super::systems::{One, Two, end, run, slope};
use contact_examples::systems::hamiltonian::{Gas, HeatedOscillator, Piston};
use contact_geom::{AtEnergy, ContactHamiltonian, InTransformedTime, PhasePoint};
use discrete_herglotz::{Event, Events, GaussCollocation, Problem, Status, Steps, Until};

/// The position, the momentum and the heat of the damped oscillator that starts at rest at 1.
fn damped(system: &HeatedOscillator, t: f64) -> (f64, f64, f64) {
    let HeatedOscillator { mass, stiffness, rate, .. } = *system;
    let frequency = (stiffness / mass - rate * rate / 4.0).sqrt();
    let (sin, cos) = (frequency * t).sin_cos();
    let decay = (-rate * t / 2.0).exp();
    let q = decay * (cos + rate / (2.0 * frequency) * sin);
    let p = -decay * stiffness / frequency * sin;
    (q, p, (0.5 * stiffness * (1.0 - q * q) - 0.5 * p * p / mass) / rate)
}

#[test]
fn the_heat_of_a_damped_oscillator() {
    let system = HeatedOscillator { mass: 0.8, stiffness: 2.0, rate: 0.3, heat_capacity: 2.0, temperature: 0.5 };
    let start = system.initial();
    let hamiltonian = AtEnergy::of(system, &start);
    let mut entropy = 0.0;
    run(One::from(hamiltonian), (0.0, start), (8, 0.1), 20.0, |t, x, log_factor| {
        let (q, p, z) = damped(&system, t);
        // A hundred roundings of sums of 200 steps.
        for (found, expected) in [(x.q[0], q), (x.p[0], p), (x.z, z), (log_factor, -0.3 * t)] {
            assert!((found - expected).abs() < 1e-13 * (1.0 + expected.abs()), "{found} {expected} at {t}");
        }
        let now = system.entropy(x.z);
        assert!(now >= entropy, "the entropy decreases to {now}");
        entropy = now;
    });
}

/// The same motion in a time whose rate is the energy, a function of (q, p, z): the time is a coordinate.
#[test]
fn a_time_transformation_that_depends_on_momentum_and_action() {
    let system = HeatedOscillator { mass: 0.8, stiffness: 2.0, rate: 0.3, heat_capacity: 2.0, temperature: 0.5 };
    let start = system.initial();
    let hamiltonian = AtEnergy::of(system, &start);
    let rate = HeatedOscillator { mass: 0.5, stiffness: 1.0, rate: 0.7, ..system };
    let moving = InTransformedTime::<_, _, 1> { hamiltonian, rate };
    let mut reached = 0.0;
    run(Two::from(moving), (0.0, moving.start(0.0, &start)), (8, 0.02), 8.0, |_, x, log_factor| {
        let t = x.q[1];
        let (q, p, z) = damped(&system, t);
        for (found, expected) in [(x.q[0], q), (x.p[0], p), (x.z, z), (log_factor, -0.3 * t)] {
            assert!((found - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{found} {expected} at {t}");
        }
        reached = t;
    });
    assert!(reached > 5.0, "{reached}");
}

fn van_der_waals() -> Piston {
    Piston { gas: Gas::van_der_waals(0.3, 0.1), friction: 0.4, ..Piston::default() }
}

/// The largest error of the energy of a piston, up to a time, and that at its end.
fn energy_error(system: Piston, method: (usize, f64), t: f64) -> (f64, f64) {
    let start = system.initial();
    let hamiltonian = AtEnergy::of(system, &start);
    let (mut largest, mut last) = (0.0, 0.0);
    let outcome = run(One::from(hamiltonian), (0.0, start), method, t, |t, x, _| {
        last = hamiltonian.value(t, &x.q, &x.p, x.z).abs();
        largest = if last <= largest { largest } else { last };
    });
    assert_eq!(outcome.status, Status::Completed);
    (largest, last)
}

/// The first law: the error of the energy has the order 2 s of the method, and it does not grow, since the level of the
/// energy attracts at the rate of the temperature.
#[test]
fn the_energy_of_a_piston_has_the_order_of_the_method_and_no_drift() {
    for (stages, counts) in [(1, [20.0, 40.0, 80.0]), (2, [10.0, 20.0, 40.0]), (3, [5.0, 7.0, 10.0])] {
        let points = counts.map(|n| (1.0 / n, energy_error(van_der_waals(), (stages, 1.0 / n), 6.0).0));
        let order = slope(&points);
        assert!((order - 2.0 * stages as f64).abs() < 0.15, "{stages} stages: {order}, {points:?}");
    }
    let (largest, last) = energy_error(van_der_waals(), (2, 0.1), 200.0);
    assert!(largest < 1.01 * energy_error(van_der_waals(), (2, 0.1), 6.0).0, "{largest:e}");
    assert!(last < 1e-14, "{last:e}");
}

/// The second law in each step, and the equilibrium of an ideal gas: `P A = F` and the energy `E0 = F q (1 + c)`.
#[test]
fn a_piston_comes_to_rest_at_the_equilibrium_of_its_energy() {
    for system in [Piston::default(), van_der_waals()] {
        let system = Piston { friction: 2.0, ..system };
        let start = system.initial();
        let hamiltonian = AtEnergy::of(system, &start);
        let mut entropy = 0.0;
        let outcome = run(One::from(hamiltonian), (0.0, start), (8, 0.1), 60.0, |_, x, _| {
            // At a turning point the entropy is stationary.
            assert!(system.entropy(x) >= entropy - 1e-15, "the entropy decreases to {}", system.entropy(x));
            entropy = system.entropy(x);
        });
        let (x, gas) = (outcome.state().fixed::<1>(), system.gas);
        assert!(x.p[0].abs() < 1e-10, "{x:?}");
        let pressure = gas.pressure(x.q[0] * system.area, system.temperature(&x));
        assert!((pressure * system.area - system.load).abs() < 1e-10, "{pressure}");
        if gas == Gas::ideal() {
            assert!((x.q[0] - hamiltonian.energy / (2.5 * system.load)).abs() < 1e-10, "{x:?}");
        }
        assert!(entropy > 0.0);
    }
}

/// At constant entropy the piston oscillates; small oscillations have the frequency of an isentropic gas,
/// `w^2 = (1 + 1/c) P A^2/(V m)`.
#[test]
fn small_oscillations_are_isentropic() {
    let system = Piston { friction: 0.0, mass: 1.3, area: 0.7, ..Piston::default() };
    let pressure = system.gas.pressure(0.7, system.temperature(&system.initial()));
    let system = Piston { load: pressure * 0.7, ..system };
    let frequency = (5.0 / 3.0 * pressure * 0.49 / (0.7 * 1.3)).sqrt();
    let start = PhasePoint::new([1.0 + 1e-4], [0.0], 0.0);
    let of = contact_geom::OfHamiltonian(One::from(AtEnergy::of(system, &start)));
    let mut turns = Events::new([Event::new(|_, x| x.p[0]).falling()]);
    let problem = Problem::of_hamiltonian(&of, 0.0, start).unwrap();
    let run = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.1)).observe(&mut turns);
    run.run(Until::Time(20.0)).unwrap();
    let [first, .., last] = &turns.crossings[..] else { panic!("{:?}", turns.crossings) };
    let period = (last.t - first.t) / (turns.crossings.len() - 1) as f64;
    // The period depends on the amplitude by its square, 1e-8.
    assert!((period * frequency / std::f64::consts::TAU - 1.0).abs() < 1e-7, "{period} {frequency}");
    let there = end(One::from(AtEnergy::of(system, &start)), (0.0, start), (8, 0.1), 20.0);
    assert!((system.entropy(&there)).abs() == 0.0);
}
