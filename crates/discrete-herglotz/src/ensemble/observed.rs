//! Ensembles with an observer for each member.

use crate::ensemble::builder::Ensemble;
use crate::ensemble::error::EnsembleError;
use crate::ensemble::member::{Member, Tally};
use crate::ensemble::members::Members;
use crate::ensemble::settings::Settings;
use crate::ensemble::shards;
use crate::ensemble::task::Task;
use crate::{InputError, Observer, Until};
use std::ops::ControlFlow;

/// The number of members that are computed and handed on together: fewer than in lanes, since a member with an observer
/// takes longer.
const MEMBERS_PER_OBSERVED_SHARD: usize = 16;

/// An [`Ensemble`] with an observer for each member, created by [`Ensemble::observe`].
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{Event, Events, Problem, SplittingScheme, Steps, Until};
///
/// let pendulum = Pendulum { gamma: -0.01 };
/// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([0.5], [0.0], 0.0))?;
/// let ensemble = problem.ensemble(10, |i| VelocityPoint::new([0.1 + 0.1 * i as f64], [0.0], 0.0));
/// let ensemble = ensemble.by(SplittingScheme::BLANES_MOAN_6).steps(Steps::Size(0.25));
/// // The times at which each pendulum hangs down.
/// let downward = |_: usize| Ok(Events::new([Event::new(|_, x| x.q[0])]));
/// let times = |events: Events<'_>| events.crossings.iter().map(|crossing| crossing.t).collect::<Vec<f64>>();
/// ensemble.observe(downward, times).run(Until::Time(10.0), |member, times| println!("{}: {times:?}", member.index))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ObservedEnsemble<'a, M, F, T> {
    of: Ensemble<'a, M>,
    observer: F,
    extract: T,
}

impl<'a, M: Members> Ensemble<'a, M> {
    /// Adds an [`Observer`] for each member, a function of its index. `extract` returns a result from the observer at
    /// the end of the run, which is passed to the fold; the observer itself stays on the thread of the run.
    ///
    /// Each member has a run of its own, distributed over the threads, since observers may request quantities of a run
    /// (the velocity, the energy, the last step with dense output) that lanes do not have. To record states after a
    /// number of steps in lanes, use [`rows_every`](Self::rows_every).
    pub fn observe<O: Observer, S: Send, F, T>(self, observer: F, extract: T) -> ObservedEnsemble<'a, M, F, T>
    where
        F: Fn(usize) -> Result<O, InputError> + Sync,
        T: Fn(O) -> S + Sync,
    {
        ObservedEnsemble { of: self, observer, extract }
    }
}

impl<M: Members, F, T> ObservedEnsemble<'_, M, F, T> {
    /// Runs the ensemble, and calls the fold with each completed member and the result of its observer, in the order of
    /// the index, on this thread. The result is `None` if the member could not start.
    ///
    /// # Errors
    /// Those of [`Ensemble::run`]; [`EnsembleError::Observed`] with a checkpoint. If an observer refuses the run of its
    /// member, the fold is called with the cause.
    pub fn run<O: Observer, S: Send>(
        &self,
        until: Until,
        mut fold: impl FnMut(&Member, Option<S>),
    ) -> Result<Tally, EnsembleError>
    where
        F: Fn(usize) -> Result<O, InputError> + Sync,
        T: Fn(O) -> S + Sync,
    {
        if self.of.settings.checkpoint.is_some() {
            return Err(EnsembleError::Observed);
        }
        let settings = &self.of.settings;
        let (threads, task) = (settings.some_threads()?, self.of.task(until, true)?);
        Ok(run_observed(&task, (settings, threads), &self.observer, &self.extract, &mut fold))
    }
}

/// Runs the members with their observers: for each kind of observer compiled once.
fn run_observed<O: Observer, S: Send>(
    task: &Task<'_>,
    (settings, threads): (&Settings<'_>, usize),
    observer: &(dyn Fn(usize) -> Result<O, InputError> + Sync),
    extract: &(dyn Fn(O) -> S + Sync),
    fold: &mut dyn FnMut(&Member, Option<S>),
) -> Tally {
    let count = settings.count;
    let shards = count.div_ceil(MEMBERS_PER_OBSERVED_SHARD);
    let work = |shard: usize| -> Vec<(Member, Option<S>)> {
        let range = shard * MEMBERS_PER_OBSERVED_SHARD..count.min((shard + 1) * MEMBERS_PER_OBSERVED_SHARD);
        let member = |index: usize| match observer(index) {
            Err(cause) => (Member { index, ending: Err(cause), rows: Vec::new() }, None),
            Ok(mut observer) => {
                let member = task.run_single(index, Some(&mut observer));
                let result = member.ending.is_ok().then(|| extract(observer));
                (member, result)
            }
        };
        range.map(member).collect()
    };
    let (mut tally, mut done) = (Tally::default(), 0);
    shards::in_order(threads, shards, work, |members| {
        for (member, result) in members {
            tally.add(&member);
            tally.own_plans += task.own_plans(1);
            fold(&member, result);
        }
        done += 1;
        settings.report_progress(done, shards);
        ControlFlow::Continue(())
    });
    tally
}
