//! Invalid input to contact Hamiltonian systems: their formulas and starts propagate a NaN.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::Report;
use contact_examples::systems::hamiltonian::{
    Bath, Bregman, ContactThermostat, Containers, Gas, HeatedOscillator, Kinetic, Medium, Nose, NoseHoover, Objective,
    Piston, Quartic, Ray, RelativisticDescent, SpinOrbit, ThermalCoordinates,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{AtEnergy, ContactHamiltonian, InTransformedTime, PhasePoint, VectorField};

pub const TESTS: &[InputTest] = &[
    InputTest { entries: &["AtEnergy::of", "InTransformedTime::start"], run: motions },
    InputTest {
        entries: &[
            "Gas::energy",
            "Gas::entropy",
            "Gas::pressure",
            "Gas::temperature",
            "Gas::temperature_of_energy",
            "HeatedOscillator::entropy",
            "HeatedOscillator::temperature_at",
            "Piston::entropy",
            "Piston::temperature",
        ],
        run: gases,
    },
    InputTest {
        entries: &[
            "Containers::energies",
            "Containers::energy",
            "Containers::entropies",
            "Containers::temperatures",
            "VectorField::at",
        ],
        run: containers,
    },
    InputTest {
        entries: &[
            "Bregman::lyapunov",
            "Bregman::start",
            "Kinetic::distance",
            "Kinetic::energy",
            "Kinetic::momentum",
            "Objective::value",
            "RelativisticDescent::start",
        ],
        run: optimizers,
    },
    InputTest { entries: &["Medium::index", "Ray::start", "SpinOrbit::rigid"], run: rays_and_spins },
    InputTest {
        entries: &[
            "ContactThermostat::in_time_of_energy",
            "ContactThermostat::log_density",
            "Nose::poincare",
            "Nose::start",
            "NoseHoover::start",
        ],
        run: thermostats,
    },
];

/// A function is finite for ordinary numbers, and not for a NaN in the place of any of them.
fn propagates(report: &mut Report, what: &str, base: &[f64], f: impl Fn(&[f64]) -> f64) {
    let value = f(base);
    report.check(value.is_finite(), || format!("{what} of {base:?} is {value}"));
    for i in 0..base.len() {
        let mut with = base.to_vec();
        with[i] = f64::NAN;
        let value = f(&with);
        report.check(!value.is_finite(), || format!("{what} of {with:?} is {value}"));
    }
}

/// A state of one coordinate.
fn state(u: &[f64]) -> PhasePoint<1> {
    PhasePoint::new([u[0]], [u[1]], u[2])
}

/// The sum of the numbers of a state.
fn sum<const N: usize>(x: PhasePoint<N>) -> f64 {
    x.q.sum() + x.p.sum() + x.z
}

fn motions(report: &mut Report) {
    let h = HeatedOscillator::default();
    propagates(report, "energy", &[0.3, 0.7, 0.2], |u| AtEnergy::of(h, &state(u)).energy);
    let moving = InTransformedTime::<_, _, 1> { hamiltonian: h, rate: h };
    propagates(report, "start", &[0.3, 0.7, 0.2, 1.0], |u| sum::<2>(moving.start(u[3], &state(u))));
}

fn gases(report: &mut Report) {
    let (gas, two) = (Gas::van_der_waals(0.3, 0.1), [0.7, 0.4]);
    propagates(report, "energy", &two, |u| gas.energy(u[0], u[1]));
    propagates(report, "entropy", &two, |u| gas.entropy(u[0], u[1]));
    propagates(report, "pressure", &two, |u| gas.pressure(u[0], u[1]));
    propagates(report, "temperature", &two, |u| gas.temperature(u[0], u[1]));
    propagates(report, "temperature", &two, |u| gas.temperature_of_energy(u[0], u[1]));
    // Below the volume of the particles.
    report.check(gas.energy(0.05, 0.4).is_nan(), || "the energy of no volume".into());
    let h = HeatedOscillator::default();
    propagates(report, "entropy", &[0.2], |u| h.entropy(u[0]));
    propagates(report, "temperature", &[0.2], |u| h.temperature_at(u[0]));
    let piston = Piston { gas, ..Piston::default() };
    propagates(report, "entropy", &[0.2], |u| piston.entropy(&PhasePoint::new([1.0], [0.0], u[0])));
    propagates(report, "temperature", &two, |u| piston.temperature(&PhasePoint::new([u[0]], [0.0], u[1])));
}

fn containers(report: &mut Report) {
    let base = [0.9, 0.3, 0.5, 0.6];
    for coordinates in [ThermalCoordinates::Entropies, ThermalCoordinates::Energies] {
        let system = Containers { coordinates, gases: [Gas::van_der_waals(0.3, 0.1); 2], ..Containers::default() };
        let at = |u: &[f64]| SVector::<f64, 4>::from_column_slice(u);
        let thermal = |u: &[f64]| at(&[u[0], 0.3, u[1], u[2]]);
        // The energies of the gases do not involve the position of the wall.
        let first = usize::from(matches!(coordinates, ThermalCoordinates::Energies));
        propagates(report, "energy", &base[first..], |u| {
            let mut x = at(&base);
            x.rows_mut(first, u.len()).copy_from_slice(u);
            system.energy(&x)
        });
        propagates(report, "field", &base, |u| system.at(0.0, &at(u)).sum());
        propagates(report, "temperatures", &base[1..], |u| system.temperatures(&thermal(u)).iter().sum());
        // The energies or the entropies are coordinates.
        propagates(report, "energies", &base[2..], |u| system.energies(&at(&[0.9, 0.3, u[0], u[1]])).iter().sum());
        propagates(report, "entropies", &base[2..], |u| system.entropies(&at(&[0.9, 0.3, u[0], u[1]])).iter().sum());
    }
}

fn optimizers(report: &mut Report) {
    let (objective, two) = (Quartic::default(), [0.3, -0.7]);
    let at = |u: &[f64]| SVector::<f64, 2>::from_column_slice(u);
    propagates(report, "value", &two, |u| objective.value(&at(u)));
    for kinetic in [Kinetic::Quadratic, Kinetic::Relativistic { speed: 2.0, mass: 0.5 }] {
        propagates(report, "distance", &two, |u| kinetic.distance(&at(u)));
        propagates(report, "energy", &two, |u| kinetic.energy(&at(u)));
        propagates(report, "momentum", &two, |u| kinetic.momentum(&at(u)).sum());
        let system = Bregman { objective, kinetic, power: 2, scale: 1.0 };
        propagates(report, "start", &two, |u| sum(system.start(at(u))));
        propagates(report, "function", &[1.5, 0.3, -0.7, 0.2, 0.4, 1.0, 0.9], |u| {
            let x = PhasePoint { q: at(&u[1..3]), p: at(&u[3..5]), z: 0.0 };
            system.lyapunov(u[0], &x, &at(&u[5..7]))
        });
    }
    let fast = Kinetic::Relativistic { speed: 2.0, mass: 0.5 };
    report.check(fast.momentum(&at(&[3.0, 0.0])).sum().is_nan(), || "a momentum beyond the speed".into());
    let descent = RelativisticDescent { objective, mass: 1.0, speed: 1.0, gamma: -0.1 };
    propagates(report, "start", &two, |u| sum(descent.start(at(u))));
}

fn rays_and_spins(report: &mut Report) {
    let at = |u: &[f64]| SVector::<f64, 2>::from_column_slice(u);
    let medium = Medium::FishEye { centre: 2.0, radius: 1.3 };
    propagates(report, "index", &[0.3, 0.7], |u| medium.index(&at(u)));
    let ray = Ray { medium };
    propagates(report, "start", &[0.3, 0.7, 0.6, 0.8], |u| sum(ray.start(at(&u[..2]), at(&u[2..]))));
    report.check(ray.start(at(&[0.3, 0.7]), at(&[0.0, 0.0])).p.sum().is_nan(), || "a ray without a direction".into());
    propagates(report, "coefficient", &[0.1], |u| SpinOrbit::rigid(u[0], 0.1).coefficient(2));
    report.check(SpinOrbit::rigid(1.5, 0.1).coefficient(2).is_nan(), || "a hyperbolic orbit".into());
}

fn thermostats(report: &mut Report) {
    let energy = HeatedOscillator::default();
    for bath in [Bath::Logistic { scale: 2.0 }, Bath::Gaussian { variance: 0.5 }] {
        let system = ContactThermostat { energy, beta: 0.1, bath };
        let moving = system.in_time_of_energy::<1>();
        propagates(report, "density", &[0.3, 0.7, 0.2], |u| system.log_density(0.0, &state(u)));
        propagates(report, "start", &[0.3, 0.7, 0.2, 1.0], |u| sum::<2>(moving.start(u[3], &state(u))));
    }
    let nose = Nose::<_, 1> { energy, temperature: 1.0, mass: 1.0, degrees: 1.0 };
    let start = |u: &[f64]| nose.start::<2>(&PhasePoint::new([u[0]], [u[1]], 0.0), u[2]);
    propagates(report, "start", &[0.3, 0.7, 0.2], |u| sum(start(u)));
    propagates(report, "motion", &[0.3, 0.7, 0.2], |u| {
        let x = start(u);
        nose.poincare(&x).hamiltonian.energy
    });
    let hoover = NoseHoover::<_, 1> { energy, temperature: 1.0, mass: 1.0 };
    propagates(report, "start", &[0.3, 0.7, 0.2], |u| sum::<2>(hoover.start(&state(u))));
    let x = hoover.start::<2>(&state(&[0.3, 0.7, 0.2]));
    let k = hoover.value(0.0, &x.q, &x.p, x.z);
    report.check(k.abs() < 1e-15, || format!("K = {k:e} at the start"));
}
