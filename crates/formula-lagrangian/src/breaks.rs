//! Kinks and jumps of formulas: at known times, and at zeros of functions of the state.

use crate::evaluation::At;
use crate::node::Inputs;
use crate::parametric_nodes::ParametricNodes;
use crate::{Formula, FormulaError, Function, Graph, Id, Node, Operation};
use contact_geom::Dual;
use contact_geom::nalgebra::SVector;
use contact_geom::switching::BreakRate;

/// The maximum number of samples of a table at an argument that depends on the state, each of which is a switching
/// function.
const MOST_KNOTS_IN_STATE: usize = 200;

/// Kinks and jumps at times that are known for given values of the parameters.
#[derive(Clone, Debug)]
enum TimeKink {
    /// At the zero of an affine function of time.
    Zero(Id),
    /// Where an affine function of time has one of these values.
    Values(Id, Vec<f64>),
}

impl TimeKink {
    fn function(&self) -> Id {
        match self {
            TimeKink::Zero(id) | TimeKink::Values(id, _) => *id,
        }
    }
}

/// A time of a kink or a jump, with the number of its function and the slope of this in time.
struct KinkTime {
    time: f64,
    function: usize,
    slope: f64,
}

/// A number with its derivative in a parameter.
type Along = Dual<f64, SVector<f64, 1>>;

/// The kinks and jumps of a formula.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kinks {
    /// The functions at whose zeros there are kinks and jumps, except for those in `in_time`.
    pub functions: Vec<Id>,
    in_time: Vec<TimeKink>,
}

impl Kinks {
    /// The kinks and jumps of some nodes: the zeros of the arguments of `abs` and `sign`, and of the differences whose
    /// sign decides `min`, `max` and `if`; and the samples of tables. Each function is listed once, also if it occurs
    /// with both signs; constants are omitted, since they do not change sign.
    ///
    /// # Errors
    /// [`FormulaError::TableOfState`].
    pub fn of(graph: &mut Graph, nodes: &[Id]) -> Result<Self, FormulaError> {
        let needed = graph.needed_by(nodes);
        let (mut functions, mut lookups): (Vec<Id>, Vec<(u32, Id)>) = Default::default();
        for id in (0..needed.len()).filter(|i| needed[*i]).map(|i| Id(i as u32)) {
            let function = match graph.node(id) {
                Node::Unary(f, a) if !f.is_smooth() => a,
                Node::Binary(Operation::Min | Operation::Max, a, b) | Node::Select([a, b, ..]) => graph.sub(a, b),
                Node::Table { table, argument, .. } => {
                    if !graph.is_constant(argument) && !lookups.contains(&(table, argument)) {
                        lookups.push((table, argument));
                    }
                    continue;
                }
                _ => continue,
            };
            let opposite = graph.neg(function);
            if !graph.is_constant(function) && !functions.contains(&function) && !functions.contains(&opposite) {
                functions.push(function);
            }
        }
        let affine = graph.affine_in_time(functions.iter().chain(lookups.iter().map(|(_, a)| a)).copied(), &[]);
        let is_affine = |id: &Id| affine.get(id.index()).is_some_and(Option::is_some);
        let (known, mut functions): (Vec<Id>, Vec<Id>) = functions.into_iter().partition(is_affine);
        let mut in_time: Vec<TimeKink> = known.into_iter().map(TimeKink::Zero).collect();
        for (table, argument) in lookups {
            let knots = graph.knots(table);
            if is_affine(&argument) {
                in_time.push(TimeKink::Values(argument, knots));
                continue;
            }
            if knots.len() > MOST_KNOTS_IN_STATE {
                return Err(FormulaError::TableOfState { found: knots.len(), limit: MOST_KNOTS_IN_STATE });
            }
            for knot in knots {
                let knot = graph.number(knot);
                functions.push(graph.sub(argument, knot));
            }
        }
        Ok(Kinks { functions, in_time })
    }

    /// The times of kinks and jumps in ascending order, from the values of all constant nodes, with others that are
    /// given.
    pub fn times(&self, graph: &Graph, constants: &[f64], given: &[f64]) -> Vec<f64> {
        let mut times = given.to_vec();
        times.extend(self.in_time(graph, constants).into_iter().map(|kink| kink.time));
        // Both zeros are one time.
        times.iter_mut().for_each(|t| *t += 0.0);
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The same times with their derivatives in a parameter, one for each kink and jump; `theta` are the values of the
    /// parameters. Times that are given do not depend on them.
    pub fn rates(&self, graph: &Graph, given: &[f64], theta: &[f64], parameter: usize) -> Vec<BreakRate> {
        let functions: Vec<Id> = self.in_time.iter().map(TimeKink::function).collect();
        let nodes = ParametricNodes::new(graph, &functions);
        let moving = |x: f64, is: bool| Along { re: x, d: SVector::from([f64::from(u8::from(is))]) };
        let moved: Vec<Along> = theta.iter().enumerate().map(|(k, x)| moving(*x, k == parameter)).collect();
        // The derivative of an affine function is affine too.
        let [at_0, at_1] = [0.0, 1.0].map(|t| {
            let mut values = vec![moving(0.0, false); functions.len()];
            let at = At { q: &[], v: &[], z: moving(0.0, false), t: moving(t, false) };
            nodes.evaluate(&moved, at, &mut values);
            values
        });
        let along = |values: &[Along], kink: &KinkTime| values.get(kink.function).map_or(f64::NAN, |g| g.d[0]);
        let rate = |kink: KinkTime| {
            let [a, b] = [&at_0, &at_1].map(|values| along(values, &kink));
            BreakRate { time: kink.time + 0.0, rate: -(a + (b - a) * kink.time) / kink.slope }
        };
        let given = given.iter().map(|time| BreakRate { time: *time + 0.0, rate: 0.0 });
        self.in_time(graph, &graph.constants(theta)).into_iter().map(rate).chain(given).collect()
    }

    /// The time of each kink and jump, from the values of all constant nodes.
    fn in_time(&self, graph: &Graph, constants: &[f64]) -> Vec<KinkTime> {
        if self.in_time.is_empty() {
            return Vec::new();
        }
        let affine = graph.affine_in_time(self.in_time.iter().map(|kink| kink.function()), constants);
        let mut found = Vec::new();
        for (function, kink) in self.in_time.iter().enumerate() {
            let values = match kink {
                TimeKink::Zero(_) => [0.0].as_slice(),
                TimeKink::Values(_, values) => values.as_slice(),
            };
            if let Some([slope, at_zero]) = affine.get(kink.function().index()).copied().flatten() {
                found.extend(values.iter().map(|value| KinkTime { time: (value - at_zero) / slope, function, slope }));
            }
        }
        // A function with a slope of 0 has no zero.
        found.retain(|kink| kink.time.is_finite());
        found
    }
}

impl Graph {
    /// For each node up to the last of some, its slope and its value at the time 0 if it is an affine function of time
    /// as it is written. The values of constants are NaN unless they are given.
    fn affine_in_time(&self, of: impl Iterator<Item = Id>, constants: &[f64]) -> Vec<Option<[f64; 2]>> {
        let count = of.map(|id| id.index() + 1).max().unwrap_or(0);
        let mut affine: Vec<Option<[f64; 2]>> = Vec::with_capacity(count);
        for id in (0..count).map(|i| Id(i as u32)) {
            let known = |id: Id| affine.get(id.index()).copied().flatten();
            let constant = |id: Id| constants.get(id.index()).copied().unwrap_or(f64::NAN);
            let here = match self.node(id) {
                _ if self.is_constant(id) => Some([0.0, constant(id)]),
                _ if self.inputs(id) != Inputs::TIME => None,
                Node::Time => Some([1.0, 0.0]),
                Node::Unary(Function::Neg, a) => known(a).map(|[s, c]| [-s, -c]),
                Node::Binary(Operation::Add, a, b) => known(a).zip(known(b)).map(|([s, c], [r, d])| [s + r, c + d]),
                Node::Binary(Operation::Sub, a, b) => known(a).zip(known(b)).map(|([s, c], [r, d])| [s - r, c - d]),
                Node::Binary(Operation::Mul, a, b) if self.is_constant(b) => {
                    known(a).map(|[s, c]| [s * constant(b), c * constant(b)])
                }
                Node::Binary(Operation::Mul, a, b) if self.is_constant(a) => {
                    known(b).map(|[s, c]| [s * constant(a), c * constant(a)])
                }
                Node::Binary(Operation::Div, a, b) if self.is_constant(b) => {
                    known(a).map(|[s, c]| [s / constant(b), c / constant(b)])
                }
                _ => None,
            };
            affine.push(here);
        }
        affine
    }

    /// The arguments at which a table has kinks or jumps.
    fn knots(&self, table: u32) -> Vec<f64> {
        let Some(table) = self.tables().get(table as usize) else { return Vec::new() };
        // A held value begins before the first sample.
        let skipped = usize::from(table.degree() == 0);
        table.knots().iter().skip(skipped).copied().collect()
    }
}

impl Formula {
    /// The same formula with times at which steps end, in addition to those that are known from the formula: a jump
    /// that the expressions do not show as one. They become [breaks](contact_geom::Lagrangian::breaks).
    ///
    /// ```
    /// use contact_geom::Lagrangian;
    /// use formula_lagrangian::Formula;
    /// let pulse = Formula::parse("x'^2/2 + x*tanh((t - 2)*1e9) + if(t > t1, x, 0)", &["x"], &[("t1", 5.0)])?;
    /// let mut l = pulse.with_breaks(&[2.0])?.lagrangian::<1>()?;
    /// assert_eq!(l.breaks(), [2.0, 5.0]);
    /// l.set("t1", 1.0)?;
    /// assert_eq!(l.breaks(), [1.0, 2.0]);
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// [`FormulaError::Break`] if a time is not finite.
    pub fn with_breaks(&self, times: &[f64]) -> Result<Self, FormulaError> {
        if let Some(time) = times.iter().find(|t| !t.is_finite()) {
            return Err(FormulaError::Break { time: *time });
        }
        let mut formula = self.clone();
        formula.breaks.extend(times);
        Ok(formula)
    }
}
