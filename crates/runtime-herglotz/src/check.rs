//! Whether a motion is contact.

use contact_geom::Statement;

/// What a symmetry's momentum is at a place, and what the theorem of Noether predicts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentumSample {
    /// The momentum.
    pub momentum: f64,
    /// That of the start times the conformal factor.
    pub predicted: f64,
}

/// A place along a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// The time.
    pub t: f64,
    /// The conformal factor of the step that starts there.
    pub sigma: f64,
    /// The logarithm of the conformal factor of the motion up to there.
    pub log_factor: f64,
    /// How far the pullback of `dz - p dq` by the step is from `sigma_d` times it, relative to its size; by differences of sixth order,
    /// which see some 1e-11.
    pub contact_defect: f64,
    /// How fast the steps depart from Herglotz' equations: the distance of (q, p, z) from two steps of half the length by contact Gauss
    /// collocation with 16 stages, relative to their size, for a unit of time.
    pub herglotz_defect: f64,
    /// The momenta of the symmetries that are seen, in their order.
    pub momenta: Vec<MomentumSample>,
}

/// A statement of the paper on the discrete theory, evaluated on two points of the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct StatementResidual {
    /// The statement.
    pub statement: Statement,
    /// The discrete Lagrangian, by the name of its method.
    pub method: String,
    /// The time between its points: the step, or a part of it where points so far apart have no discrete Lagrangian.
    pub step_size: f64,
    /// The residual, relative to the size of its terms: round-off times the condition of the matrices in it.
    pub residual: f64,
}

/// Whether the steps of a motion are contact, and the theorems of the discrete theory on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// The integrator.
    pub integrator: String,
    /// The step.
    pub step_size: f64,
    /// Along the motion.
    pub places: Vec<Place>,
    /// The theorems, worst of a few places.
    pub statements: Vec<StatementResidual>,
}

/// The largest defect of a step that counts as contact: what differences of sixth order see of steps of the catalogue's systems is
/// 1e-11; a step of the classical method of Runge and Kutta that moves a pendulum by a tenth of its period has 1e-4.
pub const CONTACT: f64 = 1e-9;

impl Check {
    /// The largest contact defect.
    pub fn contact_defect(&self) -> f64 {
        contact_geom::max_abs_or_nan(self.places.iter().map(|place| place.contact_defect))
    }

    /// Whether every step that was looked at is contact, to [`CONTACT`]: with a factor that is a number other than 0, since what a factor 0
    /// pulls back is no contact form.
    pub fn is_contact(&self) -> bool {
        self.contact_defect() <= CONTACT && !self.loses_the_form()
    }

    /// Whether the conformal factor of a step is 0 or not finite, as where drag within one step is beyond all numbers.
    pub fn loses_the_form(&self) -> bool {
        self.places.iter().any(|place| place.sigma == 0.0 || !place.sigma.is_finite())
    }

    /// The largest departure of a momentum from its prediction, in units of the largest momentum of any symmetry: one that vanishes has no
    /// size of its own.
    pub fn momentum_defect(&self) -> f64 {
        let all = || self.places.iter().flat_map(|place| &place.momenta);
        let size = contact_geom::max_abs_or_nan(all().map(|m| m.predicted));
        let apart = contact_geom::max_abs_or_nan(all().map(|m| m.momentum - m.predicted));
        if size > 0.0 { apart / size } else { apart }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_that_is_none_is_not_contact() {
        let check = |sigma: f64| {
            let place = Place {
                t: 0.0,
                sigma,
                log_factor: 0.0,
                contact_defect: 0.0,
                herglotz_defect: 0.0,
                momenta: Vec::new(),
            };
            Check { integrator: String::new(), step_size: 1.0, places: vec![place], statements: Vec::new() }
        };
        assert!([1.0, -2.0, 1e-300, f64::from_bits(1)].into_iter().all(|sigma| check(sigma).is_contact()));
        for none in [0.0, -0.0, f64::NAN, f64::INFINITY] {
            assert!(!check(none).is_contact() && check(none).loses_the_form(), "{none}");
        }
    }
}
