//! Discrete boundary value problems: paths between given ends.

use discrete_herglotz::{AnyIntegrator, UnresolvedStep, boundary::PathStatus};

/// A discrete boundary value problem: find a path between two positions that is critical for the discrete action of
/// Herglotz' principle. With forces it satisfies the discrete Lagrange-d'Alembert-Herglotz equations; these are the
/// forces of a quadrature rule, since a Gauss method has no discrete Lagrangian with forces.
///
/// ```
/// use herglotz_runtime::{AnyIntegrator, BoundaryProblem, System};
/// let system = System::parse("x'^2/2 - x^2/2 + gamma*z", &["x"], &[("gamma", -0.2)])?;
/// let by = AnyIntegrator::Gauss { stages: 4 };
/// let found = system.path(&BoundaryProblem::new([vec![0.0], vec![1.0]], (0.0, 2.0), by, 40))?;
/// assert!(found.is_found());
/// println!("it starts with the velocity {}, and has the action {}", found.v[0], found.action());
/// # Ok::<(), herglotz_runtime::RuntimeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BoundaryProblem {
    /// The positions at the start and at the end.
    pub ends: [Vec<f64>; 2],
    /// The times of the start and of the end.
    pub span: (f64, f64),
    /// The action at the start.
    pub z0: f64,
    /// The integrator whose discrete Lagrangian is used.
    pub by: AnyIntegrator,
    /// The number of steps, all of the same length.
    pub steps: usize,
    /// The points of the initial guess, point by point; the straight line where it is `None`.
    pub guess: Option<Vec<f64>>,
}

impl BoundaryProblem {
    /// A path between two positions over a time span, starting from the straight line and with initial action 0.
    pub fn new(ends: [Vec<f64>; 2], span: (f64, f64), by: AnyIntegrator, steps: usize) -> Self {
        BoundaryProblem { ends, span, z0: 0.0, by, steps, guess: None }
    }
}

/// The last path of a search, with measures of its quality. Vectors are stored point by point.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundPath {
    /// The times of the points.
    pub t: Vec<f64>,
    /// The positions.
    pub q: Vec<f64>,
    /// The velocities that correspond to the momenta; NaN where there is none.
    pub v: Vec<f64>,
    /// The momenta; NaN where they are not defined, which does not happen along a path that was found.
    pub p: Vec<f64>,
    /// The actions.
    pub z: Vec<f64>,
    /// How the search ended, with advice where no path was found.
    pub status: PathStatus,
    /// The largest residual of a discrete Herglotz equation, in units of momentum.
    pub residual: f64,
    /// The logarithm of the conformal factor of the whole path.
    pub log_factor: f64,
    /// The smallest pivot of the last linearised equations, relative to its size before the elimination: small where
    /// the ends are nearly conjugate.
    pub regularity: f64,
    /// The estimated displacement of the path by the truncation error of the steps, in units of its range. It is known
    /// for discrete Lagrangians of order one or two.
    pub error_estimate: Option<f64>,
    /// The reason why a path that was found may be far from every motion: its steps do not resolve the motion, or its
    /// ends are conjugate to within the truncation error.
    pub unresolved: Option<UnresolvedStep>,
    /// The number of corrections that were made.
    pub iterations: u32,
}

impl FoundPath {
    /// Whether the path satisfies its equations, to round-off.
    pub fn is_found(&self) -> bool {
        self.status == PathStatus::Found
    }

    /// The action of the whole path.
    pub fn action(&self) -> f64 {
        match self.z.as_slice() {
            [first, .., last] => last - first,
            _ => f64::NAN,
        }
    }
}
