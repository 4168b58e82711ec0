//! Invalid input to what interrupts a motion: impacts, named times, tables.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EVERYTHING, EXTREME, Report};
use contact_geom::nalgebra::SVector;
use contact_geom::switching::{Breaks, Control, Impact, Impacts, Surface};
use contact_geom::table::{Interpolation, Table, TableError};
use contact_geom::{GeometryError, Lagrangian, Scalar, VelocityPoint};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
            "Surface::value",
            "Surface::normal",
            "Impact::factor",
            "Impact::after",
            "Impacts::new",
            "Lagrangian::at_switch",
            "Lagrangian::at_accumulation",
        ],
        run: impacts,
    },
    InputTest { entries: &["Breaks::new", "Lagrangian::breaks"], run: breaks },
    InputTest {
        entries: &[
            "Table::new",
            "Table::knots",
            "Table::interpolation",
            "Table::degree",
            "Table::value",
            "Table::derivative",
        ],
        run: tables,
    },
];

/// A plane with a slope in time.
struct Plane(f64);

impl Surface<1> for Plane {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>) -> T {
        q[0] - t * self.0
    }
}

/// A state after an impact is finite and leaves the surface, or there is none, and the switch of the Lagrangian then has a
/// state that the stepper refuses.
fn impacts(report: &mut Report) {
    for u in EXTREME {
        let (normal, rate) = Plane(u).normal(0.0, &[0.3].into());
        report.check((normal[0] == 1.0 || !u.is_finite()) && (rate == -u || !u.is_finite()), || {
            format!("the normal for the rate {u}")
        });
        for law in [Impact::Elastic, Impact::Restitution(u), Impact::Conformal(u), Impact::Restitution(0.5)] {
            report.check(law.factor().is_none_or(|c| c == 1.0 || c == u || u.is_nan()), || format!("{law:?}"));
            for v in EXTREME {
                let x = VelocityPoint::new([0.3], [v], 0.1);
                let after = law.after(&EVERYTHING, 0.2, &x, (&normal, rate));
                let leaves = after.is_none_or(|y| y.v[0].is_finite() && (normal.dot(&y.v) + rate) * (v - u) <= 0.0);
                report.check(leaves, || format!("{law:?} of v = {v} at a wall of velocity {u}: {after:?}"));
                let wall = Impacts::new(EVERYTHING, Plane(u), law);
                let stays = matches!(wall.at_switch(0, 0.2, &x, true), Control::Continue);
                report.check(stays, || "an impact of a motion that rises".into());
                let refused = match wall.at_switch(0, 0.2, &x, false) {
                    Control::Replace(to) | Control::Conformal { to, .. } => after.is_some() || !to.v[0].is_finite(),
                    _ => false,
                };
                report.check(refused, || format!("{law:?} of v = {v} is lost"));
                report.check(wall.at_accumulation(0, u, &x) == Control::Continue, || "a limit has a state".into());
            }
        }
    }
}

fn breaks(report: &mut Report) {
    for t in EXTREME {
        let found = Breaks::new(EVERYTHING, vec![2.0, t, 1.0, t]);
        match found {
            Ok(found) => {
                let times = Lagrangian::<1>::breaks(&found);
                let ascending = times.is_sorted_by(|a, b| a < b) && times.len() <= 3;
                report.check(t.is_finite() && ascending, || format!("{t} is a break: {times:?}"));
            }
            Err(error) => {
                let named = matches!(error, GeometryError::NonFinite { what: "breaks", index: 1, .. });
                report.check(!t.is_finite() && named, || format!("{t}: {error}"));
            }
        }
    }
}

fn tables(report: &mut Report) {
    for pieces in [Interpolation::Held, Interpolation::Linear, Interpolation::Cubic] {
        let new = |times: &[f64], values: &[f64]| Table::new(times, values, pieces);
        report.check(matches!(new(&[0.0], &[1.0]), Err(TableError::TooFew { found: 1 })), || "one sample".into());
        report.check(matches!(new(&[0.0, 1.0], &[1.0]), Err(TableError::Lengths { .. })), || "lengths".into());
        report.check(matches!(new(&[0.0, 0.0], &[1.0, 2.0]), Err(TableError::Order { .. })), || "equal times".into());
        for u in EXTREME {
            for (times, values) in [([0.0, 1.0, u], [0.0, 1.0, 2.0]), ([0.0, 1.0, 2.0], [0.0, u, 2.0])] {
                let Ok(table) = new(&times, &values) else { continue };
                report.check(u.is_finite() && table.interpolation() == pieces, || format!("{u} is a sample"));
                report.check(table.knots() == times && table.degree() <= 3, || "the knots".into());
                for t in EXTREME {
                    // A time that is not finite has no value.
                    let (value, slope) = (table.value(t), table.derivative(1, t));
                    let known = !t.is_finite() || value.is_finite() && slope.is_finite();
                    report.check(known, || format!("{pieces:?} with {u} at {t}: {value}, {slope}"));
                }
            }
        }
    }
}
