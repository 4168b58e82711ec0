//! The steps of any integrator, divided at the zeros of switching functions.

pub(crate) mod accumulation;
pub(crate) mod evaluation_range;
pub(crate) mod of_integrator;
pub(crate) mod part_stepper;
pub(crate) mod parts;
mod passage;
mod run;
mod solved_parts;

use crate::error::step_error;
use crate::gauss::StepStart;
use crate::integration::{Piece, Reset, SystemProblem};
use crate::status::first;
use crate::switching::stepper::accumulation::Accumulation;
use crate::switching::stepper::evaluation_range::EvaluationRange;
use crate::switching::stepper::part_stepper::PartStepper;
use crate::switching::stepper::parts::time_spacing;
use crate::switching::stepper::solved_parts::EndOfPart;
use crate::switching::{
    step_curve::{StepCurve, TimedState},
    surfaces::Surfaces,
};
use crate::{InputError, StepError, UnresolvedStep};

/// Constructs a stepper for a problem and a step length; the last argument is whether the steps are parts that end on
/// zeros.
pub(crate) type MakeStepper<'a> =
    Box<dyn Fn(&SystemProblem<'a>, f64, bool) -> Result<PartStepper<'a>, InputError> + 'a>;

/// Steps of constant length with any integrator. A step along which a switching function changes its sign consists of
/// parts that end on the zeros.
pub(crate) struct SwitchingStepper<'a> {
    problem: SystemProblem<'a>,
    make: MakeStepper<'a>,
    range: EvaluationRange,
    h: f64,
    /// The number of steps taken.
    k: usize,
    /// The stepper since the last step with parts; its initial state (`origin`) and the number of steps before it
    /// (`before`).
    base: PartStepper<'a>,
    origin: TimedState,
    before: usize,
    here: TimedState,
    surfaces: Surfaces,
    /// The bound for the defect of a step; a step with a larger one is divided.
    max_defect: f64,
    sigma: f64,
    /// The number of evaluations of the steppers before `base`.
    spent: u64,
    unresolved: Option<UnresolvedStep>,
    /// The steppers of the parts of the last step that had parts, if they are kept.
    parts: Option<Vec<PartStepper<'a>>>,
    /// Whether the stages of parts are kept where their steppers are not.
    keeps_stages: bool,
    /// The ends of these parts.
    ends: Vec<EndOfPart>,
    switched: bool,
    /// The resets in the last steps, and the pieces of the last step if it had parts.
    resets: Vec<Reset>,
    pieces: Vec<Piece>,
    accumulation: Accumulation,
    changed_energy: bool,
}

impl<'a> SwitchingStepper<'a> {
    pub fn new(
        problem: &SystemProblem<'a>,
        h: f64,
        range: EvaluationRange,
        make: MakeStepper<'a>,
    ) -> Result<Self, InputError> {
        let base = make(problem, h, false)?;
        let (state, v) = (problem.state.clone(), problem.start.v.clone());
        let rests = StepStart::zeros(v.len());
        let here = TimedState { t: problem.t0, state, v, rests };
        let surfaces = Surfaces::at(&*problem.system, problem.t0, &here.argument(&*problem.system), h);
        Ok(SwitchingStepper {
            problem: problem.clone(),
            make,
            range,
            h,
            k: 0,
            base,
            origin: here.clone(),
            before: 0,
            here,
            surfaces,
            max_defect: f64::INFINITY,
            sigma: 1.0,
            spent: 0,
            unresolved: None,
            parts: Some(Vec::new()),
            keeps_stages: false,
            ends: Vec::new(),
            switched: false,
            resets: Vec::new(),
            pieces: Vec::new(),
            accumulation: Accumulation::default(),
            changed_energy: false,
        })
    }

    /// The same, keeping the steppers of the parts of a step.
    pub fn keeping_parts(self) -> Self {
        SwitchingStepper { parts: Some(Vec::new()), ..self }
    }

    /// The same, dividing a step whose defect exceeds this bound into parts that satisfy it, whose steppers are not kept,
    /// but their stages if they are wanted.
    pub fn dividing(self, max_defect: f64, keeps_stages: bool) -> Self {
        SwitchingStepper { max_defect, keeps_stages, parts: None, ..self }
    }

    /// Whether a step is to be divided.
    fn is_too_long(&self, step: &PartStepper<'a>) -> bool {
        if self.max_defect == f64::INFINITY {
            return false;
        }
        let defect = step.defect();
        defect.is_nan() || defect > self.max_defect
    }

    /// The steppers of the last step: those of its parts if it had some, otherwise the common stepper of all steps.
    fn last_step(&self) -> &[PartStepper<'a>] {
        match &self.parts {
            Some(parts) if self.switched => parts,
            _ => std::slice::from_ref(&self.base),
        }
    }

    /// The integrator's stepper at a state.
    fn stepper_at(&self, at: &TimedState, h: f64, is_part: bool) -> Result<PartStepper<'a>, StepError> {
        let problem = SystemProblem { t0: at.t, start: at.point(), state: at.state.clone(), ..self.problem.clone() };
        let mut stepper = (self.make)(&problem, h, is_part).map_err(step_error)?;
        stepper.set_compensation(&at.rests);
        Ok(stepper)
    }

    /// The state of a stepper, with its velocity.
    fn reached(&self, stepper: &PartStepper<'a>, t: f64, guess: &TimedState) -> Result<TimedState, StepError> {
        let (state, rests) = (stepper.stepper().state(), stepper.compensation(guess.v.len()));
        let v = self.problem.system.legendre_inverse(t, &state, &guess.v)?.v;
        Ok(TimedState { t, state, v, rests })
    }

    /// Whether a break lies in a step, or so close to it that the integrator may evaluate L on its other side.
    fn has_break_near(&self, from: f64, to: f64) -> bool {
        let breaks = self.problem.system.breaks();
        if breaks.is_empty() {
            return false;
        }
        let margin = match self.range {
            EvaluationRange::Within => 0.0,
            EvaluationRange::Extended(part) => part * (to - from).abs(),
        };
        let (first, last) = (from.min(to) - margin, from.max(to) + margin);
        let next = breaks.get(breaks.partition_point(|b| *b <= first));
        match self.range {
            EvaluationRange::Within => next.is_some_and(|b| *b < last),
            EvaluationRange::Extended(_) => {
                next.is_some_and(|b| *b <= last) || breaks.binary_search_by(|b| b.total_cmp(&first)).is_ok()
            }
        }
    }

    /// The first break after a time in the direction of the run, at a distance from it and from the end that is not
    /// round-off, or the end.
    fn next_end(&self, t: f64, t_end: f64) -> f64 {
        let breaks = self.problem.system.breaks();
        let [after, before] = [t, t_end].map(|t| time_spacing(t, self.h));
        let forward = t_end > t;
        let next = if forward {
            breaks.get(breaks.partition_point(|b| *b <= t + after)).filter(|b| **b < t_end - before)
        } else {
            let earlier = breaks.partition_point(|b| *b < t - after);
            earlier.checked_sub(1).and_then(|i| breaks.get(i)).filter(|b| **b > t_end + before)
        };
        next.copied().unwrap_or(t_end)
    }

    /// The next step.
    fn step(&mut self) -> Result<(), StepError> {
        let from = self.here.clone();
        let t = self.problem.t0 + (self.k + 1) as f64 * self.h;
        self.switched = false;
        self.pieces.clear();
        self.ends.clear();
        if !self.has_break_near(from.t, t)
            && self.base.stepper_mut().advance(1).is_ok()
            && let Ok(to) = self.reached(&self.base, t, &from)
        {
            let (system, surfaces) = (&*self.problem.system, &mut self.surfaces);
            let curve = StepCurve::new(system, [from.clone(), to], self.base.stepper().dense());
            let quiet = match self.range {
                EvaluationRange::Within => true,
                EvaluationRange::Extended(part) => !surfaces.are_near(system, &curve, part),
            };
            if quiet && matches!(surfaces.first_change(system, &curve), Ok(None)) && !self.is_too_long(&self.base) {
                (self.here, self.sigma) = (curve.to, self.base.stepper().sigma());
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
        let (sides, resets) = ((self.surfaces.clone(), self.accumulation), self.resets.len());
        let stepped =
            self.in_parts(&from, t).and_then(|(to, sigma)| Ok((self.stepper_at(&to, self.h, false)?, to, sigma)));
        match stepped {
            Ok((base, to, sigma)) => {
                (self.here, self.sigma, self.base) = (to.clone(), sigma, base);
                (self.origin, self.before, self.switched) = (to, self.k + 1, true);
                Ok(())
            }
            Err(cause) => {
                (self.surfaces, self.accumulation) = sides;
                self.resets.truncate(resets);
                self.pieces.clear();
                self.ends.clear();
                // The state is that before the step.
                if let Ok(base) = self.stepper_at(&from, self.h, false) {
                    (self.base, self.origin, self.before) = (base, from, self.k);
                }
                Err(cause)
            }
        }
    }
}
