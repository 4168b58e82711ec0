//! Lists of general local terms, and their derivatives for eight elements at a time.

use crate::LocalLagrangian;
use crate::derivatives::{EvaluationPoint, FirstDerivatives, SecondDerivatives};
use crate::elements::Elements;
use crate::gather::parameters_part;
use crate::implicit::FullPattern;
use crate::lanes::{LANES, Lanes};
use crate::potential::vector;
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Dual, support::seed};

/// A list of general terms with any number of unknowns per element.
pub(crate) trait LocalTermList: Send + Sync {
    /// Calls a function with the padded indices of the unknowns of each element.
    fn visit(&self, f: &mut dyn FnMut(&[usize]));

    /// Adds the terms and their first derivatives.
    fn add_first(&self, at: EvaluationPoint, sums: &mut FirstDerivatives);

    /// The indices of the second derivatives of each element among the entries of a sparse matrix, row by row.
    fn entry_indices(&self, pattern: &FullPattern) -> Vec<u32>;

    /// Adds the second derivatives to the entries with these indices.
    fn add_second(&self, at: EvaluationPoint, entry_indices: &[u32], sums: &mut SecondDerivatives);
}

/// A general term and its elements.
pub(crate) struct LocalTermElements<V, const K: usize, const P: usize> {
    term: V,
    elements: Elements<K, P>,
}

impl<V, const K: usize, const P: usize> LocalTermElements<V, K, P> {
    /// A term and its elements.
    pub fn new(term: V, elements: Elements<K, P>) -> Self {
        LocalTermElements { term, elements }
    }
}

/// Up to eight elements, one per lane.
struct SimdBatch<const K: usize, const P: usize> {
    count: usize,
    indices: [[usize; K]; LANES],
    c: [Lanes; P],
}

impl<const K: usize, const P: usize> SimdBatch<K, P> {
    /// The components of `x` that belong to the unknowns of the elements.
    #[inline(always)]
    fn gather(&self, x: &[f64]) -> SVector<Lanes, K> {
        let component = |index: usize| x.get(index).copied().unwrap_or(f64::NAN);
        vector(std::array::from_fn(|k| Lanes::new(self.indices.map(|indices| component(indices[k])))))
    }

    #[inline(always)]
    fn point(&self, at: EvaluationPoint) -> ChartVector<K, Lanes> {
        ChartVector { x: self.gather(at.q), y: self.gather(at.v), z: Lanes::splat(at.z) }
    }

    /// Adds the values to a vector over the unknowns, which has no entries for fixed components.
    #[inline(always)]
    fn scatter(&self, values: &SVector<Lanes, K>, sums: &mut [f64]) {
        for k in 0..K {
            for (indices, value) in self.indices.iter().zip(values[k].to_array()).take(self.count) {
                if let Some(sum) = indices[k].checked_sub(1).and_then(|i| sums.get_mut(i)) {
                    *sum += value;
                }
            }
        }
    }

    fn sum(&self, values: Lanes) -> f64 {
        values.to_array().iter().take(self.count).sum()
    }
}

impl<V: LocalLagrangian<K, P>, const K: usize, const P: usize> LocalTermElements<V, K, P> {
    /// Calls a function with the elements, up to eight at a time, in the order of [`Elements::visit`].
    #[inline(always)]
    fn for_each_batch(&self, mut f: impl FnMut(SimdBatch<K, P>)) {
        for run in &self.elements.runs {
            for e in (0..run.len).step_by(LANES) {
                let count = LANES.min(run.len - e);
                // Unused lanes repeat the first element.
                let indices =
                    std::array::from_fn(|lane| run.start.map(|s| s + e + if lane < count { lane } else { 0 }));
                f(SimdBatch { count, indices, c: parameters_part(&self.elements, run, e, count) });
            }
        }
        let outside = &self.elements.outside_runs;
        for e in (0..outside.len()).step_by(LANES) {
            let count = LANES.min(outside.len() - e);
            let element = |lane: usize| e + if lane < count { lane } else { 0 };
            let indices = std::array::from_fn(|lane| outside[element(lane)].map(|p| p as usize));
            let c = std::array::from_fn(|p| {
                let all = &self.elements.parameters_outside_runs[p];
                Lanes::new(std::array::from_fn(|lane| all.get(element(lane)).copied().unwrap_or(f64::NAN)))
            });
            f(SimdBatch { count, indices, c });
        }
    }
}

impl<V: LocalLagrangian<K, P>, const K: usize, const P: usize> LocalTermList for LocalTermElements<V, K, P> {
    fn visit(&self, f: &mut dyn FnMut(&[usize])) {
        self.elements.visit(|indices| f(&indices));
    }

    fn add_first(&self, at: EvaluationPoint, sums: &mut FirstDerivatives) {
        self.for_each_batch(|batch| {
            let x = seed(&batch.point(at));
            let t = Dual::constant(Lanes::splat(at.t));
            let l = self.term.value(t, &x.x, &x.y, x.z, &batch.c.map(Dual::constant));
            sums.l += batch.sum(l.re);
            sums.z += batch.sum(l.d.z);
            batch.scatter(&l.d.x, &mut sums.q);
            batch.scatter(&l.d.y, &mut sums.v);
        });
    }

    fn entry_indices(&self, pattern: &FullPattern) -> Vec<u32> {
        let mut entries = Vec::new();
        self.elements.visit(|indices| {
            for a in indices {
                entries.extend(indices.map(|b| pattern.entry(a, b)));
            }
        });
        entries
    }

    fn add_second(&self, at: EvaluationPoint, entry_indices: &[u32], sums: &mut SecondDerivatives) {
        let mut index_matrices = entry_indices.chunks_exact(K * K);
        self.for_each_batch(|batch| {
            let x = seed(&seed(&batch.point(at)));
            let t = Dual::constant(Dual::constant(Lanes::splat(at.t)));
            let c = batch.c.map(|c| Dual::constant(Dual::constant(c)));
            let g = self.term.value(t, &x.x, &x.y, x.z, &c).d;
            sums.zz += batch.sum(g.z.d.z);
            batch.scatter(&g.z.d.x, &mut sums.qz);
            batch.scatter(&g.z.d.y, &mut sums.vz);
            let matrices = std::array::from_fn::<_, K, _>(|a| {
                std::array::from_fn::<_, K, _>(|b| {
                    [g.x[a].d.x[b], g.x[a].d.y[b], g.y[a].d.x[b], g.y[a].d.y[b]].map(Lanes::to_array)
                })
            });
            for (lane, indices) in (0..batch.count).zip(&mut index_matrices) {
                for (index, [qq, qv, vq, vv]) in indices.iter().zip(matrices.iter().flatten()) {
                    let index = *index as usize;
                    // Rows and columns of fixed components have no entry in the matrix.
                    if index < sums.qq.len() {
                        sums.qq[index] += qq[lane];
                        sums.qv[index] += qv[lane];
                        sums.vq[index] += vq[lane];
                        sums.vv[index] += vv[lane];
                    }
                }
            }
        });
    }
}
