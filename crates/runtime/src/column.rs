//! Columns of the rows recorded along a motion.

use crate::RuntimeError;
use formula_lagrangian::{Expression, Formula};

/// A quantity recorded in each row.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Column {
    /// The time.
    Time,
    /// A coordinate by its index.
    Position(usize),
    /// Its velocity.
    Velocity(usize),
    /// Its momentum `L_v`.
    Momentum(usize),
    /// The action z.
    Action,
    /// The energy `E_L = v.p - L`, including the terms of L in z: `-gamma z` for a drag `gamma z`.
    Energy,
    /// The logarithm of the conformal factor since the start: the integral of `L_z`.
    LogFactor,
    /// The multiplier lambda of the constraint with this index: the force of the constraint is `lambda c_q`.
    Multiplier(usize),
    /// An expression of time and state.
    Expression(Box<Expression>),
}

impl Column {
    /// Parses a column over the names of a formula: `t`, `x`, `x'`, `z`; `p_x` for the momentum of `x` (`p_q[0]` in an
    /// array), `energy`, `sigma`, `log_factor`; `lambda[0]` for the multiplier of the first constraint, or `lambda` if it is the only
    /// one; unless a coordinate or a parameter has that name. Any other text is an
    /// expression in all of these, with or without a name.
    ///
    /// # Errors
    /// [`RuntimeError::Formula`] with the position in the text.
    pub fn parse(text: &str, formula: &Formula) -> Result<Self, RuntimeError> {
        let name = text.trim();
        let coordinates = formula.coordinates();
        let index = |of: &str| coordinates.iter().position(|c| c == of);
        if let Some(i) = index(name) {
            return Ok(Column::Position(i));
        }
        // The velocity and the energy of a Hamiltonian are expressions: `H_p`, and H.
        let of_lagrangian = !formula.is_hamiltonian();
        if let Some(i) = coordinates.iter().position(|c| velocity_name(c) == name).filter(|_| of_lagrangian) {
            return Ok(Column::Velocity(i));
        }
        let taken = formula.parameters().any(|(parameter, _)| parameter == name);
        match name {
            "t" => return Ok(Column::Time),
            _ if name == formula.action() => return Ok(Column::Action),
            "energy" if !taken && of_lagrangian => return Ok(Column::Energy),
            "log_factor" if !taken => return Ok(Column::LogFactor),
            _ => {}
        }
        let of_constraint = (0..formula.constraints()).find(|i| {
            name.strip_prefix("lambda[").and_then(|rest| rest.strip_suffix(']')) == Some(i.to_string().as_str())
        });
        let only = (name == "lambda" && formula.constraints() == 1).then_some(0);
        if let Some(i) = of_constraint.or(only).filter(|_| !names_lambda(formula)) {
            return Ok(Column::Multiplier(i));
        }
        if !taken && let Some(i) = formula.momenta().iter().position(|momentum| momentum == name) {
            return Ok(Column::Momentum(i));
        }
        Ok(Column::Expression(Box::new(formula.named_expression(text)?)))
    }

    /// Whether the column needs the conformal factor of the motion.
    pub fn has_conformal_factor(&self) -> bool {
        match self {
            Column::LogFactor => true,
            Column::Expression(expression) => expression.has_conformal_factor(),
            _ => false,
        }
    }

    /// The columns of a full state with their names: `t`, the coordinates, the velocities and the action; for a
    /// Hamiltonian the momenta instead of the velocities.
    pub fn state(formula: &Formula) -> Vec<(String, Column)> {
        let names = formula.coordinates();
        let positions = names.iter().cloned().enumerate().map(|(i, name)| (name, Column::Position(i)));
        let velocities = names.iter().enumerate().map(|(i, name)| (velocity_name(name), Column::Velocity(i)));
        let momenta = formula.momenta().into_iter().enumerate().map(|(i, name)| (name, Column::Momentum(i)));
        let (t, z) = (("t".to_owned(), Column::Time), (formula.action().to_owned(), Column::Action));
        let all = [t].into_iter().chain(positions);
        if formula.is_hamiltonian() {
            return all.chain(momenta).chain([z]).collect();
        }
        all.chain(velocities).chain([z]).collect()
    }
}

/// The name of a coordinate's velocity: `x'`, or `q'[0]`.
pub fn velocity_name(coordinate: &str) -> String {
    match coordinate.split_once('[') {
        Some((name, index)) => format!("{name}'[{index}"),
        None => format!("{coordinate}'"),
    }
}

/// Whether a coordinate or a parameter is named lambda.
fn names_lambda(formula: &Formula) -> bool {
    let is_lambda = |name: &str| name == "lambda" || name.starts_with("lambda[");
    formula.coordinates().iter().any(|name| is_lambda(name)) || formula.parameters().any(|(name, _)| is_lambda(name))
}
