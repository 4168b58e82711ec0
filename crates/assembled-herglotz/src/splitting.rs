//! Explicit steps: kicks and drifts.

use crate::AssemblyError;
use crate::aligned::Aligned;
use crate::blocks::{self, BLOCK};
use crate::drag::{Drag, Drift};
use crate::kernels::Weight;
use crate::monitor::{EnergyMonitor, Reached, StepFacts};
use crate::pass::{InverseMasses, Pass, Passed};
use crate::system::{AssembledSystem, Masses, State};
use discrete_herglotz::{InputError, SplittingScheme, StepError, StepFailure, UnresolvedStep};

/// The steps between two looks whether all numbers are finite.
const LOOK: usize = 256;

/// A splitting at work on `L = sum m_i v_i^2/2 - V(t, q) + gamma z`.
///
/// The flow of the kinetic part with the drag, over a time s, is `q += (e^(gamma s) - 1)/gamma v`, `v = e^(gamma s) v`; that of
/// `-V` is the kick `m v -= s V_q`; each is exact, with its action, and a conformal contact map. So every step has
/// `sigma_d = e^(gamma h)`; of a drag that depends on time, the exponential of its integral, which a Gauss formula of order 12 takes along each
/// drift. It is that of [`Splitting`](discrete_herglotz::Splitting) on a small system.
///
/// A kick and the drift after it are one pass over memory, block by block: the block's forces are gathered and its velocities
/// and positions moved while it is in the first cache. The new positions go to a second vector, so that blocks are independent:
/// large systems are shared among threads, and the numbers are the same to the last bit for any number of them.
///
/// The last kick of a step and the first of the next are one. A state that is asked for is completed on a copy, so the numbers
/// do not depend on how many steps are taken at once.
pub struct AssembledSplitting<'a> {
    system: &'a AssembledSystem,
    table: SubstepTable,
    h: f64,
    t0: f64,
    taken: usize,
    /// Positions between fixed places, before and after a pass.
    q: Aligned,
    next: Aligned,
    v: Aligned,
    /// The velocities of a state that is asked for.
    end: Aligned,
    /// Of compensated sums what the last digits of positions and velocities leave out, and of a state that is asked for. Else empty.
    rests: Rests,
    end_rests: Rests,
    inverse_masses: InverseMasses,
    z: f64,
    action: bool,
    /// What each block adds to the action: its potential energy, twice its kinetic energy. Empty without the action.
    energies: Vec<[f64; 2]>,
    monitor: EnergyMonitor,
}

/// What the last digits of positions and velocities leave out.
#[derive(Debug, Default)]
struct Rests {
    q: Vec<f64>,
    v: Vec<f64>,
}

/// A kick, and the drift that follows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    pub kick: f64,
    pub drift: Drift,
    /// The length of the drift in time.
    span: f64,
    /// The time of the kick after the step's start.
    time: f64,
}

impl Stage {
    /// In a step from the time t. A drag that depends on time has a drift of its own in each step.
    fn at(&self, drag: &Drag, t: f64) -> Self {
        match drag {
            Drag::Constant(_) => *self,
            Drag::Timed(_) => Stage { drift: drag.drift(t + self.time, self.span), ..*self },
        }
    }
}

/// The stages of a step.
struct SubstepTable {
    first: Vec<Stage>,
    /// Those of a later step: its first kick, or its first drift, is one with the last of the step before.
    joined: Vec<Stage>,
    closing: Stage,
}

impl SubstepTable {
    fn new(scheme: &SplittingScheme, drag: &Drag, h: f64, t0: f64) -> Self {
        let (drifts, kicks) = scheme.coefficients();
        let stages = scheme.stages();
        let stage = |kick: f64, span: f64, time: f64| {
            let span = span * h;
            Stage { kick: kick * h, drift: drag.drift(t0 + time, span), span, time }
        };
        let mut time = 0.0;
        let first: Vec<Stage> = (0..stages)
            .map(|i| {
                let stage = stage(kicks[i], drifts[i], time * h);
                time += drifts[i];
                stage
            })
            .collect();
        // Only a scheme that begins with a drift ends with one.
        let (last_kick, last_drift) = (kicks[stages], drifts.get(stages).copied().unwrap_or(0.0));
        let mut joined = first.clone();
        // Its kick stands before the last drift.
        joined[0] = stage(last_kick + kicks[0], last_drift + drifts[0], -last_drift * h);
        SubstepTable {
            first,
            joined,
            closing: stage(last_kick, last_drift, if last_drift == 0.0 { h } else { time * h }),
        }
    }
}

impl<'a> AssembledSplitting<'a> {
    /// From a state; with the action z where the state has one, which costs the energies at each stage.
    ///
    /// # Errors
    /// [`AssemblyError::Input`] with [`InputError::Step`] unless h is finite and not 0 (negative goes back);
    /// [`AssemblyError::Length`] and [`AssemblyError::NonFinite`] of the state; [`AssemblyError::Mass`] where an unknown has
    /// none; [`AssemblyError::NotSeparable`] of general terms; [`AssemblyError::Undefined`] where a force is not finite.
    pub fn new(
        system: &'a AssembledSystem,
        scheme: &SplittingScheme,
        h: f64,
        start: State,
    ) -> Result<Self, AssemblyError> {
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h }.into());
        }
        start.check(system)?;
        system.check_separable()?;
        system.check_masses(false)?;
        AssembledSystem::check_number("gamma", system.rate(start.t))?;
        let n = system.unknowns();
        let q = Aligned::between_fixed(start.q);
        let inverse_masses = match &system.masses {
            Masses::Same(m) => InverseMasses::Same(1.0 / m),
            Masses::Each(masses) => InverseMasses::Each(masses.iter().map(|m| 1.0 / m).collect()),
        };
        // That of the flow: splittings have no other.
        let log_sigma = system.rate(start.t) * h;
        let info = StepFacts { h, log_sigma, order: scheme.order() };
        let monitor = EnergyMonitor::new(system, start, info, |bounded| {
            system.energies((start.t, &q, start.v, start.z.unwrap_or(0.0)), bounded)
        });
        let splitting = AssembledSplitting {
            system,
            table: SubstepTable::new(scheme, &system.drag, h, start.t),
            h,
            t0: start.t,
            taken: 0,
            next: Aligned::between_fixed(start.q),
            q,
            v: Aligned::from_slice(start.v),
            end: Aligned::zeros(n, 0),
            rests: Rests::default(),
            end_rests: Rests::default(),
            inverse_masses,
            z: start.z.unwrap_or(0.0),
            action: start.z.is_some(),
            energies: vec![[0.0; 2]; if start.z.is_some() { blocks::count(n) } else { 0 }],
            monitor,
        };
        let mut force = vec![0.0; BLOCK.min(n)];
        for block in 0..blocks::count(n) {
            let from = block * BLOCK;
            let here = BLOCK.min(n - from);
            force.fill(0.0);
            for list in &system.potentials {
                list.kick(block, start.t, &splitting.q, Weight::Same(1.0), &mut force[..here], None);
            }
            if let Some(i) = force[..here].iter().position(|f| !f.is_finite()) {
                return Err(AssemblyError::Undefined { unknown: from + i });
            }
        }
        Ok(splitting)
    }

    /// With compensated sums (Kahan's): what the last digits of positions and velocities leave out is carried from stage to stage. For few unknowns
    /// over very many steps, as planets over thousands of revolutions: what is rounded then is the kick, which is smaller than the velocity by
    /// about the number of stages in a revolution. It takes four vectors of memory more, and a quarter more of the time of five bodies.
    pub fn compensated(mut self) -> Self {
        let rests = || Rests { q: vec![0.0; self.v.len()], v: vec![0.0; self.v.len()] };
        (self.rests, self.end_rests) = (rests(), rests());
        self
    }

    /// Takes steps.
    ///
    /// # Errors
    /// [`StepFailure`] with [`StepError::NonFinite`] where a velocity is no number any more. That is looked for every 256 steps, and
    /// `taken` are the steps up to the last look at which all was well; the state is that after it was found.
    pub fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        let mut taken = 0;
        while taken < steps {
            let some = LOOK.min(steps - taken);
            for _ in 0..some {
                self.step();
                if self.monitor.is_due(self.taken) {
                    self.look();
                }
            }
            // A number that is none makes the sum one.
            if !(self.v.iter().sum::<f64>() + self.z).is_finite() {
                return Err(StepFailure { taken, cause: StepError::NonFinite });
            }
            taken += some;
        }
        Ok(())
    }

    fn step(&mut self) {
        let t = self.t0 + self.taken as f64 * self.h;
        for i in 0..self.table.first.len() {
            let table = if self.taken == 0 { &self.table.first } else { &self.table.joined };
            let stage = table[i].at(&self.system.drag, t);
            let pass =
                Pass { system: self.system, inverse: &self.inverse_masses, q: &self.q, t: t + stage.time, stage };
            let next = self.next.get_mut(1..=self.v.len()).unwrap_or_default();
            let Rests { q: q_rest, v: v_rest } = &mut self.rests;
            pass.run(Passed { v: &mut self.v, next, energies: &mut self.energies, q_rest, v_rest });
            if self.action {
                self.z = act(self.z, &stage, &self.energies);
            }
            std::mem::swap(&mut self.q, &mut self.next);
        }
        self.taken += 1;
    }

    /// Looks at the energy.
    #[cold]
    fn look(&mut self) {
        let (t, z) = self.complete();
        let log_factor = self.system.rate(t) * (t - self.t0);
        let reached = Reached { t, log_factor, taken: self.taken };
        let AssembledSplitting { system, next, end, monitor, .. } = self;
        monitor.look(system, reached, |t, bounded| system.energies((t, next, end, z), bounded));
    }

    /// The first step at which the steps were seen not to resolve the motion, where they were: by the energy, which is multiplied by the
    /// conformal factor where L does not depend on time, and without the action at least does not grow by drag. It is looked at after 4, 16, 64 and 256
    /// steps, every 1024, and here: what follows such a step may be wrong. Nothing is seen without the action where gamma is positive, and of
    /// systems that depend on time.
    pub fn unresolved(&mut self) -> Option<UnresolvedStep> {
        if self.monitor.tells(self.taken) {
            self.look();
        }
        self.monitor.unresolved()
    }

    /// The state after the steps taken.
    pub fn state(&mut self) -> State<'_> {
        let (t, z) = self.complete();
        let n = self.system.unknowns();
        State { t, q: &self.next[1..=n], v: &self.end, z: self.action.then_some(z) }
    }

    /// Completes the last step, in `next` and `end`; the time and the action.
    fn complete(&mut self) -> (f64, f64) {
        let n = self.system.unknowns();
        let t = self.t0 + self.taken as f64 * self.h;
        self.end.copy_from_slice(&self.v);
        let mut z = self.z;
        if self.taken == 0 {
            self.next.copy_from_slice(&self.q);
        } else {
            let stage = self.table.closing.at(&self.system.drag, t - self.h);
            let time = t - self.h + stage.time;
            let pass = Pass { system: self.system, inverse: &self.inverse_masses, q: &self.q, t: time, stage };
            self.end_rests.q.copy_from_slice(&self.rests.q);
            self.end_rests.v.copy_from_slice(&self.rests.v);
            let next = self.next.get_mut(1..=n).unwrap_or_default();
            let Rests { q: q_rest, v: v_rest } = &mut self.end_rests;
            pass.run(Passed { v: &mut self.end, next, energies: &mut self.energies, q_rest, v_rest });
            if self.action {
                z = act(z, &stage, &self.energies);
            }
        }
        (t, z)
    }

    /// `sigma_d` of the last step, `e^(gamma h)`, or the exponential of the integral of gamma over it; before the first one, of that.
    pub fn sigma(&self) -> f64 {
        let drag = &self.system.drag;
        if let Drag::Constant(gamma) = drag {
            return (gamma * self.h).exp();
        }
        let t = self.t0 + self.taken.saturating_sub(1) as f64 * self.h;
        let drifts = self.table.first.iter().chain([&self.table.closing]);
        drifts.map(|stage| 1.0 + stage.at(drag, t).drift.damping).product()
    }
}

/// The action after a stage.
fn act(z: f64, stage: &Stage, energies: &[[f64; 2]]) -> f64 {
    let (potential, twice_kinetic) = energies.iter().fold((0.0, 0.0), |(v, k), e| (v + e[0], k + e[1]));
    let kicked = z - stage.kick * potential;
    kicked + (stage.drift.damping * kicked + stage.drift.lift * twice_kinetic)
}
