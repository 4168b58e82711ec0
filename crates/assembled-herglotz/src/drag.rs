//! The linear drag `gamma(t) z`, and the flow of the kinetic part with it.

/// The rate of the drag.
pub(crate) enum Drag {
    /// The same at all times.
    Constant(f64),
    /// A function of time.
    Timed(Box<dyn Fn(f64) -> f64 + Send + Sync>),
}

/// The nodes and weights of the Gauss formula of order 12 on `[0, 1]`: its error along a drift is far below that of any scheme here.
/// Abramowitz and Stegun, Handbook of Mathematical Functions (1964), table 25.4.
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

    /// The integral of the rate over a time s from t.
    fn growth(&self, t: f64, s: f64) -> f64 {
        match self {
            Drag::Constant(gamma) => gamma * s,
            Drag::Timed(rate) => s * NODES.iter().map(|[c, b]| b * rate(t + c * s)).sum::<f64>(),
        }
    }

    /// The drift over a time s, which may be negative, from the time t.
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

/// The flow of the kinetic part with the drag over a time, with g the integral of gamma from its start: `q += length v` with the integral of
/// `e^g`, `v += damping v` with `e^g - 1`, `z += damping z + lift v.Mv`. A conformal contact map of rate `1 + damping`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drift {
    pub length: f64,
    pub damping: f64,
    pub lift: f64,
}

impl Drift {
    /// Over no time.
    pub const NONE: Drift = Drift { length: 0.0, damping: 0.0, lift: 0.0 };

    /// Moves velocities, and positions to others.
    #[inline(always)]
    pub fn go(&self, q: &[f64], v: &mut [f64], next: &mut [f64]) {
        for ((next, q), v) in next.iter_mut().zip(q).zip(v) {
            *next = fused(self.length, *v, *q);
            *v = fused(self.damping, *v, *v);
        }
    }
}

/// `a * b + c`, fused where the build has the instruction: elsewhere it would be a call.
#[inline(always)]
fn fused(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(target_feature = "fma") { a.mul_add(b, c) } else { a * b + c }
}
