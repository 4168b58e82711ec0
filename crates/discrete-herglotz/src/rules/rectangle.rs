//! The rectangle rule.

use crate::rules::{Node, Quadrature, Rule};

/// The rectangle rule, of order 1 and explicit in z: `L_d = h L(t, q0, (q1 - q0)/h, z0)` with `sigma_d = 1 + h L_z`.
///
/// For the free particle it is the discrete Lagrangian of the first example of the paper,
/// `(q1 - q0)^2/(2h) + h gamma z0`.
#[derive(Clone, Copy, Debug)]
pub struct RectangleRule;

impl Rule for RectangleRule {
    const NAME: &'static str = "rectangle";
    const ORDER: u32 = 1;
    const NODES: &'static [Node] = &[Node { weight: 1.0, place: 0.0, action: 0.0 }];
}

/// The discrete Lagrangian of the [`RectangleRule`].
pub type Rectangle<L> = Quadrature<L, RectangleRule>;
