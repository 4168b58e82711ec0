//! The derivative of a map of states.

use contact_geom::ChartVector;
use contact_geom::nalgebra::{SMatrix, SVector};

/// The derivative of a map of states `(q, p, z)`, in blocks: `qp` is that of the new q in the old p.
#[derive(Clone, Copy, Debug)]
pub(super) struct TangentMatrix<const N: usize> {
    pub qq: SMatrix<f64, N, N>,
    pub qp: SMatrix<f64, N, N>,
    pub qz: SVector<f64, N>,
    pub pq: SMatrix<f64, N, N>,
    pub pp: SMatrix<f64, N, N>,
    pub pz: SVector<f64, N>,
    pub zq: SVector<f64, N>,
    pub zp: SVector<f64, N>,
    pub zz: f64,
}

impl<const N: usize> TangentMatrix<N> {
    /// That of the identity.
    pub fn identity() -> Self {
        let (one, none, zero) = (SMatrix::identity(), SMatrix::zeros(), SVector::zeros());
        TangentMatrix { qq: one, qp: none, qz: zero, pq: none, pp: one, pz: zero, zq: zero, zp: zero, zz: 1.0 }
    }

    /// The image of a tangent.
    pub fn push(&self, x: &ChartVector<N>) -> ChartVector<N> {
        ChartVector {
            x: self.qq * x.x + self.qp * x.y + self.qz * x.z,
            y: self.pq * x.x + self.pp * x.y + self.pz * x.z,
            z: self.zq.dot(&x.x) + self.zp.dot(&x.y) + self.zz * x.z,
        }
    }

    /// The image of a covector by the transpose.
    pub fn pull(&self, w: &ChartVector<N>) -> ChartVector<N> {
        ChartVector {
            x: self.qq.tr_mul(&w.x) + self.pq.tr_mul(&w.y) + self.zq * w.z,
            y: self.qp.tr_mul(&w.x) + self.pp.tr_mul(&w.y) + self.zp * w.z,
            z: self.qz.dot(&w.x) + self.pz.dot(&w.y) + self.zz * w.z,
        }
    }

    /// Sets the j-th column: the image of the j-th of the coordinates q, then p, then z.
    pub fn set_column(&mut self, j: usize, image: &ChartVector<N>) {
        if j < N {
            self.qq.set_column(j, &image.x);
            self.pq.set_column(j, &image.y);
            self.zq[j] = image.z;
        } else if j < 2 * N {
            self.qp.set_column(j - N, &image.x);
            self.pp.set_column(j - N, &image.y);
            self.zp[j - N] = image.z;
        } else {
            (self.qz, self.pz, self.zz) = (image.x, image.y, image.z);
        }
    }
}
