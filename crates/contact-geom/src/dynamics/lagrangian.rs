//! Lagrangians L(t, q, v, z) and their derivatives.

use crate::dynamics::blocks::{self, BLOCK};
use crate::forms::points::seed;
use crate::{Dual, KernelDual, Module, Scalar, Structure, Triple, VelocityPoint};
use nalgebra::{SMatrix, SVector};
use num_traits::One;

/// A Lagrangian of Herglotz' variational principle, `L : R x TQ x R -> R`, written once as a generic function.
///
/// The motion makes the end value of the action critical, where `zdot = L(t, q, qdot, z)`. In the field's signs a
/// dissipative term is `gamma z` with `gamma < 0`. Every derivative is `value` on duals; a user who has a closed form
/// overrides [`closed_gradient`](Self::closed_gradient), which vector fields, forms and steps then differentiate once less,
/// or [`closed_hessian`](Self::closed_hessian), which W, forms and second jets then use. [`check_closed_derivatives`](crate::check_closed_derivatives)
/// compares such a form with the derived one.
///
/// Mark `value`, and the functions that it calls, `#[inline(always)]`: integrators evaluate them at several stages in one
/// vector register, and what the compiler does not merge into their kernels is ten times slower.
///
/// ```
/// use contact_geom::{nalgebra::SVector, Lagrangian, Scalar, VelocityPoint};
/// struct Damped;
/// impl Lagrangian<1> for Damped {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
///         v[0] * v[0] * 0.5 - q[0] * q[0] * 0.5 - z * 0.1
///     }
/// }
/// let x = VelocityPoint::new([1.0], [2.0], 0.0);
/// assert_eq!(Damped.gradient(0.0, &x).y[0], 2.0); // L_v
/// ```
pub trait Lagrangian<const N: usize> {
    /// Whether this Lagrangian states a clock, that is, whether [`clock_rate`](Self::clock_rate) is overridden: it is asked for
    /// and compiled only then.
    const HAS_CLOCK: bool = false;

    /// The value `L(t, q, v, z)`.
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T;

    /// The partial derivatives `(L_q, L_v, L_z)` in closed form, if the implementor has one that is worth it.
    fn closed_gradient<T: Scalar>(&self, _t: T, _x: &VelocityPoint<N, T>) -> Option<Triple<N, T>> {
        None
    }

    /// The second partial derivatives in closed form, if the implementor has one that is worth it.
    fn closed_hessian<T: Scalar>(&self, _t: T, _x: &VelocityPoint<N, T>) -> Option<Hessian<N, T>> {
        None
    }

    /// What is known of this Lagrangian's form; see [`Structure`]. The default claims nothing.
    fn structure(&self) -> Structure {
        Structure::default()
    }

    /// The rate `g(q) = dt/dtau` of the [`Clock`](crate::Clock) by whose time tau the steps of this motion are best equal, for
    /// autonomous Lagrangians: it should fall as the motion gets faster, and be positive. With [`HAS_CLOCK`](Self::HAS_CLOCK); the
    /// default is the time itself.
    #[inline(always)]
    fn clock_rate<T: Scalar>(&self, _q: &SVector<T, N>) -> T {
        T::one()
    }

    /// The value and the differential along given directions: the coordinates of `x` carry the directions as duals.
    /// Not to be overridden: it uses [`closed_gradient`](Self::closed_gradient) where there is one.
    #[inline(always)]
    fn along<T: Scalar, D: Module<T>>(&self, t: T, x: &VelocityPoint<N, Dual<T, D>>) -> Dual<T, D> {
        let base = VelocityPoint { q: x.q.map(|a| a.re), v: x.v.map(|a| a.re), z: x.z.re };
        match self.closed_gradient(t, &base) {
            None => self.value(Dual::constant(t), &x.q, &x.v, x.z),
            Some(g) => {
                let mut d = x.z.d.each(|a| a * g.z);
                for i in 0..N {
                    d = d.join(x.q[i].d, |sum, a| sum + a * g.x[i]).join(x.v[i].d, |sum, a| sum + a * g.y[i]);
                }
                Dual { re: self.value(t, &base.q, &base.v, base.z), d }
            }
        }
    }

    /// The value with the partial derivatives `(L_q, L_v, L_z)`, for kernels. Not to be overridden.
    #[inline(always)]
    fn with_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> (T, Triple<N, T>) {
        if let Some(gradient) = self.closed_gradient(t, x) {
            return (self.value(t, &x.q, &x.v, x.z), gradient);
        }
        if const { N > BLOCK } {
            return blocks::with_gradient(self, t, x);
        }
        let mut q = still::<T, Triple<N, T>, N>(&x.q);
        let mut v = still::<T, Triple<N, T>, N>(&x.v);
        let mut z = KernelDual::<T, Triple<N, T>>::constant(x.z);
        for i in 0..N {
            q[i].d.x[i] = T::one();
            v[i].d.y[i] = T::one();
        }
        z.d.z = T::one();
        let l = self.value(KernelDual::constant(t), &q, &v, z);
        (l.re, l.d)
    }

    /// The value with the partial derivatives `L_q` alone, for kernels: what a force needs. Not to be overridden.
    #[inline(always)]
    fn with_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> (T, SVector<T, N>) {
        if let Some(gradient) = self.closed_gradient(t, x) {
            return (self.value(t, &x.q, &x.v, x.z), gradient.x);
        }
        if const { N > BLOCK } {
            return blocks::with_force(self, t, x);
        }
        let mut q = still::<T, SVector<T, N>, N>(&x.q);
        for i in 0..N {
            q[i].d[i] = T::one();
        }
        let l = self.value(KernelDual::constant(t), &q, &still(&x.v), KernelDual::constant(x.z));
        (l.re, l.d)
    }

    /// The matrix `W = L_vv` alone, for kernels. Not to be overridden.
    #[inline(always)]
    fn mass_matrix<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SMatrix<T, N, N> {
        if let Some(hessian) = self.closed_hessian(t, x) {
            return hessian.vv;
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
            return SMatrix::from_fn(|i, j| gradient.y[i].d[j]);
        }
        let mut v = still::<_, SVector<KernelDual<T, SVector<T, N>>, N>, N>(&y.v);
        for i in 0..N {
            v[i].d[i] = KernelDual::one();
        }
        let l = self.value(KernelDual::constant(time), &still(&y.q), &v, KernelDual::constant(y.z));
        SMatrix::from_fn(|i, j| l.d[i].d[j])
    }

    /// The partial derivatives `(L_q, L_v, L_z)`. Not to be overridden.
    #[inline]
    fn gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Triple<N, T> {
        self.closed_gradient(t, x).unwrap_or_else(|| derived_gradient(self, t, x))
    }

    /// The second partial derivatives in `(q, v, z)`. Not to be overridden.
    #[inline]
    fn hessian<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Hessian<N, T> {
        self.closed_hessian(t, x).unwrap_or_else(|| derived_hessian(self, t, x))
    }
}

/// Coordinates that no direction moves.
#[inline(always)]
fn still<T: Scalar, D: Module<T>, const N: usize>(x: &SVector<T, N>) -> SVector<KernelDual<T, D>, N> {
    SVector::from_array_storage(nalgebra::ArrayStorage([std::array::from_fn(|i| KernelDual::constant(x[i]))]))
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

/// The gradient by automatic differentiation, whatever the implementor overrides.
#[inline]
pub fn derived_gradient<T: Scalar, const N: usize>(
    lagrangian: &(impl Lagrangian<N> + ?Sized),
    t: T,
    x: &VelocityPoint<N, T>,
) -> Triple<N, T> {
    if const { N > BLOCK } {
        return blocks::with_gradient(lagrangian, t, x).1;
    }
    let s = seed(&Triple::from(*x));
    lagrangian.value(Dual::constant(t), &s.x, &s.y, s.z).d
}

/// The second derivatives by automatic differentiation of the gradient, itself derived or in closed form.
#[inline]
pub fn derived_hessian<T: Scalar, const N: usize>(
    lagrangian: &(impl Lagrangian<N> + ?Sized),
    t: T,
    x: &VelocityPoint<N, T>,
) -> Hessian<N, T> {
    if const { N > BLOCK } {
        return blocks::hessian(lagrangian, t, x);
    }
    let g = lagrangian.gradient(Dual::constant(t), &seed(&Triple::from(*x)).into());
    Hessian {
        qq: SMatrix::from_fn(|i, j| g.x[i].d.x[j]),
        qv: SMatrix::from_fn(|i, j| g.x[i].d.y[j]),
        vv: SMatrix::from_fn(|i, j| g.y[i].d.y[j]),
        qz: SVector::from_fn(|i, _| g.x[i].d.z),
        vz: SVector::from_fn(|i, _| g.y[i].d.z),
        zz: g.z.d.z,
    }
}

/// A Lagrangian without its closed derivatives: all are found by automatic differentiation, to see what they cost or gain.
#[derive(Clone, Copy, Debug)]
pub struct ValueOnly<L>(pub L);

impl<const N: usize, L: Lagrangian<N>> Lagrangian<N> for ValueOnly<L> {
    const HAS_CLOCK: bool = L::HAS_CLOCK;

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, v, z)
    }
    fn structure(&self) -> Structure {
        self.0.structure()
    }
    #[inline(always)]
    fn clock_rate<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        self.0.clock_rate(q)
    }
}

impl<const N: usize, L: Lagrangian<N>> Lagrangian<N> for &L {
    const HAS_CLOCK: bool = L::HAS_CLOCK;

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        (**self).value(t, q, v, z)
    }
    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<Triple<N, T>> {
        (**self).closed_gradient(t, x)
    }
    #[inline(always)]
    fn closed_hessian<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<Hessian<N, T>> {
        (**self).closed_hessian(t, x)
    }
    fn structure(&self) -> Structure {
        (**self).structure()
    }
    #[inline(always)]
    fn clock_rate<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        (**self).clock_rate(q)
    }
}
