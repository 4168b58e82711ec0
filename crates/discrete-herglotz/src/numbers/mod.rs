//! Arithmetic of the kernels: SIMD registers and batches of them, compensated summation, double-double arithmetic.

pub(crate) mod array;
pub(crate) mod compensated;
pub(crate) mod compensated_batch;
pub(crate) mod double_double;
pub(crate) mod extent;
pub(crate) mod functions;
pub(crate) mod instructions;
pub(crate) mod lanes;
pub(crate) mod order;
pub(crate) mod pair;
pub(crate) mod registers;
pub(crate) mod simd_batch;
pub(crate) mod state_words;
