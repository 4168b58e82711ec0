//! A tape at work on numbers of any kind.

use crate::Function;
use crate::functions::{atan2, hypot};
use crate::tape::{Code, InputRegisters, Instruction, PREVIOUS, Tape};
use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// The numbers of registers that lie on the stack; a tape that needs more has them on the heap. They are cleared before each evaluation, so
/// that a short tape has few.
const TINY: usize = 4;
const SMALL: usize = 8;
const MIDDLE: usize = 32;
const LARGE: usize = 256;

/// The coordinates up to which numbers are moved in and out by the caller of an interpreter, which knows how many they are: of more that is
/// slow to compile.
const FEW: usize = 2;

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
        At { q: q.as_slice(), v: v.as_slice(), z: whole(z), t: whole(t) }
    }
}

/// Registers on the stack, each of a vector's in cache lines of its own: one that lies across two is slow to read after it was written.
#[repr(align(64))]
struct OnStack<T, const R: usize>([T; R]);

impl Tape {
    /// Evaluates it over N coordinates, or over any number of them where N is 0, and writes the results to slices, one after the other.
    #[inline(always)]
    pub fn evaluate<T: Scalar, const N: usize>(&self, at: At<'_, T>, results: &mut [&mut [T]]) {
        // Nothing that takes many steps evaluates nested duals.
        if T::NESTED || self.registers > LARGE {
            self.interpret::<T, N>(at, &mut vec![T::zero(); self.registers], results);
        } else if self.registers <= TINY {
            self.interpret::<T, N>(at, &mut OnStack([T::zero(); TINY]).0, results);
        } else if self.registers <= SMALL {
            self.interpret::<T, N>(at, &mut OnStack([T::zero(); SMALL]).0, results);
        } else if self.registers <= MIDDLE {
            self.interpret::<T, N>(at, &mut OnStack([T::zero(); MIDDLE]).0, results);
        } else {
            self.evaluate_large::<T, N>(at, results);
        }
    }

    /// A frame of the stack by itself.
    #[inline(never)]
    fn evaluate_large<T: Scalar, const N: usize>(&self, at: At<'_, T>, results: &mut [&mut [T]]) {
        self.interpret::<T, N>(at, &mut OnStack([T::zero(); LARGE]).0, results);
    }

    /// What is moved in and out is part of the caller where it is little.
    #[inline(always)]
    fn interpret<T: Scalar, const N: usize>(&self, at: At<'_, T>, registers: &mut [T], results: &mut [&mut [T]]) {
        if const { N == 0 || N > FEW } {
            self.interpret_apart(at, registers, results);
            return;
        }
        self.enter(at, registers);
        if !self.code.is_empty() {
            run_apart(&self.code, registers);
        }
        self.leave(registers, results);
    }

    /// One copy of the code for each kind of numbers, whatever the dimension and the number of registers: it is long.
    #[inline(always)]
    fn interpret_apart<T: Scalar>(&self, at: At<'_, T>, registers: &mut [T], results: &mut [&mut [T]]) {
        T::apart(
            #[inline(always)]
            || {
                self.enter(at, registers);
                run(&self.code, registers);
                self.leave(registers, results);
            },
        );
    }

    /// Moves the inputs to their registers.
    #[inline(always)]
    fn enter<T: Scalar>(&self, at: At<'_, T>, registers: &mut [T]) {
        let InputRegisters { q, v, z, t } = self.inputs;
        if let Some(first) = q {
            copy(registers, first, at.q);
        }
        if let Some(first) = v {
            copy(registers, first, at.v);
        }
        if let Some(z) = z {
            set(registers, z, at.z);
        }
        if let Some(t) = t {
            set(registers, t, at.t);
        }
    }

    /// Moves the results to where they are wanted.
    #[inline(always)]
    fn leave<T: Scalar>(&self, registers: &[T], results: &mut [&mut [T]]) {
        let mut places = self.results.iter();
        for part in results.iter_mut() {
            for (result, place) in part.iter_mut().zip(&mut places) {
                let value = get(registers, place.register);
                *result = if place.negative { -value } else { whole(value) };
            }
        }
    }
}

/// The same of the instructions alone.
#[inline(always)]
fn run_apart<T: Scalar>(code: &[Instruction], registers: &mut [T]) {
    T::apart(
        #[inline(always)]
        || run(code, registers),
    );
}

/// Performs the instructions. It returns no number: that would have the place of the result before, which then is not in a register.
#[inline(always)]
fn run<T: Scalar>(code: &[Instruction], registers: &mut [T]) {
    let mut previous = T::zero();
    for instruction in code {
        previous = perform(instruction, registers, previous);
        set(registers, instruction.to, previous);
    }
}

/// A number as it is, moved as a number. A vector that is only moved the compiler takes for bytes, and moves by halves where it prefers those; who
/// reads the whole then waits until both are written.
#[inline(always)]
pub(crate) fn whole<T: Scalar>(x: T) -> T {
    -(-x)
}

/// The same of a vector's.
#[inline(always)]
pub(crate) fn whole_vector<T: Scalar, const N: usize>(x: &SVector<T, N>) -> SVector<T, N> {
    SVector::from_fn(|i, _| whole(x[i]))
}

/// Numbers to the registers from the first on.
#[inline(always)]
fn copy<T: Scalar>(registers: &mut [T], first: u16, from: &[T]) {
    let first = usize::from(first);
    if let Some(places) = registers.get_mut(first..first + from.len()) {
        for (place, x) in places.iter_mut().zip(from) {
            *place = whole(*x);
        }
    }
}

/// A register by its number, which is right by construction; what is not there would be not a number.
#[inline(always)]
fn get<T: Scalar>(registers: &[T], register: u16) -> T {
    registers.get(usize::from(register)).copied().unwrap_or_else(|| T::from(f64::NAN))
}

#[inline(always)]
fn set<T: Scalar>(registers: &mut [T], register: u16, value: T) {
    if let Some(place) = registers.get_mut(usize::from(register)) {
        *place = whole(value);
    }
}

/// The result of one instruction.
#[inline(always)]
fn perform<T: Scalar>(instruction: &Instruction, registers: &[T], previous: T) -> T {
    let k = instruction.constant();
    let r = |i: u16| if i == PREVIOUS { previous } else { get(registers, i) };
    let a = || r(instruction.a);
    let b = || r(instruction.b);
    let [c, d] = instruction.third_and_fourth();
    match instruction.code {
        Code::Add => a() + b(),
        Code::Sub => a() - b(),
        Code::Mul => a() * b(),
        Code::Div => a() / b(),
        Code::MulAdd => a() * b() + r(c),
        Code::MulSub => r(c) - a() * b(),
        Code::AddConstant => a() + k,
        Code::ConstantSub => -a() + k,
        Code::MulConstant => a() * k,
        Code::DivConstant => a() / k,
        Code::ConstantDiv => T::from(k) / a(),
        Code::MulConstantAdd => a() * k + b(),
        Code::MulConstantSub => b() - a() * k,
        Code::ScaledProduct => a() * b() * k,
        Code::Function(function) => value(function, a()),
        Code::Min => Scalar::min(a(), b()),
        Code::Max => Scalar::max(a(), b()),
        Code::Atan2 => {
            let (y, x) = (a(), b());
            apart(
                y,
                #[inline(always)]
                move |y| atan2(y, x),
            )
        }
        Code::Hypot => {
            let (x, y) = (a(), b());
            apart(
                x,
                #[inline(always)]
                move |x| hypot(x, y),
            )
        }
        Code::Power => apart(
            a(),
            #[inline(always)]
            move |x| power(x, k),
        ),
        Code::Powi => a().powi(instruction.extra as u32 as i32),
        Code::Select => a().if_less(b(), r(c), r(d)),
        Code::Constant => T::from(k),
    }
}

/// A function of one number. Those that are rare in mechanics are a piece of code of their own, so that what is read most often stays short.
#[inline(always)]
fn value<T: Scalar>(function: Function, x: T) -> T {
    match function {
        Function::Neg => -x,
        Function::Recip => x.recip(),
        Function::Sqrt => x.sqrt(),
        Function::Sin => x.sin(),
        Function::Cos => x.cos(),
        rare => apart(
            x,
            #[inline(always)]
            move |x| rare.value(x),
        ),
    }
}

/// Work on a number as a function of its own. What that writes to is a place of its own too: one that others see is not kept in a register,
/// and the result of the instruction before would be in it.
#[inline(always)]
fn apart<T: Scalar>(mut x: T, work: impl FnOnce(T) -> T) -> T {
    T::apart(
        #[inline(always)]
        || x = work(x),
    );
    x
}

/// `x^a`; a parameter may be an integer, with which the power of a negative number is defined.
#[inline(always)]
fn power<T: Scalar>(x: T, a: f64) -> T {
    if a.fract() == 0.0 && a.abs() <= 1e9 { x.powi(a as i32) } else { x.powf(a) }
}
