//! The discrete Lagrange-d'Alembert-Herglotz equations as an integrator of runs.

use super::drag_rattle::substeps;
use super::nonholonomic::EQUATIONS;
use super::{ConstrainedStart, Nonholonomic};
use crate::integration::check_unforced;
use crate::rules::{DiscretizationMethod, Rule};
use crate::{InputError, Integrator, MethodInfo, Problem, SplittingScheme, StepError, Stepper, StepperOptions};
use contact_geom::constraints::{Distribution, nonholonomic_motion};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, VelocityPoint};

/// Constraints `omega(q) v = 0` on the velocities as an [`Integrator`] of a [`Problem`]: each step solves the discrete
/// Lagrange-d'Alembert-Herglotz equations of [`Nonholonomic`] for a symmetric rule of order 2, composed by a scheme.
/// The order is that of the scheme.
///
/// Runs have rows, events, dense output, checkpoints, a plan and an accuracy as without constraints. The velocity of
/// the start lies in the distribution; [`Nonholonomic::new`] projects one that does not. An accuracy is met by runs
/// with steps that are halved until they agree.
///
/// The motion is not conformally contact. The conformal factor of a run, `sigma = exp(integral of L_z)`, multiplies the
/// energy of an autonomous L, and the momenta of horizontal symmetries, `omega(q) xi_Q = 0`, alone: those of other
/// symmetries change by the force of the constraints.
///
/// ```
/// use contact_examples::systems::constrained::KnifeEdge;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::constraints::LagrangeDAlembert;
/// use discrete_herglotz::{Event, Events, Problem, SplittingScheme, Until};
/// let blade = KnifeEdge { slope: 1.0, gamma: 0.0 };
/// let rolling = LagrangeDAlembert::new(&blade, SplittingScheme::SUZUKI_4);
/// let problem = Problem::new(&blade, 0.0, VelocityPoint::new([0.0; 3], [0.0, 0.0, 1.0], 0.0))?;
/// let mut turned = Events::new([Event::new(|_, x| x.q[2] - 3.0)]);
/// let outcome = problem.by(rolling).accuracy(1e-7).observe(&mut turned).run(Until::Time(5.0))?;
/// assert!((outcome.q[0] - 0.5 * 5f64.sin().powi(2)).abs() < 1e-6 && (turned.crossings[0].t - 3.0).abs() < 1e-6);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct LagrangeDAlembert<W, const M: usize, D = Rule> {
    /// The constraints.
    pub distribution: W,
    /// The scheme by which steps are composed; [`SplittingScheme::STRANG`] is one step of the rule.
    pub scheme: SplittingScheme,
    /// The rule that constructs the discrete Lagrangian: symmetric, and of order 2.
    pub rule: D,
}

impl<W, const M: usize> LagrangeDAlembert<W, M> {
    /// Constraints with the symmetric midpoint rule, composed by a scheme.
    pub fn new(distribution: W, scheme: SplittingScheme) -> Self {
        LagrangeDAlembert { distribution, scheme, rule: Rule::MIDPOINT }
    }
}

impl<'a, L, W, D, const N: usize, const M: usize> Integrator<'a, L, N> for LagrangeDAlembert<W, M, D>
where
    L: Lagrangian<N>,
    W: Distribution<N, M> + Clone + 'a,
    D: DiscretizationMethod<'a, L, N>,
{
    fn info(&self) -> MethodInfo {
        let rule = self.rule.info();
        MethodInfo {
            name: format!("lagrange_d_alembert_{}_by_{}", rule.name, self.scheme.name()).into(),
            order: self.scheme.order(),
            symmetric: true,
            explicit: false,
            exact_rate: false,
            substeps: self.scheme.order() > 2,
            constrained: true,
            contact: false,
            source: format!("Cortes and Martinez, Nonlinearity 14 (2001), 1365-1392; {}", self.scheme.source()).into(),
            ..MethodInfo::of_discrete::<N>("", 0)
        }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        substeps(&self.scheme)?;
        let rule = self.rule.info();
        if !rule.symmetric || rule.order != 2 {
            return Err(InputError::Hypothesis { hypothesis: "a composition of a symmetric rule of order 2" });
        }
        check_unforced(lagrangian, EQUATIONS)?;
        self.rule.check(lagrangian)
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        _options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        let start = ConstrainedStart { t: problem.t0, ..ConstrainedStart::new(problem.start) };
        let rule = |h| self.rule.discretise(problem, h);
        let distribution = self.distribution.clone();
        Ok(Box::new(Nonholonomic::of(problem.lagrangian, distribution, rule, &self.scheme, h, &start)?))
    }

    fn constraint_force(&self, lagrangian: &L, t: f64, x: &VelocityPoint<N>) -> Result<SVector<f64, N>, StepError> {
        let motion = nonholonomic_motion(lagrangian, &self.distribution, t, x);
        let multipliers = motion.map_err(|_| StepError::Singular { pivot: 0.0 })?.multipliers;
        Ok(self.distribution.omega(&x.q).transpose() * multipliers)
    }
}
