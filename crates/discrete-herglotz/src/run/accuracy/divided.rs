//! Steps of varying size for a requested accuracy, if equal steps would be too many.

use crate::run::accuracy::failure::obstacle;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::track::Track;
use crate::run::accuracy::trial_runs::{ComparisonGrid, TrialEnd, TrialRuns};
use crate::run::request::StepSelection;
use crate::switching::DividedGauss;
use crate::{InputError, SelectionFailure};
use contact_geom::{Lagrangian, numbers::max_or_nan};
use std::sync::Arc;

/// The number of stages of the parts.
const STAGES: usize = 8;

/// The smallest and the largest number of steps before division: at least 2000 nodes, between which no wide feature is
/// missed, and as many sample points between them for the defect. Fast parts of the motion are resolved by the
/// division.
const STEPS: [usize; 2] = [256, 1 << 14];

/// The largest defect of the parts that is tried, and the smallest defect above round-off.
const MISFITS: [f64; 2] = [0.02, 1e-11];

/// The largest number of iterations of the search, each with a finer division.
const ATTEMPTS: usize = 8;

/// Selects steps that are divided where the motion is fast, so that the errors of (q, p) and v are at most the
/// requested error: a division and one with parts of half the size must agree. The error of a part is about the square
/// of its defect, and halving a part divides its defect by `2^s`.
pub(crate) fn divided_steps<'p, L: Lagrangian<N>, const N: usize>(
    trials: &mut TrialRuns<'_, 'p, L, N>,
) -> Result<StepSelection<'p, L, N>, InputError> {
    let (wanted, t0, span) = (trials.wanted, trials.request.problem.t0, trials.request.span);
    let finer = f64::powi(0.5, STAGES as i32);
    let count = first_guess(trials.request, STAGES, wanted).clamp(STEPS[0], STEPS[1]);
    let marks = ComparisonGrid::of(count);
    let mut most_misfit = (0.3 * wanted.sqrt()).min(MISFITS[0]);
    let (mut best, mut before, mut cause) = (f64::INFINITY, f64::NAN, SelectionFailure::Budget);
    let mut coarse: Option<Track<N>> = None;
    for _ in 0..ATTEMPTS {
        let integrator = DividedGauss { stages: STAGES, most_misfit };
        let mut track =
            |most_misfit: f64| match trials.divided(DividedGauss { most_misfit, ..integrator }, count, &marks)? {
                TrialEnd::Followed(track) => Ok(Ok(track)),
                TrialEnd::Halted { part, cause } => Ok(Err(SelectionFailure::Halted { t: t0 + part * span, cause })),
                _ => Ok::<_, InputError>(Err(SelectionFailure::Budget)),
            };
        let first = match coarse.take() {
            Some(track) => Ok(track),
            None => track(most_misfit)?,
        };
        let tracks = match first {
            Ok(first) => track(most_misfit * finer)?.map(|second| (first, second)),
            Err(obstacle) => Err(obstacle),
        };
        let (first, second) = match tracks {
            Ok(tracks) => tracks,
            Err(obstacle) => {
                cause = obstacle;
                break;
            }
        };
        let error = max_or_nan(first.distance(&second), 0.5 * f64::EPSILON);
        // The error of the finer run is smaller than the distance of the two.
        if error <= 0.5 * wanted {
            let (h, error) = (span / count as f64, Some(error));
            return Ok(StepSelection { integrator: Arc::new(integrator), count, h, error, ended: None });
        }
        let distances = first.distances(&second);
        cause = obstacle(&distances, f64::log2(before / error), wanted, t0, span);
        (best, before) = (best.min(error), error);
        most_misfit *= finer;
        if most_misfit < MISFITS[1] {
            break;
        }
        coarse = Some(second);
    }
    Err(InputError::Accuracy { wanted, reached: best, cause })
}
