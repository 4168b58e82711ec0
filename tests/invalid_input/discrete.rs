//! Attacks on discrete-herglotz. What starts a motion refuses what is not finite, and what it hands out is finite; formulas hand
//! on what is not a number, or refuse it.

#[path = "discrete/boundary.rs"]
mod boundary;
#[path = "discrete/ensembles.rs"]
mod ensembles;
#[path = "discrete/integrators.rs"]
mod integrators;
#[path = "discrete/lagrangians.rs"]
mod lagrangians;
#[path = "discrete/observers.rs"]
mod observers;
#[path = "discrete/runs.rs"]
mod runs;
#[path = "discrete/steppers.rs"]
mod steppers;

use crate::numbers::places;
use crate::{Attack, Exceptions};
use contact_geom::PhasePoint;

pub const EXCEPTIONS: Exceptions = &[
    ("Method::name", "takes no number"),
    ("Interrupt::when", "takes no number"),
    ("Problem::with_interrupt", "takes no number"),
    ("Ensemble::with_interrupt", "takes no number"),
    ("jumps_between", "compares signs along a curve; every point of a run with switching functions is an attack on it"),
    ("Method::order", "takes no number"),
    ("Method::symmetric", "takes no number"),
    ("Method::implicit_in_z", "takes no number"),
    ("Method::exact_rate", "takes no number"),
    ("Method::check", "takes no number"),
    ("Method::applicable", "takes no number"),
    ("Method::visit_rules", "takes no number"),
    ("RuleVisitor::*", "the implementor's"),
    ("SplittingScheme::*", "tables: take no number"),
    ("AnyIntegrator::all", "takes no number"),
    ("AnyIntegrator::order", "takes no number; that of any number of stages is in the attack on check"),
    ("DiscreteLagrangian::is_explicit", "takes no number"),
    ("DiscreteLagrangian::constant_rate", "takes no number"),
    ("DiscreteLagrangian::order", "takes no number"),
    ("EnergyDrift::first", "takes no number"),
    ("Rule::is_symmetric", "takes no number"),
    ("ActionFlow::*", "the implementor's; that of Riccati is attacked with what calls it"),
    ("Observer::*", "the implementor's; what a run makes of odd ones is in the attack on Run::observe"),
];

pub const ATTACKS: &[&[Attack]] = &[
    boundary::ATTACKS,
    ensembles::ATTACKS,
    integrators::ATTACKS,
    lagrangians::ATTACKS,
    observers::ATTACKS,
    runs::ATTACKS,
    steppers::ATTACKS,
];

/// Times and states to start from, and whether they are finite.
fn starts() -> Vec<(f64, PhasePoint<1>)> {
    places().into_iter().map(|(t, x)| (t, x.into())).collect()
}

/// Steps beside those that are refused.
const STEPS: [f64; 8] = [1e-300, 1e-12, 0.1, 1e3, 1e300, -1e-12, -0.1, -1e3];
