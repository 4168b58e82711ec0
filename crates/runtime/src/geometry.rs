//! The contact geometry at a point.

/// The contact geometry of a Lagrangian at a time and a point `(q, v, z)` of TQ x R. Vectors and covectors on TQ x R
/// have the order q, v, z; matrices are given by rows.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Geometry {
    /// The value of L.
    pub lagrangian: f64,
    /// The momentum `p = L_v`: the Legendre transformation is `(q, v, z) -> (q, p, z)`.
    pub momentum: Vec<f64>,
    /// The energy `E_L = v.p - L`.
    pub energy: f64,
    /// `L_z`, the rate at which the flow contracts the contact form and every dissipated quantity.
    pub rate: f64,
    /// `W = L_vv`.
    pub mass: Vec<Vec<f64>>,
    /// The condition number of W: infinite where L is not regular.
    pub condition: f64,
    /// The contact form `eta_L = dz - L_v dq`.
    pub eta: Vec<f64>,
    /// Its Reeb field `d/dz - W^-1 L_vz d/dv`.
    pub reeb: Vec<f64>,
    /// The value of `eta ^ (d eta)^n` on the coordinate vectors.
    pub volume: f64,
    /// The Herglotz field `(v, a, L)`, the velocity of the motion in TQ x R.
    pub herglotz_field: Vec<f64>,
}

/// The contact geometry of a contact Hamiltonian at a time and a point `(q, p, z)` of T\*Q x R, for `eta = dz - p dq`.
/// Vectors and covectors on T\*Q x R have the order q, p, z; matrices are given by rows.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct HamiltonianGeometry {
    /// The value of H.
    pub hamiltonian: f64,
    /// The velocity `H_p`.
    pub velocity: Vec<f64>,
    /// `-H_z`, the rate at which the flow multiplies the contact form and every dissipated quantity.
    pub rate: f64,
    /// `H_pp`.
    pub hessian: Vec<Vec<f64>>,
    /// The condition number of `H_pp`: infinite where H has no Lagrangian.
    pub condition: f64,
    /// The contact form `dz - p dq`.
    pub eta: Vec<f64>,
    /// Its Reeb field `d/dz`.
    pub reeb: Vec<f64>,
    /// The contact Hamiltonian vector field `X_H = (H_p, -H_q - p H_z, p . H_p - H)`, the velocity of the motion.
    pub field: Vec<f64>,
    /// The Lie derivative `L_X eta`, which is `-H_z eta`.
    pub lie_derivative: Vec<f64>,
    /// The Jacobi brackets `{H, f} = X_H(f) + f H_z` of H with the coordinates f of the point. One that is 0 at all
    /// points belongs to a dissipated quantity, which is multiplied by the conformal factor.
    pub brackets: Vec<f64>,
}
