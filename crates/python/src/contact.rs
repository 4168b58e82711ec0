//! The check whether a map of (q, p, z) is a contact transformation.

use crate::arrays::{matrix, number, numbers, value_error, vector};
use crate::table::Table;
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{ChartVector, Darboux, Dual, support::conformality_with_jacobian};
use herglotz_runtime::Formula;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// The conformal factor, the defect, the image and the Jacobian.
type Found = (f64, f64, Py<PyArray1<f64>>, Py<PyArray2<f64>>);

/// The pullback of `dz - p dq` by a map at a point, where the components of the map are formulas in q, p (in place of
/// the velocities) and z.
#[pyfunction]
pub fn conformality(
    py: Python<'_>,
    components: Vec<String>,
    tables: Vec<(String, Bound<'_, Table>)>,
    at: (Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>),
) -> PyResult<Found> {
    let (q, p, z) = (numbers("q", &at.0)?, numbers("p", &at.1)?, number("z", &at.2)?);
    let n = q.len();
    if p.len() != n {
        return Err(value_error(format!("`p` has {} numbers, but `q` has {n}", p.len())));
    }
    let names = format!("q[{n}]");
    let mut formula = Formula::parse("0", &[names.as_str()], &[]).map_err(value_error)?;
    for (name, table) in &tables {
        formula = formula.with_table(name, &table.get().inner).map_err(value_error)?;
    }
    let size = 2 * n + 1;
    let (mut image, mut jacobian) = (Vec::with_capacity(size), DMatrix::zeros(size, size));
    for (i, text) in components.iter().enumerate().take(size) {
        let component = formula.expression(text).map_err(value_error)?;
        for j in 0..size {
            let seeded = |k: usize, x: f64| Dual { re: x, d: SVector::<f64, 1>::new(if k == j { 1.0 } else { 0.0 }) };
            let vector = |from: usize, x: &[f64]| -> Vec<Dual<f64, SVector<f64, 1>>> {
                x.iter().enumerate().map(|(k, x)| seeded(from + k, *x)).collect()
            };
            let value = component.at(Dual::from(0.0), &vector(0, &q), &vector(n, &p), seeded(2 * n, z));
            jacobian[(i, j)] = value.d.x;
            if j == 0 {
                image.push(value.re);
            }
        }
    }
    let point: Vec<f64> = q.iter().chain(&p).copied().chain([z]).collect();
    macro_rules! of {
        ($($n:literal)*) => {
            match n {
                $($n => {
                    let triple = |x: &[f64]| ChartVector::<$n>::from_fn(|i| x.get(i).copied().unwrap_or(f64::NAN));
                    let (from, to) = (triple(&point), triple(&image));
                    conformality_with_jacobian(&Darboux, &Darboux, &from, &to, &jacobian)
                        .map(|found| (found.sigma, found.defect))
                        .map_err(value_error)?
                })*
                _ => return Err(value_error(format!("the map has {n} coordinates; it can have from 1 to 16"))),
            }
        };
    }
    let (sigma, defect) = of!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
    let rows: Vec<f64> = jacobian.transpose().as_slice().to_vec();
    Ok((sigma, defect, vector(py, image), matrix(py, rows, size)?))
}
