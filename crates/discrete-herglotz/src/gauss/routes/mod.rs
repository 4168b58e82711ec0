//! The routes of a contact Gauss step: the reduced forms of the stage equations that the structure of L allows.

pub(crate) mod general;
pub(crate) mod linear;
pub(crate) mod separable;
pub(crate) mod transformed;
