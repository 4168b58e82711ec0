//! Systems with parameters, as derivatives of runs see them.

use crate::gauss::system::CollocationSystem;
use crate::integration::SolvedStages;
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{StageMap, Stages};
use crate::sensitivity::linear_stages::{Inhomogeneity, StageTangent};
use crate::sensitivity::of_parametric::OfParametric;
use crate::sensitivity::of_slices::{BySlices, stages_of};
use crate::sensitivity::of_system::OfSystem;
use crate::sensitivity::stage_derivatives::StageDerivatives;
use crate::sensitivity::step_maps::StepMaps;
use crate::sensitivity::switch::Argument;
use crate::{Components, Point, Problem, State, StepError, System, SystemProblem, Vector};
use contact_geom::switching::BreakRate;
use contact_geom::{Parametric, UnknownParameter};
use std::rc::Rc;

pub(crate) use crate::system::{ExplicitDerivatives, Quantity};

/// Evaluates derivatives with respect to parameters and time, with the workspace for them.
pub(crate) trait Quantities {
    /// The number of parameters.
    fn count(&self) -> usize;

    /// The derivatives at a point.
    fn at(&mut self, quantity: Quantity, t: f64, x: &Point) -> ExplicitDerivatives;

    /// The same derivatives of a contact Hamiltonian at a state: `H_theta` in the place of `L_theta`,
    /// `(H_qtheta, H_ptheta, H_ztheta)`, and the derivative of the force with that of the velocity `H_p`. NaN for a
    /// Lagrangian that is not given by one.
    fn of_hamiltonian(&mut self, quantity: Quantity, t: f64, state: &State) -> ExplicitDerivatives {
        let _ = (quantity, t);
        ExplicitDerivatives::undefined(state.q.len())
    }

    /// The derivative of the momentum `L_v` of a given velocity, at a state that has this velocity.
    fn of_momentum(&mut self, quantity: Quantity, t: f64, at: (&Point, &Vector)) -> Vector;

    /// Adds the derivatives at the stages of a step to sources, times a factor for each stage: those of `L_v`, of `L_q + f`, of L
    /// and of `L_z`, without the factor rho.
    fn add_at_stages(
        &mut self,
        _arch: Instructions,
        quantity: Quantity,
        at: &StageDerivatives,
        factors: &Stages,
        to: &mut Inhomogeneity,
    ) {
        let (n, (_, mut x)) = (at.q.len(), at.point(0));
        for i in 0..at.s {
            let t = at.move_point(i, &mut x);
            let (of, factor) = (self.at(quantity, t, &x), factors.0[i]);
            let (of_q, of_v, force) = (&of.gradient.x[..n], &of.gradient.y[..n], &of.force[..n]);
            for d in 0..n {
                to.v_source[d].0[i] += factor * of_v[d];
                to.p_source[d].0[i] += factor * (of_q[d] + force[d]);
            }
            to.z_source.0[i] += factor * of.l;
            to.r_source.0[i] += factor * of.gradient.z;
        }
    }

    /// `d(rho L_theta)[w] + rho f_theta . w_q` at the stages of a step, multiplied by the weights and summed.
    fn along(
        &mut self,
        arch: Instructions,
        quantity: Quantity,
        at: &StageDerivatives,
        along: (&StageTangent, &Stages),
    ) -> f64;
}

/// The derivatives of a [`System`] at the stages of steps, and in parameters and time. The linear algebra of the derivatives
/// of runs stands above it, and is compiled once for all systems.
pub(crate) trait StageSystem<'a> {
    /// The derivatives with respect to parameters and time.
    fn quantities(&self) -> Box<dyn Quantities + 'a>;

    /// Evaluates the derivatives at the stages of a step; `forward` are its maps. Where the step does not have its values of
    /// L, L is `L_0 + gamma z` with constant gamma, and `actions` maps `z0 + A L_0` to z.
    ///
    /// # Errors
    /// [`StepError::Singular`] where W is singular at a stage, [`StepError::NonFinite`] where a derivative is not finite.
    fn evaluate_stages(
        &self,
        arch: Instructions,
        at: &mut StageDerivatives,
        forward: &StepMaps,
        step: &SolvedStages,
        actions: Option<&StageMap>,
    ) -> Result<(), StepError>;
}

/// What derivatives of runs need of a [`System`] beside its [stages](StageSystem).
pub(crate) trait ParametricSystem<'a> {
    /// The names of the parameters.
    fn parameter_names(&self) -> Vec<String>;

    /// Their values, in the order of the names.
    fn parameters(&self) -> Vec<f64>;

    /// The index of a parameter.
    ///
    /// # Errors
    /// [`UnknownParameter`] if there is none of this name.
    fn parameter_index(&self, name: &str) -> Result<usize, UnknownParameter> {
        let names = self.parameter_names();
        names.iter().position(|known| known == name).ok_or_else(|| UnknownParameter::new(name, names))
    }

    /// A function of the system for other values of the parameters; `None` where there is no such system.
    fn with_parameters(&self, theta: &[f64], f: &mut dyn FnMut(&dyn System) -> Option<Vec<f64>>) -> Option<Vec<f64>>;

    /// The derivative of a switching function along an argument; `None` where it is not known.
    fn switching_function_along(&self, along: Argument, index: usize, t: f64, x: &Point) -> Option<f64>;

    /// The derivative of the `(q, v, z)` after a reset along an argument; `None` where it is not known.
    fn state_after_switch_along(&self, along: Argument, index: usize, t: f64, x: &Point) -> Option<Components>;

    /// The times of kinks and jumps with their derivatives in a parameter; `None` where these are not known.
    fn break_rates(&self, parameter: usize) -> Option<Vec<BreakRate>>;

    /// The contact Hamiltonian by which the Lagrangian is given, as collocation sees it; `None`, the default, for all others.
    fn hamiltonian(&self) -> Option<Box<dyn CollocationSystem + 'a>> {
        None
    }
}

/// A problem whose runs can be differentiated: of a [`Parametric`] Lagrangian, or of any [`System`].
pub trait DifferentiableProblem<'a> {
    /// The problem with the derivatives of its system.
    fn differentiable(&'a self) -> Differentiable<'a>;
}

impl<'a, L: Parametric<N>, const N: usize> DifferentiableProblem<'a> for Problem<'a, L, N> {
    fn differentiable(&'a self) -> Differentiable<'a> {
        let problem = self.of_system();
        let stages = if const { L::HINTS.over_slices } {
            let by_slices = self.lagrangian.over_slices(BySlices(problem.system.clone()));
            by_slices.unwrap_or_else(|| stages_of(&problem.system))
        } else {
            Rc::new(OfParametric(self.lagrangian))
        };
        Differentiable { problem, of: Rc::new(OfParametric(self.lagrangian)), stages }
    }
}

impl<'a> DifferentiableProblem<'a> for SystemProblem<'a> {
    fn differentiable(&'a self) -> Differentiable<'a> {
        let of = Rc::new(OfSystem(self.system.clone()));
        Differentiable { problem: self.clone(), of, stages: stages_of(&self.system) }
    }
}

/// A problem with the derivatives of its system, as derivatives of runs use it.
#[derive(Clone)]
pub struct Differentiable<'a> {
    pub(crate) problem: SystemProblem<'a>,
    pub(crate) of: Rc<dyn ParametricSystem<'a> + 'a>,
    pub(crate) stages: Rc<dyn StageSystem<'a> + 'a>,
}

impl<'a> Differentiable<'a> {
    /// The number of coordinates.
    pub(crate) fn dimension(&self) -> usize {
        self.problem.system.dimension()
    }

    /// The system.
    pub(crate) fn system(&self) -> &(dyn System + 'a) {
        &*self.problem.system
    }

    /// Whether the Lagrangian is given by a contact Hamiltonian.
    pub(crate) fn is_hamiltonian(&self) -> bool {
        self.problem.system.hints().hamiltonian
    }
}
