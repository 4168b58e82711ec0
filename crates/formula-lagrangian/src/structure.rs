//! Proofs of structural properties of a Lagrangian from its graph.

use crate::node::Inputs;
use crate::{Graph, Id, Node, Operation};
use contact_geom::Structure;

/// The derivatives of L that the proofs use, in the order of the coordinates.
pub(crate) struct Partials<'a> {
    pub value: Id,
    pub q: &'a [Id],
    pub v: &'a [Id],
    pub z: Id,
    /// Second derivatives with respect to all pairs of q and v.
    pub second: &'a [Id],
    /// Second derivatives with respect to pairs of velocities.
    pub mass: &'a [Id],
}

/// The properties that hold for all values of the parameters, and those that follow from the present value of `L_z`.
///
/// Each follows from the inputs on which the derivatives depend as they are written, so that a property may hold
/// without being claimed. Derivatives hide kinks and jumps, so that nothing is claimed in coordinates on which one
/// depends.
pub(crate) fn proved(graph: &mut Graph, l: &Partials<'_>, constants: &[f64]) -> Structure {
    use Inputs as In;
    let on = |ids: &[Id]| ids.iter().fold(In::NONE, |all, id| all.and(graph.inputs(*id)));
    let (rate, rate_inputs) = (l.z, graph.inputs(l.z));
    let (time, state) = (In::TIME, In::POSITION.and(In::VELOCITY).and(In::ACTION));
    let inputs = graph.inputs(l.value);
    let kinks = kinks(graph, l.value);
    let smooth_in = |coordinates: Inputs| !kinks.meets(coordinates);

    let no_action = inputs.within(time.and(In::POSITION).and(In::VELOCITY));
    let no_rate = smooth_in(In::ACTION) && rate_inputs == In::NONE && value(graph, rate, constants) == Some(0.0);
    let z_affine = no_action || smooth_in(In::ACTION) && rate_inputs.within(time);
    let constant_rate = no_action || z_affine && rate_inputs == In::NONE;
    let constant_mass = smooth_in(In::VELOCITY) && on(l.mass) == In::NONE;
    let quadratic = z_affine && smooth_in(state) && on(l.second).within(time);
    let separable = constant_mass && is_split(graph, l) && {
        let at_rest = l.v.iter().map(|p| graph.at_rest(*p)).collect::<Vec<_>>();
        at_rest.into_iter().all(|p| graph.as_number(p) == Some(0.0))
    };
    Structure {
        autonomous: inputs.within(state),
        z_free: no_action || no_rate,
        z_affine,
        constant_rate,
        separable,
        quadratic,
        constant_mass,
    }
}

/// Whether the function is `T(y) + V(t, q) + f(t, z)`.
pub(crate) fn is_split(graph: &Graph, l: &Partials<'_>) -> bool {
    use Inputs as In;
    let on = |ids: &[Id]| ids.iter().fold(In::NONE, |all, id| all.and(graph.inputs(*id)));
    on(l.q).within(In::TIME.and(In::POSITION))
        && on(l.v).within(In::VELOCITY)
        && graph.inputs(l.z).within(In::TIME.and(In::ACTION))
        && kinks(graph, l.value).within(In::TIME.and(In::POSITION))
}

/// The value of a constant node.
fn value(graph: &Graph, id: Id, constants: &[f64]) -> Option<f64> {
    graph.as_number(id).or_else(|| constants.get(id.index()).copied())
}

/// The inputs on which the kinks and jumps of a node depend.
pub(crate) fn kinks(graph: &Graph, of: Id) -> Inputs {
    let needed = graph.needed(of);
    let all = (0..=of.index()).filter(|i| needed[*i]).map(|i| Id(i as u32));
    all.fold(Inputs::NONE, |kinks, id| match graph.node(id) {
        Node::Unary(f, a) if !f.is_smooth() => kinks.and(graph.inputs(a)),
        Node::Binary(Operation::Min | Operation::Max, a, b) => kinks.and(graph.inputs(a)).and(graph.inputs(b)),
        // `atan2` jumps on a half-axis, and neither has a derivative at the origin.
        Node::Binary(Operation::Atan2 | Operation::Hypot, a, b) => kinks.and(graph.inputs(a)).and(graph.inputs(b)),
        Node::Select([a, b, ..]) => kinks.and(graph.inputs(a)).and(graph.inputs(b)),
        Node::Table { argument, .. } => kinks.and(graph.inputs(argument)),
        _ => kinks,
    })
}

impl Graph {
    /// For each node up to `of`, whether `of` contains it.
    pub(crate) fn needed(&self, of: Id) -> Vec<bool> {
        self.needed_by(&[of])
    }

    /// For each node up to the last of some nodes, whether one of them contains it.
    pub(crate) fn needed_by(&self, of: &[Id]) -> Vec<bool> {
        let mut needed = vec![false; of.iter().map(|id| id.index() + 1).max().unwrap_or(0)];
        of.iter().for_each(|id| needed[id.index()] = true);
        for i in (0..needed.len()).rev() {
            if needed[i] {
                self.node(Id(i as u32)).operands().for_each(|a| needed[a.index()] = true);
            }
        }
        needed
    }

    /// The node with all velocities set to 0, simplified.
    pub(crate) fn at_rest(&mut self, of: Id) -> Id {
        let zero = self.number(0.0);
        self.replaced(of, |node| matches!(node, Node::Velocity(_)).then_some(zero))
    }
}
