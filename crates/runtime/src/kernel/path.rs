//! Paths between given ends.

use crate::full::{FULL, not_compiled};
use crate::{BoundaryProblem, FoundPath, RuntimeError};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, Lagrangian, PhasePoint, VelocityPoint, legendre};
use discrete_herglotz::{
    AnyIntegrator, DiscreteLagrangian,
    boundary::{BoundaryPath, CriticalPath, End},
    gauss::Gauss,
    theory::{DiscretePath, legendre_inverse, legendre_minus, legendre_plus},
};
use formula_lagrangian::{Formula, FormulaLagrangian};

/// Searches for a path of a formula. It is compiled for fewer dimensions than motions are: compiling more would cost
/// more than the unused coordinates cost a search.
pub(crate) fn search(formula: &Formula, problem: &BoundaryProblem) -> Result<FoundPath, RuntimeError> {
    match formula.dimension() {
        1 => within::<1>(formula, problem),
        2 => within::<2>(formula, problem),
        3..=4 => within::<4>(formula, problem),
        5..=8 if const { FULL } => within::<8>(formula, problem),
        5..=8 => Err(not_compiled("paths with more coordinates")),
        n => Err(RuntimeError::argument(
            "coordinates",
            format!("are {n}, but paths between two ends are compiled for 1 to 8; write the system in Rust"),
        )),
    }
}

/// The coordinates as a vector of N; the additional components are 0.
fn point<const N: usize>(x: &[f64]) -> SVector<f64, N> {
    SVector::from_fn(|i, _| x.get(i).copied().unwrap_or(0.0))
}

fn within<const N: usize>(formula: &Formula, problem: &BoundaryProblem) -> Result<FoundPath, RuntimeError> {
    let (lagrangian, n) = (formula.lagrangian_within::<N>()?, formula.dimension());
    for (what, end) in [("the start", &problem.ends[0]), ("the end", &problem.ends[1])] {
        if end.len() != n {
            return Err(RuntimeError::Length { what, found: end.len(), expected: n });
        }
    }
    let (t0, t1) = problem.span;
    for (what, value) in [("t0", t0), ("t", t1), ("z0", problem.z0)] {
        if !value.is_finite() {
            return Err(RuntimeError::NotFinite { what: what.into(), value });
        }
    }
    // The minimum is two steps; the error for fewer is raised below.
    let h = (t1 - t0) / problem.steps.max(1) as f64;
    match problem.by {
        AnyIntegrator::Gauss { .. } if formula.has_forces() => Err(RuntimeError::argument(
            "integrator",
            format!(
                "is \"{}\", which has no discrete Lagrangian with forces; choose a rule such as \"midpoint\" or \
                 \"trapezoidal\"",
                problem.by
            ),
        )),
        AnyIntegrator::Gauss { stages } => by(&lagrangian, Gauss::new::<N>(lagrangian.clone(), stages, h)?, problem),
        AnyIntegrator::Discrete(method) => {
            // The discrete Lagrangian of a splitting is determined at a state.
            let start = VelocityPoint { q: point(&problem.ends[0]), v: SVector::zeros(), z: problem.z0 };
            let state = legendre(&lagrangian, t0, &start);
            by(&lagrangian, method.discretise::<N, _>(lagrangian.clone(), h, t0, &state)?, problem)
        }
        other => Err(RuntimeError::argument(
            "integrator",
            format!(
                "is \"{other}\", which has no discrete Lagrangian as a function of both ends of a step; choose {}",
                if formula.has_forces() {
                    "a rule such as \"midpoint\" or \"trapezoidal\""
                } else {
                    "a Gauss method such as \"gauss_4\", or \"midpoint\""
                }
            ),
        )),
    }
}

/// Searches with a discrete Lagrangian.
fn by<D: DiscreteLagrangian<N>, const N: usize>(
    lagrangian: &FormulaLagrangian<N>,
    ld: D,
    problem: &BoundaryProblem,
) -> Result<FoundPath, RuntimeError> {
    let (n, t0, h) = (lagrangian.formula().dimension(), problem.span.0, ld.step_size());
    let ends = [0, 1].map(|i| End::Position(point(&problem.ends[i])));
    let mut path = BoundaryPath::new(&ld, problem.steps, ends)?.starting_at(t0, problem.z0)?;
    if let Some(guess) = &problem.guess {
        let points = guess.chunks_exact(n).map(point).collect();
        path = path.from_path(DiscretePath::new(points)?)?;
    }
    let found = path.search();
    // The final time is exact.
    let time = |k: usize| if k == problem.steps { problem.span.1 } else { t0 + k as f64 * h };
    let momenta = momenta(&ld, t0, h, &found);
    let velocities = velocities(lagrangian, h, &time, &found, &momenta);
    let rows = |points: &[SVector<f64, N>]| points.iter().flat_map(|x| x.iter().take(n).copied()).collect();
    Ok(FoundPath {
        t: (0..=problem.steps).map(time).collect(),
        q: rows(&found.points),
        v: rows(&velocities),
        p: rows(&momenta),
        z: found.actions.clone(),
        status: found.status,
        residual: found.residual,
        log_factor: found.log_factor,
        regularity: found.regularity,
        error_estimate: found.error_estimate,
        unresolved: found.unresolved,
        iterations: found.iterations,
    })
}

/// The momenta at the points, by the discrete Legendre transformation of the step before each point, and of the first
/// step at the first point. NaN where they are not defined.
fn momenta<D: DiscreteLagrangian<N>, const N: usize>(
    ld: &D,
    t0: f64,
    h: f64,
    path: &CriticalPath<N>,
) -> Vec<SVector<f64, N>> {
    let step = |k: usize| {
        Some((
            t0 + k as f64 * h,
            DiscretePoint { q0: *path.points.get(k)?, q1: *path.points.get(k + 1)?, z0: *path.actions.get(k)? },
        ))
    };
    let first = step(0).and_then(|(t, x)| legendre_minus(ld, t, &x).ok()).map(|state| state.p);
    let others = (0..path.points.len().saturating_sub(1))
        .map(|k| step(k).and_then(|(t, x)| legendre_plus(ld, t, &x).ok()).map(|state| state.p));
    std::iter::once(first).chain(others).map(|p| p.unwrap_or_else(|| SVector::repeat(f64::NAN))).collect()
}

/// The velocities that correspond to the momenta.
fn velocities<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    h: f64,
    time: &dyn Fn(usize) -> f64,
    path: &CriticalPath<N>,
    momenta: &[SVector<f64, N>],
) -> Vec<SVector<f64, N>> {
    let of = |(k, p): (usize, &SVector<f64, N>)| {
        let (q, z) = (*path.points.get(k)?, *path.actions.get(k)?);
        // The mean velocity of the preceding step is a good initial guess; at the first point that of the first step.
        let (a, b) = (path.points.get(k.saturating_sub(1))?, path.points.get(k.max(1))?);
        let x = legendre_inverse(lagrangian, time(k), &PhasePoint { q, p: *p, z }, &((b - a) / h)).ok()?;
        Some(x.v)
    };
    momenta.iter().enumerate().map(|x| of(x).unwrap_or_else(|| SVector::repeat(f64::NAN))).collect()
}
