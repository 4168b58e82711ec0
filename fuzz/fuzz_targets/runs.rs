//! Runs of a pendulum with any integrator from any numbers, forward or backward: an error, a status, or a finite
//! outcome.

#![no_main]

use contact_examples::systems::Pendulum;
use contact_geom::VelocityPoint;
use discrete_herglotz::{InputError, AnyIntegrator, Outcome, Problem, Row, Rows, Steps, Until};
use libfuzzer_sys::fuzz_target;

/// The maximal number of steps of a run.
const STEPS: u16 = 300;

fuzz_target!(|input: ([f64; 6], u8, u16, Option<u16>, bool)| {
    match run(input) {
        Ok((outcome, rows)) => {
            let finite = outcome.q[0].is_finite() && outcome.p[0].is_finite() && outcome.z.is_none_or(f64::is_finite);
            assert!(finite, "{outcome:?}");
            assert!(rows.iter().all(|row| row.q[0].is_finite() && row.p[0].is_finite()), "{outcome:?}, {rows:?}");
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});

fn run(input: ([f64; 6], u8, u16, Option<u16>, bool)) -> Result<(Outcome, Vec<Row>), InputError> {
    let ([q, v, z, t0, span, gamma], integrator, count, stride, action) = input;
    let all = AnyIntegrator::all();
    let system = Pendulum { gamma };
    let mut rows = stride.map(|stride| Rows::every(usize::from(stride))).transpose()?;
    if !action {
        rows = rows.map(Rows::without_action);
    }
    let problem = Problem::new(&system, t0, VelocityPoint::new([q], [v], z))?;
    let mut run = problem
        .by(all[usize::from(integrator) % all.len()])
        .steps(Steps::Count(usize::from(count % STEPS)))
        .with_conformal_factor();
    if !action {
        run = run.without_action();
    }
    if let Some(rows) = &mut rows {
        run = run.observe(rows);
    }
    let outcome = run.run(Until::Time(t0 + span))?;
    Ok((outcome, rows.map_or(Vec::new(), |rows| rows.rows)))
}
