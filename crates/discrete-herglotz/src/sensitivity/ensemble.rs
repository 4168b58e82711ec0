//! Derivatives of the members of an ensemble.

use crate::ensemble::members::MemberSteps;
use crate::ensemble::shards;
use crate::ensemble::{EnsembleError, Lagrangians};
use crate::run::Interruption;
use crate::sensitivity::{EndCovector, Loss, LossGradient, MotionState, SensitivityError, Tangent, Variable};
use crate::{Ensemble, Problem, Run, Until};
use contact_geom::Parametric;
use std::ops::ControlFlow;

/// The largest number of members that are computed and handed on together.
const MAX_MEMBERS_PER_SHARD: usize = 16;

/// The number of shards for each thread in a small ensemble, so that the threads end at about the same time.
const SHARDS_PER_THREAD: usize = 8;

/// The gradients of the losses of the members of an ensemble; see [`Ensemble::gradient`].
#[derive(Clone, Debug, PartialEq)]
pub struct BatchGradient {
    /// The members in the order of their index. A member whose run was not completed has no loss, and its outcome says
    /// why; one that cannot be differentiated has an error.
    pub members: Vec<Result<LossGradient, SensitivityError>>,
}

impl BatchGradient {
    /// The sum of the losses of all members, and its gradient in the parameters where these have the same values for all
    /// members; summed in the order of the members. `None` if a member has no gradient.
    pub fn total(&self) -> Option<(f64, Vec<f64>)> {
        let mut total: Option<(f64, Vec<f64>)> = None;
        for member in &self.members {
            let (value, gradient) = member.as_ref().ok()?.loss.as_ref()?;
            match &mut total {
                None => total = Some((*value, gradient.parameters.clone())),
                Some((sum, parameters)) => {
                    *sum += value;
                    parameters.iter_mut().zip(&gradient.parameters).for_each(|(sum, of)| *sum += of);
                }
            }
        }
        total
    }

    /// The members without a gradient, by their index.
    pub fn failed(&self) -> impl Iterator<Item = (usize, &Result<LossGradient, SensitivityError>)> {
        self.members.iter().enumerate().filter(|(_, member)| !matches!(member, Ok(LossGradient { loss: Some(_), .. })))
    }
}

impl<L: Parametric<N> + Sync, const N: usize> Ensemble<'_, Lagrangians<'_, L, N>> {
    /// Performs the run of each member, and computes the value and the gradient of a loss of its end, with respect to the
    /// start of this member and the parameters, by the adjoint. Each member has a run of its own, distributed over the
    /// threads, and the gradient is that of [`Run::gradient`](crate::Run::gradient), bitwise, for any number of threads.
    /// Recorded rows and a checkpoint are ignored.
    ///
    /// ```
    /// use contact_examples::systems::Pendulum;
    /// use contact_geom::{Scalar, VelocityPoint};
    /// use discrete_herglotz::sensitivity::{EndState, Loss};
    /// use discrete_herglotz::{Ensemble, GaussCollocation, Steps, Until};
    /// struct Miss;
    /// impl Loss<1> for Miss {
    ///     fn value<T: Scalar>(&self, end: &EndState<1, T>) -> T {
    ///         (end.q[0] - 0.5).powi(2)
    ///     }
    /// }
    /// let pendulum = Pendulum { gamma: -0.01 };
    /// let start = |i: usize| VelocityPoint::new([0.01 * i as f64], [0.5], 0.0);
    /// let ensemble = Ensemble::new(&pendulum, 0.0, 100, start).by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.5));
    /// let batch = ensemble.gradient(&Miss, Until::Time(10.0))?;
    /// if let Some((loss, parameters)) = batch.total() {
    ///     println!("{loss}, in gamma {}", parameters[0]);
    /// }
    /// for member in batch.members.iter().flatten() {
    ///     if let Some((_, gradient)) = &member.loss {
    ///         println!("in its v0 {}", gradient.rate[0]);
    ///     }
    /// }
    /// # Ok::<(), discrete_herglotz::ensemble::EnsembleError>(())
    /// ```
    ///
    /// # Errors
    /// [`EnsembleError::Empty`], [`EnsembleError::Threads`], and [`EnsembleError::Member`] if there is no integrator or no
    /// step. Errors of a run are those of its member.
    pub fn gradient(&self, loss: &(impl Loss<N> + Sync), until: Until) -> Result<BatchGradient, EnsembleError> {
        self.gradient_of(|_, end| end.differentiate(loss), until)
    }

    /// The same for a loss that is given as a function with its partial derivatives in the end state: of the index of the
    /// member and its end.
    ///
    /// # Errors
    /// Those of [`gradient`](Self::gradient).
    pub fn gradient_of(
        &self,
        loss: impl Fn(usize, &MotionState) -> (f64, EndCovector) + Sync,
        until: Until,
    ) -> Result<BatchGradient, EnsembleError> {
        self.each_run(|index, run| run.gradient_of(|end| loss(index, end), until))
            .map(|members| BatchGradient { members })
    }

    /// The same for a loss of the states of each member at these times, as in
    /// [`Run::gradient_at`](crate::Run::gradient_at): a function of the index of the member and its states, with the
    /// partial derivatives in each of them.
    ///
    /// # Errors
    /// Those of [`gradient`](Self::gradient).
    pub fn gradient_at(
        &self,
        times: &[f64],
        loss: impl Fn(usize, &[MotionState]) -> (f64, Vec<EndCovector>) + Sync,
        until: Until,
    ) -> Result<BatchGradient, EnsembleError> {
        self.each_run(|index, run| run.gradient_at(times, |states| loss(index, states), until))
            .map(|members| BatchGradient { members })
    }

    /// The states of each member at these times and at its end, with their derivatives in variables, as
    /// [`Run::tangent_at`](crate::Run::tangent_at) has them; in the order of the members.
    ///
    /// # Errors
    /// Those of [`gradient`](Self::gradient).
    pub fn tangent_at(
        &self,
        variables: &[Variable],
        times: &[f64],
        until: Until,
    ) -> Result<Vec<Result<Tangent, SensitivityError>>, EnsembleError> {
        self.each_run(|_, run| run.tangent_at(variables, times, until))
    }

    /// Calls a function with the run of each member, on several threads, and returns the results in the order of the
    /// members.
    fn each_run<R: Send>(
        &self,
        work: impl for<'p, 'o> Fn(usize, Run<'p, 'o, Problem<'p, L, N>>) -> Result<R, SensitivityError> + Sync,
    ) -> Result<Vec<Result<R, SensitivityError>>, EnsembleError> {
        let (count, threads) = (self.settings.count, self.settings.some_threads()?);
        if count == 0 {
            return Err(EnsembleError::Empty);
        }
        let (members, interrupt) = (&self.members, self.settings.interrupt);
        members.method().map_err(|cause| EnsembleError::Member { index: 0, cause })?;
        let member = |index: usize| {
            let mut asking = interrupt.map(Interruption);
            members.with(index, (MemberSteps::Own, interrupt), |run| match &mut asking {
                Some(asking) => work(index, run.observe(asking)),
                None => work(index, run),
            })
        };
        let size = (count / (SHARDS_PER_THREAD * threads)).clamp(1, MAX_MEMBERS_PER_SHARD);
        let shards = count.div_ceil(size);
        let mut results = Vec::with_capacity(count);
        shards::in_order(
            threads,
            shards,
            |shard| (shard * size..count.min((shard + 1) * size)).map(member).collect::<Vec<_>>(),
            |shard| {
                results.extend(shard);
                self.settings.report_progress(results.len().div_ceil(size), shards);
                ControlFlow::Continue(())
            },
        );
        Ok(results)
    }
}
