//! The matrix of the multipliers, `G M^-1 G^T`, and its factors.

use crate::SparseError;
use crate::constraints::jacobian::JacobianPattern;
use crate::implicit::{CholeskyFactors, FullPattern, LowerPattern, LuFactors};
use discrete_herglotz::StepError;

/// The constraints count as dependent if the smallest eigenvalue of the matrix, scaled to a unit diagonal, is below three
/// times this shift of the diagonal. It is some hundred times the round-off of a factorisation; for a straight chain the
/// eigenvalue is about the inverse square of the number of links.
const SHIFT: f64 = 512.0 * f64::EPSILON;

/// A term of a matrix product `A D^T` of two matrices with the pattern of the Jacobian: the product of an entry of A and
/// an entry of D, and the entry of the product to which it is added.
#[derive(Clone, Copy)]
struct Product {
    sum: u32,
    row: u32,
    column: u32,
}

/// The sparse matrices of the multipliers. After elimination of positions and momenta these are the only equations of
/// the saddle-point system `[M, G^T; G, 0]`. Two constraints are coupled if they share an unknown; for a chain the matrix
/// is tridiagonal, so that its factors have a number of entries that is linear in the number of links.
pub(super) struct GramMatrix {
    /// The lower triangle of `G M^-1 G^T`.
    symmetric: Vec<Product>,
    entries: Vec<f64>,
    /// The indices of the diagonal entries.
    diagonal: Vec<u32>,
    cholesky: CholeskyFactors,
    /// The whole matrix `G M^-1 G_0^T` with two Jacobians.
    unsymmetric: Vec<Product>,
    lu: LuFactors,
}

impl GramMatrix {
    /// Analyses the pattern of a Jacobian with the given number of unknowns.
    ///
    /// # Errors
    /// [`SparseError::Memory`] if the matrices need more than `limit` bytes.
    pub fn new(jacobian: &JacobianPattern, unknowns: usize, limit: usize) -> Result<Self, SparseError> {
        let constraints = jacobian.constraints();
        // For each unknown, its constraints and the entries of the Jacobian.
        let mut of_unknown: Vec<[u32; 3]> = Vec::with_capacity(jacobian.columns.len());
        for (constraint, ends) in jacobian.row_starts.windows(2).enumerate() {
            let entries = (ends[0]..ends[1]).zip(&jacobian.columns[ends[0]..ends[1]]);
            let free = entries.filter(|(_, unknown)| (1..=unknowns as u32).contains(unknown));
            of_unknown.extend(free.map(|(entry, unknown)| [*unknown, constraint as u32 + 1, entry as u32]));
        }
        of_unknown.sort_unstable();
        let unknowns = || of_unknown.chunk_by(|a, b| a[0] == b[0]);
        let count: usize = unknowns().map(|entries| entries.len().saturating_pow(2)).fold(0, usize::saturating_add);
        let needed = count.saturating_mul(2 * size_of::<Product>());
        if needed > limit {
            return Err(SparseError::Memory { needed, limit });
        }
        let lower = LowerPattern::new(constraints, |f| {
            let mut indices = Vec::new();
            for entries in unknowns() {
                indices.clear();
                indices.extend(entries.iter().map(|[_, constraint, _]| *constraint as usize));
                f(&indices);
            }
        })?;
        let full = FullPattern::new(&lower)?;
        let (mut symmetric, mut unsymmetric) = (Vec::new(), Vec::new());
        for entries in unknowns() {
            for [_, a, row] in entries {
                for [_, b, column] in entries {
                    let product = |sum| Product { sum, row: *row, column: *column };
                    let (i, j) = (*a as usize, *b as usize);
                    unsymmetric.push(product(full.entry(i, j)));
                    if i >= j {
                        symmetric.push(product(lower.entry(i, j)));
                    }
                }
            }
        }
        let (column_starts, rows) = full.blocks(1)?;
        let entries = vec![0.0; lower.rows.len()];
        let diagonal = (1..=constraints).map(|a| lower.entry(a, a)).collect();
        let cholesky = CholeskyFactors::new(lower, limit)?;
        let lu = LuFactors::new(column_starts, rows, limit)?;
        Ok(GramMatrix { symmetric, entries, diagonal, cholesky, unsymmetric, lu })
    }

    /// Factorises `G M^-1 G^T`, given the entries of G and those of `G M^-1`.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the constraints are dependent, [`StepError::NonFinite`].
    pub fn factorise(&mut self, g: &[f64], weighted: &[f64]) -> Result<(), StepError> {
        self.entries.fill(0.0);
        add_products(&self.symmetric, g, weighted, &mut self.entries);
        self.cholesky.factorise(&self.entries)?;
        // The matrix is positive definite if and only if the constraints are independent.
        if self.cholesky.is_definite() { Ok(()) } else { Err(StepError::Singular { pivot: 0.0 }) }
    }

    /// Solves `G M^-1 G^T y = b` with the last factors; b is overwritten with y.
    ///
    /// # Errors
    /// [`StepError::Singular`] if y is not finite.
    pub fn solve(&mut self, b: &mut [f64]) -> Result<(), StepError> {
        self.cholesky.solve(b)
    }

    /// Factorises `G M^-1 G_0^T`, given the entries of G and those of `G_0 M^-1`.
    ///
    /// # Errors
    /// Those of [`factorise`](Self::factorise).
    pub fn factorise_unsymmetric(&mut self, g: &[f64], weighted: &[f64]) -> Result<(), StepError> {
        self.lu.entries.fill(0.0);
        add_products(&self.unsymmetric, g, weighted, &mut self.lu.entries);
        self.lu.factorise()
    }

    /// Solves `G M^-1 G_0^T y = b` with the last factors; b is overwritten with y.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the matrix is singular.
    pub fn solve_unsymmetric(&mut self, b: &mut [f64]) -> Result<(), StepError> {
        self.lu.solve(b)
    }

    /// A constraint that depends on others; `None` if there is none. It is found by inverse iteration on the matrix
    /// scaled to a unit diagonal, whose diagonal is increased by the relative shift [`SHIFT`], so that it is regular. The
    /// factors are those of the shifted matrix afterwards.
    pub fn dependent(&mut self, g: &[f64], weighted: &[f64]) -> Option<usize> {
        self.entries.fill(0.0);
        add_products(&self.symmetric, g, weighted, &mut self.entries);
        let diagonal: Vec<f64> = self.diagonal.iter().map(|entry| self.entries[*entry as usize]).collect();
        if let Some(constraint) = diagonal.iter().position(|d| *d == 0.0) {
            return Some(constraint);
        }
        for (entry, d) in self.diagonal.iter().zip(&diagonal) {
            self.entries[*entry as usize] = d + SHIFT * d;
        }
        // A start without symmetry, which is not orthogonal to the typical kernels.
        let mut x: Vec<f64> = (0..diagonal.len()).map(|a| 1.0 + 0.5 * (1.7 * a as f64).sin()).collect();
        let mut inverse = f64::INFINITY;
        if self.cholesky.factorise(&self.entries).is_ok() {
            for _ in 0..3 {
                let size = x.iter().map(|x| x * x).sum::<f64>().sqrt();
                x.iter_mut().zip(&diagonal).for_each(|(x, d)| *x *= d.sqrt() / size);
                if self.cholesky.solve(&mut x).is_err() {
                    break;
                }
                x.iter_mut().zip(&diagonal).for_each(|(x, d)| *x *= d.sqrt());
                inverse = x.iter().map(|x| x * x).sum::<f64>().sqrt();
            }
        }
        let largest = || (0..x.len()).max_by(|a, b| x[*a].abs().total_cmp(&x[*b].abs()));
        if inverse < 0.25 / SHIFT { None } else { largest() }
    }
}

/// Adds the products of the entries of two matrices to the entries of a third.
fn add_products(products: &[Product], a: &[f64], b: &[f64], sums: &mut [f64]) {
    for Product { sum, row, column } in products {
        sums[*sum as usize] += a[*row as usize] * b[*column as usize];
    }
}
