//! The members of an ensemble, as its run sees them: without the Lagrangian and the number of coordinates.

use crate::ensemble::gauss::GaussPacks;
use crate::ensemble::lane::{Lane, LaneOptions};
use crate::ensemble::single::OfMember;
use crate::ensemble::splitting::SplittingPacks;
use crate::ensemble::step_control::StepControl;
use crate::integration::{BatchKernel, OfTyped, is_separable};
use crate::numbers::instructions::Instructions;
use crate::switching::has_switching_functions;
use crate::{InputError, Integrator, Interrupt, MethodInfo, Point, Problem, Run, Start, State, Steps, System};
use contact_geom::{ChartVector, Derivatives, Lagrangian, PhasePoint, VelocityPoint, legendre};

/// The run of a member.
pub type MemberRun<'p, 'o> = Run<'p, 'o, ()>;

/// The steps of the run of a member.
#[derive(Clone, Copy, PartialEq)]
pub enum MemberSteps {
    /// Those of a single run.
    Own,
    /// Steps that all members can take together in lanes: equal steps of the integrator.
    Common,
    /// These.
    Given(Steps),
}

/// The members of an ensemble with their integrator and its steps.
pub trait Members: Sync {
    /// The number of coordinates.
    fn dimension(&self) -> usize;

    /// The properties of the integrator.
    fn info(&self) -> MethodInfo;

    /// The kernel of the integrator for many motions.
    fn batch_kernel(&self) -> Option<BatchKernel>;

    /// The requested error, if one is requested.
    fn requested_error(&self) -> Option<f64>;

    /// Whether the run of a member has an integrator that is selected for its accuracy; that of the ensemble is then the
    /// one of the lanes.
    fn selects_integrator(&self) -> bool;

    /// The time of all starts.
    fn t0(&self) -> f64;

    /// Whether the integrator and the steps are given.
    ///
    /// # Errors
    /// [`InputError::NoIntegrator`], [`InputError::NoSteps`].
    fn is_complete(&self) -> Result<(), InputError>;

    /// Calls a function with the run of a member, which has these steps and this interrupt.
    ///
    /// # Errors
    /// Those of [`Problem::new`].
    fn with_run(
        &self,
        index: usize,
        settings: (MemberSteps, Option<Interrupt<'_>>),
        then: &mut dyn FnMut(MemberRun<'_, '_>),
    ) -> Result<(), InputError>;

    /// Calls a function with the system of a member.
    fn with_system(&self, index: usize, then: &mut dyn FnMut(&dyn System));

    /// The address of the Lagrangian of a member, and the state `(q, p, z)` of its start if it is finite.
    fn start(&self, index: usize) -> (*const (), Option<State>);

    /// Numbers by which a member is recognised: its start, and L with its derivatives there.
    fn digits(&self, index: usize) -> Vec<f64>;

    /// The kernel for members with the Lagrangian of this one, whose constants are read at a state, and for a number of
    /// steps.
    fn kernel<'e>(
        &'e self,
        at: (usize, &State),
        plan: (f64, usize),
        interrupt: Option<Interrupt<'e>>,
    ) -> Option<Box<dyn LaneKernel + 'e>>;
}

/// The steps of many motions of one Lagrangian in SIMD lanes.
pub trait LaneKernel: Sync {
    /// Whether a motion needs a run of its own, since sums in lanes would lose the increments of its steps.
    fn needs_single_run(&self, state: &State) -> bool;

    /// Takes all steps of some motions in place.
    fn run(&self, instructions: Instructions, lanes: &mut [Lane], action: bool, options: LaneOptions);
}

/// The Lagrangian and the start of a member, as a function of its index.
pub(crate) type MemberOf<'a, L, const N: usize> = Box<dyn Fn(usize) -> (&'a L, Start<N>) + Sync + 'a>;

/// The members of an [`Ensemble`](crate::Ensemble) of Lagrangians of one type, in N coordinates.
pub struct Lagrangians<'a, L, const N: usize> {
    pub(crate) of: MemberOf<'a, L, N>,
    pub(crate) t0: f64,
    pub(crate) integrator: Option<Box<dyn Integrator<'a, L, N> + Sync + 'a>>,
    /// See [`Members::selects_integrator`].
    pub(crate) selects_integrator: bool,
    pub(crate) length: Option<StepControl<L, N>>,
}

impl<'a, L: Lagrangian<N>, const N: usize> Lagrangians<'a, L, N> {
    /// The integrator and the steps.
    ///
    /// # Errors
    /// [`InputError::NoIntegrator`], [`InputError::NoSteps`].
    pub(crate) fn method(&self) -> Result<(&(dyn Integrator<'a, L, N> + Sync + 'a), StepControl<L, N>), InputError> {
        let integrator = self.integrator.as_deref().ok_or(InputError::NoIntegrator)?;
        Ok((integrator, self.length.ok_or(InputError::NoSteps)?))
    }

    /// Calls a function with the run of a member.
    ///
    /// # Errors
    /// Those of [`method`](Self::method) and of [`Problem::new`].
    pub(crate) fn with<R, E: From<InputError>>(
        &self,
        index: usize,
        (steps, interrupt): (MemberSteps, Option<Interrupt<'_>>),
        then: impl FnOnce(Run<'_, '_, Problem<'_, L, N>>) -> Result<R, E>,
    ) -> Result<R, E> {
        let (integrator, length) = self.method()?;
        let (lagrangian, start) = (self.of)(index);
        let problem = Problem { interrupt, ..Problem::new(lagrangian, self.t0, start)? };
        let by = || problem.by(OfMember { integrator, lagrangian });
        then(match (steps, length) {
            (MemberSteps::Given(steps), _) | (_, StepControl::Given(steps)) => by().steps(steps),
            (_, StepControl::Accuracy(wanted, within)) if !self.selects_integrator => within(by(), wanted, false),
            (MemberSteps::Common, StepControl::Accuracy(wanted, within)) => within(by(), wanted, true),
            (MemberSteps::Own, StepControl::Accuracy(wanted, within)) => within(Run::typed(&problem), wanted, false),
        })
    }
}

impl<L: Lagrangian<N> + Sync, const N: usize> Members for Lagrangians<'_, L, N> {
    fn dimension(&self) -> usize {
        N
    }

    fn info(&self) -> MethodInfo {
        match &self.integrator {
            Some(integrator) => integrator.info(),
            None => MethodInfo::of_discrete::<N>("", 0),
        }
    }

    fn batch_kernel(&self) -> Option<BatchKernel> {
        self.integrator.as_ref().and_then(|integrator| integrator.batch_kernel())
    }

    fn requested_error(&self) -> Option<f64> {
        self.length.and_then(|length| length.requested_error())
    }

    fn selects_integrator(&self) -> bool {
        self.selects_integrator && self.requested_error().is_some()
    }

    fn t0(&self) -> f64 {
        self.t0
    }

    fn is_complete(&self) -> Result<(), InputError> {
        self.method().map(|_| ())
    }

    fn with_run(
        &self,
        index: usize,
        settings: (MemberSteps, Option<Interrupt<'_>>),
        then: &mut dyn FnMut(MemberRun<'_, '_>),
    ) -> Result<(), InputError> {
        self.with(index, settings, |run| {
            then(run.without_type());
            Ok(())
        })
    }

    fn with_system(&self, index: usize, then: &mut dyn FnMut(&dyn System)) {
        then(&OfTyped((self.of)(index).0));
    }

    fn start(&self, index: usize) -> (*const (), Option<State>) {
        let (lagrangian, start) = (self.of)(index);
        let state = match start {
            Start::Velocity(x) => legendre(lagrangian, self.t0, &x),
            Start::Momentum(x, _) => x,
        };
        (std::ptr::from_ref(lagrangian).cast(), ChartVector::from(state).is_finite().then(|| state.into()))
    }

    fn digits(&self, index: usize) -> Vec<f64> {
        let (lagrangian, start) = (self.of)(index);
        let (q, y, z) = match start {
            Start::Velocity(x) => (x.q, x.v, x.z),
            Start::Momentum(x, _) => (x.q, x.p, x.z),
        };
        let (value, slope) = lagrangian.with_gradient_and_force(self.t0, &VelocityPoint { q, v: y, z });
        let vectors = [&q, &y, &slope.x, &slope.y];
        vectors.into_iter().flat_map(|x| x.iter().copied()).chain([z, value, slope.z]).collect()
    }

    fn kernel<'e>(
        &'e self,
        (index, state): (usize, &State),
        plan: (f64, usize),
        interrupt: Option<Interrupt<'e>>,
    ) -> Option<Box<dyn LaneKernel + 'e>> {
        // The kernels evaluate L.
        if const { L::HINTS.hamiltonian } {
            return None;
        }
        let lagrangian = (self.of)(index).0;
        let (system, structure) = (OfTyped(lagrangian), lagrangian.structure());
        // With switching functions, steps end on kinks, at different times for each member.
        let start = Point::new(state.q.clone(), state.p.clone(), state.z);
        if has_switching_functions(&system, self.t0, &start) != Ok(false) {
            return None;
        }
        let (separable, state): (bool, PhasePoint<N>) = (is_separable(&system, &structure), state.fixed());
        // If the kernel cannot be created, the runs of the members report the cause.
        match self.batch_kernel() {
            Some(BatchKernel::Splitting(scheme)) if separable && structure.is_affine_in_z() => {
                let packs = SplittingPacks::new(lagrangian, &scheme, plan, self.t0, &state).ok()?;
                Some(Box::new(packs.with_interrupt(interrupt)))
            }
            Some(BatchKernel::Gauss { stages }) if separable && structure.has_constant_rate() => {
                let packs = GaussPacks::new(lagrangian, stages, plan, self.t0, &state).ok()?;
                Some(Box::new(packs.with_interrupt(interrupt)))
            }
            _ => None,
        }
    }
}
