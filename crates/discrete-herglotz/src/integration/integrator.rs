//! Integrators: what advances a run.

use crate::{InputError, Problem, SplittingScheme, Stepper};
use std::borrow::Cow;

/// What is known of an integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct MethodInfo {
    /// The name in tables, in lower case with underscores.
    pub name: Cow<'static, str>,
    /// The order of the flow; in transformed time, in steps of its time.
    pub order: u32,
    /// Whether it is its own adjoint: a step back leads to where a step came from.
    pub symmetric: bool,
    /// Whether its steps take forces alone, and solve no equation.
    pub explicit: bool,
    /// Whether `sigma_d = e^(gamma h)` for a Lagrangian with the linear drag `gamma z`, as for the motion itself.
    pub exact_rate: bool,
    /// Whether its steps are equal in the transformed time that the Lagrangian states, and end where the span does.
    pub in_transformed_time: bool,
    /// The number of stages, of contact Gauss collocation.
    pub collocation: Option<usize>,
    /// Whether a step consists of others, back and forth.
    pub substeps: bool,
    /// Whether it divides its steps where the motion is fast, and at kinks and jumps of the Lagrangian.
    pub divides: bool,
    /// What one of its [evaluations](Stepper::evaluations) costs, in evaluations of L at a stage of Gauss collocation.
    pub cost_per_evaluation: u64,
    /// Where it is from: authors, journal, year.
    pub source: Cow<'static, str>,
}

impl MethodInfo {
    /// Those of an implicit method that is not known to be symmetric: the least that is true of a discrete Lagrangian in N coordinates.
    pub fn of_discrete<const N: usize>(name: impl Into<Cow<'static, str>>, order: u32) -> Self {
        MethodInfo {
            name: name.into(),
            order,
            symmetric: false,
            explicit: false,
            exact_rate: false,
            in_transformed_time: false,
            collocation: None,
            substeps: false,
            divides: false,
            // Newton's method takes second derivatives.
            cost_per_evaluation: 32 * N as u64,
            source: Cow::Borrowed(""),
        }
    }
}

/// What is asked of a stepper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepperOptions {
    /// The action, also where it does not act back on the motion.
    pub action: bool,
    /// That it watches whether its steps resolve the motion, where that has a price; see [`Stepper::unresolved`] and [`Stepper::suspect_interval`].
    pub watched: bool,
}

/// A way to advance the motions of Lagrangians L in N coordinates: the rules, the splittings, the compositions and the collocation methods
/// of this crate, the exact flow, and a user's own.
///
/// Who has a [`DiscreteLagrangian`](crate::DiscreteLagrangian) needs no implementation: see [`CustomMethod`](crate::CustomMethod).
pub trait Integrator<'a, L, const N: usize> {
    /// What is known of it.
    fn info(&self) -> MethodInfo;

    /// Whether a Lagrangian meets its hypotheses.
    ///
    /// # Errors
    /// [`InputError::Unclaimed`] with the claim that is missing, [`InputError::Hypothesis`], [`InputError::Stages`].
    fn check(&self, lagrangian: &L) -> Result<(), InputError>;

    /// A stepper at the start of a problem, by steps of h: negative ones go back in time.
    ///
    /// # Errors
    /// [`InputError`] where the problem does not meet its hypotheses, or the first step cannot be taken.
    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        wants: StepperOptions,
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError>;

    /// What an [`Ensemble`](crate::Ensemble) has a kernel for that takes these steps for many motions at once; `None` where each has a
    /// stepper of its own.
    fn batch_kernel(&self) -> Option<BatchKernel> {
        None
    }
}

/// What an [`Integrator`] has a kernel for that takes a step of many motions at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BatchKernel {
    /// The steps of a splitting with linear drag.
    Splitting(SplittingScheme),
    /// Those of contact Gauss collocation, for constant mass and constant rate of the conformal factor.
    Gauss {
        /// The number of stages.
        stages: usize,
    },
}
