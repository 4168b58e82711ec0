//! The round-off of a Lagrangian's derivatives.

use crate::number::rounded::Rounded;
use crate::{
    Arguments, ChartVector, Derivatives, Lagrangian, PhasePoint, ScalarSystem, SlicesVisitor, Slopes, VelocityPoint,
};
use nalgebra::SVector;
use std::sync::Arc;

/// One unit of rounding.
const UNIT: f64 = 0.5 * f64::EPSILON;

/// A number that was rounded once.
fn once(value: f64) -> Rounded {
    Rounded { value, size: value.abs() }
}

/// First-order bounds of the rounding errors of the value of L and of its gradient `(L_q, L_v, L_z)` at a point. They
/// account for the rounding of each coordinate and of each operation, propagated to the result. Where forces cancel, as
/// at an equilibrium, the bound is that of the terms that cancel.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::{VelocityPoint, support::gradient_rounding};
/// let x = VelocityPoint::new([1.0], [0.0], 0.0);
/// let (_, rounding) = gradient_rounding(&Pendulum { gamma: -0.1 }, 0.0, &x);
/// assert!((1e-17..1e-15).contains(&rounding.x[0])); // of a sine
/// ```
#[inline(never)]
pub fn gradient_rounding<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    t: f64,
    x: &VelocityPoint<N>,
) -> (f64, ChartVector<N>) {
    if const { L::HINTS.over_slices } {
        let none = SVector::<f64, N>::from_element(f64::NAN);
        let mut gradient = ChartVector { x: none, y: none, z: f64::NAN };
        let at = Arguments { t, q: x.q.as_slice(), v: x.v.as_slice(), z: x.z };
        let to = Slopes { q: gradient.x.as_mut_slice(), v: gradient.y.as_mut_slice(), z: &mut gradient.z };
        let of_value = lagrangian.over_slices(RoundingAt { at, to });
        return (of_value.unwrap_or(f64::NAN), gradient);
    }
    let x = VelocityPoint { q: x.q.map(once), v: x.v.map(once), z: once(x.z) };
    let (l, g) = lagrangian.with_gradient(once(t), &x);
    let gradient = ChartVector { x: g.x.map(|e| e.size * UNIT), y: g.y.map(|e| e.size * UNIT), z: g.z.size * UNIT };
    (l.size * UNIT, gradient)
}

/// Computes [`gradient_rounding`] over slices, compiled once for any number of coordinates.
struct RoundingAt<'x> {
    at: Arguments<'x, f64>,
    to: Slopes<'x, f64>,
}

impl SlicesVisitor for RoundingAt<'_> {
    type Output = f64;

    fn visit<F: ScalarSystem + 'static>(self, slices: Arc<F>) -> f64 {
        let Arguments { t, q, v, z } = self.at;
        let [q, v] = [q, v].map(|x| x.iter().copied().map(once).collect::<Vec<_>>());
        let (mut of_q, mut of_v, mut of_z) = (q.clone(), v.clone(), once(0.0));
        let to = Slopes { q: &mut of_q, v: &mut of_v, z: &mut of_z };
        let l = slices.with_gradient::<Rounded, 0>(once(t), &q, &v, once(z), to);
        for (to, of) in [(self.to.q, of_q), (self.to.v, of_v)] {
            to.iter_mut().zip(of).for_each(|(to, of)| *to = of.size * UNIT);
        }
        *self.to.z = of_z.size * UNIT;
        l.size * UNIT
    }
}

/// The same at a state with its velocity: for a Lagrangian that is given by a contact Hamiltonian, bounds of the rounding
/// errors of `L = p . H_p - H`, of `-H_q` and of `-H_z`; that of `L_v = p` is 0.
pub fn rounding_at_state<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    t: f64,
    x: &VelocityPoint<N>,
    state: &PhasePoint<N>,
) -> (f64, ChartVector<N>) {
    if const { !L::HINTS.hamiltonian } {
        return gradient_rounding(lagrangian, t, x);
    }
    let p = state.p.map(once);
    let at = PhasePoint { q: state.q.map(once), p, z: once(state.z) };
    let nothing = ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 0.0 };
    let Some((h, d)) = lagrangian.hamiltonian_with_gradient(once(t), &at) else { return (0.0, nothing) };
    let l = (0..N).fold(-h, |sum, i| sum + p[i] * d.y[i]);
    (l.size * UNIT, ChartVector { x: d.x.map(|e| e.size * UNIT), z: d.z.size * UNIT, ..nothing })
}
