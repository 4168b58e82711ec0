//! The explicit derivatives of a formula, with respect to a parameter or to the time.

use crate::Graph;
use crate::derived::{Derived, variables};
use crate::evaluation::At;
use crate::parametric_nodes::ParametricNodes;
use crate::tape::Tape;
use std::sync::OnceLock;

/// The derivatives of L, of its gradient and of the forces with respect to each parameter, and to the time. Each is derived
/// when it is first asked for.
#[derive(Clone, Debug)]
pub(crate) struct ExplicitTapes {
    parameters: Vec<OnceLock<Option<ExplicitTape>>>,
    time: OnceLock<Option<ExplicitTape>>,
}

/// `L_q`, `L_v`, `L_z`, L and the force on each coordinate, differentiated with respect to a parameter or to the time.
#[derive(Clone, Debug)]
pub(crate) struct ExplicitTape {
    pub tape: Tape,
    /// The constants of the tape, as functions of the parameters.
    constants: ParametricNodes,
}

impl ExplicitTapes {
    /// None so far, for this number of parameters.
    pub fn new(parameters: usize) -> Self {
        ExplicitTapes { parameters: vec![OnceLock::new(); parameters], time: OnceLock::new() }
    }

    /// Sets the values of the parameters.
    pub fn set_constants(&mut self, theta: &[f64]) {
        let tapes = self.parameters.iter_mut().chain([&mut self.time]);
        tapes.filter_map(|tape| tape.get_mut()?.as_mut()).for_each(|tape| tape.set_constants(theta));
    }
}

impl Derived {
    /// The derivatives with respect to a parameter, or to the time if none is given; `None` for a parameter that is not
    /// there, and if a tape would need more registers than can be numbered.
    #[inline(never)]
    pub fn explicit(&self, parameter: Option<usize>) -> Option<&Tape> {
        let tape = match parameter {
            Some(k) => self.explicit.parameters.get(k)?,
            None => &self.explicit.time,
        };
        tape.get_or_init(|| ExplicitTape::new(self, parameter)).as_ref().map(|explicit| &explicit.tape)
    }
}

impl ExplicitTape {
    fn new(derived: &Derived, parameter: Option<usize>) -> Option<Self> {
        let (mut graph, n) = (derived.formula.graph.clone(), derived.cyclic.len());
        let by = match parameter {
            Some(k) => graph.parameter(u32::try_from(k).ok()?),
            None => graph.time(),
        };
        // Each pass backward adds a few nodes for each node, so that the number of nodes needs no bound of its own.
        let derivative = |graph: &mut Graph, of| graph.gradient(of, &[by], usize::MAX)?.pop();
        let of_value = derivative(&mut graph, derived.root)?;
        let variables = variables(&mut graph, n);
        let mut nodes = graph.gradient(of_value, &variables, usize::MAX)?;
        nodes.push(of_value);
        for force in &derived.applied_nodes {
            nodes.push(derivative(&mut graph, *force)?);
        }
        nodes.resize(3 * n + 2, graph.number(0.0));
        let mut tape = Tape::new(&graph, &nodes, n)?;
        let constants = ParametricNodes::new(&graph, &tape.take_constants());
        let mut explicit = ExplicitTape { tape, constants };
        explicit.set_constants(&derived.formula.values);
        Some(explicit)
    }

    fn set_constants(&mut self, theta: &[f64]) {
        let mut values = vec![f64::NAN; self.constants.len()];
        self.constants.evaluate(theta, At { q: &[], v: &[], z: 0.0, t: 0.0 }, &mut values);
        self.tape.set_constants(&values);
    }
}
