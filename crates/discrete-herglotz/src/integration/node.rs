//! The nodes of quadrature rules.

/// A node of a quadrature rule on `Q x Q x R^2`: L is taken at the time `t + a h`, the position `(1 - a) q0 + a q1`,
/// the velocity `(q1 - q0)/h` and the action `(1 - b) z0 + b z1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// The weight of the node; the weights sum to 1.
    pub weight: f64,
    /// The fraction `a` of the step at which position and time are taken.
    pub place: f64,
    /// The fraction `b` at which the action is taken; a rule with 0 at all nodes is explicit in z.
    pub action: f64,
}

impl Node {
    /// The node of the adjoint rule: its reflection in time.
    #[inline(always)]
    pub fn reflected(&self) -> Node {
        Node { weight: self.weight, place: 1.0 - self.place, action: 1.0 - self.action }
    }
}
