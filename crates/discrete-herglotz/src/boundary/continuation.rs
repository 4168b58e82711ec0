//! Natural continuation: each path is the initial guess for the next problem.

use super::critical_path::CriticalPath;
use super::problem::BoundaryPath;
use crate::{DiscreteLagrangian, InputError, theory::DiscretePath};
use contact_geom::nalgebra::SVector;

/// Solves a sequence of problems, each from the path of the previous one: continuation in a parameter of the
/// Lagrangian, in the step, the number of steps or the ends. The first problem starts from its own initial path. For
/// paths that end in a fold see [`branch`](crate::boundary::branch).
///
/// Returns the paths that were found, in the order of the problems. Where a search fails, its path is the last one,
/// with another status, and the remaining problems are not solved.
///
/// # Errors
/// [`InputError`] where a problem cannot start from the previous path, which happens only for a path that is not
/// finite.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use discrete_herglotz::{boundary::{BoundaryPath, End, continuation}, rules::Rule};
///
/// // The same span with more and more steps.
/// let ends = [End::Position([0.0].into()), End::Position([1.0].into())];
/// let problem = |n: usize| BoundaryPath::new(Rule::MIDPOINT.of(Pendulum { gamma: -0.1 }, 2.0 / n as f64)?, n, ends);
/// let found = continuation([problem(10)?, problem(100)?, problem(1000)?])?;
/// assert!(found.len() == 3 && found[2].is_found());
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub fn continuation<D: DiscreteLagrangian<N>, const N: usize>(
    problems: impl IntoIterator<Item = BoundaryPath<D, N>>,
) -> Result<Vec<CriticalPath<N>>, InputError> {
    let mut paths: Vec<CriticalPath<N>> = Vec::new();
    for problem in problems {
        let problem = match paths.last() {
            Some(last) if !last.is_found() => break,
            Some(last) => {
                let start = DiscretePath::new(resampled(&last.points, problem.steps()))?;
                problem.from_path(start)?
            }
            None => problem,
        };
        paths.push(problem.search());
    }
    Ok(paths)
}

/// A path interpolated linearly to another number of steps.
fn resampled<const N: usize>(points: &[SVector<f64, N>], steps: usize) -> Vec<SVector<f64, N>> {
    let from = points.len() - 1;
    let at = |k: usize| {
        let place = k as f64 * from as f64 / steps as f64;
        let before = (place as usize).min(from - 1);
        let part = place - before as f64;
        points[before] * (1.0 - part) + points[before + 1] * part
    };
    (0..=steps).map(at).collect()
}
