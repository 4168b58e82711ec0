//! The derivative of a kick.

use super::sources::Sources;
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::sensitivity::parametric_system::Quantity;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{ChartVector, Derivatives, Dual, Hessian, Parametric, PhasePoint, VelocityPoint};

/// The kick over a time s: `p += s (L_q + f)`, `z += s (L - constant)`, at `(t, q, 0, z)` for a fixed z.
pub(super) struct Kick {
    pub t: f64,
    pub s: f64,
    /// The action at which L is evaluated, and the part of L there that belongs to another flow.
    pub z: f64,
    pub constant: f64,
}

impl Kick {
    /// Applies the kick to a state, with its derivatives; `constants` are the derivatives of the constant in each
    /// parameter, none if it does not depend on them.
    pub fn linearise<L: Parametric<N>, const N: usize>(
        &self,
        lagrangian: &L,
        of: Option<&mut Sources<'_>>,
        constants: &[f64],
        state: &mut PhasePoint<N>,
    ) -> SubFlow<N> {
        let Kick { t, s, z, constant } = *self;
        let rest = VelocityPoint { q: state.q, v: SVector::zeros(), z };
        let (value, gradient) = lagrangian.with_gradient(t, &rest);
        let Hessian { mut qq, .. } = lagrangian.hessian(t, &rest);
        let mut force = gradient.x;
        if const { L::HINTS.forced } {
            let (applied, slope) = force_of_positions(lagrangian, t, &rest);
            force += applied;
            qq += slope;
        }
        let state_map = TangentMatrix { pq: qq * s, zq: gradient.x * s, ..TangentMatrix::identity() };
        let mut sources = Vec::new();
        if let Some(of) = of {
            let autonomous = lagrangian.structure().autonomous;
            let quantities = (0..of.count()).map(Quantity::Parameter).chain([Quantity::Time]);
            sources.reserve(of.count() + 2);
            for (k, quantity) in quantities.enumerate() {
                if quantity == Quantity::Time && autonomous {
                    sources.push(ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 0.0 });
                    continue;
                }
                let at = of.at(quantity, t, &rest);
                let moved = constants.get(k).copied().filter(|_| quantity != Quantity::Time).unwrap_or(0.0);
                sources.push(ChartVector {
                    x: SVector::zeros(),
                    y: (at.gradient.x + at.force) * s,
                    z: (at.l - moved) * s,
                });
            }
            sources.push(ChartVector { x: SVector::zeros(), y: force, z: value - constant });
        }
        state.p += force * s;
        state.z += (value - constant) * s;
        SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 }
    }
}

/// A force of time and positions, and its derivative in the positions.
fn force_of_positions<L: Parametric<N>, const N: usize>(
    lagrangian: &L,
    t: f64,
    rest: &VelocityPoint<N>,
) -> (SVector<f64, N>, SMatrix<f64, N, N>) {
    type Along<const N: usize> = Dual<f64, SVector<f64, N>>;
    let lifted = VelocityPoint {
        q: SVector::<Along<N>, N>::from_fn(|i, _| Dual {
            re: rest.q[i],
            d: SVector::from_fn(|j, _| f64::from(u8::from(i == j))),
        }),
        v: rest.v.map(Dual::from),
        z: Dual::from(rest.z),
    };
    let force = lagrangian.applied_force(Dual::from(t), &lifted);
    (force.map(|f| f.re), SMatrix::from_fn(|i, j| force[i].d[j]))
}
