//! Optimizers on the quartic function.

use super::systems::{Two, run};
use contact_examples::systems::hamiltonian::{Bregman, Kinetic, Objective, Quartic, RelativisticDescent};
use contact_geom::nalgebra::SVector;
use discrete_herglotz::Status;

/// The function of Lyapunov does not increase, so that `f <= E0/(C t^k)`, and the conformal factor is `(t0/t)^k`.
#[test]
fn bregman_dynamics_converges_at_its_rate() {
    let minimum = SVector::from([1.0, 1.0]);
    for kinetic in [Kinetic::Quadratic, Kinetic::Relativistic { speed: 3.0, mass: 1.0 }] {
        for power in [2, 3] {
            let system = Bregman { objective: Quartic::default(), kinetic, power, scale: 1.0 };
            let (t0, start) = (0.5, system.start([-0.4, 0.3].into()));
            let first = system.lyapunov(t0, &start, &minimum);
            let (mut last, mut excess) = (first, 0.0);
            let outcome = run(Two::from(system), (t0, start), (6, 0.02), 20.0, |t, x, log_factor| {
                let now = system.lyapunov(t, x, &minimum);
                // The change is above the error of the steps.
                assert!(now <= last + 1e-12 * first, "{kinetic:?}, {power}: {last} {now} at {t}");
                last = now;
                excess = system.objective.value(&x.q);
                assert!(excess <= first / t.powi(power.into()), "{excess} at {t}");
                let decay = f64::from(power) * (t0 / t).ln();
                assert!((log_factor - decay).abs() < 1e-11, "{log_factor} {decay} at {t}");
            });
            assert_eq!(outcome.status, Status::Completed);
            assert!(excess < 1e-3 && last < 0.9 * first, "{kinetic:?}, {power}: {excess} {last}");
        }
    }
}

/// The energy without z decreases, the speed stays below its bound, and the motion comes to the minimum.
#[test]
fn relativistic_descent_is_slower_than_light() {
    let system = RelativisticDescent { objective: Quartic::default(), mass: 1.0, speed: 0.5, gamma: -0.5 };
    let start = system.start([-2.0, 3.0].into());
    let energy =
        |q: &SVector<f64, 2>, p: &SVector<f64, 2>| 0.5 * (p.norm_squared() + 0.25).sqrt() + system.objective.value(q);
    let (mut last, mut fastest, mut before): (f64, f64, _) = (f64::INFINITY, 0.0, (0.0, start.q));
    let outcome = run(Two::from(system), (0.0, start), (6, 0.02), 60.0, |t, x, log_factor| {
        let now = energy(&x.q, &x.p);
        assert!(now <= last, "{last} {now} at {t}");
        last = now;
        if t > before.0 {
            let speed = (x.q - before.1).norm() / (t - before.0);
            fastest = if speed <= fastest { fastest } else { speed };
        }
        before = (t, x.q);
        assert!((log_factor + 0.5 * t).abs() < 1e-12 * (1.0 + t));
    });
    assert_eq!(outcome.status, Status::Completed);
    assert!(fastest > 0.45 && fastest < 0.5, "{fastest}");
    assert!(system.objective.value(&outcome.q.fixed::<2>()) < 1e-3, "{outcome:?}");
}
