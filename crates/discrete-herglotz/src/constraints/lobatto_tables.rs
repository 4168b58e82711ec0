//! Coefficients of the Lobatto IIIA and IIIB methods.

use contact_geom::support::legendre_polynomials;

/// The least and the largest number of stages.
pub(super) const STAGES: std::ops::RangeInclusive<usize> = 2..=8;
const POLYNOMIALS: usize = 10;

/// The nodes c on `[0, 1]`, the weights b, the Lobatto IIIA matrix `a` (collocation) and the IIIB matrix `a_hat`, which
/// is adjoint to it: `b_i a_hat_ij + b_j a_ji = b_i b_j`.
#[derive(Clone, Debug)]
pub(super) struct LobattoTables {
    pub c: Vec<f64>,
    pub b: Vec<f64>,
    pub a: Vec<Vec<f64>>,
    pub a_hat: Vec<Vec<f64>>,
}

impl LobattoTables {
    /// The coefficients for s stages. The inner nodes are the zeros of `P'_(s-1)`. The Lagrange polynomial of node j is
    /// `sum_k w_j P_k(x_j) P_k / gamma_k` by the discrete orthogonality of Lobatto quadrature, with `gamma_k =
    /// 2/(2k+1)` and `gamma_(s-1) = 2/(s-1)`, and the integral of `P_k` from -1 is `(P_(k+1) - P_(k-1))/(2k+1)`.
    pub fn new(s: usize) -> Self {
        let n = s - 1;
        let legendre = |x: f64| legendre_polynomials::<f64, POLYNOMIALS>(n + 1, x);
        let node = |i: usize| {
            if i == 0 || i == n {
                return if i == 0 { -1.0 } else { 1.0 };
            }
            // Newton's method for (1 - x^2) P_n' / n = P_(n-1) - x P_n, whose derivative is -(n + 1) P_n.
            let mut x = -(std::f64::consts::PI * i as f64 / n as f64).cos();
            for _ in 0..20 {
                let p = legendre(x);
                x += (p[n - 1] - x * p[n]) / ((n + 1) as f64 * p[n]);
            }
            x
        };
        let x: Vec<f64> = (0..s).map(node).collect();
        let at: Vec<_> = x.iter().map(|x| legendre(*x)).collect();
        let weight = |j: usize| 2.0 / (n as f64 * s as f64 * at[j][n] * at[j][n]);
        let b: Vec<f64> = (0..s).map(|j| 0.5 * weight(j)).collect();
        let integral = |i: usize, k: usize| match k {
            0 => x[i] + 1.0,
            k => (at[i][k + 1] - at[i][k - 1]) / (2 * k + 1) as f64,
        };
        let entry = |i: usize, j: usize| {
            let norm = |k: usize| if k == n { 2.0 / n as f64 } else { 2.0 / (2 * k + 1) as f64 };
            (0..s).map(|k| 0.5 * weight(j) * at[j][k] / norm(k) * integral(i, k)).sum::<f64>()
        };
        // The first row and the last column are known exactly.
        let a: Vec<Vec<f64>> = (0..s)
            .map(|i| match i {
                0 => vec![0.0; s],
                i if i == n => b.clone(),
                i => (0..s).map(|j| entry(i, j)).collect(),
            })
            .collect();
        let adjoint = |i: usize, j: usize| match j {
            0 => b[0],
            j if j == n => 0.0,
            j => b[j] * (1.0 - a[j][i] / b[i]),
        };
        let a_hat = (0..s).map(|i| (0..s).map(|j| adjoint(i, j)).collect()).collect();
        LobattoTables { c: x.iter().map(|x| 0.5 * (x + 1.0)).collect(), b, a, a_hat }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quadrature conditions, the collocation conditions `sum_j a_ij c_j^(k-1) = c_i^k / k` and the published
    /// matrices for three stages hold to a few roundings.
    #[test]
    fn coefficients_of_lobatto_methods() {
        for s in STAGES {
            let t = LobattoTables::new(s);
            for k in 1..2 * s - 1 {
                let sum: f64 = (0..s).map(|j| t.b[j] * t.c[j].powi(k as i32 - 1)).sum();
                assert!((sum * k as f64 - 1.0).abs() < 32.0 * f64::EPSILON, "{s}, {k}: {sum}");
            }
            for i in 0..s {
                for k in 1..=s as i32 {
                    let sum: f64 = (0..s).map(|j| t.a[i][j] * t.c[j].powi(k - 1)).sum();
                    assert!((sum - t.c[i].powi(k) / f64::from(k)).abs() < 32.0 * f64::EPSILON, "{s}, {i}, {k}");
                }
                // IIIB satisfies these conditions up to s - 2.
                for k in 1..=s as i32 - 2 {
                    let sum: f64 = (0..s).map(|j| t.a_hat[i][j] * t.c[j].powi(k - 1)).sum();
                    assert!((sum - t.c[i].powi(k) / f64::from(k)).abs() < 32.0 * f64::EPSILON, "{s}, {i}, {k}");
                }
            }
        }
        let t = LobattoTables::new(3);
        let published = [[1.0 / 6.0, -1.0 / 6.0, 0.0], [1.0 / 6.0, 1.0 / 3.0, 0.0], [1.0 / 6.0, 5.0 / 6.0, 0.0]];
        for (row, known) in t.a_hat.iter().zip(published) {
            assert!(row.iter().zip(known).all(|(a, b)| (a - b).abs() < 8.0 * f64::EPSILON));
        }
    }
}
