//! Products of matrices and vectors whose length is known at run time, in the order of summation of nalgebra's products
//! of static size.

use contact_geom::nalgebra::{DMatrix, DVectorView};

/// `y = M x`, summed column by column.
pub(crate) fn product(m: &DMatrix<f64>, x: &[f64], y: &mut [f64]) {
    product_with(m, |entry| entry, x, y);
}

/// `y = |M| x`, with the absolute values of the entries.
pub(crate) fn product_of_sizes(m: &DMatrix<f64>, x: &[f64], y: &mut [f64]) {
    product_with(m, f64::abs, x, y);
}

/// `Y = M X`.
pub(crate) fn matrix_product(m: &DMatrix<f64>, x: &DMatrix<f64>, y: &mut DMatrix<f64>) {
    let n = m.nrows();
    for (x, y) in x.as_slice().chunks_exact(n).zip(y.as_mut_slice().chunks_exact_mut(n)) {
        product(m, x, y);
    }
}

/// `y = M x` with a function of the entries of M.
#[inline(always)]
fn product_with(m: &DMatrix<f64>, of: impl Fn(f64) -> f64, x: &[f64], y: &mut [f64]) {
    for (j, (column, x)) in m.column_iter().zip(x).enumerate() {
        for (y, entry) in y.iter_mut().zip(column.iter()) {
            let term = of(*entry) * x;
            // Without a zero to start from, which would change the sign of a sum that is -0.
            *y = if j == 0 { term } else { term + *y };
        }
    }
}

/// The scalar product. For two, three and four components the order of nalgebra's static vectors is not that of its
/// dynamic ones.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    match (a, b) {
        ([a0, a1], [b0, b1]) => a0 * b0 + a1 * b1,
        ([a0, a1, a2], [b0, b1, b2]) => a0 * b0 + a1 * b1 + a2 * b2,
        ([a0, a1, a2, a3], [b0, b1, b2, b3]) => (a0 * b0 + a2 * b2) + (a1 * b1 + a3 * b3),
        _ => DVectorView::from_slice(a, a.len()).dot(&DVectorView::from_slice(b, b.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::nalgebra::{SMatrix, SVector};

    /// The bits of the products of a matrix and vectors of static size, and of those of the same data at run time.
    fn bits<const N: usize>() -> [Vec<u64>; 2] {
        let number = |i: usize| (1.0 + i as f64).sin() * 10f64.powi((5 * i % 7) as i32);
        let (m, k) =
            (SMatrix::<f64, N, N>::from_fn(|i, j| number(i + N * j)), SMatrix::from_fn(|i, j| number(3 * i + 2 * j)));
        let [x, y] = [1, 4].map(|from| SVector::<f64, N>::from_fn(|i, _| number(from + 2 * i)));
        let mut of_static = vec![x.dot(&y)];
        of_static.extend(&(m.abs() * y));
        of_static.extend(&(m * k));
        let [dynamic, other] = [m, k].map(|m| DMatrix::from_column_slice(N, N, m.as_slice()));
        let (mut sizes, mut matrix) = (vec![0.0; N], DMatrix::zeros(N, N));
        product_of_sizes(&dynamic, y.as_slice(), &mut sizes);
        matrix_product(&dynamic, &other, &mut matrix);
        let mut at_run_time = vec![dot(x.as_slice(), y.as_slice())];
        at_run_time.extend(sizes);
        at_run_time.extend(&matrix);
        [of_static, at_run_time].map(|numbers| numbers.into_iter().map(f64::to_bits).collect())
    }

    #[test]
    fn products_are_those_of_static_size() {
        for [of_static, at_run_time] in
            [bits::<1>(), bits::<2>(), bits::<3>(), bits::<4>(), bits::<5>(), bits::<7>(), bits::<8>(), bits::<21>()]
        {
            assert_eq!(of_static, at_run_time);
        }
    }
}
