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
