//! Run time against error on a motion, for all integrators that apply.

use crate::{Interrupt, Motion, Outcome, RuntimeError, System, Watch, Way};
use contact_geom::largest;
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
    /// The fastest run with at most this error.
    pub fn best(&self, error: f64) -> Option<&Work> {
        self.rows.iter().filter(|row| row.error <= error).min_by(|a, b| a.seconds.total_cmp(&b.seconds))
    }
}

/// The distance of the ends of two runs in (q, p), relative to the size of the second.
fn apart(a: &Outcome, b: &Outcome) -> f64 {
    let pairs = || a.q.iter().chain(&a.p).zip(b.q.iter().chain(&b.p));
    let square = pairs().map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let size = pairs().map(|(_, b)| b.powi(2)).sum::<f64>();
    if square == 0.0 { 0.0 } else { (square / size).sqrt() }
}

/// Ends a run that is to be interrupted.
struct Asking<'i>(Option<&'i Interrupt>);

impl Watch for Asking<'_> {
    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        if self.0.is_some_and(Interrupt::is_wanted) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl System {
    /// Runs a motion by all integrators that apply, with steps from long to short, and measures time and error of each. Of `motion` the start
    /// and the end are taken. `progress` is told the part that is done; `false` ends it there. Steps are halved until round-off, or until
    /// the integrator has used its part of two seconds, or four times what the reference takes.
    ///
    /// # Errors
    /// Those of the reference, which is by contact Gauss collocation with 16 stages.
    pub fn compare(&self, motion: &Motion, progress: &mut dyn FnMut(f64) -> bool) -> Result<Comparison, RuntimeError> {
        let bare = |way: Way| Motion {
            action: false,
            interrupt: motion.interrupt.clone(),
            ..Motion::new(motion.start.clone(), motion.end, way)
        };
        let by = AnyIntegrator::Gauss { stages: 16 };
        let mut count = Err(RuntimeError::from(InputError::NoSteps));
        for wanted in REFERENCES {
            let plan = self.plan(&bare(Way::Accuracy { wanted, by: Some(by) }));
            let refused = matches!(plan, Err(RuntimeError::Input(InputError::Accuracy { .. })));
            count = plan.map(|plan| plan.steps);
            if !refused {
                break;
            }
        }
        let (count, span) = (count?, motion.end - motion.start.t);
        let run = |by: AnyIntegrator, count: usize| {
            self.run(&bare(Way::Steps { by, steps: Steps::Count(count) }), &mut Asking(motion.interrupt.as_ref()))
        };
        let (coarse, reference) = (run(by, count)?, run(by, 2 * count)?);
        let reference_error = apart(&coarse, &reference);
        let mut comparison = Comparison {
            rows: Vec::new(),
            reference: format!("{by} in {} steps", 2 * count),
            reference_error,
            left_out: Vec::new(),
            ended: false,
        };
        let all = AnyIntegrator::all();
        let begin = Instant::now();
        run(by, count)?;
        let applicable = all.iter().filter(|by| self.check_integrator(**by).is_ok()).count();
        let part = (BUDGET / (applicable as u32).max(1)).max(OF_REFERENCE * begin.elapsed());
        for (i, by) in all.iter().copied().enumerate() {
            if !progress(i as f64 / all.len() as f64) {
                comparison.ended = true;
                return Ok(comparison);
            }
            // No formula states a clock.
            if let AnyIntegrator::Clocked { .. } = by {
                continue;
            }
            if let Err(why) = self.check_integrator(by) {
                comparison.left_out.push((by.to_string(), RuntimeError::from(why).to_string()));
                continue;
            }
            // So long that the reference would need as many evaluations.
            let first = count.div_ceil(8).max(1);
            work_of(by, (first, span, part), &run, &reference, &mut comparison);
        }
        progress(1.0);
        Ok(comparison)
    }
}

/// One integrator with steps from long to short.
fn work_of(
    by: AnyIntegrator,
    (first, span, part): (usize, f64, Duration),
    run: &dyn Fn(AnyIntegrator, usize) -> Result<Outcome, RuntimeError>,
    reference: &Outcome,
    to: &mut Comparison,
) {
    let (mut least, mut worse, beginning) = (f64::INFINITY, 0, Instant::now());
    for halving in 0..HALVINGS {
        let Some(count) = first.checked_shl(halving) else { break };
        let begin = Instant::now();
        let outcome = run(by, count);
        let mut seconds = begin.elapsed();
        let whole = outcome.ok().filter(|outcome| outcome.t == reference.t);
        if let Some(outcome) = whole {
            let error = largest([apart(&outcome, reference), to.reference_error]);
            let mut spent = seconds;
            for _ in 1..REPETITIONS {
                if spent > REPEATED {
                    break;
                }
                let begin = Instant::now();
                let _ = run(by, count);
                spent += begin.elapsed();
                seconds = seconds.min(begin.elapsed());
            }
            if error < 1.0 {
                to.rows.push(Work {
                    integrator: by.to_string(),
                    order: by.order(),
                    step_size: span / count as f64,
                    steps: outcome.steps,
                    evaluations: outcome.evaluations,
                    error,
                    seconds: seconds.as_secs_f64(),
                });
            }
            // Round-off: halving the step does not better it.
            worse = if error > 0.5 * least { worse + 1 } else { 0 };
            least = least.min(error);
            if error <= to.reference_error || worse == 2 && least < 1e-9 {
                break;
            }
        }
        // The next run takes twice as long.
        if halving as usize + 1 >= LEAST && beginning.elapsed() + 2 * seconds > part {
            break;
        }
    }
}
