//! The routes of a contact Gauss step: what of the stage equations is left to solve where the structure of L allows to skip a part.

pub(crate) mod general;
pub(crate) mod linear;
pub(crate) mod separable;
pub(crate) mod transformed;
