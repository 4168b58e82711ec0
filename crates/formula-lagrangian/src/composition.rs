//! Formulas at other nodes of a graph.

use crate::{Formula, Graph, Id, Node};

/// The nodes that stand in the places of the inputs of a formula.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'i> {
    /// Of the time.
    pub t: Id,
    /// Of the coordinates.
    pub q: &'i [Id],
    /// Of the velocities.
    pub v: &'i [Id],
    /// Of the action.
    pub z: Id,
    /// Of the parameters.
    pub parameters: &'i [Id],
}

impl Graph {
    /// The Lagrangian of a formula, with nodes of this graph in the places of its inputs: what a discrete Lagrangian such as
    /// `h L(t + h/2, (q0 + q1)/2, (q1 - q0)/h, z0)` consists of. `None` where an input is missing, and for a formula with
    /// tables.
    ///
    /// ```
    /// use contact_geom::{Lagrangian, nalgebra::SVector};
    /// use formula_lagrangian::{Formula, Graph, Inputs, Operation};
    /// let spring = Formula::parse("x'^2/2 - k*x^2/2", &["x"], &[("k", 2.0)])?;
    /// let mut graph = Graph::new();
    /// let [q, v, k] = [graph.position(0), graph.velocity(0), graph.parameter(0)];
    /// let (t, z, two) = (graph.time(), graph.action(), graph.number(2.0));
    /// let doubled = graph.binary(Operation::Mul, two, q);
    /// let inputs = Inputs { t, q: &[doubled], v: &[v], z, parameters: &[k] };
    /// let root = graph.composed(&spring, inputs).ok_or("no inputs")?;
    /// let stiff = Formula::from_graph(graph, root, &["x"], &[("k", 2.0)])?;
    /// // v^2/2 - k (2 x)^2/2
    /// let at = stiff.lagrangian::<1>()?;
    /// assert_eq!(at.value(0.0, &SVector::from([3.0]), &SVector::from([4.0]), 0.0), 8.0 - 36.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn composed(&mut self, of: &Formula, at: Inputs<'_>) -> Option<Id> {
        let needed = of.graph.needed(of.root);
        let mut images: Vec<Id> = Vec::with_capacity(needed.len());
        for (i, needed) in needed.into_iter().enumerate() {
            let image = match of.graph.node(Id(i as u32)) {
                // Nothing that is needed contains it.
                _ if !needed => at.t,
                Node::Number(bits) => self.number(f64::from_bits(bits)),
                Node::Parameter(k) => *at.parameters.get(k as usize)?,
                Node::Position(k) => *at.q.get(k as usize)?,
                Node::Velocity(k) => *at.v.get(k as usize)?,
                Node::Action => at.z,
                Node::Time => at.t,
                Node::Table { .. } => return None,
                node => self.with_operands(node, |a| images.get(a.index()).copied().unwrap_or(a)),
            };
            images.push(image);
        }
        images.last().copied()
    }

    /// A node with others in the places of some of the nodes that it contains, simplified.
    pub(crate) fn replaced(&mut self, of: Id, by: impl Fn(Node) -> Option<Id>) -> Id {
        let needed = self.needed(of);
        let mut images: Vec<Id> = Vec::with_capacity(needed.len());
        for (i, needed) in needed.into_iter().enumerate() {
            let id = Id(i as u32);
            let image = match self.node(id) {
                _ if !needed => id,
                node => match by(node) {
                    Some(other) => other,
                    None => self.with_operands(node, |a| images.get(a.index()).copied().unwrap_or(a)),
                },
            };
            images.push(image);
        }
        images.last().copied().unwrap_or(of)
    }

    /// A node with other operands, simplified.
    fn with_operands(&mut self, node: Node, image: impl Fn(Id) -> Id) -> Id {
        match node {
            Node::Unary(function, a) => self.unary(function, image(a)),
            Node::Binary(operation, a, b) => self.binary(operation, image(a), image(b)),
            Node::Powi(a, n) => self.powi(image(a), n),
            Node::Select(all) => self.select(all.map(image)),
            Node::Table { table, order, argument } => self.lookup(table, order, image(argument)),
            input => self.intern(input),
        }
    }
}
