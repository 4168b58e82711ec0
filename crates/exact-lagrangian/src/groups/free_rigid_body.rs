//! The free rigid body with linear drag, by elliptic functions.

use super::{ChangeOfTime, jacobi_functions};
use contact_geom::groups::{GroupError, Inertia, LieGroup, Rotation, Rotations};
use contact_geom::nalgebra::{Matrix3, Vector3};
use discrete_herglotz::groups::GroupState;
use std::f64::consts::PI;

/// The free rigid body with linear drag, `l = omega . J omega/2 + gamma z`: its motion in closed form.
///
/// The body momentum is that of the free body at the time `tau = (e^(gamma t) - 1)/gamma`, times `e^(gamma t)`; that of
/// the free body is a multiple of cn, sn and dn about the principal axes (Landau and Lifshitz, Mechanics, section 37).
/// The attitude is one quadrature: the angle about the constant spatial momentum, integrated to round-off.
///
/// ```
/// use contact_geom::groups::{Inertia, LieGroup, Rotations};
/// use contact_geom::nalgebra::SVector;
/// use discrete_herglotz::groups::GroupState;
/// use exact_lagrangian::groups::FreeRigidBody;
/// let body = FreeRigidBody::new(Inertia::principal([1.0, 2.0, 3.0])?, -0.1)?;
/// let start = GroupState { g: Rotations::identity(), momentum: SVector::from([1.0; 3]), z: 0.0 };
/// let end = body.at(10.0, &start)?;
/// assert!((end.momentum[0] - 0.328817081371932892).abs() < 1e-14);
/// # Ok::<(), contact_geom::groups::GroupError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeRigidBody {
    inertia: Inertia,
    drag: ChangeOfTime,
}

/// The motion of the free body in principal axes: the axis a has the momentum `alpha cn`, b `alpha sn`, c `alpha dn`.
struct Motion {
    axes: [usize; 3],
    amplitudes: [f64; 3],
    moduli: [f64; 2],
    /// du/dt.
    rate: f64,
    /// `(sn, cn, dn)` at the start.
    start: [f64; 3],
    /// The axis whose turn about the spatial momentum is integrated, a or c: the one that stays farther from it.
    reference: usize,
}

impl FreeRigidBody {
    /// The body with this inertia and the rate gamma, negative for dissipation.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`].
    pub fn new(inertia: Inertia, gamma: f64) -> Result<Self, GroupError> {
        Ok(FreeRigidBody { inertia, drag: ChangeOfTime::new(gamma)? })
    }

    /// The state at time t, before or after the start at time 0.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`], [`GroupError::NonUnitQuaternion`] for the start.
    pub fn at(&self, t: f64, start: &GroupState<Rotations, 3>) -> Result<GroupState<Rotations, 3>, GroupError> {
        start.check()?;
        if !t.is_finite() {
            return Err(GroupError::NonFinite { what: "the time", value: t });
        }
        let (tau, factor) = (self.drag.free_time(t), self.drag.factor(t));
        let axes = self.inertia.axes();
        let p0 = axes.transpose() * start.momentum;
        let kinetic = 0.5 * p0.component_div(self.inertia.moments()).dot(&p0);
        let z = self.drag.action(t, start.z, kinetic);
        let (p, turn) = match Motion::new(self.inertia.moments(), &p0) {
            // A spherical body, a body at rest, or a turn about a principal axis.
            None => (p0, Rotations::exp(&(axes * p0.component_div(self.inertia.moments()) * tau))),
            Some(motion) => {
                let p = motion.momentum(tau);
                let angle = motion.angle(self.inertia.moments(), tau);
                let (before, after) = (motion.frame(&p0), motion.frame(&p));
                // R(t) = exp(angle n) R0 F(0) F(t)^T, with n = R0 p0/|p0| turned into the body at the start.
                let about = Rotations::exp(&(axes * p0.normalize() * angle));
                let frames = axes * before * after.transpose() * axes.transpose();
                (p, Rotations::compose(&about, &quaternion(&frames)))
            }
        };
        let g = Rotations::compose(&start.g, &turn).normalised();
        Ok(GroupState { g, momentum: axes * p * factor, z })
    }
}

impl Motion {
    /// The motion from a momentum in principal axes; `None` where the momentum is constant.
    fn new(moments: &Vector3<f64>, p: &Vector3<f64>) -> Option<Self> {
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| moments[i].total_cmp(&moments[j]));
        // With a and c the axes of the smallest and the largest moment, or the other way, so that the modulus is below
        // 1.
        let [first, b, last] = order;
        if moments[first] == moments[last] || p.iter().filter(|x| **x != 0.0).count() < 2 {
            return None;
        }
        let motion = |a: usize, c: usize| -> Option<Self> {
            let [ia, ib, ic] = [moments[a], moments[b], moments[c]];
            let [pa, pb, pc] = [p[a], p[b], p[c]];
            // Sums of terms that are not negative.
            let square_a = pa * pa + pb * pb * ((ic - ib) * ia / ((ic - ia) * ib));
            let square_c = pc * pc + pb * pb * ((ib - ia) * ic / ((ic - ia) * ib));
            let (above, below) = ((ib - ia).abs() * square_a * ic, (ic - ib).abs() * square_c * ia);
            // Without cancellation of the terms with pb: ((ic - ib) pc^2 ia - (ib - ia) pa^2 ic) has no such terms.
            let difference = (ic - ib).abs() * pc * pc * ia - (ib - ia).abs() * pa * pa * ic;
            if below == 0.0 || difference < 0.0 {
                return None;
            }
            let moduli = [(above / below).sqrt().min(1.0), (difference / below).sqrt().min(1.0)];
            // (a, b, c) is an even permutation or not; the axes are right-handed.
            let sign = if (b + 3 - a) % 3 == 1 { 1.0 } else { -1.0 };
            let alpha_c = if pc < 0.0 { -square_c.sqrt() } else { square_c.sqrt() };
            let alpha_a = square_a.sqrt();
            let size_b = (square_a * (ic - ia) * ib / ((ic - ib) * ia)).sqrt();
            let alpha_b = if sign * alpha_c * (1.0 / ia - 1.0 / ic) < 0.0 { -size_b } else { size_b };
            let rate = alpha_c.abs() * ((ic - ib) * (ic - ia) / (ia * ib)).sqrt() / ic;
            let start = if alpha_a == 0.0 { [0.0, 1.0, 1.0] } else { [pb / alpha_b, pa / alpha_a, pc / alpha_c] };
            // The smallest squared distance of c from the line of the momentum is at sn = 0 or 1, that of a at sn = 0.
            let distance_c = if size_b < alpha_a { size_b } else { alpha_a };
            let reference = if distance_c > alpha_c.abs() { c } else { a };
            Some(Motion { axes: [a, b, c], amplitudes: [alpha_a, alpha_b, alpha_c], moduli, rate, start, reference })
        };
        motion(first, last).or_else(|| motion(last, first))
    }

    /// The momentum at time tau, by the addition theorem from the start.
    fn momentum(&self, tau: f64) -> Vector3<f64> {
        let [s0, c0, d0] = self.start;
        let [s, c, d] = jacobi_functions(self.rate * tau, self.moduli);
        let square = self.moduli[0] * self.moduli[0];
        let inverse = 1.0 / (1.0 - square * s0 * s0 * s * s);
        let sn = (s0 * c * d + s * c0 * d0) * inverse;
        let cn = (c0 * c - s0 * d0 * s * d) * inverse;
        let dn = (d0 * d - square * s0 * c0 * s * c) * inverse;
        let mut p = Vector3::zeros();
        for ((axis, amplitude), value) in self.axes.into_iter().zip(self.amplitudes).zip([cn, sn, dn]) {
            p[axis] = amplitude * value;
        }
        p
    }

    /// The angle about the spatial momentum by which the plane of it and the axis of reference, say a, turns: the
    /// integral of `|p| (p_b^2/I_b + p_c^2/I_c)/(p_b^2 + p_c^2)`.
    fn angle(&self, moments: &Vector3<f64>, tau: f64) -> f64 {
        let [i, j] = [(self.reference + 1) % 3, (self.reference + 2) % 3];
        let rate = |time: f64| {
            let p = self.momentum(time);
            let (pi, pj) = (p[i] * p[i], p[j] * p[j]);
            p.norm() * (pi / moments[i] + pj / moments[j]) / (pi + pj)
        };
        // The rate has the period 2K of u: many periods are one, many times.
        let period = match self.moduli[1] {
            0.0 => f64::INFINITY,
            complementary => PI / (mean(1.0, complementary) * self.rate),
        };
        let whole = (tau / period).trunc();
        if whole.abs() < 2.0 {
            return self.integral(&rate, tau);
        }
        whole * self.integral(&rate, period) + self.integral(&rate, tau - whole * period)
    }

    /// The integral of a function of time from 0 to a time, by Gauss' quadrature.
    fn integral(&self, rate: &impl Fn(f64) -> f64, time: f64) -> f64 {
        // The poles of cn, sn and dn are at least pi/2 of u away from the real axis: panels of a quarter are integrated
        // to round-off, those of the denominator included.
        let panels = ((self.rate * time).abs() * 4.0).ceil().max(1.0);
        let width = time / panels;
        let (mut sum, mut rest) = (0.0, 0.0);
        for panel in 0..panels as usize {
            let middle = (panel as f64 + 0.5) * width;
            for (x, weight) in NODES.into_iter().zip(WEIGHTS) {
                for side in [-1.0, 1.0] {
                    let change = 0.5 * weight * width * rate(middle + side * x * 0.5 * width) + rest;
                    let next = sum + change;
                    rest = change - (next - sum);
                    sum = next;
                }
            }
        }
        sum
    }

    /// The frame of the momentum and the axis of reference a: the unit vectors along p, a x p and p x (a x p).
    fn frame(&self, p: &Vector3<f64>) -> Matrix3<f64> {
        let mut axis = Vector3::zeros();
        axis[self.reference] = 1.0;
        let first = p.normalize();
        let second = axis.cross(p).normalize();
        Matrix3::from_columns(&[first, second, first.cross(&second)])
    }
}

/// The arithmetic-geometric mean.
fn mean(mut a: f64, mut b: f64) -> f64 {
    for _ in 0..20 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// Half of the nodes and weights of Gauss' quadrature with 16 nodes on [-1, 1].
const NODES: [f64; 8] = [
    0.095_012_509_837_637_44,
    0.281_603_550_779_258_9,
    0.458_016_777_657_227_4,
    0.617_876_244_402_643_7,
    0.755_404_408_355_003,
    0.865_631_202_387_831_7,
    0.944_575_023_073_232_6,
    0.989_400_934_991_649_9,
];
const WEIGHTS: [f64; 8] = [
    0.189_450_610_455_068_5,
    0.182_603_415_044_923_58,
    0.169_156_519_395_002_54,
    0.149_595_988_816_576_73,
    0.124_628_971_255_533_87,
    0.095_158_511_682_492_78,
    0.062_253_523_938_647_894,
    0.027_152_459_411_754_095,
];

/// The unit quaternion of a rotation matrix, by its largest entry.
fn quaternion(m: &Matrix3<f64>) -> Rotation {
    let trace = m.trace();
    // Four times the squares of the entries w, x, y, z.
    let squares = [1.0 + trace, 1.0 - trace + 2.0 * m.m11, 1.0 - trace + 2.0 * m.m22, 1.0 - trace + 2.0 * m.m33];
    let largest = (1..4).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
    let products = [
        [squares[0], m.m32 - m.m23, m.m13 - m.m31, m.m21 - m.m12],
        [m.m32 - m.m23, squares[1], m.m12 + m.m21, m.m13 + m.m31],
        [m.m13 - m.m31, m.m12 + m.m21, squares[2], m.m23 + m.m32],
        [m.m21 - m.m12, m.m13 + m.m31, m.m23 + m.m32, squares[3]],
    ];
    let [w, x, y, z] = products[largest];
    Rotation { w, u: [x, y, z].into() }.normalised()
}
