//! Exponential and hyperbolic functions in SIMD registers.

use crate::numbers::functions::{LN_2, ROUNDING, Register, polynomial};

/// The bound on the arguments of [`exponential`]: beyond it powers of 2 are not normal numbers.
pub(crate) const EXPONENT_RANGE: f64 = 708.0;

/// The minimax polynomial (Remez) of degree 10 for `(e^r - 1 - r) / r^2` on `|r| <= ln(2)/2`. The relative error of
/// `e^r` is 5e-20.
const EXPONENTIAL: [f64; 11] = [
    2.082_660_132_060_744_6e-9,
    2.511208452775258e-8,
    2.755_758_221_943_443_7e-7,
    2.755_723_472_773_942_2e-6,
    2.480_158_692_579_467_3e-5,
    1.984_126_989_651_523_6e-4,
    1.388_888_888_911_632e-3,
    8.333_333_333_316_982e-3,
    4.166_666_666_666_609_5e-2,
    0.166_666_666_666_666_82,
    0.5,
];

/// The k with `x = k ln 2 + r`, as the sum of [`ROUNDING`] and k, and `e^(r + low) - 1`.
#[inline(always)]
fn reduced<R: Register>(x: R, low: R) -> (R, R) {
    let rounded = x.mul_add(R::splat(std::f64::consts::LOG2_E), R::splat(ROUNDING));
    let k = rounded - R::splat(ROUNDING);
    let r = k.mul_add(R::splat(-LN_2[1]), k.mul_add(R::splat(-LN_2[0]), x)) + low;
    (rounded, (r * r).mul_add(polynomial(r, &EXPONENTIAL), r))
}

/// `2^k` for the k in the last binary digits of the sum of [`ROUNDING`] and k.
#[inline(always)]
fn power_of_two<R: Register>(rounded: R) -> R {
    rounded.map_digits(
        #[inline(always)]
        |digits| digits.wrapping_add(1023) << 52,
    )
}

/// `e^(x + low)` for a sum of this size below [`EXPONENT_RANGE`] and a small `low`, to one unit in the last place.
#[inline(always)]
pub(crate) fn exponential<R: Register>(x: R, low: R) -> R {
    let (rounded, e) = reduced(x, low);
    // A product: with a sum of exponents a NaN would become a number.
    (e + R::splat(1.0)) * power_of_two(rounded)
}

/// `e^x - 1` for `|x|` below [`EXPONENT_RANGE`], to 2 units in the last place.
#[inline(always)]
pub(crate) fn exponential_minus_one<R: Register>(x: R) -> R {
    let (rounded, e) = reduced(x, R::splat(0.0));
    let scale = power_of_two(rounded);
    e.mul_add(scale, scale - R::splat(1.0))
}

/// `sinh x` for `|x|` below [`EXPONENT_RANGE`], to 4 units in the last place: `(e + e / (1 + e)) / 2` with `e = e^|x| - 1`.
#[inline(always)]
pub(crate) fn hyperbolic_sine<R: Register>(x: R) -> R {
    let is_negative = |positive: R| x.where_less(R::splat(0.0), -positive, positive);
    let e = exponential_minus_one(is_negative(x));
    is_negative((e + e / (e + R::splat(1.0))) * R::splat(0.5))
}

/// `tanh x`, to 4 units in the last place: `e / (e + 2)` with `e = e^(2x) - 1`. From 20 on it is 1.
#[inline(always)]
pub(crate) fn hyperbolic_tangent<R: Register>(x: R) -> R {
    let most = R::splat(20.0);
    let x = most.where_less(x, most, x.where_less(-most, -most, x));
    let e = exponential_minus_one(x + x);
    e / (e + R::splat(2.0))
}
