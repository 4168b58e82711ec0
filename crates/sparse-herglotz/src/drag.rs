//! The linear drag `gamma(t) z`, and the flow of the kinetic energy with this drag.

use discrete_herglotz::support::Drift;

/// The rate of the drag.
pub(crate) enum Drag {
    /// A constant rate.
    Constant(f64),
    /// A function of time.
    Timed(Box<dyn Fn(f64) -> f64 + Send + Sync>),
}

/// The nodes and weights of the Gauss quadrature of order 12 on `[0, 1]`. Its error along a drift is far below that of
/// any splitting scheme of this library. Source: Abramowitz and Stegun, Handbook of Mathematical Functions (1964),
/// table 25.4.
const QUADRATURE: [[f64; 2]; 6] = {
    let half = [
        [0.238_619_186_083_196_9, 0.467_913_934_572_691],
        [0.661_209_386_466_264_5, 0.360_761_573_048_138_6],
        [0.932_469_514_203_152, 0.171_324_492_379_170_4],
    ];
    let mut all = [[0.0; 2]; 6];
    let mut i = 0;
    while i < 3 {
        let [x, w] = half[i];
        all[2 - i] = [0.5 - 0.5 * x, 0.5 * w];
        all[3 + i] = [0.5 + 0.5 * x, 0.5 * w];
        i += 1;
    }
    all
};

impl Drag {
    /// `gamma(t)`.
    pub fn rate(&self, t: f64) -> f64 {
        match self {
            Drag::Constant(gamma) => *gamma,
            Drag::Timed(rate) => rate(t),
        }
    }

    /// The drift from the time t over a time s, which may be negative.
    pub fn drift(&self, t: f64, s: f64) -> Drift {
        let rate = match self {
            Drag::Constant(gamma) => return Drift::constant(*gamma, s),
            Drag::Timed(rate) => rate,
        };
        // The integral of the rate from t on.
        let growth = |s: f64| s * QUADRATURE.iter().map(|[c, b]| b * rate(t + c * s)).sum::<f64>();
        let damping = growth(s).exp_m1();
        Drift::new(s * QUADRATURE.iter().map(|[c, b]| b * growth(c * s).exp()).sum::<f64>(), damping)
    }
}

/// The drift over zero time, which is the identity.
pub(crate) const NO_DRIFT: Drift = Drift { length: 0.0, damping: 0.0, lift: 0.0 };

/// Applies a drift to the unknowns of a slice: `next = q + length v`, then `v += damping v` in
/// place.
#[inline(always)]
pub(crate) fn apply_drift(drift: &Drift, q: &[f64], v: &mut [f64], next: &mut [f64]) {
    for ((next, q), v) in next.iter_mut().zip(q).zip(v) {
        *next = fused(drift.length, *v, *q);
        *v = fused(drift.damping, *v, *v);
    }
}

/// `a * b + c`, fused if the build target has the instruction; otherwise `mul_add` would be a function call.
#[inline(always)]
fn fused(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(target_feature = "fma") { a.mul_add(b, c) } else { a * b + c }
}
