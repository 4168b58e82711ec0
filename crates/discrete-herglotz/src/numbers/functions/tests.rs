//! The functions in registers are those of one number.

use crate::numbers::lanes::Lanes;
use crate::numbers::simd_batch::SimdBatch;
use contact_geom::Scalar;
use pulp::{Simd, WithSimd};

/// The exponents of the powers.
const POWERS: [f64; 6] = [-2.0 / 3.0, 1.5, -3.5, 0.1, 25.3, 3.0];

/// Sine and cosine; exponential functions; the logarithm; powers.
fn all<T: Scalar>(x: T) -> [T; 14] {
    let (sin, cos) = x.sin_cos();
    let [a, b, c, d, e, f] = POWERS.map(|a| x.powf(a));
    [sin, cos, x.exp(), x.exp_m1(), x.sinh(), x.cosh(), x.tanh(), x.ln(), a, b, c, d, e, f]
}

/// Evaluates all functions in SIMD lanes: of registers where `batch` is false, of batches otherwise.
struct Evaluate<'a> {
    arguments: &'a [f64],
    batch: bool,
}

impl WithSimd for Evaluate<'_> {
    type Output = Vec<[f64; 14]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let (mut out, n) = (Vec::new(), S::F64_LANES);
        for x in self.arguments.chunks_exact(n) {
            if self.batch {
                let values = all(SimdBatch::<S, 1>::from_lanes(|i| x[i]));
                out.extend((0..n).map(|i| values.map(|y| y.lanes()[i])));
            } else {
                let values = all(Lanes::<S>(S::as_simd_f64s(x).0[0]));
                out.extend((0..n).map(|i| values.map(|y| y.lanes()[i])));
            }
        }
        out
    }
}

/// The values of all functions at the arguments, in each instruction set of the processor.
fn in_all_sets(arguments: &[f64], batch: bool) -> Vec<Vec<[f64; 14]>> {
    let evaluate = || Evaluate { arguments, batch };
    let mut sets = vec![pulp::Scalar::new().vectorize(evaluate()), pulp::Arch::new().dispatch(evaluate())];
    #[cfg(target_arch = "x86_64")]
    {
        sets.extend(pulp::x86::V3::try_new().map(|set| Simd::vectorize(set, evaluate())));
        sets.extend(pulp::x86::V4::try_new().map(|set| Simd::vectorize(set, evaluate())));
    }
    sets
}

/// The distance of two values in units in the last place of the second.
fn units(found: f64, exact: f64) -> f64 {
    if found == exact || found.is_nan() && exact.is_nan() {
        return 0.0;
    }
    (found - exact).abs() / (exact.abs().next_up() - exact.abs())
}

/// The bound on the error of each function at an argument, in units in the last place, half of one of which is the error
/// of the standard library.
fn bounds(x: f64) -> [f64; 14] {
    let of_power = |a: f64| 1.5 + 0.01 * (a * x.abs().ln()).abs();
    let [a, b, c, d, e, f] = POWERS.map(of_power);
    // The sines also have the error of pi in two parts, 1e-33 |x|.
    let [of_sin, of_cos] = [x.sin(), x.cos()].map(|y| 2.0 + 1e-33 * x.abs() / (y.abs().next_up() - y.abs()));
    // Values at which the bound is not finite are exact.
    [of_sin, of_cos, 1.5, 2.5, 4.5, 3.0, 4.5, 1.5, a, b, c, d, e, f].map(|e| if e.is_finite() { e } else { 0.0 })
}

fn check(arguments: &[f64], batch: bool, is_outside: impl Fn(f64, usize) -> bool) {
    for set in in_all_sets(arguments, batch) {
        assert_eq!(set.len(), arguments.len());
        for (x, found) in arguments.iter().zip(set) {
            for (i, ((y, exact), bound)) in found.into_iter().zip(all(*x)).zip(bounds(*x)).enumerate() {
                if is_outside(*x, i) {
                    assert!(y.is_nan() || units(y, exact) <= bound, "function {i} of {x:e}: {y:e}, not {exact:e}");
                } else {
                    // Written so that a NaN is not within it.
                    let within = units(y, exact) <= bound;
                    assert!(within, "function {i} of {x:e}: {y:e}, not {exact:e}: {} units", units(y, exact));
                }
            }
        }
    }
}

/// Random arguments of all sizes, each beside its negative, and neighbours of multiples of pi/2, where the reduced
/// argument is smallest. Beyond the range of their reduction registers call the standard library; batches have a NaN
/// there.
#[test]
fn functions_in_registers_are_those_of_one_number() {
    let (mut arguments, mut random) = (Vec::new(), 0.5);
    for k in 0..40_000 {
        random = (random + 0.618_033_988_749_894_9f64).fract();
        let x = random * 10f64.powi(k % 24 - 16);
        let multiple = f64::from(k * 8) * std::f64::consts::FRAC_PI_2;
        let between = f64::from(k) * std::f64::consts::FRAC_PI_2;
        arguments.extend([x, -x, multiple, multiple.next_up(), -multiple, between, 1.0 + 0.1 * x, 700.0 * random]);
    }
    check(&arguments, false, |_, _| false);
    let is_outside = |x: f64, i: usize| match i {
        0 | 1 => x.abs() >= 5e5,
        6 => false,
        2..=5 => x.abs() >= 708.0,
        7 => x < f64::MIN_POSITIVE,
        _ => {
            POWERS[i - 8].fract() != 0.0
                && x != 0.0
                && (x < f64::MIN_POSITIVE || (POWERS[i - 8] * x.ln()).abs() >= 708.0)
        }
    };
    check(&arguments, true, is_outside);
}

/// Zeros, infinities, NaN, subnormal numbers, results that overflow or underflow, each among other numbers.
#[test]
fn special_values_in_registers_are_those_of_one_number() {
    let special = [0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e-310, -1e-310, f64::MIN_POSITIVE];
    let large = [f64::MAX, -f64::MAX, 709.0, 720.0, -746.0, -709.5, 1e-200, 1e200, -1.0, 1.0];
    let arguments: Vec<f64> = special
        .into_iter()
        .chain(large)
        .flat_map(|x| [[x; 8], [x, 0.7, 2.0, 3.0, x, 0.3, 1.0, 9.0]])
        .flatten()
        .collect();
    // A number that is the same in all lanes, and with others.
    check(&arguments, false, |_, _| false);
    check(&arguments, true, |x, i| x == 0.0 && i == 7 || ![0.0, 0.7, 2.0, 3.0, 0.3, 1.0, 9.0].contains(&x));
    for (x, found) in arguments.iter().zip(in_all_sets(&arguments, true).swap_remove(0)) {
        // Powers of 0 are frequent: they keep a trajectory in its batch. A logarithm of 0 does not.
        assert!(*x != 0.0 || found[9] == 0.0 && found[8] == f64::INFINITY, "{x:e}: {found:?}");
    }
}
