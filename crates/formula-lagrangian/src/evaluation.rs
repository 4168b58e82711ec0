//! A tape at work on numbers of any kind.

use crate::functions::{atan2, hypot};
use crate::tape::{Code, Instruction, Tape};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The registers that lie on the stack, in three sizes; a tape that needs more has them on the heap.
const SMALL: usize = 8;
const MIDDLE: usize = 32;
const LARGE: usize = 256;

/// The point at which a tape is evaluated.
#[derive(Clone, Copy)]
pub(crate) struct At<'a, T> {
    pub q: &'a [T],
    pub v: &'a [T],
    pub z: T,
    pub t: T,
}

impl<'a, T: Scalar> At<'a, T> {
    #[inline(always)]
    pub fn new<const N: usize>(t: T, q: &'a SVector<T, N>, v: &'a SVector<T, N>, z: T) -> Self {
        At { q: q.as_slice(), v: v.as_slice(), z, t }
    }
}

impl Tape {
    /// Evaluates it and writes the results to slices, one after the other.
    #[inline(always)]
    pub fn evaluate<T: Scalar>(&self, at: At<'_, T>, results: &mut [&mut [T]]) {
        T::apart(|| self.evaluate_here(at, results));
    }

    #[inline(always)]
    fn evaluate_here<T: Scalar>(&self, at: At<'_, T>, results: &mut [&mut [T]]) {
        let zero = T::zero();
        let (mut small, mut middle, mut large, mut heap);
        let registers: &mut [T] = if self.registers <= SMALL {
            small = [zero; SMALL];
            &mut small
        } else if self.registers <= MIDDLE {
            middle = [zero; MIDDLE];
            &mut middle
        } else if self.registers <= LARGE {
            large = [zero; LARGE];
            &mut large
        } else {
            heap = vec![zero; self.registers];
            &mut heap
        };
        // Plain loops: chained iterators, and copies of slices, cost more than all the work of a short tape.
        let mut next = 0;
        let mut put = |x: T| {
            if let Some(register) = registers.get_mut(next) {
                *register = x;
            }
            next += 1;
        };
        for x in at.q {
            put(*x);
        }
        for x in at.v {
            put(*x);
        }
        put(at.z);
        put(at.t);
        for instruction in &self.code {
            self.perform(*instruction, registers);
        }
        let mut next = 0;
        for part in results.iter_mut() {
            for result in part.iter_mut() {
                let place = self.results.get(next).map(|place| usize::from(*place));
                if let Some(value) = place.and_then(|place| registers.get(place)) {
                    *result = *value;
                }
                next += 1;
            }
        }
    }

    /// One instruction.
    #[inline(always)]
    fn perform<T: Scalar>(&self, instruction: Instruction, registers: &mut [T]) {
        let Instruction { code, to, a, b, c, d } = instruction;
        // Indices are right by construction; what is not there would be not a number.
        let r = |i: u16| registers.get(usize::from(i)).copied().unwrap_or_else(nothing);
        let k = || self.constants.get(usize::from(b)).copied().unwrap_or(f64::NAN);
        let value = match code {
            Code::Add => r(a) + r(b),
            Code::Sub => r(a) - r(b),
            Code::Mul => r(a) * r(b),
            Code::Div => r(a) / r(b),
            Code::MulAdd => r(a) * r(b) + r(c),
            Code::AddConstant => r(a) + k(),
            Code::ConstantSub => -r(a) + k(),
            Code::MulConstant => r(a) * k(),
            Code::DivConstant => r(a) / k(),
            Code::ConstantDiv => T::from(k()) / r(a),
            Code::MulConstantAdd => r(a) * k() + r(c),
            Code::Function(function) => function.value(r(a)),
            Code::Min => Scalar::min(r(a), r(b)),
            Code::Max => Scalar::max(r(a), r(b)),
            Code::Atan2 => atan2(r(a), r(b)),
            Code::Hypot => hypot(r(a), r(b)),
            Code::Power => power(r(a), k()),
            Code::Powi => r(a).powi((i32::from(c) << 16) | i32::from(b)),
            Code::Select => r(a).if_less(r(b), r(c), r(d)),
            Code::Constant => T::from(k()),
        };
        if let Some(register) = registers.get_mut(usize::from(to)) {
            *register = value;
        }
    }
}

#[cold]
fn nothing<T: Scalar>() -> T {
    T::from(f64::NAN)
}

/// `x^a`; a parameter may be an integer, with which the power of a negative number is defined.
#[inline(always)]
fn power<T: Scalar>(x: T, a: f64) -> T {
    if a.fract() == 0.0 && a.abs() <= 1e9 { x.powi(a as i32) } else { x.powf(a) }
}
