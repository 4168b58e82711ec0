//! Scenes of a pendulum by any integrator from any numbers: an error, a status, or a finite outcome.

#![no_main]

use contact_geom::VelocityPoint;
use contact_geom::systems::Pendulum;
use discrete_herglotz::{Integrator, Scene, Steps, Wanted};
use libfuzzer_sys::fuzz_target;

/// The most steps of a run.
const STEPS: u16 = 300;

fuzz_target!(|input: ([f64; 6], u8, u16, Option<u16>, bool)| {
    let ([q, v, z, t0, span, gamma], integrator, count, rows, action) = input;
    let all = Integrator::all();
    let system = Pendulum { gamma };
    let wanted = Wanted { action, conformal_factor: true, rows: rows.map(usize::from), momentum: None };
    let scene = Scene::new(&system, VelocityPoint::new([q], [v], z), span)
        .from_time(t0)
        .by(all[usize::from(integrator) % all.len()])
        .steps(Steps::Count(usize::from(count % STEPS)))
        .wanting(wanted);
    match scene.plan().and_then(|plan| plan.run()) {
        Ok(outcome) => {
            let finite = outcome.q[0].is_finite() && outcome.p[0].is_finite() && outcome.z.is_none_or(f64::is_finite);
            assert!(finite, "{outcome:?}");
            assert!(outcome.rows.iter().all(|row| row.q[0].is_finite() && row.p[0].is_finite()), "{outcome:?}");
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
