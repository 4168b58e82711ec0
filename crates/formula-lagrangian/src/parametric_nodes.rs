//! Evaluation of expressions whose parameters are numbers of any scalar type.

use crate::evaluation::{At, power};
use crate::functions::{atan2, hypot};
use crate::{Graph, Id, Node, Operation};
use contact_geom::{Scalar, table::Table};

/// Nodes of a graph with all that they depend on. In a [`Tape`](crate::tape::Tape) the values of parameters are
/// constants; here they are inputs like coordinates, so that an expression can be differentiated with respect to them.
#[derive(Clone, Debug, Default)]
pub(crate) struct ParametricNodes {
    /// The operands of a node precede it; they are given by their index in this list.
    nodes: Vec<Node>,
    results: Vec<Id>,
    tables: Vec<Table>,
}

impl ParametricNodes {
    /// The expressions of some nodes.
    pub fn new(graph: &Graph, results: &[Id]) -> Self {
        let needed = graph.needed_by(results);
        let mut nodes: Vec<Node> = Vec::new();
        let mut images: Vec<Id> = Vec::with_capacity(needed.len());
        for (i, needed) in needed.into_iter().enumerate() {
            images.push(Id(nodes.len() as u32));
            if needed {
                nodes.push(with_operands(graph.node(Id(i as u32)), |a| image(&images, a)));
            }
        }
        let has_table = nodes.iter().any(|node| matches!(node, Node::Table { .. }));
        let tables = if has_table { graph.tables().to_vec() } else { Vec::new() };
        ParametricNodes { nodes, results: results.iter().map(|id| image(&images, *id)).collect(), tables }
    }

    /// The number of results.
    pub fn len(&self) -> usize {
        self.results.len()
    }

    /// Evaluates the nodes for values of the parameters, and writes the results. An input that is missing is NaN.
    ///
    /// A power whose exponent contains a parameter does not depend on the exponent where its base is not positive: it
    /// is defined there for isolated exponents only.
    pub fn evaluate<T: Scalar>(&self, theta: &[T], at: At<'_, T>, results: &mut [T]) {
        // One copy of the code for each scalar type.
        T::apart(
            #[inline(always)]
            || {
                let mut values: Vec<T> = Vec::with_capacity(self.nodes.len());
                for node in &self.nodes {
                    let value = self.value(*node, theta, at, &values);
                    values.push(value);
                }
                for (to, id) in results.iter_mut().zip(&self.results) {
                    *to = get(&values, id.index());
                }
            },
        );
    }

    /// The value of a node, from those of its operands.
    #[inline(always)]
    fn value<T: Scalar>(&self, node: Node, theta: &[T], at: At<'_, T>, values: &[T]) -> T {
        let of = |id: Id| get(values, id.index());
        match node {
            Node::Number(bits) => T::from(f64::from_bits(bits)),
            Node::Parameter(i) => get(theta, i as usize),
            Node::Position(i) => get(at.q, i as usize),
            Node::Velocity(i) => get(at.v, i as usize),
            Node::Action => at.z,
            Node::Time => at.t,
            Node::Unary(f, a) => f.value(of(a)),
            Node::Binary(operation, a, b) => match (operation, self.number(b)) {
                (Operation::Add, Some(k)) => of(a) + k,
                (Operation::Add, None) => of(a) + of(b),
                (Operation::Sub, _) => of(a) - of(b),
                (Operation::Mul, Some(k)) => of(a) * k,
                (Operation::Mul, None) => of(a) * of(b),
                (Operation::Div, Some(k)) => of(a) / k,
                (Operation::Div, None) => of(a) / of(b),
                (Operation::Min, _) => Scalar::min(of(a), of(b)),
                (Operation::Max, _) => Scalar::max(of(a), of(b)),
                (Operation::Atan2, _) => atan2(of(a), of(b)),
                (Operation::Hypot, _) => hypot(of(a), of(b)),
                (Operation::Power, Some(k)) => power(of(a), k),
                (Operation::Power, None) => power_of(of(a), of(b)),
            },
            Node::Powi(a, n) => of(a).powi(n),
            Node::Select([a, b, then, otherwise]) => of(a).if_less(of(b), of(then), of(otherwise)),
            Node::Table { table, order, argument } => match self.tables.get(table as usize) {
                Some(table) => table.derivative(usize::from(order), of(argument)),
                None => T::from(f64::NAN),
            },
        }
    }

    /// The value of a node that is a number.
    #[inline(always)]
    fn number(&self, id: Id) -> Option<f64> {
        match self.nodes.get(id.index()) {
            Some(Node::Number(bits)) => Some(f64::from_bits(*bits)),
            _ => None,
        }
    }
}

/// `x^b` for an exponent that may have derivatives, with the rounding of a power with a constant exponent.
#[inline(always)]
fn power_of<T: Scalar>(x: T, b: T) -> T {
    let exponent = b.re();
    let fixed = power(x, exponent);
    // Its value is 1, and its derivatives are those of `x^b` in b.
    let change = ((b - exponent) * x.ln()).exp();
    T::zero().if_less(x, fixed * change, fixed)
}

#[inline(always)]
fn get<T: Scalar>(values: &[T], index: usize) -> T {
    values.get(index).copied().unwrap_or_else(|| T::from(f64::NAN))
}

fn image(images: &[Id], of: Id) -> Id {
    images.get(of.index()).copied().unwrap_or(of)
}

/// The node with other operands.
fn with_operands(node: Node, of: impl Fn(Id) -> Id) -> Node {
    match node {
        Node::Unary(f, a) => Node::Unary(f, of(a)),
        Node::Binary(operation, a, b) => Node::Binary(operation, of(a), of(b)),
        Node::Powi(a, n) => Node::Powi(of(a), n),
        Node::Select(all) => Node::Select(all.map(of)),
        Node::Table { table, order, argument } => Node::Table { table, order, argument: of(argument) },
        Node::Number(_) | Node::Parameter(_) | Node::Position(_) | Node::Velocity(_) | Node::Action | Node::Time => {
            node
        }
    }
}
