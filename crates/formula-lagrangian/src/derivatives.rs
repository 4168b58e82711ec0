//! Symbolic differentiation by reverse accumulation.

use crate::{Function, Graph, Id, Node, Operation};

/// A contribution to the adjoint of a node: it is `part` where `live` is 1, and 0 where `live` is 0, whatever the value
/// of `part` there.
///
/// A branch that is not taken therefore contributes nothing, even if its derivative is NaN: `part` is propagated
/// unconditionally, and the selection is made at the end.
#[derive(Clone, Copy)]
struct Adjoint {
    part: Id,
    live: Id,
}

/// The nesting depth of conditionals up to which each is written out; deeper ones are selected by the value of `live`.
const MAX_WRITTEN_OUT_DEPTH: usize = 8;

impl Graph {
    /// The value of an adjoint.
    fn chosen(&mut self, adjoint: Adjoint) -> Id {
        self.chosen_within(adjoint, MAX_WRITTEN_OUT_DEPTH)
    }

    fn chosen_within(&mut self, Adjoint { part, live }: Adjoint, deep: usize) -> Id {
        let (zero, one) = (self.number(0.0), self.number(1.0));
        match self.node(live) {
            _ if live == one => part,
            Node::Select([a, b, x, y]) if deep > 0 && (x == zero || y == zero) => {
                let inner = self.chosen_within(Adjoint { part, live: if y == zero { x } else { y } }, deep - 1);
                let pair = if y == zero { [inner, zero] } else { [zero, inner] };
                self.select([a, b, pair[0], pair[1]])
            }
            _ => self.select([zero, live, part, zero]),
        }
    }

    /// The sum of two adjoints.
    fn sum(&mut self, first: Adjoint, second: Adjoint) -> Adjoint {
        let (zero, one) = (self.number(0.0), self.number(1.0));
        if first.live == second.live {
            return Adjoint { part: self.add(first.part, second.part), live: first.live };
        }
        // The two adjoints belong to the two branches of one conditional.
        if let (Node::Select([a, b, x, y]), Node::Select([c, d, z, w])) =
            (self.node(first.live), self.node(second.live))
            && (a, b) == (c, d)
        {
            if y == zero && z == zero && x == w {
                return Adjoint { part: self.select([a, b, first.part, second.part]), live: x };
            }
            if x == zero && w == zero && y == z {
                return Adjoint { part: self.select([a, b, second.part, first.part]), live: y };
            }
        }
        let (left, right) = (self.chosen(first), self.chosen(second));
        let live = if first.live == one || second.live == one {
            one
        } else {
            self.binary(Operation::Max, first.live, second.live)
        };
        Adjoint { part: self.add(left, right), live }
    }

    /// The partial derivatives of a node with respect to others, all in one pass backward through the graph, so that
    /// they share their subexpressions with the node and among themselves. `None` if the graph would exceed `limit`
    /// nodes.
    ///
    /// The derivative of a jump is taken to be 0, and so is that of `abs` at 0.
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
        let mut adjoints: Vec<Option<Adjoint>> = vec![None; of.index() + 1];
        if let Some(last) = adjoints.last_mut() {
            let one = self.number(1.0);
            *last = Some(Adjoint { part: one, live: one });
        }
        for i in (0..=of.index()).rev() {
            let (true, Some(adjoint)) = (leads[i], adjoints[i]) else { continue };
            if self.len() > limit {
                return None;
            }
            let id = Id(i as u32);
            let mut give = |graph: &mut Graph, operand: Id, adjoint: Adjoint| {
                if let Some(sum) = adjoints.get_mut(operand.index()).filter(|_| leads[operand.index()]) {
                    *sum = Some(match *sum {
                        Some(sum) => graph.sum(sum, adjoint),
                        None => adjoint,
                    });
                }
            };
            self.pass_back(id, adjoint, &leads, &mut give);
        }
        let zero = self.number(0.0);
        let value = |x: &Id| match adjoints.get(x.index()).copied().flatten() {
            Some(adjoint) => self.chosen(adjoint),
            None => zero,
        };
        Some(by.iter().map(value).collect())
    }

    /// For each node up to `of`, whether it depends on one of `by`.
    fn leads_to(&self, of: Id, by: &[Id]) -> Vec<bool> {
        let mut leads = vec![false; of.index() + 1];
        for i in 0..=of.index() {
            let id = Id(i as u32);
            leads[i] = by.contains(&id) || self.node(id).operands().any(|a| leads[a.index()]);
        }
        leads
    }

    /// Passes to each operand of a node its contribution: the adjoint of the node, `adjoint`, times the partial
    /// derivative.
    fn pass_back(&mut self, id: Id, of: Adjoint, leads: &[bool], give: &mut impl FnMut(&mut Graph, Id, Adjoint)) {
        let asked = |a: Id| leads.get(a.index()).copied().unwrap_or(false);
        let Adjoint { part: adjoint, live } = of;
        let mut choose = |graph: &mut Graph, [a, b, then, otherwise]: [Id; 4]| {
            let zero = graph.number(0.0);
            for (operand, choice) in [(then, [a, b, live, zero]), (otherwise, [a, b, zero, live])] {
                let live = graph.select(choice);
                if live != zero {
                    give(graph, operand, Adjoint { part: adjoint, live });
                }
            }
        };
        match self.node(id) {
            Node::Select(all) => return choose(self, all),
            // The second operand is selected where it is strictly smaller, or for `Max` strictly larger.
            Node::Binary(Operation::Min, a, b) => return choose(self, [b, a, b, a]),
            Node::Binary(Operation::Max, a, b) => return choose(self, [a, b, b, a]),
            _ => {}
        }
        let mut give = |graph: &mut Graph, operand: Id, part: Id| give(graph, operand, Adjoint { part, live });
        match self.node(id) {
            // Powers of roots and of lengths are differentiated as a whole, since they have derivatives where the root
            // has none.
            Node::Powi(a, n) if n > 2 && matches!(self.node(a), Node::Unary(Function::Sqrt, _)) => {
                for square in self.node(a).operands() {
                    let (below, factor) = (self.powi(a, n - 2), self.number(0.5 * f64::from(n)));
                    let slope = self.mul(below, factor);
                    let slope = if n < 4 { self.slope_of_squares(square, slope) } else { slope };
                    let part = self.mul(adjoint, slope);
                    give(self, square, part);
                }
            }
            Node::Powi(a, n) if n > 2 && matches!(self.node(a), Node::Binary(Operation::Hypot, ..)) => {
                let (below, factor, zero) = (self.powi(a, n - 2), self.number(f64::from(n)), self.number(0.0));
                let slope = self.mul(below, factor);
                let slope = if n < 4 { self.select([zero, a, slope, zero]) } else { slope };
                let part = self.mul(adjoint, slope);
                for x in self.node(a).operands() {
                    let part = self.mul(part, x);
                    give(self, x, part);
                }
            }
            Node::Unary(f, a) => {
                let slope = f.slope(self, a, id);
                let part = self.mul(adjoint, slope);
                give(self, a, part);
            }
            Node::Table { table, order, argument } => {
                let slope = self.lookup(table, order.saturating_add(1), argument);
                let part = self.mul(adjoint, slope);
                give(self, argument, part);
            }
            Node::Powi(a, n) => {
                let (below, factor) = (self.powi(a, n.saturating_sub(1)), self.number(f64::from(n)));
                let part = self.mul(adjoint, below);
                let part = self.mul(part, factor);
                give(self, a, part);
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
                // For a number or a parameter as divisor the inverse is avoided, since it would add a rounding error.
                Operation::Div if !asked(b) && self.is_constant(b) => {
                    let part = self.div(adjoint, b);
                    give(self, a, part);
                }
                Operation::Div => {
                    let inverse = self.recip(b);
                    let part = self.mul(adjoint, inverse);
                    give(self, a, part);
                    if asked(b) {
                        // The sign is applied to the numerator, since it costs nothing for a constant.
                        let minus = self.neg(a);
                        let steep = self.mul(part, minus);
                        let steep = self.mul(steep, inverse);
                        give(self, b, steep);
                    }
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
                Operation::Power => {
                    let slope = self.slope_of_power(a, b);
                    let part = self.mul(adjoint, slope);
                    let part = self.mul(part, b);
                    give(self, a, part);
                    if asked(b) {
                        // In the exponent, where the power is defined for exponents near this one.
                        let (log, zero) = (self.unary(Function::Ln, a), self.number(0.0));
                        let steep = self.mul(id, log);
                        let steep = self.select([zero, a, steep, zero]);
                        let part = self.mul(adjoint, steep);
                        give(self, b, part);
                    }
                }
                // Handled above.
                Operation::Min | Operation::Max => {}
            },
            _ => {}
        }
    }

    /// The derivative of a power with an exponent between 1 and 2, where its base may be a sum of squares s. The
    /// conditional makes the second derivatives of the power vanish where s vanishes: `|grad s|^2` is at most of the
    /// size of s, so that `s^(b-2) (grad s)^2` goes to 0.
    fn slope_of_squares(&mut self, base: Id, slope: Id) -> Id {
        if !self.shape(base).flat {
            return slope;
        }
        let zero = self.number(0.0);
        self.select([zero, base, slope, zero])
    }

    /// `a^(b-1)`, which multiplied by b is the derivative of `a^b` for a constant b.
    fn slope_of_power(&mut self, a: Id, b: Id) -> Id {
        let (zero, one) = (self.number(0.0), self.number(1.0));
        let exponent = self.sub(b, one);
        let slope = self.binary(Operation::Power, a, exponent);
        let Some(x) = self.as_number(b) else {
            // If the exponent is 0, the derivative is 0, even where the base is 0.
            let size = self.unary(Function::Abs, b);
            let slope = self.select([zero, size, slope, zero]);
            if !self.shape(a).flat {
                return slope;
            }
            let at_zero = self.select([one, b, zero, slope]);
            return self.select([zero, a, slope, at_zero]);
        };
        match x {
            _ if x > 1.0 && x < 2.0 => self.slope_of_squares(a, slope),
            // The gradient vanishes where the squares do, but its derivatives do not exist there. The quotient
            // `2/(1/a)` is 0 there as well, and its derivatives are NaN by any method of differentiation.
            _ if x > 0.5 && x < 1.0 && self.shape(a).flat => {
                let (inverse, two) = (self.recip(a), self.number(2.0));
                let none = self.div(two, inverse);
                self.select([zero, a, slope, none])
            }
            _ => slope,
        }
    }
}
