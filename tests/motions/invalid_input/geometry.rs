//! Invalid input to contact-geom and to the gallery of systems. Their formulas are pointwise: a NaN is returned or refused, never lost.

mod constraints;
mod forms;
mod groups;
mod hamiltonian_systems;
mod hamiltonians;
mod lagrangians;
mod scalars;
mod switching;

use crate::invalid_input::{Exceptions, InputTest};

pub const EXCEPTIONS: Exceptions = &[
    ("Lagrangian::closed_*", "the implementor's, and nothing by default"),
    ("Lagrangian::switching_functions", "the implementor's, and none by default"),
    ("Lagrangian::structure", "the implementor's, and takes no number"),
    ("ContactHamiltonian::*", "the implementor's"),
    ("HamiltonianStructure::of_lagrangian", "takes no number"),
    ("Lagrangian::hamiltonian_*", "those of OfHamiltonian, whose Hamiltonian is tested"),
    ("OfHamiltonian::hamiltonian", "takes no number"),
    ("ParametricHamiltonian::*", "the implementor's; tests/hamiltonians/hamiltonians/derivatives"),
    ("OneParameterGroup::act", "the implementor's; that of Symmetry is tested with its callers"),
    ("Constraint::value", "the implementor's"),
    ("Constraint::count", "takes no number"),
    ("Distribution::omega", "the implementor's"),
    ("GroupLagrangian::constant_rate", "the implementor's, and takes no number"),
    ("GroupForce::*", "the implementor's; forces are tested in crates/discrete-herglotz/tests/groups/derivatives"),
    ("GroupLagrangian::applied_force", "the implementor's; tested with forces"),
    ("GroupLagrangian::is_forced", "the implementor's, and takes no number"),
    ("GroupPotential::parameter_names", "the implementor's, and takes no number"),
    ("GroupPotential::parameters", "the implementor's, and takes no number"),
    ("GroupPotential::value_at", "the implementor's; tested with the derivatives in the parameters"),
    (
        "ParametricGroupLagrangian::*",
        "the implementor's; compared with differences in crates/discrete-herglotz/tests/groups/derivatives",
    ),
    ("GroupLagrangian::value", "the implementor's; that of RigidBody is tested by its partials"),
    ("GroupPotential::value", "the implementor's; that of UniformGravity is tested with its gradient"),
    ("Inertia::axes", "takes no number"),
    ("Inertia::matrix", "takes no number"),
    ("Inertia::moments", "takes no number"),
    ("LieGroup::advance", "its sums are tested with GroupMotion::advance"),
    ("LieGroup::angle", "a norm"),
    ("LieGroup::identity", "takes no number"),
    ("LieGroup::lift", "takes the caller's function"),
    ("LieGroup::null", "takes no number"),
    ("RigidBody::gamma", "takes no number"),
    ("RigidBody::mass", "takes no number"),
    ("RigidBody::potential", "takes no number"),
    ("SystemVisitor::*", "the implementor's"),
    ("System::*", "the implementor's: constants and samples"),
    ("ClosedFlow::*", "the implementor's"),
    ("systems::*", "walk the catalogue, and take no number"),
    ("Bodies::new", "stores its arguments; every start checks them"),
    ("Bodies::masses", "takes no number"),
    ("Chain::free", "takes no number"),
    ("Duffing::forced", "takes no number"),
    ("Lienard::initial", "takes no number"),
    ("VanDerPol::initial", "takes no number"),
    ("Containers::initial", "takes no number"),
    ("HeatedOscillator::initial", "takes no number"),
    ("Piston::initial", "takes no number"),
    ("SpinOrbit::initial", "takes no number"),
    ("SpinOrbit::coefficient", "takes the number of a harmonic"),
    ("Gas::ideal", "takes no number"),
    ("Gas::van_der_waals", "stores its arguments; every start checks them"),
    ("VectorField::is_autonomous", "the implementor's, and takes no number"),
    ("Hints::of_any", "takes no number"),
    ("Structure::has_constant_rate", "takes no number"),
    ("Structure::is_affine_in_z", "takes no number"),
    ("Forced::new", "stores its arguments; every start checks them"),
    ("Scalar::piecewise", "the caller's function; tables are tested"),
    ("Statement::*", "takes no number but its own; its test tries all"),
    ("ChartVector::from_fn", "the caller's function"),
    (
        "Parametric::*",
        "the implementor's; those of the catalogue are compared with differences in tests/derivatives/gradients",
    ),
    ("ParametricForce::*", "the implementor's; tests/derivatives/gradients/forces"),
    ("Surface::parameter*", "the implementor's, and none by default; tests/derivatives/gradients/impacts"),
    ("Surface::value_at", "the implementor's; tests/derivatives/gradients/impacts"),
    ("Surface::with_parameters", "the implementor's; tests/derivatives/gradients/impacts"),
    ("Impact::parameter_name", "takes no number"),
    ("nearest_name", "takes no number"),
    ("indexed_names", "takes the number of the names"),
    ("extended", "copies its arguments"),
    ("split_last", "copies its argument"),
    ("$name::new", "stores its arguments; check() and every start check them"),
];

pub const TESTS: &[&[InputTest]] = &[
    constraints::TESTS,
    forms::TESTS,
    groups::TESTS,
    hamiltonian_systems::TESTS,
    hamiltonians::TESTS,
    lagrangians::TESTS,
    scalars::TESTS,
    switching::TESTS,
];
