//! The discrete Lagrange-d'Alembert-Herglotz equations of nonholonomic motions.

use super::drag_rattle::substeps;
use super::linear_system::LinearSystem;
use super::start::{inverse_mass, round_off, tangent_velocity};
use super::{ConstrainedStart, ConstraintError, Corrections, Progress, velocity_scale};
use crate::integration::check_unforced;
use crate::numbers::state_words::{restored_from, saved, words_of};
use crate::{
    DiscreteLagrangian, InputError, RunSupport, SplittingScheme, State, StepDetails, StepError, StepFailure, Stepper,
    Vector,
};
use contact_geom::constraints::{Distribution, DistributionDerivatives};
use contact_geom::nalgebra::SVector;
use contact_geom::support::independent_rows;
use contact_geom::{ChartVector, Derivatives, DiscretePoint, Lagrangian, PhasePoint, VelocityPoint};

/// A nonholonomic motion under `omega(q) v = 0` by a symmetric discrete Lagrangian, with the current state. The
/// discrete Lagrange-d'Alembert-Herglotz equations are
///
/// `D1 L_d(q1, q2, z1) + sigma_d D2 L_d(q0, q1, z0) = mu omega(q1)`, `omega((q0 + q1)/2) (q1 - q0) = 0`,
///
/// here with the momenta `p0 = -(D1 L_d + Y omega(q0))/sigma_d`, `p1 = D2 L_d + Y' omega(q1)`, where Y is determined by
/// the discrete constraint and Y' by `omega(q1) v(q1, p1, z1) = 0`.
///
/// The step is symmetric if `L_d` is, and then of order 2; symmetric compositions have the order of their scheme.
/// Facts:
///
/// - the momentum `p . xi` of a constant horizontal symmetry, `omega(q) xi = 0`, is multiplied by `sigma_d` in each
///   step, to round-off;
/// - a step with h and one with -h give the start again, to round-off;
/// - the energy follows `E' = L_z E` with the order of the method;
/// - the flow is not conformally contact: no method for nonholonomic motions is, since the motions themselves are not.
///
/// [`LagrangeDAlembert`](super::LagrangeDAlembert) makes runs of these steps.
///
/// Reference: paper, section 4; Cortes and Martinez, Nonlinearity 14 (2001) 1365-1392; McLachlan and Perlmutter,
/// J. Nonlinear Sci. 16 (2006) 283-328, for reversible discrete constraints.
///
/// ```
/// use contact_examples::systems::constrained::KnifeEdge;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::constraints::{ConstrainedStart, Nonholonomic};
/// use discrete_herglotz::{SplittingScheme, Stepper, rules::Rule};
/// let blade = KnifeEdge { slope: 1.0, gamma: -0.1 };
/// let start = ConstrainedStart::new(VelocityPoint::new([0.0; 3], [0.0, 0.0, 1.0], 0.0));
/// let rule = |h| Rule::MIDPOINT.of(blade, h);
/// let mut motion = Nonholonomic::new(blade, blade, rule, &SplittingScheme::SUZUKI_4, 0.1, &start)?;
/// motion.advance(100)?;
/// assert!((motion.state().p[2] - (-1f64).exp()).abs() < 1e-3); // horizontal: p = sigma p
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Nonholonomic<L, W, D, const N: usize, const M: usize> {
    lagrangian: L,
    distribution: W,
    /// One rule for each substep.
    rules: Vec<D>,
    h: f64,
    t0: f64,
    taken: usize,
    current: Current<N, M>,
    evaluations: u64,
    system: LinearSystem,
    residual: Vec<f64>,
}

/// The equations, in errors.
pub(super) const EQUATIONS: &str = "the discrete Lagrange-d'Alembert-Herglotz equations";

/// What a step changes.
#[derive(Clone, Copy, Debug)]
struct Current<const N: usize, const M: usize> {
    state: PhasePoint<N>,
    velocity: SVector<f64, N>,
    sigma: f64,
    /// The sum of the impulses Y + Y' of the substeps.
    impulse: SVector<f64, M>,
}

impl<L, W, D, const N: usize, const M: usize> Nonholonomic<L, W, D, N, M>
where
    L: Lagrangian<N>,
    W: Distribution<N, M>,
    D: DiscreteLagrangian<N>,
{
    /// The motion from a start by the discrete Lagrangians that `rule` returns for the lengths of the substeps of a
    /// scheme, some of which are negative. The hypothesis that these are symmetric is not verified. The projection of
    /// the start, on request, changes the velocity alone.
    ///
    /// # Errors
    /// [`InputError`]: a velocity outside of the distribution, dependent rows of omega, a scheme of
    /// Runge-Kutta-Nystrom type, an applied force, a step that is 0 or not finite, a first step that fails; those of
    /// `rule`.
    pub fn new(
        lagrangian: L,
        distribution: W,
        rule: impl FnMut(f64) -> Result<D, InputError>,
        scheme: &SplittingScheme,
        h: f64,
        start: &ConstrainedStart<N>,
    ) -> Result<Self, InputError> {
        let mut motion = Self::of(lagrangian, distribution, rule, scheme, h, start)?;
        motion.step().map_err(InputError::FirstStep)?;
        motion.evaluations = 0;
        Ok(motion)
    }

    /// The motion, without the trial of its first step.
    pub(super) fn of(
        lagrangian: L,
        distribution: W,
        rule: impl FnMut(f64) -> Result<D, InputError>,
        scheme: &SplittingScheme,
        h: f64,
        start: &ConstrainedStart<N>,
    ) -> Result<Self, InputError> {
        // Its equations contain no force.
        check_unforced(&lagrangian, EQUATIONS)?;
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h });
        }
        let mut x = start.at;
        crate::integration::system_problem::check_time(start.t)?;
        PhasePoint { q: x.q, p: x.v, z: x.z }.check()?;
        let substeps = substeps(scheme)?;
        let omega = distribution.omega(&x.q);
        let kept = independent_rows(&omega);
        if let Some(index) = kept.iter().position(|kept| !kept) {
            let rank = kept.iter().filter(|kept| **kept).count();
            return Err(ConstraintError::RankDeficient { rank, expected: M, index }.into());
        }
        let inverse = inverse_mass(&lagrangian, start.t, &x)?;
        // As in `ConstrainedStart::resolved_for`.
        let rounding = round_off(&x.v) + round_off(&x.q) / h.abs();
        x.v = tangent_velocity(&omega, &inverse, &[true; M], (x.v, rounding), start.off_constraint)?;
        let state = PhasePoint { q: x.q, p: lagrangian.gradient(start.t, &x).y, z: x.z };
        let rules = substeps.iter().map(|g| g * h).map(rule).collect::<Result<Vec<_>, _>>()?;
        if rules.iter().any(DiscreteLagrangian::has_forces) {
            return Err(InputError::Forced { method: EQUATIONS });
        }
        let current = Current { state, velocity: x.v, sigma: 1.0, impulse: SVector::zeros() };
        Ok(Nonholonomic {
            lagrangian,
            distribution,
            rules,
            h,
            t0: start.t,
            taken: 0,
            current,
            evaluations: 0,
            system: LinearSystem::new(N + M),
            residual: vec![0.0; N + M],
        })
    }

    /// The current velocity, with the position and the action.
    pub fn velocity_point(&self) -> VelocityPoint<N> {
        VelocityPoint { q: self.current.state.q, v: self.current.velocity, z: self.current.state.z }
    }

    /// The impulse of the constraints in the last step, the sum over its substeps: `impulse / h` is a mean of the
    /// multipliers mu, of order 2 without a composition.
    pub fn impulse(&self) -> SVector<f64, M> {
        self.current.impulse
    }

    /// One step from the current state.
    fn step(&mut self) -> Result<Current<N, M>, StepError> {
        let mut current = Current { sigma: 1.0, impulse: SVector::zeros(), ..self.current };
        let mut time = self.time();
        for i in 0..self.rules.len() {
            let h = self.rules[i].step_size();
            self.substep(i, time, &mut current)?;
            time += h;
        }
        Ok(current)
    }

    /// One substep by the rule of this index.
    fn substep(&mut self, i: usize, t: f64, current: &mut Current<N, M>) -> Result<(), StepError> {
        let h = self.rules[i].step_size();
        let PhasePoint { q: q0, p: p0, z: z0 } = current.state;
        let omega0 = self.distribution.omega(&q0);
        let (mut u, mut y) = (current.velocity, SVector::<f64, M>::zeros());
        let mut corrections = Corrections::new();
        loop {
            let jet = self.rules[i].second_jet(t, &DiscretePoint { q0, q1: q0 + u * h, z0 })?;
            self.evaluations += 1;
            let slope = (jet.d12 + p0 * jet.d2z.transpose()) * h;
            let momenta = jet.first.d1 + p0 * jet.first.sigma() + omega0.transpose() * y;
            let middle = q0 + u * (0.5 * h);
            let (normal, turning) = self.distribution.rates(&middle, &u);
            let rows = turning * (0.5 * h) + self.distribution.omega(&middle);
            self.system.clear();
            for m in 0..N {
                self.residual[m] = momenta[m];
                (0..N).for_each(|k| self.system.add(m, k, slope[(m, k)]));
                (0..M).for_each(|a| self.system.add(m, N + a, omega0[(a, m)]));
            }
            for a in 0..M {
                self.residual[N + a] = normal[a];
                (0..N).for_each(|k| self.system.add(N + a, k, rows[(a, k)]));
            }
            if self.correct(&mut u, &mut y, &mut corrections, &middle, h)? {
                break;
            }
        }
        current.impulse += y;
        let q1 = q0 + u * h;
        let jet = self.rules[i].jet(t, &DiscretePoint { q0, q1, z0 })?;
        let sigma = jet.sigma();
        if sigma.is_nan() || sigma <= 0.0 {
            return Err(StepError::SigmaVanished { sigma });
        }
        let z1 = z0 + jet.value;
        let omega1 = self.distribution.omega(&q1);
        let (mut v, mut y) = (u, SVector::<f64, M>::zeros());
        let mut corrections = Corrections::new();
        loop {
            let x = VelocityPoint { q: q1, v, z: z1 };
            let momenta = self.lagrangian.gradient(t + h, &x).y - jet.d2 - omega1.transpose() * y;
            let mass = self.lagrangian.mass_matrix(t + h, &x);
            let normal = omega1 * v;
            self.system.clear();
            for m in 0..N {
                self.residual[m] = momenta[m];
                (0..N).for_each(|k| self.system.add(m, k, mass[(m, k)]));
                (0..M).for_each(|a| self.system.add(m, N + a, -omega1[(a, m)]));
            }
            for a in 0..M {
                self.residual[N + a] = normal[a];
                (0..N).for_each(|k| self.system.add(N + a, k, omega1[(a, k)]));
            }
            if self.correct(&mut v, &mut y, &mut corrections, &q1, h)? {
                break;
            }
        }
        let state = PhasePoint { q: q1, p: jet.d2 + omega1.transpose() * y, z: z1 };
        if !ChartVector::from(state).is_finite() {
            return Err(StepError::NonFinite);
        }
        *current = Current { state, velocity: v, sigma: current.sigma * sigma, impulse: current.impulse + y };
        Ok(())
    }

    /// One correction of a velocity and of impulses; whether it was the last.
    fn correct(
        &mut self,
        u: &mut SVector<f64, N>,
        y: &mut SVector<f64, M>,
        corrections: &mut Corrections,
        q: &SVector<f64, N>,
        h: f64,
    ) -> Result<bool, StepError> {
        self.system.factorise()?;
        self.system.solve(&mut self.residual);
        let change = SVector::<f64, N>::from_fn(|k, _| self.residual[k]);
        *u -= change;
        *y -= SVector::<f64, M>::from_fn(|a, _| self.residual[N + a]);
        let size = |x: &SVector<f64, N>| contact_geom::numbers::max_abs_or_nan(x.iter().copied());
        Ok(corrections.after(size(&change), velocity_scale(size(u), size(q), h))? == Progress::Ended)
    }
}

impl<L, W, D, const N: usize, const M: usize> Stepper for Nonholonomic<L, W, D, N, M>
where
    L: Lagrangian<N>,
    W: Distribution<N, M>,
    D: DiscreteLagrangian<N>,
{
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            self.current = self.step().map_err(|cause| StepFailure { taken, cause })?;
            self.taken += 1;
        }
        Ok(())
    }

    fn state(&self) -> State {
        self.current.state.into()
    }

    fn time(&self) -> f64 {
        self.t0 + self.taken as f64 * self.h
    }

    fn sigma(&self) -> f64 {
        self.current.sigma
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

impl<L, W, D, const N: usize, const M: usize> StepDetails for Nonholonomic<L, W, D, N, M>
where
    L: Lagrangian<N>,
    W: Distribution<N, M>,
    D: DiscreteLagrangian<N>,
{
    fn last_velocity(&self) -> Option<Vector> {
        Some(self.current.velocity.into())
    }
}

impl<L, W, D, const N: usize, const M: usize> RunSupport for Nonholonomic<L, W, D, N, M>
where
    L: Lagrangian<N>,
    W: Distribution<N, M>,
    D: DiscreteLagrangian<N>,
{
    fn save(&self) -> Option<Vec<u64>> {
        Some(words_of(self))
    }

    fn restore(&mut self, words: &[u64]) -> bool {
        restored_from(self, words)
    }
}

saved!([const N: usize, const M: usize] Current<N, M> { state, velocity, sigma, impulse });
saved!([L, W, D, const N: usize, const M: usize] Nonholonomic<L, W, D, N, M> { taken, current, evaluations });
