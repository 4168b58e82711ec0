//! The steps of any integrator, divided at the zeros of switching functions.

use super::corner::{Corner, corner};
use super::surfaces::{SignChange, StepCurve, Surfaces, TimedState};
use crate::error::{first, step_error};
use crate::gauss::StepStart;
use crate::numbers::state_words::{Saved, load_option, save_option, saved};
use crate::solve::roots::bracketed_root;
use crate::{
    DenseStep, GaussCollocation, InputError, Integrator, PlanEntry, Problem, StepError, StepFailure, Stepper,
    StepperOptions, UnresolvedStep,
    gauss::{Gauss, GaussStepper},
    integration::SuspectInterval,
    theory::legendre_inverse,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    Lagrangian, PhasePoint, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
};
use std::sync::Arc;

/// The limit of the parts of a step; a step with more fails with [`StepError::Switching`] or [`StepError::Undivided`].
const MOST_PARTS: usize = 4096;

/// The limit of sign changes at one point: a motion that is pushed to a surface from both sides has infinitely many.
const MOST_AT_A_PLACE: usize = 16;

/// The Newton iterations for a zero before it is bracketed.
const NEWTON: usize = 8;

/// A type that is, or holds, a stepper.
pub(crate) trait AsStepper<const N: usize> {
    fn stepper(&self) -> &(dyn Stepper<N> + '_);
    fn stepper_mut(&mut self) -> &mut (dyn Stepper<N> + '_);

    /// The compensation terms of its sums, beyond the last digits of the state. [`add_rests`](Self::add_rests) restores
    /// them.
    fn rests(&self) -> StepStart<N> {
        StepStart::ZERO
    }
    fn add_rests(&mut self, _rests: &StepStart<N>) {}

    /// The largest defect of its last step between the nodes, relative to the momenta; 0 where it is unknown.
    fn defect(&self) -> f64 {
        0.0
    }
}

impl<const N: usize> AsStepper<N> for Box<dyn Stepper<N> + '_> {
    fn stepper(&self) -> &(dyn Stepper<N> + '_) {
        &**self
    }
    fn stepper_mut(&mut self) -> &mut (dyn Stepper<N> + '_) {
        &mut **self
    }
}

impl<L: Lagrangian<N>, const N: usize> AsStepper<N> for GaussStepper<'_, L, N> {
    fn rests(&self) -> StepStart<N> {
        GaussStepper::rests(self)
    }
    fn add_rests(&mut self, rests: &StepStart<N>) {
        GaussStepper::add_rests(self, rests);
    }
    fn defect(&self) -> f64 {
        self.look(1).map_or(0.0, |look| {
            // A jump with vanishing gradients on both sides shows only in the values of L.
            let of_value = if look.kinetic > 0.0 { look.of_value / look.kinetic } else { 0.0 };
            if look.is_underflown() { of_value } else { max_or_nan(look.defect, of_value) }
        })
    }

    fn stepper(&self) -> &(dyn Stepper<N> + '_) {
        self
    }
    fn stepper_mut(&mut self) -> &mut (dyn Stepper<N> + '_) {
        self
    }
}

/// Where an integrator evaluates L.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Reach {
    /// Between the ends of its steps, as Gauss collocation does.
    Inside,
    /// Also at the ends of its steps, or beyond them by this fraction of a step.
    Beside(f64),
}

/// A fraction of a step that exceeds the round-off of its ends.
const AT_ENDS: f64 = 1e-9;

/// A bound for the distance by which negative substeps make a composition leave its step, in units of the step.
const SUBSTEPS: f64 = 0.5;

/// The highest order of the parts.
const HIGHEST: u32 = 2 * Gauss::<()>::STAGES as u32;

/// The stepper of an integrator with steps that end on kinks and jumps.
///
/// An integrator that evaluates L at the ends of its steps, or beyond, would mix both sides of a surface there. The
/// parts of its steps, and its steps near a surface, are therefore taken by contact Gauss collocation of the same
/// order.
pub(crate) fn of_integrator<'a, L: Lagrangian<N>, const N: usize>(
    integrator: Arc<dyn Integrator<'a, L, N> + 'a>,
    problem: &Problem<'a, L, N>,
    h: f64,
    options: StepperOptions,
) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
    let info = integrator.info();
    let inside = info.collocation.is_some() || info.order > HIGHEST;
    let reach = match (inside, info.substeps) {
        (true, _) => Reach::Inside,
        (false, true) => Reach::Beside(SUBSTEPS),
        (false, false) => Reach::Beside(AT_ENDS),
    };
    let parts = GaussCollocation { stages: (info.order.div_ceil(2) as usize).clamp(1, Gauss::<()>::STAGES) };
    let make = move |problem: &Problem<'a, L, N>, h: f64, is_part: bool| {
        if is_part && !inside { parts.stepper(problem, h, options) } else { integrator.stepper(problem, h, options) }
    };
    Ok(Box::new(SwitchingStepper::new(problem, h, reach, make)?))
}

/// Steps of constant length with any integrator. A step along which a switching function changes its sign consists of
/// parts that end on the zeros.
///
/// `make` constructs a stepper for a problem and a step length; its last argument is whether the steps are such parts.
pub(crate) struct SwitchingStepper<'a, L, S, M, const N: usize> {
    problem: Problem<'a, L, N>,
    make: M,
    reach: Reach,
    h: f64,
    /// The number of steps taken.
    k: usize,
    /// The stepper since the last step with parts; its initial state (`origin`) and the number of steps before it
    /// (`before`).
    base: S,
    origin: TimedState<N>,
    before: usize,
    here: TimedState<N>,
    surfaces: Surfaces,
    /// The bound for the defect of a step; a step with a larger one is divided.
    most_misfit: f64,
    sigma: f64,
    /// The number of evaluations of the steppers before `base`.
    spent: u64,
    unresolved: Option<UnresolvedStep>,
    /// The steppers of the parts of the last step that had parts, if they are kept.
    parts: Option<Vec<S>>,
    switched: bool,
}

/// A part of a step.
struct Part<S, const N: usize> {
    stepper: Option<S>,
    to: TimedState<N>,
}

impl<'a, L, S, M, const N: usize> SwitchingStepper<'a, L, S, M, N>
where
    L: Lagrangian<N>,
    S: AsStepper<N>,
    M: Fn(&Problem<'a, L, N>, f64, bool) -> Result<S, InputError>,
{
    pub fn new(problem: &Problem<'a, L, N>, h: f64, reach: Reach, make: M) -> Result<Self, InputError> {
        let base = make(problem, h, false)?;
        let here = TimedState { t: problem.t0, state: problem.state, v: problem.start.v, rests: StepStart::ZERO };
        Ok(SwitchingStepper {
            problem: *problem,
            make,
            reach,
            h,
            k: 0,
            base,
            origin: here,
            before: 0,
            here,
            surfaces: Surfaces::at(problem.lagrangian, problem.t0, &problem.start),
            most_misfit: f64::INFINITY,
            sigma: 1.0,
            spent: 0,
            unresolved: None,
            parts: None,
            switched: false,
        })
    }

    /// The same, keeping the steppers of the parts of a step.
    pub fn keeping_parts(self) -> Self {
        SwitchingStepper { parts: Some(Vec::new()), ..self }
    }

    /// The same, dividing a step whose defect exceeds this bound into parts that satisfy it.
    pub fn dividing(self, most_misfit: f64) -> Self {
        SwitchingStepper { most_misfit, ..self }
    }

    /// Whether a step is to be divided.
    fn is_too_long(&self, step: &S) -> bool {
        if self.most_misfit == f64::INFINITY {
            return false;
        }
        let defect = step.defect();
        defect.is_nan() || defect > self.most_misfit
    }

    /// The steppers of the last step: those of its parts if it had some, otherwise the common stepper of all steps.
    pub fn last_step(&self) -> &[S] {
        match &self.parts {
            Some(parts) if self.switched => parts,
            _ => std::slice::from_ref(&self.base),
        }
    }

    /// Whether the last step had parts.
    pub fn has_switched(&self) -> bool {
        self.switched
    }

    /// The integrator's stepper at a state.
    fn stepper_at(&self, at: &TimedState<N>, h: f64, is_part: bool) -> Result<S, StepError> {
        let start = VelocityPoint { q: at.state.q, v: at.v, z: at.state.z };
        let problem = Problem { t0: at.t, start, state: at.state, ..self.problem };
        let mut stepper = (self.make)(&problem, h, is_part).map_err(step_error)?;
        stepper.add_rests(&at.rests);
        Ok(stepper)
    }

    /// The state of a stepper, with its velocity.
    fn reached(&self, stepper: &S, t: f64, guess: &TimedState<N>) -> Result<TimedState<N>, StepError> {
        let (state, rests) = (stepper.stepper().state(), stepper.rests());
        let v = legendre_inverse(self.problem.lagrangian, t, &state, &guess.v)?.v;
        Ok(TimedState { t, state, v, rests })
    }

    /// One part of a step, from a state to the time t.
    fn part(&mut self, at: &TimedState<N>, t: f64) -> Result<(S, TimedState<N>), StepError> {
        let mut stepper = self.stepper_at(at, t - at.t, true)?;
        let taken = stepper.stepper_mut().advance(1).map_err(|halt| halt.cause);
        self.spent += stepper.stepper().evaluations();
        taken?;
        let to = self.reached(&stepper, t, at)?;
        Ok((stepper, to))
    }

    /// The next step.
    fn step(&mut self) -> Result<(), StepError> {
        let from = self.here;
        let t = self.problem.t0 + (self.k + 1) as f64 * self.h;
        self.switched = false;
        if self.base.stepper_mut().advance(1).is_ok()
            && let Ok(to) = self.reached(&self.base, t, &from)
        {
            let curve = StepCurve { from, to, dense: self.base.stepper().dense() };
            let (lagrangian, surfaces) = (self.problem.lagrangian, &mut self.surfaces);
            let quiet = match self.reach {
                Reach::Inside => true,
                Reach::Beside(part) => !surfaces.are_near(lagrangian, &curve, part),
            };
            if quiet && surfaces.first_change(lagrangian, &curve).is_none() && !self.is_too_long(&self.base) {
                (self.here, self.sigma) = (to, self.base.stepper().sigma());
                return Ok(());
            }
        }
        // Unresolved steps before this one are kept; a flag of this step is dropped, since it may be due to the
        // surface.
        let earlier = self.base.stepper().unresolved().map(|s| UnresolvedStep { step: s.step + self.before, ..s });
        self.unresolved = first(self.unresolved, earlier.filter(|s| s.step < self.k));
        self.spent += self.base.stepper().evaluations();
        if let Some(parts) = &mut self.parts {
            parts.clear();
        }
        let sides = self.surfaces.clone();
        match self.in_parts(from, t).and_then(|(to, sigma)| Ok((to, sigma, self.stepper_at(&to, self.h, false)?))) {
            Ok((to, sigma, base)) => {
                (self.here, self.sigma, self.base) = (to, sigma, base);
                (self.origin, self.before, self.switched) = (to, self.k + 1, true);
                Ok(())
            }
            Err(cause) => {
                self.surfaces = sides;
                // The state is that before the step.
                if let Ok(base) = self.stepper_at(&from, self.h, false) {
                    (self.base, self.origin, self.before) = (base, from, self.k);
                }
                Err(cause)
            }
        }
    }

    /// A step in parts that end on zeros.
    fn in_parts(&mut self, from: TimedState<N>, t_end: f64) -> Result<(TimedState<N>, f64), StepError> {
        let (mut at, mut sigma, mut at_a_place) = (from, 1.0, 0);
        let span = t_end - from.t;
        let spacing = 4.0 * f64::EPSILON * max_or_nan(max_or_nan(from.t.abs(), t_end.abs()), span.abs());
        let (mut longest, mut too_long, mut switches) = (span.abs(), false, false);
        for _ in 0..MOST_PARTS {
            let rest = t_end - at.t;
            if rest * span <= 0.0 {
                return Ok((at, sigma));
            }
            let t = if rest.abs() <= longest { t_end } else { at.t + longest.copysign(span) };
            if longest <= spacing {
                return Err(if too_long { StepError::Undivided { t: at.t } } else { StepError::Switching { t: at.t } });
            }
            let (stepper, to) = match self.part(&at, t) {
                Ok(part) => part,
                Err(cause) if (t - at.t).abs() <= 2.0 * spacing => return Err(cause),
                Err(_) => {
                    longest = 0.5 * (t - at.t).abs();
                    continue;
                }
            };
            let curve = StepCurve { from: at, to, dense: stepper.stepper().dense() };
            let change = self.surfaces.first_change(self.problem.lagrangian, &curve);
            too_long = change.is_none() && self.is_too_long(&stepper);
            if too_long {
                longest = 0.5 * (t - at.t).abs();
                continue;
            }
            let Some(change) = change else {
                sigma *= stepper.stepper().sigma();
                self.keep(stepper);
                (at, longest, at_a_place) = (to, max_or_nan(2.0 * longest, f64::MIN_POSITIVE).min(span.abs()), 0);
                continue;
            };
            let Some(Part { stepper, to }) = self.locate(&curve, &change, spacing) else {
                // The curve crosses the surface, but the motion does not; the curve of a shorter part is more accurate.
                longest = 0.5 * (t - at.t).abs();
                continue;
            };
            match stepper {
                Some(stepper) if self.is_too_long(&stepper) => {
                    too_long = true;
                    longest = 0.5 * (to.t - at.t).abs();
                    continue;
                }
                Some(stepper) => {
                    sigma *= stepper.stepper().sigma();
                    self.keep(stepper);
                    at_a_place = 0;
                }
                None => at_a_place += 1,
            }
            if at_a_place > MOST_AT_A_PLACE {
                return Err(StepError::Switching { t: at.t });
            }
            at = self.through(to, change.index, span)?;
            (longest, switches) = (span.abs(), true);
        }
        let divides = self.most_misfit < f64::INFINITY && !switches;
        Err(if divides { StepError::Undivided { t: at.t } } else { StepError::Switching { t: at.t } })
    }

    fn keep(&mut self, stepper: S) {
        if let Some(parts) = &mut self.parts {
            parts.push(stepper);
        }
    }

    /// The state at a zero, on the side where the motion continues.
    fn through(&mut self, at: TimedState<N>, index: usize, span: f64) -> Result<TimedState<N>, StepError> {
        let reach = max_abs_or_nan(at.v.iter().map(|v| v * span));
        let lagrangian = self.problem.lagrangian;
        let p = match corner(lagrangian, &mut self.surfaces, index, &at, reach)? {
            Corner::Continuous => {
                self.surfaces.cross(index);
                return Ok(at);
            }
            Corner::Refracted(p) => {
                self.surfaces.cross(index);
                p
            }
            Corner::Reflected(p) => p,
        };
        let state = PhasePoint { p, ..at.state };
        let v = legendre_inverse(lagrangian, at.t, &state, &at.v)?.v;
        Ok(TimedState { state, v, rests: StepStart { y: [0.0; N], ..at.rests }, ..at })
    }

    /// The part that ends on a zero, to within `spacing` in time; it has no stepper where the zero is the start itself.
    /// `None` where the motion does not cross the surface.
    fn locate(&mut self, curve: &StepCurve<N>, change: &SignChange, spacing: f64) -> Option<Part<S, N>> {
        let SignChange { index, ends, about, slope } = *change;
        let (lagrangian, from, span) = (self.problem.lagrangian, curve.from, curve.span());
        let at_start = Part { stepper: None, to: from };
        let mut slope = slope;
        let mut length = about * span;
        let mut last: Option<(f64, f64)> = None;
        for _ in 0..NEWTON {
            if length.abs() <= spacing {
                return Some(at_start);
            }
            let (stepper, to) = self.part(&from, from.t + length).ok()?;
            let value = self.surfaces.value(lagrangian, index, (to.t, &to.point()));
            if let Some((l, g)) = last
                && l != length
                && (value - g) / (length - l) * slope > 0.0
            {
                slope = (value - g) / (length - l);
            }
            let change = value / slope;
            if !change.is_finite() {
                break;
            }
            if change.abs() <= spacing {
                return Some(Part { stepper: Some(stepper), to });
            }
            last = Some((length, value));
            length -= change;
            if length * span < 0.0 || length.abs() > 1.5 * ends[1] * span.abs() {
                break;
            }
        }
        // The zero is bracketed between two times at which the function has different signs along the motion itself.
        let side = self.surfaces.side(index);
        let mut toward = |fraction: f64| -> Result<f64, StepError> {
            if fraction * span.abs() <= spacing {
                return Ok(f64::MIN_POSITIVE);
            }
            let (_, to) = self.part(&from, from.t + fraction * span)?;
            Ok(side * self.surfaces.value(lagrangian, index, (to.t, &to.point())))
        };
        let [before, after] = [toward(ends[0]).ok()?, toward(ends[1]).ok()?];
        if before.is_nan() || after.is_nan() || before <= 0.0 || after >= 0.0 {
            return None;
        }
        let root = bracketed_root(ends, [before, after], toward).ok()?;
        if root * span.abs() <= spacing {
            return Some(at_start);
        }
        let (stepper, to) = self.part(&from, from.t + root * span).ok()?;
        Some(Part { stepper: Some(stepper), to })
    }
}

impl<'a, L, S, M, const N: usize> Stepper<N> for SwitchingStepper<'a, L, S, M, N>
where
    L: Lagrangian<N>,
    S: AsStepper<N>,
    M: Fn(&Problem<'a, L, N>, f64, bool) -> Result<S, InputError>,
{
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            self.step().map_err(|cause| StepFailure { taken, cause })?;
            self.k += 1;
        }
        Ok(())
    }

    fn state(&self) -> PhasePoint<N> {
        self.here.state
    }

    fn time(&self) -> f64 {
        self.problem.t0 + self.k as f64 * self.h
    }

    fn last_velocity(&self) -> Option<SVector<f64, N>> {
        (self.k > 0).then_some(self.here.v)
    }

    fn sigma(&self) -> f64 {
        self.sigma
    }

    fn evaluations(&self) -> u64 {
        self.spent + self.base.stepper().evaluations()
    }

    fn dense(&self) -> Option<DenseStep<N>> {
        if self.switched { None } else { self.base.stepper().dense() }
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        let mut items = self.base.stepper().work_summary();
        items.push(PlanEntry::computed(
            "switching functions",
            "L has kinks or jumps: steps end where the motion crosses them",
        ));
        items
    }

    fn save(&self) -> Option<Vec<u64>> {
        let mut words = Vec::new();
        [self.k, self.before].save(&mut words);
        [self.origin, self.here].save(&mut words);
        self.surfaces.sides.save(&mut words);
        (self.sigma, self.spent).save(&mut words);
        save_option(self.unresolved.as_ref(), &mut words);
        words.extend(self.base.stepper().save()?);
        Some(words)
    }

    fn restore(&mut self, mut words: &[u64]) -> bool {
        self.load(&mut words).is_some() && self.base.stepper_mut().restore(words)
    }

    fn unresolved(&self) -> Option<UnresolvedStep> {
        let of_base = self.base.stepper().unresolved().map(|s| UnresolvedStep { step: s.step + self.before, ..s });
        first(self.unresolved, of_base)
    }

    fn suspect_interval(&mut self) -> Option<SuspectInterval<N>> {
        let suspect = self.base.stepper_mut().suspect_interval()?;
        Some(SuspectInterval { step: suspect.step + self.before, ..suspect })
    }
}

saved!([const N: usize] TimedState<N> { t, state, v, rests });

impl<'a, L, S, M, const N: usize> SwitchingStepper<'a, L, S, M, N>
where
    L: Lagrangian<N>,
    S: AsStepper<N>,
    M: Fn(&Problem<'a, L, N>, f64, bool) -> Result<S, InputError>,
{
    /// Loads everything except the words of `base`, which is constructed again at its origin.
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        let mut counts = [self.k, self.before];
        counts.load(from)?;
        let mut states = [self.origin, self.here];
        states.load(from)?;
        self.surfaces.sides.load(from)?;
        let mut numbers = (self.sigma, self.spent);
        numbers.load(from)?;
        self.unresolved = load_option(from, || UnresolvedStep { step: 0, defect: 0.0 })?;
        self.base = self.stepper_at(&states[0], self.h, false).ok()?;
        ([self.k, self.before], [self.origin, self.here], (self.sigma, self.spent)) = (counts, states, numbers);
        Some(())
    }
}
