//! Symmetry under rotations of two coordinates, seen in an expression.

use crate::{Graph, Id, Node, Operation};

/// A coordinate of the pair that is turned, or its velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Component {
    Position(bool),
    Velocity(bool),
}

/// A summand: a number times components of the pair times what does not turn, by the sorted nodes of its factors and divisors.
#[derive(Default)]
struct Summand {
    number: f64,
    turning: Vec<Component>,
    factors: Vec<Id>,
    divisors: Vec<Id>,
}

/// The forms of two vectors of the plane that do not turn: `|q|^2`, `|v|^2`, `q.v`, and the area of q and v.
const FORMS: [[(Component, Component, f64); 2]; 4] = {
    use Component::{Position as Q, Velocity as V};
    [
        [(Q(false), Q(false), 1.0), (Q(true), Q(true), 1.0)],
        [(V(false), V(false), 1.0), (V(true), V(true), 1.0)],
        [(Q(false), V(false), 1.0), (Q(true), V(true), 1.0)],
        [(Q(false), V(true), 1.0), (Q(true), V(false), -1.0)],
    ]
};

impl Graph {
    /// Whether a node is seen to be invariant where the coordinates `i` and `j` and their velocities are turned together: where all that
    /// it is made of is, or is a sum of the squares, of the products, or of the area. What is not seen, as in `(x + y)^2 + (x - y)^2`, is
    /// not claimed.
    pub(crate) fn turns_into_itself(&self, of: Id, i: u32, j: u32) -> bool {
        let mut invariant = vec![false; of.index() + 1];
        for (k, needed) in self.needed(of).into_iter().enumerate() {
            let id = Id(k as u32);
            if !needed {
                continue;
            }
            let known = |a: Id| invariant.get(a.index()).copied().unwrap_or(false);
            let here = match self.node(id) {
                Node::Position(a) | Node::Velocity(a) => a != i && a != j,
                // The length of the pair.
                Node::Binary(Operation::Hypot, a, b) if self.is_pair(a, b, [i, j]) => true,
                node => node.operands().all(known) || self.is_invariant_sum(id, [i, j], &known),
            };
            if let Some(place) = invariant.get_mut(k) {
                *place = here;
            }
        }
        invariant.last() == Some(&true)
    }

    /// Whether two nodes are the positions, or the velocities, of the pair.
    fn is_pair(&self, a: Id, b: Id, [i, j]: [u32; 2]) -> bool {
        match (self.component(a, [i, j]), self.component(b, [i, j])) {
            (Some(Component::Position(a)), Some(Component::Position(b))) => a != b,
            (Some(Component::Velocity(a)), Some(Component::Velocity(b))) => a != b,
            _ => false,
        }
    }

    fn component(&self, id: Id, [i, j]: [u32; 2]) -> Option<Component> {
        match self.node(id) {
            Node::Position(a) if a == i || a == j => Some(Component::Position(a == j)),
            Node::Velocity(a) if a == i || a == j => Some(Component::Velocity(a == j)),
            _ => None,
        }
    }

    /// Whether the summands that turn make up forms that do not.
    fn is_invariant_sum(&self, sum: Id, pair: [u32; 2], known: &impl Fn(Id) -> bool) -> bool {
        let Some(mut summands) = self.summands(sum, pair, known) else { return false };
        // Each of the first kind has one of the second, with the same factor.
        while let Some(first) = summands.pop() {
            let is = |summand: &Summand, (a, b, sign): (Component, Component, f64), factor: f64| {
                let [x, y] = summand.turning.as_slice() else { return false };
                ((*x, *y) == (a, b) || (*x, *y) == (b, a)) && summand.number == sign * factor
            };
            let partner = FORMS.iter().find_map(|[one, other]| {
                let (mine, its) = if is(&first, *one, one.2 * first.number) { (one, other) } else { (other, one) };
                let factor = mine.2 * first.number;
                let fits = |summand: &Summand| {
                    is(summand, *its, factor) && summand.factors == first.factors && summand.divisors == first.divisors
                };
                is(&first, *mine, factor).then(|| summands.iter().position(fits))?
            });
            match partner {
                Some(partner) => drop(summands.swap_remove(partner)),
                None => return false,
            }
        }
        true
    }

    /// The summands of a sum that turn; `None` where one is not a product of two components of the pair.
    fn summands(&self, sum: Id, pair: [u32; 2], known: &impl Fn(Id) -> bool) -> Option<Vec<Summand>> {
        let (mut summands, mut open) = (Vec::new(), vec![(sum, 1.0)]);
        while let Some((id, sign)) = open.pop() {
            match self.node(id) {
                _ if known(id) => {}
                Node::Binary(Operation::Add, a, b) => open.extend([(a, sign), (b, sign)]),
                Node::Binary(Operation::Sub, a, b) => open.extend([(a, sign), (b, -sign)]),
                Node::Unary(crate::Function::Neg, a) => open.push((a, -sign)),
                _ => summands.push(self.summand(id, sign, pair, known)?),
            }
            // Sums that share their parts may have very many summands.
            if summands.len() + open.len() > MOST_SUMMANDS {
                return None;
            }
        }
        Some(summands)
    }

    fn summand(&self, id: Id, sign: f64, pair: [u32; 2], known: &impl Fn(Id) -> bool) -> Option<Summand> {
        let mut summand = Summand { number: sign, ..Summand::default() };
        let mut open = vec![id];
        while let Some(id) = open.pop() {
            match (self.component(id, pair), self.as_number(id), self.node(id)) {
                (Some(component), ..) => summand.turning.push(component),
                (_, Some(number), _) => summand.number *= number,
                _ if known(id) => summand.factors.push(id),
                (.., Node::Binary(Operation::Mul, a, b)) => open.extend([a, b]),
                (.., Node::Binary(Operation::Div, a, b)) if known(b) => {
                    open.push(a);
                    summand.divisors.push(b);
                }
                _ => return None,
            }
            if summand.turning.len() > 2 {
                return None;
            }
        }
        summand.factors.sort_unstable();
        summand.divisors.sort_unstable();
        (summand.turning.len() == 2).then_some(summand)
    }
}

/// The most summands of one sum that are looked at.
const MOST_SUMMANDS: usize = 64;
