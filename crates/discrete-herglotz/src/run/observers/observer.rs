//! What looks at a run while it goes on.

use crate::run::checks::energy::EnergySums;
use crate::run::{Motion, ResumeState};
use crate::{DenseStep, InputError, StepError, Stepper, UnresolvedStep};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;
use std::ops::ControlFlow;

/// What an observer asks of a run beside times, positions and momenta. What no observer asks for, and the outcome does not want either, is
/// not computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputRequest {
    /// The action z.
    pub action: bool,
    /// The conformal factor of the motion, the product of the `sigma_d`.
    pub conformal_factor: bool,
    /// That the stepper can be [saved](Stepper::save).
    pub saved: bool,
}

impl OutputRequest {
    /// The action alone.
    pub const ACTION: OutputRequest = OutputRequest { action: true, conformal_factor: false, saved: false };

    /// What either asks for.
    pub fn and(self, other: Self) -> Self {
        OutputRequest {
            action: self.action || other.action,
            conformal_factor: self.conformal_factor || other.conformal_factor,
            saved: self.saved || other.saved,
        }
    }
}

/// What a run will be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunInfo {
    /// The time of its start.
    pub t0: f64,
    /// The time of its end; before that of the start where the run goes back.
    pub t_end: f64,
    /// The length of its steps, where all are equal; negative where the run goes back.
    pub h: Option<f64>,
    /// The number of its steps, where that is known before: of a time transformation it shows at the end.
    pub count: Option<usize>,
}

impl RunInfo {
    /// Of an observer that has not been told its own.
    pub(crate) const NONE: RunInfo = RunInfo { t0: 0.0, t_end: 0.0, h: None, count: None };
}

/// What a run does with its states: it is shown the start, at least the steps that it asks for, and the last one.
///
/// Closures of [`StepView`] observe every step; pairs, triples and vectors of observers observe one after the other.
pub trait Observer<const N: usize> {
    /// What it asks of the run. By default the action.
    fn needs(&self) -> OutputRequest {
        OutputRequest::ACTION
    }

    /// Is told what the run will be, before work starts.
    ///
    /// # Errors
    /// An [`InputError`] where it cannot observe such a run.
    fn prepare(&mut self, _course: &RunInfo) -> Result<(), InputError> {
        Ok(())
    }

    /// The number of the step, counted from 1, at whose end it looks next after so many: those before it may be taken at once. By
    /// default the next one; `usize::MAX` for the last of the run alone.
    fn next(&self, taken: usize) -> usize {
        taken + 1
    }

    /// Sees the start, with no step before it.
    fn start(&mut self, _at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        ControlFlow::Continue(())
    }

    /// Sees the end of a step that it has asked for, or another observer, or of the last one; `Break` ends the run.
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>>;

    /// What ends trial runs where this one ends its run, and does nothing else; `None`, the default, where it ends none. What lies beyond is
    /// then no reason to refuse an accuracy.
    fn terminal(&self) -> Option<Terminal<'_, N>> {
        None
    }
}

/// An observer that only ends runs: see [`Observer::terminal`].
pub type Terminal<'o, const N: usize> = Box<dyn Observer<N> + 'o>;

/// Those of several observers as one.
fn all_terminal<'o, const N: usize>(of: impl IntoIterator<Item = Option<Terminal<'o, N>>>) -> Option<Terminal<'o, N>> {
    let all: Vec<_> = of.into_iter().flatten().collect();
    (!all.is_empty()).then(|| Box::new(all) as Terminal<'o, N>)
}

/// The end of a run by one of its observers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop<const N: usize> {
    /// Who ends it, for the status.
    pub by: &'static str,
    /// What went wrong, where that is why.
    pub cause: Option<StepError>,
    /// Where the run is to end, if not at the end of the step that the observer saw: a time in that step, and the state there.
    pub at: Option<(f64, PhasePoint<N>)>,
}

impl<const N: usize> Stop<N> {
    /// By this observer, at the end of the step that it saw.
    pub fn here(by: &'static str) -> Self {
        Stop { by, cause: None, at: None }
    }

    /// Since something that it needs cannot be computed.
    pub fn failed(cause: StepError) -> Self {
        Stop { by: "", cause: Some(cause), at: None }
    }
}

/// The end of a step, or the start of a run.
pub struct StepView<'r, const N: usize> {
    /// The number of steps taken.
    pub k: usize,
    /// The time.
    pub t: f64,
    /// The state `(q, p, z)`; the action is the start's where no one has asked for it.
    pub state: PhasePoint<N>,
    /// `sigma_d` of the last step, the factor by which it contracts the contact form and every momentum of a symmetry; 1 at the start.
    pub sigma: f64,
    /// The logarithm of the conformal factor of the motion since the start, where someone has asked for it.
    pub log_factor: Option<f64>,
    /// Whether the run ends here.
    pub last: bool,
    pub(crate) unresolved: Option<UnresolvedStep>,
    pub(crate) energy: EnergySums,
    pub(crate) before: Option<(f64, PhasePoint<N>)>,
    pub(crate) motion: &'r dyn Motion<N>,
    pub(crate) stepper: &'r dyn Stepper<N>,
    /// Whether the step that leads here is a part of one that cannot be taken as a whole.
    pub(crate) in_failed_step: bool,
}

impl<'r, const N: usize> StepView<'r, N> {
    /// The velocity, the inverse of the Legendre transformation at the state.
    ///
    /// # Errors
    /// A [`StepError`] where no velocity belongs to the momentum.
    pub fn velocity(&self) -> Result<SVector<f64, N>, StepError> {
        self.motion.velocity(self.t, &self.state, self.stepper.last_velocity())
    }

    /// The velocity that belongs to another state of the motion.
    ///
    /// # Errors
    /// Those of [`velocity`](Self::velocity).
    pub fn velocity_at(&self, t: f64, state: &PhasePoint<N>) -> Result<SVector<f64, N>, StepError> {
        self.motion.velocity(t, state, self.stepper.last_velocity())
    }

    /// The run as it would go on from here, for [`Run::resume`](crate::run::Run::resume); `None` where its stepper cannot be saved, or the run
    /// cannot go on.
    pub fn interrupted(&self) -> Option<ResumeState> {
        if self.in_failed_step {
            return None;
        }
        let (fingerprint, words) = (self.motion.fingerprint(), self.stepper.save()?);
        let (taken, unresolved, energy) = (self.k, self.unresolved, self.energy);
        Some(ResumeState { fingerprint, taken, log_factor: self.log_factor.unwrap_or(0.0), unresolved, energy, words })
    }

    /// The moment at a time of the last step: see [`LastStep::at`].
    pub(crate) fn inside(&self, t: f64) -> Result<Self, StepError> {
        let (state, sigma) = self.last_step().ok_or(StepError::NonFinite)?.reach(t)?;
        let log_factor = self.log_factor.map(|of_end| of_end - self.sigma.ln() + sigma.ln());
        Ok(StepView { t, state, sigma, log_factor, before: None, ..*self })
    }

    /// The energy `E_L = v.p - L`.
    ///
    /// # Errors
    /// Those of [`velocity`](Self::velocity).
    pub fn energy(&self) -> Result<f64, StepError> {
        self.motion.energy(self.t, &self.state, self.stepper.last_velocity())
    }

    /// The step that ends here; `None` at the start, and where several steps were taken at once.
    pub fn last_step(&self) -> Option<LastStep<'r, N>> {
        let from = self.before?;
        let (motion, stepper) = (self.motion, self.stepper);
        Some(LastStep { from, to: (self.t, self.state), motion, stepper, curve: None, rates: [None; 2] })
    }
}

/// The parts in which a step without a curve of its own is looked at.
const PARTS: usize = 4;

/// The fraction of a step aside by which the curvature of a sketch is taken, and the relative difference of its slope from the motion's up to
/// which it is used.
const ASIDE: f64 = 1e-3;
const AGREEING: f64 = 1e-4;

/// A motion beside one of its states, to second order in the fraction of a step.
pub(crate) struct Beside<const N: usize> {
    state: PhasePoint<N>,
    slope: PhasePoint<N>,
    curvature: PhasePoint<N>,
}

impl<const N: usize> Beside<N> {
    /// The fraction of a step up to which the third order is below rounding, where the step resolves the motion.
    pub(crate) const REACH: f64 = 1e-6;

    /// The state so much further, in fractions of the step.
    pub(crate) fn at(&self, ahead: f64) -> PhasePoint<N> {
        let Beside { state, slope, curvature } = self;
        let half = 0.5 * ahead;
        PhasePoint {
            q: state.q + (slope.q + curvature.q * half) * ahead,
            p: state.p + (slope.p + curvature.p * half) * ahead,
            z: state.z + (slope.z + curvature.z * half) * ahead,
        }
    }
}

/// A step, with the motion between its ends.
pub struct LastStep<'r, const N: usize> {
    from: (f64, PhasePoint<N>),
    to: (f64, PhasePoint<N>),
    motion: &'r dyn Motion<N>,
    stepper: &'r dyn Stepper<N>,
    /// Its curve, if it has one, once it is asked for.
    curve: Option<Option<DenseStep<N>>>,
    /// The rates at both ends, once they are asked for.
    rates: [Option<PhasePoint<N>>; 2],
}

impl<const N: usize> LastStep<'_, N> {
    /// The times of the step's start and end.
    pub fn span(&self) -> (f64, f64) {
        (self.from.0, self.to.0)
    }

    /// The times and states of both ends.
    pub fn ends(&self) -> ((f64, PhasePoint<N>), (f64, PhasePoint<N>)) {
        (self.from, self.to)
    }

    /// The time at a fraction of the step.
    pub(crate) fn time(&self, fraction: f64) -> f64 {
        if fraction == 1.0 { self.to.0 } else { self.from.0 + fraction * (self.to.0 - self.from.0) }
    }

    /// The state at a time between the ends: by a step of the same integrator that ends there. So it is as exact as the ends are, and its
    /// map is as conformally contact.
    ///
    /// # Errors
    /// Those of a step.
    pub fn at(&self, t: f64) -> Result<PhasePoint<N>, StepError> {
        if t == self.to.0 { Ok(self.to.1) } else { self.reach(t).map(|(state, _)| state) }
    }

    /// The same by a step of its own, with its `sigma_d`.
    fn reach(&self, t: f64) -> Result<(PhasePoint<N>, f64), StepError> {
        let curve = self.curve.as_ref().and_then(Option::as_ref);
        if t == self.from.0 {
            Ok((self.from.1, 1.0))
        } else {
            self.motion.inside(&self.from, t, self.stepper.last_velocity(), curve)
        }
    }

    /// With the rates at its start, as the step before has found them.
    pub(crate) fn with_rates_at_start(self, rates: Option<PhasePoint<N>>) -> Self {
        LastStep { rates: [rates, None], ..self }
    }

    /// The rates at its end, if they were asked for.
    pub(crate) fn rates_at_end(&self) -> Option<PhasePoint<N>> {
        self.rates[1]
    }

    /// About the states between the parts in which a search along the step looks at it, at no cost of a step.
    pub(crate) fn sketch(&mut self, to: &mut Vec<PhasePoint<N>>) -> Result<(), StepError> {
        to.clear();
        if let Some(curve) = self.curve() {
            curve.sketch(to);
            return Ok(());
        }
        for k in 1..PARTS {
            to.push(self.about(k as f64 / PARTS as f64)?);
        }
        Ok(())
    }

    /// The motion beside a state of it, at a fraction of the step: by its rates there, and by the curvature of the sketch. `None` where the
    /// slope of the sketch is another, so that its curvature may be, and where there are no rates.
    pub(crate) fn beside(&mut self, fraction: f64, state: &PhasePoint<N>) -> Result<Option<Beside<N>>, StepError> {
        let (t0, t1) = self.span();
        let near = self.stepper.last_velocity();
        let Ok(rates) = self.motion.rates(self.time(fraction), state, near) else { return Ok(None) };
        let aside = ASIDE.min(fraction).min(1.0 - fraction);
        let (below, here, above) =
            (self.about(fraction - aside)?, self.about(fraction)?, self.about(fraction + aside)?);
        let part = |of: fn(&PhasePoint<N>) -> SVector<f64, N>| {
            let slope = of(&rates) * (t1 - t0);
            let [below, here, above] = [&below, &here, &above].map(of);
            let agrees = ((above - below) / (2.0 * aside) - slope).amax() <= AGREEING * slope.amax();
            (agrees, slope, (above - here * 2.0 + below) / (aside * aside))
        };
        let ((q_agrees, q_slope, q_curvature), (p_agrees, p_slope, p_curvature)) = (part(|x| x.q), part(|x| x.p));
        let z_curvature = (above.z - 2.0 * here.z + below.z) / (aside * aside);
        Ok((q_agrees && p_agrees).then_some(Beside {
            state: *state,
            slope: PhasePoint { q: q_slope, p: p_slope, z: rates.z * (t1 - t0) },
            curvature: PhasePoint { q: q_curvature, p: p_curvature, z: z_curvature },
        }))
    }

    fn curve(&mut self) -> Option<&DenseStep<N>> {
        self.curve.get_or_insert_with(|| self.stepper.dense()).as_ref()
    }

    /// About the state at a fraction of the step, at no cost of a step: by the collocation polynomial where there is one, else by the
    /// cubic polynomial through both ends with their rates.
    pub(crate) fn about(&mut self, fraction: f64) -> Result<PhasePoint<N>, StepError> {
        if let Some(curve) = self.curve() {
            return Ok(curve.at_fraction(fraction));
        }
        let ((t0, a), (t1, b)) = (self.from, self.to);
        let ([ra, rb], near) = (self.rates, self.stepper.last_velocity());
        let ra = ra.map_or_else(|| self.motion.rates(t0, &a, near), Ok)?;
        let rb = rb.map_or_else(|| self.motion.rates(t1, &b, near), Ok)?;
        self.rates = [Some(ra), Some(rb)];
        let (u, left, h) = (fraction, 1.0 - fraction, t1 - t0);
        let weights =
            [left * left * (1.0 + 2.0 * u), u * u * (1.0 + 2.0 * left), h * u * left * left, -h * u * u * left];
        let of = |a: &SVector<f64, N>, b: &SVector<f64, N>, ra: &SVector<f64, N>, rb: &SVector<f64, N>| {
            a * weights[0] + b * weights[1] + ra * weights[2] + rb * weights[3]
        };
        Ok(PhasePoint {
            q: of(&a.q, &b.q, &ra.q, &rb.q),
            p: of(&a.p, &b.p, &ra.p, &rb.p),
            z: a.z * weights[0] + b.z * weights[1] + ra.z * weights[2] + rb.z * weights[3],
        })
    }
}

impl<const N: usize, F: FnMut(&StepView<'_, N>) -> ControlFlow<Stop<N>>> Observer<N> for F {
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self(at)
    }
}

/// Several observers as one.
macro_rules! one_after_the_other {
    ($($name:ident $field:tt),+) => {
        impl<const N: usize, $($name: Observer<N>),+> Observer<N> for ($($name,)+) {
            fn needs(&self) -> OutputRequest {
                OutputRequest::default()$(.and(self.$field.needs()))+
            }
            fn prepare(&mut self, course: &RunInfo) -> Result<(), InputError> {
                $(self.$field.prepare(course)?;)+
                Ok(())
            }
            fn next(&self, taken: usize) -> usize {
                usize::MAX$(.min(self.$field.next(taken)))+
            }
            fn start(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
                $(self.$field.start(at)?;)+
                ControlFlow::Continue(())
            }
            fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
                $(self.$field.step(at)?;)+
                ControlFlow::Continue(())
            }
            fn terminal(&self) -> Option<Terminal<'_, N>> {
                all_terminal([$(self.$field.terminal()),+])
            }
        }
    };
}

one_after_the_other!(A 0, B 1);
one_after_the_other!(A 0, B 1, C 2);

impl<const N: usize, O: Observer<N>> Observer<N> for Vec<O> {
    fn needs(&self) -> OutputRequest {
        self.iter().fold(OutputRequest::default(), |needs, observer| needs.and(observer.needs()))
    }
    fn prepare(&mut self, course: &RunInfo) -> Result<(), InputError> {
        self.iter_mut().try_for_each(|observer| observer.prepare(course))
    }
    fn next(&self, taken: usize) -> usize {
        self.iter().map(|observer| observer.next(taken)).min().unwrap_or(usize::MAX)
    }
    fn start(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self.iter_mut().try_for_each(|observer| observer.start(at))
    }
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self.iter_mut().try_for_each(|observer| observer.step(at))
    }
    fn terminal(&self) -> Option<Terminal<'_, N>> {
        all_terminal(self.iter().map(Observer::terminal))
    }
}

/// An observer that someone else keeps.
pub(crate) struct Borrowed<'o, O>(pub &'o mut O);

impl<const N: usize, O: Observer<N>> Observer<N> for Borrowed<'_, O> {
    fn needs(&self) -> OutputRequest {
        self.0.needs()
    }
    fn prepare(&mut self, course: &RunInfo) -> Result<(), InputError> {
        self.0.prepare(course)
    }
    fn next(&self, taken: usize) -> usize {
        self.0.next(taken)
    }
    fn start(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self.0.start(at)
    }
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        self.0.step(at)
    }
    fn terminal(&self) -> Option<Terminal<'_, N>> {
        self.0.terminal()
    }
}

impl<const N: usize> Observer<N> for Box<dyn Observer<N> + '_> {
    fn needs(&self) -> OutputRequest {
        (**self).needs()
    }
    fn prepare(&mut self, course: &RunInfo) -> Result<(), InputError> {
        (**self).prepare(course)
    }
    fn next(&self, taken: usize) -> usize {
        (**self).next(taken)
    }
    fn start(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        (**self).start(at)
    }
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        (**self).step(at)
    }
    fn terminal(&self) -> Option<Terminal<'_, N>> {
        (**self).terminal()
    }
}
