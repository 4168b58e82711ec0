//! Logarithms and powers in SIMD registers.

use crate::numbers::functions::{LN_2, Register, exponential, polynomial};

/// The minimax polynomial (Remez) of degree 7 in `s^2` for `(2 artanh(s) / s - 2) / s^2`, where `s = f / (2 + f)` and
/// `1 + f` is between `1/sqrt 2` and `sqrt 2`. The relative error of the logarithm is 8e-21.
const LOGARITHM: [f64; 8] = [
    0.1325152224381862,
    0.132_501_000_753_502_68,
    0.153_870_913_995_416_66,
    0.181_817_756_549_571_86,
    0.222_222_226_468_692_72,
    0.285_714_285_690_858_6,
    0.400_000_000_000_062_5,
    0.666_666_666_666_666_6,
];

/// The binary digits of `1/sqrt 2`.
const ROOT_OF_HALF: u64 = 0x3fe6_a09e_667f_3bcd;

/// The digits of a number, shifted so that its exponent is that of the power `2^k` with `x = 2^k (1 + f)`.
#[inline(always)]
fn shifted(digits: u64) -> u64 {
    digits.wrapping_add(0x3ff0_0000_0000_0000 - ROOT_OF_HALF)
}

/// k and f with `x = 2^k (1 + f)` for positive normal numbers, and f = NaN for a NaN.
#[inline(always)]
fn reduced<R: Register>(x: R) -> [R; 2] {
    // 2^52 plus the exponent, which is 1023 for k = 0.
    let exponent = x.map_digits(
        #[inline(always)]
        |digits| shifted(digits) >> 52 | 0x4330_0000_0000_0000,
    );
    let significand = x.map_digits(
        #[inline(always)]
        |digits| (shifted(digits) & 0x000f_ffff_ffff_ffff) + ROOT_OF_HALF,
    );
    // The product is 0 but for a NaN.
    [exponent - R::splat(4_503_599_627_370_496.0 + 1023.0), significand - R::splat(1.0) + x * R::splat(0.0)]
}

/// `ln x` of positive normal numbers, to one unit in the last place: `f - f^2/2 + s (f^2/2 + s^2 R(s^2)) + k ln 2`, with R
/// from [`LOGARITHM`].
#[inline(always)]
pub(crate) fn logarithm<R: Register>(x: R) -> R {
    let [k, f] = reduced(x);
    let s = f / (f + R::splat(2.0));
    let (y, half) = (s * s, f * f * R::splat(0.5));
    let low = s.mul_add(y.mul_add(polynomial(y, &LOGARITHM), half), k * R::splat(LN_2[1]));
    k.mul_add(R::splat(LN_2[0]), f - (half - low))
}

/// The logarithm as the sum of two numbers, with an error of a hundredth of a unit in the last place of the first; with
/// fused multiply-add only.
#[inline(always)]
fn logarithm_in_parts<R: Register>(x: R) -> [R; 2] {
    let [k, f] = reduced(x);
    let sum = f + R::splat(2.0);
    // s = f / (2 + f), and the remainder of the division.
    let s = f / sum;
    let of_sum = f - (sum - R::splat(2.0));
    let of_s = ((-s).mul_add(sum, f) - s * of_sum) / sum;
    let y = s * s;
    let cubic = s * y * polynomial(y, &LOGARITHM);
    let twice = s + s;
    let high = twice + cubic;
    let low = (twice - high) + cubic + (of_s + of_s);
    let of_k = k * R::splat(LN_2[0]);
    let total = of_k + high;
    [total, (of_k - total) + high + k.mul_add(R::splat(LN_2[1]), low)]
}

/// `x^a` for positive normal numbers, with `|a ln x|` below [`EXPONENT_RANGE`](super::EXPONENT_RANGE): to one unit in the
/// last place and a hundredth of one times `|a ln x|`; with fused multiply-add only. The logarithm of the power comes
/// second.
#[inline(always)]
pub(crate) fn power<R: Register>(x: R, a: f64) -> [R; 2] {
    let a = R::splat(a);
    let [high, low] = logarithm_in_parts(x);
    let product = high * a;
    [exponential(product, low.mul_add(a, high.mul_add(a, -product))), product]
}
