//! Invalid input to discrete-herglotz. A start that is not finite is refused, and the states of a motion are finite;
//! formulas return a number that is not finite for such input, or refuse it.

mod boundary;
mod constraints;
mod derivatives;
mod ensembles;
mod groups;
mod hamiltonians;
mod integrators;
mod lagrangians;
mod observers;
pub mod runs;
mod steppers;
mod systems;

use crate::invalid_input::numbers::places;
use crate::invalid_input::{Exceptions, InputTest};
use contact_geom::PhasePoint;

pub const EXCEPTIONS: Exceptions = &[
    ("ContactIncrement::*", "arithmetic: a result that is not finite follows from input that is not"),
    ("ContactPiece::*", "the implementor's; the flows of the pieces are tested with their steppers"),
    ("PieceList::*", "calls its pieces"),
    ("PointFlow::*", "the implementor's"),
    ("Polynomial::coefficients", "the implementor's"),
    ("GroupDerivatives::contact_defect_beside", "arithmetic; contact_defect calls it"),
    ("GroupGauss::lagrangian", "takes no number"),
    ("GroupGauss::stages", "takes no number"),
    ("groups::group_distance", "arithmetic: a result that is not finite follows from input that is not"),
    ("GroupEvent::*", "functions and flags; a function that is not finite is tested in the tests of the crate"),
    ("GroupIntegrator::step_size", "takes no number"),
    ("GroupIntegrator::velocity", "is tested with the first step of a motion"),
    ("GroupMotion::initial_time", "takes no number"),
    ("GroupMotion::save", "takes no number"),
    ("GroupMotion::t", "takes no number"),
    ("GroupObserver::*", "the implementor's"),
    ("GroupRun::new", "a number of steps; tested with the run"),
    ("GroupState::after", "arithmetic: a result that is not finite follows from input that is not"),
    ("GroupState::spatial_momentum", "arithmetic: a result that is not finite follows from input that is not"),
    ("RigidBodySplitting::body", "takes no number"),
    ("Progress::new", "takes no number"),
    ("Method::name", "takes no number"),
    ("Interrupt::when", "takes no number"),
    ("Problem::with_interrupt", "takes no number"),
    ("Ensemble::with_interrupt", "takes no number"),
    ("jumps_between", "compares signs along a curve; every run with switching functions calls it"),
    ("Method::order", "takes no number"),
    ("Method::symmetric", "takes no number"),
    ("Method::implicit_in_z", "takes no number"),
    ("Method::exact_rate", "takes no number"),
    ("Method::check", "takes no number"),
    ("Method::applicable", "takes no number"),
    ("System::*", "the implementor's; faults of its value and derivatives are tested with runs"),
    ("TypedSystem::*", "those of the Lagrangian, which are the implementor's"),
    ("SystemProblem::with_interrupt", "takes no number"),
    ("SystemProblem::start", "takes no number"),
    ("SystemProblem::state", "takes no number"),
    ("Vector::*", "arithmetic: a result that is not finite follows from input that is not"),
    ("sorted", "orders by `total_cmp`, in which NaN has a place"),
    ("Method::rule", "takes no number"),
    ("Quadrature::rule", "takes no number"),
    ("Node::reflected", "takes no number"),
    ("Rule::is_symmetric", "takes no number"),
    ("Rule::is_implicit_in_z", "takes no number"),
    ("SplittingScheme::*", "tables: take no number"),
    ("AnyIntegrator::all", "takes no number"),
    ("AnyIntegrator::order", "takes no number; the test of check calls it for any number of stages"),
    ("DiscreteLagrangian::is_explicit", "takes no number"),
    ("DiscreteLagrangian::constant_rate", "takes no number"),
    ("DiscreteLagrangian::order", "takes no number"),
    ("DiscreteLagrangian::has_forces", "takes no number"),
    ("EnergyDrift::first", "takes no number"),
    ("exact_sum", "arithmetic: a result that is not finite follows from input that is not"),
    ("Drift::*", "arithmetic: a result that is not finite follows from input that is not"),
    ("Node::reflected", "takes no number"),
    ("Rule::is_symmetric", "takes no number"),
    ("ActionFlow::*", "the implementor's; that of Riccati is tested with its callers"),
    ("Resets::new", "takes no number"),
    ("StepView::inverse_mass", "takes no number; crates/runtime/tests/motions"),
    ("StepView::is_at_rest", "takes no number; crates/runtime/tests/rest.rs"),
    ("StepView::resets", "takes no number; tests/motions/resets"),
    ("Stepper::last_step", "takes no number"),
    ("Stepper::run_support", "takes no number"),
    ("Stepper::run_support_mut", "takes no number"),
    ("StepDetails::resets", "takes no number; tests/motions/resets"),
    ("StepDetails::pieces", "takes no number; tests/motions/resets"),
    ("StepDetails::has_changed_energy", "takes no number; tests/motions/resets"),
    ("Ensemble::gradient", "the members' runs and gradients; tests/derivatives/gradients/ensembles"),
    ("Ensemble::gradient_of", "tests/derivatives/gradients/ensembles"),
    ("Ensemble::gradient_at", "tests/derivatives/gradients/ensembles"),
    ("Ensemble::tangent_at", "tests/derivatives/gradients/ensembles"),
    ("BatchGradient::*", "takes no number"),
    ("LyapunovExponents::*", "takes no number"),
    ("Run::lyapunov_exponents", "takes no number"),
    ("Run::lyapunov_exponents_within", "tests/derivatives/gradients/lyapunov"),
    ("Integrator::step_jacobian", "tests/derivatives/discrete_tangents"),
    ("GroupBreaks::divides", "takes a time and a length that are those of steps"),
    ("GroupBreaks::integrator", "takes no number"),
    ("ParametricGroupIntegrator::*", "the integrators'; crates/discrete-herglotz/tests/groups"),
    ("Integrator::start_projection", "takes no number; crates/runtime/tests/motions/constrained_derivatives"),
    ("Integrator::step_variation", "crates/discrete-herglotz/tests/constraints/derivatives"),
    ("DiscretizationMethod::step_jacobian", "tests/derivatives/discrete_tangents"),
    ("Integrator::step_formula", "takes no number"),
    ("RunSupport::restart", "takes a state of a run"),
    ("DiscretizationMethod::step_formula", "takes no number"),
    ("StepDetails::solved_stages", "takes no number"),
    ("SolvedStages::*", "takes no number"),
    ("StepDetails::solved_parts", "takes no number"),
    ("SolvedPart::*", "takes no number"),
    ("StateDerivative::dot", "arithmetic: a NaN stays one"),
    ("MotionState::event_time", "tests/derivatives/gradients/impacts"),
    ("MotionState::rates", "takes a state of a run; tests/derivatives/gradients/impacts by event_time"),
    ("EventTime::along", "arithmetic: a NaN stays one"),
    ("StateDerivative::at_moving_time", "arithmetic: a NaN stays one"),
    ("EndCovector::zero", "takes no number"),
    ("MotionState::fixed", "takes no number"),
    ("DifferentiableProblem::differentiable", "takes no number"),
    ("ExplicitDerivatives::zeros", "takes no number"),
    ("Components::*", "arithmetic: a result that is not finite follows from input that is not"),
    ("ForceDerivatives::of_slices", "arithmetic: a result that is not finite follows from input that is not"),
    ("MotionState::differentiate", "arithmetic: a derivative that is not finite follows from input that is not"),
    ("Loss::value", "the implementor's"),
    ("Run::tangent", "tests/derivatives/gradients/invalid_input; the second derivatives here include it"),
    ("Run::tangent_at", "tests/derivatives/gradients/invalid_input"),
    ("Run::record", "tests/derivatives/gradients/invalid_input"),
    ("Run::gradient*", "tests/derivatives/gradients/invalid_input"),
    ("RecordedRun::*", "tests/derivatives/gradients/invalid_input"),
    ("Observer::*", "the implementor's; observers with odd requests are in the test of Run::observe"),
];

pub const TESTS: &[&[InputTest]] = &[
    boundary::TESTS,
    constraints::TESTS,
    derivatives::TESTS,
    ensembles::TESTS,
    groups::TESTS,
    hamiltonians::TESTS,
    integrators::TESTS,
    lagrangians::TESTS,
    observers::TESTS,
    runs::TESTS,
    steppers::TESTS,
    systems::TESTS,
];

/// Times and states to start from, some of them not finite.
fn starts() -> Vec<(f64, PhasePoint<1>)> {
    places().into_iter().map(|(t, x)| (t, x.into())).collect()
}

/// Steps that are accepted.
const STEPS: [f64; 8] = [1e-300, 1e-12, 0.1, 1e3, 1e300, -1e-12, -0.1, -1e3];
