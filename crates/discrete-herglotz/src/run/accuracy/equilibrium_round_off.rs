//! The motion that round-off maintains at an equilibrium.

use crate::run::request::Request;
use crate::{Point, State, System, Vector};
use contact_geom::numbers::max_abs_or_nan;

/// The displacement of a motion at an equilibrium by the round-off of its forces alone. Forces that cancel there have
/// the round-off of the terms that cancel, as in `1 - exp(-x)` near `x = 0`: a decaying motion does not become smaller
/// than this.
pub(crate) struct EquilibriumRoundOff {
    /// The displacement of (q, p), in the 2-norm: for each coordinate the round-off of its force divided by its
    /// stiffness, and for each momentum the same divided by the frequency.
    pub displacement: f64,
    /// The round-off of the forces themselves.
    pub force: f64,
    /// The energy of the displacement; it is quadratic in the round-off, and not part of the first-order round-off of
    /// the energy.
    pub energy: f64,
}

impl EquilibriumRoundOff {
    /// The round-off at a point.
    pub fn at(system: &dyn System, t: f64, x: &Point) -> Self {
        if system.hints().hamiltonian {
            // The stiffness is that of L, which need not exist.
            return EquilibriumRoundOff { displacement: 0.0, force: 0.0, energy: 0.0 };
        }
        let (_, of_gradient) = system.rounding(t, x);
        let h = system.hessian(t, x);
        let (mut squares, mut energy) = (0.0, 0.0);
        for i in 0..system.dimension() {
            let (force, stiffness, mass) = (of_gradient.x[i], h.qq[(i, i)].abs(), h.vv[(i, i)].abs());
            // Without stiffness or mass the displacement is undefined.
            if stiffness > 0.0 && mass > 0.0 {
                let squared = force * force / stiffness;
                squares += squared / stiffness + squared * mass;
                energy += squared;
            }
        }
        EquilibriumRoundOff {
            displacement: squares.sqrt(),
            force: max_abs_or_nan(of_gradient.x.iter().copied()),
            energy,
        }
    }
}

/// The round-off of all steps in units of the round-off of one force: the contributions add up at random, and are
/// damped.
pub(crate) fn accumulated_roundings(steps: usize) -> f64 {
    (64.0 + steps as f64).sqrt() * 8.0
}

impl Request<'_> {
    /// The round-off at a state of the motion.
    #[cold]
    #[inline(never)]
    pub(crate) fn equilibrium_round_off(&self, t: f64, state: &State) -> EquilibriumRoundOff {
        let system = &*self.problem.system;
        let still = Point { q: state.q.clone(), v: Vector::zeros(system.dimension()), z: state.z };
        EquilibriumRoundOff::at(system, t, &system.legendre_inverse(t, state, &still.v).unwrap_or(still))
    }
}
