//! Cones of formulas: norms and other roots, whose derivative jumps where they vanish.

use crate::{Function, Graph, Id, Node, Operation};

/// Whether some nodes contain a root or a norm that may vanish along a motion. Not counted are roots of expressions that
/// are positive wherever they are defined, such as `x^2 + 1`; and those of which only reciprocals are taken, as in
/// Kepler's potential: a motion does not pass where L is infinite.
pub(crate) fn has_cones(graph: &Graph, nodes: &[Id]) -> bool {
    let needed = graph.needed_by(nodes);
    let mut passable = vec![false; needed.len()];
    nodes.iter().for_each(|id| passable[id.index()] = true);
    for (i, _) in needed.iter().enumerate().filter(|(_, needed)| **needed) {
        let node = graph.node(Id(i as u32));
        match node {
            Node::Unary(Function::Recip, _) => {}
            Node::Binary(Operation::Div, a, _) => passable[a.index()] = true,
            Node::Powi(_, n) if n < 0 => {}
            _ => node.operands().for_each(|a| passable[a.index()] = true),
        }
    }
    let signs = Signs::of(graph, needed.len());
    (0..needed.len()).filter(|i| needed[*i] && passable[*i]).any(|i| match graph.node(Id(i as u32)) {
        Node::Unary(Function::Sqrt, a) => may_vanish(graph, &signs, a),
        Node::Binary(Operation::Power, a, b) => {
            let is_negative = graph.as_number(b).is_some_and(|b| b < 0.0);
            !is_negative && may_vanish(graph, &signs, a)
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

#[cfg(test)]
mod tests {
    use crate::Formula;

    #[test]
    fn norms_that_may_vanish() {
        for (term, cones) in [
            ("hypot(x, y)", true),
            ("sqrt(x^2 + y^2)", true),
            ("1/(hypot(x, y) + 1)", true),
            ("(hypot(x, y) - l)^2", true),
            ("x'*sqrt(x'^2 + y'^2)", true),
            ("(x^2 + y^2)^1.5", true),
            ("(x^2 + y^2)^0.7", true),
            ("atan2(y, x)", true),
            ("sqrt(x)", true),
            ("hypot(x, 1)", false),
            ("sqrt(x^2 + y^2 + 0.01)", false),
            ("sqrt(exp(x))", false),
            ("1/hypot(x, y)", false),
            ("1/sqrt(x^2 + y^2)^3", false),
            ("l/sqrt(x^2 + y^2)", false),
            ("(x^2 + y^2)^-0.7", false),
            ("(x^2 + y^2)^2", false),
            ("sqrt(l)*x", false),
        ] {
            let formula = Formula::parse(&format!("(x'^2 + y'^2)/2 + {term}"), &["x", "y"], &[("l", 1.0)]).unwrap();
            assert_eq!(formula.lagrangian::<2>().unwrap().derived().cones, cones, "{term}");
        }
        let dragged = Formula::parse("(x'^2 + y'^2)/2", &["x", "y"], &[]).unwrap();
        let dragged = dragged.with_force("x", "-x'/hypot(x', y')").unwrap().lagrangian::<2>().unwrap();
        assert!(!dragged.derived().cones);
    }
}
