//! General local terms of a Lagrangian, and their derivatives for eight elements at a time.

use crate::elements::Elements;
use crate::implicit::FullPattern;
use crate::lanes::{LANES, Lanes};
use crate::term::column;
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Dual, Scalar, support::seed};

/// A local term `l(t, q, v, z; c)` of a Lagrangian: any function of `K` unknowns, their velocities and the action z of
/// the whole system, with `P` parameters.
///
/// A [`Potential`](crate::Potential) is the special case `l = -V(t, q; c)`, and less expensive. As there, select values
/// with [`Scalar::if_less`] and similar functions, never with `if`, since eight elements are evaluated at once. For a
/// [`FIXED`](crate::FIXED) unknown q and v are 0.
///
/// ```
/// use assembled_herglotz::LocalLagrangian;
/// use contact_geom::{Scalar, nalgebra::SVector};
/// /// A linear finite element of a string of length c: its consistent masses, and its tension.
/// struct Piece;
/// impl LocalLagrangian<2, 1> for Piece {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T, c: &[T; 1]) -> T {
///         let stretch = q[1] - q[0];
///         (v[0] * v[0] + v[0] * v[1] + v[1] * v[1]) * c[0] / T::from(6.0) - stretch * stretch / c[0] * 0.5
///     }
/// }
/// assert_eq!(Piece.value(0.0, &[0.0, 1.0].into(), &[3.0, 3.0].into(), 0.0, &[2.0]), 8.75);
/// ```
pub trait LocalLagrangian<const K: usize, const P: usize = 0>: Send + Sync + 'static {
    /// The value `l(t, q, v, z; c)`.
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, K>, v: &SVector<T, K>, z: T, c: &[T; P]) -> T;
}

/// The point at which a Lagrangian is evaluated. Positions and velocities are padded with one fixed component at each
/// end, so that the first unknown has the padded index 1.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a> {
    pub t: f64,
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub z: f64,
}

/// The value of a Lagrangian and its first derivatives.
#[derive(Clone, Debug)]
pub(crate) struct First {
    pub l: f64,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub z: f64,
}

impl First {
    pub fn zeros(unknowns: usize) -> Self {
        First { l: 0.0, q: vec![0.0; unknowns], v: vec![0.0; unknowns], z: 0.0 }
    }
}

/// The second derivatives of a Lagrangian; `qv` is with respect to the position of the row and the velocity of the
/// column, `vq` with respect to the velocity of the row and the position of the column.
#[derive(Clone, Debug, Default)]
pub(crate) struct Second {
    pub qq: Vec<f64>,
    pub qv: Vec<f64>,
    pub vq: Vec<f64>,
    pub vv: Vec<f64>,
    pub qz: Vec<f64>,
    pub vz: Vec<f64>,
    pub zz: f64,
}

impl Second {
    pub fn zeros(unknowns: usize, entries: usize) -> Self {
        let (matrix, vector) = (vec![0.0; entries], vec![0.0; unknowns]);
        Second {
            qq: matrix.clone(),
            qv: matrix.clone(),
            vq: matrix.clone(),
            vv: matrix,
            qz: vector.clone(),
            vz: vector,
            zz: 0.0,
        }
    }

    pub fn clear(&mut self) {
        let Second { qq, qv, vq, vv, qz, vz, zz } = self;
        [qq, qv, vq, vv, qz, vz].into_iter().for_each(|x| x.fill(0.0));
        *zz = 0.0;
    }
}

/// A list of general terms with any number of unknowns per element.
pub(crate) trait LocalList: Send + Sync {
    /// Calls a function with the padded indices of the unknowns of each element.
    fn visit(&self, f: &mut dyn FnMut(&[usize]));

    /// Adds the terms and their first derivatives.
    fn first(&self, at: Place, sums: &mut First);

    /// The indices of the second derivatives of each element among the entries of a sparse matrix, row by row.
    fn entries(&self, pattern: &FullPattern) -> Vec<u32>;

    /// Adds the second derivatives to the entries with the indices `places`.
    fn second(&self, at: Place, places: &[u32], sums: &mut Second);
}

/// A general term and its elements.
pub(crate) struct LocalKind<V, const K: usize, const P: usize> {
    pub term: V,
    pub elements: Elements<K, P>,
}

/// Up to eight elements, one per lane.
struct SimdBatch<const K: usize, const P: usize> {
    count: usize,
    places: [[usize; K]; LANES],
    c: [Lanes; P],
}

impl<const K: usize, const P: usize> SimdBatch<K, P> {
    /// The components of `x` that belong to the unknowns of the elements.
    #[inline(always)]
    fn gather(&self, x: &[f64]) -> SVector<Lanes, K> {
        let of = |place: usize| x.get(place).copied().unwrap_or(f64::NAN);
        column(std::array::from_fn(|k| Lanes::new(self.places.map(|places| of(places[k])))))
    }

    #[inline(always)]
    fn point(&self, at: Place) -> ChartVector<K, Lanes> {
        ChartVector { x: self.gather(at.q), y: self.gather(at.v), z: Lanes::splat(at.z) }
    }

    /// Adds the values to a vector over the unknowns, which has no entries for fixed components.
    #[inline(always)]
    fn scatter(&self, values: &SVector<Lanes, K>, sums: &mut [f64]) {
        for k in 0..K {
            for (places, value) in self.places.iter().zip(values[k].to_array()).take(self.count) {
                if let Some(sum) = places[k].checked_sub(1).and_then(|i| sums.get_mut(i)) {
                    *sum += value;
                }
            }
        }
    }

    fn sum(&self, values: Lanes) -> f64 {
        values.to_array().iter().take(self.count).sum()
    }
}

impl<V: LocalLagrangian<K, P>, const K: usize, const P: usize> LocalKind<V, K, P> {
    /// Calls a function with the elements, up to eight at a time, in the order of [`Elements::visit`].
    #[inline(always)]
    fn packs(&self, mut f: impl FnMut(SimdBatch<K, P>)) {
        for run in &self.elements.runs {
            for e in (0..run.len).step_by(LANES) {
                let count = LANES.min(run.len - e);
                // Unused lanes repeat the first element.
                let places = std::array::from_fn(|lane| run.start.map(|s| s + e + if lane < count { lane } else { 0 }));
                f(SimdBatch { count, places, c: self.elements.parameters_part(run, e, count) });
            }
        }
        let loose = &self.elements.loose;
        for e in (0..loose.len()).step_by(LANES) {
            let count = LANES.min(loose.len() - e);
            let of = |lane: usize| e + if lane < count { lane } else { 0 };
            let places = std::array::from_fn(|lane| loose[of(lane)].map(|p| p as usize));
            let c = std::array::from_fn(|p| {
                let all = &self.elements.loose_parameters[p];
                Lanes::new(std::array::from_fn(|lane| all.get(of(lane)).copied().unwrap_or(f64::NAN)))
            });
            f(SimdBatch { count, places, c });
        }
    }
}

impl<V: LocalLagrangian<K, P>, const K: usize, const P: usize> LocalList for LocalKind<V, K, P> {
    fn visit(&self, f: &mut dyn FnMut(&[usize])) {
        self.elements.visit(|places| f(&places));
    }

    fn first(&self, at: Place, sums: &mut First) {
        self.packs(|pack| {
            let x = seed(&pack.point(at));
            let t = Dual::constant(Lanes::splat(at.t));
            let l = self.term.value(t, &x.x, &x.y, x.z, &pack.c.map(Dual::constant));
            sums.l += pack.sum(l.re);
            sums.z += pack.sum(l.d.z);
            pack.scatter(&l.d.x, &mut sums.q);
            pack.scatter(&l.d.y, &mut sums.v);
        });
    }

    fn entries(&self, pattern: &FullPattern) -> Vec<u32> {
        let mut entries = Vec::new();
        self.elements.visit(|places| {
            for a in places {
                entries.extend(places.map(|b| pattern.entry(a, b)));
            }
        });
        entries
    }

    fn second(&self, at: Place, places: &[u32], sums: &mut Second) {
        let mut places = places.chunks_exact(K * K);
        self.packs(|pack| {
            let x = seed(&seed(&pack.point(at)));
            let t = Dual::constant(Dual::constant(Lanes::splat(at.t)));
            let c = pack.c.map(|c| Dual::constant(Dual::constant(c)));
            let g = self.term.value(t, &x.x, &x.y, x.z, &c).d;
            sums.zz += pack.sum(g.z.d.z);
            pack.scatter(&g.z.d.x, &mut sums.qz);
            pack.scatter(&g.z.d.y, &mut sums.vz);
            let matrices = std::array::from_fn::<_, K, _>(|a| {
                std::array::from_fn::<_, K, _>(|b| {
                    [g.x[a].d.x[b], g.x[a].d.y[b], g.y[a].d.x[b], g.y[a].d.y[b]].map(Lanes::to_array)
                })
            });
            for (lane, places) in (0..pack.count).zip(&mut places) {
                for (place, [qq, qv, vq, vv]) in places.iter().zip(matrices.iter().flatten()) {
                    let place = *place as usize;
                    // Rows and columns of fixed components have no entry in the matrix.
                    if place < sums.qq.len() {
                        sums.qq[place] += qq[lane];
                        sums.qv[place] += qv[lane];
                        sums.vq[place] += vq[lane];
                        sums.vv[place] += vv[lane];
                    }
                }
            }
        });
    }
}
