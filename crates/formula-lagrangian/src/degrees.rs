//! Degrees of expressions in the momenta: proofs that H is a polynomial in them, or homogeneous.

use crate::node::Inputs;
use crate::{Function, Graph, Id, Node, Operation};

/// The degree of homogeneity of an expression in the momenta, for multiplication of all of them by a positive number.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Homogeneity {
    /// The expression is 0, which has every degree.
    Any,
    Degree(f64),
    Unknown,
}

impl Homogeneity {
    /// That of a sum, or of the smaller or larger of two expressions.
    fn of_sum(self, other: Self) -> Self {
        match (self, other) {
            (Self::Any, known) | (known, Self::Any) => known,
            (Self::Degree(a), Self::Degree(b)) if a == b => self,
            _ => Self::Unknown,
        }
    }

    /// That of a product.
    fn of_product(self, other: Self) -> Self {
        match (self, other) {
            (Self::Any, _) | (_, Self::Any) => Self::Any,
            (Self::Degree(a), Self::Degree(b)) => Self::Degree(a + b),
            _ => Self::Unknown,
        }
    }

    /// That of a power.
    fn to_the(self, exponent: f64) -> Self {
        match self {
            Self::Degree(a) => Self::Degree(a * exponent),
            Self::Any if exponent > 0.0 => Self::Any,
            _ => Self::Unknown,
        }
    }
}

impl Graph {
    /// A property of each node that depends on the momenta; others have that of a constant.
    fn in_momenta<T: Copy>(&self, of: Id, constant: impl Fn(Id) -> T, rule: impl Fn(Node, &dyn Fn(Id) -> T) -> T) -> T {
        let mut found: Vec<T> = Vec::with_capacity(of.index() + 1);
        for i in 0..=of.index() {
            let id = Id(i as u32);
            let known = |a: Id| found.get(a.index()).copied().unwrap_or_else(|| constant(a));
            let depends = self.inputs(id).meets(Inputs::VELOCITY);
            found.push(if depends { rule(self.node(id), &known) } else { constant(id) });
        }
        found.last().copied().unwrap_or_else(|| constant(of))
    }

    /// A bound on the degree of a node as a polynomial in the momenta; `None` where the expression does not show one.
    pub(crate) fn degree_in_momenta(&self, of: Id) -> Option<u32> {
        self.in_momenta::<Option<u32>>(
            of,
            |_| Some(0_u32),
            |node, degree| match node {
                Node::Velocity(_) => Some(1),
                Node::Unary(Function::Neg, a) => degree(a),
                Node::Binary(Operation::Add | Operation::Sub, a, b) => Some(degree(a)?.max(degree(b)?)),
                Node::Binary(Operation::Mul, a, b) => degree(a)?.checked_add(degree(b)?),
                Node::Binary(Operation::Div, a, b) if !self.inputs(b).meets(Inputs::VELOCITY) => degree(a),
                Node::Powi(a, n) => degree(a)?.checked_mul(u32::try_from(n).ok()?),
                // The condition of a choice may depend on t, q and z.
                Node::Select([a, b, x, y]) if !self.inputs(a).and(self.inputs(b)).meets(Inputs::VELOCITY) => {
                    Some(degree(x)?.max(degree(y)?))
                }
                _ => None,
            },
        )
    }

    /// Whether a node is homogeneous of degree one in the momenta, as far as its expression shows.
    pub(crate) fn is_homogeneous_in_momenta(&self, of: Id) -> bool {
        use Homogeneity as H;
        let constant = |id: Id| if self.as_number(id) == Some(0.0) { H::Any } else { H::Degree(0.0) };
        let found = self.in_momenta(of, constant, |node, degree| match node {
            Node::Velocity(_) => H::Degree(1.0),
            Node::Unary(Function::Neg | Function::Abs, a) => degree(a),
            Node::Unary(Function::Sqrt, a) => degree(a).to_the(0.5),
            Node::Unary(Function::Recip, a) => degree(a).to_the(-1.0),
            Node::Powi(a, n) => degree(a).to_the(f64::from(n)),
            Node::Binary(Operation::Power, a, b) => self.as_number(b).map_or(H::Unknown, |b| degree(a).to_the(b)),
            Node::Binary(Operation::Mul, a, b) => degree(a).of_product(degree(b)),
            Node::Binary(Operation::Div, a, b) => degree(a).of_product(degree(b).to_the(-1.0)),
            Node::Binary(Operation::Atan2, a, b) if degree(a).of_sum(degree(b)) != H::Unknown => H::Degree(0.0),
            Node::Binary(Operation::Atan2, ..) => H::Unknown,
            Node::Binary(_, a, b) => degree(a).of_sum(degree(b)),
            // The condition must not change along a ray of momenta.
            Node::Select([a, b, x, y]) if degree(a).of_sum(degree(b)) != H::Unknown => degree(x).of_sum(degree(y)),
            Node::Unary(f, a) if degree(a) == H::Degree(0.0) || f == Function::Sign && degree(a) != H::Unknown => {
                H::Degree(0.0)
            }
            Node::Table { argument, .. } if degree(argument) == H::Degree(0.0) => H::Degree(0.0),
            _ => H::Unknown,
        });
        matches!(found, H::Any | H::Degree(1.0))
    }
}
