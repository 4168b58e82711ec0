//! Paths between given ends.

use crate::kernel::path;
use crate::{RuntimeError, System};
use discrete_herglotz::{AnyIntegrator, PathStatus, UnresolvedStep};

/// A path between two positions that is to be found: critical for the discrete action of Herglotz' principle.
///
/// ```
/// use runtime_herglotz::{AnyIntegrator, BoundaryProblem, System};
/// let system = System::parse("x'^2/2 - x^2/2 + gamma*z", &["x"], &[("gamma", -0.2)])?;
/// let by = AnyIntegrator::Gauss { stages: 4 };
/// let found = system.path(&BoundaryProblem::new([vec![0.0], vec![1.0]], (0.0, 2.0), by, 40))?;
/// assert!(found.is_found());
/// println!("it starts with the velocity {}, and has the action {}", found.v[0], found.action());
/// # Ok::<(), runtime_herglotz::RuntimeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BoundaryProblem {
    /// The positions at the start and at the end.
    pub ends: [Vec<f64>; 2],
    /// The times there.
    pub span: (f64, f64),
    /// The action at the start.
    pub z0: f64,
    /// Whose discrete Lagrangian it is.
    pub by: AnyIntegrator,
    /// The number of steps, of one length.
    pub steps: usize,
    /// The points from which the search starts, the coordinates of one after those of the other; the straight line where it is `None`.
    pub guess: Option<Vec<f64>>,
}

impl BoundaryProblem {
    /// Between two positions over a time, from the straight line, with an action that starts with 0.
    pub fn new(ends: [Vec<f64>; 2], span: (f64, f64), by: AnyIntegrator, steps: usize) -> Self {
        BoundaryProblem { ends, span, z0: 0.0, by, steps, guess: None }
    }
}

/// The last path of a search, with what it is worth. Of vectors the coordinates of one point follow those of the other.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundPath {
    /// The times of the points.
    pub t: Vec<f64>,
    /// The positions.
    pub q: Vec<f64>,
    /// The velocities that belong to the momenta; not numbers where none do.
    pub v: Vec<f64>,
    /// The momenta; not numbers where they are not defined, as they are along every path that is found.
    pub p: Vec<f64>,
    /// The actions.
    pub z: Vec<f64>,
    /// How the search ended, with what to do where no path was found.
    pub status: PathStatus,
    /// The largest residual of a discrete Herglotz equation, a momentum.
    pub residual: f64,
    /// The logarithm of the conformal factor of the whole path.
    pub log_factor: f64,
    /// The smallest pivot of the last linearised equations, relative to its size: small where the ends are nearly conjugate.
    pub regularity: f64,
    /// By how much the steps move the path, in units of its range, where that is known: by a discrete Lagrangian of order one or two.
    pub error_estimate: Option<f64>,
    /// Why a path that was found may be far from every motion: its steps do not resolve it, or its ends are conjugate to within their error.
    pub unresolved: Option<UnresolvedStep>,
    /// The corrections that were made.
    pub iterations: u32,
}

impl FoundPath {
    /// Whether the path is critical, to round-off.
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

impl System {
    /// Searches for a path between two positions, of a system of one to eight coordinates. That none was found is told by its status.
    ///
    /// # Errors
    /// [`RuntimeError`] for all that is wrong with the problem.
    pub fn path(&self, problem: &BoundaryProblem) -> Result<FoundPath, RuntimeError> {
        path::search(self.formula(), problem)
    }
}
