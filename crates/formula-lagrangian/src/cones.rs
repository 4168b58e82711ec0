//! Cones of formulas: norms and other roots, whose derivative jumps where they vanish.

use crate::{Function, Graph, Id, Node, Operation};

/// Whether some nodes contain a root or a norm that may vanish along a motion. Not counted are roots of expressions that
/// are positive wherever they are defined, such as `x^2 + 1`; and those of which only reciprocals are taken, as in
/// Kepler's potential: a motion does not pass where L is infinite.
pub(crate) fn has_cones(graph: &Graph, nodes: &[Id]) -> bool {
    let count = nodes.iter().map(|id| id.index() + 1).max().unwrap_or(0);
    // How a node enters L: as a term, up to constant factors and powers; as a factor of the denominator of such a term,
    // where L is infinite if it vanishes; or in another way, as within a function that may be finite where its argument is
    // not.
    let (mut term, mut divisor, mut argument) = (vec![false; count], vec![false; count], vec![false; count]);
    nodes.iter().for_each(|id| term[id.index()] = true);
    for id in (0..count).rev().map(|i| Id(i as u32)) {
        let node = graph.node(id);
        let mark = |set: &mut [bool]| node.operands().for_each(|a| set[a.index()] = true);
        let inverts = match node {
            Node::Unary(Function::Recip, _) => true,
            Node::Powi(_, n) => n < 0,
            Node::Binary(Operation::Power, _, b) => graph.as_number(b).is_some_and(|b| b < 0.0),
            _ => false,
        };
        if term[id.index()] {
            match node {
                Node::Binary(Operation::Div, a, b) if graph.is_constant(a) => divisor[b.index()] = true,
                _ if inverts => mark(&mut divisor),
                // A factor that vanishes with a denominator, as in `x/hypot(x, y)`, keeps the product finite.
                Node::Binary(Operation::Mul, a, b) if !graph.is_constant(a) && !graph.is_constant(b) => {
                    mark(&mut argument);
                }
                Node::Unary(Function::Neg, _)
                | Node::Binary(Operation::Add | Operation::Sub | Operation::Mul, ..)
                | Node::Powi(..) => mark(&mut term),
                _ => mark(&mut argument),
            }
        }
        if divisor[id.index()] {
            match node {
                Node::Unary(Function::Neg | Function::Sqrt, _)
                | Node::Binary(Operation::Mul | Operation::Power, ..)
                | Node::Powi(..)
                    if !inverts =>
                {
                    mark(&mut divisor);
                }
                _ => mark(&mut argument),
            }
        }
        if argument[id.index()] {
            mark(&mut argument);
        }
    }
    let signs = Signs::of(graph, count);
    (0..count).filter(|i| term[*i] || argument[*i]).any(|i| match graph.node(Id(i as u32)) {
        Node::Unary(Function::Sqrt, a) => may_vanish(graph, &signs, a),
        Node::Binary(Operation::Power, a, b) => {
            let is_infinite = !argument[i] && graph.as_number(b).is_some_and(|b| b < 0.0);
            !is_infinite && may_vanish(graph, &signs, a)
        }
        Node::Binary(Operation::Hypot, a, b) => may_vanish(graph, &signs, a) && may_vanish(graph, &signs, b),
        // It jumps on a half-axis too.
        Node::Binary(Operation::Atan2, a, b) => !graph.is_constant(a) || !graph.is_constant(b),
        _ => false,
    })
}

/// Whether a node is not constant and not proved to be positive.
fn may_vanish(graph: &Graph, signs: &Signs, id: Id) -> bool {
    !graph.is_constant(id) && !signs.positive[id.index()]
}

/// The nodes that are proved to be positive, and those that are proved not to be negative, wherever they are defined.
struct Signs {
    positive: Vec<bool>,
    not_negative: Vec<bool>,
}

impl Signs {
    fn of(graph: &Graph, count: usize) -> Self {
        let mut signs = Signs { positive: Vec::with_capacity(count), not_negative: Vec::with_capacity(count) };
        for id in (0..count).map(|i| Id(i as u32)) {
            let (positive, not_negative) = signs.of_node(graph, id);
            signs.positive.push(positive);
            signs.not_negative.push(positive || not_negative);
        }
        signs
    }

    fn of_node(&self, graph: &Graph, id: Id) -> (bool, bool) {
        use Function::{Abs, Cosh, Exp, Recip, Sqrt, Versine};
        let (above, at_least) = (|a: Id| self.positive[a.index()], |a: Id| self.not_negative[a.index()]);
        match graph.node(id) {
            Node::Number(bits) => (f64::from_bits(bits) > 0.0, f64::from_bits(bits) >= 0.0),
            Node::Unary(Exp | Cosh, _) => (true, true),
            Node::Unary(Abs | Versine, _) => (false, true),
            Node::Unary(Sqrt, a) => (above(a), true),
            Node::Unary(Recip, a) => (above(a), at_least(a)),
            Node::Binary(Operation::Hypot, a, b) => (above(a) || above(b), true),
            Node::Binary(Operation::Add, a, b) => {
                let both = at_least(a) && at_least(b);
                (both && (above(a) || above(b)), both)
            }
            Node::Binary(Operation::Mul, a, b) if a == b => (above(a), true),
            Node::Binary(Operation::Mul | Operation::Div, a, b) => (above(a) && above(b), at_least(a) && at_least(b)),
            Node::Powi(a, n) => (above(a), n % 2 == 0 || at_least(a)),
            Node::Binary(Operation::Power, a, _) => (above(a), true),
            _ => (false, false),
        }
    }
}
