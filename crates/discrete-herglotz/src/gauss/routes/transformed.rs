//! Stepper of contact Gauss collocation with equal steps in transformed time.

use crate::gauss::checks::check_step;
use crate::gauss::initial_mass::InitialMass;
use crate::gauss::resolution::defect_sample::{Compare, Curve, DefectSample};
use crate::gauss::routes::general::General;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::mass_matrix::Mass;
use crate::gauss::stages::parametrization::{Extension, Fictitious, Parametrization, Values};
use crate::gauss::tables::stage_table::StageTable;
use crate::gauss::work_summary::work_summary_in_transformed_time;
use crate::integration::check_unforced;
use crate::numbers::compensated::{CompensatedSum, values};
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::forget_branches;
use crate::numbers::state_words::{Saved, load_option, save_option};
use crate::{InputError, PlanEntry, Problem, StepError, StepFailure, Stepper, UnresolvedStep, solve::ITERATION_LIMIT};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint};
use pulp::{Simd, WithSimd};

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
pub struct TransformedStepper<'a, L, const N: usize> {
    general: Box<General<'a, L, Fictitious<'a, L>, N>>,
    arch: Instructions,
    h: f64,
    tau: f64,
    taken: usize,
    /// The start of the last step, if it is known (after `advance_until`).
    from: Option<Values<N>>,
    unresolved: Option<UnresolvedStep>,
}

impl<'a, L: Lagrangian<N>, const N: usize> TransformedStepper<'a, L, N> {
    /// A stepper at the start of a problem with `stages` from 1 to 16 and steps of length `h` in tau.
    ///
    /// # Errors
    /// [`InputError::Stages`], [`InputError::Step`]; [`InputError::Unclaimed`] if the Lagrangian does not claim that it
    /// is autonomous; [`InputError::TimeTransformation`] if the rate dt/dtau at the start is not positive and finite;
    /// [`InputError::FirstStep`] if the mass matrix or the energy at the start is not regular or not finite.
    pub fn new(problem: &Problem<'a, L, N>, stages: usize, h: f64) -> Result<Self, InputError> {
        check_step(stages, h)?;
        check_unforced(problem.lagrangian, "collocation in transformed time")?;
        let Problem { lagrangian, t0, start, state, structure, .. } = *problem;
        let InitialMass { inverse, .. } = InitialMass::of(problem)?;
        if !structure.autonomous {
            return Err(InputError::Unclaimed { claim: "autonomous" });
        }
        let rate = lagrangian.dt_dtau(&state.q);
        if !(rate > 0.0 && rate.is_finite()) {
            return Err(InputError::TimeTransformation { rate });
        }
        let energy = start.v.dot(&state.p) - lagrangian.value(t0, &start.q, &start.v, start.z);
        if !energy.is_finite() {
            return Err(InputError::FirstStep(StepError::NonFinite));
        }
        let extension = Extension::new(Fictitious(lagrangian), t0, -energy);
        let (table, mass) = (StageTable::new(stages, h), Mass::new(&structure, inverse));
        let general = Box::new(General::new(lagrangian, extension, table, mass, false, &state, &start.v));
        Ok(TransformedStepper {
            general,
            arch: Instructions::new(),
            h,
            tau: 0.0,
            taken: 0,
            from: None,
            unresolved: None,
        })
    }

    /// The momentum `p_t` conjugate to t. Up to the error of the method it is minus the energy, `E + p_t = K / g`. Each
    /// step multiplies it by `sigma_d`, as any momentum.
    pub fn time_momentum(&self) -> f64 {
        self.general.extension.p_t.value
    }

    /// The transformed time tau since the start.
    pub(crate) fn tau(&self) -> f64 {
        self.tau
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
        let (general, from) = (&*self.general, self.from.as_ref()?);
        let value = |x: &[CompensatedSum; N]| SVector::from(values(x));
        let start = PhasePoint { q: value(&from.q), p: value(&from.p), z: from.z.value };
        let (&StageTable { s, h, .. }, transformation) = (&general.table, &general.extension.transformation);
        let mut curve = Curve::new(s, from.t.value, h, &start);
        curve.of_transformed(&general.solved_in_transformed_time(), [transformation.rate(&start.q), general.rate()]);
        let at =
            |set| self.arch.dispatch(Compare { lagrangian: general.lagrangian, transformation, curve: &curve, set });
        (0..sets).map(at).reduce(DefectSample::and)
    }

    /// Repeats the last step, which has passed a given time, with the length for which it ends at that time.
    fn shorten(&mut self, before: &Values<N>, t_end: f64) -> Result<(), StepError> {
        // Lengths are positive in both directions of time.
        let way = self.h.signum();
        let (mut short, mut long, mut length) = (0.0, self.h.abs(), self.h.abs());
        let mut over = (self.time() - t_end) * way;
        for _ in 0..ITERATION_LIMIT {
            // Newton's method, with bisection as a safeguard; dt/dh is the rate at the end up to the error of the
            // method.
            let newton = length - over / self.general.rate();
            length = if short < newton && newton < long { newton } else { 0.5 * (short + long) };
            self.general.reset(before);
            self.general.table = StageTable::new(self.general.table.s, length * way);
            self.take_steps(1).map_err(|halt| halt.cause)?;
            over = (self.time() - t_end) * way;
            if self.ends_at(t_end, before.t.value) {
                // The stages belong to a step of another length than the next one, which must not be extrapolated from
                // them.
                let end = self.general.values();
                self.general.reset(&end);
                return Ok(());
            }
            *(if over > 0.0 { &mut long } else { &mut short }) = length;
        }
        Err(StepError::NotConverged { residual: over, iterations: ITERATION_LIMIT })
    }

    /// Whether a step from the time `before` ends at `t_end` to round-off; if so, the time is set to `t_end`.
    fn ends_at(&mut self, t_end: f64, before: f64) -> bool {
        let there = (self.time() - t_end).abs() <= 2.0 * f64::EPSILON * t_end.abs().max(before.abs());
        if there {
            self.general.extension.t = t_end.into();
        }
        there
    }

    /// Takes steps by fixed-point iteration.
    fn take_steps(&mut self, steps: usize) -> Result<(), StepFailure> {
        let TransformedStepper { general, taken, unresolved, .. } = self;
        self.arch.dispatch(AdvanceTransformed { general: &mut **general, unresolved, taken, steps })
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
        self.from = None;
        self.unresolved = load_option(from, || UnresolvedStep { step: 0, defect: 0.0 })?;
        Some(())
    }

    /// Restores the full step size after a shortened step.
    fn lengthen(&mut self) {
        if self.general.table.h != self.h {
            self.general.table = StageTable::new(self.general.table.s, self.h);
        }
    }
}

/// A number of steps, compiled for one instruction set; ends at the first step that fails.
struct AdvanceTransformed<'b, 'a, L, const N: usize> {
    general: &'b mut General<'a, L, Fictitious<'a, L>, N>,
    unresolved: &'b mut Option<UnresolvedStep>,
    taken: &'b mut usize,
    steps: usize,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for AdvanceTransformed<'_, '_, L, N> {
    type Output = Result<(), StepFailure>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        forget_branches();
        for taken in 0..self.steps {
            // L is autonomous.
            let t = self.general.extension.t.value;
            let progress = self.general.take_step::<S>(t);
            if progress != IterationOutcome::Done {
                return Err(StepFailure { taken, cause: progress.into() });
            }
            if self.general.defect > 1.0 && self.unresolved.is_none() {
                *self.unresolved = Some(UnresolvedStep { step: *self.taken, defect: self.general.defect });
            }
            *self.taken += 1;
        }
        Ok(())
    }
}

impl<L: Lagrangian<N>, const N: usize> Stepper<N> for TransformedStepper<'_, L, N> {
    /// The steps are equal in transformed time.
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        self.lengthen();
        self.from = None;
        let done = self.take_steps(steps);
        self.tau += done.map_or_else(|halt| halt.taken, |()| steps) as f64 * self.h;
        done
    }

    fn last_velocity(&self) -> Option<SVector<f64, N>> {
        Some(self.general.last_velocity())
    }

    /// The last step is shortened to end at `t_end` to round-off.
    fn advance_until(&mut self, steps: usize, t_end: f64) -> Result<usize, StepFailure> {
        let halt = |taken, cause| StepFailure { taken, cause };
        if !t_end.is_finite() {
            return Err(halt(0, StepError::NonFinite));
        }
        let mut taken = 0;
        while taken < steps && (t_end - self.time()) * self.h > 0.0 {
            self.lengthen();
            let before = self.general.values();
            self.from = None;
            self.take_steps(1).map_err(|refused| halt(taken, refused.cause))?;
            if !self.ends_at(t_end, before.t.value)
                && (self.time() - t_end) * self.h > 0.0
                && let Err(cause) = self.shorten(&before, t_end)
            {
                self.general.reset(&before);
                return Err(halt(taken, cause));
            }
            self.from = Some(before);
            self.tau += self.general.table.h;
            taken += 1;
        }
        Ok(taken)
    }

    fn state(&self) -> PhasePoint<N> {
        let Values { q, p, z, .. } = self.general.values();
        PhasePoint { q: values(&q).into(), p: values(&p).into(), z: z.value }
    }

    /// The physical time.
    fn time(&self) -> f64 {
        self.general.extension.t.value
    }

    fn sigma(&self) -> f64 {
        1.0 / (1.0 - self.general.one_minus_rho)
    }

    fn evaluations(&self) -> u64 {
        self.general.evaluations
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        work_summary_in_transformed_time(&self.general.lagrangian.structure())
    }

    fn save(&self) -> Option<Vec<u64>> {
        let mut words = Vec::new();
        self.general.save(&mut words);
        [self.general.table.h, self.tau].save(&mut words);
        self.taken.save(&mut words);
        save_option(self.unresolved.as_ref(), &mut words);
        Some(words)
    }

    fn restore(&mut self, mut words: &[u64]) -> bool {
        self.read(&mut words).is_some() && words.is_empty()
    }

    fn unresolved(&self) -> Option<UnresolvedStep> {
        self.unresolved
    }
}
