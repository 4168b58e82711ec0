//! The plan of a scene: the route, in code and in words.

mod halved;
mod jump;

use super::accuracy::Choice;
use super::{Integrator, Scene, Wanted};
use crate::gauss::FEW;
use crate::verified::refuted;
use crate::watch::size;
use crate::{
    ActionSplitting, Composition, Discretised, Doubt, Flow, Gauss, GaussRoute, InputError, Method, Splitting, Status,
    Stepper, Suspicion,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{Defect, Lagrangian, OneParameterGroup, PhasePoint, Structure, VelocityPoint, legendre};
use std::fmt::{Display, Formatter};

/// One line of a plan: something that could be computed, whether it is, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// What it is about.
    pub what: &'static str,
    /// Whether it is computed.
    pub computed: bool,
    /// Why, or how.
    pub why: String,
}

/// What all runs of a plan share.
enum Engine<'a, L, const N: usize> {
    Discrete(Discretised<&'a L, N>),
    Gauss(Box<Gauss<&'a L>>),
    /// Explicit: the coefficients are the stepper's.
    Explicit,
}

/// The steps that are tried, and probed, before a run.
const FIRST_STEPS: usize = 64;

/// The largest number of rows: a few gigabytes.
const MOST_ROWS: usize = 1 << 26;

fn too_many_rows(count: usize) -> InputError {
    let (found, most, remedy) = (count as f64, MOST_ROWS as f64, "record fewer rows");
    InputError::TooMany { what: "the number of rows", found, most, remedy }
}

/// The steps between two probes of the claims in long runs: so many that a probe costs less than one in a hundred.
const PROBES: usize = 1 << 14;

/// The step after which the claims are probed next: every power of two, and the multiples of [`PROBES`].
fn next_probe(taken: usize) -> usize {
    (taken + 1).checked_next_power_of_two().unwrap_or(usize::MAX).min((taken / PROBES + 1) * PROBES)
}

/// The next step, counted from 0, that is compared with two halves: each that ends at a power of two, and the last.
fn halved_step(taken: usize, count: usize) -> usize {
    (taken + 1).checked_next_power_of_two().unwrap_or(count).min(count) - 1
}

/// The earlier of two.
fn first(a: Option<Suspicion>, b: Option<Suspicion>) -> Option<Suspicion> {
    a.into_iter().chain(b).min_by_key(|s| s.step)
}

/// A scene after its checks, with step and route chosen; made by [`Scene::plan`]. Printed, it says what will be computed and
/// what is skipped.
pub struct Plan<'a, L, const N: usize> {
    lagrangian: &'a L,
    start: PhasePoint<N>,
    guess: SVector<f64, N>,
    t0: f64,
    t_end: f64,
    h: f64,
    count: usize,
    error: Option<f64>,
    integrator: Integrator,
    wanted: Wanted<N>,
    engine: Engine<'a, L, N>,
    structure: Structure,
    /// Whether `sigma_d` is the same in all steps.
    constant_rate: bool,
    /// Whether z can be left out.
    z_decouples: bool,
    items: Vec<Item>,
}

/// The state after some steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<const N: usize> {
    /// The time.
    pub t: f64,
    /// The position.
    pub q: SVector<f64, N>,
    /// The momentum.
    pub p: SVector<f64, N>,
    /// The action, where it is wanted.
    pub z: Option<f64>,
    /// The momentum of the group, where one was named.
    pub momentum: Option<f64>,
}

/// What a run has led to. After bad luck it holds what was computed before.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome<const N: usize> {
    /// How the run ended.
    pub status: Status,
    /// The first step that cannot have resolved the motion, where one was seen: what follows it may be wrong.
    pub suspicion: Option<Suspicion>,
    /// The steps taken.
    pub steps: usize,
    /// The time reached.
    pub t: f64,
    /// The position there.
    pub q: SVector<f64, N>,
    /// The momentum there.
    pub p: SVector<f64, N>,
    /// The action there, where it is wanted.
    pub z: Option<f64>,
    /// The conformal factor of the motion, where it is wanted.
    pub conformal_factor: Option<f64>,
    /// The rows, the start included; empty where none are wanted.
    pub rows: Vec<Row<N>>,
    /// The evaluations of forces or gradients.
    pub evaluations: u64,
}

impl<'a, L: Lagrangian<N>, const N: usize> Plan<'a, L, N> {
    /// A plan of a scene whose start has been checked, and the structure probed there.
    pub(super) fn new(scene: &Scene<'a, L, N>, structure: Structure, choice: &Choice) -> Result<Self, InputError> {
        let Scene { lagrangian, start, t0, span, .. } = scene;
        let Choice { integrator, count, h, error } = choice;
        let (lagrangian, count, h): (&'a L, usize, f64) = (lagrangian, *count, *h);
        let state = PhasePoint { q: start.q, p: start.v, z: start.z };
        let engine = match integrator {
            Integrator::Discrete(method) => Engine::Discrete(method.discretise(lagrangian, h, *t0, &state)?),
            Integrator::Gauss { stages } | Integrator::Clocked { stages } => {
                Engine::Gauss(Box::new(Gauss::new(lagrangian, *stages, h)?))
            }
            Integrator::Splitting(_) | Integrator::Composition(..) => Engine::Explicit,
        };
        let mut plan = Plan {
            lagrangian,
            start: legendre(lagrangian, *t0, start),
            guess: start.v,
            t0: *t0,
            t_end: t0 + span,
            h,
            count,
            error: *error,
            integrator: *integrator,
            wanted: scene.wanted.clone(),
            engine,
            structure,
            constant_rate: false,
            z_decouples: false,
            items: Vec::new(),
        };
        plan.explain(start)?;
        Ok(plan)
    }

    /// The time step; by a clock, in its time.
    pub fn step_size(&self) -> f64 {
        self.h
    }

    /// The number of steps; by a clock with steps of a given size, as many as its rate at the start lets expect.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The integrator: the scene's, or the one that was chosen.
    pub fn integrator(&self) -> Integrator {
        self.integrator
    }

    /// The error of (q, p) that the pilot runs found, or predict; `None` where no accuracy was asked for.
    pub fn error(&self) -> Option<f64> {
        self.error
    }

    /// What is computed, and what is not.
    pub fn items(&self) -> &[Item] {
        &self.items
    }

    /// A stepper at the start, for those who drive it themselves: by a clock with [`Stepper::advance_until`], which ends where the span
    /// does. A splitting's does not watch whether its steps resolve the motion:
    /// that costs up to a third of its time, and is for runs whose steps were not found by pilot runs.
    ///
    /// # Errors
    /// Those of the method's start.
    pub fn stepper(&self) -> Result<Box<dyn Stepper<N> + '_>, InputError> {
        self.make_stepper(false)
    }

    fn make_stepper(&self, watched: bool) -> Result<Box<dyn Stepper<N> + '_>, InputError> {
        let (t0, start, action) = (self.t0, self.start, self.wanted.action || !self.z_decouples);
        Ok(match &self.engine {
            Engine::Discrete(ld) => Box::new(Flow::with_guess(ld, t0, start, self.guess)?),
            Engine::Gauss(gauss) if const { L::HAS_CLOCK } && self.by_clock() => {
                Box::new(gauss.own_clock_stepper(self.structure, t0, start, self.guess)?)
            }
            Engine::Gauss(gauss) => {
                let stepper = gauss.verified_stepper(self.structure, t0, start, self.guess, action)?;
                Box::new(if watched { stepper.doubting() } else { stepper })
            }
            Engine::Explicit => self.explicit(self.h, t0, start, watched)?,
        })
    }

    /// Whether steps look at themselves between the nodes of their many stages.
    fn many_stages(&self) -> bool {
        matches!(self.integrator, Integrator::Gauss { stages } if stages > FEW)
    }

    /// Whether steps follow a clock, which ends the run.
    fn by_clock(&self) -> bool {
        matches!(self.integrator, Integrator::Clocked { .. })
    }

    /// A stepper of a splitting or a composition.
    pub(super) fn explicit(
        &self,
        h: f64,
        t0: f64,
        start: PhasePoint<N>,
        watched: bool,
    ) -> Result<Box<dyn Stepper<N> + '_>, InputError> {
        Ok(match &self.integrator {
            Integrator::Splitting(scheme) if !self.z_decouples => {
                let splitting = ActionSplitting::new(self.lagrangian, scheme, h, t0, start)?;
                let splitting = if watched { splitting.doubting() } else { splitting };
                Box::new(if self.moves_little(h) { splitting.compensated() } else { splitting })
            }
            Integrator::Splitting(scheme) => {
                let splitting = Splitting::new(self.lagrangian, scheme, h, t0, start)?;
                let splitting = if watched { splitting.watched() } else { splitting };
                let splitting = if self.moves_little(h) { splitting.compensated() } else { splitting };
                if self.wanted.action { Box::new(splitting) } else { Box::new(splitting.without_action()) }
            }
            Integrator::Composition(method, scheme) => {
                let rule = |h| method.discretise(self.lagrangian, h, t0, &start);
                Box::new(Composition::new(rule, scheme, h, t0, start)?)
            }
            // `new` makes no others.
            Integrator::Discrete(_) | Integrator::Gauss { .. } | Integrator::Clocked { .. } => {
                return Err(InputError::Dimension);
            }
        })
    }

    /// Whether steps move by so little of the position that half of the digits are lost in each; they change so little from step to step
    /// that they are rounded in the same way, and the error piles up.
    fn moves_little(&self, h: f64) -> bool {
        let moved = h * size(&self.guess);
        moved > 0.0 && moved < f64::EPSILON.sqrt() * size(&self.start.q)
    }

    /// Runs the scene.
    ///
    /// # Errors
    /// Those of [`stepper`](Self::stepper). Bad luck in mid-run is the outcome's status.
    pub fn run(&self) -> Result<Outcome<N>, InputError> {
        let mut stepper = self.make_stepper(self.error.is_none())?;
        let Wanted { conformal_factor, rows: stride, .. } = &self.wanted;
        let by_clock = self.by_clock();
        // The logarithm of the product of the sigma_d; in single steps only where they differ.
        let (mut log_factor, single) = (0.0, *conformal_factor && !self.constant_rate);
        let mut rows = Vec::new();
        if let Some(stride) = stride {
            // By a clock the number of steps may be a guess.
            let count = if by_clock && self.error.is_none() { 2 } else { self.count / stride + 2 };
            if count > MOST_ROWS || rows.try_reserve_exact(count).is_err() {
                return Err(too_many_rows(count));
            }
            rows.push(self.row(&*stepper));
        }
        let (mut taken, mut status, mut suspicion) = (0, Status::Completed, None);
        // Steps that pilot runs have found are judged already; those of many stages are looked at between their nodes, and are compared
        // with halves in doubt alone.
        let doubts = self.error.is_none() && !by_clock;
        let halves = doubts && !self.many_stages();
        let most = if by_clock { usize::MAX } else { self.count };
        let mut over = false;
        while !over {
            let next_row = stride.map_or(most, |stride| (taken / stride + 1) * stride);
            // One mark is enough.
            let halved = if halves && suspicion.is_none() { halved_step(taken, most) } else { usize::MAX };
            let before = (taken == halved).then(|| (stepper.time(), stepper.state()));
            let next_look = if taken == halved { taken + 1 } else { halved };
            let next = next_row.min(next_probe(taken)).min(next_look).min(most);
            let chunk = if single { 1 } else { next - taken };
            let (done, cause) = match stepper.advance_until(chunk, self.t_end) {
                Ok(done) => (done, None),
                Err(halt) => (halt.taken, Some(halt.cause)),
            };
            if let (Some((t, from)), None) = (before, cause) {
                let step = Doubt { step: taken, steps: 1, t, from, to: stepper.state() };
                suspicion = first(suspicion, self.settled(&step));
            }
            taken += done;
            if single {
                log_factor += done as f64 * stepper.sigma().ln();
            }
            if let Some(cause) = cause {
                status = Status::Failed { step: taken, cause };
                break;
            }
            over = taken == most || by_clock && stepper.time() >= self.t_end;
            if stride.is_some_and(|stride| taken % stride == 0 || over) {
                if rows.len() == MOST_ROWS {
                    return Err(too_many_rows(rows.len() + 1));
                }
                rows.push(self.row(&*stepper));
            }
            if over || taken == next_probe(taken - 1) {
                let doubt = stepper.doubt().filter(|_| doubts && suspicion.is_none());
                suspicion = first(suspicion, doubt.and_then(|doubt| self.settled(&doubt)));
                suspicion = first(suspicion, stepper.suspicion());
                if let Some(Defect { claim, size }) = self.refuted(&*stepper) {
                    status = Status::FalseClaim { step: taken, claim, size };
                    break;
                }
            }
        }
        if self.constant_rate {
            log_factor = taken as f64 * stepper.sigma().ln();
        }
        let end = self.row(&*stepper);
        Ok(Outcome {
            status,
            suspicion: first(suspicion, stepper.suspicion()),
            steps: taken,
            t: end.t,
            q: end.q,
            p: end.p,
            z: end.z,
            conformal_factor: conformal_factor.then(|| log_factor.exp()),
            rows,
            evaluations: stepper.evaluations(),
        })
    }

    /// The first claim that is false at the state of a stepper.
    fn refuted(&self, stepper: &dyn Stepper<N>) -> Option<Defect> {
        refuted(self.lagrangian, stepper.time(), &stepper.state(), &self.guess)
    }

    /// Probes the claims along the first steps.
    ///
    /// # Errors
    /// [`InputError::FalseClaim`] with the first claim that does not hold.
    pub(super) fn probe_first_steps(&self) -> Result<(), InputError> {
        let mut stepper = self.stepper()?;
        let mut taken = 0;
        while taken < self.count.min(FIRST_STEPS) {
            let steps = next_probe(taken).min(self.count) - taken;
            match stepper.advance_until(steps, self.t_end) {
                Ok(done) if done > 0 => taken += done,
                _ => break,
            }
            if let Some(Defect { claim, size }) = self.refuted(&*stepper) {
                return Err(InputError::FalseClaim { claim, size });
            }
        }
        Ok(())
    }

    fn row(&self, stepper: &dyn Stepper<N>) -> Row<N> {
        let PhasePoint { q, p, z } = stepper.state();
        let momentum = self.wanted.momentum.as_ref().map(|group| group.momentum(&q, &p));
        Row { t: stepper.time(), q, p, z: self.wanted.action.then_some(z), momentum }
    }

    /// Finds the route and puts it in words.
    fn explain(&mut self, start: &VelocityPoint<N>) -> Result<(), InputError> {
        let structure = self.structure;
        let drag = structure.is_affine_in_z();
        let mut items = Vec::new();
        let mut say = |what, computed, why: &str| items.push(Item { what, computed, why: why.into() });
        match (&self.engine, &self.integrator) {
            (_, Integrator::Clocked { .. }) => {
                say(
                    "time step",
                    true,
                    "the clock's rate follows the motion: equal steps of its time, a shorter one at the end",
                );
                say("iteration", true, "velocities, actions, factors and rates of the stages, to round-off");
                let why =
                    if structure.constant_mass { "W is constant: inverted once" } else { "at the stages, once a step" };
                say("mass matrix", !structure.constant_mass, why);
                say("Jacobian", false, "the iteration needs gradients alone");
                say("Newton's method", false, "steps whose iteration does not contract are refused");
            }
            (Engine::Gauss(gauss), _) => {
                let route = gauss.verified_stepper(structure, self.t0, self.start, start.v, false)?.route();
                self.constant_rate = matches!(route, GaussRoute::Linear | GaussRoute::Condensed);
                self.z_decouples = self.constant_rate;
                match route {
                    GaussRoute::Linear => {
                        say("iteration", false, "L is quadratic: the step is one matrix, made once");
                        say("forces", false, "the matrix holds them");
                    }
                    GaussRoute::Condensed => {
                        say("iteration", true, "the accelerations of the stages alone, to round-off");
                        say("mass matrix", false, "W is constant: inverted once");
                        say("integrating factor", false, "gamma is constant: its stages are computed once");
                        say(
                            "Jacobian",
                            false,
                            "one factorisation for a linear force, renewed where the force's slope has changed",
                        );
                    }
                    GaussRoute::ConstantMass | GaussRoute::General => {
                        say(
                            "iteration",
                            true,
                            "velocities, actions and integrating factors of the stages, to round-off",
                        );
                        let constant = route == GaussRoute::ConstantMass;
                        let why = if constant { "W is constant: inverted once" } else { "at the stages, once a step" };
                        say("mass matrix", !constant, why);
                        say("Jacobian", false, "the iteration needs gradients alone");
                    }
                }
                if route != GaussRoute::Linear {
                    say("Newton's method", false, "only in steps whose iteration does not contract");
                }
            }
            (_, Integrator::Discrete(Method::Strang) | Integrator::Composition(Method::Strang, _)) => {
                self.constant_rate = structure.has_constant_rate();
                say("Newton's method", false, "each step is explicit: forces only");
                say("Jacobian", false, "no equation is solved");
            }
            (Engine::Discrete(_), _) => {
                say("Newton's method", true, "each step is implicit in q1");
                say("Jacobian", true, "second derivatives of L at each iterate");
            }
            (_, Integrator::Composition(..)) => {
                say("Newton's method", true, "each substep is implicit in q1");
                say("Jacobian", true, "second derivatives of L at each iterate");
            }
            _ => {
                self.constant_rate = structure.has_constant_rate();
                self.z_decouples = drag;
                say("Newton's method", false, "each step is explicit: forces only");
                say("Jacobian", false, "no equation is solved");
                say("shared kicks", false, "the last force of a step is the first of the next");
            }
        }
        let implicit = matches!(self.integrator, Integrator::Discrete(_) | Integrator::Composition(..));
        match (self.wanted.action, self.z_decouples) {
            (true, _) => say("action z", true, "wanted"),
            (false, true) => say("action z", false, "L = L0 + gamma z: it does not act back, and nobody wants it"),
            (false, false) if implicit => say("action z", true, "the flow of a discrete Lagrangian carries it"),
            (false, false) if drag => say("action z", true, "the stages of this route carry it"),
            (false, false) => say("action z", true, "it drives the motion"),
        }
        let rate = match (self.wanted.conformal_factor, self.constant_rate) {
            (false, true) => (false, "sigma_d is the same in every step, and nobody wants the product"),
            (true, true) => (true, "wanted; sigma_d is the same in every step: a power at the end"),
            (true, false) => (true, "wanted, and different in every step: a product along the run"),
            (false, false) => (false, "the product is not wanted; each step checks that its own is positive"),
        };
        say("conformal factor", rate.0, rate.1);
        let clock = if structure.autonomous { "L does not depend on it" } else { "L depends on it" };
        say("time at the stages", !structure.autonomous, clock);
        match self.wanted.rows {
            None => say("rows", false, "only the final state is wanted"),
            Some(stride) => say("rows", true, &format!("one in {stride} steps")),
        }
        let momentum = if self.wanted.momentum.is_some() { "in each row" } else { "no group is named" };
        say("momentum", self.wanted.momentum.is_some(), momentum);
        self.items = items;
        Ok(())
    }
}

impl<L, const N: usize> Display for Plan<'_, L, N> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Plan { count, h, integrator, t0, t_end, .. } = self;
        let of = if let Integrator::Clocked { .. } = integrator { " of the clock's time" } else { "" };
        writeln!(f, "{count} steps of {h}{of} by {integrator}, t = {t0} .. {t_end}")?;
        for (title, computed) in [("computed", true), ("skipped", false)] {
            writeln!(f, "{title}:")?;
            for item in self.items.iter().filter(|item| item.computed == computed) {
                writeln!(f, "  {}: {}", item.what, item.why)?;
            }
        }
        Ok(())
    }
}
