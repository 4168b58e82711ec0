//! Dry friction that sticks.
//!
//! The mode is a coordinate m in addition, with the kinetic energy `m'^2/2` and no force, so that it changes by resets alone:
//! 0 where the coordinate sticks to the surface, 1 where friction pushes it forward, since it is slower, and -1 where friction
//! brakes it. The mode multiplies forces and does not enter L otherwise, so that no force acts on it. Where the coordinate
//! sticks, the force is the one that holds it,
//!
//! `R = (L_v)' - L_q - L_z L_v - f` with the acceleration of the surface,
//!
//! so that its velocity is that of the surface exactly.

use crate::evaluation::At;
use crate::limits::MOST_NODES;
use crate::names::Block;
use crate::node::Inputs;
use crate::parametric_nodes::ParametricNodes;
use crate::parser::{Kind, Parser, ValueName};
use crate::{Direction, Formula, FormulaError, Function, Graph, Id, MOST_COORDINATES, Operation, ResetNodes, Variable};

/// The prefix of the name of the mode of a coordinate.
const MODE: &str = "slip_";

/// A velocity relative to the surface that is round-off, relative to the velocity.
const ROUND_OFF: f64 = 16.0 * f64::EPSILON;

/// Dry friction on a coordinate, in texts over the names of a formula; see [`Formula::with_friction`].
#[derive(Clone, Copy, Debug)]
pub struct Friction<'a> {
    /// The size of the force while the coordinate slides, such as `mu*m*g`.
    pub sliding: &'a str,
    /// The largest force that holds it while it sticks; that of sliding by default.
    pub sticking: Option<&'a str>,
    /// The velocity of the surface, a function of time; 0 by default.
    pub surface: Option<&'a str>,
}

/// The mode of a coordinate with friction.
#[derive(Clone, Debug)]
pub(crate) struct Mode {
    /// The coordinate.
    pub of: u32,
    /// The force that holds it.
    hold: Id,
    /// The largest one.
    sticking: Id,
    /// The velocity of the surface.
    surface: Id,
}

impl Formula {
    /// The same formula with dry friction on a coordinate, which sticks and slips by itself: it has one coordinate more,
    /// `slip_x` for the coordinate `x`, which is 0 where x sticks, 1 where friction pushes it forward, and -1 where friction
    /// brakes it. A start without it is completed: see [`completed`](Self::completed).
    ///
    /// ```
    /// use formula_lagrangian::{Formula, Friction};
    /// let spring = Formula::parse("x'^2/2 - k*x^2/2", &["x"], &[("k", 1.0), ("fd", 0.6)])?;
    /// let block = spring.with_friction("x", Friction { sliding: "fd", sticking: Some("1"), surface: Some("0.3") })?;
    /// assert_eq!((block.coordinates(), block.resets()), (vec!["x".to_owned(), "slip_x".to_owned()], 3));
    /// // It starts with the velocity of the surface, and sticks.
    /// assert_eq!(block.completed(0.0, &[0.0], &[0.3], 0.0), Some([vec![0.0, 0.0], vec![0.3, 0.0]]));
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::Parse`]; [`FormulaError::Target`] if there is no such coordinate, if it has friction, and if its
    /// velocity and that of another coordinate are coupled in the mass matrix; [`FormulaError::Constraint`] for a formula with
    /// constraints; [`FormulaError::IsHamiltonian`]; [`FormulaError::Dimension`]; [`FormulaError::TooLarge`].
    pub fn with_friction(&self, coordinate: &str, friction: Friction<'_>) -> Result<Self, FormulaError> {
        self.check_is_lagrangian("friction", "give a Lagrangian")?;
        self.check_has_no_constraints()?;
        let refused = |why: String| FormulaError::target(coordinate, why);
        let mut indices = Graph::new();
        let target = self.target(coordinate, &mut indices)?;
        let i = match (target.kind, target.indices().collect::<Vec<_>>().as_slice()) {
            (Kind::Position, [(i, _)]) => *i,
            _ => return Err(refused("friction belongs to one coordinate".to_owned())),
        };
        if self.modes.iter().any(|mode| mode.of == i) {
            return Err(refused("this coordinate has friction already".to_owned()));
        }
        let n = self.names.dimension as u32;
        let name = format!("{MODE}{}", self.names.coordinates().nth(i as usize).unwrap_or_default());
        let name = name.replace(['[', ']'], "");
        if n as usize >= MOST_COORDINATES {
            return Err(FormulaError::Dimension { found: n as usize + 1 });
        }
        let mut formula = self.clone();
        formula.names.check(&name)?;
        let mut read = |text: &str| Parser::new(text, &self.names, &mut formula.graph, ValueName::Any)?.program();
        let sliding = read(friction.sliding)?;
        let sticking = friction.sticking.map_or(Ok(sliding), &mut read)?;
        let surface = read(friction.surface.unwrap_or("0"))?;
        let others = Inputs::POSITION.and(Inputs::VELOCITY).and(Inputs::ACTION);
        if formula.graph.inputs(surface).meets(others) {
            return Err(refused("the velocity of its surface must be a function of time".to_owned()));
        }
        let hold = formula.holding_force(i, surface)?.ok_or_else(|| {
            refused("its velocity and that of another coordinate are multiplied in L; choose coordinates without such terms".to_owned())
        })?;
        formula.names.blocks.push(Block { name, first: n as usize, count: None });
        formula.names.dimension += 1;
        let graph = &mut formula.graph;
        let (m, rate) = (graph.position(n), graph.velocity(n));
        let (one, half) = (graph.number(1.0), graph.number(0.5));
        let square = graph.binary(Operation::Mul, rate, rate);
        let kinetic = graph.binary(Operation::Mul, half, square);
        formula.root = graph.binary(Operation::Add, formula.root, kinetic);
        // m sliding + (1 - m^2) R
        let square = graph.binary(Operation::Mul, m, m);
        let sticks = graph.binary(Operation::Sub, one, square);
        let (slides, holds) = (graph.binary(Operation::Mul, m, sliding), graph.binary(Operation::Mul, sticks, hold));
        let force = graph.binary(Operation::Add, slides, holds);
        formula.forces.add(i, force, n as usize + 1, &mut formula.graph);
        let graph = &mut formula.graph;
        // It is released where R exceeds the largest force, and slips in the direction of this force.
        let mut resets = Vec::with_capacity(3);
        for (operation, mode) in [(Operation::Sub, 1.0), (Operation::Add, -1.0)] {
            let margin = graph.binary(operation, sticking, hold);
            let (when, to) = (graph.binary(Operation::Mul, sticks, margin), graph.number(mode));
            resets.push((when, vec![(Variable::Position(n), to)]));
        }
        // Where its velocity is that of the surface, it sticks if it can be held, and passes otherwise.
        let v = graph.velocity(i);
        let slower = graph.binary(Operation::Sub, surface, v);
        let when = graph.binary(Operation::Mul, m, slower);
        let size = graph.unary(Function::Abs, hold);
        let (zero, opposite) = (graph.number(0.0), graph.unary(Function::Neg, m));
        let to = graph.select([size, sticking, zero, opposite]);
        resets.push((when, vec![(Variable::Velocity(i), surface), (Variable::Position(n), to)]));
        formula.modes.push(Mode { of: i, hold, sticking, surface });
        let mut formula = formula.sized()?;
        for (when, then) in resets {
            formula = formula.with_reset_nodes(ResetNodes { when, direction: Direction::Falling, then, rest: None })?;
        }
        Ok(formula)
    }

    /// The force that gives a coordinate the acceleration of a surface with a velocity; `None` where it depends on other
    /// accelerations.
    fn holding_force(&mut self, i: u32, surface: Id) -> Result<Option<Id>, FormulaError> {
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
        !self.modes.is_empty()
    }

    /// The number of coordinates that a start has at least: those without the modes of [friction](Self::with_friction).
    pub fn given_dimension(&self) -> usize {
        self.names.dimension - self.modes.len()
    }

    /// A start with the modes of [friction](Self::with_friction), from one without them: positions and velocities. A
    /// coordinate with the velocity of its surface sticks if it can be held. `None` where there are no modes, or the start has
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
            let nodes = ParametricNodes::new(&self.graph, &[mode.hold, mode.sticking, mode.surface]);
            let mut found = [f64::NAN; 3];
            nodes.evaluate(&self.values, At { q: &q, v: &v, z, t }, &mut found);
            let [hold, sticking, surface] = found;
            let rate = v.get(mode.of as usize).copied()?;
            let slower = surface - rate;
            let is_still = slower.abs() <= ROUND_OFF * (surface.abs() + rate.abs());
            let to = match is_still {
                true if hold.abs() <= sticking => 0.0,
                true => hold.signum(),
                false => slower.signum(),
            };
            *q.get_mut(given + k)? = to;
        }
        Some([q, v])
    }
}
