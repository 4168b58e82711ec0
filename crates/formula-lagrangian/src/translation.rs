//! Detection of symmetry under common translations of several coordinates, and of the coordinates of bodies.

use crate::{Function, Graph, Id, Node, Operation};

impl Graph {
    /// Whether a node is invariant under a common translation of these coordinates, as far as its expression shows: it
    /// must depend on them only through linear combinations whose coefficients add up to 0, such as `x - y`. Invariance
    /// may hold without being detected.
    pub(crate) fn moves_into_itself(&self, of: Id, moved: &[usize]) -> bool {
        // The change of each node per unit of translation; NaN if it is not a constant.
        let mut growth = vec![f64::NAN; of.index() + 1];
        for (k, needed) in self.needed(of).into_iter().enumerate() {
            let id = Id(k as u32);
            if !needed {
                continue;
            }
            let by = |a: Id| growth.get(a.index()).copied().unwrap_or(f64::NAN);
            let here = match self.node(id) {
                Node::Position(a) if moved.contains(&(a as usize)) => 1.0,
                Node::Unary(Function::Neg, a) => -by(a),
                Node::Binary(Operation::Add, a, b) => by(a) + by(b),
                Node::Binary(Operation::Sub, a, b) => by(a) - by(b),
                node if node.operands().all(|a| by(a) == 0.0) => 0.0,
                Node::Binary(Operation::Mul, a, b) => match (self.as_number(a), self.as_number(b)) {
                    (Some(x), _) => x * by(b),
                    (_, Some(x)) => x * by(a),
                    _ => f64::NAN,
                },
                Node::Binary(Operation::Div, a, b) => self.as_number(b).map_or(f64::NAN, |x| by(a) / x),
                _ => f64::NAN,
            };
            if let Some(place) = growth.get_mut(k) {
                *place = here;
            }
        }
        growth.last() == Some(&0.0)
    }

    /// Sets of coordinates whose differences occur in an expression, such as `x1 - x2` and `x2 - x3`: the coordinates
    /// of bodies along an axis, each set in order.
    pub(crate) fn sets_of_differences(&self, of: Id, dimension: usize) -> Vec<Vec<usize>> {
        let mut set: Vec<usize> = (0..dimension).collect();
        for (k, needed) in self.needed(of).into_iter().enumerate() {
            if let Node::Binary(Operation::Sub, a, b) = self.node(Id(k as u32))
                && needed
                && let (Node::Position(a), Node::Position(b)) = (self.node(a), self.node(b))
                && let (Some(&to), Some(&from)) = (set.get(a as usize), set.get(b as usize))
            {
                set.iter_mut().filter(|x| **x == from).for_each(|x| *x = to);
            }
        }
        let members = |of: usize| (0..dimension).filter(|i| set.get(*i) == Some(&of)).collect::<Vec<_>>();
        let mut sets: Vec<_> = (0..dimension).map(members).filter(|members| members.len() > 1).collect();
        sets.sort();
        sets
    }
}
