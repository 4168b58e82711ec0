//! Products of matrices with vectors of coordinates.

use crate::Vector;
use contact_geom::nalgebra::DMatrix;

/// The product `m x`, summed column by column.
pub(crate) fn times(m: &DMatrix<f64>, x: &[f64]) -> Vector {
    let mut product = Vector::zeros(m.nrows());
    for (column, x) in m.column_iter().zip(x) {
        product.iter_mut().zip(column.iter()).for_each(|(sum, m)| *sum += m * x);
    }
    product
}

/// The product of the transpose of m with x.
pub(crate) fn transposed_times(m: &DMatrix<f64>, x: &Vector) -> Vector {
    let mut columns = m.column_iter();
    Vector::from_fn(m.ncols(), |_| columns.next().map_or(f64::NAN, |column| x.dot(column.as_slice())))
}
