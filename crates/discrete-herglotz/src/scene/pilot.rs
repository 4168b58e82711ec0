//! The step for a wanted error, by pilot runs.

use super::{Plan, Scene, Wanted};
use crate::{InputError, Status};
use contact_geom::Lagrangian;
use contact_geom::nalgebra::SVector;

/// The pairs of runs that a search may take.
const PAIRS: usize = 24;

/// The steps of the longest pilot run.
const MOST_STEPS: usize = 1 << 26;

/// The number of steps with which the error at the end of the span, relative to the size of (q, p), is at most `error`.
///
/// The error of a run with n steps is taken from one with 2n. The next n follows from the order, by a factor of at most
/// eight, and of at least 5/4. The search ends where two pairs do not better the estimate by a half: that is round-off.
pub(super) fn steps_for<L: Lagrangian<N>, const N: usize>(
    scene: &Scene<'_, L, N>,
    error: f64,
) -> Result<usize, InputError> {
    if !(error > 0.0 && error.is_finite()) {
        return Err(InputError::Accuracy { wanted: error, reached: f64::INFINITY });
    }
    let wanted = Wanted { action: false, ..Wanted::default() };
    let pilot = Scene { wanted, ..*scene };
    let run = |count: usize| -> Result<Option<[SVector<f64, N>; 2]>, InputError> {
        // Bad luck, and a start that cannot be stepped from, call for shorter steps.
        match Plan::new(&pilot, count).and_then(|plan| plan.run()) {
            Ok(outcome) if outcome.status == Status::Completed => Ok(Some([outcome.q, outcome.p])),
            Ok(_) | Err(InputError::Sigma { .. } | InputError::FirstStep(_)) => Ok(None),
            Err(bad) => Err(bad),
        }
    };
    let order = f64::from(scene.integrator.order());
    let mut count = 4usize;
    let mut coarse = run(count)?;
    let (mut best, mut strikes) = (f64::INFINITY, 0);
    for _ in 0..PAIRS {
        let fine = run(2 * count)?;
        let factor = match (&coarse, &fine) {
            (Some(a), Some(b)) => {
                let size = (b[0].norm_squared() + b[1].norm_squared()).sqrt();
                let defect = ((a[0] - b[0]).norm_squared() + (a[1] - b[1]).norm_squared()).sqrt() / size;
                if defect <= error {
                    return Ok(count);
                }
                strikes = if defect < 0.5 * best { 0 } else { strikes + 1 };
                best = best.min(defect);
                if strikes == 2 {
                    break;
                }
                // A margin of a tenth, since the order is that of short steps.
                (1.1 * (defect / error).powf(1.0 / order)).clamp(1.25, 8.0)
            }
            _ => 2.0,
        };
        let next = (count as f64 * factor).ceil() as usize;
        if next > MOST_STEPS {
            break;
        }
        coarse = if next == 2 * count { fine } else { run(next)? };
        count = next;
    }
    Err(InputError::Accuracy { wanted: error, reached: best })
}
