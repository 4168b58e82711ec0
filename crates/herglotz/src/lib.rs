//! Motions of Lagrangians whose formula is known at run time only: [`runtime`], and scene files that describe them.
//!
//! A scene file has a Lagrangian as text, an initial state, and the requested output; the program `herglotz` runs it.
//! `Scene::read` reads a scene; an error is a `SceneError` with the position in the file.
//!
//! Features: `scenes` for scene files, `program` (default) for the program and its pictures.

pub mod runtime;
#[cfg(feature = "scenes")]
mod scene;

#[cfg(feature = "scenes")]
pub use scene::{EndsScene, LatticeScene, Members, Scene, SceneError, SweptQuantity, schema};
