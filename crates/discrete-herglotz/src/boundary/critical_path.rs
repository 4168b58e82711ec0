//! The result of a search for a critical path.

use super::block_elimination::{Measured, Nodes};
use super::path_check::PathCheck;
use crate::{StepError, UnresolvedStep, theory::DiscretePath};
use contact_geom::nalgebra::SVector;

/// How the search for a critical path ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathStatus {
    /// The path satisfies the discrete Herglotz equations, with their forces, to round-off. An
    /// [unresolved step](CriticalPath::unresolved) indicates that it may not approximate a motion.
    Found,
    /// The search did not converge within the limit of iterations.
    NotConverged,
    /// No correction reduces the residual. There may be no critical path nearby, as beyond a fold, where two paths have
    /// met and vanished; [`branch`](crate::boundary::branch) locates folds.
    Stalled,
    /// The ends are conjugate along the path, to round-off: the linearised equations have no unique solution.
    Conjugate {
        /// The smallest pivot of the last block of the equations, relative to its size before the elimination.
        regularity: f64,
    },
    /// The discrete Lagrangian is not defined at a step of the path.
    Undefined {
        /// The step, counted from 0.
        step: usize,
        /// The reason.
        cause: StepError,
    },
    /// The path satisfies the equations, but is not conformally contact: a `sigma_d` is not positive.
    SigmaVanished {
        /// The step, counted from 0.
        step: usize,
        /// The value of sigma_d.
        sigma: f64,
    },
}

impl std::fmt::Display for PathStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            PathStatus::Found => write!(f, "found"),
            PathStatus::NotConverged => {
                write!(f, "not converged: start from a closer path, for example by continuation")
            }
            PathStatus::Stalled => write!(
                f,
                "stalled: no correction reduces the residual, so that there may be no critical path nearby; start \
                 from another path"
            ),
            PathStatus::Conjugate { regularity } => write!(
                f,
                "the ends are conjugate along the path (relative pivot {regularity:e}): change the ends or the span"
            ),
            PathStatus::Undefined { step, cause } => write!(f, "the path is not defined in step {step}: {cause}"),
            PathStatus::SigmaVanished { step, sigma } => {
                write!(f, "sigma_d = {sigma} in step {step}, but it must be positive: take smaller steps")
            }
        }
    }
}

/// The last path of a search, with its status; it is a critical path of the discrete action if that is
/// [`PathStatus::Found`].
#[derive(Clone, Debug, PartialEq)]
pub struct CriticalPath<const N: usize> {
    /// How the search ended.
    pub status: PathStatus,
    /// The points `q_0, ..., q_N`.
    pub points: Vec<SVector<f64, N>>,
    /// The actions `z_0, ..., z_N`.
    pub actions: Vec<f64>,
    /// The largest residual of a discrete Herglotz equation or of a boundary condition, a momentum; infinite where the
    /// path is not defined.
    pub residual: f64,
    /// The largest residual relative to the size of the terms of its equation.
    pub relative_residual: f64,
    /// `ln(sigma_1 ... sigma_N)`, the logarithm of the conformal factor of the whole path; not finite unless all are
    /// positive.
    pub log_factor: f64,
    /// The smallest pivot of the last block of the linearised equations, relative to its size before the elimination.
    /// Its reciprocal is the amplification of errors in the last unknown position. 0 where a pivot vanishes or nothing
    /// was measured.
    pub regularity: f64,
    /// The first-order estimate of the effect of the local truncation error on the path, in units of the range of the
    /// path. It uses the inverse of the last Jacobian, so that it is of order one where the ends are conjugate to
    /// within the error of the steps. Available for found paths of a discrete Lagrangian of
    /// [order](crate::DiscreteLagrangian::order) two, and of order one without forces.
    pub error_estimate: Option<f64>,
    /// The first unresolved step, as in a run with the same discrete Lagrangian; otherwise the step with the largest
    /// error estimate, if that exceeds a quarter. Such a path may be far from every motion: it may cross a centre of
    /// force between its points, or its ends may be conjugate. Only for found paths.
    pub unresolved: Option<UnresolvedStep>,
    /// The number of corrections, from all initial paths.
    pub iterations: u32,
}

impl<const N: usize> CriticalPath<N> {
    /// Whether the path is critical, to round-off.
    pub fn is_found(&self) -> bool {
        self.status == PathStatus::Found
    }

    /// The discrete action `A_d(q_d, z_0) = z_N`.
    pub fn action(&self) -> f64 {
        self.actions.last().copied().unwrap_or(f64::NAN)
    }

    /// The path in Q.
    ///
    /// # Errors
    /// [`InputError`](crate::InputError) where a point is not finite, which does not occur for a found path.
    pub fn path(&self) -> Result<DiscretePath<N>, crate::InputError> {
        DiscretePath::new(self.points.clone())
    }

    /// The last path of a search, before it is measured.
    pub(super) fn ended(status: PathStatus, nodes: Nodes<N>, iterations: u32) -> Self {
        CriticalPath {
            status,
            points: nodes.q,
            actions: nodes.z,
            residual: f64::INFINITY,
            relative_residual: f64::INFINITY,
            log_factor: f64::NAN,
            regularity: 0.0,
            error_estimate: None,
            unresolved: None,
            iterations,
        }
    }

    pub(super) fn measured(self, measured: &Measured<N>) -> Self {
        CriticalPath {
            residual: measured.residual,
            relative_residual: measured.relative,
            log_factor: measured.log_factor,
            regularity: measured.regularity,
            ..self
        }
    }

    pub(super) fn with_check(self, PathCheck { unresolved, error_estimate }: PathCheck) -> Self {
        CriticalPath { unresolved, error_estimate, ..self }
    }
}
