//! The linear drag `gamma(t) z`, and the flow of the kinetic energy with this drag.

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
const NODES: [[f64; 2]; 6] = {
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

    /// The integral of the rate from t to t + s.
    fn growth(&self, t: f64, s: f64) -> f64 {
        match self {
            Drag::Constant(gamma) => gamma * s,
            Drag::Timed(rate) => s * NODES.iter().map(|[c, b]| b * rate(t + c * s)).sum::<f64>(),
        }
    }

    /// The drift from the time t over a time s, which may be negative.
    pub fn drift(&self, t: f64, s: f64) -> Drift {
        let damping = self.growth(t, s).exp_m1();
        let length = match self {
            Drag::Constant(0.0) => s,
            Drag::Constant(gamma) => damping / gamma,
            Drag::Timed(_) => s * NODES.iter().map(|[c, b]| b * self.growth(t, c * s).exp()).sum::<f64>(),
        };
        Drift { length, damping, lift: 0.5 * (1.0 + damping) * length }
    }
}

/// The flow of the kinetic energy with drag over a time interval. With g(t) the integral of gamma from the start of the
/// interval, it is `q += length v` with `length` the integral of `e^g`, `v += damping v` with `damping = e^g - 1` at
/// the end, and `z += damping z + lift v.Mv`. It is a conformal contact map with the factor `1 + damping`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drift {
    pub length: f64,
    pub damping: f64,
    pub lift: f64,
}

impl Drift {
    /// The drift over zero time, which is the identity.
    pub const NONE: Drift = Drift { length: 0.0, damping: 0.0, lift: 0.0 };

    /// Updates the velocities in place, and writes the positions after the drift to `next`.
    #[inline(always)]
    pub fn go(&self, q: &[f64], v: &mut [f64], next: &mut [f64]) {
        for ((next, q), v) in next.iter_mut().zip(q).zip(v) {
            *next = fused(self.length, *v, *q);
            *v = fused(self.damping, *v, *v);
        }
    }
}

/// `a * b + c`, fused if the build target has the instruction; otherwise `mul_add` would be a function call.
#[inline(always)]
fn fused(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(target_feature = "fma") { a.mul_add(b, c) } else { a * b + c }
}
