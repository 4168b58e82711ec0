//! Splittings of contact flows, with exact rate.

mod linear_drag;
#[cfg(test)]
mod order_conditions;
mod scheme;
mod separable;
mod strang;
mod sum;
#[cfg(test)]
mod tests;

pub use linear_drag::Splitting;
pub use scheme::SplittingScheme;
pub use strang::Strang;
