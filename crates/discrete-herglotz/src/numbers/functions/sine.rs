//! Sine and cosine in SIMD registers.

use crate::numbers::functions::{ROUNDING, Register, polynomial};

/// The bound on the arguments that are reduced modulo pi with pi in three parts: the number of half turns then has at
/// most 19 binary digits.
pub(crate) const REDUCIBLE: f64 = 5e5;

/// pi to 107 binary digits, for fused multiply-add. The first difference is then exact: it is a multiple of the last
/// digits of both terms, and below 2.
const PI: [f64; 2] = [std::f64::consts::PI, f64::from_bits(0x3ca1_a626_3314_5c07)];

/// pi to 140 binary digits, in parts of 33, 33 and the remaining digits. The products of the first two parts with the
/// number of half turns are exact without fused multiply-add.
const PI_IN_PARTS: [f64; 3] = [
    f64::from_bits(0x4009_21fb_5440_0000),
    f64::from_bits(0x3de0_b461_1a60_0000),
    f64::from_bits(0x3bb3_198a_2e03_7073),
];

/// The minimax polynomial (Remez) of degree 7 in `r^2` for `(sin r / r - 1) / r^2` on `|r| <= pi/2`. The relative error
/// of the sine is 3.4e-19, and 3.6e-17 with rounded coefficients, a third of the round-off of the sine itself. The
/// Taylor series needs eleven terms.
const SINE: [f64; 6] = [
    2.731428986122616e-15,
    -7.643969031052769e-13,
    1.605_897_727_281_550_6e-10,
    -2.505_210_761_638_459_5e-8,
    2.755731921915843e-6,
    -1.984_126_984_125_495_5e-4,
];

/// Its last two coefficients.
const SINE_END: [f64; 2] = [8.333333333333316e-3, -0.166_666_666_666_666_66];

/// `sin x` for `|x|` below [`REDUCIBLE`], to 2 units in the last place and `1e-33 |x|`, the error of pi in two parts.
#[inline(always)]
pub(crate) fn sine<R: Register>(x: R) -> R {
    let rounded = x.mul_add(R::splat(std::f64::consts::FRAC_1_PI), R::splat(ROUNDING));
    reduced(x, rounded - R::splat(ROUNDING), rounded)
}

/// `cos x = sin(x + pi/2)`, with the shift by pi/2 included in the number of half turns.
#[inline(always)]
pub(crate) fn cosine<R: Register>(x: R) -> R {
    // The half is added before the sum is rounded to an integer.
    let half = x.mul_add(R::splat(std::f64::consts::FRAC_1_PI), R::splat(0.5));
    let rounded = half + R::splat(ROUNDING);
    reduced(x, (rounded - R::splat(ROUNDING)) - R::splat(0.5), rounded)
}

/// `(-1)^k sin(x - turns pi)`, where k has the last binary digit of `rounded`.
#[inline(always)]
fn reduced<R: Register>(x: R, turns: R, rounded: R) -> R {
    let part = |r: R, part: f64| turns.mul_add(R::splat(-part), r);
    let r = if const { R::FUSED } { PI.into_iter().fold(x, part) } else { PI_IN_PARTS.into_iter().fold(x, part) };
    let y = r * r;
    // The largest terms are summed one after another, with the fewest roundings.
    let sum = SINE_END.into_iter().fold(polynomial(y, &SINE), |sum, c| sum.mul_add(y, R::splat(c)));
    (y * r).mul_add(sum, r).turned(rounded)
}
