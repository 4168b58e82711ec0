//! Deflation, which keeps a search away from known paths.

use contact_geom::nalgebra::SVector;

/// The factor `M = prod_i (1 + l^2 / d_i^2)` by which the residuals of a path are multiplied, where `d_i` is its
/// distance (root mean square over the points) from the known path i, and `l` a length. The deflated residual vanishes
/// at the other critical paths, and does not at the known ones.
///
/// Farrell, Birkisson and Funke, "Deflation techniques for finding distinct solutions of nonlinear partial differential
/// equations", SIAM J. Sci. Comput. 37 (2015).
pub(super) struct Deflation<'a, const N: usize> {
    pub known: &'a [Vec<SVector<f64, N>>],
    pub length: f64,
}

impl<const N: usize> Deflation<'_, N> {
    /// The factor `M` of a path.
    pub fn factor(&self, q: &[SVector<f64, N>]) -> f64 {
        self.known.iter().map(|known| 1.0 + self.length.powi(2) / square(q, known)).product()
    }

    /// The factor `M` of a path, and the multiple of Newton's correction (to the path `to`) that is the correction for
    /// the deflated residual. By the Sherman-Morrison formula both corrections have the same direction.
    pub fn of(&self, q: &[SVector<f64, N>], to: &[SVector<f64, N>]) -> (f64, f64) {
        let mut slope = 0.0;
        for known in self.known {
            let distance = square(q, known);
            let along: f64 = q.iter().zip(known).zip(to).map(|((a, b), to)| (a - b).dot(&(to - a))).sum();
            // The derivative of ln(1 + l^2/d^2) along the correction.
            let by = 2.0 * along / q.len() as f64;
            slope -= self.length.powi(2) * by / (distance * (distance + self.length.powi(2)));
        }
        let stretch = 1.0 / (1.0 - slope);
        // At the pole of the formula any multiple is suitable, since the line search shortens it.
        (self.factor(q), if stretch.is_finite() { stretch } else { 1.0 })
    }
}

/// The mean square distance of two paths.
pub(super) fn square<const N: usize>(a: &[SVector<f64, N>], b: &[SVector<f64, N>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum::<f64>() / a.len() as f64
}
