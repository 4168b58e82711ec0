//! Lyapunov exponents of a run.

use crate::numbers::order::sorted;
use crate::run::{Observer, Outcome, OutputRequest, Plan, Run, StepView, Stop, Until};
use crate::sensitivity::SensitivityError;
use crate::sensitivity::carried_columns::CarriedColumns;
use crate::sensitivity::columns::Column;
use crate::sensitivity::parametric_system::DifferentiableProblem;
use crate::sensitivity::projected_start::ProjectedStart;
use crate::sensitivity::row_times::RowTimes;
use crate::sensitivity::step_maps::Direction;
use crate::sensitivity::step_tangent::{StepTangent, TakenStep};
use crate::sensitivity::stretching::Stretching;
use crate::sensitivity::tangent::no_tangent;
use crate::{InputError, State, Vector};
use contact_geom::numbers::max_abs_or_nan;
use std::ops::ControlFlow;

/// The Lyapunov exponents of a run: the mean growth rates of its tangent in `(q, p, z)`.
///
/// They are those of the discrete run. Without an applied force, the sum of all `2n + 1` exponents is `n + 1` times
/// [`rate`](Self::rate), to round-off. If `L_z` is constant too, one of them equals the rate, and the others are `n` pairs
/// of this sum, to round-off, after any number of steps.
///
/// The tangent is carried across kinks, jumps and impacts. Steps that meet an elastic impact have these sums up to their error,
/// and those that meet another reset do not have them.
///
/// Under m constraints on positions there are `2 (n - m) + 1` exponents, of the directions that the constraints leave. They are
/// measured by the lengths of these directions in all coordinates, so that their sums are those above in the limit of a long run
/// alone, and there are no [`pairs`](Self::pairs).
#[derive(Clone, Debug, PartialEq)]
pub struct LyapunovExponents {
    /// The outcome of the run. Where it ended early, the exponents are those of its whole steps; a run ends where its motion
    /// comes to rest.
    pub outcome: Outcome,
    /// The exponents, in descending order, `2n + 1` without constraints; NaN if no step was taken.
    pub exponents: Vec<f64>,
    /// The same of the second half of the run, in the same order: its difference is an estimate of the error of a run
    /// of finite length, and it does not depend on the initial directions. The halves meet at the end of a step, or of a part
    /// of one; where there is none within the run, these are the exponents themselves.
    pub of_second_half: Vec<f64>,
    /// The exponents of the n pairs of directions `q_i` and `p_i` with which the frame starts. If `L_z` is constant and no
    /// force is applied, the sum of each pair is the rate, to round-off.
    pub pairs: Vec<[f64; 2]>,
    /// The mean rate `ln sigma_d / h` of the conformal factor.
    pub rate: f64,
}

impl LyapunovExponents {
    /// The largest distance of the sum of a pair from the rate.
    pub fn pairing_defect(&self) -> f64 {
        max_abs_or_nan(self.pairs.iter().map(|[a, b]| a + b - self.rate))
    }

    /// The distance of the sum of all exponents from `n + 1` times the rate, which is that of the logarithm of the volume.
    pub fn volume_defect(&self) -> f64 {
        let sum: f64 = self.exponents.iter().sum();
        (sum - (self.pairs.len() as f64 + 1.0) * self.rate).abs()
    }
}

/// A frame of tangents that is carried along a run, and made orthonormal after each step and after each part of one: a
/// single step may span many impacts, after which all directions would be parallel.
struct Frame<'r, 'p> {
    plan: &'r Plan<'p>,
    carried: CarriedColumns<'r, 'p>,
    before: (f64, State),
    taken: usize,
    failure: Option<SensitivityError>,
}

/// The directions z, then the first n of q, then those of p in the reverse order; `dimension` is the number of all
/// coordinates.
///
/// For constant `L_z` the direction z is invariant, and the spans of the first k of the others are, in `(q, p)`, isotropic
/// and their symplectic complements the spans of the first 2n - k, which steps preserve. So the stretching factors of
/// paired directions have the product `sigma_d` in each step.
fn initial_frame(n: usize, dimension: usize) -> Vec<Column> {
    let zero = || Vector::zeros(dimension);
    let unit = |i: usize| Vector::from_fn(dimension, |j| f64::from(u8::from(i == j)));
    let positions = (0..n).map(|i| Column::new(unit(i), zero(), 0.0));
    let momenta = (0..n).rev().map(|i| Column::new(zero(), unit(i), 0.0));
    std::iter::once(Column::new(zero(), zero(), 1.0)).chain(positions).chain(momenta).collect()
}

/// An orthonormal basis of the directions that constraints leave, of this number, from those of all coordinates.
fn tangent_frame(mut columns: Vec<Column>, start: &ProjectedStart, count: usize) -> Vec<Column> {
    columns.iter_mut().for_each(|column| start.push(column));
    let mut basis: Vec<Column> = Vec::with_capacity(count);
    // The one with the largest part outside of the span of those before: the others are dependent.
    while basis.len() < count {
        let sizes = columns.iter().map(|column| column.dot(column));
        let Some((i, size)) = sizes.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let mut next = columns.swap_remove(i);
        next.scale(1.0 / size.sqrt());
        for column in &mut columns {
            column.add_multiple(-column.dot(&next), &next);
        }
        basis.push(next);
    }
    basis
}

impl Frame<'_, '_> {
    fn push(&mut self, at: &StepView<'_>) -> Result<(), SensitivityError> {
        let k = at.k.saturating_sub(1);
        let before = std::mem::replace(&mut self.before, (at.t, at.state.clone()));
        let step = TakenStep::last_of(at.stepper, self.carried.engine.has_stages(), self.plan.step_size(), before);
        let step = step.ok_or_else(|| no_tangent(self.plan, ""))?;
        let failed = |cause| SensitivityError::Step { step: k, cause };
        self.carried.push(&step, at.t, k)?;
        self.carried.switches.clear();
        self.taken = at.k;
        let CarriedColumns { columns, stretching, .. } = &mut self.carried;
        if let Some(stretching) = stretching {
            let mut times = vec![0.0; columns.len()];
            stretching.orthonormalise(columns, &mut times).map_err(failed)?;
            if 2 * at.k >= self.plan.count() && at.k < self.plan.count() {
                stretching.note_end(at.t);
            }
        }
        Ok(())
    }
}

impl Observer for Frame<'_, '_> {
    fn needs(&self) -> OutputRequest {
        OutputRequest::ACTION
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.before = (at.t, at.state.clone());
        ControlFlow::Continue(())
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if at.is_at_rest() {
            // The exponents are those of the steps.
            return ControlFlow::Break(Stop { at: Some(self.before.clone()), ..Stop::here("rest") });
        }
        // A part of a step, where a run ends within it, is not carried over.
        if at.in_failed_step || at.k <= self.taken {
            return ControlFlow::Continue(());
        }
        match self.push(at) {
            Ok(()) => ControlFlow::Continue(()),
            Err(failure) => {
                self.failure = Some(failure);
                ControlFlow::Break(Stop::here("a derivative that cannot be computed"))
            }
        }
    }
}

impl<'p, P: DifferentiableProblem<'p>> Run<'p, '_, P> {
    /// Performs the run and computes its Lyapunov exponents by the method of Benettin and others (1980): the tangent of
    /// the discrete run, made orthonormal after each step, and after each of its parts where it ends parts at kinks, jumps
    /// and resets.
    ///
    /// ```
    /// use contact_examples::systems::Duffing;
    /// use contact_geom::VelocityPoint;
    /// use discrete_herglotz::{Problem, Steps, Until};
    /// let duffing = Duffing::forced();
    /// let problem = Problem::new(&duffing, 0.0, VelocityPoint::new([0.1], [0.0], 0.0))?;
    /// let lyapunov = problem.steps(Steps::Size(0.1)).lyapunov_exponents(Until::Time(50.0))?;
    /// // A pair, and the exponent of z: in total twice the rate.
    /// let sum: f64 = lyapunov.exponents.iter().sum();
    /// assert!((sum - 2.0 * lyapunov.rate).abs() < 1e-12);
    /// # Ok::<(), discrete_herglotz::sensitivity::SensitivityError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`run`](Self::run), [`SensitivityError::NoTangent`], [`SensitivityError::UnderConstraints`], and
    /// [`SensitivityError::Step`] where the tangent of a
    /// step cannot be computed. A run that ends early is reported as the status of the outcome.
    pub fn lyapunov_exponents(self, until: Until) -> Result<LyapunovExponents, SensitivityError> {
        let coordinates = self.problem.differentiable().dimension();
        self.lyapunov_exponents_within(coordinates, until)
    }

    /// The same for the first n coordinates of a motion in which the others are at rest and act on nothing, as where the
    /// type of a system has more coordinates than its formula: `2n + 1` exponents.
    ///
    /// # Errors
    /// Those of [`lyapunov_exponents`](Self::lyapunov_exponents), [`SensitivityError::Coordinate`] for more coordinates
    /// than the problem has, and [`InputError::Count`] for none.
    pub fn lyapunov_exponents_within(
        self,
        coordinates: usize,
        until: Until,
    ) -> Result<LyapunovExponents, SensitivityError> {
        let problem = self.problem.differentiable();
        let dimension = problem.dimension();
        match coordinates {
            0 => return Err(InputError::Count { what: "the number of coordinates", least: 1, found: 0 }.into()),
            n if n > dimension => return Err(SensitivityError::Coordinate { index: n - 1, count: dimension }),
            _ => {}
        }
        let run = self.differentiable()?.with_conformal_factor();
        let plan = run.plan(until)?;
        let of_start = ProjectedStart::of(&problem, &plan.steps);
        let of_start = of_start.map_err(|cause| SensitivityError::Step { step: 0, cause })?;
        if plan.steps.info.constrained && of_start.is_none() {
            // Of constraints on velocities the directions of the motion are not known.
            let method = plan.steps.info.name.clone();
            return Err(SensitivityError::UnderConstraints { method, what: "Lyapunov exponents" });
        }
        let engine = StepTangent::new(&problem, &plan.steps, Direction::Forward)?;
        let mut columns = initial_frame(coordinates, dimension);
        let is_held = of_start.is_some();
        if let Some(start) = of_start {
            let count = columns.len().saturating_sub(2 * start.constraints());
            columns = tangent_frame(columns, &start, count);
        }
        let t0 = problem.problem.t0;
        let span = (t0, plan.steps.t_end);
        let stretching = Stretching::new(columns.len(), span);
        let carried = CarriedColumns::new(&problem, &plan.steps, engine, columns, RowTimes::new(&[], span));
        let mut frame = Frame {
            plan: &plan,
            carried: CarriedColumns { stretching: Some(stretching), ..carried },
            before: (t0, problem.problem.state.clone()),
            taken: 0,
            failure: None,
        };
        let outcome = run.observed(&plan, &mut frame)?;
        let Frame { carried: CarriedColumns { stretching, .. }, before: (t, _), failure, .. } = frame;
        if let Some(failure) = failure {
            return Err(failure);
        }
        let Some(stretching) = stretching else { return Err(no_tangent(&plan, "")) };
        let (t_middle, until_middle) = stretching.middle(t0, t);
        let all: Vec<[f64; 2]> = stretching
            .logarithms
            .iter()
            .zip(&until_middle)
            .map(|(whole, first)| [whole / (t - t0), (whole - first) / (t - t_middle)])
            .collect();
        // The frame has the pair of a direction of q in the reverse order, after that of z.
        let paired = all.iter().skip(1).zip(all.iter().rev()).take(if is_held { 0 } else { coordinates });
        let pairs = paired.map(|(of_q, of_p)| [of_q[0], of_p[0]]).collect();
        let all = sorted(&all, |pair| pair[0], true);
        let rate = outcome.log_factor.map_or(f64::NAN, |factor| factor / (t - t0));
        let [exponents, of_second_half] = [0, 1].map(|i| all.iter().map(|pair| pair[i]).collect());
        Ok(LyapunovExponents { outcome, exponents, of_second_half, pairs, rate })
    }
}
