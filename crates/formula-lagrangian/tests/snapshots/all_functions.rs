//! A Lagrangian of the coordinates x, y, made from its formula by formula-lagrangian.

use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Lagrangian, Scalar, Structure, VelocityPoint};

/// The Lagrangian with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllFunctions {
    /// The parameter type, 0.7 in the formula.
    pub type_: f64,
}

impl Lagrangian<2> for AllFunctions {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let a1: T = Scalar::sin(q[0]);
        let a3: T = Scalar::cos(q[1]);
        let a4: T = a1 * a3;
        let a7: T = q[0] * 0.5;
        let a8: T = Scalar::tan(a7);
        let a9: T = a4 + a8;
        let a10: T = Scalar::versine(q[1]);
        let a11: T = a9 + a10;
        let a12: T = Scalar::atan(q[1]);
        let a13: T = a11 + a12;
        let a14: T = Scalar::sinh(q[0]);
        let a15: T = a13 + a14;
        let a16: T = Scalar::cosh(q[1]);
        let a17: T = q[0] + 2.0;
        let a18: T = Scalar::tanh(a17);
        let a19: T = a16 / a18;
        let a20: T = a15 - a19;
        let a22: T = -q[0] + 3.0;
        let a23: T = Scalar::recip(a22);
        let a24: T = a20 + a23;
        let a26: T = q[0] * q[1];
        let a27: T = a26 + 4.0;
        let a28: T = Scalar::sqrt(a27);
        let a29: T = -q[0];
        let a30: T = Scalar::exp(a29);
        let a31: T = Scalar::exp_m1(q[1]);
        let a32: T = a30 * a31;
        let a33: T = a28 + a32;
        let a34: T = q[0] + 3.0;
        let a35: T = Scalar::ln(a34);
        let a36: T = a33 + a35;
        let a37: T = q[0] * q[0];
        let a38: T = Scalar::ln_1p(a37);
        let a39: T = a36 - a38;
        let a41: T = Scalar::powf(a17, 0.3);
        let a42: T = a39 + a41;
        let a43: T = q[1] + 3.0;
        let a45: T = Scalar::powf(a43, self.type_);
        let a46: T = a42 + a45;
        let a47: T = q[0] * q[0] * q[0];
        let a48: T = a46 - a47;
        let a49: T = q[1] + 2.0;
        let a52: T = Scalar::powi(a49, -5);
        let a53: T = a48 + a52;
        let a55: T = Scalar::powi(q[0], 7);
        let a56: T = a53 + a55;
        let a57: T = asinh(q[0]);
        let a58: T = atanh(q[1]);
        let a59: T = a57 * a58;
        let a60: T = acosh(a17);
        let a61: T = a59 + a60;
        let a62: T = q[0] - q[1];
        let a63: T = Scalar::abs(a62);
        let a64: T = Scalar::signum(q[0]);
        let a65: T = q[1] * a64;
        let a66: T = a63 + a65;
        let a68: T = Scalar::min(q[0], q[1]);
        let a69: T = Scalar::min(a68, T::from(0.1));
        let a70: T = q[1] * 2.0;
        let a71: T = Scalar::max(q[0], a70);
        let a72: T = a69 * a71;
        let a73: T = a66 + a72;
        let a74: T = atan2(q[0], q[1]);
        let a75: T = a73 + a74;
        let a77: T = -q[1] + 1.0;
        let a78: T = hypot(q[0], a77);
        let a79: T = a75 + a78;
        let a80: T = -q[1] + 2.0;
        let a81: T = Scalar::if_less(q[0], q[1], q[0], a80);
        let a82: T = a79 + a81;
        let a83: f64 = Scalar::sin(self.type_);
        let a84: T = q[0] * a83;
        let a85: f64 = self.type_ * self.type_;
        let a86: f64 = a85 + 1.0;
        let a87: T = T::from(a86) / a49;
        let a88: T = a84 + a87;
        let a89: T = -q[1] + self.type_;
        let a90: T = a88 + a89;
        let a92: T = t * self.type_;
        let a93: f64 = hypot(self.type_, 2.0);
        let a94: T = a92 * a93;
        let a95: T = a90 + a94;
        let a96: T = Scalar::cos(q[0]);
        let a97: T = a96 + 2.0;
        let a99: T = v[0] * v[0];
        let a100: T = a97 * a99;
        let a101: T = a100 * 0.5;
        let a104: T = q[0] * z;
        let a105: T = v[1] - a104;
        let a106: T = a105 * a105;
        let a107: T = a106 * 0.5;
        let a108: T = a101 + a107;
        let a109: T = a24 + a108;
        let a110: T = a56 + a109;
        let a111: T = a61 + a110;
        let a112: T = a82 + a111;
        let a113: T = a95 + a112;
        a113
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<2, T>) -> Option<ChartVector<2, T>> {
        let a1: T = Scalar::sin(x.q[0]);
        let a3: T = Scalar::cos(x.q[1]);
        let a7: T = x.q[0] * 0.5;
        let a8: T = Scalar::tan(a7);
        let a16: T = Scalar::cosh(x.q[1]);
        let a17: T = x.q[0] + 2.0;
        let a18: T = Scalar::tanh(a17);
        let a22: T = -x.q[0] + 3.0;
        let a23: T = Scalar::recip(a22);
        let a26: T = x.q[0] * x.q[1];
        let a27: T = a26 + 4.0;
        let a28: T = Scalar::sqrt(a27);
        let a29: T = -x.q[0];
        let a30: T = Scalar::exp(a29);
        let a31: T = Scalar::exp_m1(x.q[1]);
        let a32: T = a30 * a31;
        let a34: T = x.q[0] + 3.0;
        let a37: T = x.q[0] * x.q[0];
        let a43: T = x.q[1] + 3.0;
        let a49: T = x.q[1] + 2.0;
        let a57: T = asinh(x.q[0]);
        let a58: T = atanh(x.q[1]);
        let a62: T = x.q[0] - x.q[1];
        let a64: T = Scalar::signum(x.q[0]);
        let a68: T = Scalar::min(x.q[0], x.q[1]);
        let a69: T = Scalar::min(a68, T::from(0.1));
        let a70: T = x.q[1] * 2.0;
        let a71: T = Scalar::max(x.q[0], a70);
        let a77: T = -x.q[1] + 1.0;
        let a78: T = hypot(x.q[0], a77);
        let a83: f64 = Scalar::sin(self.type_);
        let a85: f64 = self.type_ * self.type_;
        let a86: f64 = a85 + 1.0;
        let a96: T = Scalar::cos(x.q[0]);
        let a97: T = a96 + 2.0;
        let a99: T = x.v[0] * x.v[0];
        let a104: T = x.q[0] * x.z;
        let a105: T = x.v[1] - a104;
        let a115: T = a104 - x.v[1];
        let a116: T = x.z * a115;
        let a117: T = x.q[0] * a115;
        let a120: T = a97 * x.v[0];
        let a123: T = a1 * a99;
        let a126: T = a123 * (-0.5);
        let a128: T = a116 + a126;
        let a130: T = Scalar::recip(a49);
        let a131: f64 = -a86;
        let a132: T = a130 * a131;
        let a133: T = a130 * a132;
        let a134: T = a128 + a83;
        let a135: T = Scalar::if_less(x.q[0], x.q[1], T::from(1.0), T::from(0.0));
        let a136: T = a134 + a135;
        let a138: T = Scalar::if_less(x.q[0], x.q[1], T::from(0.0), T::from(-1.0));
        let a139: T = a138 + (-1.0);
        let a140: T = Scalar::recip(a78);
        let a141: T = x.q[0] * a140;
        let a142: T = a136 + a141;
        let a143: T = a77 * a140;
        let a145: T = a139 - a143;
        let a146: T = x.q[1] * x.q[1];
        let a147: T = a37 + a146;
        let a148: T = Scalar::recip(a147);
        let a149: T = x.q[1] * a148;
        let a150: T = a142 + a149;
        let a151: T = x.q[0] * a148;
        let a153: T = a145 - a151;
        let a156: T = Scalar::if_less(x.q[0], a70, T::from(0.0), a69);
        let a157: T = a150 + a156;
        let a158: T = a69 * 2.0;
        let a159: T = Scalar::if_less(x.q[0], a70, a158, T::from(0.0));
        let a160: T = a153 + a159;
        let a164: T = Scalar::if_less(T::from(0.1), a68, T::from(0.0), a71);
        let a165: T = Scalar::if_less(x.q[1], x.q[0], a164, T::from(0.0));
        let a166: T = a160 + a165;
        let a168: T = Scalar::if_less(x.q[1], x.q[0], T::from(0.0), a164);
        let a169: T = a157 + a168;
        let a170: T = a64 + a166;
        let a171: T = Scalar::signum(a62);
        let a172: T = a169 + a171;
        let a174: T = a170 - a171;
        let a175: T = a17 + (-1.0);
        let a176: T = a17 + 1.0;
        let a177: T = Scalar::sqrt(a175);
        let a178: T = Scalar::sqrt(a176);
        let a179: T = a177 * a178;
        let a180: T = Scalar::recip(a179);
        let a181: T = x.q[1] + 1.0;
        let a182: T = a77 * a181;
        let a183: T = Scalar::recip(a182);
        let a184: T = a57 * a183;
        let a185: T = a174 + a184;
        let a186: T = hypot(x.q[0], T::from(1.0));
        let a187: T = Scalar::recip(a186);
        let a188: T = a58 * a187;
        let a189: T = a172 + a188;
        let a190: T = Scalar::powi(x.q[0], 6);
        let a191: T = a190 * 7.0;
        let a192: T = a189 + a191;
        let a193: T = Scalar::powi(a49, -6);
        let a194: T = a193 * (-5.0);
        let a195: T = a133 + a194;
        let a196: T = a185 + a195;
        let a199: T = a37 * (-3.0);
        let a200: T = a192 + a199;
        let a201: f64 = self.type_ + (-1.0);
        let a202: T = Scalar::powf(a43, a201);
        let a203: f64 = Scalar::abs(self.type_);
        let a204: T = Scalar::if_less(T::from(0.0), T::from(a203), a202, T::from(0.0));
        let a205: T = a204 * self.type_;
        let a206: T = a196 + a205;
        let a208: T = Scalar::powf(a17, -0.7);
        let a209: T = a208 * 0.3;
        let a210: T = a180 + a209;
        let a211: T = a37 + 1.0;
        let a212: T = Scalar::recip(a211);
        let a214: T = x.q[0] * a212;
        let a217: T = a214 * (-2.0);
        let a218: T = a200 + a217;
        let a219: T = Scalar::recip(a34);
        let a220: T = a218 + a219;
        let a221: T = a31 + 1.0;
        let a222: T = a30 * a221;
        let a223: T = a206 + a222;
        let a225: T = a220 - a32;
        let a226: T = Scalar::recip(a28);
        let a228: T = x.q[1] * a226;
        let a229: T = a228 * 0.5;
        let a230: T = a225 + a229;
        let a231: T = x.q[0] * a226;
        let a232: T = a231 * 0.5;
        let a233: T = a223 + a232;
        let a234: T = a23 * a23;
        let a236: T = a230 + a234;
        let a237: T = Scalar::recip(a18);
        let a240: T = a16 * a237;
        let a242: T = a237 * a240;
        let a243: T = a18 * a18;
        let a244: T = -a243 + 1.0;
        let a245: T = a242 * a244;
        let a246: T = a210 + a245;
        let a247: T = a236 + a246;
        let a248: T = Scalar::sinh(x.q[1]);
        let a249: T = a237 * a248;
        let a251: T = a233 - a249;
        let a252: T = Scalar::cosh(x.q[0]);
        let a253: T = a247 + a252;
        let a254: T = a146 + 1.0;
        let a255: T = Scalar::recip(a254);
        let a256: T = a251 + a255;
        let a257: T = Scalar::sin(x.q[1]);
        let a258: T = a256 + a257;
        let a259: T = a8 * a8;
        let a260: T = a259 + 1.0;
        let a261: T = a260 * 0.5;
        let a262: T = a253 + a261;
        let a264: T = a1 * a257;
        let a266: T = a258 - a264;
        let a267: T = a3 * a96;
        let a268: T = a262 + a267;
        let (l_q, l_v) = (SVector::from([a268, a266]), SVector::from([a120, a105]));
        Some(ChartVector { x: l_q, y: l_v, z: a117 })
    }

    fn structure(&self) -> Structure {
        Structure {
            ..Structure::default()
        }
    }
}

/// The angle of the point `(x, y)`, in `[-pi, pi]`.
#[inline(always)]
fn atan2<T: Scalar>(y: T, x: T) -> T {
    use std::f64::consts::{FRAC_PI_2, PI};
    let (zero, size_x, size_y) = (T::zero(), Scalar::abs(x), Scalar::abs(y));
    let steep = |then: T, otherwise: T| size_x.if_less(size_y, then, otherwise);
    let angle = (steep(-x, y) / steep(y, x)).atan();
    let quarter = y.if_less(zero, T::from(-FRAC_PI_2), T::from(FRAC_PI_2));
    let half = x.if_less(zero, y.if_less(zero, T::from(-PI), T::from(PI)), zero);
    angle + steep(quarter, half)
}

/// `sqrt(x^2 + y^2)` without overflow.
#[inline(always)]
fn hypot<T: Scalar>(x: T, y: T) -> T {
    let (x, y) = (Scalar::abs(x), Scalar::abs(y));
    let (large, small) = (Scalar::max(x, y), Scalar::min(y, x));
    let ratio = small / large;
    let length = large * (ratio * ratio + 1.0).sqrt();
    T::zero().if_less(large, length, large)
}

/// The inverse of the hyperbolic sine.
#[inline(always)]
fn asinh<T: Scalar>(x: T) -> T {
    let size = x.if_less(T::zero(), -x, x);
    let value = (size + size * (size / (hypot(size, T::one()) + 1.0))).ln_1p();
    x.if_less(T::zero(), -value, value)
}

/// The inverse of the hyperbolic cosine.
#[inline(always)]
fn acosh<T: Scalar>(x: T) -> T {
    let above = x - 1.0;
    (above + above.sqrt() * (x + 1.0).sqrt()).ln_1p()
}

/// The inverse of the hyperbolic tangent.
#[inline(always)]
fn atanh<T: Scalar>(x: T) -> T {
    let size = x.if_less(T::zero(), -x, x);
    let value = (size * 2.0 / (-size + 1.0)).ln_1p() * 0.5;
    x.if_less(T::zero(), -value, value)
}
