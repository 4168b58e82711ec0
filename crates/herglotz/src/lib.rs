//! Scene files: a Lagrangian as text, an initial state, and the requested output. The program `herglotz` runs them.
//!
//! [`Scene::read`] reads a scene; an error is a [`SceneError`] with the position in the file.

mod scene;

pub use scene::{EndsScene, Knob, LatticeScene, Members, Scene, SceneError, schema};
