//! Plans of motions of rigid bodies.

use super::run::Prepared;
use super::{Body, BodyMotion};
use crate::{OutputTimes, Plan, RuntimeError, StepControl};
use discrete_herglotz::{AnyIntegrator, MethodInfo, PlanEntry, SplittingScheme};

/// The properties of an integrator of rigid bodies.
fn info(by: AnyIntegrator) -> MethodInfo {
    let general = MethodInfo { symmetric: true, ..MethodInfo::of_discrete::<3>(by.to_string(), by.order()) };
    let of_splitting = |scheme: SplittingScheme| MethodInfo {
        explicit: true,
        exact_rate: true,
        substeps: scheme.stages() > 1,
        cost_per_evaluation: 1,
        source: scheme.source().into(),
        ..general.clone()
    };
    match by {
        AnyIntegrator::Gauss { stages } => MethodInfo {
            collocation: Some(stages),
            cost_per_evaluation: 1,
            source: "Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), II.1.3, \
                     doi:10.1007/3-540-30666-8"
                .into(),
            ..general
        },
        AnyIntegrator::Splitting(scheme) => of_splitting(scheme),
        _ => of_splitting(SplittingScheme::STRANG),
    }
}

impl Body {
    /// The plan of a motion: its integrator and steps, what is computed and what is skipped. For an accuracy the steps
    /// are found by trial runs, as in the run itself.
    ///
    /// ```
    /// use herglotz_runtime::{Body, BodyMotion, StepControl};
    /// let body = Body { inertia: Body::principal([1.0, 2.0, 3.0]), gamma: -0.1, ..Body::default() };
    /// let accuracy = StepControl::Accuracy { error: 1e-9, by: None };
    /// let plan = body.plan(&BodyMotion::new([1.0, 0.0, 0.0, 0.0], [1.0, 0.5, 1.0 / 3.0], 10.0, accuracy))?;
    /// assert!(plan.integrator.order == 10 && plan.error.is_some_and(|error| error <= 1e-9));
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`run`](Self::run), except for the times of rows.
    pub fn plan(&self, motion: &BodyMotion) -> Result<Plan, RuntimeError> {
        let Prepared { by, steps, step_size, error_estimate, .. } = self.prepare(motion)?;
        let (integrator, items) = (info(by), self.entries(motion, by));
        let mut text =
            format!("{steps} steps of {step_size} by {}, t = {} .. {}\n", integrator.name, motion.t, motion.end);
        for (title, computed) in [("computed", true), ("skipped", false)] {
            text += &format!("{title}:\n");
            for entry in items.iter().filter(|entry| entry.computed == computed) {
                text += &format!("  {}: {}\n", entry.what, entry.why);
            }
        }
        Ok(Plan { text, integrator, step_size, steps, error: error_estimate, items })
    }

    /// What a run computes and skips.
    fn entries(&self, motion: &BodyMotion, by: AnyIntegrator) -> Vec<PlanEntry> {
        let steps = match by {
            AnyIntegrator::Gauss { .. } => {
                "by collocation in the chart of the exponential map that is centred at the start of each step; its \
                 equations are solved by iteration"
            }
            _ => {
                "by the flows of the nearest symmetric body, of the rest of the kinetic energy, of gravity and of the \
                 drag, each in closed form"
            }
        };
        let mut entries = vec![PlanEntry::computed("attitude and momentum", steps)];
        entries.push(PlanEntry::computed("action z", "each step gives it with the momentum"));
        let what = "gravity";
        entries.push(if self.mass == 0.0 || self.gravity == [0.0; 3] {
            PlanEntry::skipped(what, "it does not act")
        } else {
            PlanEntry::computed(what, "the torque of m g at the centre of mass")
        });
        let what = "drag";
        entries.push(if self.gamma == 0.0 {
            PlanEntry::skipped(what, "gamma = 0, so that sigma_d = 1")
        } else {
            PlanEntry::computed(what, format!("gamma = {}; sigma_d is the same in every step", self.gamma))
        });
        let what = "torque";
        entries.push(match &self.torque {
            None => PlanEntry::skipped(what, "none is given"),
            Some(torque) => {
                PlanEntry::computed(what, format!("{} in the body; steps are not contact", torque.text().join(", ")))
            }
        });
        let what = "trial runs";
        entries.push(match motion.step_control {
            StepControl::Accuracy { error, .. } => PlanEntry::computed(
                what,
                format!(
                    "the number of steps is doubled until two runs agree to the accuracy {error:e} at the end, and two \
                     more with other roundings show how these grow"
                ),
            ),
            StepControl::Steps { .. } => PlanEntry::skipped(what, "the steps are given; their error is not estimated"),
        });
        let what = "rows";
        entries.push(match &motion.rows {
            None => PlanEntry::skipped(what, "not requested"),
            Some(OutputTimes::Every(every)) => PlanEntry::computed(
                what,
                format!("at the start, at the ends of steps whose number is a multiple of {every}, and at the end"),
            ),
            Some(OutputTimes::At(times)) => PlanEntry::computed(
                what,
                format!("at {} times; a state within a step is computed by a shorter step", times.len()),
            ),
        });
        let what = "events";
        entries.push(match motion.events.len() {
            0 => PlanEntry::skipped(what, "not requested"),
            count => PlanEntry::computed(
                what,
                format!(
                    "{count} {}, evaluated at least four times in a step; sign changes are located by shorter steps",
                    if count == 1 { "function" } else { "functions" }
                ),
            ),
        });
        entries
    }
}
