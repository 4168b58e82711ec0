//! Resets and impacts with their expressions as tapes.

use crate::evaluation::At;
use crate::impacts::DerivedImpact;
use crate::resets::{Change, Direction, FormulaReset, Variable};
use crate::tape::Tape;
use crate::{Graph, Id};
use contact_geom::nalgebra::{DMatrix, DVector};

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

    /// Replaces a state `(q, v, z)` by that with the new values.
    fn replace(&self, t: f64, (q, v, z): (&mut [f64], &mut [f64], &mut f64)) {
        let mut values = vec![0.0; self.variables.len()];
        self.values.evaluate::<f64, 0>(At { t, q, v, z: *z }, &mut [&mut values]);
        for (variable, value) in self.variables.iter().zip(values) {
            let place = match variable {
                Variable::Position(i) => q.get_mut(*i as usize),
                Variable::Velocity(i) => v.get_mut(*i as usize),
                Variable::Action => Some(&mut *z),
            };
            if let Some(place) = place {
                *place = value;
            }
        }
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

    /// Replaces a state `(q, v, z)` by that after the reset or the impact; `None` in the other direction. Returns the factor
    /// of an impact that is contact; `at` is L with `L_v` and `L_vv` at a velocity and an action.
    pub fn replace(
        &self,
        at: impl Fn(&[f64], f64) -> (f64, DVector<f64>, DMatrix<f64>),
        t: f64,
        rising: bool,
        x: (&mut [f64], &mut [f64], &mut f64),
    ) -> Option<Option<f64>> {
        match &self.change {
            _ if !self.direction.includes(rising) => None,
            DerivedChange::Assignment(then) => {
                then.replace(t, x);
                Some(None)
            }
            DerivedChange::Impact(impact) => {
                impact.replace(at, t, (x.0, x.1, x.2));
                Some(impact.factor())
            }
        }
    }

    /// Replaces a state where resets accumulate; `false` if nothing is stated.
    pub fn replace_by_rest(&self, t: f64, x: (&mut [f64], &mut [f64], &mut f64)) -> bool {
        self.rest.as_ref().map(|rest| rest.replace(t, x)).is_some()
    }
}
