//! How the columns of a row change with the state of a rigid body and with its parameters.

use super::derivatives::Tangent;
use super::observer::Rows;
use super::{BodyDerivatives, BodyEvent};
use contact_geom::groups::{Rotations, UniformGravity};
use contact_geom::nalgebra::{Matrix3, Vector3};
use discrete_herglotz::groups::GroupState;

impl Rows {
    /// The change of the columns with that of the body coordinates `(eta, Pi, z)` of a state, of the coefficients of the Lagrangian,
    /// and of the tip.
    pub fn change(
        &self,
        at: &GroupState<Rotations, 3>,
        change: &[f64],
        (of, of_tip): (&Tangent, Vector3<f64>),
    ) -> [f64; 19] {
        let component = |i: usize| change.get(i).copied().unwrap_or(f64::NAN);
        let part = |first: usize| Vector3::from_fn(|i, _| component(first + i));
        let (eta, of_momentum, of_z) = (part(0), part(3), component(6));
        let [w, x, y, z] = at.g.quaternion();
        let vector = Vector3::new(x, y, z);
        // q (0, eta/2)
        let [of_w, of_vector] = [Vector3::repeat(-0.5 * vector.dot(&eta)), (eta * w + vector.cross(&eta)) * 0.5];
        let inertia = Matrix3::from_fn(|i, j| of.inertia[(i.min(j), i.max(j))]);
        let omega = self.lagrangian.velocity(&at.momentum);
        let of_omega = self.lagrangian.velocity(&(of_momentum - inertia * omega));
        let in_space = |in_body: Vector3<f64>| at.g.apply(&in_body);
        let of_spatial = in_space(eta.cross(&at.momentum) + of_momentum);
        let of_tip = in_space(eta.cross(&Vector3::from(self.tip)) + of_tip);
        let UniformGravity { weight, centre } = self.lagrangian.potential();
        let (weight, centre) = (Vector3::from(*weight), Vector3::from(*centre));
        let of_potential = of.weight.dot(&in_space(centre)) + weight.dot(&in_space(eta.cross(&centre) + of.centre));
        // The energy is Pi . J^-1 Pi/2 - m g . (R X) - gamma z.
        let of_energy = omega.dot(&of_momentum)
            - 0.5 * omega.dot(&(inertia * omega))
            - of_potential
            - of.gamma * at.z
            - self.lagrangian.gamma() * of_z;
        let mut columns = [0.0; 19];
        let vectors = [of_vector, of_momentum, of_omega, of_spatial, of_tip];
        let all = std::iter::once(&of_w[0]).chain(vectors.iter().flatten()).chain([&of_energy, &of_z]);
        columns.iter_mut().skip(1).zip(all).for_each(|(to, from)| *to = *from);
        columns
    }
}

impl BodyEvent {
    /// The derivatives of the time of a sign change, from those at this time: in the start and in the parameters, as the columns of
    /// [`BodyDerivatives::of_columns`]. The derivative of `g(columns(t)) = 0` is `g' dt = -g_columns . d columns`.
    pub fn derivatives_of_time(&self, at: &BodyDerivatives) -> Vec<f64> {
        let gradient = self.gradient(&at.columns);
        let along = |of: &mut dyn Iterator<Item = &f64>| gradient.iter().zip(of).map(|(g, x)| g * x).sum::<f64>();
        let rate = along(&mut at.rates.iter());
        at.of_columns.column_iter().map(|column| -along(&mut column.iter()) / rate).collect()
    }
}
