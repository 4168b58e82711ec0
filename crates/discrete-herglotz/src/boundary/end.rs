//! Boundary conditions of a path.

use contact_geom::nalgebra::SVector;

/// The condition at an end of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End<const N: usize> {
    /// The position is given.
    Position(SVector<f64, N>),
    /// The momentum is given: at the start `p_0` of F-L_d, so that `D1 L_d(q_0, q_1, z_0) + sigma_d p_0 = 0`; at the
    /// end `p_N` of F+L_d, `D2 L_d(q_{N-1}, q_N, z_{N-1}) = p_N`. With
    /// [discrete forces](crate::DiscreteLagrangian::forces), `D1 L_d + F-` and `D2 L_d + F+` are in the place of the
    /// derivatives.
    Momentum(SVector<f64, N>),
    /// The position is free: the natural boundary condition, a vanishing momentum. Without forces the action is critical
    /// in this position.
    Free,
}

impl<const N: usize> End<N> {
    /// The position, where it is given.
    pub(super) fn position(&self) -> Option<&SVector<f64, N>> {
        match self {
            End::Position(q) => Some(q),
            End::Momentum(_) | End::Free => None,
        }
    }

    /// The momentum, where the position is not given.
    pub(super) fn momentum(&self) -> Option<SVector<f64, N>> {
        match self {
            End::Position(_) => None,
            End::Momentum(p) => Some(*p),
            End::Free => Some(SVector::zeros()),
        }
    }
}

/// The boundary conditions of a path, in addition to the discrete Herglotz equations at its interior points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Conditions<const N: usize> {
    /// One condition at each end.
    Ends(End<N>, End<N>),
    /// `q_N = q_0 + shift` and `p_N = p_0`; the action is not periodic.
    Periodic(SVector<f64, N>),
}

impl<const N: usize> Conditions<N> {
    pub(super) fn is_periodic(&self) -> bool {
        matches!(self, Conditions::Periodic(_))
    }

    /// The momenta that are given at the start and at the end.
    pub(super) fn momenta(&self) -> (Option<SVector<f64, N>>, Option<SVector<f64, N>>) {
        match self {
            Conditions::Ends(start, end) => (start.momentum(), end.momentum()),
            Conditions::Periodic(_) => (None, None),
        }
    }
}
