//! Deflation: what keeps a search away from paths that are known.

use contact_geom::nalgebra::SVector;

/// The factor `M = prod_i (1 + l^2 / d_i^2)` by which the residuals of a path are multiplied, `d_i` its distance (root mean square
/// over the points) from the known path i, `l` a length: residuals of known paths no longer vanish, those of others do.
///
/// Farrell, Birkisson and Funke, "Deflation techniques for finding distinct solutions of nonlinear partial differential equations",
/// SIAM J. Sci. Comput. 37 (2015).
pub(super) struct Deflation<'a, const N: usize> {
    pub known: &'a [Vec<SVector<f64, N>>],
    pub length: f64,
}

impl<const N: usize> Deflation<'_, N> {
    /// `M` of a path.
    pub fn factor(&self, q: &[SVector<f64, N>]) -> f64 {
        self.known.iter().map(|known| 1.0 + self.length.powi(2) / square(q, known)).product()
    }

    /// `M`, and the multiple of Newton's correction that is the correction of the residuals times M: by the formula of Sherman and
    /// Morrison it is along the same line.
    pub fn of(&self, q: &[SVector<f64, N>], change: &[SVector<f64, N>]) -> (f64, f64) {
        let mut slope = 0.0;
        for known in self.known {
            let distance = square(q, known);
            let along: f64 = q.iter().zip(known).zip(change).map(|((a, b), dq)| (a - b).dot(dq)).sum();
            // The derivative of ln(1 + l^2/d^2) along the correction.
            let by = 2.0 * along / q.len() as f64;
            slope -= self.length.powi(2) * by / (distance * (distance + self.length.powi(2)));
        }
        let stretch = 1.0 / (1.0 - slope);
        // At the one point of the line where the formula has a pole any multiple serves, the line search shortens it.
        (self.factor(q), if stretch.is_finite() { stretch } else { 1.0 })
    }
}

/// The mean square distance of two paths.
fn square<const N: usize>(a: &[SVector<f64, N>], b: &[SVector<f64, N>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum::<f64>() / a.len() as f64
}
