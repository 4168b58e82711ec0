//! The derivative of a map of states.

use crate::system::products::{times, transposed_times};
use crate::{Components, Vector};
use contact_geom::nalgebra::DMatrix;

/// The derivative of a map of states `(q, p, z)`, in blocks: `qp` is that of the new q in the old p.
#[derive(Clone, Debug)]
pub(super) struct TangentMatrix {
    pub qq: DMatrix<f64>,
    pub qp: DMatrix<f64>,
    pub qz: Vector,
    pub pq: DMatrix<f64>,
    pub pp: DMatrix<f64>,
    pub pz: Vector,
    pub zq: Vector,
    pub zp: Vector,
    pub zz: f64,
}

impl TangentMatrix {
    /// That of the identity, for n coordinates.
    pub fn identity(n: usize) -> Self {
        let (one, none, zero) = (|| DMatrix::identity(n, n), || DMatrix::zeros(n, n), || Vector::zeros(n));
        TangentMatrix {
            qq: one(),
            qp: none(),
            qz: zero(),
            pq: none(),
            pp: one(),
            pz: zero(),
            zq: zero(),
            zp: zero(),
            zz: 1.0,
        }
    }

    /// The image of a tangent.
    pub fn push(&self, x: &Components) -> Components {
        Components {
            x: times(&self.qq, &x.x) + times(&self.qp, &x.y) + &self.qz * x.z,
            y: times(&self.pq, &x.x) + times(&self.pp, &x.y) + &self.pz * x.z,
            z: self.zq.dot(&x.x) + self.zp.dot(&x.y) + self.zz * x.z,
        }
    }

    /// The image of a covector by the transpose.
    pub fn pull(&self, w: &Components) -> Components {
        Components {
            x: transposed_times(&self.qq, &w.x) + transposed_times(&self.pq, &w.y) + &self.zq * w.z,
            y: transposed_times(&self.qp, &w.x) + transposed_times(&self.pp, &w.y) + &self.zp * w.z,
            z: self.qz.dot(&w.x) + self.pz.dot(&w.y) + self.zz * w.z,
        }
    }

    /// Sets the j-th column: the image of the j-th of the coordinates q, then p, then z.
    pub fn set_column(&mut self, j: usize, image: Components) {
        let n = self.qz.len();
        let set = |matrix: &mut DMatrix<f64>, j: usize, x: &Vector| {
            matrix.column_mut(j).iter_mut().zip(x).for_each(|(entry, x)| *entry = *x);
        };
        if j < n {
            set(&mut self.qq, j, &image.x);
            set(&mut self.pq, j, &image.y);
            self.zq[j] = image.z;
        } else if j < 2 * n {
            set(&mut self.qp, j - n, &image.x);
            set(&mut self.pp, j - n, &image.y);
            self.zp[j - n] = image.z;
        } else {
            (self.qz, self.pz, self.zz) = (image.x, image.y, image.z);
        }
    }
}
