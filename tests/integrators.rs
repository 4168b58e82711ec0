//! The integrators: steppers, scenes, dense output and events, over the catalogue of systems.

#![allow(missing_docs)]

mod common;

mod clocked;
mod scenes;
