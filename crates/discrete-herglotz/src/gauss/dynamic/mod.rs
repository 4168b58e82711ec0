//! Contact Gauss collocation with a number of coordinates that is known at run time.
#![allow(dead_code)]

pub(crate) mod curve;
pub(crate) mod dense;
pub(crate) mod routes;
pub(crate) mod stages;
pub(crate) mod system;
