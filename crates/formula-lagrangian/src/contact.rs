//! Coordinates that come to rest on the surface of a reset, and stay there.
//!
//! The mode is a coordinate in addition: 0 where the coordinate is free, 1 where it is held on the surface and its function
//! was positive before, -1 where it was negative. In contact, the force is the one that gives the coordinate the acceleration of
//! the surface. The contact ends where this force would have to pull.

use crate::evaluation::At;
use crate::limits::MOST_NODES;
use crate::modes::Mode;
use crate::node::Inputs;
use crate::parametric_nodes::ParametricNodes;
use crate::{Direction, Formula, FormulaError, Function, Id, Node, Operation, ResetNodes, Variable};

/// The prefix of the name of the mode of a coordinate.
const MODE: &str = "contact_";

/// The round-off of two formulas for one value.
const ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// The surface of a reset on which a coordinate may lie.
struct Surface {
    /// The coordinate.
    of: u32,
    /// The derivative of its function in the coordinate.
    slope: Id,
    /// The place of the surface.
    place: Id,
    /// Its velocity.
    rate: Id,
}

impl Formula {
    /// The same formula, in which coordinates stay on the surfaces of its resets and impacts: where they accumulate, or leave the
    /// coordinate without velocity, and `rest` assigns to the coordinate the velocity of the surface, a force holds it
    /// there, until it would have to pull. For each such reset it has one coordinate more, `contact_x` for the coordinate `x`:
    /// 0 where x is free, 1 where it lies on the surface of a function that was positive before, -1 where it was negative. A start
    /// without it is completed: see [`completed`](Self::completed).
    ///
    /// A reset has such a contact if its function is `c (x - s(t))` with one coordinate x, a number c and a function s of time, if
    /// `rest` assigns the velocity of x and no other position, and if L does not multiply this velocity with that of
    /// another coordinate. All other resets stay as they are.
    ///
    /// ```
    /// use formula_lagrangian::{Direction, Formula, Reset};
    /// let ball = Formula::parse("x'^2/2 - 9.81*x", &["x"], &[("e", 0.8)])?;
    /// let rest = [("x'", "0")];
    /// let bounce = Reset { when: "x", direction: Direction::Falling, then: &[("x'", "-e*x'")], rest: Some(&rest) };
    /// let ball = ball.with_reset(bounce)?.with_resting_contact()?;
    /// assert_eq!(ball.coordinates(), ["x", "contact_x"]);
    /// // It starts on the floor.
    /// assert_eq!(ball.completed(0.0, &[0.0], &[0.0], 0.0), Some([vec![0.0, 1.0], vec![0.0, 0.0]]));
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::Dimension`]; [`FormulaError::TooLarge`]; [`FormulaError::Parse`] where a name is in use.
    pub fn with_resting_contact(&self) -> Result<Self, FormulaError> {
        let mut formula = self.clone();
        for index in 0..self.resets.len() {
            if let Some(surface) = formula.surface_of_rest(index)? {
                formula = formula.with_contact(index, surface)?;
            }
        }
        Ok(formula)
    }

    /// The surface of a reset on which a coordinate may stay.
    fn surface_of_rest(&mut self, index: usize) -> Result<Option<Surface>, FormulaError> {
        let has_mode = self.modes.iter().any(|mode| matches!(mode, Mode::Contact { reset, .. } if *reset == index));
        let Some(reset) = self.resets.get(index).filter(|_| !has_mode) else { return Ok(None) };
        let (when, Some(rest)) = (reset.when, reset.rest.clone()) else { return Ok(None) };
        let graph = &mut self.graph;
        if !graph.inputs(when).within(Inputs::TIME.and(Inputs::POSITION)) {
            return Ok(None);
        }
        let needed = graph.needed(when);
        let nodes = (0..needed.len()).filter(|i| needed[*i]).map(|i| graph.node(Id(i as u32)));
        let positions: Vec<u32> =
            nodes.filter_map(|node| if let Node::Position(i) = node { Some(i) } else { None }).collect();
        let [of] = positions[..] else { return Ok(None) };
        let too_large = || FormulaError::TooLarge { limit: MOST_NODES };
        let (x, t, zero) = (graph.position(of), graph.time(), graph.number(0.0));
        let slope = graph.gradient(when, &[x], MOST_NODES).ok_or_else(too_large)?[0];
        if graph.inputs(slope) != Inputs::NONE {
            return Ok(None);
        }
        let at_zero = graph.replaced(when, |node| (node == Node::Position(of)).then_some(zero));
        let quotient = graph.binary(Operation::Div, at_zero, slope);
        let place = graph.unary(Function::Neg, quotient);
        let rate = graph.gradient(place, &[t], MOST_NODES).ok_or_else(too_large)?[0];
        let is_on_surface = rest.iter().all(|(variable, value)| match variable {
            Variable::Position(i) => *i == of && self.are_equal(*value, place),
            Variable::Velocity(i) => *i != of || self.are_equal(*value, rate),
            Variable::Action => true,
        });
        let stops = rest.iter().any(|(variable, _)| *variable == Variable::Velocity(of));
        Ok((is_on_surface && stops).then_some(Surface { of, slope, place, rate }))
    }

    /// Whether two nodes have the same values, at some points and with some values of the parameters.
    fn are_equal(&self, a: Id, b: Id) -> bool {
        let nodes = ParametricNodes::new(&self.graph, &[a, b]);
        let n = self.names.dimension;
        a == b
            || (0..4).all(|k| {
                let number = |i: usize| f64::from(k) + 0.37 + 0.61 * ((2 * k as usize + 3) * i) as f64 % 1.0;
                let values: Vec<f64> = self.values.iter().enumerate().map(|(i, value)| value * number(i)).collect();
                let (q, v): (Vec<f64>, Vec<f64>) = (0..n).map(|i| (number(i), -number(i + n))).unzip();
                let mut found = [f64::NAN; 2];
                nodes.evaluate(&values, At { q: &q, v: &v, z: number(2 * n), t: number(2 * n + 1) }, &mut found);
                let [a, b] = found;
                (a - b).abs() <= ROUND_OFF * (a.abs() + b.abs())
            })
    }

    /// The formula with the contact of a reset.
    fn with_contact(mut self, index: usize, surface: Surface) -> Result<Self, FormulaError> {
        let Surface { of, slope, place, rate } = surface;
        let Some(hold) = self.holding_force(of, rate)? else { return Ok(self) };
        let n = self.names.dimension as u32;
        let m = self.add_mode(MODE, of)?;
        let graph = &mut self.graph;
        let [zero, one, minus] = [0.0, 1.0, -1.0].map(|x| graph.number(x));
        // In contact the position and the velocity are those of the surface, up to round-off.
        let hold = graph.replaced(hold, |node| match node {
            Node::Position(i) if i == of => Some(place),
            Node::Velocity(i) if i == of => Some(rate),
            _ => None,
        });
        let square = graph.powi(m, 2);
        let force = graph.binary(Operation::Mul, square, hold);
        self.forces.add(of, force, n as usize + 1, &mut self.graph);
        let graph = &mut self.graph;
        let push = graph.binary(Operation::Mul, slope, hold);
        let Some(reset) = self.resets.get_mut(index) else { return Ok(self) };
        let pressed = graph.select(match reset.direction {
            Direction::Falling => [push, zero, zero, one],
            Direction::Rising => [zero, push, zero, minus],
            Direction::Both => [push, zero, minus, one],
        });
        // The reset happens to free coordinates alone: the function is that of the surface, exactly zero on it, and 1 or -1 in
        // contact. The cube does not change the normal of an impact.
        let (x, cube) = (graph.position(of), graph.powi(m, 3));
        let distance = graph.binary(Operation::Sub, x, place);
        let distance = graph.binary(Operation::Mul, slope, distance);
        reset.when = graph.binary(Operation::Add, distance, cube);
        let on_surface = [(Variable::Position(of), place), (Variable::Velocity(of), rate)];
        let rest = reset.rest.get_or_insert_default();
        rest.retain(|(variable, _)| on_surface.iter().all(|(other, _)| other != variable));
        rest.extend(on_surface);
        rest.push((Variable::Position(n), pressed));
        // The contact ends where the force would have to pull.
        let (pushed, free) = (graph.binary(Operation::Mul, m, push), graph.binary(Operation::Sub, one, square));
        let when = graph.binary(Operation::Add, pushed, free);
        let then = on_surface.into_iter().chain([(Variable::Position(n), zero)]).collect();
        self.modes.push(Mode::Contact { of, reset: index, place, rate, pressed });
        self.sized()?.with_reset_nodes(ResetNodes { when, direction: Direction::Falling, then, rest: None })
    }
}

#[cfg(test)]
mod tests {
    use crate::{Direction, Formula, Reset};
    use contact_geom::switching::Impact;

    /// The coordinates of a formula with a reset, and with its contacts.
    fn with(text: &str, coordinates: &[&str], when: &str, rest: &[(&str, &str)]) -> Vec<String> {
        let formula = Formula::parse(text, coordinates, &[("a", 0.3), ("w", 2.0)]).unwrap();
        let then = [(rest[0].0, "0")];
        let reset = Reset { when, direction: Direction::Falling, then: &then, rest: Some(rest) };
        formula.with_reset(reset).unwrap().with_resting_contact().unwrap().coordinates()
    }

    #[test]
    fn which_resets_have_contacts() {
        let ball = "x'^2/2 - 9.81*x";
        assert_eq!(with(ball, &["x"], "x", &[("x'", "0")]), ["x", "contact_x"]);
        // A floor that moves, written in two ways.
        assert_eq!(with(ball, &["x"], "3*x - 3*a*sin(w*t)", &[("x'", "w*cos(w*t)*a")]), ["x", "contact_x"]);
        assert_eq!(with(ball, &["x"], "x - a*sin(w*t)", &[("x'", "0")]), ["x"]);
        assert_eq!(with(ball, &["x"], "x", &[("x'", "0"), ("x", "1")]), ["x"]);
        // Other functions, and modes of the user.
        assert_eq!(with(ball, &["x"], "x^2 - 1", &[("x'", "0")]), ["x"]);
        assert_eq!(with(ball, &["x"], "x + x'", &[("x'", "0")]), ["x"]);
        let two = "(x'^2 + y'^2)/2 - y";
        assert_eq!(with(two, &["x", "y"], "y", &[("y'", "0"), ("x'", "0")]), ["x", "y", "contact_y"]);
        assert_eq!(with(two, &["x", "y"], "y - x", &[("y'", "0")]), ["x", "y"]);
        assert_eq!(with(two, &["x", "y"], "y", &[("y'", "0"), ("x", "1")]), ["x", "y"]);
        assert_eq!(with("(x'^2 + y'^2 + x'*y')/2 - y", &["x", "y"], "y", &[("y'", "0")]), ["x", "y"]);
    }

    #[test]
    fn a_contact_is_added_once() {
        let ball = Formula::parse("x'^2/2 - 9.81*x", &["x"], &[]).unwrap();
        let ball = ball.with_impact("x", Impact::Restitution(0.5), Some(&[("x'", "0")])).unwrap();
        let once = ball.with_resting_contact().unwrap();
        assert_eq!(once.with_resting_contact().unwrap().coordinates(), once.coordinates());
    }
}
