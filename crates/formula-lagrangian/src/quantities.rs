//! Quantities of a motion by name, for expressions that belong to a Lagrangian: energy, momenta, and the conformal
//! factor.

use crate::limits::MOST_NODES;
use crate::names::Names;
use crate::node::{Function, Id, Node, Operation};
use crate::{Formula, Graph};

/// The maximum number of nodes of an expression with the derivatives of L in it: as many as L with its gradient may
/// have.
const MOST_NODES_WITH_DERIVATIVES: usize = 10 * MOST_NODES;

/// The meaning of a name in addition to those of a formula. Coordinates, parameters and definitions of the same name
/// take precedence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Quantity {
    /// `energy`: `v . L_v - L`, or H.
    Energy,
    /// `log_factor`: the logarithm of the conformal factor, the integral of `L_z` along the motion since its start.
    LogFactor,
    /// `sigma`: the conformal factor.
    Sigma,
    /// `p_x`: the momentum `L_v` of the coordinate with this index.
    Momentum(u32),
    /// `x'` beside a Hamiltonian: the velocity `H_p` of the coordinate with this index.
    Velocity(u32),
}

/// The names except those of momenta.
const NAMES: [(&str, Quantity); 3] =
    [("energy", Quantity::Energy), ("log_factor", Quantity::LogFactor), ("sigma", Quantity::Sigma)];

impl Quantity {
    /// The quantity with this name, except for momenta.
    pub fn of(name: &str) -> Option<Self> {
        NAMES.iter().find(|(known, _)| *known == name).map(|(_, quantity)| *quantity)
    }

    /// All names, those of the momenta of arrays without an index.
    pub fn names(names: &Names) -> impl Iterator<Item = String> {
        let of_lagrangian = |_: &_| !names.are_of_hamiltonian();
        let momenta = names.blocks.iter().filter(of_lagrangian).map(|block| format!("p_{}", block.name));
        NAMES.iter().map(|(name, _)| (*name).to_owned()).chain(momenta)
    }

    /// The node of the quantity in the graph of an expression; `None` if the graph would be too large.
    pub fn node(self, formula: &Formula, graph: &mut Graph) -> Option<Id> {
        let log_factor = log_factor(graph, formula.names.dimension);
        let (first, count) = match self {
            Quantity::Energy if formula.is_hamiltonian() => return Some(graph.copied(&formula.graph, formula.root)),
            Quantity::LogFactor => return Some(log_factor),
            Quantity::Sigma => return Some(graph.unary(Function::Exp, log_factor)),
            Quantity::Energy => (0, formula.names.dimension),
            Quantity::Momentum(i) | Quantity::Velocity(i) => (i as usize, 1),
        };
        let value = graph.copied(&formula.graph, formula.root);
        let velocities: Vec<Id> = (first..first + count).map(|i| graph.velocity(i as u32)).collect();
        let momenta = graph.gradient(value, &velocities, MOST_NODES_WITH_DERIVATIVES)?;
        if let Quantity::Momentum(_) | Quantity::Velocity(_) = self {
            return momenta.first().copied();
        }
        let mut sum = graph.number(0.0);
        for (v, p) in velocities.into_iter().zip(momenta) {
            let product = graph.binary(Operation::Mul, v, p);
            sum = graph.binary(Operation::Add, sum, product);
        }
        Some(graph.binary(Operation::Sub, sum, value))
    }
}

/// The node of the logarithm of the conformal factor. It is not a function of the state, and is represented by one more
/// coordinate.
fn log_factor(graph: &mut Graph, dimension: usize) -> Id {
    graph.position(dimension as u32)
}

impl Graph {
    /// Whether a node depends on the logarithm of the conformal factor.
    pub(crate) fn has_log_factor(&self, of: Id, dimension: usize) -> bool {
        let needed = self.needed(of);
        let mut nodes = needed.iter().enumerate().filter(|(_, needed)| **needed).map(|(i, _)| self.node(Id(i as u32)));
        nodes.any(|node| node == Node::Position(dimension as u32))
    }

    /// Copies a node of another graph with all nodes on which it depends.
    fn copied(&mut self, from: &Graph, root: Id) -> Id {
        let zero = self.number(0.0);
        let needed = from.needed(root);
        let mut copies = vec![zero; needed.len()];
        for i in (0..needed.len()).filter(|i| needed[*i]) {
            let of = |id: Id| copies.get(id.index()).copied().unwrap_or(zero);
            copies[i] = match from.node(Id(i as u32)) {
                Node::Number(bits) => self.number(f64::from_bits(bits)),
                Node::Parameter(i) => self.parameter(i),
                Node::Position(i) => self.position(i),
                Node::Velocity(i) => self.velocity(i),
                Node::Action => self.action(),
                Node::Time => self.time(),
                Node::Unary(function, a) => self.unary(function, of(a)),
                Node::Binary(operation, a, b) => self.binary(operation, of(a), of(b)),
                Node::Powi(a, n) => self.powi(of(a), n),
                Node::Select(all) => self.select(all.map(of)),
                Node::Table { table, order, argument } => match from.tables().get(table as usize) {
                    Some(table) => {
                        let (index, argument) = (self.add_table(table), of(argument));
                        self.lookup(index, order, argument)
                    }
                    None => self.number(f64::NAN),
                },
            };
        }
        copies.last().copied().unwrap_or(zero)
    }
}
