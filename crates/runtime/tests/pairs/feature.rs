//! The features of which a system has two: for each its text in a formula, and its field, its surfaces and its times for
//! the reference.

use super::problem::Form;
use super::random::Random;
use herglotz_runtime::{Interpolation, Table};

/// A feature of a system of one coordinate x. Its numbers are parameters of the formula, where it can be.
#[derive(Clone, Debug)]
pub enum Feature {
    /// `-c x'`.
    LinearDrag { c: f64 },
    /// `-c x' |x'|`.
    QuadraticDrag { c: f64 },
    /// `f cos(w t)`.
    Drive { f: f64, w: f64 },
    /// `-k |x - a|` in L.
    Kink { a: f64, k: f64 },
    /// `-k (x - a)^2/2` in L beyond a.
    Spring { a: f64, k: f64 },
    /// `-h` in L beyond a: a step of the potential, which the motion passes or is reflected by.
    Step { a: f64, h: f64 },
    /// The force of a table over time, in L or as an applied force.
    TableOverTime { table: Samples, applied: bool },
    /// The potential of a table of straight lines over x.
    TableOverPosition { table: Samples },
    /// The force b before the time T.
    JumpInTime { at: f64, b: f64 },
    /// At x = a the velocity is multiplied by -e.
    Reset { a: f64, e: f64 },
    /// An elastic impact at x = a.
    Impact { a: f64 },
    /// An elastic impact at the moving surface `x = a + b sin(w t)`.
    MovingImpact { a: f64, b: f64, w: f64 },
    /// The run ends where x = a, or at rest.
    TerminalEvent { a: Option<f64> },
}

/// The samples of a table.
#[derive(Clone, Debug)]
pub struct Samples {
    pub at: Vec<f64>,
    pub values: Vec<f64>,
    pub held: bool,
}

impl Samples {
    fn draw(random: &mut Random, (low, high): (f64, f64), held: bool) -> Self {
        let count = 3 + random.below(10);
        let width = (high - low) / (count - 1) as f64;
        let at = (0..count).map(|i| low + width * (i as f64 + random.between(-0.3, 0.3))).collect();
        let values = (0..count).map(|_| random.between(-0.6, 0.6)).collect();
        Samples { at, values, held }
    }

    pub fn table(&self) -> Table {
        let interpolation = if self.held { Interpolation::Held } else { Interpolation::Linear };
        Table::new(&self.at, &self.values, interpolation).unwrap()
    }

    /// The value and the slope at u on the branch of a number of samples passed; constant outside.
    pub fn branch(&self, passed: usize, u: f64) -> (f64, f64) {
        let last = self.at.len() - 1;
        match passed {
            0 => (self.values[0], 0.0),
            i if i > last => (self.values[last], 0.0),
            i if self.held => (self.values[i - 1], 0.0),
            i => {
                let slope = (self.values[i] - self.values[i - 1]) / (self.at[i] - self.at[i - 1]);
                (self.values[i - 1] + slope * (u - self.at[i - 1]), slope)
            }
        }
    }
}

/// Where the field of a feature changes, or the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// `x = a`, where the field changes.
    Position(f64),
    /// `x' = 0`, where the field changes.
    Rest,
    /// `x = a`, where the potential rises by h.
    Step { a: f64, h: f64 },
    /// `x = a + b sin(w t)`, where the velocity relative to it is multiplied by -e.
    Wall { a: f64, b: f64, w: f64, e: f64 },
    /// `x = a` or `x' = 0`, where the motion ends.
    End(Option<f64>),
}

impl Feature {
    /// A feature of a motion from x over a span. A Hamiltonian has neither forces nor resets; under constraints there are
    /// no kinks, jumps and resets; a second wall is on the other side.
    pub fn draw(random: &mut Random, x: f64, span: f64, form: Form, others: &[Feature]) -> Self {
        let other_wall = others.iter().find_map(Feature::wall);
        let side = other_wall.map_or_else(|| random.sign(), |a| (x - a).signum());
        let near = x + side * random.between(0.1, 0.7);
        // The first eight are of a Hamiltonian too.
        let kind = match form {
            Form::Lagrangian => random.below(13),
            Form::Hamiltonian => random.below(8),
            Form::Constrained => [6, 8, 9][random.below(3)],
        };
        match kind {
            0 => Feature::Kink { a: near, k: random.between(-0.5, 1.0) },
            1 => Feature::Spring { a: near, k: random.between(-0.5, 5.0) },
            2 => Feature::Step { a: near, h: random.between(-0.5, 0.5) },
            3 | 4 => {
                let table = Samples::draw(random, (-0.1 * span, 1.1 * span), kind == 3);
                Feature::TableOverTime { table, applied: form == Form::Lagrangian && random.chance(0.3) }
            }
            5 => Feature::TableOverPosition { table: Samples::draw(random, (x - 1.5, x + 1.5), false) },
            6 => Feature::TerminalEvent { a: random.chance(0.7).then_some(near) },
            7 => Feature::JumpInTime { at: random.between(0.1, 0.9) * span, b: random.between(-1.5, 1.5) },
            8 => Feature::LinearDrag { c: random.between(0.05, 0.8) },
            9 => Feature::Drive { f: random.between(0.1, 1.0), w: random.between(0.5, 5.0) },
            10 => Feature::QuadraticDrag { c: random.between(0.05, 0.8) },
            11 => Feature::Reset { a: near, e: random.between(0.7, 1.0) },
            _ if random.chance(0.5) => Feature::Impact { a: near },
            _ => Feature::MovingImpact { a: near, b: random.between(-0.05, 0.05), w: random.between(0.5, 4.0) },
        }
    }

    pub fn wall(&self) -> Option<f64> {
        match self {
            Feature::Reset { a, .. } | Feature::Impact { a } | Feature::MovingImpact { a, .. } => Some(*a),
            _ => None,
        }
    }

    /// Whether two of them are one too many.
    pub fn excludes(&self, other: &Feature) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }

    /// The parameters, by name.
    pub fn parameters(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Feature::LinearDrag { c } => vec![("linear", c)],
            Feature::QuadraticDrag { c } => vec![("quadratic", c)],
            Feature::Drive { f, w } => vec![("f", f), ("w", w)],
            Feature::Kink { a, k } => vec![("kink", a), ("slope", k)],
            Feature::Spring { a, k } => vec![("floor", a), ("stiffness", k)],
            Feature::Step { a, h } => vec![("edge", a), ("height", h)],
            Feature::MovingImpact { a, b, w } => vec![("centre", a), ("amplitude", b), ("frequency", w)],
            Feature::JumpInTime { at, b } => vec![("T", at), ("b", b)],
            Feature::Reset { a, e } => vec![("wall", a), ("e", e)],
            Feature::Impact { a } => vec![("surface", a)],
            Feature::TerminalEvent { a: Some(a) } => vec![("end", a)],
            _ => Vec::new(),
        }
    }

    /// The same with another value of a parameter.
    pub fn with(&self, name: &str, value: f64) -> Self {
        let mut changed = self.clone();
        match (&mut changed, name) {
            (Feature::LinearDrag { c }, "linear") | (Feature::QuadraticDrag { c }, "quadratic") => *c = value,
            (Feature::Drive { f, .. }, "f") => *f = value,
            (Feature::Drive { w, .. }, "w") => *w = value,
            (Feature::Kink { a, .. }, "kink") => *a = value,
            (Feature::Kink { k, .. }, "slope") => *k = value,
            (Feature::Spring { a, .. }, "floor") | (Feature::Step { a, .. }, "edge") => *a = value,
            (Feature::Spring { k, .. }, "stiffness") => *k = value,
            (Feature::Step { h, .. }, "height") => *h = value,
            (Feature::MovingImpact { a, .. }, "centre") => *a = value,
            (Feature::MovingImpact { b, .. }, "amplitude") => *b = value,
            (Feature::MovingImpact { w, .. }, "frequency") => *w = value,
            (Feature::JumpInTime { at, .. }, "T") => *at = value,
            (Feature::JumpInTime { b, .. }, "b") => *b = value,
            (Feature::Reset { a, .. }, "wall") | (Feature::Impact { a }, "surface") => *a = value,
            (Feature::Reset { e, .. }, "e") => *e = value,
            (Feature::TerminalEvent { a: Some(a) }, "end") => *a = value,
            _ => {}
        }
        changed
    }

    /// What it adds to the potential, as a text.
    pub fn potential(&self) -> Option<&'static str> {
        match self {
            Feature::Kink { .. } => Some("slope*abs(x - kink)"),
            Feature::Spring { .. } => Some("stiffness*max(x - floor, 0)^2/2"),
            Feature::Step { .. } => Some("if(x > edge, height, 0)"),
            Feature::TableOverTime { applied: false, .. } => Some("-drive(t)*x"),
            Feature::TableOverPosition { .. } => Some("hills(x)"),
            Feature::JumpInTime { .. } => Some("-if(t < T, b, 0)*x"),
            _ => None,
        }
    }

    /// Its force on a coordinate, as a text.
    pub fn force(&self, form: Form, coordinate: usize) -> Option<&'static str> {
        let (drag, drive) = match (form, coordinate) {
            (Form::Constrained, 0) => ("-linear*x'", "-y*f*cos(w*t)"),
            (Form::Constrained, _) => ("-linear*y'", "x*f*cos(w*t)"),
            _ => ("-linear*x'", "f*cos(w*t)"),
        };
        match self {
            Feature::LinearDrag { .. } => Some(drag),
            Feature::QuadraticDrag { .. } => Some("-quadratic*x'*abs(x')"),
            Feature::Drive { .. } => Some(drive),
            Feature::TableOverTime { applied: true, .. } => Some("drive(t)"),
            _ => None,
        }
    }

    pub fn table(&self) -> Option<(&'static str, Table)> {
        match self {
            Feature::TableOverTime { table, .. } => Some(("drive", table.table())),
            Feature::TableOverPosition { table } => Some(("hills", table.table())),
            _ => None,
        }
    }

    /// The times at which its field changes.
    pub fn times(&self) -> Vec<f64> {
        match self {
            Feature::TableOverTime { table, .. } => table.at.clone(),
            Feature::JumpInTime { at, .. } => vec![*at],
            _ => Vec::new(),
        }
    }

    pub fn surfaces(&self) -> Vec<Surface> {
        match self {
            Feature::QuadraticDrag { .. } => vec![Surface::Rest],
            Feature::Kink { a, .. } | Feature::Spring { a, .. } => vec![Surface::Position(*a)],
            Feature::Step { a, h } => vec![Surface::Step { a: *a, h: *h }],
            Feature::TableOverPosition { table } => table.at.iter().map(|a| Surface::Position(*a)).collect(),
            Feature::Reset { a, e } => vec![Surface::Wall { a: *a, b: 0.0, w: 0.0, e: *e }],
            Feature::Impact { a } => vec![Surface::Wall { a: *a, b: 0.0, w: 0.0, e: 1.0 }],
            Feature::MovingImpact { a, b, w } => vec![Surface::Wall { a: *a, b: *b, w: *w, e: 1.0 }],
            Feature::TerminalEvent { a } => vec![Surface::End(*a)],
            _ => Vec::new(),
        }
    }

    /// Its part of the potential and of the total force, smooth while the sides of its surfaces and the number of its
    /// times that have passed stay the same.
    pub fn field(&self, t: f64, x: f64, v: f64, sides: &[f64], passed: usize) -> (f64, f64) {
        match self {
            Feature::LinearDrag { c } => (0.0, -c * v),
            Feature::QuadraticDrag { c } => (0.0, -c * v * v * sides[0]),
            Feature::Drive { f, w } => (0.0, f * (w * t).cos()),
            Feature::Kink { a, k } => (k * sides[0] * (x - a), -k * sides[0]),
            Feature::Spring { a, k } => {
                let beyond = if sides[0] > 0.0 { x - a } else { 0.0 };
                (k * beyond * beyond / 2.0, -k * beyond)
            }
            Feature::Step { h, .. } => (if sides[0] > 0.0 { *h } else { 0.0 }, 0.0),
            Feature::TableOverTime { table, applied } => {
                let force = table.branch(passed, t).0;
                (if *applied { 0.0 } else { -force * x }, force)
            }
            Feature::TableOverPosition { table } => {
                let (value, slope) = table.branch(sides.iter().filter(|s| **s > 0.0).count(), x);
                (value, -slope)
            }
            Feature::JumpInTime { b, .. } => {
                let force = if passed == 0 { *b } else { 0.0 };
                (-force * x, force)
            }
            _ => (0.0, 0.0),
        }
    }
}
