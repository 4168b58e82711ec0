//! The energies of a state.

/// Which energy is computed and monitored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum EnergyKind {
    /// `E_L = v.L_v - L`. Divided by the conformal factor it is constant, if the system does not depend on time.
    Lagrangian,
    /// `T + V`, whose rate of change is `2 gamma T`: it does not grow while the drag dissipates, if V does not depend
    /// on time. It is used if the action is not computed, and if gamma depends on time.
    Mechanical,
}

/// An energy and the size of its parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Energies {
    /// The energy of the requested kind.
    pub total: f64,
    pub kinetic: f64,
    /// The sum of the absolute values of the other terms.
    pub terms: f64,
}

/// The sum of squares, in eight partial sums so that the compiler may use vector registers.
pub(crate) fn sum_of_squares(v: &[f64]) -> f64 {
    let (chunks, rest) = v.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for chunk in chunks {
        for (sum, v) in sums.iter_mut().zip(chunk) {
            *sum += v * v;
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|v| v * v).sum::<f64>()
}
