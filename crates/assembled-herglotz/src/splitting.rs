//! Explicit integrators: kicks and drifts.

use crate::AssemblyError;
use crate::aligned::Aligned;
use crate::blocks::{self, BLOCK};
use crate::drag::{Drag, Drift};
use crate::kernels::Weight;
use crate::monitor::{EnergyMonitor, Reached, StepFacts};
use crate::pass::{InverseMasses, Pass, Passed};
use crate::system::{AssembledSystem, Masses, State};
use discrete_herglotz::{InputError, SplittingScheme, StepError, StepFailure, UnresolvedStep};

/// The number of steps between two checks that all numbers are finite.
const LOOK: usize = 256;

/// A splitting method for `L = sum m_i v_i^2/2 - V(t, q) + gamma z`.
///
/// The flow of the kinetic energy with the drag over a time s is `q += (e^(gamma s) - 1)/gamma v`, `v = e^(gamma s) v`;
/// that of `-V` is the kick `m v -= s V_q`. Both are exact, with their action, and conformal contact maps, so that
/// every step has `sigma_d = e^(gamma h)`. If the drag depends on time, `sigma_d` is the exponential of its integral,
/// which is computed by a Gauss formula of order 12 along each drift. The map is that of
/// [`Splitting`](discrete_herglotz::splitting::Splitting) on a small system.
///
/// A kick and the drift after it are one pass over memory, block by block: the forces of a block are evaluated, and its
/// velocities and positions are updated, while it is in the L1 cache. The new positions go to a second vector, so that
/// blocks are independent. Large systems are distributed over threads, and the results are bitwise equal for any number
/// of them.
///
/// The last kick of a step and the first of the next are merged. A requested state is completed on a copy, so that the
/// results do not depend on how many steps are taken at once.
pub struct AssembledSplitting<'a> {
    system: &'a AssembledSystem,
    table: SubstepTable,
    h: f64,
    t0: f64,
    taken: usize,
    /// The padded positions before (`q`) and after (`next`) a pass.
    q: Aligned,
    next: Aligned,
    v: Aligned,
    /// The velocities of a requested state.
    end: Aligned,
    /// The rounding errors of compensated sums (`rests`), and those of a requested state (`end_rests`); otherwise
    /// empty.
    rests: Rests,
    end_rests: Rests,
    inverse_masses: InverseMasses,
    z: f64,
    action: bool,
    /// The contribution of each block to the action: its potential energy, and twice its kinetic energy. Empty without
    /// the action.
    energies: Vec<[f64; 2]>,
    monitor: EnergyMonitor,
}

/// The accumulated rounding errors of positions and velocities.
#[derive(Debug, Default)]
struct Rests {
    q: Vec<f64>,
    v: Vec<f64>,
}

/// A kick and the drift that follows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    pub kick: f64,
    pub drift: Drift,
    /// The length of the drift in time.
    span: f64,
    /// The time of the kick, relative to the start of the step.
    time: f64,
}

impl Stage {
    /// The stage in a step that starts at the time t. With a time-dependent drag the drift differs from step to step.
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
    /// The stages of a later step, whose first kick or drift is merged with the last of the step before.
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
        // The merged kick precedes the last drift of the step before.
        joined[0] = stage(last_kick + kicks[0], last_drift + drifts[0], -last_drift * h);
        SubstepTable {
            first,
            joined,
            closing: stage(last_kick, last_drift, if last_drift == 0.0 { h } else { time * h }),
        }
    }
}

impl<'a> AssembledSplitting<'a> {
    /// Starts from a state. The action z is computed if the start has one, which costs the energies at each stage.
    ///
    /// # Errors
    /// [`AssemblyError::Input`] with [`InputError::Step`] unless h is finite and not 0 (a negative h runs backward in
    /// time); [`AssemblyError::Length`] and [`AssemblyError::NonFinite`] of the state; [`AssemblyError::Mass`] if an
    /// unknown has no mass; [`AssemblyError::NotSeparable`] for general terms; [`AssemblyError::Undefined`] if a force
    /// is not finite.
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
        // Splittings have the conformal factor of the flow.
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

    /// With compensated (Kahan) summation: the rounding errors of positions and velocities are carried from stage to
    /// stage. This is useful for few unknowns over very many steps, such as planets over thousands of revolutions.
    /// There the kick is rounded, which is smaller than the velocity by about the number of stages in a revolution. It
    /// needs four more vectors, and a quarter more time for five bodies.
    pub fn compensated(mut self) -> Self {
        let rests = || Rests { q: vec![0.0; self.v.len()], v: vec![0.0; self.v.len()] };
        (self.rests, self.end_rests) = (rests(), rests());
        self
    }

    /// Takes the given number of steps.
    ///
    /// # Errors
    /// [`StepFailure`] with [`StepError::NonFinite`] if a velocity or the action is infinite or NaN. This is checked
    /// every 256 steps: `taken` is the number of steps up to the last check that was passed, and the state is that at
    /// the failed check.
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
            // The sum is not finite if one of its terms is not.
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

    /// Checks the energy.
    #[cold]
    fn look(&mut self) {
        let (t, z) = self.complete();
        let log_factor = self.system.rate(t) * (t - self.t0);
        let reached = Reached { t, log_factor, taken: self.taken };
        let AssembledSplitting { system, next, end, monitor, .. } = self;
        monitor.look(system, reached, |t, bounded| system.energies((t, next, end, z), bounded));
    }

    /// The first step at which the energy showed that the steps do not resolve the motion, if there is one: results
    /// from this step on may be wrong.
    ///
    /// The energy `E_L`, which is multiplied by the conformal factor if L does not depend on time, is checked after 4,
    /// 16, 64 and 256 steps, every 1024 steps, and by this call. Without the action, or with a time-dependent gamma,
    /// the check is that `T + V` does not grow while the drag dissipates. The check detects nothing if the potential
    /// depends on time, nor from `T + V` if `gamma h > 0`.
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

    /// Completes the last step in `next` and `end`, and returns the time and the action.
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

    /// `sigma_d` of the last step: `e^(gamma h)`, or the exponential of the integral of gamma over it; before the first
    /// step, `sigma_d` of the first.
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
