//! Formulas: an expression graph with the names of its coordinates and parameters.

use crate::forces::Forces;
use crate::modes::Mode;
use crate::names::Names;
use crate::node::Inputs;
use crate::resets::FormulaReset;
use crate::{FormulaError, Graph, Id, Node};

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
    /// Their texts, empty for those that were given as nodes.
    pub(crate) constraint_texts: Vec<String>,
    /// The modes of coordinates with friction or with a resting contact, which are the last coordinates.
    pub(crate) modes: Vec<Mode>,
}

impl Formula {
    pub(crate) fn new(graph: Graph, root: Id, names: Names, values: Vec<f64>) -> Self {
        Formula {
            names,
            graph,
            root,
            values,
            forces: Forces::default(),
            breaks: Vec::new(),
            resets: Vec::new(),
            constraints: Vec::new(),
            modes: Vec::new(),
            constraint_texts: Vec::new(),
        }
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
