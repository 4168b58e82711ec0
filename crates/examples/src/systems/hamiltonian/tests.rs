//! The equations in the documentation of each system, against the field of its Hamiltonian.

use super::*;
use crate::systems::{Lienard, VanDerPol};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    AtEnergy, ContactHamiltonian, HamiltonianDerivatives, InTransformedTime, Lifted, PhasePoint, VectorField,
};

/// Points of Weyl's sequence in a box about a centre.
fn points<const N: usize>(centre: PhasePoint<N>, size: f64) -> impl Iterator<Item = (f64, PhasePoint<N>)> {
    (1..=24).map(move |k| {
        let u = |i: usize| size * ((f64::from(k) * (0.5 + i as f64).sqrt()).fract() - 0.5);
        let q = SVector::from_fn(|i, _| centre.q[i] + u(i));
        let p = SVector::from_fn(|i, _| centre.p[i] + u(N + i));
        (2.0 + u(2 * N + 1), PhasePoint { q, p, z: centre.z + u(2 * N) })
    })
}

/// Two numbers agree to some hundred units of round-off of their size, or of 1.
#[track_caller]
fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 256.0 * f64::EPSILON * (1.0 + expected.abs()), "{found} for {expected}");
}

#[track_caller]
fn declared<H: ContactHamiltonian<N>, const N: usize>(hamiltonian: H, centre: PhasePoint<N>) {
    for (t, x) in points(centre, 0.5) {
        assert!(hamiltonian.value(t, &x.q, &x.p, x.z).is_finite(), "{x:?}");
        let defect = hamiltonian.structure().defect(&hamiltonian, t, &x);
        assert!(defect.is_none(), "{defect:?} at {x:?}");
    }
}

fn oscillator() -> HeatedOscillator {
    HeatedOscillator { stiffness: 4.0, ..HeatedOscillator::default() }
}

fn one() -> PhasePoint<1> {
    PhasePoint::new([1.0], [0.5], 0.3)
}

fn two() -> PhasePoint<2> {
    PhasePoint::new([0.4, 1.0], [0.6, -0.8], 0.3)
}

#[test]
fn declared_structures_hold() {
    let (quartic, gas) = (Quartic::default(), Gas::van_der_waals(0.3, 0.1));
    declared(oscillator(), one());
    declared(HeatedOscillator { rate: 0.0, ..oscillator() }, one());
    for friction in [0.0, 0.2] {
        declared(Piston { friction, gas, ..Piston::default() }, one());
        declared(AtEnergy::of(Piston { friction, ..Piston::default() }, &one()), one());
    }
    declared(SpinOrbit::default(), one());
    declared(SpinOrbit { drag: 0.1, ..SpinOrbit::rigid(0.2, 0.0) }, one());
    declared(SpinOrbit::rigid(0.2, 0.3), one());
    declared(Lienard { amplitude: 0.3, omega: 1.0, ..Lienard::default() }, one());
    declared(VanDerPol::default(), one());
    declared(Lifted(VanDerPol::default()), two());
    for coordinates in [ThermalCoordinates::Entropies, ThermalCoordinates::Energies] {
        let containers = Containers { coordinates, friction: 0.2, gases: [gas, Gas::ideal()], ..Containers::default() };
        declared(Lifted(containers), containers.initial());
    }
    for medium in media() {
        declared(Ray { medium }, PhasePoint::new([0.2, 0.7], [0.6, 0.8], 0.0));
    }
    for kinetic in [Kinetic::Quadratic, Kinetic::Relativistic { speed: 3.0, mass: 0.7 }] {
        declared(Bregman { objective: quartic, kinetic, power: 3, scale: 0.5 }, two());
    }
    declared(RelativisticDescent { objective: quartic, mass: 0.5, speed: 2.0, gamma: -0.3 }, two());
    for bath in [Bath::Logistic { scale: 2.0 }, Bath::Gaussian { variance: 0.7 }] {
        let thermostat = ContactThermostat { energy: oscillator(), beta: 0.1, bath };
        declared(thermostat, one());
        declared(thermostat.in_time_of_energy::<1>(), two());
    }
    let nose = Nose::<_, 1> { energy: oscillator(), temperature: 2.0, mass: 0.5, degrees: 1.0 };
    declared(nose, two());
    declared(nose.poincare(&two()), two());
    declared(NoseHoover::<_, 1> { energy: oscillator(), temperature: 2.0, mass: 0.5 }, two());
    declared(InTransformedTime::<_, _, 1> { hamiltonian: SpinOrbit::default(), rate: oscillator() }, two());
}

fn media() -> [Medium<2>; 4] {
    [
        Medium::LinearSquare { constant: 1.2, gradient: [0.3, -0.2].into() },
        Medium::LinearSpeed { slope: 0.7 },
        Medium::Graded { axis: 1.5, alpha: 0.6 },
        Medium::FishEye { centre: 2.0, radius: 1.3 },
    ]
}

#[test]
fn the_heated_oscillator_is_damped_linearly() {
    let system = HeatedOscillator { mass: 2.0, stiffness: 3.0, rate: 0.4, heat_capacity: 1.5, temperature: 0.7 };
    for (t, x) in points(one(), 1.0) {
        let field = AtEnergy::of(system, &x).contact_field(t, &x);
        close(field.x[0], x.p[0] / 2.0);
        close(field.y[0], -3.0 * x.q[0] - 0.4 * x.p[0]);
        close(field.z, x.p[0] * x.p[0] / 2.0);
        // T S' is the power of the friction.
        let slope = (system.entropy(x.z + 1e-5) - system.entropy(x.z - 1e-5)) / 2e-5 * field.z;
        let power = 0.4 * x.p[0] * x.p[0] / 2.0;
        assert!((system.temperature_at(x.z) * slope - power).abs() < 1e-9);
    }
}

#[test]
fn the_piston_moves_by_the_pressure_and_heats_the_gas() {
    let gas = Gas::van_der_waals(0.3, 0.1);
    let system = Piston { gas, mass: 2.0, area: 1.5, load: 0.8, friction: 0.2 };
    for (t, x) in points(one(), 0.5) {
        let field = AtEnergy::of(system, &x).contact_field(t, &x);
        let (volume, temperature) = (1.5 * x.q[0], system.temperature(&x));
        close(field.x[0], x.p[0] / 2.0);
        close(field.y[0], 1.5 * gas.pressure(volume, temperature) - 0.8 - 0.2 * temperature * x.p[0]);
        close(0.2 * field.z, 0.2 * x.p[0] * x.p[0] / 2.0);
        close(gas.entropy(volume, temperature), system.entropy(&x));
        close(gas.temperature_of_energy(volume, gas.energy(volume, system.entropy(&x))), temperature);
        // The equation of state of van der Waals.
        let state = (gas.pressure(volume, temperature) + 0.3 / (volume * volume)) * (volume - 0.1);
        close(state, temperature);
    }
}

#[test]
fn the_containers_obey_both_laws_in_both_coordinates() {
    let gases = [Gas::van_der_waals(0.3, 0.1), Gas { heat_capacity: 2.5, ..Gas::ideal() }];
    let of =
        |coordinates| Containers { gases, mass: 0.7, area: 1.2, friction: 0.3, coordinates, ..Containers::default() };
    let entropies = of(ThermalCoordinates::Entropies);
    let energies = of(ThermalCoordinates::Energies);
    let start = PhasePoint::new([0.9, 0.5, 0.2, -0.1], [0.0; 4], 0.0);
    for (_, x) in points(start, 0.5).map(|(t, x)| (t, x.q)) {
        let [e1, e2] = entropies.energies(&x);
        let y = SVector::from([x[0], x[1], e1, e2]);
        let (rates, of_energies) = (entropies.at(0.0, &x), energies.at(0.0, &y));
        close(energies.entropies(&y)[0], x[2]);
        close(energies.entropies(&y)[1], x[3]);
        assert_eq!((rates[0], y[1]), (of_energies[0], x[1]));
        close(rates[1], of_energies[1]);
        // The first law: of the energies exactly, of the entropies by the chain rule, with E_S = T and E_V = -P.
        close(x[1] / 0.7 * of_energies[1] + of_energies[2] + of_energies[3], 0.0);
        let temperatures = entropies.temperatures(&x);
        let volumes = [1.2 * x[0], 1.2 * (2.0 - x[0])];
        for i in 0..2 {
            let pressure = gases[i].pressure(volumes[i], temperatures[i]);
            let work = if i == 0 { -1.2 * pressure * rates[0] } else { 1.2 * pressure * rates[0] };
            close(temperatures[i] * rates[2 + i] + work, of_energies[2 + i]);
        }
        // The second law.
        assert!(rates[2] + rates[3] > 0.0);
    }
}

#[test]
fn rays_have_the_speed_of_light_and_bend_to_the_larger_index() {
    for medium in media() {
        let ray = Ray { medium };
        for (t, x) in points(PhasePoint::new([0.2, 0.7], [0.6, 0.8], 0.0), 0.5) {
            let start = ray.start(x.q, x.p);
            let (n, small) = (medium.index(&start.q), 1e-5);
            let field = ray.contact_field(t, &start);
            close(ray.value(t, &start.q, &start.p, 0.0), 1.0);
            close(field.x.norm(), 1.0 / n);
            close(field.z, 0.0);
            for i in 0..2 {
                let along = SVector::from_fn(|j, _| if i == j { small } else { 0.0 });
                let slope = (medium.index(&(start.q + along)) - medium.index(&(start.q - along))) / (2.0 * small);
                assert!((field.y[i] - slope / n).abs() < 1e-8, "{medium:?}");
            }
        }
    }
}

#[test]
fn bregman_dynamics_is_a_damped_motion_of_second_order() {
    let system = Bregman { objective: Quartic::default(), kinetic: Kinetic::Quadratic, power: 3, scale: 0.5 };
    for (t, x) in points(two(), 0.5) {
        let field = system.contact_field(t, &x);
        let k = 3.0;
        // `q'' = (k/t) (p' - q') - (k/t^2) (p - q)`.
        let acceleration = (field.y - field.x) * (k / t) - (x.p - x.q) * (k / (t * t));
        let (u, s) = (x.q - SVector::from([1.0, 1.0]), contact_geom::nalgebra::Matrix2::new(1.0, 0.9, 0.9, 1.0));
        let gradient = s * u * (4.0 * u.dot(&(s * u)));
        for i in 0..2 {
            close(acceleration[i], -(k + 1.0) / t * field.x[i] - 0.5 * k * k * t * gradient[i]);
        }
        assert_eq!(x.p, system.start(x.p).q);
    }
    // The conjugate of the relativistic kinetic energy: grad K(grad h(y)) = y, and h(y) + K(p) = p . y there.
    let kinetic = Kinetic::Relativistic { speed: 3.0, mass: 0.7 };
    let y = SVector::from([1.2, -0.5]);
    let p = kinetic.momentum(&y);
    let of = Bregman { objective: Quartic::default(), kinetic, power: 1, scale: 0.0 };
    let still = of.contact_field(1.0, &PhasePoint { q: y, p, z: 0.0 });
    assert!(still.x.norm() < 1e-14, "{still:?}");
    close(kinetic.distance(&y) + kinetic.energy(&p), p.dot(&y));
}

#[test]
fn the_torque_on_a_satellite_is_that_of_the_orbit() {
    // The harmonics that are left out are of the order 8 in the eccentricity, with factors of up to 200.
    let e: f64 = 0.03;
    let system = SpinOrbit { drag: 0.02, torque: 0.01, amplitude: 0.1, omega: 1.7, ..SpinOrbit::rigid(e, 0.4) };
    for (t, x) in points(one(), 3.0) {
        let mut anomaly = t;
        for _ in 0..50 {
            anomaly = t + e * anomaly.sin();
        }
        let (sin, cos) = anomaly.sin_cos();
        let true_anomaly = ((1.0 - e * e).sqrt() * sin).atan2(cos - e);
        let torque = 0.4 * (2.0 * (x.q[0] - true_anomaly)).sin() / (1.0 - e * cos).powi(3);
        let inertia = 1.0 + 0.1 * (1.7 * t).cos();
        let rate = 0.02 - 0.17 * (1.7 * t).sin() / inertia;
        let field = system.contact_field(t, &x);
        assert!((field.y[0] + torque / inertia - 0.01 + rate * x.p[0]).abs() < 1e-9);
        assert_eq!(field.x[0], x.p[0]);
    }
    // The series of the paper, up to the order 8 for even and 7 for odd harmonics.
    close(system.coefficient(2), 1.0 - 2.5 * e * e + 13.0 / 16.0 * e.powi(4) - 35.0 / 288.0 * e.powi(6));
    assert!((system.coefficient(3) - 3.5 * e + 123.0 / 16.0 * e.powi(3) - 489.0 / 128.0 * e.powi(5)).abs() < 1e-10);
    assert!((system.coefficient(1) + 0.5 * e - e.powi(3) / 16.0 + 5.0 / 384.0 * e.powi(5)).abs() < 1e-12);
    close(system.coefficient(0), 0.0);
    assert_eq!(system.coefficient(12), 0.0);
}

/// The equations of Bravetti and Tapias, with `S = -z`: `p' = -h_q + p h_S`, `S' = h - p h_p`, and `h^-(n+1)` is the density.
#[test]
fn contact_density_dynamics_has_the_density() {
    let system = ContactThermostat { energy: oscillator(), beta: 0.1, bath: Bath::Logistic { scale: 2.0 } };
    for (t, x) in points(one(), 2.0) {
        let (q, p, z) = (x.q[0], x.p[0], x.z);
        let density =
            (-0.1 * (p * p / 2.0 + 2.0 * q * q)).exp() * (z / 2.0).exp() / (2.0 * (1.0 + (z / 2.0).exp()).powi(2));
        let h = density.powf(-0.5);
        close(system.value(t, &x.q, &x.p, z), h);
        close(system.log_density(t, &x), density.ln());
        let field = system.contact_field(t, &x);
        close(field.x[0], h * 0.05 * p);
        close(field.y[0], -h * (0.05 * 4.0 * q + p * 0.25 * (z / 4.0).tanh()));
        close(field.z, h * (0.05 * p * p - 1.0));
    }
}

#[test]
fn nose_hoover_is_contact_density_dynamics_in_a_transformed_time() {
    let (temperature, mass) = (2.0, 0.5);
    let system = NoseHoover::<_, 1> { energy: oscillator(), temperature, mass };
    // `h = exp(F)` is the density of the inverse temperature 2/T and the variance Q T/2.
    let bath = Bath::Gaussian { variance: 0.5 * mass * temperature };
    let thermostat = ContactThermostat { energy: oscillator(), beta: 2.0 / temperature, bath };
    let transformed = thermostat.in_time_of_energy::<1>();
    for (_, x) in points(one(), 1.0) {
        let (start, same): (PhasePoint<2>, PhasePoint<2>) = (system.start(&x), transformed.start(0.0, &x));
        close(start.p[1], same.p[1]);
        let (field, other) = (system.contact_field(0.0, &start), transformed.contact_field(0.0, &start));
        let (q, p, z) = (x.q[0], x.p[0], x.z);
        close(field.x[0], p);
        close(field.y[0], -4.0 * q - z / mass * p);
        close(field.z, p * p - temperature);
        for i in 0..2 {
            close(other.x[i], field.x[i]);
            close(other.y[i], field.y[i]);
        }
        close(other.z, field.z);
    }
}

#[test]
fn nose_poincare_is_nose_in_the_physical_time() {
    let nose = Nose::<_, 1> { energy: oscillator(), temperature: 2.0, mass: 0.5, degrees: 1.0 };
    for (_, x) in points(PhasePoint::new([0.4, 1.2], [0.6, -0.8], 0.0), 1.0) {
        let field = nose.poincare(&x).contact_field(0.0, &x);
        let (s, p) = (x.q[1], x.p[0] / x.q[1]);
        close(field.x[0], p);
        close(field.x[1], s * x.p[1] / 0.5);
        close(field.y[0], -4.0 * x.q[0] * s);
        close(field.y[1], p * p - 2.0);
    }
}
