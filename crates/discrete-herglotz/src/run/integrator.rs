//! The table of integrators.

use crate::{Gauss, InputError, Method, SplittingScheme};
use contact_geom::{Lagrangian, Structure};
use std::fmt::{Display, Formatter};
use std::str::FromStr;
use thiserror::Error;

/// How a scene is advanced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// The flow of a discrete Lagrangian, each step by Newton's method.
    Discrete(Method),
    /// Contact Gauss collocation with 1 to 16 stages, of order twice their number, for every regular Lagrangian.
    Gauss {
        /// The number of stages.
        stages: usize,
    },
    /// The same with steps that are equal in the time of the clock which an autonomous Lagrangian states: short where its motion is
    /// fast, and the last one shorter, so that it ends where the span does.
    Clocked {
        /// The number of stages.
        stages: usize,
    },
    /// A splitting with exact rate, for `v.Mv/2 - V(t, q) + f(z)`.
    Splitting(SplittingScheme),
    /// A symmetric composition of a symmetric rule of order 2.
    Composition(Method, SplittingScheme),
}

impl Integrator {
    /// Every integrator by one name: quadrature rules, Gauss methods, splittings, the compositions of the symmetric midpoint rule, and
    /// Gauss methods by a clock.
    pub fn all() -> Vec<Integrator> {
        let discrete = Method::RULES.iter().copied().map(Integrator::Discrete);
        let gauss = (1..=Gauss::<()>::STAGES).map(|stages| Integrator::Gauss { stages });
        let splittings = SplittingScheme::ALL.into_iter().map(Integrator::Splitting);
        let compositions = SplittingScheme::ALL.into_iter().filter(|s| !s.is_nystrom() && s.order() > 2);
        let compositions = compositions.map(|scheme| Integrator::Composition(Method::Midpoint, scheme));
        let clocked = (1..=Gauss::<()>::STAGES).map(|stages| Integrator::Clocked { stages });
        discrete.chain(gauss).chain(splittings).chain(compositions).chain(clocked).collect()
    }

    /// The order of the flow; by a clock, in steps of its time.
    pub fn order(self) -> u32 {
        match self {
            Integrator::Discrete(method) => method.order(),
            Integrator::Gauss { stages } | Integrator::Clocked { stages } => 2 * stages as u32,
            Integrator::Splitting(scheme) | Integrator::Composition(_, scheme) => scheme.order(),
        }
    }

    /// Whether a Lagrangian meets the hypotheses of the method.
    ///
    /// # Errors
    /// [`InputError::Unclaimed`] with the claim that is missing, [`InputError::Hypothesis`], and [`InputError::Stages`].
    pub fn check<const N: usize, L: Lagrangian<N>>(self, lagrangian: &L) -> Result<(), InputError> {
        self.check_form(&lagrangian.structure(), L::HAS_CLOCK)
    }

    /// The same for a Lagrangian of a form, with a clock or without.
    fn check_form(self, structure: &Structure, has_clock: bool) -> Result<(), InputError> {
        match self {
            Integrator::Discrete(method) => method.check(structure),
            Integrator::Gauss { stages } | Integrator::Clocked { stages }
                if !(1..=Gauss::<()>::STAGES).contains(&stages) =>
            {
                Err(InputError::Stages { found: stages })
            }
            Integrator::Clocked { .. } if !has_clock => Err(InputError::Hypothesis {
                hypothesis: "a Lagrangian that states a clock (`HAS_CLOCK`, `clock_rate`)",
            }),
            Integrator::Clocked { .. } if !structure.autonomous => Err(InputError::Unclaimed { claim: "autonomous" }),
            Integrator::Clocked { .. } => Ok(()),
            Integrator::Gauss { .. } => Ok(()),
            Integrator::Splitting(_) if !structure.separable => Err(InputError::Unclaimed { claim: "separable" }),
            // The third flow, that of f(z), leaves the hypothesis of Runge-Kutta-Nyström methods.
            Integrator::Splitting(scheme) if scheme.is_nystrom() && !structure.is_affine_in_z() => {
                Err(InputError::Unclaimed { claim: "z_affine" })
            }
            Integrator::Splitting(_) => Ok(()),
            Integrator::Composition(method, scheme) => {
                if !method.symmetric() || method.order() != 2 || scheme.is_nystrom() {
                    return Err(InputError::Hypothesis { hypothesis: "a composition of a symmetric rule of order 2" });
                }
                method.check(structure)
            }
        }
    }
}

/// The name in tables: `midpoint`, `gauss_8`, `clocked_gauss_8`, `kahan_li_8`, `midpoint_by_kahan_li_8`.
impl Display for Integrator {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            Integrator::Discrete(method) => f.pad(method.name()),
            Integrator::Gauss { stages } => f.pad(&format!("gauss_{stages}")),
            Integrator::Clocked { stages } => f.pad(&format!("clocked_gauss_{stages}")),
            Integrator::Splitting(scheme) => f.pad(scheme.name()),
            Integrator::Composition(method, scheme) => f.pad(&format!("{method}_by_{}", scheme.name())),
        }
    }
}

/// From the name.
impl FromStr for Integrator {
    type Err = UnknownIntegrator;

    fn from_str(name: &str) -> Result<Self, UnknownIntegrator> {
        let named = Self::all().into_iter().find(|integrator| integrator.to_string() == name);
        named.ok_or_else(|| UnknownIntegrator { name: name.into() })
    }
}

/// No integrator has this name.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("there is no integrator {name:?}; there are {}", Integrator::all().iter().map(|i| i.to_string()).collect::<Vec<_>>().join(", "))]
pub struct UnknownIntegrator {
    /// The name that was asked for.
    pub name: String,
}
