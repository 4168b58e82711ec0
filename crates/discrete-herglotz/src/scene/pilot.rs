//! Pilot runs: a motion followed with some number of steps, seen at a few common times, and looked at between its steps.

use super::accuracy::Choice;
use super::{Integrator, Plan, Scene};
use crate::gauss::SETS;
use crate::verified::refuted;
use crate::{Gauss, GaussRoute, GaussStepper, Halt, InputError, StepError, Stepper};
use contact_geom::nalgebra::SVector;
use contact_geom::{Defect, Lagrangian};

/// The evaluations of L that all pilot runs of a plan may take together: some seconds.
pub(super) const BUDGET: u64 = 1 << 28;

/// The misfit between the nodes beyond which a step does not resolve the motion: its momenta would be off by a twentieth.
const RESOLVED: f64 = 0.05;

/// How many times the expected misfit is more than a smooth motion has: something narrow lies between the nodes.
const NARROW: f64 = 30.0;

/// The points of a span at which a run is looked at, at least: what is wider than the distance of two is seen.
const POINTS: usize = 2000;

/// The steps between two looks at budget and progress.
const CHUNK: usize = 1024;

/// A motion at the ends of the `marks` equal parts of its span: (q, p).
#[derive(Clone, Debug)]
pub(super) struct Track<const N: usize>(pub Vec<[SVector<f64, N>; 2]>);

/// A 2-norm that neither overflows nor underflows.
fn norm<const N: usize>(x: &[SVector<f64, N>; 2]) -> f64 {
    let size = contact_geom::largest(x.iter().flat_map(|x| x.iter().copied()));
    if !(size > 0.0 && size.is_finite()) {
        return size;
    }
    size * x.iter().map(|x| (x / size).norm_squared()).sum::<f64>().sqrt()
}

impl<const N: usize> Track<N> {
    /// The distances of the states of two tracks at the times that both have, relative to the size of the second's at that time, or at
    /// the end where that is larger. Not a number where a state is not.
    pub fn distances(&self, of: &Self) -> Vec<f64> {
        let marks = gcd(self.0.len(), of.0.len());
        let at = |track: &Self, i: usize| track.0[(i + 1) * track.0.len() / marks - 1];
        let last = of.0.last().map_or(0.0, norm);
        let relative = |i: usize| {
            let (a, b) = (at(self, i), at(of, i));
            let (apart, size) = (norm(&[a[0] - b[0], a[1] - b[1]]), contact_geom::larger(norm(&b), last));
            if apart == 0.0 { 0.0 } else { apart / size }
        };
        (0..marks).map(relative).collect()
    }

    /// The largest of the [`distances`](Self::distances).
    pub fn distance(&self, of: &Self) -> f64 {
        contact_geom::largest(self.distances(of))
    }
}

/// The greatest common divisor.
pub(super) fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// How a pilot run has ended.
#[derive(Clone, Debug)]
pub(super) enum Ending<const N: usize> {
    /// At the end of the span.
    Followed(Track<N>),
    /// At a step that does not resolve the motion, after this part of the span.
    Unresolved { part: f64 },
    /// The same, where the misfit is that of something narrow.
    Narrow { part: f64 },
    /// At a step that could not be taken.
    Halted { part: f64, cause: StepError },
    /// No evaluations are left.
    Exhausted,
}

/// Pilot runs of a scene, with what is left of their budget.
pub(super) struct Pilots<'s, 'a, L, const N: usize> {
    pub scene: &'s Scene<'a, L, N>,
    pub left: u64,
    /// The error that is wanted.
    pub wanted: f64,
}

impl<L: Lagrangian<N>, const N: usize> Pilots<'_, '_, L, N> {
    /// Follows the motion by contact Gauss collocation, with a look at one in `stride` steps, for what is narrow too or not.
    pub fn gauss(
        &mut self,
        stages: usize,
        count: usize,
        marks: usize,
        stride: usize,
        narrow: bool,
    ) -> Result<Ending<N>, InputError> {
        let Scene { lagrangian, start, t0, span, .. } = *self.scene;
        let gauss = Gauss::new(lagrangian, stages, span / count as f64)?;
        let state = contact_geom::legendre(lagrangian, t0, &start);
        let mut stepper = match gauss.stepper_without_action(t0, state, start.v) {
            Ok(stepper) => stepper,
            Err(error) => return halted_at_the_start(error),
        };
        // A linear motion is not iterated, and nothing is to be seen.
        let stride = if stepper.route() == GaussRoute::Linear { CHUNK } else { stride };
        let sets = POINTS.div_ceil(stages * count.div_ceil(stride)).min(SETS);
        let floor = contact_geom::larger(0.1 * self.wanted, 1e-11);
        let bad = |run: &GaussStepper<'_, &L, N>, part: f64| {
            let look = run.look(sets)?;
            if look.misfit > RESOLVED || look.misfit.is_nan() {
                return Some(Ending::Unresolved { part });
            }
            (narrow && look.misfit > NARROW * look.expected + floor).then_some(Ending::Narrow { part })
        };
        let steps = |taken: usize| if taken < 4 { 1 } else { stride };
        // A step by Newton's method costs the solution of its equations, a look about a sweep.
        let (newton, mut looks) = ((stages * (N + 2)).pow(2) as u64, 0);
        let ending = self.follow(&mut stepper, count, marks, steps, |run, part| {
            looks += sets * stages;
            (bad(run, part), run.evaluations() + run.newton_steps() * newton + looks as u64)
        });
        // What is met nowhere else may be what a claim denies.
        if let Ending::Narrow { .. } | Ending::Unresolved { .. } = ending
            && let Some(Defect { claim, size }) = refuted(lagrangian, stepper.time(), &stepper.state(), &start.v)
        {
            return Err(InputError::FalseClaim { claim, size });
        }
        Ok(ending)
    }

    /// Follows the motion by the scene's own integrator.
    pub fn own(&mut self, integrator: Integrator, count: usize, marks: usize) -> Result<Ending<N>, InputError> {
        let scene = self.scene.bare();
        let plan = match Plan::new(&scene, &Choice { integrator, count, error: None }) {
            Ok(plan) => plan,
            Err(error) => return halted_at_the_start(error),
        };
        let mut stepper = match plan.stepper() {
            Ok(stepper) => stepper,
            Err(error) => return halted_at_the_start(error),
        };
        let price = match integrator {
            Integrator::Gauss { .. } => 1,
            Integrator::Splitting(_) => 4,
            // Newton's method takes second derivatives.
            Integrator::Discrete(_) | Integrator::Composition(..) => 32,
        };
        let look = |run: &(dyn Stepper<N> + '_), _: f64| (None, run.evaluations().saturating_mul(price));
        Ok(self.follow(&mut *stepper, count, marks, |_| CHUNK, look))
    }

    /// Takes `count` steps, which the marks divide, so many at a time as `steps` says after those that are taken; `look` sees the run
    /// in between with the part that is done, may end it, and says what it has cost. The cost is taken off the budget.
    fn follow<R: Stepper<N> + ?Sized>(
        &mut self,
        run: &mut R,
        count: usize,
        marks: usize,
        steps: impl Fn(usize) -> usize,
        mut look: impl FnMut(&R, f64) -> (Option<Ending<N>>, u64),
    ) -> Ending<N> {
        let (mut track, mut taken, mut spent) = (Vec::with_capacity(marks), 0, 0);
        let mut ending = None;
        while taken < count && ending.is_none() {
            let next_mark = count / marks * (track.len() + 1);
            let chunk = steps(taken).min(next_mark - taken);
            let halt = run.advance(chunk).err();
            taken += halt.map_or(chunk, |halt| halt.taken);
            let part = taken as f64 / count as f64;
            let seen;
            (seen, spent) = look(run, part);
            ending = halt.map(|Halt { cause, .. }| Ending::Halted { part, cause }).or(seen);
            if taken == next_mark {
                let x = run.state();
                track.push([x.q, x.p]);
            }
            if spent > self.left {
                ending = Some(Ending::Exhausted);
            }
        }
        self.left = self.left.saturating_sub(spent);
        ending.unwrap_or(Ending::Followed(Track(track)))
    }
}

/// Bad luck at the start calls for shorter steps; bad input ends the search.
fn halted_at_the_start<const N: usize>(error: InputError) -> Result<Ending<N>, InputError> {
    match error {
        InputError::Sigma { sigma } => Ok(Ending::Halted { part: 0.0, cause: StepError::SigmaVanished { sigma } }),
        InputError::FirstStep(cause) => Ok(Ending::Halted { part: 0.0, cause }),
        bad => Err(bad),
    }
}
