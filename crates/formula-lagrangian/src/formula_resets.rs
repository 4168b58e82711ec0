//! Formulas with resets and impacts.

use crate::node::Inputs;
use crate::parser::{Kind, Parser, ValueName};
use crate::resets::{Change, Direction, FormulaReset, Reset, ResetNodes, Variable};
use crate::{Formula, FormulaError, Graph, Id};
use contact_geom::switching::Impact;

/// What a Hamiltonian does not have, and what to do.
pub(crate) const NO_RESETS: (&str, &str) =
    ("resets", "end the run there by a terminal event and start from the new state, or give a Lagrangian");

impl Formula {
    /// The same formula with one more reset. The variables are named as in expressions (`x`, `x'`, `u[2]`, `v[0]`,
    /// `z`), and `u'[i]` with an unused name as index is each entry of an array. All get their new values at once;
    /// those that are not named keep theirs. The expressions may contain `energy` and momenta such as `p_x`, as those
    /// of [`expression`](Self::expression), but not the conformal factor.
    ///
    /// The function `when` becomes a [switching function](contact_geom::Lagrangian::switching_functions) after those of
    /// L and of the forces, also if it depends on time alone; [`FormulaLagrangian::reset_of`] returns the number of the
    /// reset.
    ///
    /// ```
    /// use contact_geom::{switching::Control, Lagrangian, VelocityPoint};
    /// use formula_lagrangian::{Direction, Formula, Reset};
    /// let ball = Formula::parse("x'^2/2 - 9.81*x", &["x"], &[("e", 0.8)])?;
    /// let bounce = Reset { when: "x", direction: Direction::Falling, then: &[("x'", "-e*x'")], rest: None };
    /// let l = ball.with_reset(bounce)?.lagrangian::<1>()?;
    /// let bounced = l.at_switch(0, 0.0, &VelocityPoint::new([0.0], [-2.0], 1.0), false);
    /// assert_eq!(bounced, Control::Replace(VelocityPoint::new([0.0], [1.6], 1.0)));
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::Parse`]; [`FormulaError::Target`] if there is no such variable, or if it is assigned twice;
    /// [`FormulaError::Reset`] if nothing is assigned, if the function is constant, or if an expression contains the
    /// conformal factor; [`FormulaError::Constraint`] if the formula has constraints; [`FormulaError::TooLarge`].
    ///
    /// [`FormulaLagrangian::reset_of`]: crate::FormulaLagrangian::reset_of
    pub fn with_reset(&self, reset: Reset<'_>) -> Result<Self, FormulaError> {
        self.check_is_lagrangian(NO_RESETS.0, NO_RESETS.1)?;
        let mut formula = self.clone();
        let when = self.parse_beside(&mut formula.graph, reset.when, None)?;
        let then = self.assignments(&mut formula.graph, reset.then)?;
        let rest = reset.rest.map(|rest| self.assignments(&mut formula.graph, rest)).transpose()?;
        formula.sized()?.with_reset_nodes(ResetNodes { when, direction: reset.direction, then, rest })
    }

    /// A text of a reset as a node of a graph. Its index, if it is that of an array, has a value.
    pub(crate) fn parse_beside(
        &self,
        graph: &mut Graph,
        text: &str,
        index: Option<(&str, u32)>,
    ) -> Result<Id, FormulaError> {
        let parser = Parser::new(text, &self.names, graph, ValueName::Any)?;
        let id = parser.beside(self).with_index(index).program()?;
        if graph.has_log_factor(id, self.names.dimension) {
            return Err(FormulaError::Reset {
                why: "contains the conformal factor, which is no function of the state",
            });
        }
        Ok(id)
    }

    /// New values of variables, by texts.
    pub(crate) fn assignments(
        &self,
        to: &mut Graph,
        texts: &[(&str, &str)],
    ) -> Result<Vec<(Variable, Id)>, FormulaError> {
        let mut assigned: Vec<(Variable, Id)> = Vec::new();
        for (name, text) in texts {
            let mut graph = Graph::new();
            let target = self.target(name, &mut graph)?;
            for (i, index) in target.indices() {
                let variable = match target.kind {
                    Kind::Position => Variable::Position(i),
                    Kind::Velocity => Variable::Velocity(i),
                    Kind::Action => Variable::Action,
                };
                if assigned.iter().any(|(other, _)| *other == variable) {
                    return Err(FormulaError::target(name, "this variable is assigned twice in one reset"));
                }
                assigned.push((variable, self.parse_beside(to, text, index)?));
            }
        }
        Ok(assigned)
    }

    /// A formula [from a graph](Self::from_graph) with one more reset, whose expressions are nodes of the same graph.
    ///
    /// # Errors
    /// [`FormulaError::ForeignNode`]; [`FormulaError::Unknown`] if there is no such coordinate; [`FormulaError::Reset`]
    /// if nothing is assigned, if a variable is assigned twice, or if the function is constant;
    /// [`FormulaError::Constraint`] if the formula has constraints.
    pub fn with_reset_nodes(mut self, reset: ResetNodes) -> Result<Self, FormulaError> {
        self.check_is_lagrangian(NO_RESETS.0, NO_RESETS.1)?;
        self.check_has_no_constraints()?;
        let ResetNodes { when, direction, then, rest } = reset;
        let reset = FormulaReset { when, direction, change: Change::Assignment(then), rest };
        reset.roots().try_for_each(|id| self.check_node(id))?;
        if let Change::Assignment(then) = &reset.change {
            self.check_assignment(then)?;
            if then.is_empty() {
                return Err(FormulaError::Reset { why: "assigns nothing; name a variable and its new value" });
            }
        }
        self.check_assignment(reset.rest.as_deref().unwrap_or_default())?;
        if self.graph.is_constant(reset.when) {
            return Err(FormulaError::Reset { why: "has a constant in place of a function that changes its sign" });
        }
        self.resets.push(reset);
        Ok(self)
    }

    /// Checks that variables exist, and that none is assigned twice.
    fn check_assignment(&self, assigned: &[(Variable, Id)]) -> Result<(), FormulaError> {
        let count = self.names.dimension;
        let mut seen: Vec<Variable> = Vec::new();
        for (variable, _) in assigned {
            let (what, index) = match variable {
                Variable::Position(i) => ("coordinate", *i as usize),
                Variable::Velocity(i) => ("velocity", *i as usize),
                Variable::Action => ("action", 0),
            };
            if index >= count {
                return Err(FormulaError::Unknown { what, index, count });
            }
            if seen.contains(variable) {
                return Err(FormulaError::Reset { why: "assigns a variable twice" });
            }
            seen.push(*variable);
        }
        Ok(())
    }

    /// The number of resets and impacts.
    pub fn resets(&self) -> usize {
        self.resets.len()
    }

    /// The same formula with impacts on a surface: where the function `when` of t and the coordinates falls to 0, the
    /// momentum changes along its gradient by a law, which conserves energy, or multiplies the normal velocity or the
    /// contact form by a number. It counts as one of the [resets](Self::with_reset), and `rest` is that of
    /// [`Reset`](crate::Reset).
    ///
    /// ```
    /// use contact_geom::{Lagrangian, VelocityPoint, switching::{Control, Impact}};
    /// use formula_lagrangian::Formula;
    /// let thrown = Formula::parse("(x'^2 + y'^2)/2 - 9.81*y", &["x", "y"], &[])?;
    /// // A slope of 45 degrees: the normal velocity is reversed.
    /// let l = thrown.with_impact("y - x", Impact::Elastic, None)?.lagrangian::<2>()?;
    /// let falling = VelocityPoint::new([0.0, 0.0], [0.0, -2.0], 0.0);
    /// let Control::Conformal { to, factor } = l.at_switch(0, 0.0, &falling, false) else { panic!() };
    /// assert!((to.v[0] + 2.0).abs() < 1e-15 && to.v[1].abs() < 1e-15 && factor == 1.0);
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`with_reset`](Self::with_reset); [`FormulaError::Impact`] if the function depends on velocities or z,
    /// or if the number of the law is outside its range.
    pub fn with_impact(&self, when: &str, law: Impact, rest: Option<&[(&str, &str)]>) -> Result<Self, FormulaError> {
        self.check_is_lagrangian(NO_RESETS.0, NO_RESETS.1)?;
        self.check_has_no_constraints()?;
        match law {
            Impact::Restitution(e) if !(0.0..=1.0).contains(&e) => {
                return Err(FormulaError::Impact { why: "has a restitution outside of 0 to 1; give one within" });
            }
            Impact::Conformal(factor) if !(factor > 0.0 && factor <= 1.0) => {
                return Err(FormulaError::Impact {
                    why: "has a conformal factor that is not positive and at most 1; give one that is",
                });
            }
            _ => {}
        }
        let mut formula = self.clone();
        let surface = self.parse_beside(&mut formula.graph, when, None)?;
        let rest = rest.map(|rest| self.assignments(&mut formula.graph, rest)).transpose()?;
        if formula.graph.is_constant(surface) {
            return Err(FormulaError::Impact { why: "has a constant in place of a surface" });
        }
        if !formula.graph.inputs(surface).within(Inputs::TIME.and(Inputs::POSITION)) {
            return Err(FormulaError::Impact {
                why: "has a function of velocities or z in place of a surface; give a function of t and the \
                      coordinates, or assign new values by a reset",
            });
        }
        let change = Change::Impact(law);
        formula.resets.push(FormulaReset { when: surface, direction: Direction::Falling, change, rest });
        formula.sized()
    }

    /// Whether an impact multiplies the contact form by a factor other than 1, so that `L_z` alone does not determine
    /// the conformal factor of a motion.
    pub fn has_conformal_impacts(&self) -> bool {
        let factor = |reset: &FormulaReset| match reset.change {
            Change::Impact(law) => law.factor(),
            Change::Assignment(_) => None,
        };
        self.resets.iter().filter_map(factor).any(|factor| factor != 1.0)
    }

    /// Whether a reset preserves no contact form, as all do but elastic and conformal impacts.
    pub fn has_noncontact_resets(&self) -> bool {
        self.resets.iter().any(|reset| match reset.change {
            Change::Impact(law) => law.factor().is_none(),
            Change::Assignment(_) => true,
        })
    }
}
