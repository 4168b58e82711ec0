//! A Lagrangian `L(q, v, z)` whose coefficients are a dense network, in the language of formulas.
//!
//! ```text
//! L = v^T M(q) v/2 - U(q) + G(q) z,    M = C^T C,    C = [e^(o0), m + o1; 0, e^(s + o2)],    U = o3,    G = gamma + o4
//! ```
//!
//! where `o_k(q)` are the outputs of one hidden layer, `o_k = sum_j b_kj (tanh(a_j . x(q) + c_j) - tanh(a_j . x(0) + c_j))`.
//! But for round-off M is positive definite for all weights, so that Herglotz' equation determines the acceleration. The inputs x are the
//! functions `cos q1, cos q2, cos(q1 - q2)`, by which every function of two angles that is even, such as those of a
//! pendulum with a mirror plane, can be expressed.
//!
//! A motion in q does not determine L: `c L` and `L + constant` have the same motions. The outputs vanish where the
//! pendulum hangs, so that `M_11 = 1` and `U = 0` there: these fix the unit and the zero. A term in L that is linear in the
//! velocities, and any dependence on z but a linear one, are excluded by the form; the rate `L_z = G(q)` is then
//! determined by positions alone.

use contact_examples::Failure;
use formula_lagrangian::{Formula, FormulaLagrangian};

/// The number of neurons of the hidden layer.
pub const HIDDEN: usize = 5;

/// The inputs of the network.
const INPUTS: [&str; 3] = ["cos(q1)", "cos(q2)", "cos(q1 - q2)"];

/// The number of its outputs.
const OUTPUTS: usize = 5;

/// The coefficients beside the network: `m`, `s` and `gamma`. At 0, M is the unit matrix where the pendulum hangs, and the
/// motion is without drag there.
const COEFFICIENTS: [&str; 3] = ["m", "s", "gamma"];

/// The names of the weights with their values at the start: those of the hidden layer are spread evenly over (-1, 1), those
/// of the outputs over (-0.1, 0.1).
pub fn weights() -> Vec<(String, f64)> {
    let mut spread = spread();
    let mut next = |size: f64| size * spread.next().unwrap_or(0.0);
    let mut weights: Vec<(String, f64)> = COEFFICIENTS.iter().map(|name| ((*name).to_owned(), 0.0)).collect();
    for j in 0..HIDDEN {
        weights.extend((0..INPUTS.len()).map(|i| (format!("a{j}{i}"), next(1.0))));
        weights.push((format!("c{j}"), next(1.0)));
    }
    for k in 0..OUTPUTS {
        weights.extend((0..HIDDEN).map(|j| (format!("b{k}{j}"), next(0.1))));
    }
    weights
}

/// The Lagrangian with the weights of the start.
pub fn lagrangian() -> Result<FormulaLagrangian<2>, Failure> {
    let weights = weights();
    let parameters: Vec<(&str, f64)> = weights.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    Ok(Formula::parse(&text(), &["q1", "q2"], &parameters)?.lagrangian()?)
}

/// The text of the Lagrangian.
pub fn text() -> String {
    let mut lines: Vec<String> = INPUTS.iter().enumerate().map(|(i, input)| format!("x{i} = {input}")).collect();
    for j in 0..HIDDEN {
        let input = |of: &dyn Fn(usize) -> String| {
            let terms: Vec<String> = (0..INPUTS.len()).map(|i| format!("a{j}{i}{}", of(i))).collect();
            format!("tanh({} + c{j})", terms.join(" + "))
        };
        // All inputs are 1 where the pendulum hangs.
        lines.push(format!("h{j} = {} - {}", input(&|i| format!("*x{i}")), input(&|_| String::new())));
    }
    for k in 0..OUTPUTS {
        let terms: Vec<String> = (0..HIDDEN).map(|j| format!("b{k}{j}*h{j}")).collect();
        lines.push(format!("o{k} = {}", terms.join(" + ")));
    }
    lines.push("w1 = exp(o0)*q1' + (m + o1)*q2'".to_owned());
    lines.push("w2 = exp(s + o2)*q2'".to_owned());
    lines.push("L = (w1^2 + w2^2)/2 - o3 + (gamma + o4)*z".to_owned());
    lines.join("\n")
}

/// Numbers in (-1, 1), the multiples of the golden section modulo 1, which repeat no pattern.
pub fn spread() -> impl Iterator<Item = f64> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    (1..).map(|k| 2.0 * (f64::from(k) * GOLDEN).fract() - 1.0)
}
