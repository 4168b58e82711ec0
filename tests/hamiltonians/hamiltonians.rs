//! Contact Hamiltonians given directly: contact Gauss collocation whatever the rank of `H_pp`, and runs on it.

mod catalogue;
mod derivatives;
mod modified;
mod runs;
mod steps;
mod switches;
mod systems;
