//! The exact flow as an integrator.

use crate::numerics::flow::flow_between_jumps;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, VelocityPoint, legendre};
use discrete_herglotz::{
    InputError, Integrator, MethodInfo, PlanEntry, Problem, RunSupport, State, StepError, StepFailure, Stepper,
    StepperOptions,
};

/// The flow of the Herglotz vector field as an [`Integrator`]. Steps of any length are computed to round-off by
/// [`herglotz_flow`](crate::herglotz_flow); they end at the jumps of L that its switching functions indicate.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{Problem, Rows, Steps, Until};
/// use exact_lagrangian::ExactFlow;
/// let pendulum = Pendulum { gamma: -0.1 };
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
/// let mut rows = Rows::every(1)?;
/// problem.by(ExactFlow).steps(Steps::Count(10)).observe(&mut rows).run(Until::Time(10.0))?;
/// println!("q(10) = {}", rows.rows[10].q[0]);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExactFlow;

impl<'a, L: Lagrangian<N>, const N: usize> Integrator<'a, L, N> for ExactFlow {
    fn info(&self) -> MethodInfo {
        MethodInfo {
            symmetric: true,
            explicit: true,
            exact_rate: true,
            ..MethodInfo::of_discrete::<N>("exact", u32::MAX)
        }
    }

    fn check(&self, _lagrangian: &L) -> Result<(), InputError> {
        Ok(())
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        _: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h });
        }
        let (lagrangian, t0, x) = (problem.lagrangian(), problem.t0(), *problem.start());
        Ok(Box::new(Run { lagrangian, t0, h, k: 0, x, b: 0.0, evaluations: 0 }))
    }
}

/// A run of the exact flow.
struct Run<'a, L, const N: usize> {
    lagrangian: &'a L,
    t0: f64,
    h: f64,
    k: usize,
    x: VelocityPoint<N>,
    /// The logarithm of the conformal factor of the last step.
    b: f64,
    evaluations: u64,
}

impl<L: Lagrangian<N>, const N: usize> Stepper for Run<'_, L, N> {
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure> {
        for taken in 0..steps {
            let motion = flow_between_jumps(self.lagrangian, self.time(), &self.x, self.h)
                .map_err(|error| StepFailure { taken, cause: StepError::from(error) })?;
            (self.x, self.b) = (motion.end, motion.b);
            self.evaluations += motion.evaluations;
            self.k += 1;
        }
        Ok(())
    }

    fn state(&self) -> State {
        legendre(self.lagrangian, self.time(), &self.x).into()
    }

    fn time(&self) -> f64 {
        self.t0 + self.k as f64 * self.h
    }

    fn sigma(&self) -> f64 {
        self.b.exp()
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn run_support(&self) -> Option<&dyn RunSupport> {
        Some(self)
    }

    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        Some(self)
    }
}

impl<L: Lagrangian<N>, const N: usize> RunSupport for Run<'_, L, N> {
    fn save(&self) -> Option<Vec<u64>> {
        let VelocityPoint { q, v, z } = &self.x;
        let numbers = q.iter().chain(v.iter()).chain([z, &self.b]).map(|x| x.to_bits());
        Some(numbers.chain([self.k as u64, self.evaluations]).collect())
    }

    fn restore(&mut self, words: &[u64]) -> bool {
        let [numbers @ .., k, evaluations] = words else { return false };
        if numbers.len() != 2 * N + 2 {
            return false;
        }
        let number = |i: usize| f64::from_bits(numbers[i]);
        self.x = VelocityPoint {
            q: SVector::from_fn(|i, _| number(i)),
            v: SVector::from_fn(|i, _| number(N + i)),
            z: number(2 * N),
        };
        (self.b, self.k, self.evaluations) = (number(2 * N + 1), *k as usize, *evaluations);
        true
    }

    fn work_summary(&self) -> Vec<PlanEntry> {
        vec![
            PlanEntry::computed(
                "panels",
                "their number in a step is chosen for an error of round-off, with a check of the defect between \
                 their nodes",
            ),
            PlanEntry::skipped("Newton's method", "each panel is solved by fixed-point iteration"),
            PlanEntry::computed("action z", "it is a component of the Herglotz field"),
        ]
    }
}
