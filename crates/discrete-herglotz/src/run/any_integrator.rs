//! The integrators of this crate, by name.

use crate::{
    DividedGauss, GaussCollocation, InputError, Integrator, MethodInfo, Problem, SplittingScheme, Stepper,
    StepperOptions, TransformedGauss,
    gauss::Gauss,
    integration::{BatchKernel, StepFormula},
    rules::{CompositionMethod, Method},
};
use contact_geom::Lagrangian;
use std::fmt::{Display, Formatter};
use std::str::FromStr;
use thiserror::Error;

/// Any integrator of this crate, selected by name at run time. A program that uses this type compiles all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum AnyIntegrator {
    /// The flow of a discrete Lagrangian, each step by Newton's method; for [`Method::Strang`] by the splitting of this
    /// name, which has the same flow.
    Discrete(Method),
    /// [`GaussCollocation`].
    Gauss {
        /// The number of stages.
        stages: usize,
    },
    /// [`TransformedGauss`].
    TransformedGauss {
        /// The number of stages.
        stages: usize,
    },
    /// [`DividedGauss`]; the name contains the largest defect: `divided_gauss_8_1e-5`.
    Divided(DividedGauss),
    /// A splitting whose conformal factor is exact, for `v.Mv/2 - V(t, q) + f(z)`.
    Splitting(SplittingScheme),
    /// A symmetric composition of a symmetric rule of order 2.
    Composition(Method, SplittingScheme),
}

/// Evaluates an expression with the integrator of each variant.
macro_rules! each {
    ($any:expr, $integrator:ident => $result:expr) => {
        match $any {
            // The discrete Lagrangian of Strang's splitting has the splitting's flow, which is explicit.
            AnyIntegrator::Discrete(Method::Strang) => {
                let $integrator = SplittingScheme::STRANG;
                $result
            }
            AnyIntegrator::Discrete($integrator) => $result,
            AnyIntegrator::Gauss { stages } => {
                let $integrator = GaussCollocation { stages };
                $result
            }
            AnyIntegrator::TransformedGauss { stages } => {
                let $integrator = TransformedGauss { stages };
                $result
            }
            AnyIntegrator::Divided($integrator) => $result,
            AnyIntegrator::Splitting($integrator) => $result,
            AnyIntegrator::Composition(rule, scheme) => {
                let $integrator = CompositionMethod::new(rule, scheme);
                $result
            }
        }
    };
}

impl AnyIntegrator {
    /// All integrators whose names contain no number that the user chooses freely: quadrature rules, Gauss methods,
    /// splittings, compositions of the symmetric midpoint rule, and Gauss methods in transformed time.
    pub fn all() -> Vec<AnyIntegrator> {
        let discrete = Method::RULES.iter().copied().map(AnyIntegrator::Discrete);
        let gauss = (1..=Gauss::<()>::STAGES).map(|stages| AnyIntegrator::Gauss { stages });
        let splittings = SplittingScheme::ALL.into_iter().map(AnyIntegrator::Splitting);
        let compositions = SplittingScheme::ALL.into_iter().filter(|s| !s.is_nystrom() && s.order() > 2);
        let compositions = compositions.map(|scheme| AnyIntegrator::Composition(Method::Midpoint, scheme));
        let transformed = (1..=Gauss::<()>::STAGES).map(|stages| AnyIntegrator::TransformedGauss { stages });
        discrete.chain(gauss).chain(splittings).chain(compositions).chain(transformed).collect()
    }

    /// The order of the flow; for a method in transformed time, with respect to the step in that time.
    pub fn order(self) -> u32 {
        match self {
            AnyIntegrator::Discrete(method) => method.order(),
            AnyIntegrator::Gauss { stages }
            | AnyIntegrator::TransformedGauss { stages }
            | AnyIntegrator::Divided(DividedGauss { stages, .. }) => 2 * stages as u32,
            AnyIntegrator::Splitting(scheme) | AnyIntegrator::Composition(_, scheme) => scheme.order(),
        }
    }

    /// Whether a Lagrangian meets the hypotheses of the method.
    ///
    /// # Errors
    /// Those of [`Integrator::check`].
    pub fn check<const N: usize, L: Lagrangian<N>>(self, lagrangian: &L) -> Result<(), InputError> {
        each!(self, integrator => Integrator::<'_, L, N>::check(&integrator, lagrangian))
    }
}

impl<'a, L: Lagrangian<N> + 'a, const N: usize> Integrator<'a, L, N> for AnyIntegrator {
    fn info(&self) -> MethodInfo {
        let info = each!(*self, integrator => Integrator::<'a, L, N>::info(&integrator));
        MethodInfo { name: self.to_string().into(), ..info }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        AnyIntegrator::check(*self, lagrangian)
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        each!(*self, integrator => integrator.stepper(problem, h, options))
    }

    fn batch_kernel(&self) -> Option<BatchKernel> {
        each!(*self, integrator => Integrator::<'a, L, N>::batch_kernel(&integrator))
    }

    fn step_formula(&self) -> Option<StepFormula> {
        each!(*self, integrator => Integrator::<'a, L, N>::step_formula(&integrator))
    }
}

/// The name in tables: `midpoint`, `gauss_8`, `transformed_gauss_8`, `kahan_li_8`, `midpoint_by_kahan_li_8`.
impl Display for AnyIntegrator {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            AnyIntegrator::Discrete(method) => f.pad(method.name()),
            AnyIntegrator::Gauss { stages } => f.pad(&format!("gauss_{stages}")),
            AnyIntegrator::TransformedGauss { stages } => f.pad(&format!("transformed_gauss_{stages}")),
            AnyIntegrator::Divided(divided) => f.pad(&divided.name()),
            AnyIntegrator::Splitting(scheme) => f.pad(scheme.name()),
            AnyIntegrator::Composition(method, scheme) => f.pad(&format!("{method}_by_{}", scheme.name())),
        }
    }
}

/// Parses the name.
impl FromStr for AnyIntegrator {
    type Err = UnknownIntegrator;

    fn from_str(name: &str) -> Result<Self, UnknownIntegrator> {
        let named = Self::all().into_iter().find(|integrator| integrator.to_string() == name);
        // `all` lists compositions of the midpoint rule only; compositions of the other rules are parsed here.
        let composed = || {
            let (rule, scheme) = name.split_once("_by_")?;
            let scheme = SplittingScheme::ALL.into_iter().find(|known| known.name() == scheme)?;
            Some(AnyIntegrator::Composition(rule.parse().ok()?, scheme))
        };
        let divided = || {
            let (stages, defect) = name.strip_prefix("divided_gauss_")?.split_once('_')?;
            let divided = DividedGauss { stages: stages.parse().ok()?, max_defect: defect.parse().ok()? };
            Some(AnyIntegrator::Divided(divided))
        };
        named.or_else(composed).or_else(divided).ok_or_else(|| UnknownIntegrator { name: name.into() })
    }
}

/// Serializes as the name.
#[cfg(feature = "serde")]
impl serde::Serialize for AnyIntegrator {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Deserializes from the name.
#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for AnyIntegrator {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = <String as serde::Deserialize>::deserialize(deserializer)?;
        name.parse().map_err(serde::de::Error::custom)
    }
}

/// The error of a name that belongs to no integrator.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("unknown integrator {name:?}; the integrators are {}", AnyIntegrator::all().iter().map(|i| i.to_string()).collect::<Vec<_>>().join(", "))]
pub struct UnknownIntegrator {
    /// The requested name.
    pub name: String,
}
