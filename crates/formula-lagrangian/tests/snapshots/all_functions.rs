//! A Lagrangian of the coordinates x, y, made from its formula by formula-lagrangian.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure, Triple, VelocityPoint};

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
        let a57: T = q[0] - q[1];
        let a58: T = Scalar::abs(a57);
        let a59: T = Scalar::signum(q[0]);
        let a60: T = q[1] * a59;
        let a61: T = a58 + a60;
        let a63: T = Scalar::min(q[0], q[1]);
        let a64: T = Scalar::min(a63, T::from(0.1));
        let a65: T = q[1] * 2.0;
        let a66: T = Scalar::max(q[0], a65);
        let a67: T = a64 * a66;
        let a68: T = a61 + a67;
        let a69: T = atan2(q[0], q[1]);
        let a70: T = a68 + a69;
        let a72: T = -q[1] + 1.0;
        let a73: T = hypot(q[0], a72);
        let a74: T = a70 + a73;
        let a75: T = -q[1] + 2.0;
        let a76: T = Scalar::if_less(q[0], q[1], q[0], a75);
        let a77: T = a74 + a76;
        let a78: f64 = Scalar::sin(self.type_);
        let a79: T = q[0] * a78;
        let a80: f64 = self.type_ * self.type_;
        let a81: f64 = a80 + 1.0;
        let a82: T = T::from(a81) / a49;
        let a83: T = a79 + a82;
        let a84: T = -q[1] + self.type_;
        let a85: T = a83 + a84;
        let a87: T = t * self.type_;
        let a88: f64 = hypot(self.type_, 2.0);
        let a89: T = a87 * a88;
        let a90: T = a85 + a89;
        let a91: T = Scalar::cos(q[0]);
        let a92: T = a91 + 2.0;
        let a94: T = v[0] * v[0];
        let a95: T = a92 * a94;
        let a96: T = a95 * 0.5;
        let a99: T = q[0] * z;
        let a100: T = v[1] - a99;
        let a101: T = a100 * a100;
        let a102: T = a101 * 0.5;
        let a103: T = a96 + a102;
        let a104: T = a24 + a103;
        let a105: T = a56 + a104;
        let a106: T = a77 + a105;
        let a107: T = a90 + a106;
        a107
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<2, T>) -> Option<Triple<2, T>> {
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
        let a57: T = x.q[0] - x.q[1];
        let a59: T = Scalar::signum(x.q[0]);
        let a63: T = Scalar::min(x.q[0], x.q[1]);
        let a64: T = Scalar::min(a63, T::from(0.1));
        let a65: T = x.q[1] * 2.0;
        let a66: T = Scalar::max(x.q[0], a65);
        let a72: T = -x.q[1] + 1.0;
        let a73: T = hypot(x.q[0], a72);
        let a78: f64 = Scalar::sin(self.type_);
        let a80: f64 = self.type_ * self.type_;
        let a81: f64 = a80 + 1.0;
        let a91: T = Scalar::cos(x.q[0]);
        let a92: T = a91 + 2.0;
        let a94: T = x.v[0] * x.v[0];
        let a99: T = x.q[0] * x.z;
        let a100: T = x.v[1] - a99;
        let a109: T = a99 - x.v[1];
        let a110: T = x.z * a109;
        let a111: T = x.q[0] * a109;
        let a114: T = a92 * x.v[0];
        let a117: T = a1 * a94;
        let a120: T = a117 * (-0.5);
        let a121: T = a110 + a120;
        let a123: T = Scalar::recip(a49);
        let a124: f64 = -a81;
        let a125: T = a123 * a124;
        let a126: T = a123 * a125;
        let a127: T = a121 + a78;
        let a129: T = Scalar::if_less(x.q[0], x.q[1], T::from(1.0), T::from(0.0));
        let a130: T = a127 + a129;
        let a131: T = Scalar::if_less(x.q[0], x.q[1], T::from(0.0), T::from(1.0));
        let a133: T = -a131 + (-1.0);
        let a134: T = Scalar::recip(a73);
        let a135: T = x.q[0] * a134;
        let a136: T = a130 + a135;
        let a137: T = a72 * a134;
        let a139: T = a133 - a137;
        let a140: T = x.q[1] * x.q[1];
        let a141: T = a37 + a140;
        let a142: T = Scalar::recip(a141);
        let a143: T = x.q[1] * a142;
        let a144: T = a136 + a143;
        let a145: T = x.q[0] * a142;
        let a147: T = a139 - a145;
        let a148: T = Scalar::if_less(x.q[0], a65, T::from(0.0), a64);
        let a149: T = a144 + a148;
        let a150: T = Scalar::if_less(x.q[0], a65, a64, T::from(0.0));
        let a151: T = a150 * 2.0;
        let a152: T = a147 + a151;
        let a153: T = Scalar::if_less(T::from(0.1), a63, T::from(0.0), a66);
        let a155: T = Scalar::if_less(x.q[1], x.q[0], T::from(0.0), a153);
        let a156: T = a149 + a155;
        let a157: T = Scalar::if_less(x.q[1], x.q[0], a153, T::from(0.0));
        let a158: T = a152 + a157;
        let a159: T = a59 + a158;
        let a160: T = Scalar::signum(a57);
        let a161: T = a156 + a160;
        let a163: T = a159 - a160;
        let a164: T = Scalar::powi(x.q[0], 6);
        let a165: T = a164 * 7.0;
        let a166: T = a161 + a165;
        let a167: T = Scalar::powi(a49, -6);
        let a168: T = a167 * (-5.0);
        let a169: T = a126 + a168;
        let a170: T = a163 + a169;
        let a173: T = a37 * (-3.0);
        let a174: T = a166 + a173;
        let a175: f64 = self.type_ + (-1.0);
        let a176: T = Scalar::powf(a43, a175);
        let a177: T = a176 * self.type_;
        let a178: T = a170 + a177;
        let a180: T = Scalar::powf(a17, -0.7);
        let a181: T = a180 * 0.3;
        let a182: T = a37 + 1.0;
        let a183: T = Scalar::recip(a182);
        let a185: T = x.q[0] * a183;
        let a188: T = a185 * (-2.0);
        let a189: T = a174 + a188;
        let a190: T = Scalar::recip(a34);
        let a191: T = a189 + a190;
        let a192: T = a31 + 1.0;
        let a193: T = a30 * a192;
        let a194: T = a178 + a193;
        let a196: T = a191 - a32;
        let a197: T = Scalar::recip(a28);
        let a199: T = x.q[1] * a197;
        let a200: T = a199 * 0.5;
        let a201: T = a196 + a200;
        let a202: T = x.q[0] * a197;
        let a203: T = a202 * 0.5;
        let a204: T = a194 + a203;
        let a205: T = a23 * a23;
        let a207: T = a201 + a205;
        let a208: T = Scalar::recip(a18);
        let a211: T = a16 * a208;
        let a213: T = a208 * a211;
        let a214: T = a18 * a18;
        let a215: T = -a214 + 1.0;
        let a216: T = a213 * a215;
        let a217: T = a181 + a216;
        let a218: T = a207 + a217;
        let a219: T = Scalar::sinh(x.q[1]);
        let a220: T = a208 * a219;
        let a222: T = a204 - a220;
        let a223: T = Scalar::cosh(x.q[0]);
        let a224: T = a218 + a223;
        let a225: T = a140 + 1.0;
        let a226: T = Scalar::recip(a225);
        let a227: T = a222 + a226;
        let a228: T = Scalar::sin(x.q[1]);
        let a229: T = a227 + a228;
        let a230: T = a8 * a8;
        let a231: T = a230 + 1.0;
        let a232: T = a231 * 0.5;
        let a233: T = a224 + a232;
        let a235: T = a1 * a228;
        let a237: T = a229 - a235;
        let a238: T = a3 * a91;
        let a239: T = a233 + a238;
        let (l_q, l_v) = (SVector::from([a239, a237]), SVector::from([a114, a100]));
        Some(Triple { x: l_q, y: l_v, z: a111 })
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
