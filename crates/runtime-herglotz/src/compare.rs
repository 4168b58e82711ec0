//! Run time against error on a motion, for all integrators that apply.

use crate::{FirstOrder, Interrupt, Motion, Outcome, Peer, PeerEnd, RunMonitor, RuntimeError, StepControl, System};
use contact_geom::max_abs_or_nan;
use discrete_herglotz::{AnyIntegrator, InputError, Steps};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// The errors that are asked of the reference, until one is had.
const REFERENCES: [f64; 5] = [1e-13, 1e-12, 1e-10, 1e-8, 1e-6];

/// The time for all integrators together, in which each has an equal part: so that a comparison is short where its motion is.
const BUDGET: Duration = Duration::from_millis(2000);

/// The part of an integrator is at least so many times what the reference takes by half its steps: of a long motion enough to be compared.
const OF_REFERENCE: u32 = 4;

/// The runs of each integrator that do not depend on the time they take, so that each is seen; the first ones are short.
const LEAST: usize = 6;

/// A run is repeated for so long, and so often, for the least time.
const REPEATED: Duration = Duration::from_millis(2);
const REPETITIONS: usize = 5;

/// The halvings of the step of an integrator.
const HALVINGS: u32 = 20;

/// The tolerances of a peer: a tenth, a hundredth, and so on.
const TOLERANCES: u32 = 14;

/// A peer has as many parts of the time: there are few of them, and each is drawn.
const OF_PEER: u32 = 8;

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
    /// The error of (q, p) at the end, relative to its size there, and not less than that of the reference.
    pub error: f64,
    /// The seconds that it took with all checks of a run, the least of a few.
    pub seconds: f64,
}

/// Run time against error.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// All runs, by integrator and falling step.
    pub rows: Vec<Work>,
    /// The runs of peers, by falling tolerance; their step is the mean one.
    pub peers: Vec<Work>,
    /// How the reference was computed.
    pub reference: String,
    /// The error of the reference: its distance from a run by half as many steps.
    pub reference_error: f64,
    /// Integrators that do not apply, and why; not those by a clock, which no formula states.
    pub left_out: Vec<(String, String)>,
    /// Whether it was ended before all integrators were tried.
    pub ended: bool,
}

impl Comparison {
    /// The fastest run with at most this error, of the library.
    pub fn best(&self, error: f64) -> Option<&Work> {
        fastest(&self.rows, error)
    }

    /// The fastest run with at most this error, of the peers.
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

/// Ends a run that is to be interrupted.
struct Asking<'i>(Option<&'i Interrupt>);

impl RunMonitor for Asking<'_> {
    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        if self.0.is_some_and(Interrupt::is_wanted) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl System {
    /// Runs a motion by all integrators that apply, with steps from long to short, and measures time and error of each. Of `motion` the start
    /// and the end are taken. `progress` is told the part that is done; `false` ends it there. Steps are halved until round-off, or until
    /// the integrator has used its part of two seconds, or four times what the reference takes. The peers are run to one tolerance after the other.
    ///
    /// # Errors
    /// Those of the reference, which is by contact Gauss collocation with 16 stages.
    pub fn compare(
        &self,
        motion: &Motion,
        peers: &[&dyn Peer],
        progress: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Comparison, RuntimeError> {
        let bare = |way: StepControl| Motion {
            action: false,
            interrupt: motion.interrupt.clone(),
            ..Motion::new(motion.start.clone(), motion.end, way)
        };
        let by = AnyIntegrator::Gauss { stages: 16 };
        let mut count = Err(RuntimeError::from(InputError::NoSteps));
        for wanted in REFERENCES {
            let plan = self.plan(&bare(StepControl::Accuracy { wanted, by: Some(by) }));
            let refused = matches!(plan, Err(RuntimeError::Input(InputError::Accuracy { .. })));
            count = plan.map(|plan| plan.steps);
            if !refused {
                break;
            }
        }
        let (count, span) = (count?, motion.end - motion.start.t);
        let run = |by: AnyIntegrator, count: usize| {
            self.run(
                &bare(StepControl::Steps { by, steps: Steps::Count(count) }),
                &mut Asking(motion.interrupt.as_ref()),
            )
        };
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
        let part = (BUDGET / ((applicable + peers.len()) as u32).max(1)).max(OF_REFERENCE * begin.elapsed());
        for (i, by) in all.iter().copied().enumerate() {
            if !progress(i as f64 / all.len() as f64) {
                comparison.ended = true;
                return Ok(comparison);
            }
            // No formula states a clock.
            if let AnyIntegrator::TransformedGauss { .. } = by {
                continue;
            }
            if let Err(why) = self.check_integrator(by) {
                comparison.left_out.push((by.to_string(), RuntimeError::from(why).to_string()));
                continue;
            }
            // So long that the reference would need as many evaluations.
            let first = count.div_ceil(8).max(1);
            let run = |halving: u32| {
                let outcome = run(by, first.checked_shl(halving)?).ok().filter(|outcome| outcome.t == reference.t)?;
                Some(Done { steps: outcome.steps, evaluations: outcome.evaluations, end: (outcome.q, outcome.p) })
            };
            let error = |(q, p): &(Vec<f64>, Vec<f64>)| Some(apart((q, p), &reference));
            let measure = Measure { span, part, reference_error, of: (&by.to_string(), by.order()) };
            comparison.rows.extend(work_of(&measure, HALVINGS, &run, &error, LEAST));
        }
        let first_order = if peers.is_empty() { None } else { Some(FirstOrder::new(self, motion, &reference)?) };
        for (peer, motion) in peers.iter().zip(first_order.iter().cycle()) {
            let run = |k: u32| {
                let PeerEnd { state, steps, evaluations } = peer.run(motion, 10f64.powi(-(k as i32) - 1))?;
                Some(Done { end: state, steps, evaluations })
            };
            let error = |state: &Vec<f64>| motion.end_of(self, state).map(|(q, p)| apart((&q, &p), &reference));
            let measure = Measure { span, part: OF_PEER * part, reference_error, of: (peer.name(), peer.order()) };
            // It may give up late.
            comparison.peers.extend(work_of(&measure, TOLERANCES, &run, &error, 1));
        }
        progress(1.0);
        Ok(comparison)
    }
}

/// The end of a run, with what it took.
struct Done<E> {
    end: E,
    steps: usize,
    evaluations: u64,
}

/// What a run is measured against.
struct Measure<'m> {
    /// The span of time, by which a mean step is told.
    span: f64,
    /// What all runs together may take.
    part: Duration,
    /// The error of the reference.
    reference_error: f64,
    /// The name and the order of what is measured.
    of: (&'m str, u32),
}

/// The runs of one integrator, each about twice as long as the one before, and what they give. `run` is timed; `None` is a run that does not end
/// where it should. `error` is that of an end. So many runs do not depend on the time that they take.
fn work_of<E>(
    by: &Measure<'_>,
    runs: u32,
    run: &dyn Fn(u32) -> Option<Done<E>>,
    error: &dyn Fn(&E) -> Option<f64>,
    least_runs: usize,
) -> Vec<Work> {
    let mut found = Vec::new();
    let (mut least, mut worse, beginning) = (f64::INFINITY, 0, Instant::now());
    for k in 0..runs {
        let begin = Instant::now();
        let done = run(k);
        let mut seconds = begin.elapsed();
        let with_error = done.and_then(|done| Some((error(&done.end)?, done)));
        if let Some((error, done)) = with_error {
            let error = max_abs_or_nan([error, by.reference_error]);
            let mut spent = seconds;
            for _ in 1..REPETITIONS {
                if spent > REPEATED {
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
                    step_size: by.span / done.steps.max(1) as f64,
                    steps: done.steps,
                    evaluations: done.evaluations,
                    error,
                    seconds: seconds.as_secs_f64(),
                });
            }
            // Round-off: halving the step does not better it.
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
