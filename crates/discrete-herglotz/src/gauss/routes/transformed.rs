//! Stepper of contact Gauss collocation with equal steps in transformed time.

use crate::gauss::checks::check_step;
use crate::gauss::curve::Curve;
use crate::gauss::initial_mass::InitialMass;
use crate::gauss::resolution::defect_sample::DefectSample;
use crate::gauss::routes::general::{Extension, General, GeneralKernel, InTransformedTime, Values};
use crate::gauss::routes::{RouteState, StageRoute};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::system::{CollocationSystem, PointRef, Typed};
use crate::gauss::tables::stage_table::StageTable;
use crate::gauss::work_summary::work_summary_in_transformed_time;
use crate::integration::{StageVectors, check_unforced};
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::forget_branches;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::{Saved, load_option, save_option};
use crate::solve::ITERATION_LIMIT;
use crate::{
    InputError, PlanEntry, Problem, RunSupport, State, StepDetails, StepError, StepFailure, Stepper, UnresolvedStep,
    Vector,
};
use contact_geom::numbers::dot;
use contact_geom::{Lagrangian, Structure};

/// A stepper of contact Gauss collocation with variable steps: the steps are equal in the time tau of the
/// time transformation of the Lagrangian, `dt = g(q) dtau` ([`Lagrangian::dt_dtau`]).
///
/// It is Gauss collocation for the contact Hamiltonian `K = g(q) (H + p_t)` on T\*(Q x R) x R with `p_t = -H`, and
/// therefore `K = 0`, at the start. With the velocities V with respect to t, `g = g(Q)` and the energy `E = V.L_v - L`,
/// the stage equations are
///
/// `Q = q0 + hA (g V)`, `Z = z0 + hA (g L)`, `t = t0 + hA g`, `rho = 1 - hA (rho g L_z)`, `rho p_t = p_t0`,
/// `rho L_v = p0 + hA (rho (g L_q - (E + p_t) grad g))`,
///
/// and the end of the step is given by the same sums with `hb`, `sigma_d = 1 / rho1`. The step multiplies the contact
/// form `dz - p dq - p_t dt` by `sigma_d`, and so it does every momentum of a symmetry of L that leaves g invariant.
/// The method is symmetric and of order 2s in tau.
///
/// The stage equations are solved by fixed-point iteration; a step that is too large for it fails with
/// [`StepError::NotConverged`].
///
/// A run by [`TransformedGauss`](crate::TransformedGauss) uses it.
pub struct TransformedStepper<'a> {
    system: Box<dyn CollocationSystem + 'a>,
    kernel: Box<dyn GeneralKernel + 'a>,
    structure: Structure,
    run: Run,
}

/// The run without the Lagrangian.
struct Run {
    general: Box<General>,
    h: f64,
    tau: f64,
    taken: usize,
    /// The start of the last step, if it is known (after `advance_until`).
    from: Values,
    knows_from: bool,
    unresolved: Option<UnresolvedStep>,
}

/// A system with the kernel of its steps in transformed time.
#[derive(Clone, Copy)]
struct Evaluated<'r> {
    system: &'r dyn CollocationSystem,
    kernel: &'r dyn GeneralKernel,
}

impl<'a> TransformedStepper<'a> {
    /// A stepper at the start of a problem with `stages` from 1 to 16 and steps of length `h` in tau.
    ///
    /// # Errors
    /// [`InputError::Stages`], [`InputError::Step`]; [`InputError::Unclaimed`] if the Lagrangian does not claim that it
    /// is autonomous; [`InputError::TimeTransformation`] if the rate dt/dtau at the start is not positive and finite;
    /// [`InputError::FirstStep`] if the mass matrix or the energy at the start is not regular or not finite.
    pub fn new<L: Lagrangian<N>, const N: usize>(
        problem: &Problem<'a, L, N>,
        stages: usize,
        h: f64,
    ) -> Result<Self, InputError> {
        check_step(stages, h)?;
        check_unforced(problem.lagrangian, "collocation in transformed time")?;
        let Problem { lagrangian, t0, start, state, structure, .. } = *problem;
        let at = PointRef { q: start.q.as_slice(), v: start.v.as_slice(), z: start.z };
        let InitialMass { inverse, .. } = InitialMass::of(&Typed(lagrangian), t0, at)?;
        if !structure.autonomous {
            return Err(InputError::Unclaimed { claim: "autonomous" });
        }
        let rate = lagrangian.dt_dtau(&state.q);
        if !(rate > 0.0 && rate.is_finite()) {
            return Err(InputError::TimeTransformation { rate });
        }
        let energy = dot(start.v, state.p) - lagrangian.value(t0, &start.q, &start.v, start.z);
        if !energy.is_finite() {
            return Err(InputError::FirstStep(StepError::NonFinite));
        }
        let mass = Mass::new(&structure, inverse, false);
        let from = PointRef { q: state.q.as_slice(), v: state.p.as_slice(), z: state.z };
        let extension = (Extension::new(t0, -energy), true);
        let general =
            Box::new(General::new(extension, StageTable::new(stages, h), mass, false, from, start.v.as_slice()));
        let from = general.values();
        let run = Run { general, h, tau: 0.0, taken: 0, from, knows_from: false, unresolved: None };
        let (system, kernel) = (Box::new(Typed(lagrangian)), Box::new(InTransformedTime(lagrangian)));
        Ok(TransformedStepper { system, kernel, structure, run })
    }

    /// The momentum `p_t` conjugate to t. Up to the error of the method it is minus the energy, `E + p_t = K / g`. Each
    /// step multiplies it by `sigma_d`, as any momentum.
    pub fn time_momentum(&self) -> f64 {
        self.run.general.extension.p_t.value
    }

    /// The transformed time tau since the start.
    pub(crate) fn tau(&self) -> f64 {
        self.run.tau
    }

    /// Takes steps up to a physical time; the last step is shortened to end there to round-off. Takes no step if the
    /// time is already past.
    ///
    /// # Errors
    /// Those of [`advance`](Stepper::advance); [`StepError::NonFinite`] for a time that is not finite.
    pub fn advance_to(&mut self, t_end: f64) -> Result<(), StepFailure> {
        self.advance_until(usize::MAX, t_end).map(|_| ())
    }

    /// The largest defect of the last step over a number of sets of sample points between its nodes. `None` if the
    /// start of the last step is not known.
    pub(crate) fn sample_defect(&self, sets: usize) -> Option<DefectSample> {
        let curve = self.run.curve(&*self.system)?;
        self.system.defect_of(Instructions::new(), &curve, true, sets)
    }
}

impl Run {
    /// The physical time.
    fn time(&self) -> f64 {
        self.general.extension.t.value
    }

    /// The last step as a curve, if its start is known.
    fn curve(&self, system: &dyn CollocationSystem) -> Option<Curve> {
        if !self.knows_from {
            return None;
        }
        let (general, from) = (&*self.general, &self.from);
        let values = |x: &[CompensatedSum]| x.iter().map(|x| x.value).collect::<Vector>();
        let (q, end) = (values(&from.q), values(general.state().q));
        let zeros = || StageVectors::from_elem(Stages::ZERO, q.len());
        let mut curve = Curve {
            s: general.table.s,
            t: from.t.value,
            h: general.table.h,
            p: values(&from.p),
            z: from.z.value,
            v: zeros(),
            force: zeros(),
            rate: Stages::ZERO,
            l: Stages::ZERO,
            acts: true,
            rates: [system.dt_dtau(&q), system.dt_dtau(&end)],
            q,
        };
        general.copy_stages([&mut curve.v, &mut curve.force], [&mut curve.rate, &mut curve.l]);
        Some(curve)
    }

    /// Repeats the last step, which started at `from` and has passed a given time, with the length for which it ends at
    /// that time.
    fn shorten(&mut self, with: Evaluated<'_>, t_end: f64) -> Result<(), StepError> {
        // Lengths are positive in both directions of time.
        let way = self.h.signum();
        let (mut short, mut long, mut length) = (0.0, self.h.abs(), self.h.abs());
        let mut over = (self.time() - t_end) * way;
        for _ in 0..ITERATION_LIMIT {
            // Newton's method, with bisection as a safeguard; dt/dh is the rate at the end up to the error of the
            // method.
            let newton = length - over / self.general.rate(with.system);
            length = if short < newton && newton < long { newton } else { 0.5 * (short + long) };
            self.general.reset(&self.from);
            self.general.table = StageTable::new(self.general.table.s, length * way);
            self.take_steps(with, 1).map_err(|halt| halt.cause)?;
            over = (self.time() - t_end) * way;
            if self.ends_at(t_end) {
                // The stages belong to a step of another length than the next one, which must not be extrapolated from
                // them.
                self.general.forget_stages();
                return Ok(());
            }
            *(if over > 0.0 { &mut long } else { &mut short }) = length;
        }
        Err(StepError::NotConverged { residual: over, iterations: ITERATION_LIMIT })
    }

    /// Whether the step that started at `from` ends at `t_end` to round-off; if so, the time is set to `t_end`.
    fn ends_at(&mut self, t_end: f64) -> bool {
        let before = self.from.t.value;
        let there = (self.time() - t_end).abs() <= 2.0 * f64::EPSILON * t_end.abs().max(before.abs());
        if there {
            self.general.extension.t = t_end.into();
        }
        there
    }

    /// Takes steps by fixed-point iteration; ends at the first step that fails.
    fn take_steps(&mut self, with: Evaluated<'_>, steps: usize) -> Result<(), StepFailure> {
        forget_branches();
        for taken in 0..steps {
            // L is autonomous.
            let progress = self.general.take_step(with.system, with.kernel, self.general.extension.t.value);
            if progress != IterationOutcome::Done {
                return Err(StepFailure { taken, cause: progress.into() });
            }
            if self.general.defect > 1.0 && self.unresolved.is_none() {
                self.unresolved = Some(UnresolvedStep { step: self.taken, defect: self.general.defect });
            }
            self.taken += 1;
        }
        Ok(())
    }

    /// The steps are equal in transformed time.
    fn advance(&mut self, with: Evaluated<'_>, steps: usize) -> Result<(), StepFailure> {
        self.lengthen();
        self.knows_from = false;
        let done = self.take_steps(with, steps);
        self.tau += done.map_or_else(|halt| halt.taken, |()| steps) as f64 * self.h;
        done
    }

    /// The last step is shortened to end at `t_end` to round-off.
    fn advance_until(&mut self, with: Evaluated<'_>, steps: usize, t_end: f64) -> Result<usize, StepFailure> {
        let halt = |taken, cause| StepFailure { taken, cause };
        if !t_end.is_finite() {
            return Err(halt(0, StepError::NonFinite));
        }
        let mut taken = 0;
        while taken < steps && (t_end - self.time()) * self.h > 0.0 {
            self.lengthen();
            self.general.copy_values_to(&mut self.from);
            self.knows_from = false;
            self.take_steps(with, 1).map_err(|refused| halt(taken, refused.cause))?;
            if !self.ends_at(t_end)
                && (self.time() - t_end) * self.h > 0.0
                && let Err(cause) = self.shorten(with, t_end)
            {
                self.general.reset(&self.from);
                return Err(halt(taken, cause));
            }
            self.knows_from = true;
            self.tau += self.general.table.h;
            taken += 1;
        }
        Ok(taken)
    }

    /// Restores the full step size after a shortened step.
    fn lengthen(&mut self) {
        if self.general.table.h != self.h {
            self.general.table = StageTable::new(self.general.table.s, self.h);
        }
    }

    fn words(&self) -> Vec<u64> {
        let mut words = Vec::new();
        self.general.save(&mut words);
        [self.general.table.h, self.tau].save(&mut words);
        self.taken.save(&mut words);
        save_option(self.unresolved.as_ref(), &mut words);
        words
    }

    /// Restores the state from words; the start of the last step is not among them.
    fn read(&mut self, from: &mut &[u64]) -> Option<()> {
        self.general.load(from)?;
        let mut h = 0.0;
        h.load(from)?;
        if h != self.general.table.h {
            self.general.table = StageTable::new(self.general.table.s, h);
        }
        self.tau.load(from)?;
        self.taken.load(from)?;
        self.knows_from = false;
        self.unresolved = load_option(from, || UnresolvedStep { step: 0, defect: 0.0 })?;
        Some(())
    }
}

impl Stepper for TransformedStepper<'_> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        let with = Evaluated { system: &*self.system, kernel: &*self.kernel };
        self.run.advance(with, steps)
    }

    fn state(&self) -> State {
        let RouteState { q, y, z } = self.run.general.state();
        let values = |of: &[CompensatedSum]| of.iter().map(|x| x.value).collect();
        State { q: values(q), p: values(y), z: z.value }
    }

    fn time(&self) -> f64 {
        self.run.time()
    }

    fn sigma(&self) -> f64 {
        self.run.general.sigma()
    }

    fn evaluations(&self) -> u64 {
        self.run.general.evaluations
    }

    fn last_step(&self) -> Option<&dyn StepDetails> {
        Some(self)
    }

    fn run_support(&self) -> Option<&dyn RunSupport> {
        Some(self)
    }

    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        Some(self)
    }
}

impl StepDetails for TransformedStepper<'_> {
    fn last_velocity(&self) -> Option<Vector> {
        self.run.general.last_velocity().map(Vector::from)
    }
}

impl RunSupport for TransformedStepper<'_> {
    fn advance_until(&mut self, steps: usize, t_end: f64) -> Result<usize, StepFailure> {
        let with = Evaluated { system: &*self.system, kernel: &*self.kernel };
        self.run.advance_until(with, steps, t_end)
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        work_summary_in_transformed_time(&self.structure)
    }

    fn save(&self) -> Option<Vec<u64>> {
        Some(self.run.words())
    }

    fn restore(&mut self, mut words: &[u64]) -> bool {
        self.run.read(&mut words).is_some() && words.is_empty()
    }

    fn unresolved(&self) -> Option<UnresolvedStep> {
        self.run.unresolved
    }
}
