//! Conjugate gradients for the matrix of a midpoint step, without forming the matrix.

use crate::SparseError;
use crate::system::SparseSystem;
use discrete_herglotz::StepError;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::matrix_free::conjugate_gradient::{CgError, CgParams, conjugate_gradient, conjugate_gradient_scratch};
use faer::matrix_free::{IdentityPrecond, InitialGuessStatus, LinOp};
use faer::{MatMut, MatRef, Par};
use std::sync::{Mutex, PoisonError};

/// The relative residual of a solution, about the square root of the machine epsilon. Newton's method corrects the
/// remaining error, and two iterations reach round-off.
const RELATIVE_RESIDUAL: f64 = 1e-8;

/// The maximum number of matrix-vector products for one solution. A step that needs more is far too long for its
/// forces.
const MAX_PRODUCTS: u32 = 1000;

/// Solves `(M + (h^2/4) V_qq) x = b` by faer's conjugate gradients in the variables `M^(1/2) x`. In these variables the
/// matrix is the identity plus the contribution of the forces, for any masses.
pub(super) struct ConjugateGradients {
    /// `M^(-1/2)`.
    inverse_roots: Vec<f64>,
    /// A vector and its product with the matrix, both padded.
    padded: Mutex<[Vec<f64>; 2]>,
    scaled: Vec<f64>,
    scratch: MemBuffer,
    products: u64,
}

impl ConjugateGradients {
    /// The solver for a system in which every unknown has a mass.
    ///
    /// # Errors
    /// [`SparseError::Memory`].
    pub fn new(system: &SparseSystem) -> Result<Self, SparseError> {
        let n = system.unknowns();
        let inverse_roots = (0..n).map(|i| system.mass(i).sqrt().recip()).collect();
        let request =
            conjugate_gradient_scratch::<f64>(IdentityPrecond { dim: n }, IdentityPrecond { dim: n }, 1, Par::Seq);
        let too_much = |_| SparseError::Memory { needed: request.size_bytes(), limit: usize::MAX };
        Ok(ConjugateGradients {
            inverse_roots,
            padded: Mutex::new([vec![0.0; n + 2], vec![0.0; n + 2]]),
            scaled: vec![0.0; n],
            scratch: MemBuffer::try_new(request).map_err(too_much)?,
            products: 0,
        })
    }

    /// The number of matrix-vector products so far.
    pub fn products(&self) -> u64 {
        self.products
    }

    /// Solves the system at padded positions, with `factor = h^2/4`; `b` is overwritten with the solution.
    ///
    /// # Errors
    /// [`StepError::Singular`] if the matrix is not positive definite, [`StepError::NotConverged`] with the residual,
    /// [`StepError::NonFinite`] if the solution is not finite.
    pub fn solve(
        &mut self,
        system: &SparseSystem,
        (t, q): (f64, &[f64]),
        factor: f64,
        b: &mut [f64],
    ) -> Result<(), StepError> {
        let ConjugateGradients { inverse_roots, padded, scaled, scratch, products } = self;
        let n = b.len();
        for ((y, b), root) in scaled.iter_mut().zip(b.iter_mut()).zip(inverse_roots.iter()) {
            (*y, *b) = (*b * root, 0.0);
        }
        let matrix = ScaledMatrix { system, t, q, factor, inverse_roots, padded };
        let params = CgParams {
            // With `Zero`, faer 0.24.4 uses a residual that it has not initialised.
            initial_guess: InitialGuessStatus::MaybeNonZero,
            rel_tolerance: RELATIVE_RESIDUAL,
            max_iters: MAX_PRODUCTS as usize,
            ..CgParams::default()
        };
        let outcome = conjugate_gradient(
            MatMut::from_column_major_slice_mut(b, n, 1),
            IdentityPrecond { dim: n },
            &matrix,
            MatRef::from_column_major_slice(scaled, n, 1),
            params,
            |_| {},
            Par::Seq,
            MemStack::new(scratch),
        );
        match outcome {
            Ok(info) => *products += info.iter_count as u64,
            Err(CgError::NoConvergence { abs_residual, .. }) => {
                return Err(StepError::NotConverged { residual: abs_residual, iterations: MAX_PRODUCTS });
            }
            Err(_) => return Err(StepError::Singular { pivot: 0.0 }),
        }
        for (x, root) in b.iter_mut().zip(inverse_roots.iter()) {
            *x *= root;
        }
        if b.iter().sum::<f64>().is_finite() { Ok(()) } else { Err(StepError::NonFinite) }
    }
}

/// `1 + (h^2/4) M^(-1/2) V_qq M^(-1/2)`, applied to vectors by directional derivatives of the forces.
struct ScaledMatrix<'a> {
    system: &'a SparseSystem,
    t: f64,
    q: &'a [f64],
    factor: f64,
    inverse_roots: &'a [f64],
    padded: &'a Mutex<[Vec<f64>; 2]>,
}

impl std::fmt::Debug for ScaledMatrix<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ScaledMatrix").field("unknowns", &self.inverse_roots.len()).finish()
    }
}

impl LinOp<f64> for ScaledMatrix<'_> {
    fn apply_scratch(&self, _rhs_ncols: usize, _par: Par) -> StackReq {
        StackReq::EMPTY
    }

    fn nrows(&self) -> usize {
        self.inverse_roots.len()
    }

    fn ncols(&self) -> usize {
        self.inverse_roots.len()
    }

    fn apply(&self, mut out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, _par: Par, _stack: &mut MemStack) {
        let mut padded = self.padded.lock().unwrap_or_else(PoisonError::into_inner);
        let [x, product] = &mut *padded;
        for j in 0..rhs.ncols() {
            product.fill(0.0);
            for (i, root) in self.inverse_roots.iter().enumerate() {
                x[i + 1] = rhs[(i, j)] * root;
            }
            for list in &self.system.potentials {
                list.add_hessian_product(self.t, self.q, x, product);
            }
            for (i, root) in self.inverse_roots.iter().enumerate() {
                out[(i, j)] = rhs[(i, j)] + self.factor * root * product[i + 1];
            }
        }
    }

    fn conj_apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, par: Par, stack: &mut MemStack) {
        self.apply(out, rhs, par, stack);
    }
}
