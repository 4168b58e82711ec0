//! Contact Hamiltonians in a new time, on systems of the gallery.

use contact_examples::systems::hamiltonian::{HeatedOscillator, Piston, SpinOrbit};
use contact_geom::{
    AtEnergy, ChartVector, ContactHamiltonian, HamiltonianDerivatives, InTransformedTime, PhasePoint, TimesRate,
};

/// Some hundred units of round-off.
const ROUND_OFF: f64 = 256.0 * f64::EPSILON;

/// `X_(g K) = g X_K + K (X_g + g R)` at any point, so that the two are parallel on K = 0.
#[test]
fn the_field_of_a_product() {
    let (k, g) = (Piston::default(), HeatedOscillator { rate: 0.7, ..HeatedOscillator::default() });
    for (q, p, z) in [(1.0, 0.5, 0.3), (0.6, -1.0, 2.0), (2.0, 0.1, -1.0)] {
        let x = PhasePoint::new([q], [p], z);
        let (of_k, of_g) = (k.value(0.0, &x.q, &x.p, z), g.value(0.0, &x.q, &x.p, z));
        let (x_k, mut x_g) = (k.contact_field(0.0, &x), g.contact_field(0.0, &x));
        x_g.z += of_g;
        let expected = x_k.scale(of_g).plus(x_g.scale(of_k));
        let found = TimesRate { hamiltonian: k, rate: g }.contact_field(0.0, &x);
        assert!(found.minus(expected).amax() <= ROUND_OFF * (1.0 + expected.amax()), "{found:?}");
        // On a level of K, the evolution field times the rate.
        let found = TimesRate { hamiltonian: AtEnergy::of(k, &x), rate: g }.contact_field(0.0, &x);
        let evolution = ChartVector { z: x_k.z + of_k, ..x_k };
        let off = found.minus(evolution.scale(of_g)).amax();
        assert!(off <= ROUND_OFF * (1.0 + evolution.amax() * of_g.abs()), "{off:e}");
    }
}

/// The field of a Hamiltonian that depends on time, with a rate that depends on everything.
#[test]
fn the_field_with_the_time_as_a_coordinate() {
    let h = SpinOrbit { amplitude: 0.3, ..SpinOrbit::default() };
    let g = HeatedOscillator { rate: 0.7, ..HeatedOscillator::default() };
    let moving = InTransformedTime::<_, _, 1> { hamiltonian: h, rate: g };
    for (t, q, p, z) in [(0.3, 1.0, 0.5, 0.3), (2.0, 0.6, -1.0, 2.0), (-1.0, 2.0, 0.1, -1.0)] {
        let x = PhasePoint::new([q], [p], z);
        let start: PhasePoint<2> = moving.start(t, &x);
        let (field, of_h) = (moving.contact_field(9.0, &start), h.contact_field(t, &x));
        let rate = g.value(t, &x.q, &x.p, z);
        for (found, expected) in
            [(field.x[0], of_h.x[0]), (field.x[1], 1.0), (field.y[0], of_h.y[0]), (field.z, of_h.z)]
        {
            assert!((found - rate * expected).abs() <= ROUND_OFF * (1.0 + (rate * expected).abs()));
        }
    }
}
