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
        let mut images: Vec<Option<Id>> = Vec::with_capacity(needed.len());
        for (i, needed) in needed.into_iter().enumerate() {
            let image = |id: Id| images.get(id.index()).copied().flatten();
            let found = match of.graph.node(Id(i as u32)) {
                _ if !needed => None,
                Node::Number(bits) => Some(self.number(f64::from_bits(bits))),
                Node::Parameter(k) => Some(*at.parameters.get(k as usize)?),
                Node::Position(k) => Some(*at.q.get(k as usize)?),
                Node::Velocity(k) => Some(*at.v.get(k as usize)?),
                Node::Action => Some(at.z),
                Node::Time => Some(at.t),
                Node::Unary(function, a) => Some(self.unary(function, image(a)?)),
                Node::Binary(operation, a, b) => {
                    let (a, b) = (image(a)?, image(b)?);
                    Some(self.binary(operation, a, b))
                }
                Node::Powi(a, n) => Some(self.powi(image(a)?, n)),
                Node::Select([a, b, then, otherwise]) => {
                    let all = [image(a)?, image(b)?, image(then)?, image(otherwise)?];
                    Some(self.select(all))
                }
                Node::Table { .. } => return None,
            };
            images.push(found);
        }
        images.get(of.root.index()).copied().flatten()
    }
}
