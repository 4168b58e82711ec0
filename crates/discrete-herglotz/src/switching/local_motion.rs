//! The motion near a point at which switching functions are evaluated: a point `(q, v, z)`, or `(q, p, z)` with the
//! momentum in the place of the velocity for a system that is given by a contact Hamiltonian.

use crate::{Components, Point, State, System};

/// The state `(q, p, z)` as a point.
pub(crate) fn phase_point(state: &State) -> Point {
    Point { q: state.q.clone(), v: state.p.clone(), z: state.z }
}

/// The derivatives in time along the motion of a point at which switching functions are evaluated; `None` where they are
/// not defined.
pub(crate) fn rates_along_motion(system: &dyn System, t: f64, x: &Point) -> Option<Components> {
    if system.hints().hamiltonian {
        return hamiltonian_motion(system, t, x);
    }
    system.rates(t, x).ok().map(|(field, _)| field)
}

/// The contact Hamiltonian vector field at a point `(q, p, z)`, with the applied force.
fn hamiltonian_motion(system: &dyn System, t: f64, x: &Point) -> Option<Components> {
    let state = State { q: x.q.clone(), p: x.v.clone(), z: x.z };
    let (h, d) = system.hamiltonian_with_gradient(t, &state)?;
    let z = state.p.dot(&d.y) - h;
    let mut force = -(d.x + &state.p * d.z);
    if system.has_force() {
        force += system.applied_force(t, &Point { v: d.y.clone(), ..x.clone() });
    }
    let field = Components { x: d.y, y: force, z };
    field.is_finite().then_some(field)
}

/// The motion near a point, to second order in time.
pub(super) struct LocalMotion<'s> {
    system: &'s dyn System,
    t: f64,
    x: &'s Point,
    rates: Option<Components>,
}

impl<'s> LocalMotion<'s> {
    pub fn at(system: &'s dyn System, t: f64, x: &'s Point) -> Self {
        LocalMotion { system, t, x, rates: rates_along_motion(system, t, x) }
    }

    /// The point after a time; without rates it has no forces.
    pub fn after(&self, dt: f64) -> Point {
        let LocalMotion { system, t, x, rates } = self;
        let is_hamiltonian = system.hints().hamiltonian;
        let Some(rates) = rates else {
            return if is_hamiltonian { (*x).clone() } else { Point { q: &x.q + &x.v * dt, ..(*x).clone() } };
        };
        let along = |by: &Components, dt: f64| Point { q: &x.q + &by.x * dt, v: &x.v + &by.y * dt, z: x.z + by.z * dt };
        if is_hamiltonian {
            // The explicit midpoint rule.
            let middle = rates_along_motion(*system, t + 0.5 * dt, &along(rates, 0.5 * dt));
            return along(middle.as_ref().unwrap_or(rates), dt);
        }
        Point { q: &x.q + (&x.v + &rates.y * (0.5 * dt)) * dt, ..along(rates, dt) }
    }
}
