//! A tape at work on numbers of any kind.

use crate::functions::{atan2, hypot};
use crate::node::Inputs;
use crate::tape::{Code, Instruction, PREVIOUS, Tape};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The numbers of registers that lie on the stack; a tape that needs more has them on the heap. Each is a power of two, so that an index
/// into them is made one by a mask, and no bound is checked.
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

/// Registers by their number.
trait Registers<T> {
    fn get(&self, register: u16) -> T;
    fn set(&mut self, register: u16, value: T);
}

impl<T: Copy, const R: usize> Registers<T> for [T; R] {
    #[inline(always)]
    fn get(&self, register: u16) -> T {
        const { assert!(R.is_power_of_two(), "a mask makes an index") };
        self[usize::from(register) & (R - 1)]
    }
    #[inline(always)]
    fn set(&mut self, register: u16, value: T) {
        self[usize::from(register) & (R - 1)] = value;
    }
}

/// Of any length; indices are right by construction, and what is not there would be not a number.
struct OnHeap<T>(Vec<T>);

impl<T: Scalar> Registers<T> for OnHeap<T> {
    #[inline(always)]
    fn get(&self, register: u16) -> T {
        self.0.get(usize::from(register)).copied().unwrap_or_else(|| T::from(f64::NAN))
    }
    #[inline(always)]
    fn set(&mut self, register: u16, value: T) {
        if let Some(place) = self.0.get_mut(usize::from(register)) {
            *place = value;
        }
    }
}

impl Tape {
    /// Evaluates it and writes the results to slices, one after the other.
    #[inline(always)]
    pub fn evaluate<T: Scalar>(&self, at: At<'_, T>, results: &mut [&mut [T]]) {
        // One copy of the code for each kind of dual numbers is enough: nothing that takes many steps evaluates them.
        if T::NESTED || self.registers > LARGE {
            T::apart(|| self.run(at, OnHeap(vec![T::zero(); self.registers]), results));
        } else if self.registers <= SMALL {
            T::apart(|| self.run(at, [T::zero(); SMALL], results));
        } else if self.registers <= MIDDLE {
            T::apart(|| self.run(at, [T::zero(); MIDDLE], results));
        } else {
            T::apart(|| self.run(at, [T::zero(); LARGE], results));
        }
    }

    #[inline(always)]
    fn run<T: Scalar>(&self, at: At<'_, T>, mut registers: impl Registers<T>, results: &mut [&mut [T]]) {
        // Plain loops: chained iterators, and copies of slices, cost more than all the work of a short tape.
        let n = at.q.len() as u16;
        for (x, i) in at.q.iter().zip(0..) {
            registers.set(i, *x);
        }
        if self.reads.meets(Inputs::VELOCITY) {
            for (x, i) in at.v.iter().zip(n..) {
                registers.set(i, *x);
            }
        }
        if self.reads.meets(Inputs::ACTION.and(Inputs::TIME)) {
            registers.set(2 * n, at.z);
            registers.set(2 * n + 1, at.t);
        }
        let mut previous = T::zero();
        for instruction in &self.code {
            previous = perform(instruction, &registers, previous);
            registers.set(instruction.to, previous);
        }
        let mut places = self.results.iter();
        for part in results.iter_mut() {
            for (result, place) in part.iter_mut().zip(&mut places) {
                *result = if *place == PREVIOUS { previous } else { registers.get(*place) };
            }
        }
    }
}

/// The result of one instruction.
#[inline(always)]
fn perform<T: Scalar>(instruction: &Instruction, registers: &impl Registers<T>, previous: T) -> T {
    let k = instruction.constant();
    let r = |i: u16| if i == PREVIOUS { previous } else { registers.get(i) };
    let a = || r(instruction.a);
    let b = || r(instruction.b);
    let [c, d] = instruction.third_and_fourth();
    match instruction.code {
        Code::Add => a() + b(),
        Code::Sub => a() - b(),
        Code::Mul => a() * b(),
        Code::Div => a() / b(),
        Code::MulAdd => a() * b() + r(c),
        Code::AddConstant => a() + k,
        Code::ConstantSub => -a() + k,
        Code::MulConstant => a() * k,
        Code::DivConstant => a() / k,
        Code::ConstantDiv => T::from(k) / a(),
        Code::MulConstantAdd => a() * k + b(),
        Code::Function(function) => function.value(a()),
        Code::Min => Scalar::min(a(), b()),
        Code::Max => Scalar::max(a(), b()),
        Code::Atan2 => atan2(a(), b()),
        Code::Hypot => hypot(a(), b()),
        Code::Power => power(a(), k),
        Code::Powi => a().powi(instruction.extra as u32 as i32),
        Code::Select => a().if_less(b(), r(c), r(d)),
        Code::Constant => T::from(k),
    }
}

/// `x^a`; a parameter may be an integer, with which the power of a negative number is defined.
#[inline(always)]
fn power<T: Scalar>(x: T, a: f64) -> T {
    if a.fract() == 0.0 && a.abs() <= 1e9 { x.powi(a as i32) } else { x.powf(a) }
}
