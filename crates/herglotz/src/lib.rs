//! Scene files: a Lagrangian as text, a start, and what is asked of its motion. The program `herglotz` runs them.
//!
//! [`Scene::read`] reads one; what is wrong with it is a [`SceneError`] with the place in the file.

mod scene;

pub use scene::{EndsScene, Knob, LatticeScene, Members, Scene, SceneError, schema};
