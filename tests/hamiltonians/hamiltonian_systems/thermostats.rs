//! Thermostats: contact density dynamics, Nose and Hoover, Nose and Poincare.

use super::systems::{One, Two, end, run};
use contact_examples::systems::hamiltonian::{Bath, ContactThermostat, HeatedOscillator, Nose, NoseHoover};
use contact_geom::{ContactHamiltonian, PhasePoint};
use discrete_herglotz::Status;

/// `p^2/2 + 2 q^2`.
fn oscillator() -> HeatedOscillator {
    HeatedOscillator { stiffness: 4.0, ..HeatedOscillator::default() }
}

/// The example of Bravetti and Tapias, whose S is -z.
fn logistic() -> (ContactThermostat<HeatedOscillator>, PhasePoint<1>) {
    let start = PhasePoint::new([0.12578471404894542], [0.7479637648489665], -0.917435858684718);
    (ContactThermostat { energy: oscillator(), beta: 0.1, bath: Bath::Logistic { scale: 2.0 } }, start)
}

/// `ln rho + 2 ln sigma_d` is constant: the density times the volume, which a step multiplies by the square of sigma_d
/// exactly. The bound is the rounding of 5000 steps whose terms are below 20.
#[test]
fn the_density_times_the_volume_is_constant() {
    let (system, start) = logistic();
    let at_start = system.log_density(0.0, &start);
    let (mut largest, mut range): (f64, f64) = (0.0, 0.0);
    let outcome = run(One::from(system), (0.0, start), (8, 0.002), 10.0, |t, x, log_factor| {
        let change = (system.log_density(t, x) + 2.0 * log_factor - at_start).abs();
        largest = if change <= largest { largest } else { change };
        range = if log_factor.abs() <= range { range } else { log_factor.abs() };
    });
    assert_eq!(outcome.status, Status::Completed);
    assert!(largest < 1e-12, "{largest:e}");
    assert!(range > 1.0, "ln sigma reaches {range} only");
}

/// The averages in time of `p^2` and `4 q^2` are the temperature 10, within four standard errors from the scatter of blocks
/// that are longer than the correlation. Along the run h varies by five orders of magnitude, so that equal steps are those
/// in the time of the energy, with the weight g.
#[test]
fn averages_are_those_of_the_canonical_ensemble() {
    const BLOCKS: usize = 50;
    const LENGTH: f64 = 30.0;
    let (system, start) = logistic();
    let moving = system.in_time_of_energy::<1>();
    let start = moving.start(0.0, &start);
    let mut sums = [[0.0; 3]; BLOCKS];
    let (mut conserved, mut largest): (Option<f64>, f64) = (None, 0.0);
    let outcome = run(Two::from(moving), (0.0, start), (8, 0.02), LENGTH * BLOCKS as f64, |tau, x, log_factor| {
        let (q, p) = (x.q[0], x.p[0]);
        let of_h = PhasePoint::new([q], [p], x.z);
        let weight = moving.rate.value(tau, &of_h.q, &of_h.p, of_h.z);
        let block = ((tau / LENGTH) as usize).min(BLOCKS - 1);
        for (sum, of) in sums[block].iter_mut().zip([p * p, 4.0 * q * q, 1.0]) {
            *sum += weight * of;
        }
        let volume = system.log_density(tau, &of_h) + 2.0 * log_factor;
        let change = (volume - *conserved.get_or_insert(volume)).abs();
        largest = if change <= largest { largest } else { change };
    });
    assert_eq!(outcome.status, Status::Completed, "{outcome:?}");
    // The error of 75000 steps, in some of which z passes several scales of the bath.
    assert!(largest < 1e-6, "{largest:e}");
    for i in 0..2 {
        // The average is a quotient of means; its error is that of the residuals of the blocks.
        let total: f64 = sums.iter().map(|sum| sum[2]).sum();
        let mean = sums.iter().map(|sum| sum[i]).sum::<f64>() / total;
        let residuals: f64 = sums.iter().map(|sum| (sum[i] - mean * sum[2]).powi(2)).sum();
        let error = residuals.sqrt() / total;
        assert!(error < 0.5, "average {i}: {mean} +- {error}");
        assert!((mean - 10.0).abs() < 4.0 * error, "average {i}: {mean} +- {error}");
    }
}

/// The thermostat of Nose in the physical time, with `(q, p/s, p_s)`, moves as that of Nose and Hoover, with `(q, p, z)`,
/// and each conserves its energy: two Hamiltonians that differ in everything but their motion.
#[test]
fn nose_hoover_and_nose_poincare_are_one_motion() {
    let (temperature, mass, friction) = (2.0, 1.5, 0.2);
    let x = PhasePoint::new([1.2], [0.4], friction * mass);
    let hoover = NoseHoover::<_, 1> { energy: oscillator(), temperature, mass };
    let nose = Nose::<_, 1> { energy: oscillator(), temperature, mass, degrees: 1.0 };
    let start = nose.start(&x, friction * mass);
    let (method, t) = ((8, 0.05), 10.0);
    let energy = |x: &PhasePoint<1>| 0.5 * x.p[0] * x.p[0] + 2.0 * x.q[0] * x.q[0] + x.z * x.z / (2.0 * mass);
    let mut largest: f64 = 0.0;
    let outcome = run(Two::from(hoover), (0.0, hoover.start(&x)), method, t, |_, y, log_factor| {
        let state = PhasePoint::new([y.q[0]], [y.p[0]], y.z);
        let change = (energy(&state) - temperature * log_factor - energy(&x)).abs();
        largest = if change <= largest { largest } else { change };
    });
    let b = end(Two::from(nose.poincare(&start)), (0.0, start), method, t);
    let a = outcome.state();
    let off = [a.q[0] - b.q[0], a.p[0] - b.p[0] / b.q[1], a.z - b.p[1]];
    // The bounds are a thousand roundings of numbers below 10.
    assert!(off.iter().all(|e| e.abs() < 1e-12), "{off:?}");
    assert!(largest < 1e-12, "{largest:e}");
}
