//! Expressions beside the Lagrangian: columns and events.

use crate::evaluation::At;
use crate::formula::index;
use crate::names::Names;
use crate::node::Inputs;
use crate::parser::{MOST_NODES, Parser};
use crate::tape::Tape;
use crate::{Formula, FormulaError, Graph};
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
    tape: Tape,
    values: Vec<f64>,
    inputs: Inputs,
}

impl Expression {
    pub(crate) fn parse(formula: &Formula, text: &str, named: bool) -> Result<Self, FormulaError> {
        let (names, values) = (formula.names.clone(), formula.values.clone());
        let mut graph = Graph::new();
        let root = Parser::parse(text, &names, &mut graph, named)?;
        let tape = Tape::new(&graph, &[root], names.dimension).ok_or(FormulaError::TooLarge { limit: MOST_NODES })?;
        let inputs = graph.inputs(root);
        let mut expression = Expression { names, graph, tape, values, inputs };
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

    /// Whether it depends on the action.
    pub fn has_action(&self) -> bool {
        self.inputs.meets(Inputs::ACTION)
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
