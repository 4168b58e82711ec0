//! Expressions in addition to the Lagrangian: output columns and events.

use crate::breaks::Kinks;
use crate::evaluation::At;
use crate::formula::index;
use crate::limits::MOST_NODES;
use crate::names::Names;
use crate::node::Inputs;
use crate::parser::{Parser, ValueName};
use crate::tape::Tape;
use crate::{Formula, FormulaError, Graph, Id, Node};
use contact_geom::Scalar;

/// The number of coordinates up to which an evaluation with the conformal factor does not allocate.
const FEW_COORDINATES: usize = 16;

/// An expression over the names of a formula, evaluated along a motion; made by [`Formula::expression`].
///
/// The following names are available as well, unless a coordinate, a parameter or a definition has the name: `energy`,
/// which is `v L_v - L` and contains all terms of `L`, also those in z (`-gamma*z` for a drag `gamma*z`); `p_x`, the
/// momentum `L_v` of a coordinate `x` (`p_q[0]` in an array); `log_factor`, the integral of `L_z` along the motion
/// since its start; and `sigma`, its exponential, the conformal factor. The last two are not functions of the state,
/// see [`at_factor`](Self::at_factor). An expression that belongs to a Hamiltonian is evaluated at (t, q, p, z), in it
/// `x'` is `H_p`, and `energy` is H.
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
    pub(crate) names: Names,
    pub(crate) graph: Graph,
    pub(crate) root: Id,
    tape: Tape,
    pub(crate) values: Vec<f64>,
    inputs: Inputs,
    log_factor: bool,
}

impl Formula {
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
}

impl Expression {
    pub(crate) fn parse(formula: &Formula, text: &str, value_name: ValueName) -> Result<Self, FormulaError> {
        let (names, values) = (formula.names.clone(), formula.values.clone());
        let mut graph = Graph::with_tables_of(&formula.graph);
        let root = Parser::new(text, &names, &mut graph, value_name)?.beside(formula).program()?;
        let log_factor = graph.has_log_factor(root, names.dimension);
        let width = names.dimension + usize::from(log_factor);
        let tape = Tape::new(&graph, &[root], width).ok_or(FormulaError::TooLarge { limit: MOST_NODES })?;
        let inputs = graph.inputs(root);
        let mut expression = Expression { names, graph, root, tape, values, inputs, log_factor };
        expression.tape.set_constants(&expression.graph.constants(&expression.values));
        Ok(expression)
    }

    /// The value at a time and a state, for any scalar type. It is NaN if a slice has fewer entries than there are
    /// coordinates, or if the expression depends on the [conformal factor](Self::has_conformal_factor).
    pub fn at<T: Scalar>(&self, t: T, q: &[T], v: &[T], z: T) -> T {
        self.at_factor(t, (q, v, z), T::from(f64::NAN))
    }

    /// The same at a state `(q, v, z)` of a motion, with the logarithm of the conformal factor since its start.
    ///
    /// ```
    /// use formula_lagrangian::Formula;
    /// let formula = Formula::parse("x'^2/2 - x^2/2 + gamma*z", &["x"], &[("gamma", -0.5)])?;
    /// // v L_v - L = 1/2 (3^2 + 2^2) + 0.5 z
    /// assert_eq!(formula.expression("energy")?.at(0.0, &[2.0], &[3.0], 4.0), 8.5);
    /// assert_eq!(formula.expression("p_x/sigma")?.at_factor(0.0, (&[2.0], &[3.0], 4.0), 0.0), 3.0);
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    pub fn at_factor<T: Scalar>(&self, t: T, (q, v, z): (&[T], &[T], T), log_factor: T) -> T {
        let (mut value, n) = (T::from(f64::NAN), self.names.dimension);
        let (Some(q), Some(v)) = (q.get(..n), v.get(..n)) else { return value };
        let mut evaluate = |q: &[T], v: &[T]| {
            self.tape.evaluate::<T, 0>(At { q, v, z, t }, &mut [std::slice::from_mut(&mut value)]);
        };
        if !self.log_factor {
            evaluate(q, v);
            return value;
        }
        // The logarithm is passed as one more coordinate.
        let mut wide = |to_q: &mut [T], to_v: &mut [T]| {
            for (to, from) in to_q.iter_mut().zip(q).chain(to_v.iter_mut().zip(v)) {
                *to = *from;
            }
            if let Some(last) = to_q.last_mut() {
                *last = log_factor;
            }
            evaluate(to_q, to_v);
        };
        let (mut few_q, mut few_v) = ([T::zero(); FEW_COORDINATES + 1], [T::zero(); FEW_COORDINATES + 1]);
        match (few_q.get_mut(..=n), few_v.get_mut(..=n)) {
            (Some(to_q), Some(to_v)) => wide(to_q, to_v),
            _ => wide(&mut vec![T::zero(); n + 1], &mut vec![T::zero(); n + 1]),
        }
        value
    }

    /// Whether the expression depends on the conformal factor of the motion, `sigma` or `log_factor`.
    pub fn has_conformal_factor(&self) -> bool {
        self.log_factor
    }

    /// Whether it belongs to a Hamiltonian: it is then evaluated at momenta in the place of velocities.
    pub fn is_of_hamiltonian(&self) -> bool {
        self.names.are_of_hamiltonian()
    }

    /// Whether the expression depends on velocities, or on momenta if it belongs to a Hamiltonian.
    pub fn has_velocity(&self) -> bool {
        self.inputs.meets(Inputs::VELOCITY)
    }

    /// Whether the expression depends on time.
    pub fn has_time(&self) -> bool {
        self.inputs.meets(Inputs::TIME)
    }

    /// Whether the expression depends on the action.
    pub fn has_action(&self) -> bool {
        self.inputs.meets(Inputs::ACTION)
    }

    /// The number of the mode of [friction](Formula::with_friction) or of [resting contact](Formula::with_resting_contact) that
    /// the expression is by itself, among the coordinates; `None` for any other expression.
    pub fn mode(&self, of: &Formula) -> Option<usize> {
        match self.graph.node(self.root) {
            Node::Position(k) if k as usize >= of.given_dimension() => Some(k as usize),
            _ => None,
        }
    }

    /// The times of kinks and jumps that are known from the text, in ascending order, as 5 in `if(t > 5, 1, 0)`.
    ///
    /// # Errors
    /// [`FormulaError::TableOfState`].
    pub fn breaks(&self) -> Result<Vec<f64>, FormulaError> {
        let mut graph = self.graph.clone();
        let kinks = Kinks::of(&mut graph, &[self.root])?;
        Ok(kinks.times(&graph, &graph.constants(&self.values), &[]))
    }

    /// Sets the value of a parameter, without parsing the text again.
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
