//! Polytropic stars: Lane-Emden's equation from the centre to the surface.

use super::systems::{OfSystem, One, Polytrope};
use contact_examples::systems::{LaneEmden, System};
use contact_geom::{OfHamiltonian, PhasePoint, legendre};
use discrete_herglotz::{Event, Events, GaussCollocation, Problem, Steps, Until};

/// The radius at which the density vanishes.
fn surface(system: One, (t0, start): (f64, PhasePoint<1>)) -> f64 {
    let of = OfHamiltonian(system);
    let mut surface = Events::new([Event::new(|_, x| x.q[0]).terminal()]);
    let problem = Problem::of_hamiltonian(&of, t0, start).unwrap();
    let run = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.02)).observe(&mut surface);
    let outcome = run.run(Until::Time(10.0)).unwrap();
    assert_eq!(surface.crossings.len(), 1, "{outcome:?}");
    surface.crossings[0].t
}

/// The radii 6.89684862 (n = 3) and 3.65375374 (n = 1.5) of the tables, to their last digit; Horedt, "Polytropes" (2004).
#[test]
fn the_surface_of_a_polytrope() {
    let system = LaneEmden { n: 3 };
    let (t, x) = (system.initial_time(), system.initial());
    let radius = surface(One::from(OfSystem(system)), (t, legendre(&system, t, &x)));
    assert!((radius - 6.89684862).abs() < 5e-9, "{radius}");
    // The series of the regular motion to t^6: at 0.1 the next term is below 1e-12.
    let (n, t): (f64, f64) = (1.5, 0.1);
    let q = 1.0 - t * t / 6.0 + n * t.powi(4) / 120.0 - n * (8.0 * n - 5.0) * t.powi(6) / 15120.0;
    let p = -t / 3.0 + n * t.powi(3) / 30.0 - n * (8.0 * n - 5.0) * t.powi(5) / 2520.0;
    let radius = surface(One::from(Polytrope(n)), (t, PhasePoint::new([q], [p], 0.0)));
    assert!((radius - 3.65375374).abs() < 5e-9, "{radius}");
}
