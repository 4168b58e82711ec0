//! Functions of the numbers in SIMD registers.

mod exponential;
mod logarithm;
mod sine;
#[cfg(test)]
mod tests;

pub(crate) use exponential::{EXPONENT_RANGE, exponential, exponential_minus_one, hyperbolic_sine, hyperbolic_tangent};
pub(crate) use logarithm::{logarithm, power};
pub(crate) use sine::{REDUCIBLE, cosine, sine};

use std::ops::{Add, Div, Mul, Neg, Sub};

/// 1.5 * 2^52: adding it rounds a smaller number to an integer, whose last binary digits are those of the sum.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// ln 2 in two parts. The first has 33 binary digits: its product with an exponent is exact.
const LN_2: [f64; 2] = [f64::from_bits(0x3fe6_2e42_fee0_0000), f64::from_bits(0x3dea_39ef_3579_3c76)];

/// The operations on registers that the functions of this module use.
pub(crate) trait Register:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Whether [`mul_add`](Self::mul_add) is fused, with a single rounding.
    const FUSED: bool;
    /// A constant in all lanes.
    fn splat(x: f64) -> Self;
    /// `self b + c`.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self` with its sign changed in the lanes in which the last binary digit of `of` is 1.
    fn turned(self, of: Self) -> Self;
    /// `then` in the lanes with `self < b`, `otherwise` in all others, including those with a NaN.
    fn where_less(self, b: Self, then: Self, otherwise: Self) -> Self;
    /// The numbers whose binary digits are a function of those of `self`.
    fn map_digits(self, of: impl Fn(u64) -> u64) -> Self;
}

/// The polynomial with these coefficients, that of the highest power first. With fused multiply-add its even and its odd
/// part are summed side by side, in half the time of one sum, which has fewer roundings.
#[inline(always)]
fn polynomial<R: Register, const TERMS: usize>(x: R, coefficients: &[f64; TERMS]) -> R {
    if const { !R::FUSED } {
        let mut sum = R::splat(coefficients[0]);
        for c in &coefficients[1..] {
            sum = sum.mul_add(x, R::splat(*c));
        }
        return sum;
    }
    let (y, mut sums, mut k) = (x * x, [R::splat(coefficients[0]), R::splat(coefficients[1])], 2);
    while k < TERMS {
        sums[k % 2] = sums[k % 2].mul_add(y, R::splat(coefficients[k]));
        k += 1;
    }
    let [last, before] = [sums[(TERMS - 1) % 2], sums[TERMS % 2]];
    before.mul_add(x, last)
}
