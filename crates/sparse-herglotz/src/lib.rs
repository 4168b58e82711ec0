//! Large contact systems: Lagrangians that are sums of local terms, of any number of unknowns.
//!
//! The user writes the term of one element (a site, a bond, a finite element) once, generic in the scalar, and lists
//! the elements that have it. The crate assembles forces and sparse second derivatives from dual numbers of fixed size,
//! and takes explicit and implicit steps. The cost of an explicit step grows linearly with the number of elements.
//!
//! ```
//! use sparse_herglotz::systems::{FputBond, fput_chain};
//! use sparse_herglotz::{SparseSplitting, State};
//! use discrete_herglotz::SplittingScheme;
//!
//! let n = 1000;
//! let chain = fput_chain(n, FputBond { alpha: 0.0, beta: 1.0 }, -0.01)?;
//! let q: Vec<f64> = (1..=n).map(|i| (std::f64::consts::PI * i as f64 / (n + 1) as f64).sin()).collect();
//! let start = State { t: 0.0, q: &q, v: &vec![0.0; n], z: Some(0.0) };
//! let mut motion = SparseSplitting::new(&chain, &SplittingScheme::BLANES_MOAN_6, 1.0, start)?;
//! assert!(motion.advance(100).is_ok());
//! println!("{:?}", motion.state().q[500]);
//! # Ok::<(), sparse_herglotz::SparseError>(())
//! ```

mod aligned;
mod batch;
mod blocks;
mod constraints;
mod derivatives;
mod drag;
mod elements;
mod energies;
mod error;
mod friction;
mod gather;
mod hessian;
mod implicit;
mod kick;
mod kick_drift;
mod lanes;
mod local_lagrangian;
mod local_term_list;
mod memory;
mod monitor;
mod potential;
mod potential_list;
mod rattle;
mod splitting;
mod stages;
mod system;
pub mod systems;

pub use constraints::{Distance, DistanceToPoint, LocalConstraint};
pub use elements::{ElementData, FIXED};
pub use error::SparseError;
pub use implicit::{SparseGauss, SparseMidpoint};
pub use local_lagrangian::LocalLagrangian;
pub use potential::{Difference, Potential};
pub use rattle::SparseRattle;
pub use splitting::SparseSplitting;
pub use system::{SparseSystem, State};

/// Runs the program of the README as a doctest.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
