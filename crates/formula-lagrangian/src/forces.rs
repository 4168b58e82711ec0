//! The forces of a formula.

use crate::names::Names;
use crate::{Graph, Id};

/// The name of Rayleigh's function in a text.
pub(crate) const RAYLEIGH: &str = "rayleigh";

/// The forces on the coordinates, and Rayleigh's function R, whose force is `-dR/dv`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forces {
    /// The force on each coordinate, as far as it is given; empty if none is.
    pub components: Vec<Option<Id>>,
    pub rayleigh: Option<Id>,
}

impl Forces {
    /// Gives the force on a coordinate. Returns whether there was none before.
    pub fn set(&mut self, i: u32, force: Id, dimension: usize) -> bool {
        self.components.resize(dimension, None);
        match self.components.get_mut(i as usize) {
            Some(component @ None) => *component = Some(force),
            _ => return false,
        }
        true
    }

    /// Adds a force on a coordinate to what it has.
    pub fn add(&mut self, i: u32, force: Id, dimension: usize, graph: &mut Graph) {
        self.components.resize(dimension, None);
        if let Some(component) = self.components.get_mut(i as usize) {
            *component = Some(component.map_or(force, |known| graph.add(known, force)));
        }
    }

    /// The nodes that are given.
    pub fn roots(&self) -> impl Iterator<Item = Id> {
        self.components.iter().copied().chain([self.rayleigh]).flatten()
    }

    /// The total force on each of the coordinates. It is empty if there are no forces, or if all of them are 0; `None`
    /// if the graph would be too large.
    pub fn total(&self, graph: &mut Graph, dimension: usize, limit: usize) -> Option<Vec<Id>> {
        if self.roots().next().is_none() {
            return Some(Vec::new());
        }
        let zero = graph.number(0.0);
        let mut total: Vec<Id> =
            (0..dimension).map(|i| self.components.get(i).copied().flatten().unwrap_or(zero)).collect();
        if let Some(rayleigh) = self.rayleigh {
            let velocities: Vec<Id> = (0..dimension).map(|i| graph.velocity(i as u32)).collect();
            let slopes = graph.gradient(rayleigh, &velocities, limit)?;
            for (force, slope) in total.iter_mut().zip(slopes) {
                *force = graph.sub(*force, slope);
            }
        }
        if total.iter().all(|force| *force == zero) {
            total.clear();
        }
        Some(total)
    }
}

/// The message on a second force on a coordinate.
pub(crate) fn given_twice(names: &Names, i: u32) -> String {
    let name = names.coordinates().nth(i as usize).unwrap_or_default();
    format!("the force on `{name}` is given twice; write one sum")
}

/// Whether the force does no work along a symmetry, so that the momentum of the symmetry is dissipated as without the
/// force. It may be so without being detected.
pub(crate) struct Work<'a> {
    graph: Graph,
    total: &'a [Id],
}

impl<'a> Work<'a> {
    pub fn new(graph: &Graph, total: &'a [Id]) -> Self {
        // Without a force nothing is computed in the graph.
        Work { graph: if total.is_empty() { Graph::new() } else { graph.clone() }, total }
    }

    fn force(&mut self, i: usize) -> Id {
        self.total.get(i).copied().unwrap_or_else(|| self.graph.number(0.0))
    }

    /// Along a common translation of some coordinates.
    pub fn vanishes_along(&mut self, set: &[usize]) -> bool {
        if self.total.is_empty() {
            return true;
        }
        let mut sum = self.graph.number(0.0);
        for i in set {
            let force = self.force(*i);
            sum = self.graph.add(sum, force);
        }
        self.graph.as_number(sum) == Some(0.0)
    }

    /// Along a common rotation of pairs of coordinates.
    pub fn vanishes_around(&mut self, pairs: &[(usize, usize)]) -> bool {
        if self.total.is_empty() {
            return true;
        }
        let mut sum = self.graph.number(0.0);
        for (i, j) in pairs {
            let (x, y) = (self.graph.position(*i as u32), self.graph.position(*j as u32));
            let (fx, fy) = (self.force(*i), self.force(*j));
            let [ahead, back] = [(x, fy), (y, fx)].map(|(q, f)| self.graph.mul(q, f));
            let torque = self.graph.sub(ahead, back);
            sum = self.graph.add(sum, torque);
        }
        self.graph.as_number(sum) == Some(0.0)
    }
}
