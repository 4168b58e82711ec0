//! Derivatives of systems with many coordinates, computed in blocks of directions so that the dual numbers stay small
//! enough for the stack.

use crate::{ChartVector, Derivatives, Hessian, Lagrangian, Scalar, VelocityPoint, support::KernelDual};
use nalgebra::{SMatrix, SVector};

/// The largest dimension for which all directions are carried at once: for nested duals the memory for all coordinates
/// grows as the third power of the dimension.
pub(crate) const BLOCK: usize = 8;

/// A number with its derivatives along a block of coordinates.
type Block<T> = KernelDual<T, SVector<T, BLOCK>>;

/// The first indices of the blocks of `n` directions.
#[inline(always)]
fn starts(n: usize) -> impl Iterator<Item = usize> {
    (0..n.div_ceil(BLOCK)).map(|k| k * BLOCK)
}

/// The coordinates as dual numbers whose directions are the block of coordinates from `start` on, in the order q, v, z.
#[inline(always)]
fn lifted<T: Scalar, const N: usize>(x: &VelocityPoint<N, T>, start: usize) -> VelocityPoint<N, Block<T>> {
    let one = |i: usize, re: T| {
        let mut number = Block::constant(re);
        if (start..start + BLOCK).contains(&i) {
            number.d[i - start] = T::one();
        }
        number
    };
    VelocityPoint {
        q: SVector::from_fn(|i, _| one(i, x.q[i])),
        v: SVector::from_fn(|i, _| one(N + i, x.v[i])),
        z: one(2 * N, x.z),
    }
}

/// The value of L with its derivatives along a block of coordinates.
#[inline(always)]
fn value<T: Scalar, const N: usize>(
    lagrangian: &(impl Lagrangian<N> + ?Sized),
    t: T,
    x: &VelocityPoint<N, T>,
    start: usize,
) -> Block<T> {
    let y = lifted(x, start);
    lagrangian.value(Block::constant(t), &y.q, &y.v, y.z)
}

/// The value and the gradient by automatic differentiation.
#[inline(always)]
pub(crate) fn with_gradient<T: Scalar, const N: usize>(
    lagrangian: &(impl Lagrangian<N> + ?Sized),
    t: T,
    x: &VelocityPoint<N, T>,
) -> (T, ChartVector<N, T>) {
    let zero = T::zero();
    let mut gradient = ChartVector { x: SVector::from_element(zero), y: SVector::from_element(zero), z: zero };
    let mut re = zero;
    for start in starts(2 * N + 1) {
        let l = value(lagrangian, t, x, start);
        re = l.re;
        for (k, d) in l.d.iter().enumerate() {
            match start + k {
                i if i < N => gradient.x[i] = *d,
                i if i < 2 * N => gradient.y[i - N] = *d,
                i if i == 2 * N => gradient.z = *d,
                _ => {}
            }
        }
    }
    (re, gradient)
}

/// The value and `L_q` by automatic differentiation.
#[inline(always)]
pub(crate) fn with_force<T: Scalar, const N: usize>(
    lagrangian: &(impl Lagrangian<N> + ?Sized),
    t: T,
    x: &VelocityPoint<N, T>,
) -> (T, SVector<T, N>) {
    let (mut re, mut force) = (T::zero(), SVector::from_element(T::zero()));
    for start in starts(N) {
        let l = value(lagrangian, t, x, start);
        re = l.re;
        for i in start..N.min(start + BLOCK) {
            force[i] = l.d[i - start];
        }
    }
    (re, force)
}

/// The mass matrix W by automatic differentiation, of the closed gradient where there is one.
#[inline(always)]
pub(crate) fn mass_matrix<T: Scalar, const N: usize>(
    lagrangian: &(impl Lagrangian<N> + ?Sized),
    t: T,
    x: &VelocityPoint<N, T>,
) -> SMatrix<T, N, N> {
    let mut w = SMatrix::from_element(T::zero());
    for column in starts(N) {
        let (time, y) = (Block::constant(t), lifted(x, N + column));
        let columns = column..N.min(column + BLOCK);
        if let Some(gradient) = lagrangian.closed_gradient(time, &y) {
            for (j, i) in columns.flat_map(|j| (0..N).map(move |i| (j, i))) {
                w[(i, j)] = gradient.y[i].d[j - column];
            }
            continue;
        }
        // Compute the blocks on and below the diagonal; the others follow by symmetry.
        for row in starts(N).filter(|row| *row >= column) {
            let l = value(lagrangian, time, &y, N + row);
            for (j, i) in columns.clone().flat_map(|j| (row..N.min(row + BLOCK)).map(move |i| (j, i))) {
                w[(i, j)] = l.d[i - row].d[j - column];
                w[(j, i)] = w[(i, j)];
            }
        }
    }
    w
}

/// The second derivatives by automatic differentiation of the gradient, which is in closed form where there is one.
pub(crate) fn hessian<T: Scalar, const N: usize>(
    lagrangian: &(impl Lagrangian<N> + ?Sized),
    t: T,
    x: &VelocityPoint<N, T>,
) -> Hessian<N, T> {
    let zero = T::zero();
    let (matrix, vector) = (SMatrix::from_element(zero), SVector::from_element(zero));
    let mut h = Hessian { qq: matrix, qv: matrix, vv: matrix, qz: vector, vz: vector, zz: zero };
    for start in starts(2 * N + 1) {
        let g = lagrangian.gradient(Block::constant(t), &lifted(x, start));
        for k in 0..BLOCK {
            match start + k {
                j if j < N => (0..N).for_each(|i| h.qq[(i, j)] = g.x[i].d[k]),
                j if j < 2 * N => (0..N).for_each(|i| {
                    h.qv[(i, j - N)] = g.x[i].d[k];
                    h.vv[(i, j - N)] = g.y[i].d[k];
                }),
                j if j == 2 * N => {
                    h.qz = g.x.map(|e| e.d[k]);
                    h.vz = g.y.map(|e| e.d[k]);
                    h.zz = g.z.d[k];
                }
                _ => {}
            }
        }
    }
    h
}

#[cfg(test)]
mod tests;
