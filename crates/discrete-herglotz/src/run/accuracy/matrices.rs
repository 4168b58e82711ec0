//! Matrices whose size is known at run time.

use crate::Vector;
use crate::gauss::stages::product::matrix_product;
use contact_geom::nalgebra::DMatrix;

/// The product of two square matrices.
pub(crate) fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut product = DMatrix::zeros(a.nrows(), a.nrows());
    matrix_product(a, b, &mut product);
    product
}

/// The Frobenius norm, summed column by column.
pub(crate) fn frobenius_norm(m: &DMatrix<f64>) -> f64 {
    m.column_iter().fold(0.0, |sum, column| sum + Vector::from(column.as_slice()).norm_squared()).sqrt()
}
