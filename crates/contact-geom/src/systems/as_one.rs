//! Enums of the systems with the same number of coordinates.

/// Defines an enum of systems with the same number of coordinates, which is itself a system. Code that is generic over
/// systems is then compiled once for all of them.
macro_rules! systems {
    ($(#[$of:meta])* $name:ident<$n:literal> { $($system:ident: $type:ty,)* }) => {
        $(#[$of])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum $name {
            $(#[doc = concat!("[`", stringify!($system), "`].")] $system($type),)*
        }

        $(impl From<$type> for $name {
            fn from(system: $type) -> Self {
                $name::$system(system)
            }
        })*

        impl Lagrangian<$n> for $name {
            #[inline]
            fn value<T: Scalar>(&self, t: T, q: &SVector<T, $n>, v: &SVector<T, $n>, z: T) -> T {
                match self { $($name::$system(system) => system.value(t, q, v, z),)* }
            }
            #[inline]
            fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<$n, T>) -> Option<ChartVector<$n, T>> {
                match self { $($name::$system(system) => system.closed_gradient(t, x),)* }
            }
            #[inline]
            fn closed_hessian<T: Scalar>(&self, t: T, x: &VelocityPoint<$n, T>) -> Option<Hessian<$n, T>> {
                match self { $($name::$system(system) => system.closed_hessian(t, x),)* }
            }
            fn structure(&self) -> Structure {
                match self { $($name::$system(system) => system.structure(),)* }
            }
        }

        impl $crate::Parametric<$n> for $name {
            fn parameter_names(&self) -> Vec<String> {
                match self { $($name::$system(system) => system.parameter_names(),)* }
            }
            fn parameters(&self) -> Vec<f64> {
                match self { $($name::$system(system) => system.parameters(),)* }
            }
            fn parameter_count(&self) -> usize {
                match self { $($name::$system(system) => $crate::Parametric::<$n>::parameter_count(system),)* }
            }
            fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
                match self { $($name::$system(system) => system.with_parameters(theta).map(Self::from),)* }
            }
            #[inline]
            fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, $n>, v: &SVector<T, $n>, z: T) -> T {
                match self { $($name::$system(system) => system.value_at(theta, t, q, v, z),)* }
            }
        }

        impl System<$n> for $name {
            fn name(&self) -> &'static str {
                match self { $($name::$system(system) => system.name(),)* }
            }
            fn initial(&self) -> VelocityPoint<$n> {
                match self { $($name::$system(system) => system.initial(),)* }
            }
            fn initial_time(&self) -> f64 {
                match self { $($name::$system(system) => system.initial_time(),)* }
            }
            fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<$n>) {
                match self { $($name::$system(system) => system.sample(u),)* }
            }
            fn hamiltonian<T: Scalar>(&self, t: T, x: &PhasePoint<$n, T>) -> Option<T> {
                match self { $($name::$system(system) => system.hamiltonian(t, x),)* }
            }
            fn symmetries(&self) -> Vec<Symmetry<$n>> {
                match self { $($name::$system(system) => system.symmetries(),)* }
            }
        }
    };
}

pub(super) use systems;
