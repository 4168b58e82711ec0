//! Second derivatives of a list of elements, evaluated eight at a time and added to a sparse matrix.

use crate::Potential;
use crate::kernels::{Kind, unknowns, unknowns_part};
use crate::lanes::{LANES, Lanes};
use crate::term::column;
use contact_geom::Dual;
use contact_geom::nalgebra::SVector;

impl<V: Potential<K, P>, const K: usize, const P: usize> Kind<V, K, P> {
    /// See [`PotentialList::hessian`](crate::kernels::PotentialList::hessian).
    pub(crate) fn add_second(&self, t: f64, q: &[f64], factor: f64, places: &[u32], entries: &mut [f64]) {
        let t = Lanes::splat(t);
        // For each element, the indices of the lower triangle of its second derivatives.
        let mut places = places.chunks_exact(K * (K + 1) / 2);
        for run in &self.elements.runs {
            for e in (0..run.len).step_by(LANES) {
                let count = LANES.min(run.len - e);
                let (x, c) = if count == LANES {
                    (unknowns(q, run, e), self.elements.parameters(run, e))
                } else {
                    (unknowns_part(q, run, e, count), self.elements.parameters_part(run, e, count))
                };
                add(self.second(t, &x, &c), count, factor, &mut places, entries);
            }
        }
        let loose = self.elements.loose.len();
        for e in (0..loose).step_by(LANES) {
            let count = LANES.min(loose - e);
            let (x, c) = self.elements.gathered(q, count, |lane| e + lane);
            add(self.second(t, &x, &c), count, factor, &mut places, entries);
        }
    }

    /// See [`PotentialList::hessian_times`](crate::kernels::PotentialList::hessian_times).
    pub(crate) fn add_product(&self, t: f64, q: &[f64], x: &[f64], product: &mut [f64]) {
        let t = Lanes::splat(t);
        for run in &self.elements.runs {
            for e in (0..run.len).step_by(LANES) {
                let count = LANES.min(run.len - e);
                let (c, at) = (self.elements.parameters_part(run, e, count), |y| unknowns_part(y, run, e, count));
                let along = self.along(t, &at(q), &at(x), &c);
                for (start, slot) in run.start.iter().zip(along) {
                    for (sum, part) in product[start + e..].iter_mut().zip(&slot.to_array()[..count]) {
                        *sum += part;
                    }
                }
            }
        }
        let loose = self.elements.loose.len();
        for e in (0..loose).step_by(LANES) {
            let count = LANES.min(loose - e);
            let (at, c) = self.elements.gathered(q, count, |lane| e + lane);
            let (direction, _) = self.elements.gathered(x, count, |lane| e + lane);
            let along = self.along(t, &at, &direction, &c).map(Lanes::to_array);
            for (lane, places) in self.elements.loose[e..e + count].iter().enumerate() {
                for (place, slot) in places.iter().zip(&along) {
                    product[*place as usize] += slot[lane];
                }
            }
        }
    }

    /// The directional derivative of the gradient of eight elements.
    #[inline(always)]
    fn along(&self, t: Lanes, x: &SVector<Lanes, K>, direction: &SVector<Lanes, K>, c: &[Lanes; P]) -> [Lanes; K] {
        let lifted = std::array::from_fn(|i| Dual { re: x[i], d: SVector::<Lanes, 1>::from([direction[i]]) });
        let gradient = self.term.gradient(Dual::constant(t), &column(lifted), &c.map(Dual::constant));
        std::array::from_fn(|i| gradient[i].d[0])
    }

    /// The second derivatives of eight elements, by dual numbers over the gradient.
    #[inline(always)]
    fn second(&self, t: Lanes, x: &SVector<Lanes, K>, c: &[Lanes; P]) -> [SVector<Lanes, K>; K] {
        let lifted = std::array::from_fn(|i| {
            let mut x = Dual::<Lanes, SVector<Lanes, K>>::constant(x[i]);
            x.d[i] = Lanes::splat(1.0);
            x
        });
        let gradient = self.term.gradient(Dual::constant(t), &column(lifted), &c.map(Dual::constant));
        std::array::from_fn(|i| gradient[i].d)
    }
}

/// Adds the second derivatives of the first `count` elements, times `factor`, to the entries of the matrix.
#[inline(always)]
fn add<'p, const K: usize>(
    second: [SVector<Lanes, K>; K],
    count: usize,
    factor: f64,
    places: &mut impl Iterator<Item = &'p [u32]>,
    entries: &mut [f64],
) {
    let second = second.map(|row| row.data.0[0].map(|x| (x * factor).to_array()));
    for (lane, places) in (0..count).zip(places) {
        let triangle = (0..K).flat_map(|i| (0..=i).map(move |j| (i, j)));
        for ((i, j), place) in triangle.zip(places) {
            // Rows and columns of fixed components have no entry in the matrix.
            if let Some(entry) = entries.get_mut(*place as usize) {
                *entry += second[i][j][lane];
            }
        }
    }
}
