//! The midpoint rule of the paper, with the action at the start of the step.

use crate::rules::{Node, Quadrature, Rule};

/// The midpoint rule of the paper (section 5), of order 1 and explicit in z:
/// `L_d = h L(t + h/2, (q0 + q1)/2, (q1 - q0)/h, z0)` with `sigma_d = 1 + h L_z`.
///
/// It is symmetric in q but takes z at the left end, which reduces the order to 1: for a linear drag its conformal
/// factor is `1 + h gamma` instead of `e^(gamma h)`.
#[derive(Clone, Copy, Debug)]
pub struct LeftMidpointRule;

impl Rule for LeftMidpointRule {
    const NAME: &'static str = "left_midpoint";
    const ORDER: u32 = 1;
    const NODES: &'static [Node] = &[Node { weight: 1.0, place: 0.5, action: 0.0 }];
}

/// The discrete Lagrangian of the [`LeftMidpointRule`].
pub type LeftMidpoint<L> = Quadrature<L, LeftMidpointRule>;
