//! The discrete Herglotz equation at a point of a path, with discrete forces, and its linearisation.

use super::elimination::{ActionRow, BlockRows};
use super::step_forces::StepForces;
use crate::DiscreteLagrangian;
use contact_geom::SecondDiscreteJet;
use contact_geom::nalgebra::{SMatrix, SVector};

/// The discrete Herglotz equation at a point, `H = D1 + F- + sigma p` with `p = D2 + F+` of the previous step (or a
/// given momentum), and its derivatives in the position and action of the point and in the next position, at fixed p.
pub(super) struct HerglotzEquation<const N: usize> {
    pub value: SVector<f64, N>,
    /// The sizes of its terms.
    pub size: SVector<f64, N>,
    pub here: SMatrix<f64, N, N>,
    pub action: SVector<f64, N>,
    pub next: SMatrix<f64, N, N>,
}

impl<const N: usize> HerglotzEquation<N> {
    #[inline(always)]
    pub fn new<D: DiscreteLagrangian<N>>(
        p: &SVector<f64, N>,
        (jet, forces): (&SecondDiscreteJet<N>, &StepForces<D, N>),
        neighbour: &SVector<f64, N>,
    ) -> Self {
        let sigma = jet.first.sigma();
        let next = forces.pull_in_q1(jet) + p * jet.d2z.transpose();
        HerglotzEquation {
            value: forces.pull(jet) + p * sigma,
            // Includes the effect of the round-off of the three positions in the equation.
            size: forces.pull_size(jet) + p.abs() * sigma.abs() + next.abs() * neighbour.abs() * 4.0,
            here: forces.pull_in_q0(jet) + p * jet.d1z.transpose(),
            action: forces.pull_in_z(jet) + p * jet.dzz,
            next,
        }
    }

    /// The condition `D2 + F+ = p` at the end of a path.
    pub fn at_end<D: DiscreteLagrangian<N>>(
        p: &SVector<f64, N>,
        (jet, forces): (&SecondDiscreteJet<N>, &StepForces<D, N>),
        neighbour: &SVector<f64, N>,
    ) -> Self {
        let momentum = forces.momentum(jet);
        HerglotzEquation {
            value: momentum - p,
            size: momentum.abs() + p.abs() + forces.momentum_in_q0(jet).abs() * neighbour.abs() * 2.0,
            here: SMatrix::zeros(),
            action: SVector::zeros(),
            next: SMatrix::zeros(),
        }
    }

    /// The linearised equation of point k+1 in the corrections of the positions, by which those of both actions are
    /// expressed. `before` is the jet of step k with its forces, `sigma` the factor of p.
    #[inline(always)]
    pub fn rows<D: DiscreteLagrangian<N>, const PERIODIC: bool>(
        &self,
        (before, forces): (&SecondDiscreteJet<N>, &StepForces<D, N>),
        sigma: f64,
        action: &ActionRow<N>,
        next_action: &ActionRow<N>,
    ) -> BlockRows<N> {
        let by_action = forces.momentum_in_z(before) * sigma;
        let first = if PERIODIC {
            -by_action * action.first.transpose() - self.action * next_action.first.transpose()
        } else {
            SMatrix::zeros()
        };
        BlockRows {
            here: forces.momentum_in_q0(before) * sigma
                - by_action * action.here.transpose()
                - self.action * next_action.here.transpose(),
            next: self.here + forces.momentum_in_q1(before) * sigma
                - by_action * action.next.transpose()
                - self.action * next_action.next.transpose(),
            after: self.next,
            first,
            rhs: -self.value - by_action * action.rhs - self.action * next_action.rhs,
        }
    }
}
