//! Fields that are parameters.

/// Implements `Parametric` for a system whose fields, all numbers, are its parameters; `formula` takes them in this
/// order.
macro_rules! parametric_fields {
    ([$($generic:tt)*] $system:ty, $n:expr, $($field:ident),+) => {
        impl<$($generic)*> contact_geom::Parametric<{ $n }> for $system {
            fn parameter_names(&self) -> Vec<String> {
                [$(stringify!($field)),+].map(String::from).into()
            }
            fn parameters(&self) -> Vec<f64> {
                vec![$(self.$field),+]
            }
            #[inline(always)]
            fn parameter_count(&self) -> usize {
                [$(stringify!($field)),+].len()
            }
            fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
                let [$($field),+] = *theta else { return None };
                #[allow(clippy::needless_update)] // Some systems have further fields.
                Some(Self { $($field,)+ ..*self })
            }
            #[inline(always)]
            fn value_at<T: contact_geom::Scalar>(
                &self,
                theta: &[T],
                t: T,
                q: &contact_geom::nalgebra::SVector<T, { $n }>,
                v: &contact_geom::nalgebra::SVector<T, { $n }>,
                z: T,
            ) -> T {
                let [$($field),+] = *theta else { return T::from(f64::NAN) };
                self.formula([$($field),+], t, q, v, z)
            }
        }
    };
}
pub(super) use parametric_fields;
