//! The nodes of expressions.

/// The identifier of a node of a [`Graph`](crate::Graph). The operands of a node have smaller identifiers.
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
    /// The inverse hyperbolic sine.
    Asinh,
    /// The inverse hyperbolic cosine, for numbers not less than 1.
    Acosh,
    /// The inverse hyperbolic tangent.
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
    /// The smaller; if both are equal, the first.
    Min,
    /// The larger; if both are equal, the first.
    Max,
    /// The angle of the point `(b, a)`.
    Atan2,
    /// `sqrt(a^2 + b^2)` without overflow.
    Hypot,
    /// `a^b`, where b is constant.
    Power,
}

/// The content of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// A number, by its bits.
    Number(u64),
    /// The parameter with this index.
    Parameter(u32),
    /// The coordinate with this index.
    Position(u32),
    /// The velocity of the coordinate with this index.
    Velocity(u32),
    /// The action z.
    Action,
    /// The time t.
    Time,
    /// A function of one node.
    Unary(Function, Id),
    /// A function of two nodes.
    Binary(Operation, Id, Id),
    /// An integer power with an exponent other than 0, 1, 2 and -1.
    Powi(Id, i32),
    /// `c` if `a < b`, else `d`, in the order `[a, b, c, d]`.
    Select([Id; 4]),
    /// A derivative of a table.
    Table {
        /// The index of the table among those of the graph.
        table: u32,
        /// The order of the derivative, 0 for the value.
        order: u8,
        /// Where it is evaluated.
        argument: Id,
    },
}

impl Node {
    /// The operands of the node.
    pub fn operands(&self) -> impl Iterator<Item = Id> + use<> {
        let (operands, count) = match *self {
            Node::Unary(_, a) | Node::Powi(a, _) | Node::Table { argument: a, .. } => ([a; 4], 1),
            Node::Binary(_, a, b) => ([a, b, b, b], 2),
            Node::Select(all) => (all, 4),
            _ => ([Id(0); 4], 0),
        };
        operands.into_iter().take(count)
    }
}

/// The set of inputs on which a node depends.
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
    /// Whether the two sets have an input in common.
    pub fn meets(self, others: Inputs) -> bool {
        self.0 & others.0 != 0
    }
    /// Whether the set is contained in the other.
    pub fn within(self, others: Inputs) -> bool {
        self.0 & !others.0 == 0
    }
}
