//! A path that was found, and how the search for it ended.

use super::block_elimination::{Measured, Nodes};
use super::judge::Judgement;
use crate::{StepError, UnresolvedStep, theory::DiscretePath};
use contact_geom::nalgebra::SVector;

/// How the search for a critical path ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathStatus {
    /// The path satisfies the discrete Herglotz equations to round-off; whether it is near a motion its
    /// [unresolved step](CriticalPath::unresolved) tells.
    Found,
    /// The iterations were used up.
    NotConverged,
    /// No correction lessens the residual: there may be no critical path near, as beyond a fold, where two paths have met and vanished;
    /// [`branch`](crate::boundary::branch) finds it.
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
        /// Why.
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
                write!(f, "not converged: start from a path that is nearer, as by continuation")
            }
            PathStatus::Stalled => write!(
                f,
                "stalled: no correction lessens the residual; there may be no critical path near, start from another one"
            ),
            PathStatus::Conjugate { regularity } => write!(
                f,
                "the ends are conjugate along the path (relative pivot {regularity:e}): change the ends or the span"
            ),
            PathStatus::Undefined { step, cause } => write!(f, "the path is not defined in step {step}: {cause}"),
            PathStatus::SigmaVanished { step, sigma } => {
                write!(f, "sigma_d = {sigma} in step {step}, where it must be positive: take smaller steps")
            }
        }
    }
}

/// The last path of a search, with its status; a critical path of the discrete action where that is [`PathStatus::Found`].
#[derive(Clone, Debug, PartialEq)]
pub struct CriticalPath<const N: usize> {
    /// How the search ended.
    pub status: PathStatus,
    /// The points `q_0, ..., q_N`.
    pub points: Vec<SVector<f64, N>>,
    /// The actions `z_0, ..., z_N`.
    pub actions: Vec<f64>,
    /// The largest residual of a discrete Herglotz equation or of an end's condition, a momentum; infinite where the path is not
    /// defined.
    pub residual: f64,
    /// The largest residual relative to the size of the terms of its equation.
    pub relative_residual: f64,
    /// `ln(sigma_1 ... sigma_N)`, the logarithm of the conformal factor of the whole path; not a number unless all are positive.
    pub log_factor: f64,
    /// The smallest pivot of the last block of the linearised equations, relative to its size before the elimination: the reciprocal of it is how
    /// much the last unknown position is magnified. 0 where a pivot vanishes or nothing was measured.
    pub regularity: f64,
    /// By how much what the steps leave out moves the path, to first order and in units of its range: by the inverse of the last Jacobian, so that it
    /// is of order one where the ends are conjugate to within the error of the steps. Of found paths, by a discrete Lagrangian of
    /// [order](crate::DiscreteLagrangian::order) one or two.
    pub error_estimate: Option<f64>,
    /// The first step that cannot have resolved the motion, as of a run of the same discrete Lagrangian; or else the one where the error
    /// estimate is largest, if that is above a quarter. The path may then be far from every motion: it may have crossed a centre of force
    /// without meeting it, or its ends be conjugate. Of found paths only.
    pub unresolved: Option<UnresolvedStep>,
    /// The corrections that were made, from all starts.
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
    /// [`InputError`](crate::InputError) where a point is not finite, which no found path has.
    pub fn path(&self) -> Result<DiscretePath<N>, crate::InputError> {
        DiscretePath::new(self.points.clone())
    }

    /// The last path of a search, nothing of it measured.
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

    pub(super) fn judged(self, Judgement { unresolved, error_estimate }: Judgement) -> Self {
        CriticalPath { unresolved, error_estimate, ..self }
    }
}
