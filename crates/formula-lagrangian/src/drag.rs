//! Proofs of the structure of forces from their expressions.

use crate::node::Inputs;
use crate::structure::kinks;
use crate::{Function, Graph, Id, Node, Operation};
use contact_geom::Structure;

/// The maximum number of terms of a force, and of factors of a term, that are examined.
const MOST_PARTS: usize = 64;

/// The largest integer power that is read as a product of its factors.
const LARGEST_POWER: i32 = 4;

/// A coefficient: a node of numbers and parameters, and its present value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coefficient {
    pub node: Id,
    pub value: f64,
}

/// What is proved about the forces of a formula; see [`ForceStructure`](contact_geom::ForceStructure).
#[derive(Clone, Debug)]
pub(crate) enum ProvedForce {
    None,
    General,
    Drag { linear: Vec<Coefficient>, quadratic: Coefficient },
}

impl ProvedForce {
    /// What the expressions of the forces show, on a system with `n` coordinates, at least as many as there are forces.
    pub fn of(graph: &mut Graph, forces: &[Id], n: usize, limit: usize) -> Self {
        if forces.is_empty() {
            return ProvedForce::None;
        }
        drag(graph, forces, n, limit).unwrap_or(ProvedForce::General)
    }

    /// Sets the values of the coefficients from those of all constant nodes.
    pub fn set_constants(&mut self, constants: &[f64]) {
        if let ProvedForce::Drag { linear, quadratic } = self {
            for c in linear.iter_mut().chain([quadratic]) {
                c.value = constants.get(c.node.index()).copied().unwrap_or(f64::NAN);
            }
        }
    }

    /// The structure of a Lagrangian with these forces, as that of [`Forced`](contact_geom::Forced): the claims on the
    /// form of L remain.
    pub fn structure(&self, unforced: Structure) -> Structure {
        if let ProvedForce::None = self {
            return unforced;
        }
        Structure {
            autonomous: false,
            quadratic: false,
            constant_mass: unforced.constant_mass || unforced.separable || unforced.quadratic,
            constant_rate: unforced.has_constant_rate(),
            z_affine: unforced.is_affine_in_z(),
            ..unforced
        }
    }
}

/// The coefficients of the drag, if each force is one of time and positions with drag.
fn drag(graph: &mut Graph, forces: &[Id], n: usize, limit: usize) -> Option<ProvedForce> {
    let motion = Inputs::VELOCITY.and(Inputs::ACTION);
    let zero = graph.number(0.0);
    let mut variables: Vec<Id> = (0..forces.len()).map(|i| graph.velocity(i as u32)).collect();
    variables.push(graph.action());
    let coefficient = |node| Coefficient { node, value: f64::NAN };
    let (mut linear, mut common) = (Vec::new(), None);
    for (i, force) in forces.iter().enumerate() {
        let (quadratic, rest) = graph.without_quadratic_drag(*force, i, n)?;
        if *common.get_or_insert(quadratic) != quadratic || kinks(graph, rest).meets(motion) {
            return None;
        }
        let slopes = graph.gradient(rest, &variables, limit)?;
        for (j, slope) in slopes.into_iter().enumerate() {
            if j == i && graph.is_constant(slope) {
                linear.push(coefficient(graph.neg(slope)));
            } else if slope != zero {
                return None;
            }
        }
    }
    Some(ProvedForce::Drag { linear, quadratic: coefficient(common?) })
}

impl Graph {
    /// The coefficient k of the terms `-k |v| v_i` of a sum, and the sum of its other terms. The speed is that of all n
    /// coordinates, so that there is no such term where a formula has fewer.
    fn without_quadratic_drag(&mut self, sum: Id, i: usize, n: usize) -> Option<(Id, Id)> {
        let zero = self.number(0.0);
        let (mut coefficient, mut rest, mut found) = (zero, zero, false);
        for (scale, term) in self.terms(sum)? {
            match self.quadratic_drag(term, i, n) {
                Some(factor) => {
                    let part = self.mul(scale, factor);
                    (coefficient, found) = (self.sub(coefficient, part), true);
                }
                None => {
                    let part = self.mul(term, scale);
                    rest = self.add(rest, part);
                }
            }
        }
        Some(if found { (coefficient, rest) } else { (zero, sum) })
    }

    /// The terms of a sum with their constant factors, in order; `None` if there are too many.
    fn terms(&mut self, sum: Id) -> Option<Vec<(Id, Id)>> {
        let one = self.number(1.0);
        let (mut terms, mut open) = (Vec::new(), vec![(one, sum)]);
        while let Some((scale, id)) = open.pop() {
            match self.node(id) {
                _ if self.is_constant(id) => terms.push((scale, id)),
                Node::Binary(Operation::Add, a, b) => open.extend([(scale, b), (scale, a)]),
                Node::Binary(Operation::Sub, a, b) => open.extend([(self.neg(scale), b), (scale, a)]),
                Node::Unary(Function::Neg, a) => open.push((self.neg(scale), a)),
                Node::Binary(Operation::Mul, a, b) if self.is_constant(b) => open.push((self.mul(scale, b), a)),
                Node::Binary(Operation::Mul, a, b) if self.is_constant(a) => open.push((self.mul(scale, a), b)),
                Node::Binary(Operation::Div, a, b) if self.is_constant(b) => open.push((self.div(scale, b), a)),
                _ => terms.push((scale, id)),
            }
            if terms.len() + open.len() > MOST_PARTS {
                return None;
            }
        }
        Some(terms)
    }

    /// The constant factor of a product with `|v| v_i`, where v are all n velocities.
    fn quadratic_drag(&mut self, product: Id, i: usize, n: usize) -> Option<Id> {
        let own = self.velocity(i as u32);
        let mut constant = self.number(1.0);
        let (mut factors, mut open) = (Vec::new(), vec![product]);
        while let Some(id) = open.pop() {
            match self.node(id) {
                _ if self.is_constant(id) => constant = self.mul(constant, id),
                Node::Unary(Function::Neg, a) => {
                    constant = self.neg(constant);
                    open.push(a);
                }
                Node::Binary(Operation::Mul, a, b) => open.extend([a, b]),
                Node::Binary(Operation::Div, a, b) if self.is_constant(b) => {
                    constant = self.div(constant, b);
                    open.push(a);
                }
                Node::Powi(a, k) if (2..=LARGEST_POWER).contains(&k) => open.extend((0..k).map(|_| a)),
                // A factor of the speed that is written as 0 at rest.
                Node::Select([low, high, moving, at_rest])
                    if self.as_number(low) == Some(0.0)
                        && self.as_number(at_rest) == Some(0.0)
                        && (self.is_speed(high, n) || self.is_square_of_speed(high, n)) =>
                {
                    open.push(moving);
                }
                _ => factors.push(id),
            }
            if factors.len() + open.len() > MOST_PARTS {
                return None;
            }
        }
        let found = match factors.as_slice() {
            [a, b] => *a == own && self.is_speed(*b, n) || *b == own && self.is_speed(*a, n),
            // `v^2 sign v` of a single coordinate.
            [_, _, _] if n == 1 => {
                let signs = factors.iter().filter(|id| self.node(**id) == Node::Unary(Function::Sign, own)).count();
                signs == 1 && factors.iter().filter(|id| **id == own).count() == 2
            }
            _ => false,
        };
        found.then_some(constant)
    }

    /// Whether a node is the length of all n velocities.
    fn is_speed(&self, id: Id, n: usize) -> bool {
        let velocity = |id: Id| match self.node(id) {
            Node::Velocity(i) => Some(i),
            _ => None,
        };
        match self.node(id) {
            Node::Unary(Function::Abs, a) => n == 1 && velocity(a) == Some(0),
            Node::Unary(Function::Sqrt, a) => self.is_square_of_speed(a, n),
            Node::Binary(Operation::Hypot, a, b) => {
                n == 2 && matches!((velocity(a), velocity(b)), (Some(0), Some(1)) | (Some(1), Some(0)))
            }
            _ => false,
        }
    }

    /// Whether a node is the sum of the squares of all n velocities.
    fn is_square_of_speed(&self, id: Id, n: usize) -> bool {
        let (mut seen, mut open) = (vec![false; n], vec![id]);
        while let Some(id) = open.pop() {
            match self.node(id) {
                Node::Binary(Operation::Add, a, b) => open.extend([a, b]),
                Node::Binary(Operation::Mul, a, b) if a == b => match self.node(a) {
                    Node::Velocity(i) if seen.get(i as usize) == Some(&false) => seen[i as usize] = true,
                    _ => return false,
                },
                _ => return false,
            }
            if open.len() > MOST_PARTS {
                return false;
            }
        }
        seen.into_iter().all(|seen| seen)
    }
}
