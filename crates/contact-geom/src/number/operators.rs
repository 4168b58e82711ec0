//! A macro for the operators of number types.

/// Implements the operators of a [`Scalar`](crate::Scalar) from its four rules of arithmetic: `+ - * /` with numbers of
/// its type and with `f64`, the assignment operators, 0 and 1. The type must implement `From<f64>`, `PartialEq` and
/// `Copy`; its generic parameters, if any, are given in brackets.
///
/// ```
/// /// A number with a note of what was added to it.
/// #[derive(Clone, Copy, Debug, PartialEq)]
/// struct Counted(f64, u32);
/// impl From<f64> for Counted {
///     fn from(x: f64) -> Self {
///         Counted(x, 0)
///     }
/// }
/// contact_geom::scalar_operators! { [] Counted;
///     a + b = Counted(a.0 + b.0, a.1 + b.1 + 1);
///     c - d = Counted(c.0 - d.0, c.1 + d.1 + 1);
///     e * f = Counted(e.0 * f.0, e.1 + f.1);
///     g / h = Counted(g.0 / h.0, g.1 + h.1);
/// }
/// let mut x = Counted::from(2.0) * 3.0 + 1.0;
/// x -= Counted::from(4.0);
/// assert_eq!(x, Counted(3.0, 2));
/// ```
#[macro_export]
macro_rules! scalar_operators {
    ([$($generics:tt)*] $type:ty;
        $a:ident + $b:ident = $sum:expr;
        $c:ident - $d:ident = $difference:expr;
        $e:ident * $f:ident = $product:expr;
        $g:ident / $h:ident = $quotient:expr;
    ) => {
        $crate::scalar_operators! { @one [$($generics)*] $type; Add add AddAssign add_assign $a $b $sum }
        $crate::scalar_operators! { @one [$($generics)*] $type; Sub sub SubAssign sub_assign $c $d $difference }
        $crate::scalar_operators! { @one [$($generics)*] $type; Mul mul MulAssign mul_assign $e $f $product }
        $crate::scalar_operators! { @one [$($generics)*] $type; Div div DivAssign div_assign $g $h $quotient }

        impl<$($generics)*> $crate::num_traits::Zero for $type {
            #[inline(always)]
            fn zero() -> Self {
                Self::from(0.0)
            }
            fn is_zero(&self) -> bool {
                *self == Self::from(0.0)
            }
        }

        impl<$($generics)*> $crate::num_traits::One for $type {
            #[inline(always)]
            fn one() -> Self {
                Self::from(1.0)
            }
        }
    };
    (@one [$($generics:tt)*] $type:ty; $op:ident $method:ident $assign:ident $assign_method:ident $a:ident $b:ident $value:expr) => {
        impl<$($generics)*> ::std::ops::$op for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                $value
            }
        }

        impl<$($generics)*> ::std::ops::$op<f64> for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                ::std::ops::$op::$method(self, Self::from(other))
            }
        }

        impl<$($generics)*> ::std::ops::$assign for $type {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = ::std::ops::$op::$method(*self, other);
            }
        }
    };
}
