//! Changes of the state where a function of it changes its sign.

use crate::evaluation::At;
use crate::impacts::DerivedImpact;
use crate::parser::{Kind, Parser, ValueName};
use crate::tape::Tape;
use crate::{Formula, FormulaError, FormulaLagrangian, Graph, Id};
use contact_geom::VelocityPoint;
use contact_geom::switching::{Control, Impact};

/// The direction in which a function crosses 0, along the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// From positive to negative values.
    Falling,
    /// From negative to positive values.
    Rising,
    /// Either way.
    Both,
}

impl Direction {
    fn includes(self, rising: bool) -> bool {
        match self {
            Direction::Falling => !rising,
            Direction::Rising => rising,
            Direction::Both => true,
        }
    }
}

/// A change of the state where a function of it changes its sign, as by an impact or a kick, in texts over the names of
/// a formula; see [`Formula::with_reset`].
#[derive(Clone, Copy, Debug)]
pub struct Reset<'a> {
    /// The function whose change of sign triggers the reset.
    pub when: &'a str,
    /// The direction of the change.
    pub direction: Direction,
    /// The variables that get new values, with expressions of the state before the reset.
    pub then: &'a [(&'a str, &'a str)],
    /// Where resets accumulate, the variables that get new values, with expressions of the state after the last of
    /// them: the state from which the motion continues. A run ends there if it is `None`.
    pub rest: Option<&'a [(&'a str, &'a str)]>,
}

/// A variable of the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Variable {
    /// The coordinate with this index.
    Position(u32),
    /// The velocity of the coordinate with this index.
    Velocity(u32),
    /// The action z.
    Action,
}

/// A [`Reset`] whose expressions are nodes of the graph of a formula; see [`Formula::with_reset_nodes`].
#[derive(Clone, Debug, PartialEq)]
pub struct ResetNodes {
    /// The function whose change of sign triggers the reset.
    pub when: Id,
    /// The direction of the change.
    pub direction: Direction,
    /// The variables that get new values.
    pub then: Vec<(Variable, Id)>,
    /// The variables that get new values where resets accumulate; a run ends there if it is `None`.
    pub rest: Option<Vec<(Variable, Id)>>,
}

/// What a Hamiltonian does not have, and what to do.
pub(crate) const NO_RESETS: (&str, &str) =
    ("resets", "end the run there by a terminal event and start from the new state, or give a Lagrangian");

/// The change of the state at a reset.
#[derive(Clone, Debug)]
pub(crate) enum Change {
    Assignment(Vec<(Variable, Id)>),
    Impact(Impact),
}

/// A reset or an impact of a formula.
#[derive(Clone, Debug)]
pub(crate) struct FormulaReset {
    pub when: Id,
    pub direction: Direction,
    pub change: Change,
    pub rest: Option<Vec<(Variable, Id)>>,
}

impl FormulaReset {
    pub fn roots(&self) -> impl Iterator<Item = Id> {
        let then = match &self.change {
            Change::Assignment(then) => then.as_slice(),
            Change::Impact(_) => &[],
        };
        std::iter::once(self.when).chain(then.iter().chain(self.rest.iter().flatten()).map(|(_, value)| *value))
    }
}

/// New values of variables as a tape.
#[derive(Clone, Debug)]
struct Assignment {
    variables: Vec<Variable>,
    values: Tape,
}

impl Assignment {
    /// The tape over `n` coordinates; `None` if it is too large.
    fn new(graph: &Graph, assigned: &[(Variable, Id)], n: usize) -> Option<Self> {
        let (variables, values): (Vec<Variable>, Vec<Id>) = assigned.iter().copied().unzip();
        Some(Assignment { variables, values: Tape::new(graph, &values, n)? })
    }

    /// A state with the new values.
    fn after<const N: usize>(&self, t: f64, x: &VelocityPoint<N>) -> VelocityPoint<N> {
        let (mut after, mut values) = (*x, vec![0.0; self.variables.len()]);
        self.values.evaluate::<f64, N>(At::new(t, &x.q, &x.v, x.z), &mut [&mut values]);
        for (variable, value) in self.variables.iter().zip(values) {
            let place = match variable {
                Variable::Position(i) => after.q.get_mut(*i as usize),
                Variable::Velocity(i) => after.v.get_mut(*i as usize),
                Variable::Action => Some(&mut after.z),
            };
            if let Some(place) = place {
                *place = value;
            }
        }
        after
    }
}

#[derive(Clone, Debug)]
enum DerivedChange {
    Assignment(Assignment),
    Impact(DerivedImpact),
}

/// A reset or an impact with its expressions as tapes.
#[derive(Clone, Debug)]
pub(crate) struct DerivedReset {
    direction: Direction,
    change: DerivedChange,
    rest: Option<Assignment>,
}

impl DerivedReset {
    /// The tapes over `n` coordinates; `None` if they, or the graph with the normal of an impact, are too large.
    pub fn new(graph: &mut Graph, reset: &FormulaReset, n: usize, limit: usize) -> Option<Self> {
        let change = match &reset.change {
            Change::Assignment(then) => DerivedChange::Assignment(Assignment::new(graph, then, n)?),
            Change::Impact(law) => DerivedChange::Impact(DerivedImpact::new(graph, (*law, reset.when), n, limit)?),
        };
        let rest = match &reset.rest {
            Some(rest) => Some(Assignment::new(graph, rest, n)?),
            None => None,
        };
        Some(DerivedReset { direction: reset.direction, change, rest })
    }

    /// Sets the values of all constant nodes.
    pub fn set_constants(&mut self, constants: &[f64]) {
        match &mut self.change {
            DerivedChange::Assignment(then) => then.values.set_constants(constants),
            DerivedChange::Impact(impact) => impact.normal.set_constants(constants),
        }
        if let Some(rest) = &mut self.rest {
            rest.values.set_constants(constants);
        }
    }

    /// What happens where the function crosses 0; nothing in the other direction.
    pub fn at_switch<const N: usize>(
        &self,
        lagrangian: &FormulaLagrangian<N>,
        t: f64,
        x: &VelocityPoint<N>,
        rising: bool,
    ) -> Control<N> {
        match &self.change {
            _ if !self.direction.includes(rising) => Control::Continue,
            DerivedChange::Assignment(then) => Control::Replace(then.after(t, x)),
            DerivedChange::Impact(impact) => impact.control(lagrangian, t, x),
        }
    }

    /// What happens where resets accumulate.
    pub fn at_accumulation<const N: usize>(&self, t: f64, x: &VelocityPoint<N>) -> Control<N> {
        self.rest.as_ref().map_or(Control::Continue, |rest| Control::Replace(rest.after(t, x)))
    }
}

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
}
