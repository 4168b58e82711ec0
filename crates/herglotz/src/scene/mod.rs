//! Scenes: a system, an initial state or two ends, and the requested output.

mod body;
mod body_file;
mod body_overrides;
mod body_quantity;
mod checked;
mod combinations;
mod constraints;
mod csv_file;
mod ends;
mod error;
mod file;
mod fit;
mod fit_table;
mod forces;
mod lattice;
mod location;
mod members;
mod motion;
mod output;
mod overrides;
mod quantities;
mod resets;
mod start;
mod step_control;
mod sum_of_terms;
mod sweep;
mod system;
mod tables;

pub use body::BodyScene;
pub use combinations::Combinations;
pub use ends::EndsScene;
pub use error::SceneError;
pub use lattice::LatticeScene;
pub use members::Members;
pub use motion::Scene;
pub use sweep::SweptQuantity;

/// The JSON schema of scene files.
pub fn schema() -> serde_json::Value {
    /// A motion of a Lagrangian, of a lattice or of a rigid body with the requested output, or a path between two ends.
    #[derive(schemars::JsonSchema)]
    #[schemars(title = "Scene", untagged)]
    #[expect(dead_code, reason = "it stands for its variants, which are read one by one")]
    enum AnyFile {
        System(file::File),
        Lattice(lattice::LatticeFile),
        Ends(ends::EndsFile),
        Body(body_file::BodyFile),
    }
    schemars::schema_for!(AnyFile).to_value()
}
