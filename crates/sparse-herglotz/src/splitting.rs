//! Explicit integrators: kicks and drifts.

use crate::SparseError;
use crate::aligned::AlignedVector;
use crate::blocks::{BLOCK_SIZE, block_count};
use crate::drag::Drag;
use crate::friction::FrictionDrift;
use crate::kick::KickFactor;
use crate::kick_drift::{InverseMasses, KickDrift, KickDriftOutput};
use crate::monitor::{EnergyMonitor, RunProgress, StepInfo};
use crate::stages::{Stage, StageTable};
use crate::system::{MassSource, Masses, SparseSystem, State};
use discrete_herglotz::{InputError, SplittingScheme, StepError, StepFailure, UnresolvedStep};

/// The number of steps between two checks that all numbers are finite. Such a check reads all velocities once more; at
/// this distance it costs less than one per cent of the steps.
const STEPS_BETWEEN_FINITE_CHECKS: usize = 256;

/// A splitting method for `L = sum m_i v_i^2/2 - V(t, q) + gamma z`.
///
/// The flow of the kinetic energy with the drag over a time s is `q += (e^(gamma s) - 1)/gamma v`, `v = e^(gamma s) v`;
/// that of `-V` is the kick `m v -= s V_q`. Both are exact, with their action, and conformal contact maps, so that
/// every step has `sigma_d = e^(gamma h)`. If the drag depends on time, `sigma_d` is the exponential of its integral,
/// which is computed by a Gauss formula of order 12 along each drift. The map is that of
/// [`Splitting`](discrete_herglotz::splitting::Splitting) on a small system.
///
/// Friction, an applied force `-c_i v_i`, is combined with the drift: the velocity of an unknown decays at the rate
/// `gamma - c_i/m_i`. It needs three numbers for each unknown and each stage.
///
/// A kick and the drift after it are applied in one pass over memory, block by block: the forces of a block are
/// evaluated, and its velocities and positions are updated, while it is in the L1 cache. The new positions go to a
/// second vector, so that blocks are independent. Large systems are distributed over threads, and the results are
/// bitwise equal for any number of them.
///
/// The last kick of a step and the first of the next are merged. A requested state is completed on a copy, so that the
/// results do not depend on how many steps are taken at once.
pub struct SparseSplitting<'a> {
    system: &'a SparseSystem,
    table: StageTable,
    /// The drifts with friction of the stages of the first step, of the merged stage, and of the closing one; empty
    /// without friction.
    friction: Vec<FrictionDrift>,
    h: f64,
    t0: f64,
    taken: usize,
    /// The padded positions before (`q`) and after (`next`) a stage.
    q: AlignedVector,
    next: AlignedVector,
    v: AlignedVector,
    /// The velocities of a requested state.
    end_v: AlignedVector,
    /// The compensation terms of the positions and velocities, and those of a requested state; empty without
    /// compensated summation.
    compensation: CompensationTerms,
    end_compensation: CompensationTerms,
    inverse_masses: InverseMasses,
    z: f64,
    has_action: bool,
    /// The contribution of each block to the action: its potential energy, and twice its kinetic energy. Empty without
    /// the action.
    energies: Vec<[f64; 2]>,
    monitor: EnergyMonitor,
}

/// The accumulated rounding errors of positions and velocities.
#[derive(Debug, Default)]
struct CompensationTerms {
    q: Vec<f64>,
    v: Vec<f64>,
}

impl<'a> SparseSplitting<'a> {
    /// Starts from a state. The action z is computed if the start has one, which costs the energies at each stage.
    ///
    /// # Errors
    /// [`SparseError::Input`] with [`InputError::Step`] unless h is finite and not 0 (a negative h runs backward in
    /// time); [`SparseError::Length`] and [`SparseError::NonFinite`] of the state; [`SparseError::Mass`] if an
    /// unknown has no mass; [`SparseError::NotSeparable`] for general terms; [`SparseError::Undefined`] if a force
    /// is not finite.
    pub fn new(system: &'a SparseSystem, scheme: &SplittingScheme, h: f64, start: State) -> Result<Self, SparseError> {
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h }.into());
        }
        start.check(system)?;
        system.check_separable()?;
        system.check_unconstrained("`SparseSplitting`")?;
        system.check_masses(MassSource::Diagonal)?;
        let mut table = StageTable::new(scheme, &system.drag, h, start.t);
        let friction = friction_of(system, &mut table)?;
        SparseSystem::check_number("gamma", system.rate(start.t))?;
        let n = system.unknowns();
        let q = AlignedVector::padded(start.q);
        let inverse_masses = match &system.masses {
            Masses::Same(m) => InverseMasses::Same(1.0 / m),
            Masses::Each(masses) => InverseMasses::Each(masses.iter().map(|m| 1.0 / m).collect()),
        };
        // Splittings have the conformal factor of the flow.
        let log_sigma = system.rate(start.t) * h;
        let info = StepInfo { h, log_sigma, order: scheme.order() };
        let monitor = EnergyMonitor::new(system, start, info, |kind| {
            system.energies((start.t, &q, start.v, start.z.unwrap_or(0.0)), kind)
        });
        let splitting = SparseSplitting {
            system,
            table,
            friction,
            h,
            t0: start.t,
            taken: 0,
            next: AlignedVector::padded(start.q),
            q,
            v: AlignedVector::from_slice(start.v),
            end_v: AlignedVector::zeros(n, 0),
            compensation: CompensationTerms::default(),
            end_compensation: CompensationTerms::default(),
            inverse_masses,
            z: start.z.unwrap_or(0.0),
            has_action: start.z.is_some(),
            energies: vec![[0.0; 2]; if start.z.is_some() { block_count(n) } else { 0 }],
            monitor,
        };
        let mut force = vec![0.0; BLOCK_SIZE.min(n)];
        for block in 0..block_count(n) {
            let from = block * BLOCK_SIZE;
            let len = BLOCK_SIZE.min(n - from);
            force.fill(0.0);
            for list in &system.potentials {
                list.kick(block, start.t, &splitting.q, KickFactor::Uniform(1.0), &mut force[..len], None);
            }
            if let Some(i) = force[..len].iter().position(|f| !f.is_finite()) {
                return Err(SparseError::Undefined { unknown: from + i });
            }
        }
        Ok(splitting)
    }

    /// With compensated (Kahan) summation: the rounding errors of positions and velocities are carried from stage to
    /// stage. This is useful for few unknowns over very many steps, such as planets over thousands of revolutions.
    /// There the kick is rounded, which is smaller than the velocity by about the number of stages in a revolution. It
    /// needs four more vectors, and a quarter more time for five bodies.
    pub fn compensated(mut self) -> Self {
        let terms = || CompensationTerms { q: vec![0.0; self.v.len()], v: vec![0.0; self.v.len()] };
        (self.compensation, self.end_compensation) = (terms(), terms());
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
            let to_check = STEPS_BETWEEN_FINITE_CHECKS.min(steps - taken);
            for _ in 0..to_check {
                self.step();
                if self.monitor.is_due(self.taken) {
                    self.check_energy();
                }
            }
            // The sum is not finite if one of its terms is not.
            if !(self.v.iter().sum::<f64>() + self.z).is_finite() {
                return Err(StepFailure { taken, cause: StepError::NonFinite });
            }
            taken += to_check;
        }
        Ok(())
    }

    fn step(&mut self) {
        let t = self.t0 + self.taken as f64 * self.h;
        for i in 0..self.table.first.len() {
            let table = if self.taken == 0 { &self.table.first } else { &self.table.merged };
            let stage = table[i].at(&self.system.drag, t);
            let (system, inverse_masses) = (self.system, &self.inverse_masses);
            let merged = i == 0 && self.taken > 0;
            let friction = self.friction.get(if merged { self.table.first.len() } else { i });
            let kick_drift = KickDrift { system, inverse_masses, q: &self.q, t: t + stage.time, stage, friction };
            let next = self.next.get_mut(1..=self.v.len()).unwrap_or_default();
            let CompensationTerms { q: q_rest, v: v_rest } = &mut self.compensation;
            kick_drift.run(KickDriftOutput { v: &mut self.v, next, energies: &mut self.energies, q_rest, v_rest });
            if self.has_action {
                self.z = stage.action_after(self.z, &self.energies);
            }
            std::mem::swap(&mut self.q, &mut self.next);
        }
        self.taken += 1;
    }

    /// Checks the energy.
    #[cold]
    fn check_energy(&mut self) {
        let (t, z) = self.complete();
        let log_factor = self.system.rate(t) * (t - self.t0);
        let progress = RunProgress { t, log_factor, taken: self.taken };
        let SparseSplitting { system, next, end_v, monitor, .. } = self;
        monitor.check(system, progress, |t, kind| system.energies((t, next, end_v, z), kind));
    }

    /// The first step at which the energy showed that the steps do not resolve the motion, if there is one: results
    /// from this step on may be wrong.
    ///
    /// The energy `E_L`, which is multiplied by the conformal factor if L does not depend on time, is checked after 4,
    /// 16, 64 and 256 steps, every 1024 steps, and by this call. Without the action, or with a time-dependent gamma,
    /// the check is that `T + V` does not grow while the drag dissipates. The check detects nothing if the potential
    /// depends on time, nor from `T + V` if `gamma h > 0`.
    pub fn unresolved(&mut self) -> Option<UnresolvedStep> {
        if self.monitor.can_check(self.taken) {
            self.check_energy();
        }
        self.monitor.unresolved()
    }

    /// The state after the steps taken.
    pub fn state(&mut self) -> State<'_> {
        let (t, z) = self.complete();
        let n = self.system.unknowns();
        State { t, q: &self.next[1..=n], v: &self.end_v, z: self.has_action.then_some(z) }
    }

    /// Completes the last step in `next` and `end_v`, and returns the time and the action.
    fn complete(&mut self) -> (f64, f64) {
        let n = self.system.unknowns();
        let t = self.t0 + self.taken as f64 * self.h;
        self.end_v.copy_from_slice(&self.v);
        let mut z = self.z;
        if self.taken == 0 {
            self.next.copy_from_slice(&self.q);
        } else {
            let stage = self.table.closing.at(&self.system.drag, t - self.h);
            let time = t - self.h + stage.time;
            let (system, inverse_masses) = (self.system, &self.inverse_masses);
            let friction = self.friction.last();
            let kick_drift = KickDrift { system, inverse_masses, q: &self.q, t: time, stage, friction };
            self.end_compensation.q.copy_from_slice(&self.compensation.q);
            self.end_compensation.v.copy_from_slice(&self.compensation.v);
            let next = self.next.get_mut(1..=n).unwrap_or_default();
            let CompensationTerms { q: q_rest, v: v_rest } = &mut self.end_compensation;
            kick_drift.run(KickDriftOutput { v: &mut self.end_v, next, energies: &mut self.energies, q_rest, v_rest });
            if self.has_action {
                z = stage.action_after(z, &self.energies);
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

/// The drifts with friction of a table of stages, whose own drifts are then those of the action.
fn friction_of(system: &SparseSystem, table: &mut StageTable) -> Result<Vec<FrictionDrift>, SparseError> {
    let Some(coefficients) = &system.friction else { return Ok(Vec::new()) };
    system.check_vector("the friction", coefficients)?;
    let Drag::Constant(gamma) = system.drag else {
        return Err(SparseError::Friction { method: "a splitting with a drag that depends on time" });
    };
    let relative: Vec<f64> = coefficients.iter().enumerate().map(|(i, c)| c / system.mass(i)).collect();
    let spans = table.first.iter().chain(table.merged.first()).chain([&table.closing]).map(|stage| stage.span);
    let drifts = spans.map(|s| FrictionDrift::new(gamma, &relative, s)).collect();
    let of_action = |stage: &mut Stage| stage.drift = FrictionDrift::of_action(gamma, stage.span);
    table.first.iter_mut().chain(&mut table.merged).chain([&mut table.closing]).for_each(of_action);
    Ok(drifts)
}
