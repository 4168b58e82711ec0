//! The non-holonomic system (L~, M_L) that is equivalent to Herglotz' equations.

use crate::numerics::flow::{ACCURACY, Work, integrate};
use crate::numerics::panel::{Rate, Rates, State};
use crate::{ExactError, Motion};
use contact_geom::nalgebra::{DMatrix, DVector, SVector};
use contact_geom::support::linear::solve;
use contact_geom::{
    ChartVector, Derivatives, Dual, GeometryError, Lagrangian, Regularity, Scalar, VelocityPoint,
    numbers::{AugmentedVector, TangentVector, max_or_nan},
    support::seed,
};

/// A point `(q, z, v, w)` of T(Q x R); on `M_L` where `w = L(q, v, z)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtendedPoint<const N: usize, T = f64> {
    /// Position.
    pub q: SVector<T, N>,
    /// Action.
    pub z: T,
    /// Velocity of the position.
    pub v: SVector<T, N>,
    /// Velocity of the action.
    pub w: T,
}

impl<const N: usize, T: Scalar> ExtendedPoint<N, T> {
    /// The projection `pi : T(Q x R) -> TQ x R`, which forgets `w`.
    pub fn project(&self) -> VelocityPoint<N, T> {
        VelocityPoint { q: self.q, v: self.v, z: self.z }
    }
}

/// The singular Lagrangian `L~ = L o pi` on T(Q x R) with the non-linear constraint `Phi = w - L(q, v, z) = 0`, the
/// submanifold `M_L`; paper, section 4.1.
///
/// Chetaev's principle gives its equations of motion, with a multiplier lambda: `d/dt L~_v - L~_q = lambda Phi_v`,
/// `d/dt L~_w - L~_z = lambda Phi_w`, `Phi = 0`. The multiplier is computed together with the accelerations. The
/// theorem that it is `-L_z`, by which these are Herglotz' equations, is not used.
#[derive(Clone, Copy, Debug)]
pub struct NonHolonomic<L> {
    lagrangian: L,
}

/// The solution of Chetaev's equations at a point: the accelerations of position and action, and the multiplier.
#[derive(Clone, Debug, PartialEq)]
pub struct Chetaev<const N: usize, T = f64> {
    /// The acceleration of the position.
    pub a: SVector<T, N>,
    /// The acceleration of the action.
    pub dw: T,
    /// The multiplier lambda of the constraint.
    pub multiplier: T,
}

/// A motion on `M_L`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtendedMotion<const N: usize, T = f64> {
    /// The end of the motion.
    pub end: ExtendedPoint<N, T>,
    /// The largest defect `|w - L|` of the constraint at the ends of eight parts of the motion, relative to `1 + |L|`.
    /// The flow stays on `M_L` by its equations alone, without projection.
    pub defect: f64,
}

/// The number of parts of a motion, at whose ends the constraint is checked: enough to see a drift that grows along it.
const PARTS: usize = 8;

impl<L> NonHolonomic<L> {
    /// The non-holonomic system of a Lagrangian.
    pub fn new(lagrangian: L) -> Self {
        NonHolonomic { lagrangian }
    }

    /// The inverse of `pi` restricted to `M_L`: the point over `(q, v, z)` at time t with `w = L`.
    pub fn lift<T: Scalar, const N: usize>(&self, t: f64, x: &VelocityPoint<N, T>) -> ExtendedPoint<N, T>
    where
        L: Lagrangian<N>,
    {
        ExtendedPoint { q: x.q, z: x.z, v: x.v, w: self.lagrangian.value(T::from(t), &x.q, &x.v, x.z) }
    }

    /// Chetaev's equations solved for accelerations and multiplier: `N + 2` linear equations, of which the last is the
    /// time derivative of the constraint. They are defined on all of T(Q x R), and the solution is tangent to the sets
    /// `Phi = const`.
    ///
    /// # Errors
    /// [`GeometryError::Singular`] where W is singular, [`GeometryError::Undefined`] where a term is not finite.
    pub fn chetaev<T: Scalar, const N: usize>(
        &self,
        t: f64,
        x: &ExtendedPoint<N, T>,
    ) -> Result<Chetaev<N, T>, GeometryError>
    where
        L: Lagrangian<N>,
    {
        // Along the velocities, and along the drift (q, z, t)' = (v, w, 1) of T(Q x R).
        let moving = |re: T, drift: T| Dual { re, d: AugmentedVector::<N, T> { x: TangentVector::null(), z: drift } };
        let mut y = VelocityPoint {
            q: SVector::<_, N>::from_fn(|i, _| moving(x.q[i], x.v[i])),
            v: x.v.map(|v| moving(v, T::zero())),
            z: moving(x.z, x.w),
        };
        for i in 0..N {
            y.v[i].d.x[i] = T::one();
        }
        let time = moving(T::from(t), T::one());
        let value = self.lagrangian.value(time, &y.q, &y.v, y.z);
        let g = self.lagrangian.gradient(time, &y);
        // Unknowns a, dw, lambda. L~ does not depend on w; Phi_v = -L_v, Phi_w = 1.
        let mut matrix = DMatrix::from_element(N + 2, N + 2, T::zero());
        let mut right = DVector::from_element(N + 2, T::zero());
        for i in 0..N {
            for j in 0..N {
                matrix[(i, j)] = g.y[i].d.x[j];
            }
            matrix[(i, N + 1)] = g.y[i].re;
            right[i] = g.x[i].re - g.y[i].d.z;
            matrix[(N + 1, i)] = -g.y[i].re;
        }
        matrix[(N, N + 1)] = -T::one();
        right[N] = g.z.re;
        matrix[(N + 1, N)] = T::one();
        right[N + 1] = value.d.z;
        solve(&mut matrix, &mut right)
            .map_err(|e| e.of("the matrix of Chetaev's equations", "L is not regular here; choose another point"))?;
        if !right.iter().all(|e| e.extent().is_finite()) {
            return Err(GeometryError::Undefined { what: "the solution of Chetaev's equations" });
        }
        Ok(Chetaev { a: SVector::from_fn(|i, _| right[i]), dw: right[N], multiplier: right[N + 1] })
    }

    /// The flow of `Gamma` on `M_L` over a duration.
    ///
    /// # Errors
    /// Like those of [`herglotz_flow`](crate::herglotz_flow).
    pub fn flow<T: Scalar, const N: usize>(
        &self,
        t0: f64,
        start: &ExtendedPoint<N, T>,
        duration: f64,
    ) -> Result<ExtendedMotion<N, T>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let (mut at, mut defect, mut work) = (*start, 0.0, Work::default());
        for k in 0..PARTS {
            let (from, to) = [k, k + 1].map(|k| duration * (k as f64 / PARTS as f64)).into();
            let state = State { q: at.q, v: at.v, z: at.z, b: at.w };
            let Motion { end, b: w, .. } = integrate(self, t0 + from, &state, to - from, ACCURACY, &mut work)?;
            at = ExtendedPoint { q: end.q, z: end.z, v: end.v, w };
            let on = self.lift(t0 + to, &end).w.re();
            defect = max_or_nan(defect, (w.re() - on).abs() / (1.0 + on.abs()));
        }
        Ok(ExtendedMotion { end: at, defect })
    }

    /// The differential of `exp_h^Gamma o (pi|M_L)^-1 : (q0, v0, z0) -> (q0, z0, q1, z1)`: `2N + 2` rows, `2N + 1`
    /// columns in the order of TQ x R. Its columns span the tangent space of `M_d`, the image of the non-holonomic
    /// exponential map.
    ///
    /// # Errors
    /// Those of [`flow`](Self::flow).
    pub fn exponential_differential<const N: usize>(
        &self,
        t: f64,
        x: &VelocityPoint<N>,
        h: f64,
    ) -> Result<DMatrix<f64>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let start = self.lift(t, &seed(&ChartVector::from(*x)).into());
        let end = self.flow(t, &start, h)?.end;
        Ok(DMatrix::from_fn(2 * N + 2, 2 * N + 1, |i, j| match i {
            _ if i < N => f64::from(u8::from(i == j)),
            _ if i == N => f64::from(u8::from(j == 2 * N)),
            _ if i <= 2 * N => end.q[i - N - 1].d.component(j),
            _ => end.z.d.component(j),
        }))
    }

    /// The regularity of `pr~_1 : (q0, z0, q1, z1) -> (q0, q1, z0)` restricted to `M_d`: the singular values of its
    /// restriction to the tangent space of `M_d`, in an orthonormal basis of that space; paper, section 4.1, lemma.
    ///
    /// `M_d` is the graph of `z1 = z0 + L_h^e` over Q x Q x R. Hence the smallest singular value is
    /// `(1 + |D1 L_h^e|^2 + |D2 L_h^e|^2 + sigma_d^2)^(-1/2)` wherever the exponential map is an embedding, and does
    /// not vanish there. At a conjugate point the exponential map itself has a fold, and `M_d` has no tangent space.
    ///
    /// # Errors
    /// Those of [`flow`](Self::flow).
    pub fn projection_regularity<const N: usize>(
        &self,
        t: f64,
        x: &VelocityPoint<N>,
        h: f64,
    ) -> Result<Regularity, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let basis = self.exponential_differential(t, x, h)?.qr().q();
        Ok(Regularity::of(basis.rows(0, 2 * N + 1).into_owned()))
    }
}

impl<L: Lagrangian<N>, T: Scalar, const N: usize> Rates<N, T> for NonHolonomic<L> {
    /// The second integrated quantity, `b`, is w.
    fn at(&self, t: f64, x: &State<N, T>) -> Result<Rate<N, T>, GeometryError> {
        let solved = self.chetaev(t, &ExtendedPoint { q: x.q, z: x.z, v: x.v, w: x.b })?;
        Ok(Rate { a: solved.a, z: x.b, b: solved.dw })
    }
}
