//! What expressions are made of.

/// A node of a [`Graph`](crate::Graph). The nodes that it is made of have smaller numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(pub(crate) u32);

impl Id {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Function {
    /// `-x`.
    Neg,
    /// `1 / x`.
    Recip,
    /// The square root.
    Sqrt,
    /// The absolute value; its derivative is the sign.
    Abs,
    /// 1, -1 or 0; its derivative is 0.
    Sign,
    /// The sine.
    Sin,
    /// The cosine.
    Cos,
    /// The tangent.
    Tan,
    /// `1 - cos x`, without cancellation near 0.
    Versine,
    /// The arc tangent.
    Atan,
    /// The hyperbolic sine.
    Sinh,
    /// The hyperbolic cosine.
    Cosh,
    /// The hyperbolic tangent.
    Tanh,
    /// The inverse of the hyperbolic sine.
    Asinh,
    /// The inverse of the hyperbolic cosine, of numbers from 1 on.
    Acosh,
    /// The inverse of the hyperbolic tangent.
    Atanh,
    /// `e^x`.
    Exp,
    /// `e^x - 1`, without cancellation near 0.
    ExpM1,
    /// The natural logarithm.
    Ln,
    /// `ln(1 + x)`, without cancellation near 0.
    Ln1p,
}

/// A function of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    /// `a + b`.
    Add,
    /// `a - b`.
    Sub,
    /// `a b`.
    Mul,
    /// `a / b`.
    Div,
    /// The smaller; at a tie the first.
    Min,
    /// The larger; at a tie the first.
    Max,
    /// The angle of the point `(b, a)`.
    Atan2,
    /// `sqrt(a^2 + b^2)` without overflow.
    Hypot,
    /// `a^b`, where b is constant.
    Power,
}

/// What a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// A number, by its bits.
    Number(u64),
    /// The parameter of this index.
    Parameter(u32),
    /// The coordinate of this index.
    Position(u32),
    /// The velocity of the coordinate of this index.
    Velocity(u32),
    /// The action z.
    Action,
    /// The time t.
    Time,
    /// A function of one node.
    Unary(Function, Id),
    /// A function of two nodes.
    Binary(Operation, Id, Id),
    /// An integer power; its exponent is none of 0, 1, 2 and -1.
    Powi(Id, i32),
    /// `c` where `a < b`, else `d`, in the order `[a, b, c, d]`.
    Select([Id; 4]),
}

impl Node {
    /// The nodes that it is made of.
    pub fn operands(&self) -> impl Iterator<Item = Id> + use<> {
        let (operands, count) = match *self {
            Node::Unary(_, a) | Node::Powi(a, _) => ([a; 4], 1),
            Node::Binary(_, a, b) => ([a, b, b, b], 2),
            Node::Select(all) => (all, 4),
            _ => ([Id(0); 4], 0),
        };
        operands.into_iter().take(count)
    }
}

/// What a node depends on, as a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Inputs(u8);

impl Inputs {
    pub const NONE: Inputs = Inputs(0);
    pub const TIME: Inputs = Inputs(1);
    pub const POSITION: Inputs = Inputs(2);
    pub const VELOCITY: Inputs = Inputs(4);
    pub const ACTION: Inputs = Inputs(8);

    pub const fn and(self, other: Inputs) -> Inputs {
        Inputs(self.0 | other.0)
    }
    /// Whether they have an input in common.
    pub fn meets(self, others: Inputs) -> bool {
        self.0 & others.0 != 0
    }
    /// Whether it holds no input but these.
    pub fn within(self, others: Inputs) -> bool {
        self.0 & !others.0 == 0
    }
}
