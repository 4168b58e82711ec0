//! Detection of symmetry under rotations of pairs of coordinates.

use crate::{Function, Graph, Id, Node, Operation};

/// A vector in the plane of rotation: a linear combination of the vectors of the pairs and of their velocities. Each
/// term is `(pair, is a velocity, factor)`; they are ordered, and their factors are in units of the first.
type Vector = Vec<(usize, bool, f64)>;

/// A number times the first or the second component of a rotating vector.
#[derive(Clone, Debug)]
struct Component {
    number: f64,
    vector: Vector,
    second: bool,
}

impl Component {
    fn of(pair: usize, velocity: bool, second: bool) -> Self {
        Component { number: 1.0, vector: vec![(pair, velocity, 1.0)], second }
    }

    fn times(mut self, number: f64) -> Option<Self> {
        self.number *= number;
        (self.number != 0.0 && self.number.is_finite()).then_some(self)
    }

    /// The sum of two components that are both first or both second.
    fn plus(&self, other: &Component) -> Option<Self> {
        if self.second != other.second {
            return None;
        }
        let mut vector: Vector =
            self.vector.iter().map(|(pair, velocity, x)| (*pair, *velocity, x * self.number)).collect();
        for (pair, velocity, x) in &other.vector {
            let x = x * other.number;
            match vector.iter_mut().find(|entry| (entry.0, entry.1) == (*pair, *velocity)) {
                Some(entry) => entry.2 += x,
                None => vector.push((*pair, *velocity, x)),
            }
        }
        vector.retain(|entry| entry.2 != 0.0);
        vector.sort_by_key(|entry| (entry.0, entry.1));
        let number = vector.first()?.2;
        vector.iter_mut().for_each(|entry| entry.2 /= number);
        Some(Component { number, vector, second: self.second })
    }
}

/// A summand: a number times two components of rotating vectors, times invariant factors, given by the sorted nodes of
/// its factors and divisors.
#[derive(Default)]
struct Summand {
    number: f64,
    turning: Vec<(Vector, bool)>,
    factors: Vec<Id>,
    divisors: Vec<Id>,
}

impl Summand {
    /// Whether the two summands make up an invariant form of two vectors u and w: the scalar product `u1 w1 + u2 w2`,
    /// or the area `u1 w2 - u2 w1`.
    fn completes(&self, other: &Summand) -> bool {
        let [a, b] = self.turning.as_slice() else { return false };
        let turned = [(&a.0, !a.1), (&b.0, !b.1)];
        let [c, d] = other.turning.as_slice() else { return false };
        let theirs = [(&c.0, c.1), (&d.0, d.1)];
        let number = if a.1 == b.1 { self.number } else { -self.number };
        (turned == theirs || turned == [theirs[1], theirs[0]])
            && other.number == number
            && other.factors == self.factors
            && other.divisors == self.divisors
    }
}

/// The component that each node is, if it is one.
struct Components(Vec<Option<Component>>);

impl Components {
    fn get(&self, id: Id) -> Option<&Component> {
        self.0.get(id.index()).and_then(Option::as_ref)
    }
}

impl Graph {
    /// Whether a node is invariant under a common rotation of pairs of coordinates and of their velocities, as far as
    /// its expression shows: all its operands must be invariant, or it must be a sum of scalar products or areas of
    /// rotating vectors. Invariance may hold without being detected, as in `(x + y)^2 + (x - y)^2`.
    pub(crate) fn turns_into_itself(&self, of: Id, pairs: &[(usize, usize)]) -> bool {
        let turns = |a: u32| pairs.iter().any(|(i, j)| a as usize == *i || a as usize == *j);
        let mut invariant = vec![false; of.index() + 1];
        let mut components = Components(vec![None; of.index() + 1]);
        for (k, needed) in self.needed(of).into_iter().enumerate() {
            let id = Id(k as u32);
            if !needed {
                continue;
            }
            let component = self.component(id, pairs, &components);
            let known = |a: Id| invariant.get(a.index()).copied().unwrap_or(false);
            let here = match self.node(id) {
                Node::Position(a) | Node::Velocity(a) => !turns(a),
                // The length of a vector.
                Node::Binary(Operation::Hypot, a, b) if is_vector(components.get(a), components.get(b)) => true,
                node => node.operands().all(known) || self.is_invariant_sum(id, &components, &known),
            };
            if let (Some(place), Some(part)) = (invariant.get_mut(k), components.0.get_mut(k)) {
                (*place, *part) = (here, component);
            }
        }
        invariant.last() == Some(&true)
    }

    /// The component of a rotating vector that a node is, if it is one.
    fn component(&self, id: Id, pairs: &[(usize, usize)], known: &Components) -> Option<Component> {
        let of = |a: u32, velocity: bool| {
            let pair = pairs.iter().position(|(i, j)| a as usize == *i || a as usize == *j)?;
            Some(Component::of(pair, velocity, pairs.get(pair)?.1 == a as usize))
        };
        let scaled = |a: Id, number: f64| known.get(a)?.clone().times(number);
        match self.node(id) {
            Node::Position(a) => of(a, false),
            Node::Velocity(a) => of(a, true),
            Node::Unary(Function::Neg, a) => scaled(a, -1.0),
            Node::Binary(Operation::Add, a, b) => known.get(a)?.plus(known.get(b)?),
            Node::Binary(Operation::Sub, a, b) => known.get(a)?.plus(&scaled(b, -1.0)?),
            Node::Binary(Operation::Mul, a, b) => match (self.as_number(a), self.as_number(b)) {
                (Some(x), _) => scaled(b, x),
                (_, Some(x)) => scaled(a, x),
                _ => None,
            },
            Node::Binary(Operation::Div, a, b) => scaled(a, 1.0 / self.as_number(b)?),
            _ => None,
        }
    }

    /// Whether the summands that are not invariant make up invariant forms.
    fn is_invariant_sum(&self, sum: Id, components: &Components, known: &impl Fn(Id) -> bool) -> bool {
        let Some(mut summands) = self.summands(sum, components, known) else { return false };
        // Each summand must have one that completes it.
        while let Some(first) = summands.pop() {
            match summands.iter().position(|other| first.completes(other)) {
                Some(partner) => drop(summands.swap_remove(partner)),
                None => return false,
            }
        }
        true
    }

    /// The summands of a sum that are not invariant; `None` if one is not a product of two components.
    fn summands(&self, sum: Id, components: &Components, known: &impl Fn(Id) -> bool) -> Option<Vec<Summand>> {
        let (mut summands, mut open) = (Vec::new(), vec![(sum, 1.0)]);
        while let Some((id, sign)) = open.pop() {
            match self.node(id) {
                _ if known(id) => {}
                Node::Binary(Operation::Add, a, b) => open.extend([(a, sign), (b, sign)]),
                Node::Binary(Operation::Sub, a, b) => open.extend([(a, sign), (b, -sign)]),
                Node::Unary(Function::Neg, a) => open.push((a, -sign)),
                _ => summands.push(self.summand(id, sign, components, known)?),
            }
            if summands.len() + open.len() > MOST_SUMMANDS {
                return None;
            }
        }
        Some(summands)
    }

    fn summand(&self, id: Id, sign: f64, components: &Components, known: &impl Fn(Id) -> bool) -> Option<Summand> {
        let mut summand = Summand { number: sign, ..Summand::default() };
        let mut open = vec![id];
        while let Some(id) = open.pop() {
            match (components.get(id), self.as_number(id), self.node(id)) {
                (Some(Component { number, vector, second }), ..) => {
                    summand.number *= number;
                    summand.turning.push((vector.clone(), *second));
                }
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

/// Whether two nodes are both components of a vector, up to signs.
fn is_vector(a: Option<&Component>, b: Option<&Component>) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return false };
    a.second != b.second && a.vector == b.vector && a.number.abs() == b.number.abs()
}

/// The maximum number of summands of one sum that are examined. Sums with shared subexpressions may have very
/// many.
const MOST_SUMMANDS: usize = 64;
