//! Explicit steps: kicks and drifts.

use crate::AssemblyError;
use crate::aligned::Aligned;
use crate::blocks::{self, BLOCK};
use crate::drag::{Drag, Drift};
use crate::kernels::{Then, Weight};
use crate::system::{AssembledSystem, Masses, State};
use discrete_herglotz::{Halt, InputError, SplittingScheme, StepError};
use rayon::prelude::*;

/// The number of unknowns from which a pass over memory is shared among threads.
const SHARED: usize = 1 << 17;

/// The blocks that a thread takes at a time.
const TOGETHER: usize = 16;

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
    inverse_masses: InverseMasses,
    z: f64,
    action: bool,
    /// What each block adds to the action: its potential energy, twice its kinetic energy. Empty without the action.
    energies: Vec<[f64; 2]>,
}

enum InverseMasses {
    Same(f64),
    Each(Vec<f64>),
}

/// A kick, and the drift that follows.
#[derive(Clone, Copy, Debug)]
struct Stage {
    kick: f64,
    drift: Drift,
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
    /// From a state, without the action.
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
            inverse_masses,
            z: start.z,
            action: false,
            energies: Vec::new(),
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

    /// With the action z, which costs the energies at each stage.
    pub fn with_action(mut self) -> Self {
        self.action = true;
        self.energies = vec![[0.0; 2]; blocks::count(self.system.unknowns())];
        self
    }

    /// Takes steps.
    ///
    /// # Errors
    /// [`Halt`] with [`StepError::NonFinite`] where a velocity is no number any more. That is looked for every 256 steps, and
    /// `taken` are the steps up to the last look at which all was well; the state is that after it was found.
    pub fn advance(&mut self, steps: usize) -> Result<(), Halt> {
        let mut taken = 0;
        while taken < steps {
            let some = LOOK.min(steps - taken);
            for _ in 0..some {
                self.step();
            }
            // A number that is none makes the sum one.
            if !(self.v.iter().sum::<f64>() + self.z).is_finite() {
                return Err(Halt { taken, cause: StepError::NonFinite });
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
            pass.run(&mut self.v, &mut self.next, &mut self.energies);
            if self.action {
                self.z = act(self.z, &stage, &self.energies);
            }
            std::mem::swap(&mut self.q, &mut self.next);
        }
        self.taken += 1;
    }

    /// The state after the steps taken.
    pub fn state(&mut self) -> State<'_> {
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
            pass.run(&mut self.end, &mut self.next, &mut self.energies);
            if self.action {
                z = act(z, &stage, &self.energies);
            }
        }
        State { t, q: &self.next[1..=n], v: &self.end, z }
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

/// A kick and a drift, from the positions `q` to others.
struct Pass<'p> {
    system: &'p AssembledSystem,
    inverse: &'p InverseMasses,
    q: &'p [f64],
    t: f64,
    stage: Stage,
}

impl Pass<'_> {
    fn run(&self, v: &mut [f64], next: &mut [f64], energies: &mut [[f64; 2]]) {
        let n = v.len();
        let next = &mut next[1..=n];
        if n < SHARED || rayon::current_num_threads() == 1 {
            self.blocks(0, v, next, energies);
            return;
        }
        let together = TOGETHER * BLOCK;
        let parts = v.par_chunks_mut(together).zip(next.par_chunks_mut(together)).enumerate();
        if energies.is_empty() {
            parts.for_each(|(i, (v, next))| self.blocks(i * TOGETHER, v, next, &mut []));
        } else {
            parts
                .zip(energies.par_chunks_mut(TOGETHER))
                .for_each(|((i, (v, next)), energies)| self.blocks(i * TOGETHER, v, next, energies));
        }
    }

    /// Blocks from a first one on.
    fn blocks(&self, first: usize, v: &mut [f64], next: &mut [f64], energies: &mut [[f64; 2]]) {
        let mut energies = energies.iter_mut();
        for (i, (v, next)) in v.chunks_mut(BLOCK).zip(next.chunks_mut(BLOCK)).enumerate() {
            self.block(first + i, v, next, energies.next());
        }
    }

    fn block(&self, block: usize, v: &mut [f64], next: &mut [f64], energies: Option<&mut [f64; 2]>) {
        let Stage { kick, drift, .. } = self.stage;
        let from = block * BLOCK;
        let weight = match self.inverse {
            InverseMasses::Same(inverse) => Weight::Same(kick * inverse),
            InverseMasses::Each(inverse) => Weight::Masses(kick, &inverse[from..from + v.len()]),
        };
        if kick != 0.0 {
            let lists = &self.system.potentials;
            for (i, list) in lists.iter().enumerate() {
                // The energies are those between the kick and the drift.
                let last = i + 1 == lists.len() && energies.is_none();
                if list.kick(block, self.t, self.q, weight, v, last.then_some(Then { drift, next: &mut *next })) {
                    return;
                }
            }
        }
        if let Some(energies) = energies {
            let blocks = blocks::count(self.system.unknowns());
            let lists = self.system.potentials.iter();
            let potential = lists.map(|list| list.energy(block, blocks, self.t, self.q)).sum();
            // Without a kick the action has nothing of it.
            energies[0] = if kick == 0.0 { 0.0 } else { potential };
            energies[1] = match &self.system.masses {
                Masses::Same(m) => m * sum_of_squares(v),
                Masses::Each(masses) => masses[from..from + v.len()].iter().zip(&*v).map(|(m, v)| m * v * v).sum(),
            };
        }
        drift.go(&self.q[from + 1..], v, next);
    }
}

/// The sum of squares, in eight partial sums so that the compiler may use vector registers.
fn sum_of_squares(v: &[f64]) -> f64 {
    let (chunks, rest) = v.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for chunk in chunks {
        for (sum, v) in sums.iter_mut().zip(chunk) {
            *sum += v * v;
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|v| v * v).sum::<f64>()
}
