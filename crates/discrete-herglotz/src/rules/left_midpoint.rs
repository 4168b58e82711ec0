//! The paper's midpoint rule, with the action at the step's start.

use crate::rules::{Node, Quadrature, Rule};

/// The paper's midpoint rule (section 5), of order 1 and explicit in z:
/// `L_d = h L(t + h/2, (q0 + q1)/2, (q1 - q0)/h, z0)` with `sigma_d = 1 + h L_z`.
///
/// It is symmetric in q but takes z at the left end, which costs it the second order: its rate is `1 + h gamma`, not
/// `e^(gamma h)`.
#[derive(Clone, Copy, Debug)]
pub struct LeftMidpointRule;

impl Rule for LeftMidpointRule {
    const NAME: &'static str = "left_midpoint";
    const ORDER: u32 = 1;
    const NODES: &'static [Node] = &[Node { weight: 1.0, place: 0.5, action: 0.0 }];
}

/// The discrete Lagrangian of the [`LeftMidpointRule`].
pub type LeftMidpoint<L> = Quadrature<L, LeftMidpointRule>;
