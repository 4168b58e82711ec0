//! The coefficients of Gauss collocation with one or two stages.

/// The maximum number of stages. The linear systems of the stages are solved by a determinant of two rows, and the
/// matrices of the border have a fixed size.
pub(crate) const MAX_STAGES: usize = 2;

/// The coefficients of Gauss collocation with one or two stages. All except `extrapolation` are multiplied by the step
/// size.
#[derive(Clone, Debug)]
pub(crate) struct GaussTable {
    pub s: usize,
    pub a: [[f64; MAX_STAGES]; MAX_STAGES],
    pub b: [f64; MAX_STAGES],
    pub c: [f64; MAX_STAGES],
    /// Extrapolation: the values, at the nodes of the next step, of the polynomial through the values at the nodes of
    /// this step.
    pub extrapolation: [[f64; MAX_STAGES]; MAX_STAGES],
}

impl GaussTable {
    /// The coefficients for `s` stages, one or two.
    pub fn new(s: usize, h: f64) -> Self {
        if s == 1 {
            let first = |x: f64| [x, 0.0];
            return GaussTable {
                s,
                a: [first(0.5 * h), [0.0; 2]],
                b: first(h),
                c: first(0.5 * h),
                extrapolation: [first(1.0), [0.0; 2]],
            };
        }
        let r = 3f64.sqrt() / 6.0;
        let (c, w) = ([0.5 - r, 0.5 + r], 0.5 / r);
        let extrapolation = c.map(|c_i| {
            let x = 1.0 + c_i;
            [(c[1] - x) * w, (x - c[0]) * w]
        });
        let a = [[0.25, 0.25 - r], [0.25 + r, 0.25]].map(|row| row.map(|a| a * h));
        GaussTable { s: 2, a, b: [0.5 * h; 2], c: c.map(|c| c * h), extrapolation }
    }

    /// Solves `x_i + h sum a_ij w_j x_j = r_i` for the stages.
    fn solve(&self, w: [f64; MAX_STAGES], r: [f64; MAX_STAGES]) -> [f64; MAX_STAGES] {
        let [[a, b], [c, d]]: [[f64; MAX_STAGES]; MAX_STAGES] = std::array::from_fn(|i| {
            std::array::from_fn(|j| f64::from(u8::from(i == j)) + if j < self.s { self.a[i][j] * w[j] } else { 0.0 })
        });
        let determinant = a * d - b * c;
        [(d * r[0] - b * r[1]) / determinant, (a * r[1] - c * r[0]) / determinant]
    }

    /// The integrating factors of the stages for given rates `L_z` there: `rho_i = 1 - h sum a_ij rho_j rate_j`.
    pub fn factors(&self, rates: [f64; MAX_STAGES]) -> [f64; MAX_STAGES] {
        self.solve(rates, [1.0; MAX_STAGES])
    }

    /// The actions `Z_i - z0` of the stages for an L that is affine in z with these rates, from its values at z = z0.
    pub fn actions(&self, rates: [f64; MAX_STAGES], values: [f64; MAX_STAGES]) -> [f64; MAX_STAGES] {
        let sums = self.a.map(|row| row.iter().zip(values).take(self.s).map(|(a, l)| a * l).sum());
        self.solve(rates.map(|rate| -rate), sums)
    }
}
