//! Coefficients of Gauss collocation.

use contact_geom::support::legendre_polynomials;
use std::array::from_fn;
use std::sync::LazyLock;

/// The largest number of nodes of a panel: order 48.
pub(crate) const MAX_NODES: usize = 24;

/// The numbers of nodes that a panel may have: few for a short one, many for a long one. Each is at most twice the
/// one before, so that the solution with few nodes is a good guess for that with more.
const NODE_COUNTS: [usize; 4] = [4, 8, 14, MAX_NODES];

/// The golden ratio minus one: of all numbers, the fractional parts of its multiples are the most evenly distributed.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Gauss collocation with `s` nodes on `[0, 1]`, for systems `q' = v, v' = a`.
pub(crate) struct Gauss {
    /// The number of nodes.
    pub s: usize,
    /// The nodes.
    pub c: [f64; MAX_NODES],
    /// The weights.
    pub b: [f64; MAX_NODES],
    /// The integrals of the Lagrange polynomials from 0 to each node: `v_i = v0 + h sum_j a_ij a_j`.
    pub a: [[f64; MAX_NODES]; MAX_NODES],
    /// The square of that matrix: `q_i = q0 + h c_i v0 + h^2 sum_j aa_ij a_j`.
    pub aa: [[f64; MAX_NODES]; MAX_NODES],
    /// `b_j (1 - c_j)`: the position at the end is `q0 + h v0 + h^2 sum_j end_j a_j`.
    pub end: [f64; MAX_NODES],
    /// The functionals that give the last two Legendre coefficients of a function from its values at the nodes.
    pub tail: [[f64; MAX_NODES]; 2],
    /// The functionals that give the two coefficients halfway to the last.
    pub middle: [[f64; MAX_NODES]; 2],
    /// The interpolation matrix: from the values at these nodes to the values of their polynomial at the nodes of the
    /// next larger collocation.
    pub refine: [[f64; MAX_NODES]; MAX_NODES],
    /// The weights of the value at 0 of the polynomial with given values at the nodes.
    pub start: [f64; MAX_NODES],
    /// The points other than the nodes at which a solution is compared with its equations: the end; the Gauss points of
    /// one node more; and multiples of the golden ratio modulo 1, of which any number of the first are evenly
    /// distributed.
    pub probes: Vec<Probe>,
}

/// A point of `[0, 1]` other than the nodes, with the weights that give a solution there from its values at the nodes.
pub(crate) struct Probe {
    /// The point.
    pub c: f64,
    /// Its weight in Gauss quadrature with one more node; 0 if it is not a node of that.
    pub weight: f64,
    /// The weights of the rates.
    pub value: [f64; MAX_NODES],
    /// The weights of the integral of the rates from 0.
    pub once: [f64; MAX_NODES],
    /// The weights of the integral of that integral.
    pub twice: [f64; MAX_NODES],
}

/// The number of points at which a long motion is checked in total, at least: their largest distance is
/// about a hundredth of the motion.
pub(crate) const PROBES: usize = 128;

/// The number of points at which a panel without any force is checked. Such a panel may be as long as the whole motion,
/// so that it is checked more closely.
pub(crate) const PROBES_WITHOUT_FORCE: usize = 1024;

/// The number of Legendre polynomials that is sufficient for any number of nodes.
const POLYNOMIALS: usize = MAX_NODES + 2;

/// The Gauss weight on `[0, 1]` of a node x, one of s nodes on `[-1, 1]`.
fn weight(s: usize, x: f64) -> f64 {
    let below = s as f64 * legendre_polynomials::<_, POLYNOMIALS>(s, x)[s - 1];
    (1.0 - x * x) / (below * below)
}

impl Gauss {
    /// The nodes on `[-1, 1]`, 0 beyond the last.
    fn nodes(s: usize) -> [f64; MAX_NODES + 1] {
        let n = s as f64;
        from_fn(|i| {
            if i >= s {
                return 0.0;
            }
            // Tricomi's approximation, then Newton's method, which converges quadratically: five steps are more than
            // enough.
            let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            for _ in 0..5 {
                let p = legendre_polynomials::<_, POLYNOMIALS>(s, x);
                x -= p[s] * (x * x - 1.0) / (n * (x * p[s] - p[s - 1]));
            }
            x
        })
    }

    fn new(s: usize, next: usize) -> Self {
        let (nodes, beyond, between) = (Self::nodes(s), Self::nodes(next), Self::nodes(s + 1));
        let polynomials: [_; MAX_NODES] = from_fn(|j| legendre_polynomials::<_, POLYNOMIALS>(s, nodes[j]));
        let c = from_fn(|j| (1.0 + nodes[j]) * 0.5);
        let rough: [f64; MAX_NODES] = from_fn(|j| if j < s { weight(s, nodes[j]) } else { 0.0 });
        // The closed formula amplifies the rounding of the nodes. The exact integrals of the Legendre polynomials are
        // known; one correction by them makes all weights accurate to the last digit.
        let defects: [f64; MAX_NODES] = from_fn(|k| {
            let sum: f64 = (0..s).map(|j| rough[j] * polynomials[j][k]).sum();
            if k == 0 { 1.0 - sum } else { -sum }
        });
        let b = from_fn(|j| {
            let p = polynomials[j];
            rough[j] * (1.0 + (0..s).map(|k| (2 * k + 1) as f64 * p[k] * defects[k]).sum::<f64>())
        });
        // The Lagrange polynomial of node j is b_j sum (2k+1) P_k(x_j) P_k, and the integral of P_k is a difference of
        // two Legendre polynomials.
        let integrals = |x: f64| -> [f64; MAX_NODES] {
            let at = legendre_polynomials::<_, POLYNOMIALS>(s, x);
            from_fn(|j| {
                let p = polynomials[j];
                let rest: f64 = (1..s).map(|k| p[k] * (at[k + 1] - at[k - 1])).sum();
                b[j] * 0.5 * (1.0 + x + rest)
            })
        };
        let a: [[f64; MAX_NODES]; MAX_NODES] = from_fn(|i| if i < s { integrals(nodes[i]) } else { [0.0; MAX_NODES] });
        let aa = from_fn(|i| from_fn(|j| (0..s).map(|k| a[i][k] * a[k][j]).sum()));
        let coefficient = |k: usize| from_fn(|j| (2 * k + 1) as f64 * b[j] * polynomials[j][k]);
        // The values of the Lagrange polynomials, and their integrals from -1, at x.
        let lagrange = |x: f64| {
            let at = legendre_polynomials::<_, POLYNOMIALS>(s, x);
            from_fn(|j| {
                let p = polynomials[j];
                b[j] * (0..s).map(|k| (2 * k + 1) as f64 * p[k] * at[k]).sum::<f64>()
            })
        };
        let probe = |k: usize| {
            let (c, weight) = match k {
                0 => (1.0, 0.0),
                _ if k <= s + 1 => (0.5 * (1.0 + between[k - 1]), weight(s + 1, between[k - 1])),
                _ => (((k - s - 1) as f64 * GOLDEN).fract(), 0.0),
            };
            let once: [f64; MAX_NODES] = integrals(2.0 * c - 1.0);
            let twice = from_fn(|j| (0..s).map(|k| once[k] * a[k][j]).sum());
            Probe { c, weight, value: lagrange(2.0 * c - 1.0), once, twice }
        };
        let refine = from_fn(|i| if i < next { lagrange(beyond[i]) } else { [0.0; MAX_NODES] });
        Gauss {
            s,
            refine,
            c,
            b,
            aa,
            end: from_fn(|j| b[j] * (1.0 - c[j])),
            tail: [s - 1, s - 2].map(coefficient),
            middle: [s / 2, s / 2 - 1].map(coefficient),
            start: lagrange(-1.0),
            probes: (0..if s == NODE_COUNTS[0] { PROBES_WITHOUT_FORCE } else { PROBES }).map(probe).collect(),
            a,
        }
    }
}

/// The tables, computed once.
static TABLES: LazyLock<[Gauss; 4]> =
    LazyLock::new(|| from_fn(|i| Gauss::new(NODE_COUNTS[i], *NODE_COUNTS.get(i + 1).unwrap_or(&NODE_COUNTS[i]))));

/// The collocations from the one with fewest nodes to the one with most.
pub(crate) fn collocations() -> &'static [Gauss; 4] {
    &TABLES
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The weights integrate all polynomials of degree `2s - 1` and the matrix those of degree `s - 1`, both to a few
    /// units of round-off, since the sums have positive terms or terms below one.
    #[test]
    fn the_coefficients_integrate_polynomials() {
        let eps = 4.0 * f64::EPSILON;
        for g in collocations() {
            for k in 0..2 * g.s {
                let sum: f64 = (0..g.s).map(|j| g.b[j] * g.c[j].powi(k as i32)).sum();
                assert!((sum - 1.0 / (k + 1) as f64).abs() < eps, "s = {}, degree {k}: {sum}", g.s);
            }
            for (i, k) in (0..g.s).flat_map(|i| (0..g.s).map(move |k| (i, k))) {
                let row =
                    |m: &[[f64; MAX_NODES]; MAX_NODES]| (0..g.s).map(|j| m[i][j] * g.c[j].powi(k as i32)).sum::<f64>();
                let (once, n) = (g.c[i].powi(k as i32 + 1), (k + 1) as f64);
                assert!((row(&g.a) - once / n).abs() < eps, "s = {}, row {i}, degree {k}", g.s);
                if k + 1 < g.s {
                    assert!((row(&g.aa) - once * g.c[i] / (n * (n + 1.0))).abs() < eps, "twice: {i}, {k}");
                }
            }
        }
    }

    /// The weights of the probes integrate all polynomials up to degree `2s + 1`, also the polynomial of degree s that
    /// vanishes at the nodes, which the collocation does not detect. Their closed formula amplifies the rounding of the
    /// nodes some hundred times.
    #[test]
    fn the_weights_between_the_nodes_integrate_polynomials() {
        for g in collocations() {
            for k in 0..=2 * g.s + 1 {
                let sum: f64 = g.probes.iter().map(|p| p.weight * p.c.powi(k as i32)).sum();
                assert!((sum - 1.0 / (k + 1) as f64).abs() < 512.0 * f64::EPSILON, "s = {}, degree {k}: {sum}", g.s);
            }
        }
    }

    /// Polynomials of degree `s - 1` are interpolated exactly at the next nodes.
    #[test]
    fn refinement_is_interpolation() {
        for pair in collocations().windows(2) {
            let ([from, to], degree) = ([&pair[0], &pair[1]], pair[0].s as i32 - 1);
            for i in 0..to.s {
                let value: f64 = (0..from.s).map(|j| from.refine[i][j] * from.c[j].powi(degree)).sum();
                assert!((value - to.c[i].powi(degree)).abs() < 1e-14, "{} to {}, node {i}", from.s, to.s);
            }
        }
    }

    /// Checked on the Legendre polynomials themselves.
    #[test]
    fn the_tail_is_the_last_two_legendre_coefficients() {
        for g in collocations() {
            for (row, k) in [g.s - 1, g.s - 2].into_iter().enumerate() {
                let of = |m: usize| {
                    (0..g.s)
                        .map(|j| g.tail[row][j] * legendre_polynomials::<_, POLYNOMIALS>(g.s, 2.0 * g.c[j] - 1.0)[m])
                        .sum::<f64>()
                };
                assert!((of(k) - 1.0).abs() < 1e-14);
                assert!((0..g.s).filter(|m| *m != k).all(|m| of(m).abs() < 1e-14));
            }
        }
    }
}
