//! Methods for holonomic constraints as integrators of runs.

use super::drag_rattle::substeps;
use super::start::inverse_mass;
use super::variation::{Along, Varied};
use super::{ConstrainedStart, ContactLobatto, DragRattle, OffConstraint};
use crate::integration::OfTyped;
use crate::integration::{StartProjection, StepFormula, check_kicks};
use crate::{InputError, Integrator, MethodInfo, Problem, SplittingScheme, StepError, Stepper, StepperOptions};
use contact_geom::constraints::{Constraint, ConstraintDerivatives, Redundancy, constrained_motion};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{ChartVector, Dual, Lagrangian, PhasePoint, VelocityPoint};

/// A method for motions under holonomic constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConstrainedMethod {
    /// [`DragRattle`], composed by a scheme: for `v.Mv/2 - V(t, q) + gamma z`.
    Rattle(SplittingScheme),
    /// [`ContactLobatto`] with this number of stages, for any Lagrangian.
    Lobatto {
        /// The number of stages, from 2 to 8.
        stages: usize,
    },
}

/// Constraints with a method, as an [`Integrator`] of a [`Problem`]: runs have rows, events, dense output, checkpoints,
/// a plan and an accuracy as without constraints.
///
/// The start of the problem satisfies the constraints: [`ConstrainedStart::resolved`] projects one that does not. An
/// accuracy is met by runs with steps that are halved until they agree, since collocation, the reference for other
/// integrators, knows no constraints. Derivatives of a run are those of a start that stays on the constraints: it moves along
/// `W^-1 G^T` where they contain a parameter ([`Constraint::in_parameter`]), and in the direction of a variable of the start
/// it is projected to them ([`StartProjection`]).
///
/// ```
/// use contact_examples::systems::constrained::RigidPendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::constraints::{Constrained, ConstrainedMethod};
/// use discrete_herglotz::{Event, Events, Problem, SplittingScheme, Until};
/// let pendulum = RigidPendulum::<2> { gravity: 9.81, gamma: -0.1 };
/// let rattle = Constrained::new(&pendulum, ConstrainedMethod::Rattle(SplittingScheme::KAHAN_LI_8));
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0, 0.0], [0.0, 0.0], 0.0))?;
/// let mut lowest = Events::new([Event::new(|_, x| x.q[0])]);
/// let outcome = problem.by(rattle).accuracy(1e-9).observe(&mut lowest).run(Until::Time(2.0))?;
/// println!("{:?}, lowest at t = {}", outcome.q, lowest.crossings[0].t);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constrained<C, const M: usize> {
    /// The constraints.
    pub constraint: C,
    /// The method.
    pub method: ConstrainedMethod,
    /// What happens where the constraints are redundant.
    pub redundancy: Redundancy,
}

impl<C, const M: usize> Constrained<C, M> {
    /// Constraints that are independent, with a method.
    pub fn new(constraint: C, method: ConstrainedMethod) -> Self {
        Constrained { constraint, method, redundancy: Redundancy::Refuse }
    }
}

impl<C, const M: usize> Constrained<C, M> {
    /// The start of the steps of a problem.
    fn start<const N: usize>(&self, t: f64, at: VelocityPoint<N>) -> ConstrainedStart<N> {
        ConstrainedStart { t, at, off_constraint: OffConstraint::Refuse, redundancy: self.redundancy }
    }
}

impl<'a, L, C, const N: usize, const M: usize> Integrator<'a, L, N> for Constrained<C, M>
where
    L: Lagrangian<N>,
    C: Constraint<N, M> + Clone + 'a,
{
    fn info(&self) -> MethodInfo {
        let symmetric = MethodInfo { symmetric: true, constrained: true, ..MethodInfo::of_discrete::<N>("", 0) };
        match self.method {
            ConstrainedMethod::Rattle(scheme) => MethodInfo {
                name: format!("rattle_{}", scheme.name()).into(),
                order: scheme.order(),
                exact_rate: true,
                substeps: scheme.order() > 2,
                // A force and the multipliers, each with the Jacobian of the constraints.
                cost_per_evaluation: 8 * N as u64,
                source: format!("Andersen, J. Comput. Phys. 52 (1983), 24-34; {}", scheme.source()).into(),
                ..symmetric
            },
            ConstrainedMethod::Lobatto { stages } => MethodInfo {
                name: format!("lobatto_{stages}").into(),
                order: 2 * (stages as u32).saturating_sub(1),
                source: "Jay, SIAM J. Numer. Anal. 33 (1996)".into(),
                ..symmetric
            },
        }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        match self.method {
            ConstrainedMethod::Rattle(scheme) => {
                substeps(&scheme)?;
                let structure = lagrangian.structure();
                let missing = [("separable", structure.separable), ("constant_rate", structure.has_constant_rate())];
                if let Some((claim, _)) = missing.into_iter().find(|(_, claimed)| !claimed) {
                    return Err(InputError::Unclaimed { claim });
                }
                check_kicks(&OfTyped(lagrangian), "RATTLE")
            }
            ConstrainedMethod::Lobatto { stages } => ContactLobatto::<L, C, N, M>::check(stages),
        }
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        _options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        let start = self.start(problem.t0, problem.start);
        let constraint = self.constraint.clone();
        Ok(match self.method {
            ConstrainedMethod::Rattle(scheme) => {
                Box::new(DragRattle::of(problem.lagrangian, constraint, &scheme, h, &start)?)
            }
            ConstrainedMethod::Lobatto { stages } => {
                Box::new(ContactLobatto::of(problem.lagrangian, constraint, stages, h, &start)?)
            }
        })
    }

    fn constraint_force(&self, lagrangian: &L, t: f64, x: &VelocityPoint<N>) -> Result<SVector<f64, N>, StepError> {
        let motion = constrained_motion(lagrangian, &self.constraint, t, x, self.redundancy);
        let multipliers = motion.map_err(|_| StepError::Singular { pivot: 0.0 })?.multipliers;
        Ok(self.constraint.with_jacobian(&x.q).1.transpose() * multipliers)
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Derivatives)
    }

    fn step_jacobian(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        (t, from, _): (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        let step = self.differentiated(problem, h, (t, from))?;
        let mut jacobian = DMatrix::zeros(2 * N + 1, 2 * N + 1);
        for k in 0..=2 * N {
            let slope = step(Some(k), &mut Varied { of: None, parameter: None })?;
            let entries = slope.x.iter().chain(&slope.y).chain([&slope.z]);
            entries.enumerate().for_each(|(i, entry)| jacobian[(i, k)] = *entry);
        }
        Ok(Some(jacobian))
    }

    fn step_variation(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        (t, from, _): (f64, &PhasePoint<N>, &PhasePoint<N>),
        parameter: Option<usize>,
        variation: &mut dyn FnMut(f64, &VelocityPoint<N>) -> (f64, ChartVector<N>),
    ) -> Result<Option<ChartVector<N>>, StepError> {
        self.differentiated(problem, h, (t, from))?(None, &mut Varied { of: Some(variation), parameter }).map(Some)
    }

    fn start_projection(
        &self,
        problem: &Problem<'a, L, N>,
        parameters: usize,
    ) -> Result<Option<StartProjection>, StepError> {
        let (constraint, VelocityPoint { q, v, .. }) = (&self.constraint, problem.start);
        let g = constraint.with_jacobian(&q).1;
        let inverse = inverse_mass(problem.lagrangian, problem.t0, &problem.start)
            .map_err(|_| StepError::Singular { pivot: 0.0 })?;
        let kept = self.redundancy.imposed(constraint.count(), &g);
        let rows: Vec<usize> = (0..M).filter(|a| kept[*a]).collect();
        let mut curvature = SMatrix::<f64, M, N>::zeros();
        for a in rows.iter().copied() {
            let only = SVector::from_fn(|b, _| f64::from(u8::from(a == b)));
            curvature.set_row(a, &(constraint.force_slope(&q, &only) * v).transpose());
        }
        let of = |k| constraint.in_parameter(k, &q).map(|(c, jacobian)| [c, jacobian * v]);
        let of_parameters = (0..parameters).map(of);
        StartProjection::new(&rows, (&g, &curvature), &inverse, of_parameters).map(Some)
    }
}

/// The derivative of the end of a step along a coordinate of its start, in the order q, p, z, if one is given, and a
/// variation of L.
type StepDerivative<'s, const N: usize> =
    Box<dyn Fn(Option<usize>, &mut Varied<'_, N>) -> Result<ChartVector<N>, StepError> + 's>;

impl<C, const M: usize> Constrained<C, M> {
    /// The derivative of a step that starts at a time and a state.
    fn differentiated<'s, 'a: 's, L: Lagrangian<N>, const N: usize>(
        &'s self,
        problem: &Problem<'a, L, N>,
        h: f64,
        (t, from): (f64, &'s PhasePoint<N>),
    ) -> Result<StepDerivative<'s, N>, StepError>
    where
        C: Constraint<N, M>,
    {
        let x = crate::theory::legendre_inverse(problem.lagrangian, t, from, &problem.start.v)?;
        let start = self.start(t, x);
        let (of, constraint) = (crate::error::step_error, &self.constraint);
        Ok(match self.method {
            ConstrainedMethod::Rattle(scheme) => {
                let motion = DragRattle::of(problem.lagrangian, constraint, &scheme, h, &start).map_err(of)?;
                Box::new(move |k, vary| Ok(slope(&motion.step_varied(t, &moving(from, k), vary)?.end)))
            }
            ConstrainedMethod::Lobatto { stages } => {
                let motion = ContactLobatto::of(problem.lagrangian, constraint, stages, h, &start).map_err(of)?;
                Box::new(move |k, vary| Ok(slope(&motion.step_varied(t, &moving(from, k), &x.v, vary)?.end)))
            }
        })
    }
}

/// A state with the derivative one in a coordinate, if one is given.
fn moving<const N: usize>(at: &PhasePoint<N>, k: Option<usize>) -> PhasePoint<N, Along> {
    let number = |i: usize, re: f64| Dual { re, d: SVector::<f64, 1>::new(f64::from(u8::from(Some(i) == k))) };
    PhasePoint {
        q: SVector::from_fn(|i, _| number(i, at.q[i])),
        p: SVector::from_fn(|i, _| number(N + i, at.p[i])),
        z: number(2 * N, at.z),
    }
}

/// The derivatives of a state.
fn slope<const N: usize>(x: &PhasePoint<N, Along>) -> ChartVector<N> {
    ChartVector { x: x.q.map(|q| q.d[0]), y: x.p.map(|p| p.d[0]), z: x.z.d[0] }
}
