//! Friction of the unknowns, the applied force `-c_i v_i`, and the flow of the kinetic energy with it.

use discrete_herglotz::support::Drift;

/// The drift of each unknown over a time s, with the rates `gamma - c_i/m_i` of its velocity:
/// `q += length v`, then `v += damping v`; and `z += damping z + sum lift m v^2` with the damping of [`Stage::drift`].
///
/// [`Stage::drift`]: crate::stages::Stage
#[derive(Debug)]
pub(crate) struct FrictionDrift {
    pub length: Vec<f64>,
    pub damping: Vec<f64>,
    pub lift: Vec<f64>,
}

impl FrictionDrift {
    /// The drifts for the constant rate gamma and the numbers `c_i/m_i`.
    pub fn new(gamma: f64, friction: &[f64], s: f64) -> Self {
        let growth = (gamma * s).exp();
        let of = |c: &f64| Drift::constant(gamma - c, s);
        FrictionDrift {
            length: friction.iter().map(|c| of(c).length).collect(),
            damping: friction.iter().map(|c| of(c).damping).collect(),
            // e^(gamma s) times the integral of e^((2 (gamma - c) - gamma) s), of which the action has one half.
            lift: friction.iter().map(|c| 0.5 * growth * Drift::constant(gamma - 2.0 * c, s).length).collect(),
        }
    }

    /// The drift of the action, whose energies are weighted by `lift` already.
    pub fn of_action(gamma: f64, s: f64) -> Drift {
        Drift { length: 0.0, damping: (gamma * s).exp_m1(), lift: 1.0 }
    }

    /// The part of a block.
    pub fn block(&self, from: usize, count: usize) -> [&[f64]; 3] {
        [&self.length, &self.damping, &self.lift].map(|all| all.get(from..from + count).unwrap_or(&[]))
    }
}
