//! The engine of the page on which anyone types a Lagrangian: four functions that take and return JSON.
//!
//! A request is the text of a scene with changes of single values, as [`AnyScene::read_in`] takes them. The functions are [`describe`]
//! (the names, values and symmetries of a scene), [`run`] (its motion, by the integrators of this project or by a Runge-Kutta method),
//! [`cloud`] (many starts on a circle in a plane of position and momentum) and [`check`] (whether steps are contact transformations).
//! Every answer is an object; one with the key `error` says what is wrong with the scene, and where. Rows of numbers are
//! passed to the host while they are computed.
//!
//! Exported for WebAssembly by [`exports`]; the page itself is in the folder `web`.
//!
//! [`AnyScene::read_in`]: herglotz::AnyScene::read_in

#![deny(missing_docs)]

mod check;
mod cloud;
mod describe;
pub mod exports;
mod host;
mod numbers;
mod recorder;
mod request;
mod run;
mod runge_kutta;

pub use check::check;
pub use cloud::cloud;
pub use describe::describe;
pub use run::run;
