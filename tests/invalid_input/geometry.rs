//! Attacks on contact-geom. Its formulas are pointwise: what is not a number is handed on or refused, never lost.

#[path = "geometry/forms.rs"]
mod forms;
#[path = "geometry/lagrangians.rs"]
mod lagrangians;
#[path = "geometry/scalars.rs"]
mod scalars;

use crate::{Attack, Exceptions};

pub const EXCEPTIONS: Exceptions = &[
    ("Lagrangian::closed_*", "the implementor's, and nothing by default"),
    ("Lagrangian::switching_functions", "the implementor's, and none by default"),
    ("Lagrangian::structure", "the implementor's, and takes no number"),
    ("OneParameterGroup::act", "the implementor's; that of Symmetry is attacked with what calls it"),
    ("SystemVisitor::*", "the implementor's"),
    ("System::*", "the implementor's: constants and samples"),
    ("ClosedFlow::*", "the implementor's"),
    ("systems::*", "walk the catalogue, and take no number"),
    ("Bodies::new", "holds what it is given; every start looks at it"),
    ("Bodies::masses", "takes no number"),
    ("Chain::free", "takes no number"),
    ("Duffing::forced", "takes no number"),
    ("Lienard::initial", "takes no number"),
    ("VanDerPol::initial", "takes no number"),
    ("Structure::has_constant_rate", "takes no number"),
    ("Structure::is_affine_in_z", "takes no number"),
    ("Statement::*", "takes no number but its own, of which its test tries all"),
    ("ChartVector::from_fn", "the caller's function"),
    ("$name::new", "holds what it is given; check() and every start look at it"),
];

pub const ATTACKS: &[&[Attack]] = &[forms::ATTACKS, lagrangians::ATTACKS, scalars::ATTACKS];
