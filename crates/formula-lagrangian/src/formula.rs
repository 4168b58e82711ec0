//! Formulas: an expression graph with the names of its coordinates and parameters.

use crate::forces::Forces;
use crate::names::{FormulaNames, Names};
use crate::node::Inputs;
use crate::parser::{MOST_NODES, Parser, ValueName};
use crate::resets::FormulaReset;
use crate::{Expression, FormulaError, FormulaHamiltonian, FormulaLagrangian, Graph, Id, Node};

/// A Lagrangian `L(t, q, v, z)` or a contact Hamiltonian `H(t, q, p, z)` that is given at run time: an expression of
/// coordinates, velocities or momenta, z, t and parameters, with names chosen by the user.
///
/// The language is described in the [crate's documentation](crate). [`lagrangian`](Self::lagrangian) returns the
/// Lagrangian for integrators, [`hamiltonian`](Self::hamiltonian) the Hamiltonian.
///
/// ```
/// use formula_lagrangian::Formula;
/// let pendulum = Formula::parse("theta'^2/2 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)])?;
/// assert_eq!(pendulum.coordinates(), ["theta"]);
/// let error = Formula::parse("theta'^2/2 + cos(teta)", &["theta"], &[]).unwrap_err();
/// assert!(error.to_string().starts_with("line 1, column 18: unknown name `teta`; did you mean `theta`?"));
/// # Ok::<(), formula_lagrangian::FormulaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Formula {
    pub(crate) names: Names,
    pub(crate) graph: Graph,
    pub(crate) root: Id,
    pub(crate) values: Vec<f64>,
    pub(crate) forces: Forces,
    /// The times at which steps end, as given by the user.
    pub(crate) breaks: Vec<f64>,
    pub(crate) resets: Vec<FormulaReset>,
    /// The functions of the coordinates that vanish.
    pub(crate) constraints: Vec<Id>,
}

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

    fn new(graph: Graph, root: Id, names: Names, values: Vec<f64>) -> Self {
        Formula {
            names,
            graph,
            root,
            values,
            forces: Forces::default(),
            breaks: Vec::new(),
            resets: Vec::new(),
            constraints: Vec::new(),
        }
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

    /// The Lagrangian for integrators, with its derivatives and its proved structure. Its type is compiled once for
    /// each dimension, for all formulas.
    ///
    /// # Errors
    /// [`FormulaError::OtherDimension`] unless the formula has `N` coordinates, [`FormulaError::TooLarge`],
    /// [`FormulaError::IsHamiltonian`].
    pub fn lagrangian<const N: usize>(&self) -> Result<FormulaLagrangian<N>, FormulaError> {
        FormulaLagrangian::new(self)
    }

    /// The same with at least as many coordinates. Each coordinate beyond those of the formula is that of an uncoupled
    /// free particle of mass 1, which stays at rest if it starts at rest. For programs that are not compiled for each
    /// dimension.
    ///
    /// ```
    /// use formula_lagrangian::Formula;
    /// let three = Formula::parse("sum(i, 0, n-1, v[i]^2 - q[i]^2)/2", &["x[3]"], &[])?;
    /// assert!(three.lagrangian::<4>().is_err() && three.lagrangian_within::<4>().is_ok());
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::OtherDimension`] if the formula has more than `N` coordinates, [`FormulaError::TooLarge`].
    pub fn lagrangian_within<const N: usize>(&self) -> Result<FormulaLagrangian<N>, FormulaError> {
        FormulaLagrangian::within(self)
    }

    /// The contact Hamiltonian for integrators, with its derivatives and its proved structure.
    ///
    /// # Errors
    /// [`FormulaError::OtherDimension`] unless the formula has `N` coordinates, [`FormulaError::TooLarge`],
    /// [`FormulaError::IsLagrangian`].
    pub fn hamiltonian<const N: usize>(&self) -> Result<FormulaHamiltonian<N>, FormulaError> {
        FormulaHamiltonian::new(self)
    }

    /// The same with at least as many coordinates. `p^2/2` is added for each one beyond those of the formula, which
    /// stays at rest if it starts at rest.
    ///
    /// # Errors
    /// Those of [`hamiltonian`](Self::hamiltonian); the formula may have less than `N` coordinates.
    pub fn hamiltonian_within<const N: usize>(&self) -> Result<FormulaHamiltonian<N>, FormulaError> {
        FormulaHamiltonian::within(self)
    }

    /// Another expression over the same names, such as the function of an event.
    ///
    /// # Errors
    /// [`FormulaError::Parse`], [`FormulaError::TooLarge`].
    pub fn expression(&self, text: &str) -> Result<Expression, FormulaError> {
        Expression::parse(self, text, ValueName::Function)
    }

    /// The same, where the value may have a name that is not in use, as in `E = x'^2/2 + x^2/2`.
    ///
    /// # Errors
    /// Those of [`expression`](Self::expression).
    pub fn named_expression(&self, text: &str) -> Result<Expression, FormulaError> {
        Expression::parse(self, text, ValueName::Any)
    }

    /// The number of coordinates.
    pub fn dimension(&self) -> usize {
        self.names.dimension
    }

    /// The names of the coordinates in their order, such as `x` or `q[0]`.
    pub fn coordinates(&self) -> Vec<String> {
        self.names.coordinates().collect()
    }

    /// The names of the momenta in their order, such as `p_x` or `p_q[0]`.
    pub fn momenta(&self) -> Vec<String> {
        self.names.momenta()
    }

    /// The name of the action: `z` unless another one was given.
    pub fn action(&self) -> &str {
        &self.names.action
    }

    /// Whether it is a Hamiltonian, and not a Lagrangian.
    pub fn is_hamiltonian(&self) -> bool {
        self.names.are_of_hamiltonian()
    }

    /// Whether L or H depends on the action.
    pub fn has_action(&self) -> bool {
        self.graph.inputs(self.root).meets(Inputs::ACTION)
    }

    /// The parameters with their values, in their order.
    pub fn parameters(&self) -> impl Iterator<Item = (&str, f64)> {
        self.names.parameters.iter().map(String::as_str).zip(self.values.iter().copied())
    }

    /// The parameters on which the Lagrangian, a force, a reset or a constraint depends, in their order.
    pub fn used_parameters(&self) -> impl Iterator<Item = &str> {
        let needed = self.graph.needed_by(&self.roots());
        let is_used = move |i: usize| {
            let mut nodes = needed.iter().enumerate().filter(|(_, needed)| **needed).map(|(id, _)| Id(id as u32));
            nodes.any(|id| self.graph.node(id) == Node::Parameter(i as u32))
        };
        self.names.parameters.iter().enumerate().filter(move |(i, _)| is_used(*i)).map(|(_, name)| name.as_str())
    }

    /// Refuses what only a Lagrangian has.
    pub(crate) fn check_is_lagrangian(&self, what: &'static str, remedy: &'static str) -> Result<(), FormulaError> {
        if self.is_hamiltonian() { Err(FormulaError::IsHamiltonian { what, remedy }) } else { Ok(()) }
    }

    /// The nodes of all that the formula consists of.
    fn roots(&self) -> Vec<Id> {
        let of_resets = self.resets.iter().flat_map(FormulaReset::roots);
        let constraints = self.constraints.iter().copied();
        std::iter::once(self.root).chain(self.forces.roots()).chain(of_resets).chain(constraints).collect()
    }

    /// Sets the value of a parameter.
    ///
    /// # Errors
    /// [`FormulaError::UnknownParameter`], [`FormulaError::ParameterValue`].
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError> {
        let i = index(&self.names, parameter, value)?;
        if let Some(old) = self.values.get_mut(i) {
            *old = value;
        }
        Ok(())
    }
}

/// The index of a parameter that is set to a value; both are checked.
pub(crate) fn index(names: &Names, parameter: &str, value: f64) -> Result<usize, FormulaError> {
    let Some(i) = names.parameters.iter().position(|name| name == parameter) else {
        let known = match names.parameters.as_slice() {
            [] => "the formula has no parameters".to_owned(),
            some => format!("the parameters of the formula are {}", some.join(", ")),
        };
        return Err(FormulaError::UnknownParameter { name: parameter.to_owned(), known });
    };
    if !value.is_finite() {
        return Err(FormulaError::ParameterValue { name: parameter.to_owned(), value });
    }
    Ok(i)
}
