//! Sine and cosine of numbers that lie in vector registers.

use std::ops::{Add, Mul, Sub};

/// The arguments below which sine and cosine are reduced by three parts of pi: the half turns then have at most 19 binary digits.
pub(crate) const REDUCIBLE: f64 = 5e5;

/// 1.5 * 2^52: a number of a smaller size added to it is rounded to an integer, whose last digit is the last of the sum's.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// pi to 107 binary digits. With fused products the first difference is exact: a multiple of the last digits of both, and below 2.
const PI: [f64; 2] = [std::f64::consts::PI, f64::from_bits(0x3ca1_a626_3314_5c07)];

/// pi to 140 binary digits: 33, 33 and the rest. The products of the first two with the turns are exact without fusing.
const PI_IN_PARTS: [f64; 3] = [
    f64::from_bits(0x4009_21fb_5440_0000),
    f64::from_bits(0x3de0_b461_1a60_0000),
    f64::from_bits(0x3bb3_198a_2e03_7073),
];

/// The polynomial of degree 7 in `r^2` nearest to `(sin r / r - 1) / r^2` for `|r| <= pi/2` (Remez): it is off by 3.4e-19 of the sine, with its
/// coefficients rounded by 3.6e-17, a third of the rounding of the sine itself. The Taylor series needs eleven terms.
const SINE: [f64; 8] = [
    2.731428986122616e-15,
    -7.643969031052769e-13,
    1.605_897_727_281_550_6e-10,
    -2.505_210_761_638_459_5e-8,
    2.755731921915843e-6,
    -1.984_126_984_125_495_5e-4,
    8.333333333333316e-3,
    -0.166_666_666_666_666_66,
];

/// What the functions of this module ask of registers.
pub(crate) trait Register: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Whether [`mul_add`](Self::mul_add) rounds once for certain.
    const FUSED: bool;
    /// A constant in all lanes.
    fn splat(x: f64) -> Self;
    /// `self b + c`.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// With the other sign in the lanes in which the last binary digit of `of` is 1.
    fn turned(self, of: Self) -> Self;
}

/// `sin x` for `|x|` below [`REDUCIBLE`], within 2 units in the last place and `1e-33 |x|`, which two parts of pi leave out.
#[inline(always)]
pub(crate) fn sine<R: Register>(x: R) -> R {
    let rounded = x.mul_add(R::splat(std::f64::consts::FRAC_1_PI), R::splat(ROUNDING));
    reduced(x, rounded - R::splat(ROUNDING), rounded)
}

/// `cos x = sin(x + pi/2)`, the quarter turn put among the turns.
#[inline(always)]
pub(crate) fn cosine<R: Register>(x: R) -> R {
    // The half is added before it is rounded to an integer.
    let half = x.mul_add(R::splat(std::f64::consts::FRAC_1_PI), R::splat(0.5));
    let rounded = half + R::splat(ROUNDING);
    reduced(x, (rounded - R::splat(ROUNDING)) - R::splat(0.5), rounded)
}

/// `(-1)^k sin(x - turns pi)` where the last binary digit of `rounded` is that of k.
#[inline(always)]
fn reduced<R: Register>(x: R, turns: R, rounded: R) -> R {
    let part = |r: R, part: f64| turns.mul_add(R::splat(-part), r);
    let r = if const { R::FUSED } { PI.into_iter().fold(x, part) } else { PI_IN_PARTS.into_iter().fold(x, part) };
    let y = r * r;
    let mut sum = R::splat(SINE[0]);
    for c in &SINE[1..] {
        sum = sum.mul_add(y, R::splat(*c));
    }
    (y * r).mul_add(sum, r).turned(rounded)
}
