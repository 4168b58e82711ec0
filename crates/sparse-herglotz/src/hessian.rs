//! Second derivatives of a list of potentials, evaluated for eight elements at a time and added to a sparse matrix or
//! multiplied by a vector.

use crate::Potential;
use crate::elements::Elements;
use crate::gather;
use crate::lanes::{LANES, Lanes};
use crate::potential::vector;
use contact_geom::Dual;
use contact_geom::nalgebra::SVector;

/// Adds the second derivatives of all elements, times a factor, to the entries of a matrix. `entry_indices` holds the
/// indices of the lower triangle of each element, one element after the other.
pub(crate) fn add_hessian<V: Potential<K, P>, const K: usize, const P: usize>(
    term: &V,
    elements: &Elements<K, P>,
    (t, q): (f64, &[f64]),
    factor: f64,
    entry_indices: &[u32],
    entries: &mut [f64],
) {
    let t = Lanes::splat(t);
    let mut triangles = entry_indices.chunks_exact(K * (K + 1) / 2);
    for run in &elements.runs {
        for e in (0..run.len).step_by(LANES) {
            let count = LANES.min(run.len - e);
            let (x, c) = if count == LANES {
                (gather::unknowns(q, run, e), gather::parameters(elements, run, e))
            } else {
                (gather::unknowns_part(q, run, e, count), gather::parameters_part(elements, run, e, count))
            };
            scatter(hessian(term, t, &x, &c), count, factor, &mut triangles, entries);
        }
    }
    let outside = elements.outside_runs.len();
    for e in (0..outside).step_by(LANES) {
        let count = LANES.min(outside - e);
        let (x, c) = gather::outside_runs(elements, q, count, |lane| e + lane);
        scatter(hessian(term, t, &x, &c), count, factor, &mut triangles, entries);
    }
}

/// Adds the product of the second derivatives of all elements with a vector x. The vectors q, x and the product are
/// padded with one fixed component at each end.
pub(crate) fn add_hessian_product<V: Potential<K, P>, const K: usize, const P: usize>(
    term: &V,
    elements: &Elements<K, P>,
    (t, q): (f64, &[f64]),
    x: &[f64],
    product: &mut [f64],
) {
    let t = Lanes::splat(t);
    for run in &elements.runs {
        for e in (0..run.len).step_by(LANES) {
            let count = LANES.min(run.len - e);
            let (c, part_of) =
                (gather::parameters_part(elements, run, e, count), |y| gather::unknowns_part(y, run, e, count));
            let derivative = gradient_derivative(term, t, &part_of(q), &part_of(x), &c);
            for (start, slot) in run.start.iter().zip(derivative) {
                for (sum, part) in product[start + e..].iter_mut().zip(&slot.to_array()[..count]) {
                    *sum += part;
                }
            }
        }
    }
    let outside = elements.outside_runs.len();
    for e in (0..outside).step_by(LANES) {
        let count = LANES.min(outside - e);
        let (point, c) = gather::outside_runs(elements, q, count, |lane| e + lane);
        let (direction, _) = gather::outside_runs(elements, x, count, |lane| e + lane);
        let derivative = gradient_derivative(term, t, &point, &direction, &c).map(Lanes::to_array);
        for (lane, indices) in elements.outside_runs[e..e + count].iter().enumerate() {
            for (index, slot) in indices.iter().zip(&derivative) {
                product[*index as usize] += slot[lane];
            }
        }
    }
}

/// The directional derivative of the gradient of eight elements.
#[inline(always)]
fn gradient_derivative<V: Potential<K, P>, const K: usize, const P: usize>(
    term: &V,
    t: Lanes,
    x: &SVector<Lanes, K>,
    direction: &SVector<Lanes, K>,
    c: &[Lanes; P],
) -> [Lanes; K] {
    let lifted = std::array::from_fn(|i| Dual { re: x[i], d: SVector::<Lanes, 1>::from([direction[i]]) });
    let gradient = term.gradient(Dual::constant(t), &vector(lifted), &c.map(Dual::constant));
    std::array::from_fn(|i| gradient[i].d[0])
}

/// The second derivatives of eight elements, by dual numbers over the gradient.
#[inline(always)]
fn hessian<V: Potential<K, P>, const K: usize, const P: usize>(
    term: &V,
    t: Lanes,
    x: &SVector<Lanes, K>,
    c: &[Lanes; P],
) -> [SVector<Lanes, K>; K] {
    let lifted = std::array::from_fn(|i| {
        let mut x = Dual::<Lanes, SVector<Lanes, K>>::constant(x[i]);
        x.d[i] = Lanes::splat(1.0);
        x
    });
    let gradient = term.gradient(Dual::constant(t), &vector(lifted), &c.map(Dual::constant));
    std::array::from_fn(|i| gradient[i].d)
}

/// Adds the second derivatives of the first `count` elements, times `factor`, to the entries of the matrix.
#[inline(always)]
fn scatter<'p, const K: usize>(
    hessian: [SVector<Lanes, K>; K],
    count: usize,
    factor: f64,
    triangles: &mut impl Iterator<Item = &'p [u32]>,
    entries: &mut [f64],
) {
    let hessian = hessian.map(|row| row.data.0[0].map(|x| (x * factor).to_array()));
    for (lane, indices) in (0..count).zip(triangles) {
        let triangle = (0..K).flat_map(|i| (0..=i).map(move |j| (i, j)));
        for ((i, j), index) in triangle.zip(indices) {
            // Rows and columns of fixed components have no entry in the matrix.
            if let Some(entry) = entries.get_mut(*index as usize) {
                *entry += hessian[i][j][lane];
            }
        }
    }
}
