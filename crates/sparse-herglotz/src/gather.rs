//! The unknowns and parameters of up to eight elements, gathered into the lanes of vector registers.

use crate::elements::{Elements, Run};
use crate::lanes::{LANES, Lanes};
use crate::potential::vector;
use contact_geom::nalgebra::SVector;

/// The unknowns of eight elements of a run.
#[inline(always)]
pub(crate) fn unknowns<const K: usize>(q: &[f64], run: &Run<K>, e: usize) -> SVector<Lanes, K> {
    vector(std::array::from_fn(|i| Lanes::load(q, run.start[i] + e)))
}

/// The unknowns of fewer than eight elements of a run.
#[inline(always)]
pub(crate) fn unknowns_part<const K: usize>(q: &[f64], run: &Run<K>, e: usize, count: usize) -> SVector<Lanes, K> {
    vector(std::array::from_fn(|i| Lanes::load_part(q, run.start[i] + e, count)))
}

/// The parameters of eight elements of a run.
#[inline(always)]
pub(crate) fn parameters<const K: usize, const P: usize>(
    elements: &Elements<K, P>,
    run: &Run<K>,
    e: usize,
) -> [Lanes; P] {
    std::array::from_fn(|p| Lanes::load(&elements.run_parameters[p], run.first + e))
}

/// The parameters of fewer than eight elements of a run.
#[inline(always)]
pub(crate) fn parameters_part<const K: usize, const P: usize>(
    elements: &Elements<K, P>,
    run: &Run<K>,
    e: usize,
    count: usize,
) -> [Lanes; P] {
    std::array::from_fn(|p| Lanes::load_part(&elements.run_parameters[p], run.first + e, count))
}

/// The unknowns and parameters of elements outside runs; unused lanes repeat the first element.
#[inline(always)]
pub(crate) fn outside_runs<const K: usize, const P: usize>(
    elements: &Elements<K, P>,
    q: &[f64],
    count: usize,
    element: impl Fn(usize) -> usize,
) -> (SVector<Lanes, K>, [Lanes; P]) {
    // Loops, since `map` on arrays would compile to function calls.
    let (mut x, mut c) = ([[f64::NAN; LANES]; K], [[f64::NAN; LANES]; P]);
    for lane in 0..LANES {
        let e = element(if lane < count { lane } else { 0 });
        let Some(indices) = elements.outside_runs.get(e) else { continue };
        for k in 0..K {
            if let Some(value) = q.get(indices[k] as usize) {
                x[k][lane] = *value;
            }
        }
        for (c, parameter) in c.iter_mut().zip(&elements.parameters_outside_runs) {
            if let Some(value) = parameter.get(e) {
                c[lane] = *value;
            }
        }
    }
    let (x, c) = (std::array::from_fn(|k| Lanes::new(x[k])), std::array::from_fn(|p| Lanes::new(c[p])));
    (vector(x), c)
}
