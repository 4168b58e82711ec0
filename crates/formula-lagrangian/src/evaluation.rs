//! Evaluation of a tape on numbers of any scalar type.

use crate::Function;
use crate::functions::{atan2, hypot};
use crate::tape::{Code, InputRegisters, Instruction, PREVIOUS, Tape};
use contact_geom::nalgebra::SVector;
use contact_geom::{Scalar, table::Table, vector};

/// The sizes of the register arrays on the stack; a tape that needs more registers has them on the heap. The registers
/// are cleared before each evaluation, so that a short tape has a small array.
const REGISTERS_TINY: usize = 4;
const REGISTERS_SMALL: usize = 8;
const REGISTERS_MEDIUM: usize = 32;
const REGISTERS_LARGE: usize = 256;

/// The dimension up to which inputs and results are copied in the caller of the interpreter, which knows their number
/// at compile time. In higher dimensions that is slow to compile.
const MAX_INLINED_DIMENSION: usize = 2;

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

/// Registers on the stack, aligned so that a register that holds a SIMD vector does not straddle two cache lines. One
/// that does is slow to load after it was stored.
#[repr(align(64))]
struct OnStack<T, const R: usize>([T; R]);

impl Tape {
    /// Evaluates the tape over N coordinates, or over any number of them if N is 0, and writes the results to slices,
    /// one after the other.
    #[inline(always)]
    pub fn evaluate<T: Scalar, const N: usize>(&self, at: At<'_, T>, results: &mut [&mut [T]]) {
        // Nested dual numbers are not evaluated in long computations, so that their registers may be on the heap.
        if T::ORDER > 0 || self.registers > REGISTERS_LARGE {
            self.interpret_apart(at, &mut vec![T::zero(); self.registers], results);
        } else if self.registers <= REGISTERS_TINY {
            self.interpret::<T, N>(at, &mut OnStack([T::zero(); REGISTERS_TINY]).0, results);
        } else if self.registers <= REGISTERS_SMALL {
            self.interpret::<T, N>(at, &mut OnStack([T::zero(); REGISTERS_SMALL]).0, results);
        } else if self.registers <= REGISTERS_MEDIUM {
            let registers = &mut OnStack([T::zero(); REGISTERS_MEDIUM]).0;
            // In lanes the copying of inputs and results is a small part of a long program.
            if const { size_of::<T>() == size_of::<f64>() } {
                self.interpret::<T, N>(at, registers, results);
            } else {
                self.interpret_apart(at, registers, results);
            }
        } else {
            self.evaluate_large(at, results);
        }
    }

    /// A separate function, so that the large array is in a stack frame of its own.
    #[inline(never)]
    fn evaluate_large<T: Scalar>(&self, at: At<'_, T>, results: &mut [&mut [T]]) {
        self.interpret_apart(at, &mut OnStack([T::zero(); REGISTERS_LARGE]).0, results);
    }

    /// The copying of inputs and results is inlined into the caller if there are few of them.
    #[inline(always)]
    fn interpret<T: Scalar, const N: usize>(&self, at: At<'_, T>, registers: &mut [T], results: &mut [&mut [T]]) {
        if const { N == 0 || N > MAX_INLINED_DIMENSION } {
            self.interpret_apart(at, registers, results);
            return;
        }
        self.enter(at, registers);
        if !self.code.is_empty() {
            run_apart(&self.code, &self.tables, registers);
        }
        self.leave(registers, results);
    }

    /// One copy of the code for each scalar type, shared by all dimensions and numbers of registers, since the code is
    /// long.
    #[inline(always)]
    fn interpret_apart<T: Scalar>(&self, at: At<'_, T>, registers: &mut [T], results: &mut [&mut [T]]) {
        T::apart(
            #[inline(always)]
            || {
                self.enter(at, registers);
                run(&self.code, &self.tables, registers);
                self.leave(registers, results);
            },
        );
    }

    /// Copies the inputs to their registers.
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

    /// Copies the results from their registers to the slices.
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

/// Performs only the instructions, as a separate function.
#[inline(always)]
fn run_apart<T: Scalar>(code: &[Instruction], tables: &[Table], registers: &mut [T]) {
    T::apart(
        #[inline(always)]
        || run(code, tables, registers),
    );
}

/// Performs the instructions. It returns nothing: a return value would occupy the memory of the previous result, which
/// would then not be kept in a register.
#[inline(always)]
fn run<T: Scalar>(code: &[Instruction], tables: &[Table], registers: &mut [T]) {
    let mut previous = T::zero();
    for instruction in code {
        previous = perform(instruction, tables, registers, previous);
        set(registers, instruction.to, previous);
    }
}

/// Returns a number unchanged, but moved as a number. If a SIMD vector is only moved, the compiler may treat it as
/// bytes and move it in halves; a load of the whole vector then waits until both halves are stored.
#[inline(always)]
pub(crate) fn whole<T: Scalar>(x: T) -> T {
    -(-x)
}

/// The same for each component of a vector.
#[inline(always)]
pub(crate) fn whole_vector<T: Scalar, const N: usize>(x: &SVector<T, N>) -> SVector<T, N> {
    vector!(|i| whole(x[i]))
}

/// Copies numbers to consecutive registers, starting at `first`.
#[inline(always)]
fn copy<T: Scalar>(registers: &mut [T], first: u16, from: &[T]) {
    let first = usize::from(first);
    if let Some(places) = registers.get_mut(first..first + from.len()) {
        for (place, x) in places.iter_mut().zip(from) {
            *place = whole(*x);
        }
    }
}

/// The value of a register. Its number is valid by construction; the value would be NaN otherwise.
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
fn perform<T: Scalar>(instruction: &Instruction, tables: &[Table], registers: &[T], previous: T) -> T {
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
        Code::Table => {
            let (table, order) = instruction.table_and_order();
            let table = tables.get(table);
            apart(
                a(),
                #[inline(always)]
                move |x| table.map_or_else(|| T::from(f64::NAN), |table| table.derivative(order, x)),
            )
        }
        Code::Constant => T::from(k),
    }
}

/// The value of a function of one number. Functions that are rare in mechanics are compiled separately, so that the
/// frequently used code stays short.
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

/// Applies a function to a number in separate code. The function writes to a local variable: if it wrote to the
/// variable of the previous result, that one would be kept in memory instead of a register.
#[inline(always)]
fn apart<T: Scalar>(mut x: T, work: impl FnOnce(T) -> T) -> T {
    T::apart(
        #[inline(always)]
        || x = work(x),
    );
    x
}

/// `x^a`; the exponent may be a parameter with an integer value, for which powers of negative numbers are defined.
#[inline(always)]
pub(crate) fn power<T: Scalar>(x: T, a: f64) -> T {
    if a.fract() == 0.0 && a.abs() <= 1e9 { x.powi(a as i32) } else { x.powf(a) }
}
