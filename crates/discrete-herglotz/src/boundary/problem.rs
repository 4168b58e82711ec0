//! The boundary-value problem of the discrete Herglotz principle.

use super::critical_path::CriticalPath;
use super::deflation::Deflation;
use super::end::{Conditions, End};
use super::index::inertia;
use super::newton::search;
use super::sweep::{Equations, Nodes};
use crate::{DiscreteLagrangian, DiscretePath, InputError};
use contact_geom::GeometryError;
use contact_geom::nalgebra::SVector;

/// The discrete Herglotz principle as a boundary-value problem: find the path `q_0, ..., q_N` that is critical for the discrete
/// action `z_N`, where `z_{k+1} = z_k + L_d(q_k, q_{k+1}, z_k)`; paper, section 3.
///
/// The unknowns are all positions and actions at once. They satisfy the recursion of the action and, at the interior points, the
/// discrete Herglotz equations `D1 L_d(q_k, q_{k+1}, z_k) + sigma_d D2 L_d(q_{k-1}, q_k, z_{k-1}) = 0`; at each end what an
/// [`End`] says. Newton's method with a line search solves them, each linear system by block elimination at a cost proportional to
/// the number of steps.
///
/// ```
/// use contact_geom::systems::Pendulum;
/// use discrete_herglotz::{BoundaryPath, End, Midpoint};
///
/// // From rest position to 1 in time 2, by 200 steps.
/// let ld = Midpoint::new(Pendulum { gamma: -0.1 }, 0.01)?;
/// let ends = [End::Position([0.0].into()), End::Position([1.0].into())];
/// let found = BoundaryPath::new(ld, 200, ends)?.search();
/// assert!(found.is_found());
/// println!("q_100 = {}, action {}", found.points[100][0], found.action());
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Debug)]
pub struct BoundaryPath<D, const N: usize> {
    ld: D,
    steps: usize,
    conditions: Conditions<N>,
    t0: f64,
    z0: f64,
    from: Option<DiscretePath<N>>,
    known: Vec<Vec<SVector<f64, N>>>,
    length: f64,
}

fn finite<const N: usize>(what: &'static str, x: &SVector<f64, N>) -> Result<(), InputError> {
    match x.iter().enumerate().find(|(_, c)| !c.is_finite()) {
        Some((index, &value)) => Err(GeometryError::NonFinite { what, index, value }.into()),
        None => Ok(()),
    }
}

impl<D: DiscreteLagrangian<N>, const N: usize> BoundaryPath<D, N> {
    /// The problem with a number of steps and a condition at each end; `t_0 = 0` and `z_0 = 0`.
    ///
    /// # Errors
    /// [`InputError::Count`] for fewer than two steps, [`GeometryError::NonFinite`] where an end is not finite,
    /// [`InputError::Dimension`] for `N = 0`.
    pub fn new(ld: D, steps: usize, ends: [End<N>; 2]) -> Result<Self, InputError> {
        for (end, what) in ends.iter().zip(["the condition at the start", "the condition at the end"]) {
            match end {
                End::Position(x) | End::Momentum(x) => finite(what, x)?,
                End::Free => {}
            }
        }
        let [start, end] = ends;
        Self::with(ld, steps, Conditions::Ends(start, end))
    }

    /// The problem of a periodic path, in which no position is given: `q_N = q_0 + shift`, as by whole turns of an angle, and
    /// `p_N = p_0`. The action is shifted by what it is along the path; where forces depend on it, only position and momentum close.
    ///
    /// # Errors
    /// Like those of [`new`](Self::new).
    pub fn periodic(ld: D, steps: usize, shift: SVector<f64, N>) -> Result<Self, InputError> {
        finite("the shift of the positions", &shift)?;
        Self::with(ld, steps, Conditions::Periodic(shift))
    }

    fn with(ld: D, steps: usize, conditions: Conditions<N>) -> Result<Self, InputError> {
        if N == 0 {
            return Err(InputError::Dimension);
        }
        if steps < 2 {
            return Err(InputError::Count { what: "the number of steps of the path", least: 2, found: steps });
        }
        Ok(BoundaryPath { ld, steps, conditions, t0: 0.0, z0: 0.0, from: None, known: Vec::new(), length: 1.0 })
    }

    /// The time and the action of the start.
    ///
    /// # Errors
    /// [`GeometryError::NonFinite`].
    pub fn starting_at(self, t0: f64, z0: f64) -> Result<Self, InputError> {
        finite("the time and the action of the start", &SVector::from([t0, z0]))?;
        Ok(BoundaryPath { t0, z0, ..self })
    }

    /// The path from which the search starts, in place of the straight line. Its ends are moved to where they are given.
    ///
    /// # Errors
    /// [`InputError::PathLength`] unless it has as many steps as the problem.
    pub fn from_path(self, path: DiscretePath<N>) -> Result<Self, InputError> {
        if path.steps() != self.steps {
            return Err(InputError::PathLength { expected: self.steps, found: path.steps() });
        }
        Ok(BoundaryPath { from: Some(path), ..self })
    }

    /// Keeps the search away from known paths, so that it finds another, if it finds one: by deflation, within about `length` (a
    /// root mean square of coordinates) of each. A search that starts at a known path starts beside it.
    ///
    /// # Errors
    /// [`InputError::PathLength`] unless each has as many steps as the problem, [`InputError::Tolerance`] unless the length is
    /// positive and finite.
    pub fn avoiding(self, known: &[&CriticalPath<N>], length: f64) -> Result<Self, InputError> {
        if let Some(path) = known.iter().find(|path| path.points.len() != self.steps + 1) {
            let found = path.points.len().saturating_sub(1);
            return Err(InputError::PathLength { expected: self.steps, found });
        }
        if !(length > 0.0 && length.is_finite()) {
            return Err(InputError::Tolerance { wanted: length });
        }
        Ok(BoundaryPath { known: known.iter().map(|path| path.points.clone()).collect(), length, ..self })
    }

    /// Searches for a critical path; the status says how that ended.
    pub fn search(&self) -> CriticalPath<N> {
        let nodes = Nodes { q: self.start(), z: vec![self.z0; self.steps + 1] };
        search(&self.equations(), nodes, &Deflation { known: &self.known, length: self.length })
    }

    /// The number of steps.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The index of a critical path of this problem: the number of negative directions of the second variation of the action.
    ///
    /// That is the number of negative eigenvalues of the Hessian of `A_d` (minus `p_N . q_N` where that momentum is given) in the
    /// positions that are not given. Where `p_0` is given, the action at the start moves along: `dz_0 = p_0 . dq_0`, so that the path
    /// is critical in `q_0` as well. For `h > 0` and W positive definite it is 0 on short paths between given ends and grows by the
    /// multiplicity of each conjugate point that the path meets: the index theorem of Morse, for which see Milnor, "Morse theory"
    /// (1963). `None` where it is not defined: for a periodic path, which is not critical for the action of all its points, where a
    /// sigma_d is not positive, and where the second variation is degenerate.
    ///
    /// # Errors
    /// [`InputError::PathLength`] unless the path has as many steps as the problem, [`InputError::Undefined`] where the discrete
    /// Lagrangian is not defined along it.
    pub fn index(&self, path: &CriticalPath<N>) -> Result<Option<usize>, InputError> {
        if path.points.len() != self.steps + 1 || path.actions.len() != self.steps + 1 {
            let found = path.points.len().min(path.actions.len()).saturating_sub(1);
            return Err(InputError::PathLength { expected: self.steps, found });
        }
        let nodes = Nodes { q: path.points.clone(), z: path.actions.clone() };
        let found = inertia(&self.equations(), &nodes).map_err(|_| InputError::Undefined)?;
        Ok(found.and_then(|(negative, vanishing)| (vanishing == 0).then_some(negative)))
    }

    fn equations(&self) -> Equations<'_, D, N> {
        Equations { ld: &self.ld, conditions: &self.conditions, t0: self.t0, steps: self.steps }
    }

    /// The path from which the search starts: not a known one, from which nothing leads away.
    fn start(&self) -> Vec<SVector<f64, N>> {
        let mut points = self.undisturbed();
        let near = |known: &Vec<SVector<f64, N>>| {
            let square =
                points.iter().zip(known).map(|(a, b)| (a - b).norm_squared()).sum::<f64>() / points.len() as f64;
            square <= (1e-3 * self.length).powi(2)
        };
        if self.known.iter().any(near) {
            // An arc that leaves the ends where they are.
            for (k, q) in points.iter_mut().enumerate() {
                let arc = (std::f64::consts::PI * k as f64 / self.steps as f64).sin() * self.length;
                if k > 0 && k < self.steps {
                    *q += SVector::from_element(arc);
                }
            }
        }
        points
    }

    /// The user's path, or the straight line.
    fn undisturbed(&self) -> Vec<SVector<f64, N>> {
        let (first, last) = match &self.conditions {
            Conditions::Ends(start, end) => (start.position().copied(), end.position().copied()),
            Conditions::Periodic(_) => (None, None),
        };
        if let Some(path) = &self.from {
            let mut points = path.points().to_vec();
            if let (Some(q), Some(given)) = (points.first_mut(), first) {
                *q = given;
            }
            let last = match (&self.conditions, points.first()) {
                (Conditions::Periodic(shift), Some(q)) => Some(q + shift),
                _ => last,
            };
            if let (Some(q), Some(given)) = (points.last_mut(), last) {
                *q = given;
            }
            return points;
        }
        let from = first.or(last).unwrap_or_else(SVector::zeros);
        let to = match &self.conditions {
            Conditions::Periodic(shift) => *shift,
            Conditions::Ends(..) => last.unwrap_or(from),
        };
        let at = |k: usize| k as f64 / self.steps as f64;
        // Of this form the ends are exact.
        (0..=self.steps).map(|k| from * (1.0 - at(k)) + to * at(k)).collect()
    }
}
