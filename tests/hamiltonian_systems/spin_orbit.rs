//! The capture of a satellite into the synchronous resonance.

use super::systems::{One, run};
use contact_geom::systems::hamiltonian::SpinOrbit;
use discrete_herglotz::Status;

/// The run of Bravetti, Seri, Vermeeren and Zadra: the spin decays from 3 to the resonance, within whose width 0.16 it
/// stays. The conformal factor is that in closed form.
#[test]
fn a_satellite_is_captured_into_the_synchronous_resonance() {
    let system = SpinOrbit::default();
    let inertia = |t: f64| 1.0 + 1e-4 * t.cos();
    let mut captured = None;
    let h = std::f64::consts::PI / 10.0;
    let outcome = run(One::from(system), (0.0, system.initial()), (4, h), 10_000.0, |t, x, log_factor| {
        let exact = (inertia(0.0) / inertia(t)).ln() - 1e-3 * t;
        // The error of 30000 steps, each of the order 8.
        assert!((log_factor - exact).abs() < 1e-10, "{log_factor} {exact} at {t}");
        match ((x.p[0] - 1.0).abs() < 0.16, captured) {
            (true, None) => captured = Some(t),
            (false, Some(since)) => panic!("left the resonance at {t}, captured at {since}"),
            _ => (),
        }
        // Before the capture the mean of the spin decays, up to the librations of the resonances that it passes.
        if captured.is_none() && t > 100.0 {
            assert!((x.p[0] - 1.0 - 2.0 * (-1e-3 * t).exp()).abs() < 0.1, "{} at {t}", x.p[0]);
        }
    });
    assert_eq!(outcome.status, Status::Completed);
    let since = captured.unwrap();
    assert!(since > 1_500.0 && since < 4_000.0, "{since}");
    // It turns once in each orbit.
    let turns = outcome.q[0] - outcome.t;
    assert!((outcome.p[0] - 1.0).abs() < 0.05 && (turns / std::f64::consts::PI).fract().abs() < 0.1, "{outcome:?}");
}
