//! Whether the steps of a motion are contact transformations.

use contact_geom::Statement;

/// The momentum of a symmetry at a sample of a motion, and the prediction of Noether's theorem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentumSample {
    /// The momentum.
    pub momentum: f64,
    /// The initial momentum times the conformal factor.
    pub predicted: f64,
}

/// A sample of a motion: a state at the end of a step, and the step that starts there.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The time.
    pub t: f64,
    /// The conformal factor of the step that starts there.
    pub sigma: f64,
    /// The logarithm of the conformal factor of the motion up to there.
    pub log_factor: f64,
    /// The distance of the pullback of `dz - p dq` by the step from `sigma_d (dz - p dq)`, relative to its size; from
    /// differences of sixth order, which are accurate to about 1e-11.
    pub contact_defect: f64,
    /// The rate at which the steps depart from Herglotz' equations: the distance of (q, p, z) from two steps of half
    /// the length by contact Gauss collocation with 16 stages, relative to the size of the state and per unit of time.
    pub herglotz_defect: f64,
    /// The momenta of the recognised symmetries, in their order.
    pub momenta: Vec<MomentumSample>,
}

/// A statement of the paper on the discrete theory, evaluated at two points of the motion.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct StatementResidual {
    /// The statement.
    pub statement: Statement,
    /// The discrete Lagrangian, by the name of its method.
    pub method: String,
    /// The time between the two points: the step, or a fraction of it where points so far apart have no discrete
    /// Lagrangian.
    pub step_size: f64,
    /// The residual relative to the size of its terms; it is of the size of round-off times the condition number of the
    /// matrices in it.
    pub residual: f64,
}

/// Whether the steps of a motion are contact transformations, and the residuals of the theorems of the discrete theory
/// along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// The integrator.
    pub integrator: String,
    /// The step.
    pub step_size: f64,
    /// The samples of the motion, in the order of the motion.
    pub samples: Vec<Sample>,
    /// The theorems, with the largest residual over a few samples. With a force it is the statement that the contact
    /// defect of a step of Gauss collocation is the virtual work of the force.
    pub statements: Vec<StatementResidual>,
    /// Why contactness is not to be expected, if it is not.
    pub not_contact: Option<NotContact>,
}

/// The reason why a motion is not contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NotContact {
    /// A force acts.
    Forced,
    /// A reset replaces the state, or an impact with restitution.
    Reset,
}

impl std::fmt::Display for NotContact {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            NotContact::Forced => "not contact: forced; the defect is the virtual work of the force",
            NotContact::Reset => "not contact: a reset that replaces the state preserves no contact form",
        })
    }
}

/// The largest defect of a step that counts as contact. Differences of sixth order give 1e-11 for steps of the
/// catalogue's systems; a step of the classical Runge-Kutta method over a tenth of a pendulum's period gives 1e-4.
pub const MAX_CONTACT_DEFECT: f64 = 1e-9;

impl Check {
    /// The largest contact defect.
    pub fn contact_defect(&self) -> f64 {
        contact_geom::numbers::max_abs_or_nan(self.samples.iter().map(|sample| sample.contact_defect))
    }

    /// Whether every step that was checked is contact to within [`MAX_CONTACT_DEFECT`], with a conformal factor that is
    /// finite and not 0: with the factor 0 the pullback is not a contact form. A motion with a force, or with a reset
    /// that replaces the state, is not contact.
    pub fn is_contact(&self) -> bool {
        self.not_contact.is_none() && self.contact_defect() <= MAX_CONTACT_DEFECT && !self.loses_the_form()
    }

    /// Whether the steps have the contact defect that they are to have: none to within [`MAX_CONTACT_DEFECT`], with a
    /// force its virtual work, and any after a reset that replaces the state.
    pub fn is_as_expected(&self) -> bool {
        let worst = || contact_geom::numbers::max_abs_or_nan(self.statements.iter().map(|stated| stated.residual));
        match self.not_contact {
            None => self.is_contact(),
            Some(NotContact::Forced) => worst() <= MAX_CONTACT_DEFECT,
            Some(NotContact::Reset) => true,
        }
    }

    /// Whether the conformal factor of a step is 0 or not finite, as where the drag within one step exceeds the range
    /// of floating-point numbers.
    pub fn loses_the_form(&self) -> bool {
        self.samples.iter().any(|sample| sample.sigma == 0.0 || !sample.sigma.is_finite())
    }

    /// The largest difference between a momentum and its prediction, in units of the largest momentum of any symmetry,
    /// since a momentum that vanishes gives no scale.
    pub fn momentum_defect(&self) -> f64 {
        let all = || self.samples.iter().flat_map(|sample| &sample.momenta);
        let size = contact_geom::numbers::max_abs_or_nan(all().map(|m| m.predicted));
        let apart = contact_geom::numbers::max_abs_or_nan(all().map(|m| m.momentum - m.predicted));
        if size > 0.0 { apart / size } else { apart }
    }
}
