//! The boundary-value problem of the discrete Herglotz principle.

use super::block_elimination::{Equations, Nodes};
use super::critical_path::CriticalPath;
use super::deflation::{Deflation, square};
use super::end::{Conditions, End};
use super::index::inertia;
use super::newton::search;
use crate::{DiscreteLagrangian, InputError, theory::DiscretePath};
use contact_geom::GeometryError;
use contact_geom::nalgebra::SVector;

/// The discrete Herglotz principle as a boundary-value problem: find the path `q_0, ..., q_N` that is critical for the
/// discrete action `z_N`, where `z_{k+1} = z_k + L_d(q_k, q_{k+1}, z_k)`; paper, section 3.
///
/// The unknowns are all positions and actions. They satisfy the recursion of the action, the discrete Herglotz
/// equations `D1 L_d(q_k, q_{k+1}, z_k) + sigma_d D2 L_d(q_{k-1}, q_k, z_{k-1}) = 0` at the interior points, and the
/// condition of an [`End`] at each end. They are found by Newton's method with a line search; the linear systems are
/// solved by block elimination at a cost proportional to the number of steps.
///
/// With [discrete forces](DiscreteLagrangian::forces) F- and F+ the equations are those of `D1 L_d + F-` and `D2 L_d +
/// F+`, by the discrete Lagrange-d'Alembert-Herglotz principle. The path is then not critical for the action, and has no
/// [index](Self::index).
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use discrete_herglotz::{boundary::{BoundaryPath, End}, rules::Rule};
///
/// // From rest position to 1 in time 2, by 200 steps.
/// let ld = Rule::MIDPOINT.of(Pendulum { gamma: -0.1 }, 0.01)?;
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

/// The largest number of initial paths next to known ones in a search: both sides of four arcs of one path.
const MAX_RESTARTS: usize = 8;

/// The distance of two paths, in units of the deflation length, at which they coincide: there the deflated residual is
/// a million times the residual.
const MAX_COINCIDENCE: f64 = 1e-3;

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
    /// [`InputError::Dimension`] for `N = 0`, [`InputError::TooMany`] for more steps than there is memory for.
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

    /// The problem of a periodic path without given positions: `q_N = q_0 + shift` (for example by full turns of an
    /// angle) and `p_N = p_0`. The action is not periodic, so that the state repeats in position and momentum only.
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
        check_memory::<N>(steps, conditions.is_periodic())?;
        Ok(BoundaryPath { ld, steps, conditions, t0: 0.0, z0: 0.0, from: None, known: Vec::new(), length: 1.0 })
    }

    /// The same with this initial time and action.
    ///
    /// # Errors
    /// [`GeometryError::NonFinite`].
    pub fn starting_at(self, t0: f64, z0: f64) -> Result<Self, InputError> {
        finite("(t0, z0)", &SVector::from([t0, z0]))?;
        Ok(BoundaryPath { t0, z0, ..self })
    }

    /// The same with an initial path for the search in place of the straight line. Its ends are moved to the given
    /// positions.
    ///
    /// # Errors
    /// [`InputError::PathLength`] unless it has as many steps as the problem.
    pub fn from_path(self, path: DiscretePath<N>) -> Result<Self, InputError> {
        if path.steps() != self.steps {
            return Err(InputError::PathLength { expected: self.steps, found: path.steps() });
        }
        Ok(BoundaryPath { from: Some(path), ..self })
    }

    /// The same with deflation of known paths, so that the search finds a different one if it succeeds. Deflation acts
    /// within about `length` (a root mean square of coordinates) of each. An initial path that coincides with a known
    /// one is shifted by an arc of this height.
    ///
    /// # Errors
    /// [`InputError::PathLength`] unless each has as many steps as the problem, [`InputError::Tolerance`] unless the
    /// length is positive and finite.
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

    /// Searches for a critical path; the status of the result is [`PathStatus::Found`](super::PathStatus::Found) if it
    /// was found.
    ///
    /// With deflation, a search that fails from its initial path is repeated from paths on both sides of the known
    /// ones.
    pub fn search(&self) -> CriticalPath<N> {
        let deflation = Deflation { known: &self.known, length: self.length };
        let from = |q| search(&self.equations(), self.nodes(q), &deflation);
        let first = from(self.start());
        if first.is_found() {
            return first;
        }
        let mut iterations = first.iterations;
        let shifted = self.known.iter().rev().flat_map(|known| self.arcs().map(move |arc| self.shifted(known, &arc)));
        for start in shifted.take(MAX_RESTARTS) {
            let next = from(start);
            iterations += next.iterations;
            if next.is_found() {
                return CriticalPath { iterations, ..next };
            }
        }
        CriticalPath { iterations, ..first }
    }

    /// The nodes of a path, with all actions set to the initial one.
    pub(super) fn nodes(&self, q: Vec<SVector<f64, N>>) -> Nodes<N> {
        Nodes { q, z: vec![self.z0; self.steps + 1] }
    }

    /// The number of steps.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The index of a critical path of this problem: the number of negative directions of the second variation of the
    /// action.
    ///
    /// This is the number of negative eigenvalues of the Hessian of `A_d` (minus `p_N . q_N` where that momentum is
    /// given) in the free positions. Where `p_0` is given, the initial action varies by `dz_0 = p_0 . dq_0`, so that
    /// the path is critical in `q_0` as well. For `h > 0` and W positive definite the index is 0 for short paths
    /// between given ends, and it grows by the multiplicity of each conjugate point on the path, by the Morse index
    /// theorem: Milnor, "Morse theory" (1963).
    ///
    /// `None` where the index is not defined: for a periodic path, which is not critical for the action in all its
    /// points, for a path with forces, which is not critical for it at all, where a sigma_d is not positive, and where
    /// the second variation is degenerate.
    ///
    /// # Errors
    /// [`InputError::PathLength`] unless the path has as many steps as the problem, [`InputError::Undefined`] where the
    /// discrete Lagrangian is not defined along it.
    pub fn index(&self, path: &CriticalPath<N>) -> Result<Option<usize>, InputError> {
        if path.points.len() != self.steps + 1 || path.actions.len() != self.steps + 1 {
            let found = path.points.len().min(path.actions.len()).saturating_sub(1);
            return Err(InputError::PathLength { expected: self.steps, found });
        }
        let nodes = Nodes { q: path.points.clone(), z: path.actions.clone() };
        let found = inertia(&self.equations(), &nodes).map_err(|_| InputError::Undefined)?;
        Ok(found.and_then(|(negative, vanishing)| (vanishing == 0).then_some(negative)))
    }

    pub(super) fn equations(&self) -> Equations<'_, D, N> {
        Equations { ld: &self.ld, conditions: &self.conditions, t0: self.t0, steps: self.steps, load: &[] }
    }

    /// The initial path of the search, shifted by an arc if it coincides with a known path, where the deflated residual
    /// is singular.
    fn start(&self) -> Vec<SVector<f64, N>> {
        let points = match &self.from {
            Some(path) => self.moved(path.points().to_vec()),
            None => self.straight(),
        };
        if self.known.iter().any(|known| square(&points, known) <= (MAX_COINCIDENCE * self.length).powi(2)) {
            self.shifted(&points, &SVector::from_element(self.length))
        } else {
            points
        }
    }

    /// The heights of arcs on both sides: in all coordinates together, and in each coordinate alone.
    fn arcs(&self) -> impl Iterator<Item = SVector<f64, N>> {
        let together = SVector::from_element(self.length);
        let single =
            (0..if N > 1 { N } else { 0 }).map(|i| SVector::from_fn(|j, _| if i == j { self.length } else { 0.0 }));
        std::iter::once(together).chain(single).flat_map(|arc| [arc, -arc])
    }

    /// A path shifted by a sine arc with fixed ends.
    fn shifted(&self, points: &[SVector<f64, N>], arc: &SVector<f64, N>) -> Vec<SVector<f64, N>> {
        let at = |k: usize| {
            let inside = k > 0 && k < self.steps;
            if inside { (std::f64::consts::PI * k as f64 / self.steps as f64).sin() } else { 0.0 }
        };
        points.iter().enumerate().map(|(k, q)| q + arc * at(k)).collect()
    }

    /// A path with its ends moved to the given positions.
    pub(super) fn moved(&self, mut points: Vec<SVector<f64, N>>) -> Vec<SVector<f64, N>> {
        let (first, mut last) = self.given();
        if let (Some(q), Some(given)) = (points.first_mut(), first) {
            *q = given;
        }
        if let (Conditions::Periodic(shift), Some(q)) = (&self.conditions, points.first()) {
            last = Some(q + shift);
        }
        if let (Some(q), Some(given)) = (points.last_mut(), last) {
            *q = given;
        }
        points
    }

    /// The positions that are given at the ends.
    fn given(&self) -> (Option<SVector<f64, N>>, Option<SVector<f64, N>>) {
        match &self.conditions {
            Conditions::Ends(start, end) => (start.position().copied(), end.position().copied()),
            Conditions::Periodic(_) => (None, None),
        }
    }

    /// The straight line between the ends.
    fn straight(&self) -> Vec<SVector<f64, N>> {
        let (first, last) = self.given();
        let from = first.or(last).unwrap_or_else(SVector::zeros);
        let to = match &self.conditions {
            Conditions::Periodic(shift) => *shift,
            Conditions::Ends(..) => last.unwrap_or(from),
        };
        let at = |k: usize| k as f64 / self.steps as f64;
        // In this form the ends are exact.
        (0..=self.steps).map(|k| from * (1.0 - at(k)) + to * at(k)).collect()
    }
}

/// Returns an error for a path whose search needs more memory than is available, according to the operating system
/// where it reports this, and to a trial allocation.
fn check_memory<const N: usize>(steps: usize, periodic: bool) -> Result<(), InputError> {
    // Positions of the path, the correction, the trial path, the best path and the initial path; momenta and loads of
    // the checks; actions; the eliminated blocks.
    let blocks = if periodic { 2 } else { 1 };
    let reals = 7 * N + 5 + N + blocks * N * N;
    let bytes = reals.saturating_mul(size_of::<f64>());
    // Short paths need no query of the system.
    if steps <= (1 << 26) / bytes {
        return Ok(());
    }
    let most = available_memory() / bytes;
    if steps >= most || Vec::<u8>::new().try_reserve_exact(steps.saturating_mul(bytes)).is_err() {
        let (what, remedy) =
            ("the number of steps of the path", "take longer steps, or use a machine with more memory");
        return Err(InputError::TooMany { what, found: steps as f64, most: most.min(steps - 1) as f64, remedy });
    }
    Ok(())
}

/// The memory in bytes that is available without swapping; the size of the address space where the system does not
/// report it.
fn available_memory() -> usize {
    let reported = || {
        let text = std::fs::read_to_string("/proc/meminfo").ok()?;
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<usize>().ok()?.checked_mul(1024)
    };
    reported().unwrap_or(isize::MAX as usize)
}
