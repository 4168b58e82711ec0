//! The discrete path space, the discrete action and its differential, the discrete Herglotz equations.

use crate::{DiscreteLagrangian, InputError, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscreteJet, DiscretePoint, GeometryError, Scalar};

/// A discrete path `q_d = (q_0, ..., q_N)` in Q; paper, section 3.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscretePath<const N: usize> {
    points: Vec<SVector<f64, N>>,
}

impl<const N: usize> DiscretePath<N> {
    /// The path through these points.
    ///
    /// # Errors
    /// [`InputError::Count`] for fewer than two points, [`GeometryError::NonFinite`] where a coordinate is not finite.
    pub fn new(points: Vec<SVector<f64, N>>) -> Result<Self, InputError> {
        if points.len() < 2 {
            return Err(InputError::Count { what: "the number of points of the path", least: 2, found: points.len() });
        }
        for (index, q) in points.iter().enumerate() {
            if let Some(&value) = q.iter().find(|c| !c.is_finite()) {
                return Err(GeometryError::NonFinite { what: "the path's point", index, value }.into());
            }
        }
        Ok(DiscretePath { points })
    }

    /// The points.
    pub fn points(&self) -> &[SVector<f64, N>] {
        &self.points
    }

    /// The number of steps.
    pub fn steps(&self) -> usize {
        self.points.len() - 1
    }

    /// The jets of `L_d` along the path, each with the action `z_k` at which it is taken.
    fn jets(&self, ld: &impl DiscreteLagrangian<N>, t0: f64, z0: f64) -> Result<Vec<(f64, DiscreteJet<N>)>, StepError> {
        let mut z = z0;
        let mut jets = Vec::with_capacity(self.steps());
        for (k, pair) in self.points.windows(2).enumerate() {
            let jet = ld.jet(t0 + k as f64 * ld.step_size(), &DiscretePoint { q0: pair[0], q1: pair[1], z0: z })?;
            jets.push((z, jet));
            z += jet.value;
        }
        Ok(jets)
    }

    /// The actions `z_0, ..., z_N` with `z_{k+1} = z_k + L_d(q_k, q_{k+1}, z_k)`.
    ///
    /// # Errors
    /// Those of the discrete Lagrangian.
    pub fn actions(&self, ld: &impl DiscreteLagrangian<N>, t0: f64, z0: f64) -> Result<Vec<f64>, StepError> {
        let mut z = vec![z0];
        z.extend(self.jets(ld, t0, z0)?.iter().map(|(z, jet)| z + jet.value));
        Ok(z)
    }

    /// The differential of the discrete action at this path, one covector per point, by the formula of the paper:
    /// `sigma_N ... sigma_2 dZ_1/dq_0`, then `prod_{j >= k+2} sigma_j (D1 L_d(k) + sigma_{k+1} D2 L_d(k-1))`, then
    /// `dZ_N/dq_N`.
    ///
    /// # Errors
    /// Those of the discrete Lagrangian.
    pub fn action_differential(
        &self,
        ld: &impl DiscreteLagrangian<N>,
        t0: f64,
        z0: f64,
    ) -> Result<Vec<SVector<f64, N>>, StepError> {
        let jets = self.jets(ld, t0, z0)?;
        let steps = self.steps();
        let mut differential = vec![SVector::zeros(); steps + 1];
        // The product of the sigma_j after the step that starts at point k.
        let mut tail = 1.0;
        for (k, (_, jet)) in jets.iter().enumerate().rev() {
            differential[k + 1] += jet.d2 * tail;
            differential[k] += jet.d1 * tail;
            tail *= jet.sigma();
        }
        Ok(differential)
    }

    /// The residuals of the discrete Herglotz equations at the interior points:
    /// `D1 L_d(q_k, q_{k+1}, z_k) + sigma_d(q_k, q_{k+1}, z_k) D2 L_d(q_{k-1}, q_k, z_{k-1})`, k = 1..N-1. With
    /// [discrete forces](DiscreteLagrangian::forces), `D1 L_d + F-` and `D2 L_d + F+` are in the place of the derivatives.
    ///
    /// # Errors
    /// Those of the discrete Lagrangian.
    pub fn herglotz_residuals<D: DiscreteLagrangian<N>>(
        &self,
        ld: &D,
        t0: f64,
        z0: f64,
    ) -> Result<Vec<SVector<f64, N>>, StepError> {
        let mut jets = self.jets(ld, t0, z0)?;
        if const { D::FORCED } {
            for (k, (pair, (z, jet))) in self.points.windows(2).zip(&mut jets).enumerate() {
                let x = DiscretePoint { q0: pair[0], q1: pair[1], z0: *z };
                let [minus, plus] = ld.forces(t0 + k as f64 * ld.step_size(), &x)?;
                jet.d1 += minus;
                jet.d2 += plus;
            }
        }
        Ok(jets.windows(2).map(|pair| pair[1].1.d1 + pair[0].1.d2 * pair[1].1.sigma()).collect())
    }
}

/// The discrete action `A_d(q_d, z_0) = z_N`, generic over the scalar type so that it can be differentiated.
///
/// # Errors
/// Those of the discrete Lagrangian.
pub fn discrete_action<T: Scalar, const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t0: f64,
    points: &[SVector<T, N>],
    z0: T,
) -> Result<T, StepError> {
    let mut z = z0;
    for (k, pair) in points.windows(2).enumerate() {
        z += ld.value(t0 + k as f64 * ld.step_size(), &DiscretePoint { q0: pair[0], q1: pair[1], z0: z })?;
    }
    Ok(z)
}
