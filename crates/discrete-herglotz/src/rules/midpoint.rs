//! The symmetric midpoint rule.

use crate::rules::{Node, Quadrature, Rule};

/// The symmetric midpoint rule, of order 2 and implicit in z:
/// `z1 = z0 + h L(t + h/2, (q0 + q1)/2, (q1 - q0)/h, (z0 + z1)/2)` with
/// `sigma_d = (1 + h L_z/2)/(1 - h L_z/2)`.
///
/// It is the midpoint rule of Vermeeren, Bravetti and Seri on `Q x Q x R^2`, solved for `z1`.
#[derive(Clone, Copy, Debug)]
pub struct MidpointRule;

impl Rule for MidpointRule {
    const NAME: &'static str = "midpoint";
    const ORDER: u32 = 2;
    const NODES: &'static [Node] = &[Node { weight: 1.0, place: 0.5, action: 0.5 }];
}

/// The discrete Lagrangian of the [`MidpointRule`].
pub type Midpoint<L> = Quadrature<L, MidpointRule>;
