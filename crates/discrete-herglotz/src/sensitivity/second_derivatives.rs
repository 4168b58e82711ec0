//! Derivatives of L and of the force along two tangents, at a point.

use contact_geom::nalgebra::SVector;
use contact_geom::support::seed;
use contact_geom::{ChartVector, Dual, Parametric, VelocityPoint};

/// A number with its derivative along one direction.
type AlongOne = Dual<f64, SVector<f64, 1>>;

/// A number with its derivatives along two directions, and the mixed one.
pub(crate) type AlongTwo = Dual<AlongOne, SVector<AlongOne, 1>>;

/// A number that moves along two directions; the mixed derivative of the number is the last of the arguments.
pub(crate) fn along_two(re: f64, [first, second]: [f64; 2], mixed: f64) -> AlongTwo {
    let one = |re: f64, d: f64| Dual { re, d: SVector::<f64, 1>::from_element(d) };
    Dual { re: one(re, first), d: SVector::<AlongOne, 1>::from_element(one(second, mixed)) }
}

/// The mixed derivative of a number.
pub(crate) fn mixed(x: &AlongTwo) -> f64 {
    x.d[0].d[0]
}

/// A tangent at a point of `R x TQ x R`, of rho, and of the parameters.
pub(crate) struct PointTangent<'a, const N: usize> {
    /// `(dq, dv, dz)`.
    pub x: ChartVector<N>,
    pub rho: f64,
    pub t: f64,
    pub theta: &'a [f64],
}

/// The second derivatives of L and of the momentum, the force and the rate on the symplectification along two tangents, at
/// a point that moves linearly.
pub(crate) struct MixedDerivatives<const N: usize> {
    /// Of `L`.
    pub l: f64,
    /// Of `rho L_v`.
    pub momentum: SVector<f64, N>,
    /// Of `rho (L_q + f)`.
    pub force: SVector<f64, N>,
    /// Of `rho L_z`.
    pub rate: f64,
}

/// Evaluates derivatives along two tangents, with buffers for the parameters.
pub(crate) struct SecondDerivatives<const N: usize> {
    values: Vec<f64>,
    theta: Vec<AlongTwo>,
    with_gradient: Vec<Dual<AlongTwo, ChartVector<N, AlongTwo>>>,
}

impl<const N: usize> SecondDerivatives<N> {
    pub fn new(lagrangian: &impl Parametric<N>) -> Self {
        let values = lagrangian.parameters();
        let (theta, with_gradient) = (Vec::with_capacity(values.len()), Vec::with_capacity(values.len()));
        SecondDerivatives { values, theta, with_gradient }
    }

    /// The second derivatives along two tangents at the time t, the point x and rho.
    #[inline(never)]
    pub fn at<L: Parametric<N>>(
        &mut self,
        lagrangian: &L,
        (t, x, rho): (f64, &VelocityPoint<N>, f64),
        a: &PointTangent<'_, N>,
        b: &PointTangent<'_, N>,
    ) -> MixedDerivatives<N> {
        let vector = |re: &SVector<f64, N>, a: &SVector<f64, N>, b: &SVector<f64, N>| {
            SVector::<AlongTwo, N>::from_fn(|d, _| along_two(re[d], [a[d], b[d]], 0.0))
        };
        let point = ChartVector {
            x: vector(&x.q, &a.x.x, &b.x.x),
            y: vector(&x.v, &a.x.y, &b.x.y),
            z: along_two(x.z, [a.x.z, b.x.z], 0.0),
        };
        let (time, factor) = (along_two(t, [a.t, b.t], 0.0), along_two(rho, [a.rho, b.rho], 0.0));
        let theta = self.values.iter().zip(a.theta.iter().zip(b.theta));
        self.theta.clear();
        self.theta.extend(theta.map(|(re, (a, b))| along_two(*re, [*a, *b], 0.0)));
        self.with_gradient.clear();
        self.with_gradient.extend(self.theta.iter().map(|theta| Dual::constant(*theta)));
        let y = seed(&point);
        let l = lagrangian.value_at(&self.with_gradient, Dual::constant(time), &y.x, &y.y, y.z);
        let mut of_q = l.d.x;
        if const { L::HINTS.forced } {
            let x = VelocityPoint { q: point.x, v: point.y, z: point.z };
            let force = lagrangian.force_at(&self.theta, time, &x);
            of_q = SVector::from_fn(|d, _| of_q[d] + force[d]);
        }
        MixedDerivatives {
            l: mixed(&l.re),
            momentum: l.d.y.map(|p| mixed(&(p * factor))),
            force: of_q.map(|f| mixed(&(f * factor))),
            rate: mixed(&(l.d.z * factor)),
        }
    }
}
