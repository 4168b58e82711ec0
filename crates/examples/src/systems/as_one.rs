//! Enums of the systems with the same number of coordinates.

/// Defines an enum of systems with the same number of coordinates, which is itself a system.
macro_rules! systems {
    ($(#[$of:meta])* $name:ident<$n:literal> { $($system:ident: $type:ty,)* }) => {
        contact_geom::lagrangian_enum! {
            $(#[$of])*
            #[derive(Clone, Copy, Debug, PartialEq)]
            pub enum $name<$n> {
                $(#[doc = concat!("[`", stringify!($system), "`].")] $system($type),)*
            }
        }
        contact_geom::lagrangian_enum!(parametric $name<$n> { $($system),* });

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
