//! Dry friction that sticks.
//!
//! The mode is a coordinate in addition: 0 where the coordinate sticks to the surface, 1 where friction pushes it forward, since it
//! is slower, and -1 where friction brakes it. Where the coordinate sticks, the force is the one that holds it, so that its
//! velocity is that of the surface exactly.

use crate::modes::Mode;
use crate::node::Inputs;
use crate::parser::{Kind, Parser, ValueName};
use crate::{Direction, Formula, FormulaError, Function, Graph, Operation, ResetNodes, Variable};

/// The prefix of the name of the mode of a coordinate.
const MODE: &str = "slip_";

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
        if self.modes.iter().any(|mode| matches!(mode, Mode::Friction { of, .. } if *of == i)) {
            return Err(refused("this coordinate has friction already".to_owned()));
        }
        let n = self.names.dimension as u32;
        let mut formula = self.clone();
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
        let m = formula.add_mode(MODE, i)?;
        let graph = &mut formula.graph;
        let one = graph.number(1.0);
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
        formula.modes.push(Mode::Friction { of: i, hold, sticking, surface });
        let mut formula = formula.sized()?;
        for (when, then) in resets {
            formula = formula.with_reset_nodes(ResetNodes { when, direction: Direction::Falling, then, rest: None })?;
        }
        Ok(formula)
    }
}
