//! The capture of a satellite into the synchronous resonance.

use super::systems::{One, run};
use contact_examples::systems::hamiltonian::SpinOrbit;
use discrete_herglotz::Status;

/// The run of Bravetti, Seri, Vermeeren and Zadra: the spin decays from 3 to the resonance, within whose width 0.16 it
/// stays. The conformal factor is that in closed form.
#[test]
fn a_satellite_is_captured_into_the_synchronous_resonance() {
    let system = SpinOrbit::default();
    let inertia = |t: f64| 1.0 + 1e-4 * t.cos();
    let (mut reached, mut outside) = (None, 0.0);
    let h = std::f64::consts::PI / 10.0;
    let outcome = run(One::from(system), (0.0, system.initial()), (4, h), 10_000.0, |t, x, log_factor| {
        let exact = (inertia(0.0) / inertia(t)).ln() - 1e-3 * t;
        // The error of 30000 steps, each of the order 8.
        assert!((log_factor - exact).abs() < 1e-10, "{log_factor} {exact} at {t}");
        if (x.p[0] - 1.0).abs() >= 0.16 {
            outside = t;
        } else if reached.is_none() {
            reached = Some(t);
        }
        // Before that the mean of the spin decays, up to the librations at the resonances that it passes.
        if reached.is_none() && t > 100.0 {
            assert!((x.p[0] - 1.0 - 2.0 * (-1e-3 * t).exp()).abs() < 0.1, "{} at {t}", x.p[0]);
        }
    });
    assert_eq!(outcome.status, Status::Completed);
    // The decay alone reaches the edge of the resonance at 1000 ln(2/0.16) = 2526.
    assert!(outside > 2_400.0 && outside < 4_000.0 && reached < Some(outside), "{reached:?}, {outside}");
    // It turns once in each orbit.
    let turns = (outcome.q[0] - outcome.t) / std::f64::consts::PI;
    let off = turns - turns.round();
    assert!((outcome.p[0] - 1.0).abs() < 0.05 && off.abs() < 0.1, "{outcome:?}");
}
