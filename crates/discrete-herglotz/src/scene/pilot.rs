//! Pilot runs: a motion followed with some number of steps, seen at a few common times, and looked at between its steps.

use super::accuracy::Choice;
use super::{Integrator, Plan, Scene};
use crate::gauss::{Look, SETS};
use crate::verified::refuted;
use crate::{Gauss, GaussRoute, Halt, InputError, StepError, Stepper};
use contact_geom::nalgebra::SVector;
use contact_geom::{Defect, Lagrangian, Structure, larger};

/// What all pilot runs of a plan may cost together, in evaluations of L at one stage: some seconds.
pub(super) const BUDGET: u64 = 1 << 26;

/// The misfit between the nodes beyond which a step does not resolve the motion: its momenta would be off by a twentieth.
const RESOLVED: f64 = 0.05;

/// The misfit in units of the largest momentum that is round-off: some hundred units for the sums that forces are made of.
const AT_REST: f64 = 1e-13;

/// The same of the values of L, whose polynomials follow twice the frequencies.
const RESOLVED_VALUE: f64 = 0.2;

/// Products of two numbers that are smaller have lost digits.
const UNDERFLOWN: f64 = f64::MIN_POSITIVE / f64::EPSILON;

/// How many times the expected misfit is more than a smooth motion has: something narrow lies between the nodes.
const NARROW: f64 = 30.0;

/// The points of a span at which a run is looked at, at least: what is wider than the distance of two is seen.
const POINTS: usize = 2000;

/// The steps between two looks at budget and progress.
const CHUNK: usize = 1024;

/// The parts of a span at whose ends runs are compared.
const PARTS: usize = 10;

/// The times of a span at which runs are compared: ends of steps of a run with `base` steps, which divides the steps of all others.
#[derive(Clone, Debug)]
pub(super) struct Marks {
    base: usize,
    at: Vec<usize>,
}

impl Marks {
    /// The ends of the tenths of a span, each moved to the end of the step in which it lies; of all steps where they are fewer.
    pub fn of(base: usize) -> Self {
        let parts = base.min(PARTS);
        Marks { base, at: (1..=parts).map(|i| (i * base).div_ceil(parts)).collect() }
    }

    /// Equal parts of a span, as many as tenths and as steps.
    pub fn equal(steps: usize) -> Self {
        Marks::of(steps.min(PARTS))
    }

    /// The fewest steps from a number on that they divide.
    pub fn whole(&self, steps: f64) -> usize {
        (steps / self.base as f64).ceil().max(1.0) as usize * self.base
    }
}

/// A motion at some marks: (q, p).
#[derive(Clone, Debug)]
pub(super) struct Track<const N: usize> {
    states: Vec<[SVector<f64, N>; 2]>,
    /// The largest misfit that was seen between the nodes of its steps.
    pub misfit: f64,
}

/// A 2-norm that neither overflows nor underflows.
fn norm<const N: usize>(x: &[SVector<f64, N>; 2]) -> f64 {
    let size = contact_geom::largest(x.iter().flat_map(|x| x.iter().copied()));
    if !(size > 0.0 && size.is_finite()) {
        return size;
    }
    size * x.iter().map(|x| (x / size).norm_squared()).sum::<f64>().sqrt()
}

impl<const N: usize> Track<N> {
    /// The distances of the states of two tracks at the same marks, relative to the size of the second's at that time, or at the end
    /// where that is larger. Not a number where a state is not.
    pub fn distances(&self, of: &Self) -> Vec<f64> {
        let last = of.states.last().map_or(0.0, norm);
        let relative = |(a, b): (&[SVector<f64, N>; 2], &[SVector<f64, N>; 2])| {
            let (apart, size) = (norm(&[a[0] - b[0], a[1] - b[1]]), larger(norm(b), last));
            if apart == 0.0 { 0.0 } else { apart / size }
        };
        self.states.iter().zip(&of.states).map(relative).collect()
    }

    /// Whether the motion ends with numbers that have lost digits since they are too small.
    pub fn has_underflown(&self) -> bool {
        self.states.last().is_some_and(|last| norm(last) < f64::MIN_POSITIVE)
    }

    /// The largest of the [`distances`](Self::distances).
    pub fn distance(&self, of: &Self) -> f64 {
        contact_geom::largest(self.distances(of))
    }
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

/// What the looks at a run have seen.
#[derive(Default)]
struct Seen {
    before: Option<Look>,
    /// The largest momentum, and the largest of what misfits of values change, on the way.
    size: f64,
    kinetic: f64,
    /// The largest misfit, in units of these: of a motion that comes to rest only round-off is left.
    misfit: f64,
}

impl Seen {
    /// Takes in a look at the next step, and says whether the step resolves the motion.
    fn resolves(&mut self, look: &Look) -> bool {
        let jump = self.before.replace(*look).map_or(0.0, |before| before.jump_to(look));
        (self.size, self.kinetic) = (larger(self.size, look.size), larger(self.kinetic, look.kinetic));
        let of_value = larger(look.of_value, jump);
        // What does not move crosses nothing, and values of L that have underflowed tell nothing.
        let told = of_value != 0.0 && (self.kinetic >= UNDERFLOWN || self.kinetic.is_nan());
        let of_value = if told { of_value / self.kinetic } else { 0.0 };
        let of_run = look.misfit * if self.size > 0.0 { look.size / self.size } else { 1.0 };
        self.misfit = larger(self.misfit, larger(of_run, of_value));
        // A NaN resolves nothing.
        (look.misfit <= RESOLVED || of_run <= AT_REST) && of_value <= RESOLVED_VALUE
    }
}

/// Pilot runs of a scene, with what is left of their budget.
pub(super) struct Pilots<'s, 'a, L, const N: usize> {
    pub scene: &'s Scene<'a, L, N>,
    /// What the Lagrangian claims, probed at the start.
    pub structure: Structure,
    pub left: u64,
    /// The error that is wanted.
    pub wanted: f64,
}

impl<L: Lagrangian<N>, const N: usize> Pilots<'_, '_, L, N> {
    /// Follows the motion by contact Gauss collocation, with a look between the nodes of each step: closely, at so many points of the
    /// span that nothing is narrower, or at a few of each step; and for what is narrow beside the steps or not.
    pub fn gauss(
        &mut self,
        stages: usize,
        count: usize,
        marks: &Marks,
        closely: bool,
        narrow: bool,
    ) -> Result<Ending<N>, InputError> {
        let Scene { lagrangian, start, t0, span, .. } = *self.scene;
        let gauss = Gauss::new(lagrangian, stages, span / count as f64)?;
        let state = contact_geom::legendre(lagrangian, t0, &start);
        let mut stepper = match gauss.verified_stepper(self.structure, t0, state, start.v, false) {
            Ok(stepper) => stepper,
            Err(error) => return halted_at_the_start(error),
        };
        // Of a linear motion nothing is to be seen between the nodes that the order does not show.
        let linear = stepper.route() == GaussRoute::Linear;
        let stride = if linear { CHUNK } else { 1 };
        let sets = match closely {
            _ if linear => 0,
            true => POINTS.div_ceil(stages * count).min(SETS),
            false => 1,
        };
        let floor = larger(0.1 * self.wanted, 1e-11);
        let price = Price::of::<N>(stages);
        let (mut looks, mut seen) = (0, Seen::default());
        let ending = self.follow(&mut stepper, count, marks, stride, |run, part| {
            let ending = run.look(sets).and_then(|look| {
                looks += sets as u64 + 1;
                if !seen.resolves(&look) {
                    return Some(Ending::Unresolved { part });
                }
                (narrow && look.misfit > NARROW * look.expected + floor).then_some(Ending::Narrow { part })
            });
            (ending, run.evaluations() + run.newton_steps() * price.newton + looks * price.look)
        });
        // What is met nowhere else may be what a claim denies.
        if let Ending::Narrow { .. } | Ending::Unresolved { .. } = ending
            && let Some(Defect { claim, size }) = refuted(lagrangian, stepper.time(), &stepper.state(), &start.v)
        {
            return Err(InputError::FalseClaim { claim, size });
        }
        Ok(match ending {
            Ending::Followed(track) => Ending::Followed(Track { misfit: seen.misfit, ..track }),
            other => other,
        })
    }

    /// Follows the motion by the scene's own integrator.
    pub fn own(&mut self, integrator: Integrator, count: usize, marks: &Marks) -> Result<Ending<N>, InputError> {
        let scene = self.scene.bare();
        let plan = match Plan::new(&scene, self.structure, &Choice { integrator, count, error: None }) {
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
            Integrator::Discrete(_) | Integrator::Composition(..) => 32 * N as u64,
        };
        let look = |run: &(dyn Stepper<N> + '_), _: f64| (None, run.evaluations().saturating_mul(price));
        Ok(self.follow(&mut *stepper, count, marks, CHUNK, look))
    }

    /// Takes `count` steps, at most `stride` at a time; `look` sees the run in between with the part that is done, may end it, and says
    /// what it has cost. The cost is taken off the budget.
    fn follow<R: Stepper<N> + ?Sized>(
        &mut self,
        run: &mut R,
        count: usize,
        marks: &Marks,
        stride: usize,
        mut look: impl FnMut(&R, f64) -> (Option<Ending<N>>, u64),
    ) -> Ending<N> {
        let (mut states, mut taken, mut spent) = (Vec::with_capacity(marks.at.len()), 0, 0);
        let mut ending = None;
        while ending.is_none()
            && let Some(mark) = marks.at.get(states.len())
        {
            let mark = mark * (count / marks.base);
            let chunk = stride.min(mark - taken);
            let halt = run.advance(chunk).err();
            taken += halt.map_or(chunk, |halt| halt.taken);
            let part = taken as f64 / count as f64;
            let seen;
            (seen, spent) = look(run, part);
            ending = halt.map(|Halt { cause, .. }| Ending::Halted { part, cause }).or(seen);
            if taken == mark {
                let x = run.state();
                states.push([x.q, x.p]);
            }
            if spent > self.left {
                ending = Some(Ending::Exhausted);
            }
        }
        self.left = self.left.saturating_sub(spent);
        ending.unwrap_or(Ending::Followed(Track { states, misfit: 0.0 }))
    }
}

/// What parts of a run cost, in evaluations of L at one stage.
struct Price {
    /// A step that Newton's method solves: a few solutions of the dense equations of all stages, with second derivatives at each.
    newton: u64,
    /// A look at as many points as there are stages, maps included.
    look: u64,
}

impl Price {
    fn of<const N: usize>(stages: usize) -> Self {
        let (unknowns, stages) = ((stages * (N + 2)) as u64, stages as u64);
        // An evaluation takes as long as about 32 products; second derivatives are not in lanes.
        Price { newton: 4 * (unknowns.pow(3) / 96 + 8 * stages * (2 * N as u64 + 1)), look: 2 * stages }
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
