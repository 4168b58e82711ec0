//! Contact Hamiltonians given directly: their methods, and the systems of `contact_examples::systems::hamiltonian`.

#![allow(missing_docs)]
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// In a test a missing value is a failure.
#![allow(clippy::panic, clippy::unwrap_used)]
// `!(x <= bound)` holds for a NaN, as the checks intend; an index says which stage or coordinate it is.
#![allow(clippy::neg_cmp_op_on_partial_ord, clippy::needless_range_loop)]

// Other targets use the rest of it.
#[allow(dead_code)]
#[path = "../common/mod.rs"]
mod common;

mod hamiltonian_systems;
mod hamiltonians;
