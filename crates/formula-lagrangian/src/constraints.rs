//! Holonomic constraints of formulas.

use crate::evaluation::{At, whole_vector};
use crate::parametric_nodes::ParametricNodes;
use crate::parser::{Parser, ValueName, not_holonomic};
use crate::{Formula, FormulaError, FormulaLagrangian, Graph, Id, Node, Operation};
use contact_geom::constraints::Constraint;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Dual, Scalar, vector};

/// What a Hamiltonian does not have, and what to do.
const NO_CONSTRAINTS: (&str, &str) = ("holonomic constraints", "give a Lagrangian");

impl Formula {
    /// The same formula with more holonomic constraints: equations over the coordinates and the parameters, as
    /// `x^2 + y^2 = l^2`, or expressions that vanish, as `x^2 + y^2 - l^2`. A text may begin with definitions, as that
    /// of a Lagrangian. [`FormulaLagrangian`] implements [`Constraint`] by them.
    ///
    /// ```
    /// use contact_geom::{constraints::Constraint, nalgebra::SVector};
    /// use formula_lagrangian::Formula;
    /// let free = Formula::parse("(x'^2 + y'^2)/2 - 9.81*y", &["x", "y"], &[("l", 2.0)])?;
    /// let pendulum = free.with_constraints(&["x^2 + y^2 = l^2"])?.lagrangian::<2>()?;
    /// assert_eq!((pendulum.count(), pendulum.value(&SVector::from([2.0, 1.0]))[0]), (1, 1.0));
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::Parse`] with the position in the text, also where a constraint contains velocities, t, the
    /// action, a kink or a jump, and where it is constant; [`FormulaError::Constraints`] if there are as many
    /// constraints as coordinates; [`FormulaError::Constraint`] if the formula has resets;
    /// [`FormulaError::IsHamiltonian`]; [`FormulaError::TooLarge`].
    pub fn with_constraints(&self, texts: &[&str]) -> Result<Self, FormulaError> {
        let mut formula = self.clone();
        let mut found = Vec::with_capacity(texts.len());
        for text in texts {
            let Formula { names, graph, .. } = &mut formula;
            found.push(Parser::new(text, names, graph, ValueName::Any)?.equation()?);
        }
        let mut formula = formula.sized()?.with_constraint_nodes(&found)?;
        let last = formula.constraint_texts.len() - texts.len();
        formula.constraint_texts.iter_mut().skip(last).zip(texts).for_each(|(to, text)| *to = text.trim().to_owned());
        Ok(formula)
    }

    /// A formula [from a graph](Self::from_graph) with more holonomic constraints `c(q) = 0`, which are nodes of the same
    /// graph.
    ///
    /// # Errors
    /// [`FormulaError::ForeignNode`]; otherwise those of [`with_constraints`](Self::with_constraints), with
    /// [`FormulaError::Constraint`] for those of a text.
    pub fn with_constraint_nodes(mut self, constraints: &[Id]) -> Result<Self, FormulaError> {
        if constraints.is_empty() {
            return Ok(self);
        }
        self.check_is_lagrangian(NO_CONSTRAINTS.0, NO_CONSTRAINTS.1)?;
        if self.resets() > 0 {
            return Err(FormulaError::Constraint { why: WITH_RESETS });
        }
        for id in constraints {
            self.check_node(*id)?;
            let why = not_holonomic(self.graph.inputs(*id));
            let needed = self.graph.needed(*id);
            let mut nodes = (0..needed.len()).filter(|i| needed.get(*i) == Some(&true));
            let why = why.or_else(|| {
                let kink = nodes.any(|i| self.graph.has_kink(Id(i as u32)));
                kink.then_some("contains a kink or a jump, such as `abs` or `if`; give a smooth function")
            });
            let constant = self.graph.is_constant(*id);
            let why = why.or(constant.then_some("does not depend on a coordinate; give a function of coordinates"));
            if let Some(why) = why {
                return Err(FormulaError::Constraint { why });
            }
        }
        self.constraints.extend(constraints);
        self.constraint_texts.resize(self.constraints.len(), String::new());
        let (found, coordinates) = (self.constraints.len(), self.names.dimension);
        if found >= coordinates {
            return Err(FormulaError::Constraints { found, coordinates });
        }
        Ok(self)
    }

    /// The number of holonomic constraints.
    pub fn constraints(&self) -> usize {
        self.constraints.len()
    }

    /// The text of a constraint; `None` where there is none, and for one that was given as a node of the graph.
    pub fn constraint_text(&self, index: usize) -> Option<&str> {
        self.constraint_texts.get(index).map(String::as_str).filter(|text| !text.is_empty())
    }

    /// Refuses resets of a formula with constraints.
    pub(crate) fn check_has_no_constraints(&self) -> Result<(), FormulaError> {
        if self.constraints.is_empty() { Ok(()) } else { Err(FormulaError::Constraint { why: WITH_RESETS }) }
    }
}

/// Why resets and constraints are not combined.
const WITH_RESETS: &str = "cannot be combined with resets and impacts, after which the state may violate it; remove \
                           one of the two, or end the run at a terminal event";

impl Graph {
    /// Whether the value of a node itself has a kink or a jump in the state, whatever its operands are.
    pub(crate) fn has_kink(&self, of: Id) -> bool {
        match self.node(of) {
            Node::Unary(f, a) => !f.is_smooth() && !self.is_constant(a),
            Node::Binary(Operation::Min | Operation::Max, ..) | Node::Select(_) | Node::Table { .. } => {
                !self.is_constant(of)
            }
            _ => false,
        }
    }
}

/// The constraints of the formula, of which there may be any number below N: values beyond their
/// [`count`](Constraint::count) are 0.
impl<const N: usize> Constraint<N, N> for FormulaLagrangian<N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, q: &SVector<T, N>) -> SVector<T, N> {
        let mut c: SVector<T, N> = vector!(|_| T::zero());
        let at = At::new(T::zero(), q, q, T::zero());
        self.derived().constraints.evaluate::<T, N>(at, &mut [c.as_mut_slice()]);
        whole_vector(&c)
    }

    fn count(&self) -> usize {
        self.derived().formula.constraints.len()
    }

    fn in_parameter(&self, parameter: usize, q: &SVector<f64, N>) -> Option<(SVector<f64, N>, SMatrix<f64, N, N>)> {
        let Formula { graph, constraints, names, values, .. } = &self.derived().formula;
        let needed = graph.needed_by(constraints);
        let is_parameter = |i: usize| graph.node(Id(i as u32)) == Node::Parameter(parameter as u32);
        if !(0..needed.len()).any(|i| needed[i] && is_parameter(i)) {
            return None;
        }
        let nodes = ParametricNodes::new(graph, constraints);
        // The coordinates move along all axes, and the parameter along itself.
        let still = |re: f64| Dual::<Along, SVector<Along, N>>::constant(Along::constant(re));
        let mut x = q.map(still);
        (0..N).for_each(|i| x[i].d[i].re = 1.0);
        let mut theta: Vec<_> = values.iter().map(|value| still(*value)).collect();
        if let Some(theta) = theta.get_mut(parameter) {
            theta.re.d[0] = 1.0;
        }
        let n = names.dimension;
        let mut c = vec![still(0.0); constraints.len()];
        let at = At { q: x.as_slice().get(..n)?, v: x.as_slice().get(..n)?, z: still(0.0), t: still(0.0) };
        nodes.evaluate(&theta, at, &mut c);
        let of_value = SVector::from_fn(|a, _| c.get(a).map_or(0.0, |c| c.re.d[0]));
        Some((of_value, SMatrix::from_fn(|a, i| c.get(a).map_or(0.0, |c| c.d[i].d[0]))))
    }
}

/// A number with its derivative in a parameter.
type Along = Dual<f64, SVector<f64, 1>>;
