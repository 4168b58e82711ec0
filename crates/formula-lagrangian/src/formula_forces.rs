//! Formulas with forces.

use crate::forces::given_twice;
use crate::limits::MOST_NODES;
use crate::parser::{Kind, Parser, Target, ValueName};
use crate::{Formula, FormulaError, Graph, Id};

/// What a Hamiltonian does not have, and what to do.
const NO_FORCES: (&str, &str) = ("forces", "write drag as a term in the action, or give a Lagrangian with forces");

impl Formula {
    /// The same formula with a force on a coordinate, in addition to what it has: the equations of motion are
    /// `d/dt L_v - L_q - L_z L_v = f(t, q, v, z)`. The coordinate is given by its name (`x`, `u[2]`, `q[0]`) or by its
    /// index (`0`). `u[i]` with an unused name as index is each entry of an array; the text then contains the index.
    /// The text may have definitions of its own, but does not see those of the Lagrangian.
    ///
    /// ```
    /// use contact_geom::{Lagrangian, VelocityPoint};
    /// use formula_lagrangian::Formula;
    /// let free = Formula::parse("(x'^2 + y'^2)/2", &["x", "y"], &[("c", 0.5)])?;
    /// let falling = free.with_force("y", "-9.81 - c*y'")?.with_force("x", "-c*x'")?;
    /// let x = VelocityPoint::new([0.0, 0.0], [2.0, 0.0], 0.0);
    /// assert_eq!(falling.lagrangian::<2>()?.applied_force(0.0, &x).as_slice(), [-1.0, -9.81]);
    /// // The same in the text of the Lagrangian.
    /// let text = "force[y] = -9.81 - c*y'; force[x] = -c*x'; L = (x'^2 + y'^2)/2";
    /// assert!(Formula::parse(text, &["x", "y"], &[("c", 0.5)])?.has_forces());
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::Parse`]; [`FormulaError::Target`] if there is no such coordinate, or if it has a force;
    /// [`FormulaError::TooLarge`].
    pub fn with_force(&self, coordinate: &str, text: &str) -> Result<Self, FormulaError> {
        self.with_forces(&[(coordinate, text)])
    }

    /// The same formula with forces on several coordinates; see [`with_force`](Self::with_force).
    ///
    /// # Errors
    /// Those of [`with_force`](Self::with_force); [`FormulaError::IsHamiltonian`].
    pub fn with_forces(&self, forces: &[(&str, &str)]) -> Result<Self, FormulaError> {
        self.check_is_lagrangian(NO_FORCES.0, NO_FORCES.1)?;
        let mut formula = self.clone();
        for (coordinate, text) in forces {
            let mut graph = Graph::new();
            let target = self.target(coordinate, &mut graph)?;
            if target.kind != Kind::Position {
                return Err(FormulaError::target(
                    coordinate,
                    "a force belongs to a coordinate, not to a velocity or z",
                ));
            }
            for (i, index) in target.indices() {
                let Formula { names, graph, .. } = &mut formula;
                let force = Parser::new(text, names, graph, ValueName::Any)?.with_index(index).program()?;
                if !formula.forces.set(i, force, formula.names.dimension) {
                    return Err(FormulaError::target(coordinate, given_twice(&formula.names, i)));
                }
            }
        }
        formula.sized()
    }

    /// The same formula with the force `-dR/dv` of Rayleigh's dissipation function `R(t, q, v, z)`, as by a line
    /// `rayleigh = ...` in the text of the Lagrangian. It is added to the forces, and to the function that the formula
    /// has.
    ///
    /// # Errors
    /// [`FormulaError::Parse`], [`FormulaError::TooLarge`].
    pub fn with_rayleigh(&self, text: &str) -> Result<Self, FormulaError> {
        self.check_is_lagrangian(NO_FORCES.0, NO_FORCES.1)?;
        let mut formula = self.clone();
        let Formula { names, graph, .. } = &mut formula;
        let rayleigh = Parser::new(text, names, graph, ValueName::Any)?.program()?;
        formula.add_rayleigh(rayleigh);
        formula.sized()
    }

    /// A formula [from a graph](Self::from_graph) with forces that are nodes of the same graph, in the order of the
    /// coordinates. Those that are left out are 0.
    ///
    /// ```
    /// use formula_lagrangian::{Formula, Function, Graph, Operation};
    /// let mut graph = Graph::new();
    /// let v = graph.velocity(0);
    /// let kinetic = graph.binary(Operation::Mul, v, v);
    /// let drag = graph.unary(Function::Neg, v);
    /// assert!(Formula::from_graph(graph, kinetic, &["x"], &[])?.with_force_nodes(&[Some(drag)])?.has_forces());
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::ForceTwice`]; [`FormulaError::Unknown`] if there are more forces than coordinates;
    /// [`FormulaError::ForeignNode`].
    pub fn with_force_nodes(mut self, forces: &[Option<Id>]) -> Result<Self, FormulaError> {
        self.check_is_lagrangian(NO_FORCES.0, NO_FORCES.1)?;
        let dimension = self.names.dimension;
        if forces.len() > dimension {
            return Err(FormulaError::Unknown { what: "force", index: dimension, count: dimension });
        }
        for (i, force) in forces.iter().enumerate() {
            let Some(force) = *force else { continue };
            self.check_node(force)?;
            if !self.forces.set(i as u32, force, dimension) {
                let coordinate = self.names.coordinates().nth(i).unwrap_or_default();
                return Err(FormulaError::ForceTwice { coordinate });
            }
        }
        Ok(self)
    }

    /// The same for [Rayleigh's function](Self::with_rayleigh).
    ///
    /// # Errors
    /// [`FormulaError::ForeignNode`].
    pub fn with_rayleigh_node(mut self, rayleigh: Id) -> Result<Self, FormulaError> {
        self.check_is_lagrangian(NO_FORCES.0, NO_FORCES.1)?;
        self.check_node(rayleigh)?;
        self.add_rayleigh(rayleigh);
        Ok(self)
    }

    /// Whether it has forces.
    pub fn has_forces(&self) -> bool {
        self.forces.roots().next().is_some()
    }

    /// What a text assigns. Its indices are evaluated in any graph.
    pub(crate) fn target<'a>(&'a self, text: &'a str, graph: &'a mut Graph) -> Result<Target<'a>, FormulaError> {
        let target = Parser::new(text, &self.names, graph, ValueName::Any).and_then(Parser::only_target);
        target.map_err(FormulaError::Target)
    }

    fn add_rayleigh(&mut self, rayleigh: Id) {
        self.forces.rayleigh = Some(match self.forces.rayleigh {
            Some(other) => self.graph.add(other, rayleigh),
            None => rayleigh,
        });
    }

    /// Checks that the graph has a node.
    pub(crate) fn check_node(&self, id: Id) -> Result<(), FormulaError> {
        if id.index() < self.graph.len() { Ok(()) } else { Err(FormulaError::ForeignNode) }
    }

    /// The formula itself, if it is not too large.
    pub(crate) fn sized(self) -> Result<Self, FormulaError> {
        if self.graph.len() > MOST_NODES {
            return Err(FormulaError::TooLarge { limit: MOST_NODES });
        }
        Ok(self)
    }
}
