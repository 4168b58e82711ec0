//! Symmetric compositions of discrete flows.

use crate::numbers::state_words::{Saved, saved};
use crate::resolution::monitor::{ResolutionMonitor, sharper, turning};
use crate::rules::flow::work_summary_of;
use crate::{
    DiscreteLagrangian, DiscreteStep, InputError, PlanEntry, RunSupport, SplittingScheme, State, StepDetails,
    StepError, StepFailure, Stepper, UnresolvedStep, Vector, integration::SuspectInterval, solve::Solver,
};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;

/// A symmetric composition `F_(g_s h) ... F_(g_1 h)` of higher order of the flow of a symmetric discrete Lagrangian of
/// order 2, with its current state.
///
/// The substeps `g_i` of a [`SplittingScheme`] sum to 1 and satisfy the order conditions of the scheme, so that a rule
/// of the user is raised to the order of the scheme; Yoshida, Phys. Lett. A 150 (1990). Some substeps are negative: for
/// a symmetric rule the step with `-h` is the inverse of the step with `h`, which is
/// [`backward`](DiscreteLagrangian::backward).
///
/// The hypotheses are order 2 and the symmetry `F_(-h) = F_h^(-1)`. They are not verified; without them the order of
/// the scheme is not attained. Each substep is conformally contact, and `sigma_d` of the step is the product of the
/// factors.
///
/// ```
/// use contact_examples::systems::DoublePendulum;
/// use contact_geom::PhasePoint;
/// use discrete_herglotz::{SplittingScheme, Stepper, rules::{Composition, Rule}};
/// let system = DoublePendulum::default();
/// let rule = |h| Rule::MIDPOINT.of(&system, h);
/// let start = PhasePoint::new([1.0, 0.5], [0.0, 0.0], 0.0);
/// let mut motion = Composition::new(rule, &SplittingScheme::KAHAN_LI_8, 0.1, 0.0, start)?;
/// assert!(motion.advance(100).is_ok());
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub struct Composition<D, const N: usize> {
    rules: Vec<D>,
    substeps: Vec<Substep>,
    h: f64,
    t0: f64,
    taken: usize,
    state: PhasePoint<N>,
    velocity: SVector<f64, N>,
    sigma: f64,
    evaluations: u64,
    solver: Solver<N>,
    /// The difference quotient of the last two mean velocities.
    acceleration: SVector<f64, N>,
    change: SVector<f64, N>,
    /// The state before the last step.
    before: PhasePoint<N>,
    monitor: ResolutionMonitor,
}

/// One substep: the index of its rule, and the earlier of its two times, relative to the start of the step.
#[derive(Clone, Copy, Debug)]
struct Substep {
    rule: usize,
    start: f64,
    back: bool,
    /// Its length, with the sign of the time between the midpoints of consecutive differences of mean velocities.
    length: f64,
    /// The time from the midpoint of the previous substep to the midpoint of this one.
    apart: f64,
}

impl<D: DiscreteLagrangian<N>, const N: usize> Composition<D, N> {
    /// A composition of the discrete Lagrangians that `rule` returns for the lengths of the substeps, from the state
    /// `(q, p, z)` at time `t0`.
    ///
    /// # Errors
    /// [`InputError::Step`] unless h is finite and not 0; [`InputError::Hypothesis`] for a Runge-Kutta-Nystrom scheme;
    /// [`InputError::Geometry`] where the time or the state is not finite, or the Lagrangian singular;
    /// [`InputError::Sigma`] and [`InputError::FirstStep`] where the first substep fails; those of `rule`.
    pub fn new(
        mut rule: impl FnMut(f64) -> Result<D, InputError>,
        scheme: &SplittingScheme,
        h: f64,
        t0: f64,
        state: PhasePoint<N>,
    ) -> Result<Self, InputError> {
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h });
        }
        crate::integration::system_problem::check_time(t0)?;
        state.check()?;
        let Some(lengths) = scheme.substeps() else {
            return Err(InputError::Hypothesis {
                hypothesis: "a composition of symmetric steps, not a Nyström splitting",
            });
        };
        let (mut rules, mut substeps, mut time) = (Vec::new(), Vec::new(), 0.0);
        // By symmetry the last two midpoints are as far apart as the first two.
        let mut last_apart = match lengths[..] {
            [first, second, ..] => 0.5 * (first + second) * h,
            _ => h,
        };
        for (i, &g) in lengths.iter().enumerate() {
            // The second half of the substeps mirrors the first and shares its rules.
            let index = i.min(lengths.len() - 1 - i);
            if index == i {
                rules.push(rule(g.abs() * h)?);
            }
            let before = if i == 0 { lengths[lengths.len() - 1] } else { lengths[i - 1] };
            let start = f64::min(time, time + g) * h;
            let apart = 0.5 * (before + g) * h;
            // The sign is the direction in which the midpoint of the last two mean velocities moves.
            let length = (g * h).abs().copysign(apart + last_apart);
            last_apart = apart;
            substeps.push(Substep { rule: index, start, back: g < 0.0, length, apart });
            time += g;
        }
        let mut composition = Composition {
            rules,
            substeps,
            h,
            t0,
            taken: 0,
            state,
            velocity: SVector::zeros(),
            sigma: 1.0,
            evaluations: 0,
            solver: Solver::default(),
            acceleration: SVector::zeros(),
            change: SVector::zeros(),
            before: state,
            monitor: ResolutionMonitor::new(state.q.as_slice(), &[0.0; N], h),
        };
        if let Some(first) = composition.substeps.first().copied() {
            let guess = SVector::zeros();
            let taken = composition.substep(&first, &state, &guess);
            let velocity = taken.map_or(guess, |step| step.velocity);
            composition.rules[first.rule].check_start(t0, &state, &velocity)?;
            taken.map_err(InputError::first_step)?;
        }
        Ok(composition)
    }

    /// One substep of the current step.
    fn substep(
        &mut self,
        substep: &Substep,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        let (rule, at) = (&self.rules[substep.rule], self.time() + substep.start);
        if substep.back {
            rule.backward(at, from, guess, &mut self.solver)
        } else {
            rule.forward(at, from, guess, &mut self.solver)
        }
    }

    /// Takes one step; the state changes only if every substep succeeds.
    fn step(&mut self) -> Result<(), StepError> {
        let (mut state, mut velocity, mut sigma) = (self.state, self.velocity, 1.0);
        let mut sharpest = self.monitor.steps.sharpest;
        for i in 0..self.substeps.len() {
            let substep = self.substeps[i];
            let next = self.substep(&substep, &state, &velocity)?;
            sigma *= if substep.back { 1.0 / next.sigma } else { next.sigma };
            self.check_substep(&substep, &velocity, &next, &mut sharpest);
            // Newton's method evaluates once in each iteration and once at the solution.
            self.evaluations += u64::from(next.iterations) + 1;
            (state, velocity) = (next.end, next.velocity);
        }
        if sharpest > self.monitor.steps.sharpest
            && let Some(step) = self.taken.checked_sub(1)
        {
            // The cause of a change of the first mean velocity may lie in the previous step.
            let t = self.t0 + step as f64 * self.h;
            self.monitor.suspect(sharpest, (step, 2, t), [&self.before, &state]);
        }
        self.before = self.state;
        (self.state, self.velocity, self.sigma) = (state, velocity, sigma);
        self.taken += 1;
        Ok(())
    }
}

impl<D: DiscreteLagrangian<N>, const N: usize> Composition<D, N> {
    /// Checks whether a substep resolves the motion, by the conformal factor of its rule and by the second differences
    /// of the mean velocities, scaled to the length of the substep. Differences are compared from the second step on.
    #[inline(always)]
    fn check_substep(
        &mut self,
        substep: &Substep,
        before: &SVector<f64, N>,
        next: &DiscreteStep<N>,
        sharpest: &mut f64,
    ) {
        let now = &next.velocity;
        let acceleration = (now - before) / substep.apart;
        let last = std::mem::replace(&mut self.acceleration, acceleration);
        let change = (acceleration - last) * substep.length;
        let last = std::mem::replace(&mut self.change, change);
        if self.taken > 0 {
            let found = if change.dot(&last) < 0.0 {
                let velocities = [before.as_slice(), now.as_slice(), now.as_slice()];
                let changes = [last.as_slice(), change.as_slice()];
                turning(changes, velocities, next.end.q.as_slice(), substep.length, self.monitor.steps.floor)
            } else {
                None
            };
            if let Some(defect) = found {
                self.monitor.steps.note(self.taken, defect);
            }
            if let Some(sharpness) =
                sharper([&change, now, &next.end.q], substep.length, self.monitor.steps.floor, *sharpest)
            {
                *sharpest = sharpness;
            }
        }
        if let Some(defect) = self.rules[substep.rule].defect([now; 4], &next.end, next.sigma) {
            self.monitor.steps.note(self.taken, defect);
        }
    }
}

impl<D: DiscreteLagrangian<N>, const N: usize> Stepper for Composition<D, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        (0..steps).try_for_each(|taken| self.step().map_err(|cause| StepFailure { taken, cause }))
    }

    fn state(&self) -> State {
        self.state.into()
    }

    fn time(&self) -> f64 {
        self.t0 + self.taken as f64 * self.h
    }

    fn sigma(&self) -> f64 {
        self.sigma
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
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

impl<D: DiscreteLagrangian<N>, const N: usize> StepDetails for Composition<D, N> {
    fn last_velocity(&self) -> Option<Vector> {
        (self.taken > 0).then(|| self.velocity.into())
    }
}

impl<D: DiscreteLagrangian<N>, const N: usize> RunSupport for Composition<D, N> {
    fn has_constant_rate(&self) -> bool {
        self.rules.iter().all(|rule| rule.constant_rate())
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        work_summary_of(self.rules.iter().all(|rule| rule.is_explicit()), "substep")
    }

    fn save(&self) -> Option<Vec<u64>> {
        let mut words = Vec::new();
        Saved::save(self, &mut words);
        Some(words)
    }

    fn restore(&mut self, mut words: &[u64]) -> bool {
        self.load(&mut words).is_some() && words.is_empty()
    }

    fn unresolved(&self) -> Option<UnresolvedStep> {
        self.monitor.steps.first
    }

    fn suspect_interval(&mut self) -> Option<SuspectInterval> {
        self.monitor.suspect.take()
    }
}

saved!([D, const N: usize] Composition<D, N> {
    taken, state, velocity, sigma, evaluations, acceleration, change, before, monitor
});
