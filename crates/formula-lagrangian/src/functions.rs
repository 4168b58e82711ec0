//! The functions of the language: their values for any scalar type, and their derivatives.

use crate::{Function, Graph, Id, Operation};
use contact_geom::Scalar;
use std::f64::consts::{FRAC_PI_2, PI};

/// The functions of one number by their names in a text. Several names may denote the same function.
pub(crate) const FUNCTIONS: [(&str, Function); 21] = [
    ("sqrt", Function::Sqrt),
    ("abs", Function::Abs),
    ("sign", Function::Sign),
    ("sin", Function::Sin),
    ("cos", Function::Cos),
    ("tan", Function::Tan),
    ("versine", Function::Versine),
    ("atan", Function::Atan),
    ("sinh", Function::Sinh),
    ("cosh", Function::Cosh),
    ("tanh", Function::Tanh),
    ("asinh", Function::Asinh),
    ("acosh", Function::Acosh),
    ("atanh", Function::Atanh),
    ("exp", Function::Exp),
    ("expm1", Function::ExpM1),
    ("ln", Function::Ln),
    ("log", Function::Ln),
    ("ln1p", Function::Ln1p),
    ("log1p", Function::Ln1p),
    ("recip", Function::Recip),
];

/// The functions of two numbers by their names.
pub(crate) const OPERATIONS: [(&str, Operation); 5] = [
    ("min", Operation::Min),
    ("max", Operation::Max),
    ("atan2", Operation::Atan2),
    ("hypot", Operation::Hypot),
    ("pow", Operation::Power),
];

impl Function {
    /// The value, for any scalar type.
    #[inline(always)]
    pub(crate) fn value<T: Scalar>(self, x: T) -> T {
        match self {
            Function::Neg => -x,
            Function::Recip => x.recip(),
            Function::Sqrt => x.sqrt(),
            Function::Abs => Scalar::abs(x),
            Function::Sign => Scalar::signum(x),
            Function::Sin => x.sin(),
            Function::Cos => x.cos(),
            Function::Tan => x.tan(),
            Function::Versine => x.versine(),
            Function::Atan => x.atan(),
            Function::Sinh => x.sinh(),
            Function::Cosh => x.cosh(),
            Function::Tanh => x.tanh(),
            Function::Asinh => asinh(x),
            Function::Acosh => acosh(x),
            Function::Atanh => atanh(x),
            Function::Exp => x.exp(),
            Function::ExpM1 => x.exp_m1(),
            Function::Ln => x.ln(),
            Function::Ln1p => x.ln_1p(),
        }
    }

    /// Whether `f(-x) = -f(x)` exactly.
    pub(crate) fn is_odd(self) -> bool {
        use Function::{Asinh, Atan, Atanh, Recip, Sign, Sin, Sinh, Tan, Tanh};
        matches!(self, Recip | Sign | Sin | Tan | Atan | Sinh | Tanh | Asinh | Atanh)
    }

    /// Whether it has neither kinks nor jumps.
    pub(crate) fn is_smooth(self) -> bool {
        !matches!(self, Function::Abs | Function::Sign)
    }

    /// The derivative at `x`, given the node of the value `y = f(x)`.
    pub(crate) fn slope(self, graph: &mut Graph, x: Id, y: Id) -> Id {
        let one = graph.number(1.0);
        match self {
            Function::Neg => graph.number(-1.0),
            Function::Recip => {
                let square = graph.mul(y, y);
                graph.neg(square)
            }
            Function::Sqrt => {
                let (inverse, half) = (graph.recip(y), graph.number(0.5));
                graph.mul(inverse, half)
            }
            Function::Abs => graph.unary(Function::Sign, x),
            Function::Sign => graph.number(0.0),
            Function::Sin => graph.unary(Function::Cos, x),
            Function::Cos => {
                let sine = graph.unary(Function::Sin, x);
                graph.neg(sine)
            }
            Function::Tan => {
                let square = graph.mul(y, y);
                graph.add(square, one)
            }
            Function::Versine => graph.unary(Function::Sin, x),
            Function::Atan => {
                let square = graph.mul(x, x);
                let sum = graph.add(square, one);
                graph.recip(sum)
            }
            Function::Sinh => graph.unary(Function::Cosh, x),
            Function::Cosh => graph.unary(Function::Sinh, x),
            Function::Tanh => {
                let square = graph.mul(y, y);
                graph.sub(one, square)
            }
            Function::Asinh => {
                let size = graph.binary(Operation::Hypot, x, one);
                graph.recip(size)
            }
            // A product of factors, since the difference of squares would suffer from cancellation.
            Function::Acosh => {
                let (below, above) = (graph.sub(x, one), graph.add(x, one));
                let [below, above] = [below, above].map(|factor| graph.unary(Function::Sqrt, factor));
                let root = graph.mul(below, above);
                graph.recip(root)
            }
            Function::Atanh => {
                let (below, above) = (graph.sub(one, x), graph.add(x, one));
                let product = graph.mul(below, above);
                graph.recip(product)
            }
            Function::Exp => y,
            Function::ExpM1 => graph.add(y, one),
            Function::Ln => graph.recip(x),
            Function::Ln1p => {
                let sum = graph.add(x, one);
                graph.recip(sum)
            }
        }
    }
}

impl Operation {
    /// The value of two numbers.
    pub(crate) fn value(self, x: f64, y: f64) -> f64 {
        match self {
            Operation::Add => x + y,
            Operation::Sub => x - y,
            Operation::Mul => x * y,
            Operation::Div => x / y,
            Operation::Min => Scalar::min(x, y),
            Operation::Max => Scalar::max(x, y),
            Operation::Atan2 => atan2(x, y),
            Operation::Hypot => hypot(x, y),
            Operation::Power if y.fract() == 0.0 && y.abs() <= 1e9 => x.powi(y as i32),
            Operation::Power => x.powf(y),
        }
    }
}

/// The angle of the point `(x, y)`, in `[-pi, pi]`; NaN at the origin.
#[inline(always)]
pub(crate) fn atan2<T: Scalar>(y: T, x: T) -> T {
    let (zero, size_x, size_y) = (T::zero(), Scalar::abs(x), Scalar::abs(y));
    // The coordinate of smaller size, divided by that of larger size.
    let steep = |then: T, otherwise: T| size_x.if_less(size_y, then, otherwise);
    let angle = (steep(-x, y) / steep(y, x)).atan();
    let quarter = y.if_less(zero, T::from(-FRAC_PI_2), T::from(FRAC_PI_2));
    let half = x.if_less(zero, y.if_less(zero, T::from(-PI), T::from(PI)), zero);
    angle + steep(quarter, half)
}

/// `sqrt(x^2 + y^2)` without overflow.
#[inline(always)]
pub(crate) fn hypot<T: Scalar>(x: T, y: T) -> T {
    let (x, y) = (Scalar::abs(x), Scalar::abs(y));
    // If both are equal, `large` is the one and `small` the other.
    let (large, small) = (Scalar::max(x, y), Scalar::min(y, x));
    let ratio = small / large;
    let length = large * (ratio * ratio + 1.0).sqrt();
    T::zero().if_less(large, length, large)
}

/// The inverse hyperbolic sine, without cancellation or overflow: that of `|x|`, with the sign of x.
#[inline(always)]
pub(crate) fn asinh<T: Scalar>(x: T) -> T {
    // `abs` is not used, since its derivative is 0 at 0.
    let size = x.if_less(T::zero(), -x, x);
    let value = (size + size * (size / (hypot(size, T::one()) + 1.0))).ln_1p();
    x.if_less(T::zero(), -value, value)
}

/// The inverse hyperbolic cosine, without cancellation or overflow.
#[inline(always)]
pub(crate) fn acosh<T: Scalar>(x: T) -> T {
    let above = x - 1.0;
    (above + above.sqrt() * (x + 1.0).sqrt()).ln_1p()
}

/// The inverse hyperbolic tangent: that of `|x|`, with the sign of x.
#[inline(always)]
pub(crate) fn atanh<T: Scalar>(x: T) -> T {
    let size = x.if_less(T::zero(), -x, x);
    let value = (size * 2.0 / (-size + 1.0)).ln_1p() * 0.5;
    x.if_less(T::zero(), -value, value)
}
