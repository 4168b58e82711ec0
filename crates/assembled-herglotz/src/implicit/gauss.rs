//! Contact Gauss collocation for assembled systems.

use super::border::{Border, Scalars};
use super::corrections::{Corrections, Verdict};
use super::lu::LuFactors;
use super::max_abs_or_nan;
use super::stages::{Assembly, MOST, Table};
use crate::AssemblyError;
use crate::local::{First, Place};
use crate::memory::limit;
use crate::monitor::{Energies, EnergyMonitor, Reached, StepFacts};
use crate::system::{AssembledSystem, State};
use discrete_herglotz::{InputError, StepError, StepFailure, UnresolvedStep, solve::ITERATION_LIMIT};

/// Contact Gauss collocation with one or two stages, of order 2 or 4, for systems of any size and any local terms. The
/// stage equations are those of [`Gauss`](discrete_herglotz::gauss::Gauss):
///
/// `Q = q0 + hA V`, `Z = z0 + hA L`, `rho = 1 - hA (rho L_z)`, `rho L_v = p0 + hA (rho L_q)`.
///
/// The step is completed with the weights `hb`: `q1 = q0 + hb.V`, `z1 = z0 + hb.L`, `p1 = (p0 + hb.(rho L_q))/rho1`,
/// `sigma_d = 1/rho1`. With one stage this is the midpoint rule.
///
/// The stage velocities are found by Newton's method with faer's sparse LU, which is analysed once and factorised anew
/// only if the corrections decrease slowly. All unknowns are coupled through Z and rho. These are a border of at most
/// four columns and rows, which is eliminated by its Schur complement, so that the matrix stays sparse. Without general
/// terms rho does not depend on the unknowns, and there is no border.
///
/// ```
/// use assembled_herglotz::systems::{FputBond, fput_chain};
/// use assembled_herglotz::{AssembledGauss, State};
/// let chain = fput_chain(100, FputBond { alpha: 0.0, beta: 1.0 }, -0.01)?;
/// let q: Vec<f64> = (1..=100).map(|i| (0.03 * i as f64).sin()).collect();
/// let start = State { t: 0.0, q: &q, v: &[0.0; 100], z: Some(0.0) };
/// let mut motion = AssembledGauss::new(&chain, 2, 0.1, start, None)?;
/// assert!(motion.advance(100).is_ok());
/// println!("{:?}", motion.q()[50]);
/// # Ok::<(), assembled_herglotz::AssemblyError>(())
/// ```
pub struct AssembledGauss<'a> {
    system: &'a AssembledSystem,
    table: Table,
    assembly: Assembly,
    factors: LuFactors,
    /// Present only with general terms, as are the factors `mass` of `L_vv`.
    border: Option<Border>,
    mass: Option<LuFactors>,
    h: f64,
    t0: f64,
    taken: usize,
    factorisations: u64,
    iterations: u64,
    action: bool,
    /// The positions, padded.
    q: Vec<f64>,
    p: Vec<f64>,
    z: f64,
    sigma: f64,
    /// The stage velocities of the last step (`v`), grouped by unknown; those of the next step (`next`); and work space
    /// for a correction (`change`).
    v: Vec<f64>,
    next: Vec<f64>,
    change: Vec<f64>,
    residual: Vec<f64>,
    /// `Z_i - z0` and rho of the stages.
    actions: [f64; MOST],
    rho: [f64; MOST],
    stages: Vec<First>,
    /// The position and velocity of a stage, padded.
    place_q: Vec<f64>,
    place_v: Vec<f64>,
    /// The velocity of a requested state.
    end: Vec<f64>,
    log_factor: f64,
    monitor: EnergyMonitor,
}

impl<'a> AssembledGauss<'a> {
    /// Starts from a state, with 1 or 2 stages. The action z is computed if the start has one, which costs one
    /// evaluation of the energies per stage unless there are general terms. The matrix, its factors and the workspace
    /// are refused if they may need more than `memory` bytes; `None` stands for the memory that the system has
    /// available (`MemAvailable` on Linux; elsewhere there is no limit).
    ///
    /// # Errors
    /// [`InputError::Stages`] and [`InputError::Step`]; [`AssemblyError::Length`] and [`AssemblyError::NonFinite`] of
    /// the state and the masses; [`AssemblyError::Mass`] if an unknown has no mass, neither its own nor from a general
    /// term; [`AssemblyError::SingularMass`]; [`AssemblyError::NoAction`] for general terms and a state without the
    /// action; [`AssemblyError::Undefined`] if a derivative of L is not finite at the start; [`AssemblyError::Memory`]
    /// with the estimate.
    pub fn new(
        system: &'a AssembledSystem,
        stages: usize,
        h: f64,
        start: State,
        memory: Option<usize>,
    ) -> Result<Self, AssemblyError> {
        if !(1..=MOST).contains(&stages) {
            return Err(InputError::Stages { found: stages }.into());
        }
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h }.into());
        }
        start.check(system)?;
        let general = !system.locals.is_empty();
        if general && start.z.is_none() {
            return Err(AssemblyError::NoAction);
        }
        let z = start.z.unwrap_or(0.0);
        system.check_masses(general)?;
        AssembledSystem::check_number("gamma", system.rate(start.t))?;
        let (n, limit) = (system.unknowns(), limit(memory));
        let len = n.checked_mul(stages).ok_or(AssemblyError::Unknowns { found: n, most: usize::MAX / stages })?;
        let assembly = Assembly::new(system)?;
        let (begins, rows) = assembly.pattern.blocks(stages)?;
        let factors = LuFactors::new(begins, rows, limit)?;
        let between = |x: &[f64]| [&[0.0], x, &[0.0]].concat();
        let (q, place_v) = (between(start.q), between(start.v));
        let mut first = First::zeros(n);
        system.first(Place { t: start.t, q: &q, v: &place_v, z }, true, &mut first);
        let defined = |unknown: usize| first.q[unknown].is_finite() && first.v[unknown].is_finite();
        if let Some(unknown) = (0..n).find(|i| !defined(*i)) {
            return Err(AssemblyError::Undefined { unknown });
        }
        let v: Vec<f64> = start.v.iter().flat_map(|v| std::iter::repeat_n(*v, stages)).collect();
        let zeros = vec![0.0; len];
        let table = Table::new(stages, h);
        let rho = table.factors([first.z; MOST]);
        let end = table.b.iter().zip(rho).take(stages).fold(1.0, |end, (b, rho)| end - b * rho * first.z);
        let info = StepFacts { h, log_sigma: -end.ln(), order: 2 * stages as u32 };
        let monitor = EnergyMonitor::new(system, start, info, |bounded| {
            if general {
                energies(&first, (start.v, &first.v), z)
            } else {
                system.energies((start.t, &q, start.v, z), bounded)
            }
        });
        let mut gauss = AssembledGauss {
            system,
            table,
            assembly,
            factors,
            border: general.then(|| Border::new(len)),
            mass: None,
            h,
            t0: start.t,
            taken: 0,
            factorisations: 0,
            iterations: 0,
            action: start.z.is_some(),
            place_q: q.clone(),
            q,
            p: first.v.clone(),
            z,
            sigma: 1.0,
            next: v.clone(),
            v,
            change: zeros.clone(),
            residual: zeros,
            actions: [0.0; MOST],
            rho: [1.0; MOST],
            stages: vec![first; stages],
            place_v,
            end: start.v.to_vec(),
            log_factor: 0.0,
            monitor,
        };
        if general {
            gauss.check_regular(limit)?;
        }
        Ok(gauss)
    }

    /// Takes the given number of steps.
    ///
    /// # Errors
    /// [`StepFailure`] with the number of steps taken before the failure and the cause: [`StepError::NotConverged`],
    /// [`StepError::Singular`], [`StepError::NonFinite`], [`StepError::StageFactor`] or [`StepError::SigmaVanished`].
    /// The state is that before the step that failed.
    pub fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            self.step().map_err(|cause| StepFailure { taken, cause })?;
            if self.monitor.is_due(self.taken) {
                self.look();
            }
        }
        Ok(())
    }

    /// Checks the energy. With general terms this requires the velocity; if it cannot be computed, the check is
    /// omitted.
    #[cold]
    fn look(&mut self) {
        let Ok(State { t, .. }) = self.state() else { return };
        let (n, z) = (self.system.unknowns(), self.z);
        let reached = Reached { t, log_factor: self.log_factor, taken: self.taken };
        let AssembledGauss { system, q, p, end, place_v, stages, border, monitor, .. } = self;
        place_v[1..=n].copy_from_slice(end);
        monitor.look(system, reached, |t, bounded| match stages.first_mut() {
            Some(first) if border.is_some() => {
                system.first(Place { t, q, v: place_v, z }, true, first);
                energies(first, (end, p), z)
            }
            _ => system.energies((t, q, end, z), bounded),
        });
    }

    /// The first step at which the energy showed that the steps do not resolve the motion, if there is one: results
    /// from this step on may be wrong.
    ///
    /// The energy `E_L`, which is multiplied by the conformal factor if L does not depend on time, is checked after 4,
    /// 16, 64 and 256 steps, every 1024 steps, and by this call. Without the action, or with a time-dependent gamma and
    /// no general terms, the check is that `T + V` does not grow while the drag dissipates. The check detects nothing
    /// if the potential depends on time, or with general terms any part of L, nor from `T + V` if `gamma h > 0`.
    /// Without general terms and for a constant gamma the conformal factor of a step is also compared with
    /// `e^(gamma h)`.
    pub fn unresolved(&mut self) -> Option<UnresolvedStep> {
        if self.monitor.tells(self.taken) {
            self.look();
        }
        self.monitor.unresolved()
    }

    /// The time.
    pub fn time(&self) -> f64 {
        self.t0 + self.taken as f64 * self.h
    }

    /// The positions.
    pub fn q(&self) -> &[f64] {
        &self.q[1..=self.system.unknowns()]
    }

    /// The momenta `p = L_v`.
    pub fn p(&self) -> &[f64] {
        &self.p
    }

    /// The action, if the start has one.
    pub fn z(&self) -> Option<f64> {
        self.action.then_some(self.z)
    }

    /// `sigma_d` of the last step; 1 before the first step.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// The number of numeric factorisations so far, including those for the velocity of a state.
    pub fn factorisations(&self) -> u64 {
        self.factorisations
    }

    /// The number of Newton iterations so far; each has one linear solve and one evaluation of the derivatives of L per
    /// stage.
    pub fn iterations(&self) -> u64 {
        self.iterations
    }

    /// The state. With general terms the velocity is computed from `p = L_v` by Newton's method.
    ///
    /// # Errors
    /// [`StepError`] if no velocity is found. The motion can be continued, since the steps do not use this velocity.
    pub fn state(&mut self) -> Result<State<'_>, StepError> {
        let n = self.system.unknowns();
        match self.mass.take() {
            None => {
                for (i, (v, p)) in self.end.iter_mut().zip(&self.p).enumerate() {
                    *v = p / self.system.mass(i);
                }
            }
            Some(mut mass) => {
                let found = self.velocity(&mut mass);
                self.mass = Some(mass);
                found?;
            }
        }
        Ok(State { t: self.time(), q: &self.q[1..=n], v: &self.end, z: self.z() })
    }

    /// Solves `L_v = p` for the velocity, starting from that of the last requested state; the result is in `end`.
    fn velocity(&mut self, mass: &mut LuFactors) -> Result<(), StepError> {
        let (n, t) = (self.system.unknowns(), self.time());
        let mut corrections = Corrections::new();
        let mut size = f64::INFINITY;
        mass.discard();
        for _ in 0..ITERATION_LIMIT {
            self.place_v[1..=n].copy_from_slice(&self.end);
            let at = Place { t, q: &self.q, v: &self.place_v, z: self.z };
            let Some(first) = self.stages.first_mut() else { break };
            self.system.first(at, true, first);
            if !mass.ready() {
                self.assembly.mass_matrix(self.system, at, &mut mass.entries);
                mass.factorise()?;
                self.factorisations += 1;
                corrections.forget();
            }
            let change = &mut self.change[..n];
            for (change, (l_v, p)) in change.iter_mut().zip(first.v.iter().zip(&self.p)) {
                *change = l_v - p;
            }
            size = max_abs_or_nan(change);
            mass.solve(change)?;
            self.end.iter_mut().zip(&*change).for_each(|(v, change)| *v -= change);
            let (now, speed) = (max_abs_or_nan(change), max_abs_or_nan(&self.end));
            match corrections.judge(now, f64::EPSILON * speed) {
                Verdict::Done => return Ok(()),
                Verdict::Further => {}
                Verdict::Factorise => mass.discard(),
            }
        }
        Err(StepError::NotConverged { residual: size, iterations: ITERATION_LIMIT })
    }

    /// Checks that `L_vv` is regular at the start, and keeps its pattern and factors for the velocities of states.
    fn check_regular(&mut self, limit: usize) -> Result<(), AssemblyError> {
        let (begins, rows) = self.assembly.pattern.blocks(1)?;
        let mut mass = LuFactors::new(begins, rows, limit)?;
        let at = Place { t: self.t0, q: &self.q, v: &self.place_v, z: self.z };
        self.assembly.mass_matrix(self.system, at, &mut mass.entries);
        if let Some((unknown, _)) =
            self.assembly.pattern.columns().find(|(_, range)| mass.entries[range.clone()].iter().all(|m| *m == 0.0))
        {
            return Err(AssemblyError::Mass { unknown, mass: 0.0 });
        }
        let n = self.system.unknowns();
        // A right-hand side that is not orthogonal to the typical kernels of a singular `L_vv`.
        let b: Vec<f64> = (0..n).map(|i| 1.0 + 0.5 * (1.7 * i as f64).sin()).collect();
        let mut x = b.clone();
        let regular = mass.factorise().and_then(|()| mass.solve(&mut x)).and_then(|()| mass.check(&x, &b));
        regular.map_err(|_| AssemblyError::SingularMass)?;
        self.mass = Some(mass);
        Ok(())
    }

    fn step(&mut self) -> Result<(), StepError> {
        let Table { s, ahead, .. } = self.table;
        // The initial guess is extrapolated from the stages of the last step, or with one stage from those of the last
        // two steps.
        for (next, v) in self.next.chunks_exact_mut(s).zip(self.v.chunks_exact(s)) {
            match (self.taken, s) {
                (0, _) => next.copy_from_slice(v),
                (_, 1) => next[0] = 2.0 * v[0] - next[0],
                _ => {
                    for (next, ahead) in next.iter_mut().zip(&ahead) {
                        *next = ahead.iter().zip(v).map(|(a, v)| a * v).sum();
                    }
                }
            }
        }
        let (actions, rho) = (self.actions, self.rho);
        let done = self.solve().and_then(|()| self.finish());
        if done.is_err() {
            // Restores the data from before the step, so that it can be retried.
            self.next.copy_from_slice(&self.v);
            (self.actions, self.rho) = (actions, rho);
            self.factors.discard();
        }
        done
    }

    /// Completes the step with the weighted sums over its stages.
    fn finish(&mut self) -> Result<(), StepError> {
        let Table { s, b, .. } = self.table;
        self.evaluate(self.action);
        let least = self.rho[..s].iter().copied().fold(f64::INFINITY, f64::min);
        if least.is_nan() || least <= 0.0 {
            return Err(StepError::StageFactor { rho: least });
        }
        if self.action && self.border.is_none() {
            // L is affine in z: its stages were evaluated at the action of the start, and are corrected here by the
            // actions of the stages.
            let of = |f: fn(&First) -> f64| std::array::from_fn(|j| self.stages.get(j).map_or(0.0, f));
            let actions = self.table.actions(of(|l| l.z), of(|l| l.l));
            self.stages.iter_mut().zip(actions).for_each(|(stage, action)| stage.l += stage.z * action);
        }
        let stages = || self.stages.iter().zip(b).zip(self.rho);
        let rho = stages().fold(1.0, |sum, ((l, b), rho)| sum - b * rho * l.z);
        if rho.is_nan() || rho <= 0.0 {
            return Err(StepError::SigmaVanished { sigma: 1.0 / rho });
        }
        let action = stages().map(|((l, b), _)| b * l.l).sum::<f64>();
        for (i, p) in self.p.iter_mut().enumerate() {
            let force: f64 = self.stages.iter().zip(b).zip(self.rho).map(|((l, b), rho)| b * rho * l.q[i]).sum();
            *p = (*p + force) / rho;
        }
        for (q, v) in self.q.iter_mut().skip(1).zip(self.next.chunks_exact(s)) {
            *q += v.iter().zip(b).map(|(v, b)| b * v).sum::<f64>();
        }
        if self.action {
            self.z += action;
        }
        self.sigma = 1.0 / rho;
        self.log_factor -= rho.ln();
        std::mem::swap(&mut self.v, &mut self.next);
        self.taken += 1;
        Ok(())
    }

    /// Computes the position and the velocity of a stage, and returns its time.
    fn place(&mut self, j: usize) -> f64 {
        let Table { s, a, c, .. } = self.table;
        let row = a[j];
        let places = self.place_q.iter_mut().zip(&mut self.place_v).zip(&self.q).skip(1);
        for (((q, v), q0), stages) in places.zip(self.next.chunks_exact(s)) {
            *q = q0 + stages.iter().zip(row).map(|(v, a)| a * v).sum::<f64>();
            *v = stages[j];
        }
        self.time() + c[j]
    }

    /// Evaluates L and its first derivatives at the stages; without general terms the value of L only if it is
    /// requested.
    fn evaluate(&mut self, value: bool) {
        for j in 0..self.table.s {
            let t = self.place(j);
            let at = Place { t, q: &self.place_q, v: &self.place_v, z: self.z + self.actions[j] };
            self.system.first(at, value, &mut self.stages[j]);
        }
        if self.border.is_none() {
            // Without general terms z enters L only as gamma z, so that rho follows from the rates.
            let mut rates = [0.0; MOST];
            rates.iter_mut().zip(&self.stages).for_each(|(rate, l)| *rate = l.z);
            self.rho = self.table.factors(rates);
        }
    }

    /// Solves for the stage velocities; `next` holds the initial guess, and then the solution.
    fn solve(&mut self) -> Result<(), StepError> {
        let Table { s, a, .. } = self.table;
        // A correction below this times the machine epsilon does not change the position.
        let resolution = max_abs_or_nan(&self.q) / self.h.abs();
        let mut corrections = Corrections::new();
        let mut size = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            self.evaluate(false);
            for (i, residual) in self.residual.chunks_exact_mut(s).enumerate() {
                for (k, residual) in residual.iter_mut().enumerate() {
                    let force: f64 = (0..s).map(|j| a[k][j] * self.rho[j] * self.stages[j].q[i]).sum();
                    *residual = self.rho[k] * self.stages[k].v[i] - self.p[i] - force;
                }
            }
            size = max_abs_or_nan(&self.residual);
            if !size.is_finite() {
                return Err(StepError::NonFinite);
            }
            let fresh = !self.factors.ready();
            if fresh {
                self.factorise()?;
                corrections.forget();
            }
            self.change.copy_from_slice(&self.residual);
            self.factors.solve(&mut self.change)?;
            if fresh {
                self.factors.check(&self.change, &self.residual)?;
            }
            let moved = self.border_change()?;
            self.next.iter_mut().zip(&self.change).for_each(|(v, change)| *v -= change);
            self.iterations += 1;
            let (now, speed) = (max_abs_or_nan(&self.change), max_abs_or_nan(&self.next));
            let scale = speed + resolution;
            let now = if scale > 0.0 { (now / scale).max(moved) } else { moved };
            if !now.is_finite() {
                return Err(StepError::NonFinite);
            }
            match corrections.judge(now, f64::EPSILON) {
                Verdict::Done => return Ok(()),
                Verdict::Further => {}
                Verdict::Factorise => self.factors.discard(),
            }
        }
        self.factors.discard();
        Err(StepError::NotConverged { residual: size, iterations: ITERATION_LIMIT })
    }

    /// Corrects Z and rho, and adapts the correction of the velocities to these changes. Returns the largest change of
    /// Z and rho relative to their sizes.
    fn border_change(&mut self) -> Result<f64, StepError> {
        let Some(border) = &self.border else { return Ok(0.0) };
        let Table { s, a, .. } = self.table;
        let mut r = Scalars::zeros();
        let mut size = self.z.abs();
        for i in 0..s {
            let sum = |of: &dyn Fn(usize) -> f64| (0..s).map(|j| a[i][j] * of(j)).sum::<f64>();
            r[i] = self.actions[i] - sum(&|j| self.stages[j].l);
            r[MOST + i] = self.rho[i] - 1.0 + sum(&|j| self.rho[j] * self.stages[j].z);
            size += (self.h * self.stages[i].l).abs();
        }
        let w = border.solve(&mut self.change, &r);
        let mut moved = 0.0f64;
        for i in 0..s {
            self.actions[i] -= w[i];
            self.rho[i] -= w[MOST + i];
            let relative = if w[i] == 0.0 { 0.0 } else { w[i].abs() / size };
            // `f64::max` would ignore a NaN.
            for relative in [relative, (w[MOST + i] / self.rho[i]).abs()] {
                if relative.is_nan() {
                    return Err(StepError::NonFinite);
                }
                moved = moved.max(relative);
            }
        }
        Ok(moved)
    }

    /// Factorises the Jacobian at the present stages.
    fn factorise(&mut self) -> Result<(), StepError> {
        self.factors.entries.fill(0.0);
        if let Some(border) = &mut self.border {
            border.clear();
        }
        for j in 0..self.table.s {
            let t = self.place(j);
            let at = Place { t, q: &self.place_q, v: &self.place_v, z: self.z + self.actions[j] };
            let AssembledGauss { system, table, assembly, factors, border, rho, stages, .. } = self;
            assembly.add_stage(system, table, at, j, rho[j], &stages[j], &mut factors.entries, border.as_mut());
        }
        self.factors.factorise()?;
        self.factorisations += 1;
        match &mut self.border {
            Some(border) => border.reduce(self.table.s, &mut self.factors),
            None => Ok(()),
        }
    }
}

/// The energies of a Lagrangian, from its first derivatives, the velocity and the momentum. The kinetic energy is
/// `|p.v|/2`, as for a quadratic form in the velocity.
fn energies(first: &First, (v, p): (&[f64], &[f64]), z: f64) -> Energies {
    let twice_kinetic: f64 = p.iter().zip(v).map(|(p, v)| p * v).sum();
    let terms = first.l.abs() + (first.z * z).abs();
    Energies { total: twice_kinetic - first.l, kinetic: 0.5 * twice_kinetic.abs(), terms }
}
