//! Flows of `z' = f(z)`, the part of a splitting that acts on the action.

use super::separable::{MAX_HYPOTHESIS_DEFECT, without_symmetry};
use crate::InputError;
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Dual, Lagrangian, PhasePoint, Scalar, VelocityPoint};

/// The flow of `z' = f(z)`, `p' = f'(z) p`: the third part of a splitting for L that is not affine in z.
///
/// It maps the action by `z -> phi_s(z)` and the momentum by `p -> phi_s'(z) p`, which is conformally contact with the
/// factor `phi_s'(z)`. The derivative is computed by automatic differentiation.
///
/// ```
/// use contact_geom::Scalar;
/// use discrete_herglotz::splitting::{ActionFlow, ActionMap};
/// /// `f(z) = -k e^z`.
/// struct Exponential { k: f64 }
/// #[derive(Clone, Copy, Debug)]
/// struct Over { ks: f64 }
/// impl ActionFlow for Exponential {
///     type Map = Over;
///     fn rate<T: Scalar>(&self, z: T) -> T { -z.exp() * self.k }
///     fn over(&self, s: f64) -> Over { Over { ks: self.k * s } }
/// }
/// impl ActionMap for Over {
///     fn apply<T: Scalar>(&self, z: T) -> T { z - (z.exp() * self.ks).ln_1p() }
/// }
/// ```
pub trait ActionFlow {
    /// The map `phi_s`, with the quantities that depend only on s precomputed.
    type Map: ActionMap;

    /// The rate `f(z)`.
    fn rate<T: Scalar>(&self, z: T) -> T;

    /// The map `phi_s` for a time s of either sign.
    fn over(&self, s: f64) -> Self::Map;
}

/// The map `phi_s` of an [`ActionFlow`].
pub trait ActionMap: Copy + std::fmt::Debug {
    /// `phi_s(z)`; NaN where the flow is not defined up to the time s.
    fn apply<T: Scalar>(&self, z: T) -> T;

    /// The change `phi_s(z) - z`. An implementation should avoid the cancellation in this difference where the flow is
    /// slow, because it affects the factor `phi_s'(z) - 1` of the momentum with the same sign in all steps.
    #[inline(always)]
    fn change<T: Scalar>(&self, z: T) -> T {
        self.apply(z) - z
    }
}

/// The flow of `f(z) = b z + c z^2`, a Riccati equation; a constant term belongs to the potential. In closed form, with
/// `d = (e^(b s) - 1)/b`, it is `phi_s(z) = e^(b s) z/(1 - c d z)` as long as the denominator is positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Riccati {
    /// The linear rate.
    pub b: f64,
    /// The quadratic rate.
    pub c: f64,
}

/// The map of [`Riccati`].
#[derive(Clone, Copy, Debug)]
pub struct RiccatiMap {
    /// `e^(b s) - 1`.
    growth: f64,
    /// `c (e^(b s) - 1)/b`.
    bend: f64,
}

impl ActionFlow for Riccati {
    type Map = RiccatiMap;

    #[inline(always)]
    fn rate<T: Scalar>(&self, z: T) -> T {
        z * (z * self.c + self.b)
    }

    fn over(&self, s: f64) -> RiccatiMap {
        let growth = (self.b * s).exp_m1();
        let length = if self.b == 0.0 { s } else { growth / self.b };
        RiccatiMap { growth, bend: self.c * length }
    }
}

impl ActionMap for RiccatiMap {
    #[inline(always)]
    fn apply<T: Scalar>(&self, z: T) -> T {
        z + self.change(z)
    }

    #[inline(always)]
    fn change<T: Scalar>(&self, z: T) -> T {
        let below = -(z * self.bend) + 1.0;
        if below.re() <= 0.0 {
            return T::from(f64::NAN);
        }
        z * (z * self.bend + self.growth) / below
    }
}

impl Riccati {
    /// Determines b and c from a Lagrangian and verifies that `L_z = b + 2 c z`.
    pub(crate) fn of<const N: usize>(
        lagrangian: &impl Lagrangian<N>,
        t: f64,
        state: &PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let x = VelocityPoint { q: state.q, v: SVector::zeros(), z: state.z };
        let c = 0.5 * lagrangian.hessian(t, &x).zz;
        let flow = Riccati { b: lagrangian.gradient(t, &x).z - 2.0 * c * state.z, c };
        let hypothesis = "an f(z) that is a polynomial of degree two, or the given flow of another f(z)";
        if is_rate_of(&flow, lagrangian, t, state) { Ok(flow) } else { Err(InputError::Hypothesis { hypothesis }) }
    }
}

/// The value and the derivative of a map at z.
#[inline(always)]
pub(super) fn with_slope(map: impl Fn(Dual<f64, SVector<f64, 1>>) -> Dual<f64, SVector<f64, 1>>, z: f64) -> (f64, f64) {
    let image = map(Dual { re: z, d: SVector::<f64, 1>::new(1.0) });
    (image.re, image.d[0])
}

/// Returns an error unless the flow is that of the function f of the Lagrangian.
pub(super) fn check_flow<const N: usize>(
    flow: &impl ActionFlow,
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    state: &PhasePoint<N>,
) -> Result<(), InputError> {
    if !is_rate_of(flow, lagrangian, t, state) {
        return Err(InputError::Hypothesis { hypothesis: "an action flow whose rate f has f'(z) = L_z" });
    }
    if !is_flow_of_its_rate(flow, state.z) {
        return Err(InputError::Hypothesis { hypothesis: "an action flow whose maps are the flow of its rate" });
    }
    Ok(())
}

/// Whether `f'(z) = L_z` at the action of the state and at two others.
fn is_rate_of<const N: usize>(
    flow: &impl ActionFlow,
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    state: &PhasePoint<N>,
) -> bool {
    nearby_actions(state.z).all(|z| {
        let given = lagrangian.gradient(t, &VelocityPoint { q: state.q, v: SVector::zeros(), z }).z;
        (with_slope(|z| flow.rate(z), z).1 - given).abs() <= MAX_HYPOTHESIS_DEFECT * (1.0 + given.abs())
    })
}

/// Whether the maps are the flow of the rate near an action: `phi_s' f = f o phi_s`, and
/// `phi_s - phi_(-s) = 2 s f` for small s up to higher order.
pub(super) fn is_flow_of_its_rate(flow: &impl ActionFlow, z: f64) -> bool {
    nearby_actions(z).all(|z| {
        let (rate, slope) = with_slope(|z| flow.rate(z), z);
        let scale = 1.0 / (1.0 + slope.abs());
        let (end, stretch) = with_slope(|z| flow.over(0.1 * scale).apply(z), z);
        let s = 1e-4 * scale;
        let change = flow.over(s).apply(z) - flow.over(-s).apply(z);
        let size = 1.0 + rate.abs();
        (stretch * rate - flow.rate(end)).abs() <= MAX_HYPOTHESIS_DEFECT * size
            && (change - 2.0 * s * rate).abs() <= 1e-6 * s * size
    })
}

/// An action and one value on either side of it.
fn nearby_actions(z: f64) -> impl Iterator<Item = f64> {
    [0.0, -0.1, 0.1].into_iter().enumerate().map(move |(i, d)| z + d * without_symmetry(i))
}
