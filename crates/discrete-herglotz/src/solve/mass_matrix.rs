//! The mass matrix `W = L_vv` and its inverse.

use contact_geom::nalgebra::SMatrix;
use contact_geom::support::linear::{self, SingularMatrix};
use contact_geom::{Derivatives, Lagrangian, VelocityPoint};

/// The largest dimension whose directions are carried at once; larger ones go in blocks, so that the numbers stay small
/// enough for the stack and for registers.
pub(crate) const BLOCK: usize = 8;

/// W alone where there are many coordinates; else with the other second derivatives, which are compiled in any case.
pub(crate) fn mass_matrix<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> SMatrix<f64, N, N> {
    if const { N > BLOCK } { lagrangian.mass_matrix(t, x) } else { lagrangian.hessian(t, x).vv }
}

/// Whether a matrix is the identity; without one to compare with, for the sake of the stack.
pub(crate) fn is_identity<const N: usize>(m: &SMatrix<f64, N, N>) -> bool {
    (0..N).all(|j| (0..N).all(|i| m[(i, j)] == f64::from(u8::from(i == j))))
}

/// W on the heap, for what is kept.
#[inline(never)]
pub(crate) fn kept_mass_matrix<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Box<SMatrix<f64, N, N>> {
    Box::new(mass_matrix(lagrangian, t, x))
}

/// The inverse, column by column, on the heap.
#[inline(never)]
pub(crate) fn inverted<const N: usize>(m: &SMatrix<f64, N, N>) -> Result<Box<SMatrix<f64, N, N>>, SingularMatrix> {
    let mut inverse = SMatrix::<f64, N, N>::identity();
    for mut column in inverse.column_iter_mut() {
        linear::solve(&mut m.clone_owned(), &mut column)?;
    }
    Ok(Box::new(inverse))
}
