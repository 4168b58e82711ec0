//! Two gas containers: published numbers, and both laws of thermodynamics.

use super::systems::{Four, end, run, slope};
use contact_examples::systems::hamiltonian::{Containers, Gas, ThermalCoordinates};
use contact_geom::Lifted;
use discrete_herglotz::Status;

const COORDINATES: [ThermalCoordinates; 2] = [ThermalCoordinates::Entropies, ThermalCoordinates::Energies];

/// The example of Shang and Oettinger at the times 1 and 30, to its last digit.
#[test]
fn the_published_motion() {
    for coordinates in COORDINATES {
        let system = Containers { coordinates, ..Containers::default() };
        let start = (0.0, system.initial());
        let x = end(Lifted(system), start, (8, 0.1), 1.0).q;
        assert!((x[0] - 0.995943001913).abs() < 1e-12 && (x[1] + 1.924764006792).abs() < 1e-12, "{x:?}");
        let x = end(Lifted(system), start, (8, 0.1), 30.0).q;
        let [e1, e2] = system.energies(&x);
        let gain: f64 = system.entropies(&x).iter().sum();
        for (found, published) in [
            (x[0], 1.16581228326),
            (x[1], -0.53388914243),
            (e1, 2.63142893086),
            (e2, 3.22605226094),
            (gain, 1.10085901608),
        ] {
            assert!((found - published).abs() < 1e-10, "{coordinates:?}: {found} for {published}");
        }
    }
}

/// In entropies the error of the energy has the order of the method, and does not drift once the motion has come to rest.
#[test]
fn the_first_law_in_entropies() {
    let system = Containers { friction: 0.3, ..Containers::default() };
    let error = |stages: usize, h: f64, t: f64| {
        let mut largest: f64 = 0.0;
        run(Lifted(system), (0.0, system.initial()), (stages, h), t, |_, x, _| {
            let error = (system.energy(&x.q) - 6.0).abs();
            largest = if error <= largest { largest } else { error };
        });
        largest
    };
    for (stages, counts) in [(1, [20.0, 40.0, 80.0]), (2, [16.0, 32.0, 64.0]), (3, [16.0, 24.0, 36.0])] {
        let points = counts.map(|n| (1.0 / n, error(stages, 1.0 / n, 5.0)));
        let order = slope(&points);
        assert!((order - 2.0 * stages as f64).abs() < 0.15, "{stages} stages: {order}, {points:?}");
    }
    let [early, late] = [60.0, 240.0].map(|t| error(2, 0.1, t));
    assert!(late <= 1.001 * early, "{early:e} {late:e}");
}

/// Numbers of [0, 1), from a linear congruential generator.
struct Random(u64);

impl Random {
    fn next(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Ten thousand random systems with large steps. The second law holds in each step in entropies, whatever the accuracy,
/// since the rate of the entropy is not negative at any stage and the weights are positive. The first law holds in each
/// step in energies, since Gauss collocation conserves quadratic invariants. The bounds are some hundred
/// units of round-off of the numbers and of the residuals of the steps.
#[test]
fn both_laws_on_random_systems() {
    let mut random = Random(20261126);
    let mut steps = 0;
    let mut gained = 0.0;
    for case in 0..10_000 {
        let mut gas = || Gas {
            attraction: random.next(0.0, 0.3),
            covolume: random.next(0.0, 0.1),
            heat_capacity: random.next(1.0, 3.0),
            reference: random.next(1.0, 4.0),
        };
        let system = Containers {
            gases: [gas(), gas()],
            mass: random.next(0.5, 2.0),
            area: random.next(0.5, 2.0),
            length: random.next(0.7, 1.5),
            conductivity: random.next(0.0, 1.0),
            friction: random.next(0.0, 1.0),
            coordinates: COORDINATES[case % 2],
        };
        let mut start = system.initial();
        start.q[0] *= random.next(0.8, 1.2);
        start.q[1] = random.next(-0.7, 0.7);
        for i in 2..4 {
            start.q[i] += random.next(-0.2, 0.2);
        }
        let h = random.next(0.01, 0.1);
        let (energy, mut entropy) = (system.energy(&start.q), system.entropies(&start.q).iter().sum::<f64>());
        let outcome = run::<Four, 4>(Lifted(system), (0.0, start), (2, h), 3.0 * h, |_, x, _| {
            let now: f64 = system.entropies(&x.q).iter().sum();
            match system.coordinates {
                ThermalCoordinates::Entropies => {
                    assert!(now >= entropy - 1e-14, "case {case}: the entropy changes by {:e}", now - entropy);
                }
                ThermalCoordinates::Energies => {
                    let error = (system.energy(&x.q) - energy).abs() / energy;
                    assert!(error < 1e-13, "case {case}: the energy changes by {error:e}");
                }
            }
            gained += now - entropy;
            entropy = now;
            steps += 1;
        });
        assert_eq!(outcome.status, Status::Completed, "case {case}: {system:?}");
    }
    assert!(steps >= 40_000 && gained > 10.0, "{steps} {gained}");
}
