//! Regularity, energy, the Legendre transformation and the Herglotz vector field of a Lagrangian.

use crate::dynamics::blocks::BLOCK;
use crate::dynamics::derivatives::add_applied_force;
use crate::support::linear::{SingularMatrix, solve};
use crate::{ChartVector, OneParameterGroup, VelocityPoint};
use crate::{
    Derivatives, Dual, GeometryError, Lagrangian, PhasePoint, Regularity, Scalar, Smooth, SmoothFunction,
    numbers::{AugmentedVector, TangentVector},
};
use nalgebra::{DMatrix, SMatrix, SVector};
use num_traits::One;

/// The regularity of L at a point, by the singular values of `W = L_vv`.
pub fn regularity<const N: usize>(lagrangian: &impl Lagrangian<N>, t: f64, x: &VelocityPoint<N>) -> Regularity {
    let w = lagrangian.hessian(t, x).vv;
    Regularity::of(DMatrix::from_fn(N, N, |i, j| w[(i, j)]))
}

/// The energy `E_L = v . L_v - L`, as a function on TQ x R.
#[derive(Clone, Copy, Debug)]
pub struct Energy<'a, L>(pub &'a L);

impl<const N: usize, L: Lagrangian<N>> SmoothFunction<N> for Energy<'_, L> {
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T {
        x.y.dot(&self.0.gradient(t, &(*x).into()).y) - self.0.value(t, &x.x, &x.y, x.z)
    }
}

/// The Legendre transformation `FL : (q, v, z) -> (q, L_v, z)` from TQ x R to T\*Q x R.
#[inline]
pub fn legendre<T: Scalar, const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: T,
    x: &VelocityPoint<N, T>,
) -> PhasePoint<N, T> {
    PhasePoint { q: x.q, p: lagrangian.gradient(t, x).y, z: x.z }
}

/// The linearisation `T FL` at a point, in the order `q, v, z`: rows `(1, 0, 0)`, `(L_vq, W, L_vz)`, `(0, 0, 1)`.
pub fn legendre_jacobian<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> DMatrix<f64> {
    let h = lagrangian.hessian(t, x);
    DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| match (i, j) {
        (i, j) if i >= N && i < 2 * N => match j {
            _ if j < N => h.qv[(j, i - N)],
            _ if j < 2 * N => h.vv[(i - N, j - N)],
            _ => h.vz[i - N],
        },
        (i, j) if i == j => 1.0,
        _ => 0.0,
    })
}

/// The Legendre transformation at a fixed time, as a map that can be differentiated.
#[derive(Clone, Copy, Debug)]
pub struct Legendre<'a, L> {
    /// The Lagrangian.
    pub lagrangian: &'a L,
    /// The time at which it is evaluated.
    pub t: f64,
}

impl<const N: usize, L: Lagrangian<N>> Smooth<N> for Legendre<'_, L> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        Ok(legendre(self.lagrangian, T::from(self.t), &(*x).into()).into())
    }
}

/// The Herglotz vector field `xi_L = (v, a, L)` on TQ x R: Herglotz' equations
/// `d/dt L_v = L_q + L_v L_z`, `zdot = L` solved for the acceleration `a`; paper, section 2.2. With an
/// [applied force](Lagrangian::applied_force) f, `d/dt L_v = L_q + L_v L_z + f`.
///
/// For any regular L: `W a = L_q + L_v L_z - (L_vq v + L_vz L + L_vt)`. A first evaluation, on duals along q and z,
/// gives L, `L_q` and `L_z`; a second, on nested duals along the `N` velocities and along the drift `(v, 0, L, 1)`,
/// gives W and the bracket. This takes two thirds of the work of all mixed second derivatives.
///
/// # Errors
/// [`GeometryError::Singular`] where W is singular.
#[inline]
pub fn herglotz_field<T: Scalar, const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: T,
    x: &VelocityPoint<N, T>,
) -> Result<ChartVector<N, T>, GeometryError> {
    Ok(herglotz_rates(lagrangian, t, x)?.0)
}

/// The Herglotz vector field together with the rate `L_z` of the conformal factor, which the same evaluation provides.
/// Along a motion `sigma = exp int L_z`.
///
/// # Errors
/// Those of [`herglotz_field`].
#[inline]
pub fn herglotz_rates<T: Scalar, const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: T,
    x: &VelocityPoint<N, T>,
) -> Result<(ChartVector<N, T>, T), GeometryError> {
    if const { N > BLOCK } {
        return rates_of_many(lagrangian, t, x);
    }
    // L, L_q and L_z, by duals along the N + 1 directions of q and z.
    let still = Dual::<T, AugmentedVector<N, T>>::constant;
    let mut y = VelocityPoint { q: x.q.map(still), v: x.v.map(still), z: still(x.z) };
    for i in 0..N {
        y.q[i].d.x[i] = T::one();
    }
    y.z.d.z = T::one();
    let Dual { re: zdot, d: slope } = lagrangian.along(t, &y);
    // L_v, and its derivatives along the velocities and the drift: only these second derivatives are needed.
    let moving = |re: T, drift: T| {
        Dual::<Dual<T, AugmentedVector<N, T>>, SVector<Dual<T, AugmentedVector<N, T>>, N>>::constant(Dual {
            re,
            d: AugmentedVector { x: TangentVector::null(), z: drift },
        })
    };
    let mut y = VelocityPoint {
        q: SVector::from_fn(|i, _| moving(x.q[i], x.v[i])),
        v: x.v.map(|v| moving(v, T::zero())),
        z: moving(x.z, zdot),
    };
    for i in 0..N {
        y.v[i].re.d.x[i] = T::one();
        y.v[i].d[i] = Dual::one();
    }
    let p = lagrangian.along(Dual { re: t, d: AugmentedVector { x: TangentVector::null(), z: T::one() } }, &y).d;
    let mut a = SVector::<T, N>::from_fn(|i, _| slope.x[i] + p[i].re * slope.z - p[i].d.z);
    add_applied_force(lagrangian, t, x, &mut a);
    let mut w = SMatrix::<T, N, N>::from_fn(|i, j| p[i].d.x[j]);
    solve(&mut w, &mut a).map_err(irregular)?;
    Ok((ChartVector { x: x.v, y: a, z: zdot }, slope.z))
}

/// [`herglotz_rates`] for many coordinates, in blocks of directions to save stack space.
#[inline(never)]
fn rates_of_many<T: Scalar, const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: T,
    x: &VelocityPoint<N, T>,
) -> Result<(ChartVector<N, T>, T), GeometryError> {
    let (zdot, slope) = lagrangian.with_gradient(t, x);
    let drifting = |re: T, drift: T| Dual { re, d: SVector::<T, 1>::new(drift) };
    let y = VelocityPoint {
        q: x.q.zip_map(&x.v, drifting),
        v: x.v.map(|v| drifting(v, T::zero())),
        z: drifting(x.z, zdot),
    };
    let p = lagrangian.gradient(drifting(t, T::one()), &y).y;
    let mut a = SVector::<T, N>::from_fn(|i, _| slope.x[i] + p[i].re * slope.z - p[i].d[0]);
    add_applied_force(lagrangian, t, x, &mut a);
    solve(&mut lagrangian.mass_matrix(t, x), &mut a).map_err(irregular)?;
    Ok((ChartVector { x: x.v, y: a, z: zdot }, slope.z))
}

/// The error for a singular W.
fn irregular(singular: SingularMatrix) -> GeometryError {
    singular.of(
        "W = L_vv",
        "L is not regular here, so that Herglotz' equation does not determine the acceleration; choose a regular \
         Lagrangian",
    )
}

/// The Herglotz vector field at a fixed time, as a field that can be differentiated.
#[derive(Clone, Copy, Debug)]
pub struct HerglotzField<'a, L> {
    /// The Lagrangian.
    pub lagrangian: &'a L,
    /// The time at which it is evaluated.
    pub t: f64,
}

impl<const N: usize, L: Lagrangian<N>> Smooth<N> for HerglotzField<'_, L> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        herglotz_field(self.lagrangian, T::from(self.t), &(*x).into())
    }
}

/// Noether's momentum `J(xi) = L_v . xi_Q = -eta_L(xi_TQxR)` on TQ x R. It is dissipated if the group is a symmetry of
/// L; paper, section 2.2.2, with the sign of the errata.
#[derive(Clone, Copy, Debug)]
pub struct NoetherMomentum<'a, L, G> {
    /// The Lagrangian.
    pub lagrangian: &'a L,
    /// The group.
    pub group: &'a G,
}

impl<const N: usize, L: Lagrangian<N>, G: OneParameterGroup<N>> SmoothFunction<N> for NoetherMomentum<'_, L, G> {
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T {
        self.group.momentum(&x.x, &self.lagrangian.gradient(t, &(*x).into()).y)
    }
}

/// The lift of a group element to TQ x R, as a map that can be differentiated.
#[derive(Clone, Copy, Debug)]
pub struct LiftedAction<'a, G> {
    /// The group.
    pub group: &'a G,
    /// The parameter of the element.
    pub s: f64,
}

impl<const N: usize, G: OneParameterGroup<N>> Smooth<N> for LiftedAction<'_, G> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        Ok(self.group.on_velocities(T::from(self.s), &(*x).into()).into())
    }
}
