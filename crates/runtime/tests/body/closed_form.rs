//! The motion of a free rigid body in closed form, by Jacobi's elliptic functions (Landau and Lifshitz, Mechanics, section 37),
//! for moments of inertia that are whole numbers.
//!
//! Its error is some hundred eps also next to the separatrix: what is small there is computed from the digits of the start
//! without cancellation, and the phase by Carlson's integral R_F.

use std::f64::consts::{FRAC_PI_2, PI};

/// The quaternion product.
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let ([aw, ax, ay, az], [bw, bx, by, bz]) = (a, b);
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

fn conjugate([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, -x, -y, -z]
}

fn norm(x: [f64; 3]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The angle of the turn between two attitudes.
pub fn turn(a: [f64; 4], b: [f64; 4]) -> f64 {
    let [w, x, y, z] = product(conjugate(a), b);
    2.0 * norm([x, y, z]).atan2(w.abs())
}

/// A product of two numbers and its rounding.
fn exact_product(a: f64, b: f64) -> (f64, f64) {
    (a * b, a.mul_add(b, -(a * b)))
}

/// `a x^2 - b y^2` with a relative error of some eps, where it is above `eps^2 a x^2`.
fn difference_of_squares(a: f64, x: f64, b: f64, y: f64) -> f64 {
    let of = |a: f64, x: f64| {
        let (square, rest) = exact_product(x, x);
        let (value, low) = exact_product(a, square);
        (value, low + a * rest)
    };
    let ((of_x, low_x), (of_y, low_y)) = (of(a, x), of(b, y));
    (of_x - of_y) + (low_x - low_y)
}

/// Carlson's integral R_F(x, y, 1), by duplication.
fn carlson(x: f64, y: f64) -> f64 {
    let (mut x, mut y, mut z) = (x, y, 1.0_f64);
    // Each duplication divides the differences by 4, and the series below has their sixth power as error.
    for _ in 0..40 {
        let [a, b, c] = [x, y, z].map(f64::sqrt);
        let lambda = a * b + b * c + c * a;
        [x, y, z] = [x, y, z].map(|x| 0.25 * (x + lambda));
        let mean = (x + y + z) / 3.0;
        if [x, y, z].iter().all(|x| (x - mean).abs() < 1e-3 * mean) {
            break;
        }
    }
    let mean = (x + y + z) / 3.0;
    let [a, b] = [x, y].map(|x| 1.0 - x / mean);
    let c = -a - b;
    let (second, third) = (a * b - c * c, a * b * c);
    (1.0 - second / 10.0 + third / 14.0 + second * second / 24.0 - 3.0 * second * third / 44.0) / mean.sqrt()
}

/// Jacobi's functions of one modulus, by arithmetic and geometric means (Abramowitz and Stegun, 16.4).
struct Jacobi {
    /// The complementary parameter `1 - m`.
    m1: f64,
    /// The means a_n, and the ratios c_n / a_n.
    means: Vec<(f64, f64)>,
    /// A quarter of the period.
    quarter: f64,
}

impl Jacobi {
    fn new(m1: f64) -> Self {
        let (mut a, mut b) = (1.0_f64, m1.sqrt());
        let mut means = vec![(a, (1.0 - m1).max(0.0).sqrt())];
        while (a - b).abs() > 4.0 * f64::EPSILON * a && means.len() < 64 {
            let c = 0.5 * (a - b);
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
            means.push((a, c / a));
        }
        Jacobi { m1, means, quarter: FRAC_PI_2 / a }
    }

    /// sn, cn and dn.
    fn at(&self, u: f64) -> [f64; 3] {
        let period = 4.0 * self.quarter;
        // To [-K, K], where small values of cn are computed from the distance to K by the quotients below.
        let u = u - (u / period).round() * period;
        let (u, sign) = if u > self.quarter {
            (2.0 * self.quarter - u, -1.0)
        } else if u < -self.quarter {
            (-2.0 * self.quarter - u, -1.0)
        } else {
            (u, 1.0)
        };
        let levels = self.means.len() - 1;
        let mut phi = f64::powi(2.0, levels as i32) * self.means[levels].0 * u;
        for (_, ratio) in self.means[1..].iter().rev() {
            phi = 0.5 * (phi + (ratio * phi.sin()).asin());
        }
        let (sn, cn) = phi.sin_cos();
        [sn, sign * cn, (cn * cn + self.m1 * sn * sn).sqrt()]
    }

    /// The argument with these values of sn, cn and dn.
    fn argument(&self, [sn, cn, dn]: [f64; 3]) -> f64 {
        let u = sn.abs() * carlson(cn * cn, dn * dn);
        (if cn < 0.0 { 2.0 * self.quarter - u } else { u }).copysign(sn)
    }
}

/// A free body with principal moments of inertia 1 < 2 < 3 or in the reverse order, whole numbers.
pub struct FreeBody {
    moments: [f64; 3],
    attitude: [f64; 4],
    omega: [f64; 3],
}

impl FreeBody {
    pub fn new(moments: [f64; 3], attitude: [f64; 4], omega: [f64; 3]) -> Self {
        FreeBody { moments, attitude, omega }
    }

    /// Attitude and angular velocity after the time t.
    pub fn after(&self, t: f64) -> ([f64; 4], [f64; 3]) {
        let ([i1, i2, i3], [w1, w2, w3]) = (self.moments, self.omega);
        // L^2 - 2 E I_2; the motion is about the third axis where it has the sign of I_3 - I_2, and about the first else.
        let beyond = difference_of_squares(i3 * (i3 - i2), w3, i1 * (i2 - i1), w1);
        let reversed = (beyond > 0.0) != (i3 > i2);
        let of_axes = |mut x: [f64; 3]| {
            if reversed {
                x.reverse();
            }
            x
        };
        let ([i1, i2, i3], [w1, w2, w3]) = (of_axes([i1, i2, i3]), of_axes([w1, w2, w3]));
        // 2 E I_3 - L^2 and L^2 - 2 E I_1, which have no cancellation.
        let from_third = i1 * (i3 - i1) * w1 * w1 + i2 * (i3 - i2) * w2 * w2;
        let from_first = i2 * (i2 - i1) * w2 * w2 + i3 * (i3 - i1) * w3 * w3;
        // Euler's equations have the other sign where one axis is reversed: so has I_3 - I_2 where the axes are exchanged.
        let orientation = if reversed { i2 - i3 } else { i3 - i2 };
        let amplitudes = [
            (from_third / (i1 * (i3 - i1))).sqrt(),
            (from_third / (i2 * (i3 - i2))).sqrt().copysign(w3 * orientation),
            (from_first / (i3 * (i3 - i1))).sqrt().copysign(w3),
        ];
        let rate = ((i3 - i2) * from_first / (i1 * i2 * i3)).sqrt();
        let jacobi = Jacobi::new((i3 - i1) * beyond / ((i3 - i2) * from_first));
        let start = jacobi.argument([w2 / amplitudes[1], w1 / amplitudes[0], w3 / amplitudes[2]]);
        let at = |s: f64| {
            let [sn, cn, dn] = jacobi.at(start + rate * s);
            [amplitudes[0] * cn, amplitudes[1] * sn, amplitudes[2] * dn]
        };
        // The turn about the momentum of the frame of momentum and third axis.
        let momentum = norm([i1 * w1, i2 * w2, i3 * w3]);
        let precession = |s: f64| {
            let [x, y, _] = at(s).map(|x| x * x);
            momentum * (i1 * x + i2 * y) / (i1 * i1 * x + i2 * i2 * y)
        };
        let angle = integral(precession, t, 0.015 / rate);
        let end = at(t);
        let frame =
            |omega: [f64; 3]| frame_of_momentum(of_axes([i1 * omega[0], i2 * omega[1], i3 * omega[2]]), reversed);
        let of_start = product(self.attitude, frame([w1, w2, w3]));
        let (sin, cos) = (0.5 * angle).sin_cos();
        // The frame has the momentum as its third axis.
        let attitude = product(product(of_start, [cos, 0.0, 0.0, sin]), conjugate(frame(end)));
        (attitude, of_axes(end))
    }
}

/// The rotation to the body from the frame whose third axis is the momentum and whose first axis is orthogonal to the third
/// axis of the body, or to its first axis.
fn frame_of_momentum(momentum: [f64; 3], about_first: bool) -> [f64; 4] {
    // A cyclic change of the axes takes the first to the third: that of the turn by 2 pi/3 about (1, 1, 1).
    let [x, y, z] = if about_first { [momentum[1], momentum[2], momentum[0]] } else { momentum };
    // A turn about the third axis by `azimuth`, and one about the first by the angle from the third axis.
    let (across, azimuth) = (x.hypot(y), x.atan2(-y));
    let tilt = across.atan2(z);
    let turned = product(
        [(0.5 * azimuth).cos(), 0.0, 0.0, (0.5 * azimuth).sin()],
        [(0.5 * tilt).cos(), (0.5 * tilt).sin(), 0.0, 0.0],
    );
    if about_first { product([0.5, 0.5, 0.5, 0.5], turned) } else { turned }
}

/// The integral from 0 to t by Gauss' rule of five points on panels of at most this length.
fn integral(f: impl Fn(f64) -> f64, t: f64, panel: f64) -> f64 {
    let root = (10.0_f64 / 7.0).sqrt();
    let [near, far] = [(5.0 - 2.0 * root).sqrt() / 3.0, (5.0 + 2.0 * root).sqrt() / 3.0];
    let [of_near, of_far] = [13.0, -13.0].map(|x: f64| (322.0 + x * 70.0_f64.sqrt()) / 900.0);
    let rule = [(-far, of_far), (-near, of_near), (0.0, 128.0 / 225.0), (near, of_near), (far, of_far)];
    let panels = (t.abs() / panel).ceil().max(1.0);
    let half = 0.5 * t / panels;
    let of_panel = |k: usize| {
        let centre = (2 * k + 1) as f64 * half;
        rule.iter().map(|(x, weight)| weight * f(centre + x * half)).sum::<f64>() * half
    };
    // Turns by 2 pi are left out, so that the sum keeps its digits.
    (0..panels as usize).map(of_panel).fold(0.0, |sum, part| (sum + part) % (4.0 * PI))
}
