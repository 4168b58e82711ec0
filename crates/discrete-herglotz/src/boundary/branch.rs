//! Pseudo-arclength continuation: a branch of critical paths along a parameter, past its folds.

use super::block_elimination::BlockElimination;
use super::critical_path::CriticalPath;
use super::deflation::square;
use super::problem::BoundaryPath;
use crate::{DiscreteLagrangian, InputError, theory::DiscretePath};
use contact_geom::GeometryError;
use contact_geom::nalgebra::SVector;

/// The largest number of corrections for a point of a branch; with more the step is halved: convergence is quadratic,
/// so that a point near the predicted one needs four.
const MAX_CORRECTIONS: u32 = 8;

/// The cosine of the angle between neighbouring tangents, 26 degrees, below which the step is halved. A larger angle
/// indicates a corner or another branch.
const MIN_TANGENT_COSINE: f64 = 0.9;

/// The shortest step, relative to the first one: the branch ends where twenty halvings find no further path.
const MIN_STEP_RATIO: f64 = 1e-6;

/// The factor by which the step grows after each path: less than the two by which it is halved, so that a step that
/// fails is not tried again at once.
const STEP_GROWTH: f64 = 1.3;

/// A point of a branch, or a direction: the positions of a path and a parameter. The inner product of the positions is
/// the mean over the points, so that it does not depend on the number of steps.
#[derive(Clone)]
struct Extended<const N: usize> {
    q: Vec<SVector<f64, N>>,
    parameter: f64,
}

impl<const N: usize> Extended<N> {
    fn dot(&self, other: &Self) -> f64 {
        let sum: f64 = self.q.iter().zip(&other.q).map(|(a, b)| a.dot(b)).sum();
        sum / self.q.len() as f64 + self.parameter * other.parameter
    }

    /// Adds a multiple of another.
    fn add(&mut self, other: &Self, factor: f64) {
        for (q, dq) in self.q.iter_mut().zip(&other.q) {
            *q += dq * factor;
        }
        self.parameter += other.parameter * factor;
    }
}

/// The root mean square distance of two paths.
fn distance<const N: usize>(a: &[SVector<f64, N>], b: &[SVector<f64, N>]) -> f64 {
    square(a, b).sqrt()
}

/// Newton's correction at a path, and its derivative in the parameter, which at a path of the branch is the derivative
/// of the branch.
struct Corrections<const N: usize> {
    change: Vec<SVector<f64, N>>,
    slope: Vec<SVector<f64, N>>,
}

/// Follows a branch of critical paths along a parameter of the problem (of the Lagrangian, the ends or the step) by
/// pseudo-arclength continuation: Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems" (1977).
/// A fold, where two paths meet and vanish as the parameter changes, is passed like any other point.
///
/// `problem` returns the problem for a parameter; all have the same number of steps. The branch starts at the path that
/// the search finds for `range[0]`, and the parameter first changes toward `range[1]` by about `step`. The branch ends
/// where the parameter leaves the range, with a last path at that end of the range (at `range[0]` again after a fold),
/// after `most` paths, or where no further path is found with ever smaller steps.
///
/// Returns the paths in the order of the branch, each with its parameter. All of them are found, except that a first
/// path that is not found is returned alone.
///
/// # Errors
/// [`GeometryError::NonFinite`] for a range that is not finite, [`InputError::Span`] for an empty range,
/// [`InputError::Step`] unless the step is positive and finite, [`InputError::Count`] for `most < 2`,
/// [`InputError::PathLength`] where the number of steps changes, and those of `problem`.
///
/// ```
/// use contact_geom::{Lagrangian, Scalar, nalgebra::SVector};
/// use discrete_herglotz::{boundary::{BoundaryPath, End, branch}, rules::Rule};
///
/// // Bratu's problem q'' = -lambda e^q has two paths below lambda = 3.5138, and none above.
/// struct Bratu(f64);
/// impl Lagrangian<1> for Bratu {
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
///         v[0] * v[0] * 0.5 - q[0].exp() * self.0
///     }
/// }
/// let ends = [End::Position([0.0].into()); 2];
/// let problem = |lambda: f64| BoundaryPath::new(Rule::MIDPOINT.of(Bratu(lambda), 0.01)?, 100, ends);
/// let paths = branch(problem, [3.0, 4.0], 0.1, 100)?;
/// let (first, last) = (&paths[0], &paths[paths.len() - 1]);
/// assert!(first.0 == 3.0 && last.0 == 3.0 && last.1.points[50][0] > 2.0 * first.1.points[50][0]);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub fn branch<D: DiscreteLagrangian<N>, const N: usize>(
    problem: impl Fn(f64) -> Result<BoundaryPath<D, N>, InputError>,
    range: [f64; 2],
    step: f64,
    most: usize,
) -> Result<Vec<(f64, CriticalPath<N>)>, InputError> {
    if let Some((index, &value)) = range.iter().enumerate().find(|(_, end)| !end.is_finite()) {
        return Err(GeometryError::NonFinite { what: "the range of the parameter", index, value }.into());
    }
    let span = range[1] - range[0];
    if !(span != 0.0 && span.is_finite()) {
        return Err(InputError::Span { span });
    }
    if !(step > 0.0 && step.is_finite()) {
        return Err(InputError::Step { h: step });
    }
    if most < 2 {
        return Err(InputError::Count { what: "the number of paths of the branch", least: 2, found: most });
    }
    let first = problem(range[0])?;
    let mut follower = Follower { problem, steps: first.steps(), difference: span.abs() * f64::EPSILON.cbrt() };
    let found = first.search();
    if !found.is_found() {
        return Ok(vec![(range[0], found)]);
    }
    let mut at = Extended { q: found.points.clone(), parameter: range[0] };
    let mut paths = vec![(range[0], found)];
    let Some(mut tangent) = follower.tangent(&at, None)? else { return Ok(paths) };
    if tangent.parameter * span < 0.0 {
        let back = tangent.clone();
        tangent.add(&back, -2.0);
    }
    // The first step changes the parameter by `step`, or less where the range is shorter.
    let first_length = step.min(span.abs()) / tangent.parameter.abs();
    let mut length = first_length;
    while paths.len() < most && length > MIN_STEP_RATIO * first_length {
        let Some((next, direction)) = follower.next(&at, &tangent, length)? else {
            length *= 0.5;
            continue;
        };
        let inside = (next.parameter - range[0]) * (range[1] - next.parameter) >= 0.0;
        let (mut parameter, mut start) = (next.parameter, next.clone());
        if !inside {
            // The path at the end of the range lies between this point and the previous one.
            parameter = if (next.parameter - range[0]) * span < 0.0 { range[0] } else { range[1] };
            let beyond = (next.parameter - parameter) / (next.parameter - at.parameter);
            start.add(&next, -beyond);
            start.add(&at, beyond);
        }
        let found = follower.search(parameter, &start)?.filter(|found| distance(&found.points, &start.q) <= length);
        let Some(found) = found else {
            length *= 0.5;
            continue;
        };
        paths.push((parameter, found));
        if !inside {
            break;
        }
        (at, tangent) = (next, direction);
        length *= STEP_GROWTH;
    }
    Ok(paths)
}

/// Data for following a branch.
struct Follower<F> {
    problem: F,
    steps: usize,
    /// The increment of the parameter for difference quotients.
    difference: f64,
}

impl<F> Follower<F> {
    fn of<D: DiscreteLagrangian<N>, const N: usize>(&self, parameter: f64) -> Result<BoundaryPath<D, N>, InputError>
    where
        F: Fn(f64) -> Result<BoundaryPath<D, N>, InputError>,
    {
        let problem = (self.problem)(parameter)?;
        if problem.steps() != self.steps {
            return Err(InputError::PathLength { expected: self.steps, found: problem.steps() });
        }
        Ok(problem)
    }

    /// The path at a parameter near a point of the branch.
    fn search<D: DiscreteLagrangian<N>, const N: usize>(
        &self,
        parameter: f64,
        near: &Extended<N>,
    ) -> Result<Option<CriticalPath<N>>, InputError>
    where
        F: Fn(f64) -> Result<BoundaryPath<D, N>, InputError>,
    {
        let found = self.of(parameter)?.from_path(DiscretePath::new(near.q.clone())?)?.search();
        Ok(found.is_found().then_some(found))
    }

    /// Newton's correction of a path at a parameter; `None` where it is not defined.
    fn correction<D: DiscreteLagrangian<N>, const N: usize>(
        &self,
        q: &[SVector<f64, N>],
        parameter: f64,
    ) -> Result<Option<Vec<SVector<f64, N>>>, InputError>
    where
        F: Fn(f64) -> Result<BoundaryPath<D, N>, InputError>,
    {
        let problem = self.of(parameter)?;
        let equations = problem.equations();
        let mut nodes = problem.nodes(problem.moved(q.to_vec()));
        let mut elimination = BlockElimination::new(&equations);
        let Ok(measured) = elimination.forward(&equations, &mut nodes) else { return Ok(None) };
        if measured.regularity.is_nan() || measured.regularity <= 0.0 {
            return Ok(None);
        }
        let mut change = nodes.q.clone();
        elimination.backward(&equations, &nodes.q, &mut change);
        // The difference from the given path includes the motion of the prescribed ends.
        for (to, q) in change.iter_mut().zip(q) {
            *to -= q;
        }
        Ok(Some(change))
    }

    fn corrections<D: DiscreteLagrangian<N>, const N: usize>(
        &self,
        at: &Extended<N>,
    ) -> Result<Option<Corrections<N>>, InputError>
    where
        F: Fn(f64) -> Result<BoundaryPath<D, N>, InputError>,
    {
        let Some(change) = self.correction(&at.q, at.parameter)? else { return Ok(None) };
        let Some(mut slope) = self.correction(&at.q, at.parameter + self.difference)? else { return Ok(None) };
        for (slope, dq) in slope.iter_mut().zip(&change) {
            *slope = (*slope - dq) / self.difference;
        }
        Ok(Some(Corrections { change, slope }))
    }

    /// The unit tangent of the branch at a point, oriented like the previous tangent.
    fn tangent<D: DiscreteLagrangian<N>, const N: usize>(
        &self,
        at: &Extended<N>,
        before: Option<&Extended<N>>,
    ) -> Result<Option<Extended<N>>, InputError>
    where
        F: Fn(f64) -> Result<BoundaryPath<D, N>, InputError>,
    {
        let Some(Corrections { slope, .. }) = self.corrections(at)? else { return Ok(None) };
        let tangent = Extended { q: slope, parameter: 1.0 };
        let size = tangent.dot(&tangent).sqrt();
        let sense = if before.is_some_and(|before| before.dot(&tangent) < 0.0) { -1.0 } else { 1.0 };
        let factor = sense / size;
        if !(factor.is_finite() && factor != 0.0) {
            return Ok(None);
        }
        let q = tangent.q.iter().map(|dq| dq * factor).collect();
        Ok(Some(Extended { q, parameter: factor }))
    }

    /// The point of the branch whose difference from `at` has the component `length` along the tangent, and the tangent
    /// there; `None` where it is not found.
    fn next<D: DiscreteLagrangian<N>, const N: usize>(
        &mut self,
        at: &Extended<N>,
        tangent: &Extended<N>,
        length: f64,
    ) -> Result<Option<(Extended<N>, Extended<N>)>, InputError>
    where
        F: Fn(f64) -> Result<BoundaryPath<D, N>, InputError>,
    {
        let mut x = at.clone();
        x.add(tangent, length);
        for _ in 0..MAX_CORRECTIONS {
            let Some(Corrections { change, slope }) = self.corrections(&x)? else { return Ok(None) };
            // The correction `change + slope dparameter` that is orthogonal to the tangent. The error of `slope` is of
            // first order in `change`, and its product with `dparameter` of second order.
            let change = Extended { q: change, parameter: 0.0 };
            let slope = Extended { q: slope, parameter: 1.0 };
            let along = -tangent.dot(&change) / tangent.dot(&slope);
            if !along.is_finite() {
                return Ok(None);
            }
            x.add(&change, 1.0);
            x.add(&slope, along);
            let (mut whole, size) = (change, x.dot(&x).sqrt());
            whole.add(&slope, along);
            if whole.dot(&whole).sqrt() <= f64::EPSILON.sqrt() * size {
                let Some(direction) = self.tangent(&x, Some(tangent))? else { return Ok(None) };
                return Ok((direction.dot(tangent) >= MIN_TANGENT_COSINE).then_some((x, direction)));
            }
        }
        Ok(None)
    }
}
