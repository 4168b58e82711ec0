//! Discrete paths on `Q x Q x R^2`, where the discrete Lagrangian depends on both actions of a step.

use crate::{DiscreteLagrangian, StepError, rules::Quadrature, theory::DiscretePath};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, Lagrangian};

impl<const N: usize> DiscretePath<N> {
    /// The residuals of the condition of Vermeeren, Bravetti and Seri on `Q x Q x R^2` at the interior points:
    /// `S_1(k) + S_2(k-1) (1 + S_z0(k)) / (1 - S_z1(k-1))`, k = 1..N-1.
    ///
    /// # Errors
    /// Those of the discrete Lagrangian.
    pub fn extended_residuals<L: Lagrangian<N>>(
        &self,
        ld: &Quadrature<L>,
        t0: f64,
        z0: f64,
    ) -> Result<Vec<SVector<f64, N>>, StepError> {
        let z = self.actions(ld, t0, z0)?;
        let h = ld.step_size();
        let jets: Vec<_> = (0..self.steps())
            .map(|k| {
                let x = DiscretePoint { q0: self.points()[k], q1: self.points()[k + 1], z0: z[k] };
                ld.extended_jet(t0 + k as f64 * h, &x, z[k + 1])
            })
            .collect();
        Ok(jets.windows(2).map(|pair| pair[1].s1 + pair[0].s2 * ((1.0 + pair[1].z0) / (1.0 - pair[0].z1))).collect())
    }
}
