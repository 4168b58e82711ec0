//! Several Lagrangians as one type.

/// Defines an enum of Lagrangians with the same number of coordinates, which is itself a [`Lagrangian`](crate::Lagrangian):
/// a program that uses many of them compiles each integrator once instead of once for each of them.
///
/// Structure, forces, switching functions, time transformation, and closed gradients and Hessians are those of the
/// variant; other closed forms follow from these two. Each evaluation selects the variant, so that a type of its own is
/// faster. The second form of the macro implements [`Parametric`](crate::Parametric) where each variant does. Variants that
/// are given by a contact Hamiltonian are not accepted.
///
/// ```
/// use contact_examples::systems::{Duffing, Pendulum};
/// use contact_geom::{Lagrangian, Parametric};
///
/// contact_geom::lagrangian_enum! {
///     /// A pendulum or an oscillator.
///     #[derive(Clone, Debug)]
///     pub enum Oscillator<1> {
///         Pendulum(Pendulum),
///         Duffing(Duffing),
///     }
/// }
/// contact_geom::lagrangian_enum!(parametric Oscillator<1> { Pendulum, Duffing });
///
/// let system = Oscillator::from(Pendulum { gamma: -0.1 });
/// assert_eq!(
///     system.value(0.0, &[0.0].into(), &[2.0].into(), 0.0),
///     Pendulum { gamma: -0.1 }.value(0.0, &[0.0].into(), &[2.0].into(), 0.0)
/// );
/// assert_eq!(system.parameters(), [-0.1]);
/// ```
#[macro_export]
macro_rules! lagrangian_enum {
    (
        $(#[$of:meta])*
        $visibility:vis enum $name:ident<$n:literal> { $($(#[$about:meta])* $variant:ident($type:ty)),* $(,)? }
    ) => {
        $(#[$of])*
        $visibility enum $name {
            $($(#[$about])* $variant($type),)*
        }

        $(impl From<$type> for $name {
            fn from(lagrangian: $type) -> Self {
                $name::$variant(lagrangian)
            }
        })*

        impl $crate::Lagrangian<$n> for $name {
            const HINTS: $crate::Hints = $crate::Hints::of_any(&[$(<$type as $crate::Lagrangian<$n>>::HINTS),*]);

            #[inline]
            fn value<T: $crate::Scalar>(
                &self,
                t: T,
                q: &$crate::nalgebra::SVector<T, $n>,
                v: &$crate::nalgebra::SVector<T, $n>,
                z: T,
            ) -> T {
                match self { $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::value(lagrangian, t, q, v, z),)* }
            }
            #[inline]
            fn closed_gradient<T: $crate::Scalar>(
                &self,
                t: T,
                x: &$crate::VelocityPoint<$n, T>,
            ) -> Option<$crate::ChartVector<$n, T>> {
                match self { $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::closed_gradient(lagrangian, t, x),)* }
            }
            #[inline]
            fn closed_hessian<T: $crate::Scalar>(
                &self,
                t: T,
                x: &$crate::VelocityPoint<$n, T>,
            ) -> Option<$crate::Hessian<$n, T>> {
                match self { $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::closed_hessian(lagrangian, t, x),)* }
            }
            #[inline]
            fn applied_force<T: $crate::Scalar>(
                &self,
                t: T,
                x: &$crate::VelocityPoint<$n, T>,
            ) -> $crate::nalgebra::SVector<T, $n> {
                match self { $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::applied_force(lagrangian, t, x),)* }
            }
            #[inline]
            fn dt_dtau<T: $crate::Scalar>(&self, q: &$crate::nalgebra::SVector<T, $n>) -> T {
                match self { $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::dt_dtau(lagrangian, q),)* }
            }
            fn structure(&self) -> $crate::Structure {
                match self { $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::structure(lagrangian),)* }
            }
            fn force_structure(&self) -> $crate::ForceStructure<$n> {
                match self { $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::force_structure(lagrangian),)* }
            }
            fn switching_functions(&self, t: f64, x: &$crate::VelocityPoint<$n>, values: &mut Vec<f64>) {
                match self {
                    $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::switching_functions(lagrangian, t, x, values),)*
                }
            }
            fn at_switch(
                &self,
                index: usize,
                t: f64,
                x: &$crate::VelocityPoint<$n>,
                rising: bool,
            ) -> $crate::switching::Control<$n> {
                match self {
                    $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::at_switch(lagrangian, index, t, x, rising),)*
                }
            }
            fn at_accumulation(
                &self,
                index: usize,
                t: f64,
                x: &$crate::VelocityPoint<$n>,
            ) -> $crate::switching::Control<$n> {
                match self {
                    $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::at_accumulation(lagrangian, index, t, x),)*
                }
            }
            fn breaks(&self) -> &[f64] {
                match self { $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::breaks(lagrangian),)* }
            }
            fn has_cones(&self) -> bool {
                match self { $($name::$variant(lagrangian) => $crate::Lagrangian::<$n>::has_cones(lagrangian),)* }
            }
        }
    };
    (parametric $name:ident<$n:literal> { $($variant:ident),* $(,)? }) => {
        impl $crate::Parametric<$n> for $name {
            fn parameter_names(&self) -> Vec<String> {
                match self { $($name::$variant(lagrangian) => $crate::Parametric::<$n>::parameter_names(lagrangian),)* }
            }
            fn parameters(&self) -> Vec<f64> {
                match self { $($name::$variant(lagrangian) => $crate::Parametric::<$n>::parameters(lagrangian),)* }
            }
            fn parameter_count(&self) -> usize {
                match self { $($name::$variant(lagrangian) => $crate::Parametric::<$n>::parameter_count(lagrangian),)* }
            }
            fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
                match self {
                    $($name::$variant(lagrangian) => {
                        $crate::Parametric::<$n>::with_parameters(lagrangian, theta).map($name::$variant)
                    })*
                }
            }
            #[inline]
            fn value_at<T: $crate::Scalar>(
                &self,
                theta: &[T],
                t: T,
                q: &$crate::nalgebra::SVector<T, $n>,
                v: &$crate::nalgebra::SVector<T, $n>,
                z: T,
            ) -> T {
                match self {
                    $($name::$variant(lagrangian) => $crate::Parametric::<$n>::value_at(lagrangian, theta, t, q, v, z),)*
                }
            }
            #[inline]
            fn force_at<T: $crate::Scalar>(
                &self,
                theta: &[T],
                t: T,
                x: &$crate::VelocityPoint<$n, T>,
            ) -> $crate::nalgebra::SVector<T, $n> {
                match self { $($name::$variant(lagrangian) => $crate::Parametric::<$n>::force_at(lagrangian, theta, t, x),)* }
            }
            fn break_rates(&self, parameter: usize) -> Option<Vec<$crate::switching::BreakRate>> {
                match self {
                    $($name::$variant(lagrangian) => $crate::Parametric::<$n>::break_rates(lagrangian, parameter),)*
                }
            }
            #[inline]
            fn switching_function_at<T: $crate::Scalar>(
                &self,
                theta: &[T],
                index: usize,
                t: T,
                x: &$crate::VelocityPoint<$n, T>,
            ) -> Option<T> {
                match self {
                    $($name::$variant(lagrangian) => {
                        $crate::Parametric::<$n>::switching_function_at(lagrangian, theta, index, t, x)
                    })*
                }
            }
            #[inline]
            fn state_after_switch_at<T: $crate::Scalar>(
                &self,
                theta: &[T],
                index: usize,
                t: T,
                x: &$crate::VelocityPoint<$n, T>,
            ) -> Option<$crate::VelocityPoint<$n, T>> {
                match self {
                    $($name::$variant(lagrangian) => {
                        $crate::Parametric::<$n>::state_after_switch_at(lagrangian, theta, index, t, x)
                    })*
                }
            }
        }
    };
}
