//! The derivatives of Lagrangians.

use crate::dynamics::blocks::{self, BLOCK};
use crate::{
    ChartVector, Dual, Lagrangian, Scalar, VelocityPoint,
    numbers::TangentVector,
    support::{KernelDual, seed},
    vector,
};
use nalgebra::{SMatrix, SVector};
use num_traits::One;

/// The derivatives of a Lagrangian: in closed form where it provides them, otherwise by automatic differentiation. The
/// trait is implemented for every Lagrangian, so that its methods cannot be overridden.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::{Derivatives, VelocityPoint};
/// let x = VelocityPoint::new([1.0], [2.0], 0.0);
/// assert_eq!(Pendulum { gamma: -0.1 }.gradient(0.0, &x).y[0], 2.0); // L_v
/// ```
pub trait Derivatives<const N: usize>: Lagrangian<N> {
    /// The value and the differential along given directions, which the coordinates of `x` carry as dual parts. It uses
    /// [`closed_gradient`](Lagrangian::closed_gradient) where there is one.
    fn along<T: Scalar, D: TangentVector<T>>(&self, t: T, x: &VelocityPoint<N, Dual<T, D>>) -> Dual<T, D>;

    /// The value with the partial derivatives `(L_q, L_v, L_z)`, for kernels.
    fn with_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> (T, ChartVector<N, T>);

    /// The value with `(L_q + f, L_v, L_z)`, where f is the [applied force](Lagrangian::applied_force): all that the
    /// equations of motion `(L_v)' = L_q + f + L_z L_v` contain of first derivatives. For kernels.
    fn with_gradient_and_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> (T, ChartVector<N, T>);

    /// The value with `L_q + f`, where f is the [applied force](Lagrangian::applied_force), for kernels.
    fn with_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> (T, SVector<T, N>);

    /// `L_q + f` without the value, for kernels.
    fn force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N>;

    /// `L_z` alone, for kernels.
    fn rate<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> T;

    /// The matrix `W = L_vv` alone, for kernels.
    fn mass_matrix<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SMatrix<T, N, N>;

    /// The partial derivatives `(L_q, L_v, L_z)`.
    fn gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> ChartVector<N, T>;

    /// The second partial derivatives in `(q, v, z)`.
    fn hessian<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Hessian<N, T>;
}

impl<L: Lagrangian<N> + ?Sized, const N: usize> Derivatives<N> for L {
    #[inline(always)]
    fn along<T: Scalar, D: TangentVector<T>>(&self, t: T, x: &VelocityPoint<N, Dual<T, D>>) -> Dual<T, D> {
        let base = VelocityPoint { q: x.q.map(|a| a.re), v: x.v.map(|a| a.re), z: x.z.re };
        let g = match self.closed_gradient(t, &base) {
            Some(g) => g,
            None if const { Self::HINTS.proved } => missing(),
            None => return self.value(Dual::constant(t), &x.q, &x.v, x.z),
        };
        let mut d = x.z.d.each(|a| a * g.z);
        for i in 0..N {
            d = d.join(x.q[i].d, |sum, a| sum + a * g.x[i]).join(x.v[i].d, |sum, a| sum + a * g.y[i]);
        }
        Dual { re: self.value(t, &base.q, &base.v, base.z), d }
    }

    #[inline(always)]
    fn with_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> (T, ChartVector<N, T>) {
        if let Some(both) = self.closed_with_gradient(t, x) {
            return both;
        }
        if const { Self::HINTS.proved } {
            return (T::from(f64::NAN), missing());
        }
        if const { N > BLOCK } {
            return blocks::with_gradient(self, t, x);
        }
        let mut q = still::<T, ChartVector<N, T>, N>(&x.q);
        let mut v = still::<T, ChartVector<N, T>, N>(&x.v);
        let mut z = KernelDual::<T, ChartVector<N, T>>::constant(x.z);
        for i in 0..N {
            q[i].d.x[i] = T::one();
            v[i].d.y[i] = T::one();
        }
        z.d.z = T::one();
        let l = self.value(KernelDual::constant(t), &q, &v, z);
        (l.re, l.d)
    }

    #[inline(always)]
    fn with_gradient_and_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> (T, ChartVector<N, T>) {
        let (l, mut gradient) = self.with_gradient(t, x);
        add_applied_force(self, t, x, &mut gradient.x);
        (l, gradient)
    }

    #[inline(always)]
    fn with_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> (T, SVector<T, N>) {
        let (value, mut force) = with_lagrangian_force(self, t, x);
        add_applied_force(self, t, x, &mut force);
        (value, force)
    }

    #[inline(always)]
    fn force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let mut force = match self.closed_force(t, x) {
            Some(force) => force,
            None => with_lagrangian_force(self, t, x).1,
        };
        add_applied_force(self, t, x, &mut force);
        force
    }

    #[inline(always)]
    fn rate<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> T {
        if let Some(rate) = self.closed_rate(t, x) {
            return rate;
        }
        if const { Self::HINTS.proved } {
            return T::from(f64::NAN);
        }
        let mut z = KernelDual::<T, SVector<T, 1>>::constant(x.z);
        z.d[0] = T::one();
        self.value(KernelDual::constant(t), &still(&x.q), &still(&x.v), z).d[0]
    }

    #[inline(always)]
    fn mass_matrix<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SMatrix<T, N, N> {
        if let Some(w) = self.closed_mass_matrix(t, x) {
            return w;
        }
        if const { Self::HINTS.proved } {
            return SMatrix::from_element(T::from(f64::NAN));
        }
        if const { N > BLOCK } {
            return blocks::mass_matrix(self, t, x);
        }
        let mut y = VelocityPoint {
            q: still::<T, SVector<T, N>, N>(&x.q),
            v: still::<T, SVector<T, N>, N>(&x.v),
            z: KernelDual::<T, SVector<T, N>>::constant(x.z),
        };
        for i in 0..N {
            y.v[i].d[i] = T::one();
        }
        let time = KernelDual::constant(t);
        if let Some(gradient) = self.closed_gradient(time, &y) {
            return matrix(&gradient.y);
        }
        let mut v = still::<_, SVector<KernelDual<T, SVector<T, N>>, N>, N>(&y.v);
        for i in 0..N {
            v[i].d[i] = KernelDual::one();
        }
        let l = self.value(KernelDual::constant(time), &still(&y.q), &v, KernelDual::constant(y.z));
        matrix(&l.d)
    }

    #[inline]
    fn gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> ChartVector<N, T> {
        match self.closed_gradient(t, x) {
            Some(gradient) => gradient,
            None if const { Self::HINTS.proved } => missing(),
            None => derived_gradient(self, t, x),
        }
    }

    #[inline]
    fn hessian<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Hessian<N, T> {
        match self.closed_hessian(t, x) {
            Some(hessian) => hessian,
            None if const { Self::HINTS.proved } => {
                let ChartVector { x, y, z } = missing();
                let matrix = SMatrix::from_element(z);
                Hessian { qq: matrix, qv: matrix, vv: matrix, qz: x, vz: y, zz: z }
            }
            None => derived_hessian(self, t, x),
        }
    }
}

/// The gradient of a Lagrangian that declares closed derivatives but does not provide them: all entries are NaN.
#[cold]
fn missing<T: Scalar, const N: usize>() -> ChartVector<N, T> {
    let none = || SVector::from_fn(|_, _| T::from(f64::NAN));
    ChartVector { x: none(), y: none(), z: T::from(f64::NAN) }
}

/// The coordinates as constants, whose differentials vanish.
#[inline(always)]
fn still<T: Scalar, D: TangentVector<T>, const N: usize>(x: &SVector<T, N>) -> SVector<KernelDual<T, D>, N> {
    vector!(|i| KernelDual::constant(x[i]))
}

/// The matrix of the derivatives of a vector, by rows.
#[inline(always)]
fn matrix<T: Scalar, const N: usize>(x: &SVector<KernelDual<T, SVector<T, N>>, N>) -> SMatrix<T, N, N> {
    let mut columns = [[T::zero(); N]; N];
    for (j, column) in columns.iter_mut().enumerate() {
        for (i, entry) in column.iter_mut().enumerate() {
            *entry = x[i].d[j];
        }
    }
    SMatrix::from_array_storage(nalgebra::ArrayStorage(columns))
}

/// The second partial derivatives of a Lagrangian in `(q, v, z)`; `W = vv` in the paper's notation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hessian<const N: usize, T = f64> {
    /// `d2L / dq_i dq_j`.
    pub qq: SMatrix<T, N, N>,
    /// `d2L / dq_i dv_j`.
    pub qv: SMatrix<T, N, N>,
    /// `W_ij = d2L / dv_i dv_j`.
    pub vv: SMatrix<T, N, N>,
    /// `d2L / dq_i dz`.
    pub qz: SVector<T, N>,
    /// `d2L / dv_i dz`.
    pub vz: SVector<T, N>,
    /// `d2L / dz2`.
    pub zz: T,
}

/// The gradient by automatic differentiation, even where the Lagrangian has a closed one.
#[inline]
pub fn derived_gradient<T: Scalar, const N: usize>(
    lagrangian: &(impl Lagrangian<N> + ?Sized),
    t: T,
    x: &VelocityPoint<N, T>,
) -> ChartVector<N, T> {
    if const { N > BLOCK } {
        return blocks::with_gradient(lagrangian, t, x).1;
    }
    let s = seed(&ChartVector::from(*x));
    lagrangian.value(Dual::constant(t), &s.x, &s.y, s.z).d
}

/// The second derivatives by automatic differentiation of the gradient, which is in closed form where there is one.
#[inline]
pub fn derived_hessian<T: Scalar, const N: usize>(
    lagrangian: &(impl Lagrangian<N> + ?Sized),
    t: T,
    x: &VelocityPoint<N, T>,
) -> Hessian<N, T> {
    if const { N > BLOCK } {
        return blocks::hessian(lagrangian, t, x);
    }
    let g = lagrangian.gradient(Dual::constant(t), &seed(&ChartVector::from(*x)).into());
    Hessian {
        qq: SMatrix::from_fn(|i, j| g.x[i].d.x[j]),
        qv: SMatrix::from_fn(|i, j| g.x[i].d.y[j]),
        vv: SMatrix::from_fn(|i, j| g.y[i].d.y[j]),
        qz: SVector::from_fn(|i, _| g.x[i].d.z),
        vz: SVector::from_fn(|i, _| g.y[i].d.z),
        zz: g.z.d.z,
    }
}

/// The value with `L_q`.
#[inline(always)]
fn with_lagrangian_force<L: Lagrangian<N> + ?Sized, T: Scalar, const N: usize>(
    lagrangian: &L,
    t: T,
    x: &VelocityPoint<N, T>,
) -> (T, SVector<T, N>) {
    if let Some(both) = lagrangian.closed_with_force(t, x) {
        return both;
    }
    if const { L::HINTS.proved } {
        return (T::from(f64::NAN), missing::<T, N>().x);
    }
    if const { N > BLOCK } {
        return blocks::with_force(lagrangian, t, x);
    }
    let mut q = still::<T, SVector<T, N>, N>(&x.q);
    for i in 0..N {
        q[i].d[i] = T::one();
    }
    let l = lagrangian.value(KernelDual::constant(t), &q, &still(&x.v), KernelDual::constant(x.z));
    (l.re, l.d)
}

/// Adds the applied force, if there is one.
#[inline(always)]
pub(crate) fn add_applied_force<L: Lagrangian<N> + ?Sized, T: Scalar, const N: usize>(
    lagrangian: &L,
    t: T,
    x: &VelocityPoint<N, T>,
    to: &mut SVector<T, N>,
) {
    if const { L::HINTS.forced } {
        *to += lagrangian.applied_force(t, x);
    }
}
