//! Formulas from texts and from graphs.

use crate::limits::MOST_NODES;
use crate::names::{FormulaNames, Names};
use crate::parser::Parser;
use crate::{Formula, FormulaError, Graph, Id};

impl Formula {
    /// Parses a text over coordinates and over parameters with their values. The coordinate `"q[3]"` is an array of
    /// three.
    ///
    /// # Errors
    /// [`FormulaError::Parse`] with the position in the text; [`FormulaError::Name`], [`FormulaError::Dimension`],
    /// [`FormulaError::ParameterValue`] if a name, the number of coordinates or a value is invalid.
    pub fn parse(text: &str, coordinates: &[&str], parameters: &[(&str, f64)]) -> Result<Self, FormulaError> {
        Self::parse_lagrangian(text, &FormulaNames::new(coordinates, parameters))
    }

    /// Parses a text over all kinds of names: also with tables, and with an action that is not named z.
    ///
    /// # Errors
    /// Those of [`parse`](Self::parse).
    pub fn parse_lagrangian(text: &str, names: &FormulaNames<'_>) -> Result<Self, FormulaError> {
        Self::of_text(text, names, false)
    }

    /// Parses the text of a contact Hamiltonian `H(t, q, p, z)`, in which the momentum of `x` is `p_x`, or has the name
    /// that is given. `p[0]` is the momentum with the index 0, whatever its name. There are no velocities and no forces.
    ///
    /// ```
    /// use contact_geom::{HamiltonianDerivatives, PhasePoint};
    /// use formula_lagrangian::{Formula, FormulaNames};
    /// let names = FormulaNames::new(&["x"], &[("gamma", -0.1)]);
    /// let oscillator = Formula::parse_hamiltonian("p_x^2/2 + x^2/2 - gamma*z", &names)?;
    /// let field = oscillator.hamiltonian::<1>()?.contact_field(0.0, &PhasePoint::new([1.0], [2.0], 0.0));
    /// assert_eq!((field.x[0], field.y[0]), (2.0, -1.2)); // x' = p, p' = -x + gamma p
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`parse`](Self::parse), and [`FormulaError::Momenta`].
    pub fn parse_hamiltonian(text: &str, names: &FormulaNames<'_>) -> Result<Self, FormulaError> {
        Self::of_text(text, names, true)
    }

    fn of_text(text: &str, names: &FormulaNames<'_>, hamiltonian: bool) -> Result<Self, FormulaError> {
        let values = names.parameters.iter().map(|(_, value)| *value).collect();
        let mut formula = Self::new(Graph::new(), Id(0), Names::of(names, hamiltonian)?, values);
        for (name, table) in names.tables {
            formula.add_table(name, table)?;
        }
        let Formula { names, graph, root, forces, .. } = &mut formula;
        (*root, *forces) = Parser::parse_formula(text, names, graph)?;
        Ok(formula)
    }

    /// A formula that is built by a program: a node of a graph, in which coordinates and parameters are given by their
    /// indices.
    ///
    /// ```
    /// use formula_lagrangian::{Formula, Graph, Operation};
    /// let mut graph = Graph::new();
    /// let v = graph.velocity(0);
    /// let kinetic = graph.binary(Operation::Mul, v, v);
    /// let free = Formula::from_graph(graph, kinetic, &["x"], &[])?;
    /// assert!(free.lagrangian::<1>()?.proved().quadratic);
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`parse`](Self::parse) except for the text; [`FormulaError::TooLarge`]; [`FormulaError::Unknown`] if
    /// the graph has a coordinate or a parameter beyond those given.
    pub fn from_graph(
        graph: Graph,
        root: Id,
        coordinates: &[&str],
        parameters: &[(&str, f64)],
    ) -> Result<Self, FormulaError> {
        let values = parameters.iter().map(|(_, value)| *value).collect();
        Self::named(graph, root, Names::new(coordinates, parameters)?, values)
    }

    pub(crate) fn named(graph: Graph, root: Id, names: Names, values: Vec<f64>) -> Result<Self, FormulaError> {
        if graph.len() > MOST_NODES {
            return Err(FormulaError::TooLarge { limit: MOST_NODES });
        }
        graph.check(names.dimension, names.parameters.len())?;
        Ok(Self::new(graph, root, names, values))
    }

    /// A contact Hamiltonian that is built by a program; [`Graph::velocity`] is the momentum.
    ///
    /// # Errors
    /// Those of [`from_graph`](Self::from_graph), and [`FormulaError::Momenta`].
    pub fn hamiltonian_from_graph(graph: Graph, root: Id, names: &FormulaNames<'_>) -> Result<Self, FormulaError> {
        let values = names.parameters.iter().map(|(_, value)| *value).collect();
        Self::named(graph, root, Names::of(names, true)?, values)
    }
}
