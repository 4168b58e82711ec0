//! The derivative of a kick.

use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::sensitivity::parametric_system::{Quantities, Quantity};
use crate::{Components, Point, State, System, Vector};

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
    pub fn linearise(
        &self,
        system: &dyn System,
        of: Option<&mut (dyn Quantities + '_)>,
        constants: &[f64],
        state: &mut State,
    ) -> SubFlow {
        let Kick { t, s, z, constant } = *self;
        let n = state.q.len();
        let rest = Point { q: state.q.clone(), v: Vector::zeros(n), z };
        let (value, gradient) = (system.value(t, &rest), system.gradient(t, &rest));
        let (mut qq, mut force) = (system.hessian(t, &rest).qq, gradient.x.clone());
        // A force of time and positions.
        if let Some(applied) = system.force_derivatives(t, &rest) {
            force += applied.value;
            qq += applied.q;
        }
        let state_map = TangentMatrix { pq: qq * s, zq: gradient.x * s, ..TangentMatrix::identity(n) };
        let mut sources = Vec::new();
        if let Some(of) = of {
            let autonomous = system.structure().autonomous;
            let quantities = (0..of.count()).map(Quantity::Parameter).chain([Quantity::Time]);
            sources.reserve(of.count() + 2);
            for (k, quantity) in quantities.enumerate() {
                if quantity == Quantity::Time && autonomous {
                    sources.push(Components::zeros(n));
                    continue;
                }
                let at = of.at(quantity, t, &rest);
                let moved = constants.get(k).copied().filter(|_| quantity != Quantity::Time).unwrap_or(0.0);
                sources.push(Components {
                    x: Vector::zeros(n),
                    y: (at.gradient.x + at.force) * s,
                    z: (at.l - moved) * s,
                });
            }
            sources.push(Components { x: Vector::zeros(n), y: force.clone(), z: value - constant });
        }
        state.p += force * s;
        state.z += (value - constant) * s;
        SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 }
    }
}
