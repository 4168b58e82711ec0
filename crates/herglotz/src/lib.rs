//! Scene files: motions of systems that depend on the action, described in text.
//!
//! A scene file has a Lagrangian or a contact Hamiltonian as text, an initial state, and the requested output; the program `herglotz` runs it.
//! [`Scene::read`] reads a scene; an error is a [`SceneError`] with the position in the file. Motions are computed by
//! [`runtime`].
//!
//! The feature `program` (default) builds the program and its figures.

mod scene;

#[doc(no_inline)]
pub use herglotz_runtime as runtime;
pub use scene::{
    AnyScene, BodyScene, Combinations, EndsScene, LatticeScene, Members, Property, Scene, SceneError, SweptQuantity,
    VERSION, schema,
};
