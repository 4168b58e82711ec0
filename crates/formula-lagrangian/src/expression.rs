//! Expressions beside the Lagrangian: columns and events.

use crate::evaluation::At;
use crate::formula::{index, used_parameters};
use crate::names::Names;
use crate::node::Inputs;
use crate::parser::{MOST_NODES, OfMotion, Parser};
use crate::tape::Tape;
use crate::{Formula, FormulaError, Function, Graph, Id, Operation};
use contact_geom::Scalar;

/// An expression over the names of a formula, to be evaluated along a motion; made by [`Formula::expression`].
///
/// ```
/// use formula_lagrangian::Formula;
/// let formula = Formula::parse("x'^2/2 - x^2/2 + gamma*z", &["x"], &[("gamma", -0.1)])?;
/// let scaled = formula.expression("exp(-gamma*t)*x")?;
/// assert_eq!(scaled.at(0.0, &[2.0], &[0.0], 0.0), 2.0);
/// # Ok::<(), formula_lagrangian::FormulaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Expression {
    names: Names,
    graph: Graph,
    root: Id,
    tape: Tape,
    values: Vec<f64>,
    /// How many of the parameters are the formula's.
    given: usize,
    inputs: Inputs,
}

/// The parameter that has the logarithm of the conformal factor, behind those of the formula.
const LOG_FACTOR: &str = "log_factor";

/// What motions of a formula have beside their state.
fn of_motion(graph: &mut Graph, formula: &Formula, sigma: Option<Id>) -> Result<OfMotion, FormulaError> {
    let velocities: Vec<Id> = (0..formula.dimension()).map(|i| graph.velocity(i as u32)).collect();
    let limit = graph.len() + 10 * MOST_NODES;
    let too_large = FormulaError::TooLarge { limit };
    let momenta = graph.gradient(formula.root, &velocities, limit).ok_or(too_large)?;
    let mut work = graph.number(0.0);
    for (v, p) in velocities.into_iter().zip(&momenta) {
        let product = graph.mul(v, *p);
        work = graph.add(work, product);
    }
    let energy = graph.binary(Operation::Sub, work, formula.root);
    Ok(OfMotion { energy, momenta, sigma })
}

impl Expression {
    /// A text over the names of a formula, and of what its motions have beside their state; with the conformal factor where it is `named`, a
    /// column.
    pub(crate) fn parse(formula: &Formula, text: &str, named: bool) -> Result<Self, FormulaError> {
        let (mut names, mut values) = (formula.names.clone(), formula.values.clone());
        let mut graph = Graph::new();
        let is_free =
            |name: &str| !names.parameters.iter().chain(names.blocks.iter().map(|b| &b.name)).any(|n| n == name);
        let mut sigma = None;
        if named && is_free(LOG_FACTOR) {
            let log_factor = graph.parameter(names.parameters.len() as u32);
            sigma = Some(graph.unary(Function::Exp, log_factor));
            names.parameters.push(LOG_FACTOR.to_owned());
            values.push(f64::NAN);
        }
        let of_motion = if text.contains("energy") || text.contains("p_") {
            // Nodes of the formula, and then those of its parameters, keep their numbers.
            graph = formula.graph.clone();
            if sigma.is_some() {
                let log_factor = graph.parameter(names.parameters.len() as u32 - 1);
                sigma = Some(graph.unary(Function::Exp, log_factor));
            }
            of_motion(&mut graph, formula, sigma)?
        } else {
            // Neither is in a text that does not have it.
            let none = graph.number(f64::NAN);
            OfMotion { energy: none, momenta: Vec::new(), sigma }
        };
        let root = Parser::parse_along(text, &names, &mut graph, named, Some(of_motion))?;
        let tape = Tape::new(&graph, &[root], names.dimension).ok_or(FormulaError::TooLarge { limit: MOST_NODES })?;
        let inputs = graph.inputs(root);
        let mut expression = Expression { names, graph, root, tape, values, given: formula.values.len(), inputs };
        expression.tape.set_constants(&expression.graph.constants(&expression.values));
        Ok(expression)
    }

    /// The value at a time and a state, over any number. Not a number where a slice has fewer entries than there are coordinates.
    pub fn at<T: Scalar>(&self, t: T, q: &[T], v: &[T], z: T) -> T {
        let mut value = T::from(f64::NAN);
        if let (Some(q), Some(v)) = (q.get(..self.names.dimension), v.get(..self.names.dimension)) {
            self.tape.evaluate::<T, 0>(At { q, v, z, t }, &mut [std::slice::from_mut(&mut value)]);
        }
        value
    }

    /// Whether it depends on velocities.
    pub fn has_velocity(&self) -> bool {
        self.inputs.meets(Inputs::VELOCITY)
    }

    /// Whether it depends on the conformal factor since the start, so that a state alone does not tell it.
    pub fn has_conformal_factor(&self) -> bool {
        self.used_parameters().any(|name| name == LOG_FACTOR) && self.names.parameters.len() > self.given
    }

    /// The same expression where the logarithm of the conformal factor is this number.
    #[must_use]
    pub fn with_log_factor(&self, log_factor: f64) -> Self {
        let mut there = self.clone();
        if let Some(last) = there.values.get_mut(self.given) {
            *last = log_factor;
        }
        there.tape.set_constants(&there.graph.constants(&there.values));
        there
    }

    /// Whether it depends on the action.
    pub fn has_action(&self) -> bool {
        self.inputs.meets(Inputs::ACTION)
    }

    /// The parameters on which it depends, in their order.
    pub fn used_parameters(&self) -> impl Iterator<Item = &str> {
        used_parameters(&self.names, &self.graph, self.root)
    }

    /// Gives a parameter another value, without reading the text anew.
    ///
    /// # Errors
    /// [`FormulaError::UnknownParameter`], [`FormulaError::ParameterValue`].
    pub fn set(&mut self, parameter: &str, value: f64) -> Result<(), FormulaError> {
        let i = index(&self.names, parameter, value)?;
        if let Some(old) = self.values.get_mut(i) {
            *old = value;
        }
        self.tape.set_constants(&self.graph.constants(&self.values));
        Ok(())
    }
}
