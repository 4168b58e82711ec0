//! Symbolic derivatives.

use crate::{Graph, Id, Node, Operation};

impl Graph {
    /// The partial derivatives of a node by others, all in one pass from the node back to what it is made of, so that they share
    /// their subexpressions with it and among themselves. `None` where the graph would get more than `limit` nodes.
    ///
    /// The derivative of a jump is 0, as that of a kink in it.
    ///
    /// ```
    /// use formula_lagrangian::{Graph, Operation};
    /// let mut graph = Graph::new();
    /// let (q, v) = (graph.position(0), graph.velocity(0));
    /// let product = graph.binary(Operation::Mul, q, v);
    /// assert_eq!(graph.gradient(product, &[q, v], 100), Some(vec![v, q]));
    /// ```
    pub fn gradient(&mut self, of: Id, by: &[Id], limit: usize) -> Option<Vec<Id>> {
        let leads = self.leads_to(of, by);
        let mut adjoints: Vec<Option<Id>> = vec![None; of.index() + 1];
        if let Some(last) = adjoints.last_mut() {
            *last = Some(self.number(1.0));
        }
        for i in (0..=of.index()).rev() {
            let (true, Some(adjoint)) = (leads[i], adjoints[i]) else { continue };
            if self.len() > limit {
                return None;
            }
            let id = Id(i as u32);
            let mut give = |graph: &mut Graph, operand: Id, part: Id| {
                if let Some(sum) = adjoints.get_mut(operand.index()).filter(|_| leads[operand.index()]) {
                    *sum = Some(match *sum {
                        Some(sum) => graph.add(sum, part),
                        None => part,
                    });
                }
            };
            self.pass_back(id, adjoint, &leads, &mut give);
        }
        let zero = self.number(0.0);
        Some(by.iter().map(|x| adjoints.get(x.index()).copied().flatten().unwrap_or(zero)).collect())
    }

    /// Which nodes up to `of` depend on one of `by`.
    fn leads_to(&self, of: Id, by: &[Id]) -> Vec<bool> {
        let mut leads = vec![false; of.index() + 1];
        for i in 0..=of.index() {
            let id = Id(i as u32);
            leads[i] = by.contains(&id) || self.node(id).operands().any(|a| leads[a.index()]);
        }
        leads
    }

    /// Gives each operand of a node its part of the derivative: the node's own, `adjoint`, times the slope.
    fn pass_back(&mut self, id: Id, adjoint: Id, leads: &[bool], give: &mut impl FnMut(&mut Graph, Id, Id)) {
        let asked = |a: Id| leads.get(a.index()).copied().unwrap_or(false);
        match self.node(id) {
            Node::Unary(f, a) => {
                let slope = f.slope(self, a, id);
                let part = self.mul(adjoint, slope);
                give(self, a, part);
            }
            Node::Powi(a, n) => {
                let (below, factor) = (self.powi(a, n.saturating_sub(1)), self.number(f64::from(n)));
                let part = self.mul(adjoint, below);
                let part = self.mul(part, factor);
                give(self, a, part);
            }
            Node::Select([a, b, then, otherwise]) => {
                let zero = self.number(0.0);
                let first = self.select([a, b, adjoint, zero]);
                give(self, then, first);
                let second = self.select([a, b, zero, adjoint]);
                give(self, otherwise, second);
            }
            Node::Binary(operation, a, b) => match operation {
                Operation::Add => {
                    give(self, a, adjoint);
                    give(self, b, adjoint);
                }
                Operation::Sub => {
                    give(self, a, adjoint);
                    let minus = self.neg(adjoint);
                    give(self, b, minus);
                }
                Operation::Mul if a == b => {
                    let (product, two) = (self.mul(adjoint, a), self.number(2.0));
                    let part = self.mul(product, two);
                    give(self, a, part);
                }
                Operation::Mul => {
                    for (x, other) in [(a, b), (b, a)] {
                        if asked(x) {
                            let part = self.mul(adjoint, other);
                            give(self, x, part);
                        }
                    }
                }
                // By a number or a parameter: no inverse, whose rounding would come on top.
                Operation::Div if !asked(b) && self.is_constant(b) => {
                    let part = self.div(adjoint, b);
                    give(self, a, part);
                }
                Operation::Div => {
                    let inverse = self.recip(b);
                    let part = self.mul(adjoint, inverse);
                    give(self, a, part);
                    if asked(b) {
                        // The sign goes to a constant, where it costs nothing.
                        let minus = self.neg(a);
                        let steep = self.mul(part, minus);
                        let steep = self.mul(steep, inverse);
                        give(self, b, steep);
                    }
                }
                Operation::Min | Operation::Max => {
                    let zero = self.number(0.0);
                    // The second is taken where it is less, or where the first is.
                    let pair = if operation == Operation::Max { [a, b] } else { [b, a] };
                    let first = self.select([pair[0], pair[1], zero, adjoint]);
                    give(self, a, first);
                    let second = self.select([pair[0], pair[1], adjoint, zero]);
                    give(self, b, second);
                }
                Operation::Atan2 => {
                    let (y2, x2) = (self.mul(a, a), self.mul(b, b));
                    let square = self.add(y2, x2);
                    let part = self.div(adjoint, square);
                    let first = self.mul(part, b);
                    give(self, a, first);
                    let second = self.mul(part, a);
                    let second = self.neg(second);
                    give(self, b, second);
                }
                Operation::Hypot => {
                    let part = self.div(adjoint, id);
                    for x in [a, b] {
                        let part = self.mul(part, x);
                        give(self, x, part);
                    }
                }
                // The exponent is constant.
                Operation::Power => {
                    let one = self.number(1.0);
                    let exponent = self.sub(b, one);
                    let below = self.binary(Operation::Power, a, exponent);
                    let part = self.mul(adjoint, below);
                    let part = self.mul(part, b);
                    give(self, a, part);
                }
            },
            _ => {}
        }
    }
}
