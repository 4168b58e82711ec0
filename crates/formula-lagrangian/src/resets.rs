//! Changes of the state where a function of it changes its sign.

use crate::Id;
use contact_geom::switching::Impact;

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
    pub(crate) fn includes(self, rising: bool) -> bool {
        match self {
            Direction::Falling => !rising,
            Direction::Rising => rising,
            Direction::Both => true,
        }
    }
}

/// A change of the state where a function of it changes its sign, as by an impact or a kick, in texts over the names of
/// a formula; see [`Formula::with_reset`](crate::Formula::with_reset).
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

/// A [`Reset`] whose expressions are nodes of the graph of a formula; see [`Formula::with_reset_nodes`](crate::Formula::with_reset_nodes).
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
