//! The stages of a splitting scheme: kicks, each with the drift that follows.

use crate::drag::Drag;
use discrete_herglotz::SplittingScheme;
use discrete_herglotz::support::Drift;

/// A kick and the drift that follows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    pub kick: f64,
    pub drift: Drift,
    /// The length of the drift in time.
    pub span: f64,
    /// The time of the kick, relative to the start of the step.
    pub time: f64,
}

impl Stage {
    /// The stage in a step that starts at the time t. With a time-dependent drag the drift differs from step to step.
    pub fn at(&self, drag: &Drag, t: f64) -> Self {
        match drag {
            Drag::Constant(_) => *self,
            Drag::Timed(_) => Stage { drift: drag.drift(t + self.time, self.span), ..*self },
        }
    }

    /// The action after the stage, from the action before it and the energies of the blocks: the potential energy of
    /// each, and twice its kinetic energy.
    pub fn action_after(&self, z: f64, energies: &[[f64; 2]]) -> f64 {
        let (potential, twice_kinetic) = energies.iter().fold((0.0, 0.0), |(v, k), e| (v + e[0], k + e[1]));
        let kicked = z - self.kick * potential;
        kicked + (self.drift.damping * kicked + self.drift.lift * twice_kinetic)
    }
}

/// The stages of a step.
pub(crate) struct StageTable {
    pub first: Vec<Stage>,
    /// The stages of a later step, whose first kick or drift is merged with the last of the step before.
    pub merged: Vec<Stage>,
    /// The last kick and drift, which complete a step after which no other is merged.
    pub closing: Stage,
}

impl StageTable {
    pub fn new(scheme: &SplittingScheme, drag: &Drag, h: f64, t0: f64) -> Self {
        let (drifts, kicks) = scheme.coefficients();
        let stages = scheme.stages();
        let stage = |kick: f64, span: f64, time: f64| {
            let span = span * h;
            Stage { kick: kick * h, drift: drag.drift(t0 + time, span), span, time }
        };
        let mut time = 0.0;
        let first: Vec<Stage> = (0..stages)
            .map(|i| {
                let stage = stage(kicks[i], drifts[i], time * h);
                time += drifts[i];
                stage
            })
            .collect();
        // Only a scheme that begins with a drift ends with one.
        let (last_kick, last_drift) = (kicks[stages], drifts.get(stages).copied().unwrap_or(0.0));
        let mut merged = first.clone();
        // The merged kick precedes the last drift of the step before.
        merged[0] = stage(last_kick + kicks[0], last_drift + drifts[0], -last_drift * h);
        StageTable {
            first,
            merged,
            closing: stage(last_kick, last_drift, if last_drift == 0.0 { h } else { time * h }),
        }
    }
}
