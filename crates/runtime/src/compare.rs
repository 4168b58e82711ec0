//! Work-precision comparison (run time against error) of all integrators that apply to a motion.

use crate::{FirstOrder, Interrupt, Motion, Outcome, Peer, PeerEnd, RunMonitor, RuntimeError, StepControl, System};
use contact_geom::numbers::max_abs_or_nan;
use discrete_herglotz::{AnyIntegrator, InputError, Steps};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Accuracies requested of the reference, tried in this order until one is accepted.
const REFERENCES: [f64; 5] = [1e-13, 1e-12, 1e-10, 1e-8, 1e-6];

/// The number of stages that stands for the contact Lobatto method of the highest order, 14.
const MOST_STAGES_WITH_CONSTRAINTS: usize = 7;

/// Time budget of all integrators together, shared equally, so that the comparison of a short motion is short.
const BUDGET: Duration = Duration::from_millis(2000);

/// The share of an integrator is at least this multiple of the run time of the reference with half its steps, so that
/// long motions get enough time for a comparison.
const REFERENCE_TIMES: u32 = 4;

/// The number of runs of each integrator that are made regardless of their run time, so that every integrator appears;
/// the first runs have few steps.
const MIN_RUNS: usize = 6;

/// A run is repeated until this time is reached, which is long compared with the resolution of the clock; the smallest
/// time counts.
const MAX_REPETITION_TIME: Duration = Duration::from_millis(2);

/// The maximal number of runs for one time.
const MAX_REPETITIONS: usize = 5;

/// The maximal number of step sizes of an integrator, each half the one before: from the longest to a millionth of it.
const MAX_HALVINGS: u32 = 20;

/// The number of tolerances of a peer: 0.1, 0.01, and so on to 1e-14, some tens of units of round-off.
const PEER_TOLERANCES: u32 = 14;

/// A peer has this multiple of the share of an integrator: there are few peers, and the plot shows each of them.
const PEER_SHARE: u32 = 8;

/// One run of a [`Comparison`].
#[derive(Clone, Debug, PartialEq)]
pub struct Work {
    /// The integrator.
    pub integrator: String,
    /// Its order.
    pub order: u32,
    /// The step.
    pub step_size: f64,
    /// The number of steps.
    pub steps: usize,
    /// The evaluations of forces or gradients.
    pub evaluations: u64,
    /// The error of (q, p) at the end, relative to its size there, and not less than the error of the reference.
    pub error: f64,
    /// The run time in seconds, including all checks of a run: the smallest of a few repetitions.
    pub seconds: f64,
}

/// Run time against error.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// All runs, sorted by integrator and decreasing step.
    pub rows: Vec<Work>,
    /// The runs of peers, by decreasing tolerance; their step is the mean one.
    pub peers: Vec<Work>,
    /// How the reference was computed.
    pub reference: String,
    /// The error of the reference: its distance from a run with half as many steps.
    pub reference_error: f64,
    /// Integrators and peers that do not apply, with the reason. Integrators in transformed time are omitted, since no formula
    /// has a time transformation.
    pub left_out: Vec<(String, String)>,
    /// Whether the comparison was ended before all integrators were tried.
    pub ended: bool,
}

impl Comparison {
    /// The fastest run of the library with at most this error.
    pub fn best(&self, error: f64) -> Option<&Work> {
        fastest(&self.rows, error)
    }

    /// The fastest run of a peer with at most this error.
    pub fn best_of_peers(&self, error: f64) -> Option<&Work> {
        fastest(&self.peers, error)
    }
}

fn fastest(rows: &[Work], error: f64) -> Option<&Work> {
    rows.iter().filter(|row| row.error <= error).min_by(|a, b| a.seconds.total_cmp(&b.seconds))
}

/// The distance of the ends of two runs in (q, p), relative to the size of the second.
fn apart((q, p): (&[f64], &[f64]), b: &Outcome) -> f64 {
    let pairs = || q.iter().chain(p).zip(b.q.iter().chain(&b.p));
    let square = pairs().map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let size = pairs().map(|(_, b)| b.powi(2)).sum::<f64>();
    if square == 0.0 { 0.0 } else { (square / size).sqrt() }
}

/// Ends a run when its interrupt is set.
struct UntilInterrupted<'i>(Option<&'i Interrupt>);

impl RunMonitor for UntilInterrupted<'_> {
    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        if self.0.is_some_and(Interrupt::is_wanted) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl System {
    /// Runs a motion with all integrators that apply, with steps from long to short, and measures run time and error of
    /// each; a [method](Motion::method) of the motion is measured beside them. Only the start and the end are used otherwise. `progress` is called with the completed fraction; the
    /// comparison ends where it returns `false`. Steps are halved until round-off dominates, or until the integrator
    /// has used its share of two seconds or four times the run time of the reference with half its steps, whichever is
    /// longer. The peers are run with a decreasing sequence of tolerances.
    ///
    /// # Errors
    /// Those of the reference, which is contact Gauss collocation with 16 stages, or, under constraints, a contact Lobatto method
    /// of order 14.
    pub fn compare(
        &self,
        motion: &Motion,
        peers: &[&dyn Peer],
        progress: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Comparison, RuntimeError> {
        if cfg!(target_family = "wasm") {
            // There is no clock.
            return Err(RuntimeError::NotCompiled { what: "measured run times" });
        }
        let is_held = self.formula().constraints() > 0;
        let without_output = |step_control: StepControl| Motion {
            action: false,
            project: motion.project,
            interrupt: motion.interrupt.clone(),
            ..Motion::new(motion.start.clone(), motion.end, step_control)
        };
        // With constraints it stands for the contact Lobatto method of the same order.
        let by = AnyIntegrator::Gauss { stages: if is_held { MOST_STAGES_WITH_CONSTRAINTS } else { 16 } };
        let mut count = Err(RuntimeError::from(InputError::NoSteps));
        for error in REFERENCES {
            let plan = self.plan(&without_output(StepControl::Accuracy { error, by: Some(by) }));
            let refused = matches!(plan, Err(RuntimeError::Input(InputError::Accuracy { .. })));
            count = plan.map(|plan| plan.steps);
            if !refused {
                break;
            }
        }
        let (count, span) = (count?, motion.end - motion.start.t);
        let steps =
            |by: AnyIntegrator, count: usize| without_output(StepControl::Steps { by, steps: Steps::Count(count) });
        let run_of = |motion: &Motion| self.run(motion, &mut UntilInterrupted(motion.interrupt.as_ref()));
        let run = |by: AnyIntegrator, count: usize| run_of(&steps(by, count));
        let (coarse, reference) = (run(by, count)?, run(by, 2 * count)?);
        let reference_error = apart((&coarse.q, &coarse.p), &reference);
        let mut comparison = Comparison {
            rows: Vec::new(),
            peers: Vec::new(),
            reference: format!("{by} in {} steps", 2 * count),
            reference_error,
            left_out: Vec::new(),
            ended: false,
        };
        let all = AnyIntegrator::all();
        let begin = Instant::now();
        run(by, count)?;
        let applicable = all.iter().filter(|by| self.check_integrator(**by).is_ok()).count();
        let part = (BUDGET / ((applicable + peers.len()) as u32).max(1)).max(REFERENCE_TIMES * begin.elapsed());
        for (i, by) in all.iter().copied().enumerate() {
            if !progress(i as f64 / all.len() as f64) {
                comparison.ended = true;
                return Ok(comparison);
            }
            // Formulas have no time transformation.
            if let AnyIntegrator::TransformedGauss { .. } = by {
                continue;
            }
            if let Err(why) = self.check_integrator(by) {
                comparison.left_out.push((by.to_string(), RuntimeError::from(why).to_string()));
                continue;
            }
            // The longest step is eight times that of the coarser reference run.
            let first = count.div_ceil(8).max(1);
            let run = |halving: u32| {
                let outcome = run(by, first.checked_shl(halving)?).ok().filter(|outcome| outcome.t == reference.t)?;
                Some(FinishedRun {
                    steps: outcome.steps,
                    evaluations: outcome.evaluations,
                    end: (outcome.q, outcome.p),
                })
            };
            let error = |(q, p): &(Vec<f64>, Vec<f64>)| Some(apart((q, p), &reference));
            let measure = Measure { span, part, reference_error, of: (&by.to_string(), by.order()) };
            comparison.rows.extend(work_of(&measure, MAX_HALVINGS, &run, &error, MIN_RUNS));
        }
        if let Some(method) = &motion.method {
            let run = |halving: u32| {
                let own = Motion { method: Some(method.clone()), ..steps(by, count.checked_shl(halving)?) };
                let Outcome { t, q, p, steps, evaluations, .. } = run_of(&own).ok()?;
                (t == reference.t).then_some(FinishedRun { steps, evaluations, end: (q, p) })
            };
            let error = |(q, p): &(Vec<f64>, Vec<f64>)| Some(apart((q, p), &reference));
            let measure = Measure { span, part, reference_error, of: (method.name(), method.order()) };
            comparison.rows.extend(work_of(&measure, MAX_HALVINGS, &run, &error, MIN_RUNS));
        }
        // A first-order system has no resets.
        let peers = if self.formula().resets() > 0 || self.formula().is_hamiltonian() || is_held {
            let why = match self.formula().is_hamiltonian() {
                true => "it has the equations of a Lagrangian only",
                false if is_held => "it has no constraints",
                false => "it performs no resets",
            };
            let why = why.to_owned();
            comparison.left_out.extend(peers.iter().map(|peer| (peer.name().to_owned(), why.clone())));
            &[]
        } else {
            peers
        };
        let first_order = if peers.is_empty() { None } else { Some(FirstOrder::new(self, motion, &reference)?) };
        for (peer, motion) in peers.iter().zip(first_order.iter().cycle()) {
            let run = |k: u32| {
                let PeerEnd { state, steps, evaluations } = peer.run(motion, 10f64.powi(-(k as i32) - 1))?;
                Some(FinishedRun { end: state, steps, evaluations })
            };
            let error = |state: &Vec<f64>| motion.end_of(self, state).map(|(q, p)| apart((&q, &p), &reference));
            let measure = Measure { span, part: PEER_SHARE * part, reference_error, of: (peer.name(), peer.order()) };
            // A peer may fail only after a long time.
            comparison.peers.extend(work_of(&measure, PEER_TOLERANCES, &run, &error, 1));
        }
        progress(1.0);
        Ok(comparison)
    }
}

/// The end of a run, with the work it took.
struct FinishedRun<E> {
    end: E,
    steps: usize,
    evaluations: u64,
}

/// Data of a measurement that all runs of one integrator share.
struct Measure<'m> {
    /// The time span, from which the mean step follows.
    span: f64,
    /// The time that all runs together may take.
    part: Duration,
    /// The error of the reference.
    reference_error: f64,
    /// The name and the order of the integrator that is measured.
    of: (&'m str, u32),
}

/// The runs of one integrator, each about twice as long as the one before, with their errors. `run` is timed; it
/// returns `None` for a run that does not reach the end. `error` is the error of a final state. The first `least_runs`
/// runs are made regardless of their run time.
fn work_of<E>(
    by: &Measure<'_>,
    runs: u32,
    run: &dyn Fn(u32) -> Option<FinishedRun<E>>,
    error: &dyn Fn(&E) -> Option<f64>,
    least_runs: usize,
) -> Vec<Work> {
    let mut found = Vec::new();
    let (mut least, mut worse, beginning) = (f64::INFINITY, 0, Instant::now());
    for k in 0..runs {
        let begin = Instant::now();
        let finished = run(k);
        let mut seconds = begin.elapsed();
        let with_error = finished.and_then(|finished| Some((error(&finished.end)?, finished)));
        if let Some((error, finished)) = with_error {
            let error = max_abs_or_nan([error, by.reference_error]);
            let mut spent = seconds;
            for _ in 1..MAX_REPETITIONS {
                if spent > MAX_REPETITION_TIME {
                    break;
                }
                let begin = Instant::now();
                let _ = run(k);
                spent += begin.elapsed();
                seconds = seconds.min(begin.elapsed());
            }
            if error < 1.0 {
                found.push(Work {
                    integrator: by.of.0.to_owned(),
                    order: by.of.1,
                    step_size: by.span / finished.steps.max(1) as f64,
                    steps: finished.steps,
                    evaluations: finished.evaluations,
                    error,
                    seconds: seconds.as_secs_f64(),
                });
            }
            // Halving the step no longer reduces the error: round-off dominates.
            worse = if error > 0.5 * least { worse + 1 } else { 0 };
            least = least.min(error);
            if error <= by.reference_error || worse == 2 && least < 1e-9 {
                break;
            }
        }
        // The next run takes twice as long.
        if k as usize + 1 >= least_runs && beginning.elapsed() + 2 * seconds > by.part {
            break;
        }
    }
    found
}
