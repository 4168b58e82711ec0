//! Coordinates that are discrete modes: those of dry friction and of resting contact.
//!
//! A mode is a coordinate m with the kinetic energy `m'^2/2` and no force, so that it changes by resets alone. It multiplies
//! forces and does not enter L otherwise, so that no force acts on it.

use crate::evaluation::At;
use crate::limits::MOST_NODES;
use crate::names::Block;
use crate::parametric_nodes::ParametricNodes;
use crate::{Formula, FormulaError, Graph, Id, MOST_COORDINATES, Operation};

/// A velocity relative to the surface that is round-off, relative to the velocity; a distance likewise.
const ROUND_OFF: f64 = 16.0 * f64::EPSILON;

/// The mode of a coordinate.
#[derive(Clone, Debug)]
pub(crate) enum Mode {
    /// Of dry friction: 0 where the coordinate sticks, 1 and -1 where it slips.
    Friction {
        /// The coordinate.
        of: u32,
        /// The force that holds it.
        hold: Id,
        /// The largest one.
        sticking: Id,
        /// The velocity of the surface.
        surface: Id,
    },
    /// Of resting contact: 0 where the coordinate is free, 1 and -1 where it is held on the surface of a reset.
    Contact {
        /// The coordinate.
        of: u32,
        /// The index of the reset.
        reset: usize,
        /// The place of the surface.
        place: Id,
        /// Its velocity.
        rate: Id,
        /// The mode of a coordinate that is at rest there: 0 where no force presses it onto the surface.
        pressed: Id,
    },
}

impl Mode {
    fn of(&self) -> u32 {
        match self {
            Mode::Friction { of, .. } | Mode::Contact { of, .. } => *of,
        }
    }

    /// The value of the mode at the start of a motion `(t, q, v, z)`.
    fn at_start(&self, graph: &Graph, values: &[f64], at: At<'_, f64>) -> Option<f64> {
        let evaluate = |nodes: [Id; 3]| {
            let mut found = [f64::NAN; 3];
            ParametricNodes::new(graph, &nodes).evaluate(values, at, &mut found);
            found
        };
        let is_round_off = |difference: f64, a: f64, b: f64| difference.abs() <= ROUND_OFF * (a.abs() + b.abs());
        let [q, v] = [at.q, at.v].map(|of| of.get(self.of() as usize).copied());
        let (q, v) = (q?, v?);
        Some(match *self {
            Mode::Friction { hold, sticking, surface, .. } => {
                let [hold, sticking, surface] = evaluate([hold, sticking, surface]);
                match is_round_off(surface - v, surface, v) {
                    true if hold.abs() <= sticking => 0.0,
                    true => hold.signum(),
                    false => (surface - v).signum(),
                }
            }
            Mode::Contact { place, rate, pressed, .. } => {
                let [place, rate, pressed] = evaluate([place, rate, pressed]);
                let is_at_rest = is_round_off(q - place, q, place) && is_round_off(v - rate, v, rate);
                if is_at_rest { pressed } else { 0.0 }
            }
        })
    }
}

impl Formula {
    /// Adds the coordinate of a mode, with the name of another coordinate after a prefix: its node.
    pub(crate) fn add_mode(&mut self, prefix: &str, of: u32) -> Result<Id, FormulaError> {
        let n = self.names.dimension;
        if n >= MOST_COORDINATES {
            return Err(FormulaError::Dimension { found: n + 1 });
        }
        let name = format!("{prefix}{}", self.names.coordinates().nth(of as usize).unwrap_or_default());
        let name = name.replace(['[', ']'], "");
        self.names.check(&name)?;
        self.names.blocks.push(Block { name, first: n, count: None });
        self.names.dimension += 1;
        let graph = &mut self.graph;
        let rate = graph.velocity(n as u32);
        let half = graph.number(0.5);
        let square = graph.binary(Operation::Mul, rate, rate);
        let kinetic = graph.binary(Operation::Mul, half, square);
        self.root = graph.binary(Operation::Add, self.root, kinetic);
        Ok(graph.position(n as u32))
    }

    /// The force that gives a coordinate the acceleration of a surface with a velocity,
    ///
    /// `R = (L_v)' - L_q - L_z L_v - f` with the acceleration of the surface;
    ///
    /// `None` where it depends on other accelerations.
    pub(crate) fn holding_force(&mut self, i: u32, surface: Id) -> Result<Option<Id>, FormulaError> {
        let n = self.names.dimension;
        let too_large = || FormulaError::TooLarge { limit: MOST_NODES };
        let graph = &mut self.graph;
        let (z, t) = (graph.action(), graph.time());
        let q: Vec<Id> = (0..n as u32).map(|k| graph.position(k)).collect();
        let v: Vec<Id> = (0..n as u32).map(|k| graph.velocity(k)).collect();
        let first = [v[i as usize], q[i as usize], z];
        let first = graph.gradient(self.root, &first, MOST_NODES).ok_or_else(too_large)?;
        let [p, l_q, l_z] = first[..] else { return Err(too_large()) };
        let by: Vec<Id> = q.iter().chain(&v).copied().chain([z, t]).collect();
        let second = graph.gradient(p, &by, MOST_NODES).ok_or_else(too_large)?;
        let acceleration = graph.gradient(surface, &[t], MOST_NODES).ok_or_else(too_large)?[0];
        let mut rate = second[2 * n + 1];
        let mut add = |graph: &mut Graph, a: Id, b: Id| {
            let product = graph.binary(Operation::Mul, a, b);
            rate = graph.binary(Operation::Add, rate, product);
        };
        for (k, v) in v.iter().enumerate() {
            add(graph, second[k], *v);
            let mass = second[n + k];
            if k == i as usize {
                add(graph, mass, acceleration);
            } else if graph.as_number(mass) != Some(0.0) {
                return Ok(None);
            }
        }
        add(graph, second[2 * n], self.root);
        let total = self.forces.total(graph, n, MOST_NODES).ok_or_else(too_large)?;
        let drag = graph.binary(Operation::Mul, l_z, p);
        for known in [l_q, drag].into_iter().chain(total.get(i as usize).copied()) {
            rate = graph.binary(Operation::Sub, rate, known);
        }
        Ok(Some(rate))
    }

    /// Whether a coordinate has [friction](Self::with_friction).
    pub fn has_friction(&self) -> bool {
        self.modes.iter().any(|mode| matches!(mode, Mode::Friction { .. }))
    }

    /// Whether a coordinate stays on the surface of a reset: see [`with_resting_contact`](Self::with_resting_contact).
    pub fn has_resting_contact(&self) -> bool {
        self.modes.iter().any(|mode| matches!(mode, Mode::Contact { .. }))
    }

    /// The number of coordinates that a start has at least: those without the modes of [friction](Self::with_friction) and of
    /// [resting contact](Self::with_resting_contact).
    pub fn given_dimension(&self) -> usize {
        self.names.dimension - self.modes.len()
    }

    /// A start with the modes of [friction](Self::with_friction) and of [resting contact](Self::with_resting_contact), from one
    /// without them: positions and velocities. A coordinate with the velocity of its surface sticks if it can be held; one at
    /// rest on the surface of a reset stays there if it is pressed onto it. `None` where there are no modes, or the start has
    /// another number of coordinates.
    pub fn completed(&self, t: f64, q: &[f64], v: &[f64], z: f64) -> Option<[Vec<f64>; 2]> {
        let (n, given) = (self.names.dimension, self.given_dimension());
        if self.modes.is_empty() || q.len() != given || v.len() != given {
            return None;
        }
        let (mut q, mut v) = (q.to_vec(), v.to_vec());
        q.resize(n, 0.0);
        v.resize(n, 0.0);
        for (k, mode) in self.modes.iter().enumerate() {
            let to = mode.at_start(&self.graph, &self.values, At { q: &q, v: &v, z, t })?;
            *q.get_mut(given + k)? = to;
        }
        Some([q, v])
    }
}
