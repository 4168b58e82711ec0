//! The systems of the catalogue, compared with the types of the libraries.

use super::{accurate, start_of};
use contact_examples::systems as typed;
use contact_geom::{Derivatives, Lagrangian, VelocityPoint, herglotz_field};
use discrete_herglotz::Status;
use herglotz_runtime::{CATALOGUE, CatalogueEntry, FormulaSymmetry, Motion, System};

/// Checks that the Herglotz field of a catalogue entry is that of the type.
fn same<const N: usize>(name: &str, lagrangian: &impl Lagrangian<N>) {
    let entry = CatalogueEntry::find(name).unwrap();
    let system = System::new(&entry.formula().unwrap()).unwrap();
    let x = VelocityPoint::<N>::from_slices(entry.q, entry.v, 0.2).unwrap();
    let field = herglotz_field(lagrangian, entry.t, &x).unwrap().to_vector();
    let geometry = system.geometry(&start_of(entry)).unwrap();
    let size = field.amax();
    for (found, expected) in geometry.herglotz_field.iter().zip(&field) {
        assert!((found - expected).abs() <= 16.0 * f64::EPSILON * size, "{name}: {found} and {expected}");
    }
    let rate = lagrangian.gradient(entry.t, &x).z;
    assert!((geometry.rate - rate).abs() <= 16.0 * f64::EPSILON, "{name}: {}", geometry.rate);
}

#[test]
fn the_catalogue_has_the_formulas_of_the_types() {
    same("free_particle", &typed::FreeParticle { gamma: -0.1 });
    same("uniform_field", &typed::UniformField::<2> { field: [0.0, -1.0], gamma: -0.1 });
    same("harmonic_oscillator", &typed::HarmonicOscillator { gamma: -0.1 });
    same("pendulum", &typed::Pendulum { gamma: -0.1 });
    same("duffing", &typed::Duffing { alpha: -1.0, beta: 1.0, force: 0.3, omega: 1.2, gamma: -0.3 });
    same("quadratic_in_z", &typed::QuadraticInZ { c: 0.1 });
    same("coupled_in_z", &typed::CoupledInZ { a: 0.5, b: 0.1, gamma: -0.1 });
    same("relativistic", &typed::Relativistic { gamma: -0.1 });
    same("lane_emden", &typed::LaneEmden { n: 5 });
    same("kepler", &typed::Kepler::<2> { mu: 1.0, gamma: -0.01 });
    same("kepler_in_space", &typed::Kepler::<3> { mu: 1.0, gamma: -0.01 });
    same("perturbed_kepler", &typed::PerturbedKepler { mu: 1.0, alpha: 0.01, theta: std::f64::consts::PI });
    same("charged_particle", &typed::ChargedParticle { b: 1.0, k: 0.5, gamma: -0.1 });
    same("double_pendulum", &typed::DoublePendulum { masses: [1.0; 2], lengths: [1.0; 2], gamma: -0.1 });
    same("spherical_pendulum", &typed::SphericalPendulum { gamma: -0.1 });
    same("coupled_plane", &typed::CoupledPlane { a: 0.3, b: 0.4, c: 0.3 });
    same("chain", &typed::Chain::<6> { ends: typed::Ends::Fixed, beta: 0.5, gamma: -0.1 });
    assert_eq!(CATALOGUE.len(), 17, "each is compared above");
}

#[test]
fn every_entry_runs_and_its_steps_are_contact() {
    for entry in CATALOGUE {
        let system = System::new(&entry.formula().unwrap()).unwrap();
        let motion = Motion::new(start_of(entry), entry.t + 3.0, accurate(1e-9));
        let outcome = system.run(&motion, &mut ()).unwrap();
        assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None), "{}", entry.name);
        let check = system.check(&motion, 3).unwrap_or_else(|error| panic!("{}: {error}", entry.name));
        assert!(check.is_contact(), "{}: {:e}", entry.name, check.contact_defect());
        assert!(check.momentum_defect() <= 1e-11, "{}: {:e}", entry.name, check.momentum_defect());
        for sample in &check.samples {
            // The whole motion has an error of 1e-9, so the error of a single step is below this bound.
            assert!(sample.herglotz_defect <= 1e-8, "{}: {:e}", entry.name, sample.herglotz_defect);
        }
        assert!(check.statements.len() >= 12, "{}", entry.name);
        for stated in &check.statements {
            assert!(stated.residual <= 1e-9, "{}: {:?} {:e}", entry.name, stated.statement, stated.residual);
        }
    }
}

#[test]
fn symmetries_and_structure() {
    let kepler = System::new(&CatalogueEntry::find("kepler").unwrap().formula().unwrap()).unwrap();
    assert_eq!(kepler.symmetries(), [FormulaSymmetry::Rotation(vec![(0, 1)])]);
    let free = System::new(&CatalogueEntry::find("free_particle").unwrap().formula().unwrap()).unwrap();
    assert_eq!(free.symmetries(), [FormulaSymmetry::Translation(vec![0])]);
    assert!(free.structure().separable && free.is_smooth());
}
