//! Scenes: a system, an initial state or two ends, and the requested output.

mod any;
mod body;
mod body_overrides;
mod body_quantity;
mod body_table;
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
mod only;
mod output;
mod overrides;
mod profile;
mod property;
mod quantities;
mod resets;
mod start;
mod step_control;
mod sum_of_terms;
mod sweep;
mod system;
mod tables;

pub use any::AnyScene;
pub use body::BodyScene;
pub use combinations::Combinations;
pub use ends::EndsScene;
pub use error::SceneError;
pub use file::VERSION;
pub use lattice::LatticeScene;
pub use members::Members;
pub use motion::Scene;
pub use property::Property;
pub use sweep::SweptQuantity;

/// The JSON schema of scene files.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(file::File).to_value()
}
