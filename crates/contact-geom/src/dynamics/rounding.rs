//! The round-off of a Lagrangian's derivatives.

use crate::number::rounded::Rounded;
use crate::{ChartVector, Derivatives, Lagrangian, PhasePoint, VelocityPoint};
use nalgebra::SVector;

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
pub fn gradient_rounding<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> (f64, ChartVector<N>) {
    let once = |value: f64| Rounded { value, size: value.abs() };
    let x = VelocityPoint { q: x.q.map(once), v: x.v.map(once), z: once(x.z) };
    let (l, g) = lagrangian.with_gradient(once(t), &x);
    let unit = 0.5 * f64::EPSILON;
    let gradient = ChartVector { x: g.x.map(|e| e.size * unit), y: g.y.map(|e| e.size * unit), z: g.z.size * unit };
    (l.size * unit, gradient)
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
    let once = |value: f64| Rounded { value, size: value.abs() };
    let p = state.p.map(once);
    let at = PhasePoint { q: state.q.map(once), p, z: once(state.z) };
    let unit = 0.5 * f64::EPSILON;
    let nothing = ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 0.0 };
    let Some((h, d)) = lagrangian.hamiltonian_with_gradient(once(t), &at) else { return (0.0, nothing) };
    let l = (0..N).fold(-h, |sum, i| sum + p[i] * d.y[i]);
    (l.size * unit, ChartVector { x: d.x.map(|e| e.size * unit), z: d.z.size * unit, ..nothing })
}
