//! Scenes of every kind.

use super::file;
use super::{BodyScene, EndsScene, LatticeScene, Scene, SceneError};
use std::path::Path;

/// A scene that has been read and validated, by its kind.
pub enum AnyScene {
    /// A motion of a system with a formula.
    Motion(Box<Scene>),
    /// A motion of a lattice by sparse integrators.
    Lattice(Box<LatticeScene>),
    /// A motion of a rigid body.
    Body(Box<BodyScene>),
    /// A path between two ends.
    Path(Box<EndsScene>),
}

impl AnyScene {
    /// Reads a scene file in a folder, to which the paths of its tables are relative, and overrides some of its values: for a
    /// rigid body numbers such as `gamma=-0.2`, `mass=2`, `inertia1=0.5` and `start.omega3=10`, vectors such as
    /// `start.omega=[0.0, 0.0, 10.0]`, and those of the run; for all others as in [`Scene::read_with`].
    ///
    /// ```
    /// let scene = herglotz::AnyScene::read_in(r#"
    ///     [system.body]
    ///     inertia = [1.0, 2.0, 3.0]
    ///     [start]
    ///     omega = [1.0, 0.5, 0.25]
    ///     [run]
    ///     time = 10.0
    ///     accuracy = 1e-9
    /// "#, &[], "".as_ref())?;
    /// assert!(matches!(scene, herglotz::AnyScene::Body(_)));
    /// # Ok::<(), herglotz::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError`] with the position in the text, or in the override.
    pub fn read_in(text: &str, changes: &[String], folder: &Path) -> Result<Self, SceneError> {
        let file = file::read(text, changes)?;
        Ok(if file.ends.is_some() {
            AnyScene::Path(Box::new(EndsScene::of(text, &file)?))
        } else if file.system.body.is_some() {
            AnyScene::Body(Box::new(BodyScene::of(text, &file)?))
        } else if LatticeScene::is_one(&file) {
            AnyScene::Lattice(Box::new(LatticeScene::of(text, &file)?))
        } else {
            AnyScene::Motion(Box::new(Scene::of(text, &file, folder)?))
        })
    }
}
