//! Ensembles of systems with any number of coordinates.

use crate::ensemble::builder::Ensemble;
use crate::ensemble::members::{LaneKernel, MemberRun, MemberSteps, Members};
use crate::ensemble::settings::Settings;
use crate::integration::BatchKernel;
use crate::switching::{CollocationByPoints, CollocationSteppers};
use crate::system::caught;
use crate::{
    Components, GaussCollocation, InitialState, InputError, Interrupt, MethodInfo, Point, State, Steps, System,
    SystemProblem,
};

/// The number of stages if no integrator is given.
const DEFAULT_STAGES: usize = 8;

/// How the steps of the members are determined.
#[derive(Clone, Copy)]
enum Length {
    Given(Steps),
    Accuracy(f64),
}

/// The system and the start of a member, as a function of its index.
type MemberOf<'a> = Box<dyn Fn(usize) -> (&'a (dyn System + Sync + 'a), InitialState) + Sync + 'a>;

/// The members of an [`Ensemble`] of systems whose number of coordinates is known at run time.
pub struct Systems<'a> {
    of: MemberOf<'a>,
    n: usize,
    t0: f64,
    stages: Option<usize>,
    length: Option<Length>,
}

impl<'m> Ensemble<'_, Systems<'m>> {
    /// An ensemble of motions from the time `t0`, of systems with any number of coordinates; the system and the start of
    /// each are functions of its index. The motions run by contact Gauss collocation, each in a run of its own,
    /// distributed over the threads.
    ///
    /// ```
    /// use contact_geom::nalgebra::DMatrix;
    /// use discrete_herglotz::{Components, Ensemble, Point, SecondDerivatives, System, Until, Vector};
    ///
    /// /// Two oscillators under linear drag.
    /// struct Pair;
    ///
    /// impl System for Pair {
    ///     fn dimension(&self) -> usize {
    ///         2
    ///     }
    ///     fn value(&self, _t: f64, x: &Point) -> f64 {
    ///         (x.v.norm_squared() - x.q.norm_squared()) / 2.0 - x.z / 10.0
    ///     }
    ///     fn gradient(&self, _t: f64, x: &Point) -> Components {
    ///         Components { x: -x.q.clone(), y: x.v.clone(), z: -0.1 }
    ///     }
    ///     fn hessian(&self, _t: f64, _x: &Point) -> SecondDerivatives {
    ///         let (one, line) = (DMatrix::identity(2, 2), Vector::zeros(2));
    ///         SecondDerivatives { qq: -&one, qv: DMatrix::zeros(2, 2), vv: one, qz: line.clone(), vz: line, zz: 0.0 }
    ///     }
    /// }
    ///
    /// let start = |i: usize| Point { q: Vector::from([0.1 * i as f64, 1.0]), v: Vector::zeros(2), z: 0.0 };
    /// let ensemble = Ensemble::of_systems(0.0, 10, |i| (&Pair as &(dyn System + Sync), start(i))).accuracy(1e-9);
    /// let tally = ensemble.run(Until::Time(10.0), |member| {
    ///     if let Ok(ending) = &member.ending {
    ///         println!("{}: q = {:?}", member.index, ending.state.q);
    ///     }
    /// })?;
    /// # assert_eq!(tally.completed, 10);
    /// # Ok::<(), discrete_herglotz::ensemble::EnsembleError>(())
    /// ```
    pub fn of_systems<X: Into<InitialState>>(
        t0: f64,
        count: usize,
        member: impl Fn(usize) -> (&'m (dyn System + Sync + 'm), X) + Sync + 'm,
    ) -> Self {
        let n = if count > 0 { caught(|| member(0).0.dimension(), || 0) } else { 0 };
        let of = move |index: usize| {
            let (system, start) = member(index);
            (system, start.into())
        };
        let members = Systems { of: Box::new(of), n, t0, stages: None, length: None };
        Ensemble { members, settings: Settings::new(count) }
    }

    /// Sets the number of stages of contact Gauss collocation; the default is 8.
    pub fn by(self, integrator: GaussCollocation) -> Self {
        Ensemble { members: Systems { stages: Some(integrator.stages), ..self.members }, ..self }
    }

    /// Sets the size or the number of the steps.
    pub fn steps(self, steps: Steps) -> Self {
        Ensemble { members: Systems { length: Some(Length::Given(steps)), ..self.members }, ..self }
    }

    /// Requests an error of (q, p) and v instead of a step size, as in a run of a [`SystemProblem`]: each member has its own
    /// steps.
    pub fn accuracy(self, wanted: f64) -> Self {
        Ensemble { members: Systems { length: Some(Length::Accuracy(wanted)), ..self.members }, ..self }
    }
}

impl Systems<'_> {
    fn integrator(&self) -> GaussCollocation {
        GaussCollocation { stages: self.stages.unwrap_or(DEFAULT_STAGES) }
    }
}

impl Members for Systems<'_> {
    fn dimension(&self) -> usize {
        self.n
    }

    fn info(&self) -> MethodInfo {
        CollocationByPoints.gauss(self.integrator().stages).info()
    }

    fn batch_kernel(&self) -> Option<BatchKernel> {
        None
    }

    fn requested_error(&self) -> Option<f64> {
        match self.length {
            Some(Length::Accuracy(wanted)) => Some(wanted),
            _ => None,
        }
    }

    fn selects_integrator(&self) -> bool {
        self.stages.is_none() && self.requested_error().is_some()
    }

    fn t0(&self) -> f64 {
        self.t0
    }

    fn is_complete(&self) -> Result<(), InputError> {
        self.length.map(|_| ()).ok_or(InputError::NoSteps)
    }

    fn with_run(
        &self,
        index: usize,
        (steps, interrupt): (MemberSteps, Option<Interrupt<'_>>),
        then: &mut dyn FnMut(MemberRun<'_, '_>),
    ) -> Result<(), InputError> {
        let (system, start) = (self.of)(index);
        let problem = SystemProblem::new(system, self.t0, start)?;
        let problem = match interrupt {
            Some(interrupt) => problem.with_interrupt(interrupt),
            None => problem,
        };
        let length = if let MemberSteps::Given(steps) = steps { Some(Length::Given(steps)) } else { self.length };
        let run = match (length, self.stages) {
            (None, _) => return Err(InputError::NoSteps),
            (Some(Length::Given(steps)), _) => problem.by(self.integrator()).steps(steps),
            (Some(Length::Accuracy(wanted)), None) => problem.accuracy(wanted),
            (Some(Length::Accuracy(wanted)), Some(_)) => problem.by(self.integrator()).accuracy(wanted),
        };
        then(run.without_type());
        Ok(())
    }

    fn with_system(&self, index: usize, then: &mut dyn FnMut(&dyn System)) {
        then((self.of)(index).0);
    }

    /// Each member has a run of its own, which needs no state.
    fn start(&self, index: usize) -> (*const (), Option<State>) {
        (std::ptr::from_ref((self.of)(index).0).cast(), None)
    }

    fn digits(&self, index: usize) -> Vec<f64> {
        let (system, start) = (self.of)(index);
        let (q, y, z) = match start {
            InitialState::Velocity(x) => (x.q, x.v, x.z),
            InitialState::Momentum(x, _) => (x.q, x.p, x.z),
        };
        let x = Point { q, v: y, z };
        let (l, slope) =
            caught(|| (system.value(self.t0, &x), system.gradient(self.t0, &x)), || (f64::NAN, Components::zeros(0)));
        [&x.q, &x.v, &slope.x, &slope.y].into_iter().flat_map(|x| x.iter().copied()).chain([x.z, l, slope.z]).collect()
    }

    fn kernel<'e>(
        &'e self,
        _at: (usize, &State),
        _plan: (f64, usize),
        _interrupt: Option<Interrupt<'e>>,
    ) -> Option<Box<dyn LaneKernel + 'e>> {
        None
    }
}
