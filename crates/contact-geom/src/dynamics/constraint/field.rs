//! The Herglotz equations under constraints, solved for accelerations and multipliers.

use super::{
    Constraint, ConstraintDerivatives, Distribution, DistributionDerivatives, Redundancy, least_norm, restricted,
};
use crate::support::linear::{SingularMatrix, solve};
use crate::{Derivatives, Dual, GeometryError, Lagrangian, VelocityPoint};
use nalgebra::{SMatrix, SVector};

/// The constrained motion at a state: its acceleration, and the multipliers of the constraint force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstrainedMotion<const N: usize, const M: usize> {
    /// The acceleration `q''`.
    pub acceleration: SVector<f64, N>,
    /// The multipliers lambda, or mu; the constraint force is `G^T lambda`, or `omega^T mu`.
    pub multipliers: SVector<f64, M>,
}

/// The acceleration and the multipliers of the constrained Herglotz equations at a state with `c = 0`, `c_q v = 0`:
///
/// `W a - G^T lambda = L_q + L_z L_v - (L_vq v + L_vz L + L_vt)`, `G a = -c_qq(v, v)`.
///
/// ```
/// use contact_examples::systems::constrained::RigidPendulum;
/// use contact_geom::{VelocityPoint, constraints::{Redundancy, constrained_motion}};
/// let system = RigidPendulum::<2> { gravity: 9.81, gamma: 0.0 };
/// let x = VelocityPoint::new([0.0, -1.0], [2.0, 0.0], 0.0);
/// let motion = constrained_motion(&system, &system, 0.0, &x, Redundancy::Refuse)?;
/// // The tension g + v^2 pulls upward; G = 2 q.
/// assert!((2.0 * x.q[1] * motion.multipliers[0] - (9.81 + 4.0)).abs() < 1e-14);
/// # Ok::<(), contact_geom::GeometryError>(())
/// ```
///
/// # Errors
/// [`GeometryError::Singular`] where W is singular, or the rows of `G = c_q` are dependent.
pub fn constrained_motion<const N: usize, const M: usize>(
    lagrangian: &impl Lagrangian<N>,
    constraint: &impl Constraint<N, M>,
    t: f64,
    x: &VelocityPoint<N>,
    redundancy: Redundancy,
) -> Result<ConstrainedMotion<N, M>, GeometryError> {
    let g = constraint.with_jacobian(&x.q).1;
    let [_, curvature] = constraint.along(&x.q, &x.v);
    let independent = redundancy.imposed(constraint.count(), &g);
    motion_under(lagrangian, t, x, (&g, &curvature), &independent)
}

/// The acceleration and the multipliers of the Lagrange-d'Alembert-Herglotz equations at a state with `omega(q) v = 0`:
///
/// `W a - omega^T mu = L_q + L_z L_v - (L_vq v + L_vz L + L_vt)`, `omega a = -omega'(q)[v] v`.
///
/// ```
/// use contact_examples::systems::constrained::KnifeEdge;
/// use contact_geom::{VelocityPoint, constraints::nonholonomic_motion};
/// let blade = KnifeEdge { slope: 1.3, gamma: 0.0 };
/// let x = VelocityPoint::new([0.0; 3], [0.5, 0.0, 2.0], 0.0);
/// let motion = nonholonomic_motion(&blade, &blade, 0.0, &x)?;
/// // The force across the blade turns its velocity.
/// assert!((motion.multipliers[0] - 0.5 * 2.0).abs() < 1e-15 && (motion.acceleration[0] - 1.3).abs() < 1e-15);
/// # Ok::<(), contact_geom::GeometryError>(())
/// ```
///
/// # Errors
/// [`GeometryError::Singular`] where W is singular, or the rows of omega are dependent.
pub fn nonholonomic_motion<const N: usize, const M: usize>(
    lagrangian: &impl Lagrangian<N>,
    distribution: &impl Distribution<N, M>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<ConstrainedMotion<N, M>, GeometryError> {
    let omega = distribution.omega(&x.q);
    let curvature = distribution.rates(&x.q, &x.v).1 * x.v;
    motion_under(lagrangian, t, x, (&omega, &curvature), &[true; M])
}

/// The motion under `G a = -curvature` with the force `G^T lambda`, for the constraints that are independent.
fn motion_under<const N: usize, const M: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
    (g, curvature): (&SMatrix<f64, M, N>, &SVector<f64, M>),
    independent: &[bool; M],
) -> Result<ConstrainedMotion<N, M>, GeometryError> {
    let (value, slope) = lagrangian.with_gradient_and_force(t, x);
    let drifting = |re: f64, drift: f64| Dual { re, d: SVector::<f64, 1>::new(drift) };
    let y = VelocityPoint { q: x.q.zip_map(&x.v, drifting), v: x.v.map(|v| drifting(v, 0.0)), z: drifting(x.z, value) };
    let p = lagrangian.gradient(drifting(t, 1.0), &y).y;
    let force = SVector::<f64, N>::from_fn(|i, _| slope.x[i] + p[i].re * slope.z - p[i].d[0]);
    let mass = lagrangian.mass_matrix(t, x);
    let solved = |b: SVector<f64, N>| -> Result<SVector<f64, N>, GeometryError> {
        let (mut w, mut b) = (mass, b);
        solve(&mut w, &mut b).map_err(|e| e.of("W = L_vv", "choose a regular Lagrangian"))?;
        Ok(b)
    };
    // a = W^-1 (force + G^T lambda), and G W^-1 G^T lambda = -curvature - G W^-1 force.
    let free = solved(force)?;
    let mut responses = SMatrix::<f64, N, M>::zeros();
    for a in 0..M {
        responses.set_column(a, &solved(g.row(a).transpose())?);
    }
    let mut multipliers = -curvature - g * free;
    for (a, _) in independent.iter().enumerate().filter(|(_, kept)| !**kept) {
        multipliers[a] = 0.0;
    }
    solve(&mut restricted(g * responses, independent), &mut multipliers).map_err(dependent)?;
    let acceleration = free + responses * multipliers;
    let multipliers = least_norm(g, independent, &multipliers).map_err(dependent)?;
    Ok(ConstrainedMotion { acceleration, multipliers })
}

/// The error for dependent constraints.
fn dependent(singular: SingularMatrix) -> GeometryError {
    singular.of(
        "G W^-1 G^T with G = c_q or omega",
        "remove dependent constraints, or choose a point at which G has full rank",
    )
}
