//! The symmetric trapezoidal rule.

use crate::rules::{Node, Quadrature, Rule};

/// The symmetric trapezoidal rule, of order 2 and implicit in z, with `u = (q1 - q0)/h`:
/// `z1 = z0 + h/2 L(t, q0, u, z0) + h/2 L(t + h, q1, u, z1)` and
/// `sigma_d = (1 + h L_z(t, q0, u, z0)/2)/(1 - h L_z(t + h, q1, u, z1)/2)`.
///
/// For `v^2/2 - V(q) + gamma z` it is the contact version of the Stoermer-Verlet method.
#[derive(Clone, Copy, Debug)]
pub struct TrapezoidalRule;

impl Rule for TrapezoidalRule {
    const NAME: &'static str = "trapezoidal";
    const ORDER: u32 = 2;
    const NODES: &'static [Node] =
        &[Node { weight: 0.5, place: 0.0, action: 0.0 }, Node { weight: 0.5, place: 1.0, action: 1.0 }];
}

/// The discrete Lagrangian of the [`TrapezoidalRule`].
pub type Trapezoidal<L> = Quadrature<L, TrapezoidalRule>;
