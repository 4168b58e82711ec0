//! Expressions as one graph, in which equal expressions are one node.

use crate::FormulaError;
use crate::node::{Function, Id, Inputs, Node, Operation};
use contact_geom::table::Table;
use std::collections::HashMap;

/// Hash-consed expressions: an expression that is built twice is one node. Each is simplified as it is built, in ways
/// that are exact except for the sign of zeros and for numbers that are not finite: constants are folded; `x + 0`,
/// `1 x`, `0 x`, `x - x` and double signs are simplified; factors that are powers of two are collected. No operations
/// are reordered in a way that changes rounding.
///
/// ```
/// use formula_lagrangian::{Function, Graph, Operation};
/// let mut graph = Graph::new();
/// let q = graph.position(0);
/// let a = graph.unary(Function::Sin, q);
/// let b = graph.unary(Function::Sin, q);
/// assert_eq!(a, b);
/// let zero = graph.number(0.0);
/// assert_eq!(graph.binary(Operation::Add, a, zero), a);
/// ```
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    inputs: Vec<Inputs>,
    shapes: Vec<Shape>,
    index: HashMap<Node, Id>,
    tables: Vec<Table>,
}

impl Graph {
    /// A graph without nodes.
    pub fn new() -> Self {
        Self::default()
    }

    /// A graph without nodes, with the tables of another one.
    pub(crate) fn with_tables_of(other: &Graph) -> Self {
        Graph { tables: other.tables.clone(), ..Self::default() }
    }

    /// The tables to which nodes refer by their index.
    pub fn tables(&self) -> &[Table] {
        &self.tables
    }

    pub(crate) fn push_table(&mut self, table: Table) {
        self.tables.push(table);
    }

    /// The number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether it has no nodes.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The content of a node; the number 0 for a node that is not of this graph.
    pub fn node(&self, id: Id) -> Node {
        self.nodes.get(id.index()).copied().unwrap_or(Node::Number(0))
    }

    /// The inputs on which a node depends.
    pub(crate) fn inputs(&self, id: Id) -> Inputs {
        self.inputs.get(id.index()).copied().unwrap_or(Inputs::NONE)
    }

    /// Whether a node consists only of numbers and parameters.
    pub fn is_constant(&self, id: Id) -> bool {
        self.inputs(id) == Inputs::NONE
    }

    /// The value of a node that is a number.
    pub fn as_number(&self, id: Id) -> Option<f64> {
        match self.node(id) {
            Node::Number(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    pub(crate) fn intern(&mut self, node: Node) -> Id {
        if let Some(id) = self.index.get(&node) {
            return *id;
        }
        let id = Id(self.nodes.len() as u32);
        let own = match node {
            Node::Position(_) => Inputs::POSITION,
            Node::Velocity(_) => Inputs::VELOCITY,
            Node::Action => Inputs::ACTION,
            Node::Time => Inputs::TIME,
            _ => Inputs::NONE,
        };
        let inputs = node.operands().fold(own, |all, a| all.and(self.inputs(a)));
        let shape = self.shape_of(node);
        self.nodes.push(node);
        self.inputs.push(inputs);
        self.shapes.push(shape);
        self.index.insert(node, id);
        id
    }

    /// The known properties of the values of a node.
    pub(crate) fn shape(&self, id: Id) -> Shape {
        self.shapes.get(id.index()).copied().unwrap_or_default()
    }

    fn shape_of(&self, node: Node) -> Shape {
        use Function::{Abs, Asinh, Atan, Cos, Cosh, Exp, ExpM1, Neg, Sin, Sinh, Tanh, Versine};
        let shape = |id: Id| self.shape(id);
        let positive = |id: Id| self.as_number(id).is_some_and(|x| x > 0.0 && x.is_finite());
        let bounded = match node {
            Node::Number(bits) => f64::from_bits(bits).is_finite(),
            Node::Unary(Abs | Asinh | Atan | Cos | Cosh | Exp | ExpM1 | Neg | Sin | Sinh | Tanh | Versine, a) => {
                shape(a).bounded
            }
            Node::Unary(..) => false,
            Node::Binary(Operation::Add | Operation::Sub | Operation::Mul | Operation::Min | Operation::Max, a, b) => {
                shape(a).bounded && shape(b).bounded
            }
            Node::Binary(Operation::Div, a, b) => shape(a).bounded && self.is_constant(b),
            Node::Binary(..) => false,
            Node::Powi(a, n) => n > 0 && shape(a).bounded,
            Node::Select(all) => all.iter().all(|a| shape(*a).bounded),
            Node::Table { argument, .. } => shape(argument).bounded,
            _ => true,
        };
        let sum_of = |known: fn(Shape) -> bool, factor: &dyn Fn(Id) -> bool| match node {
            Node::Binary(Operation::Mul, a, b) if a == b => bounded,
            Node::Binary(Operation::Mul, a, b) => {
                known(shape(a)) && (factor(b) || known(shape(b))) || known(shape(b)) && factor(a)
            }
            Node::Binary(Operation::Add, a, b) => known(shape(a)) && known(shape(b)),
            Node::Binary(Operation::Div, a, b) => known(shape(a)) && factor(b),
            Node::Powi(_, n) => bounded && n % 2 == 0,
            Node::Unary(Versine, _) => bounded,
            _ => false,
        };
        let squares = sum_of(|shape| shape.squares, &positive);
        let parameter = |id: Id| self.is_constant(id) && self.as_number(id).is_none();
        let flat = sum_of(|shape| shape.flat, &|id| positive(id) || parameter(id));
        Shape { bounded, squares, flat }
    }

    /// A number.
    pub fn number(&mut self, x: f64) -> Id {
        // Zeros of both signs are one node, and all NaN are one node.
        let x = if x == 0.0 { 0.0 } else { x };
        self.intern(Node::Number(if x.is_nan() { f64::NAN } else { x }.to_bits()))
    }

    /// The parameter with this index.
    pub fn parameter(&mut self, index: u32) -> Id {
        self.intern(Node::Parameter(index))
    }

    /// The coordinate with this index.
    pub fn position(&mut self, index: u32) -> Id {
        self.intern(Node::Position(index))
    }

    /// The velocity of a coordinate.
    pub fn velocity(&mut self, index: u32) -> Id {
        self.intern(Node::Velocity(index))
    }

    /// The action z.
    pub fn action(&mut self) -> Id {
        self.intern(Node::Action)
    }

    /// The time t.
    pub fn time(&mut self) -> Id {
        self.intern(Node::Time)
    }

    /// A function of a node.
    pub fn unary(&mut self, function: Function, a: Id) -> Id {
        if let Some(x) = self.as_number(a) {
            let y = function.value(x);
            return self.number(y);
        }
        match (function, self.node(a)) {
            (Function::Neg, Node::Unary(Function::Neg, b)) => b,
            (Function::Neg, Node::Binary(Operation::Sub, b, c)) => self.sub(c, b),
            (Function::Neg, Node::Binary(Operation::Mul, b, c)) if self.is_constant(c) => {
                let c = self.unary(Function::Neg, c);
                self.mul(b, c)
            }
            (Function::Recip, Node::Unary(Function::Recip, b)) => b,
            (Function::Abs, _) if self.shape(a).squares => a,
            // Roots of powers are simplified, since the results have derivatives where the root has none.
            (Function::Sqrt, Node::Binary(Operation::Mul, b, c)) if b == c => self.unary(Function::Abs, b),
            (Function::Sqrt, Node::Powi(b, n)) if n % 2 == 0 => {
                let base = if n % 4 == 0 { b } else { self.unary(Function::Abs, b) };
                self.powi(base, n / 2)
            }
            // Even and odd functions.
            (Function::Cos | Function::Cosh | Function::Abs | Function::Versine, Node::Unary(Function::Neg, b)) => {
                self.unary(function, b)
            }
            (f, Node::Unary(Function::Neg, b)) if f.is_odd() => {
                let positive = self.unary(f, b);
                self.neg(positive)
            }
            _ => self.intern(Node::Unary(function, a)),
        }
    }

    /// A function of two nodes. A power whose exponent depends on the state is `e^(b ln a)`.
    pub fn binary(&mut self, operation: Operation, a: Id, b: Id) -> Id {
        match operation {
            Operation::Add => self.add(a, b),
            Operation::Sub => self.sub(a, b),
            Operation::Mul => self.mul(a, b),
            Operation::Div => self.div(a, b),
            Operation::Power => self.power(a, b),
            Operation::Min | Operation::Max if a == b => a,
            _ => match (self.as_number(a), self.as_number(b)) {
                (Some(x), Some(y)) => self.number(operation.value(x, y)),
                _ => self.intern(Node::Binary(operation, a, b)),
            },
        }
    }

    pub(crate) fn neg(&mut self, a: Id) -> Id {
        self.unary(Function::Neg, a)
    }

    pub(crate) fn recip(&mut self, a: Id) -> Id {
        self.unary(Function::Recip, a)
    }

    /// The operand of a node that is a change of sign.
    fn negated(&self, a: Id) -> Option<Id> {
        match self.node(a) {
            Node::Unary(Function::Neg, b) => Some(b),
            _ => None,
        }
    }

    /// The operands of a commutative operation in canonical order: numbers last.
    fn ordered(&self, a: Id, b: Id) -> (Id, Id) {
        let key = |id: Id| (self.as_number(id).is_some(), id);
        if key(a) <= key(b) { (a, b) } else { (b, a) }
    }

    pub(crate) fn add(&mut self, a: Id, b: Id) -> Id {
        let (a, b) = self.ordered(a, b);
        match (self.as_number(a), self.as_number(b)) {
            (Some(x), Some(y)) => return self.number(x + y),
            (None, Some(0.0)) => return a,
            _ => {}
        }
        match (self.negated(a), self.negated(b)) {
            (_, Some(b)) => self.sub(a, b),
            (Some(a), None) => self.sub(b, a),
            _ if a == b => {
                let two = self.number(2.0);
                self.mul(a, two)
            }
            _ => self.intern(Node::Binary(Operation::Add, a, b)),
        }
    }

    pub(crate) fn sub(&mut self, a: Id, b: Id) -> Id {
        if a == b {
            return self.number(0.0);
        }
        match (self.as_number(a), self.as_number(b)) {
            (_, Some(y)) => {
                let minus = self.number(-y);
                return self.add(a, minus);
            }
            (Some(0.0), None) => return self.neg(b),
            _ => {}
        }
        match (self.negated(a), self.negated(b)) {
            (_, Some(b)) => self.add(a, b),
            (Some(a), None) => {
                let sum = self.add(a, b);
                self.neg(sum)
            }
            _ => self.intern(Node::Binary(Operation::Sub, a, b)),
        }
    }

    /// The square of an absolute value, of a root or of a length, simplified to an expression without a kink.
    fn square_of(&mut self, a: Id) -> Option<Id> {
        match self.node(a) {
            Node::Unary(Function::Abs, b) => Some(self.mul(b, b)),
            Node::Unary(Function::Sqrt, b) if self.shape(b).squares => Some(b),
            Node::Binary(Operation::Hypot, b, c) => {
                let (b, c) = (self.mul(b, b), self.mul(c, c));
                Some(self.add(b, c))
            }
            _ => None,
        }
    }

    pub(crate) fn mul(&mut self, a: Id, b: Id) -> Id {
        let (a, b) = self.ordered(a, b);
        if a == b
            && let Some(square) = self.square_of(a)
        {
            return square;
        }
        match (self.as_number(a), self.as_number(b)) {
            (Some(x), Some(y)) => return self.number(x * y),
            (None, Some(0.0)) => return b,
            (None, Some(1.0)) => return a,
            (None, Some(-1.0)) => return self.neg(a),
            (None, Some(y)) => {
                if let Some(a) = self.negated(a) {
                    let minus = self.number(-y);
                    return self.mul(a, minus);
                }
                // If one of two factors is a power of two, their product is exact.
                if let Some((c, x)) = self.scaled(a)
                    && (is_power_of_two(x) || is_power_of_two(y))
                    && (x * y).is_normal()
                {
                    let factor = self.number(x * y);
                    return self.mul(c, factor);
                }
                return self.intern(Node::Binary(Operation::Mul, a, b));
            }
            _ => {}
        }
        for (first, second) in [(a, b), (b, a)] {
            if let Some(first) = self.negated(first).filter(|a| !self.is_constant(*a)) {
                let product = self.mul(first, second);
                return self.neg(product);
            }
            if let Some((c, x)) = self.scaled(first)
                && is_power_of_two(x)
            {
                let product = self.mul(c, second);
                let factor = self.number(x);
                return self.mul(product, factor);
            }
        }
        self.intern(Node::Binary(Operation::Mul, a, b))
    }

    /// The node and the number of a product with a number.
    fn scaled(&self, a: Id) -> Option<(Id, f64)> {
        match self.node(a) {
            Node::Binary(Operation::Mul, b, c) => self.as_number(c).map(|x| (b, x)),
            _ => None,
        }
    }

    pub(crate) fn div(&mut self, a: Id, b: Id) -> Id {
        match (self.as_number(a), self.as_number(b)) {
            (Some(x), Some(y)) => return self.number(x / y),
            (_, Some(1.0)) => return a,
            (_, Some(y)) if is_power_of_two(y) && y.recip().is_normal() => {
                let factor = self.number(y.recip());
                return self.mul(a, factor);
            }
            (Some(0.0), None) => return a,
            (Some(1.0), None) => return self.recip(b),
            _ => {}
        }
        match (self.negated(a), self.negated(b)) {
            (Some(a), Some(b)) => self.div(a, b),
            (Some(c), None) => {
                let quotient = self.div(c, b);
                self.neg(quotient)
            }
            (None, Some(c)) => {
                let quotient = self.div(a, c);
                self.neg(quotient)
            }
            _ => self.intern(Node::Binary(Operation::Div, a, b)),
        }
    }

    /// An integer power.
    pub fn powi(&mut self, a: Id, n: i32) -> Id {
        if let Some(x) = self.as_number(a) {
            return self.number(x.powi(n));
        }
        match n {
            0 => self.number(1.0),
            1 => a,
            2 => self.mul(a, a),
            -1 => self.recip(a),
            _ if n % 2 == 0
                && let Some(square) = self.square_of(a) =>
            {
                self.powi(square, n / 2)
            }
            _ => match self.negated(a) {
                Some(b) if n % 2 == 0 => self.powi(b, n),
                Some(b) => {
                    let power = self.powi(b, n);
                    self.neg(power)
                }
                None => self.intern(Node::Powi(a, n)),
            },
        }
    }

    /// A power: a product for an integer exponent, a power of the square root for half of an odd integer.
    fn power(&mut self, a: Id, b: Id) -> Id {
        match (self.as_number(a), self.as_number(b)) {
            (Some(x), Some(y)) => self.number(Operation::Power.value(x, y)),
            (None, Some(y)) if y.fract() == 0.0 && y.abs() <= 1e9 => self.powi(a, y as i32),
            (None, Some(y)) if (2.0 * y).fract() == 0.0 && y.abs() <= 32.0 => {
                let root = self.unary(Function::Sqrt, a);
                self.powi(root, (2.0 * y) as i32)
            }
            _ if self.is_constant(b) => self.intern(Node::Binary(Operation::Power, a, b)),
            _ => {
                let log = self.unary(Function::Ln, a);
                let exponent = self.mul(b, log);
                self.unary(Function::Exp, exponent)
            }
        }
    }

    /// `then` if `a < b`, else `otherwise`.
    pub fn select(&mut self, [a, b, then, otherwise]: [Id; 4]) -> Id {
        if then == otherwise {
            return then;
        }
        match (self.as_number(a), self.as_number(b)) {
            (Some(x), Some(y)) if x < y => then,
            (Some(x), Some(y)) if x >= y => otherwise,
            _ => self.intern(Node::Select([a, b, then, otherwise])),
        }
    }

    /// Checks that the indices of coordinates and parameters are within the given numbers.
    pub(crate) fn check(&self, dimension: usize, parameters: usize) -> Result<(), FormulaError> {
        for node in &self.nodes {
            let (what, index, count) = match *node {
                Node::Position(i) => ("coordinate", i, dimension),
                Node::Velocity(i) => ("velocity", i, dimension),
                Node::Parameter(i) => ("parameter", i, parameters),
                _ => continue,
            };
            if index as usize >= count {
                return Err(FormulaError::Unknown { what, index: index as usize, count });
            }
        }
        Ok(())
    }

    /// The values of all constant nodes for given values of the parameters; 0 for the other nodes.
    pub(crate) fn constants(&self, parameters: &[f64]) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.nodes.len());
        for (node, inputs) in self.nodes.iter().zip(&self.inputs) {
            let of = |id: Id| values.get(id.index()).copied().unwrap_or(0.0);
            let value = match *node {
                _ if *inputs != Inputs::NONE => 0.0,
                Node::Number(bits) => f64::from_bits(bits),
                Node::Parameter(i) => parameters.get(i as usize).copied().unwrap_or(f64::NAN),
                Node::Unary(f, a) => f.value(of(a)),
                Node::Binary(o, a, b) => o.value(of(a), of(b)),
                Node::Powi(a, n) => of(a).powi(n),
                Node::Select([a, b, c, d]) => contact_geom::Scalar::if_less(of(a), of(b), of(c), of(d)),
                Node::Table { table, order, argument } => {
                    let table = self.tables.get(table as usize);
                    table.map_or(f64::NAN, |table| table.derivative(usize::from(order), of(argument)))
                }
                _ => 0.0,
            };
            values.push(value);
        }
        values
    }
}

/// Known properties of the values of a node, from its expression.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shape {
    /// The node and its derivatives are finite wherever its inputs are, except for overflow.
    pub bounded: bool,
    /// The node is a sum of squares of bounded nodes, and so not negative.
    pub squares: bool,
    /// The same up to factors that are parameters: the gradient is 0 where the node is 0, and at most of the size of
    /// the root of the node nearby.
    pub flat: bool,
}

/// Whether products with a number are exact.
fn is_power_of_two(x: f64) -> bool {
    x.is_normal() && x.to_bits() << 12 == 0
}
