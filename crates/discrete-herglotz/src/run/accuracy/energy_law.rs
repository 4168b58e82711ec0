//! Trial runs of which some steps are sampled, since the law of the energy shows what the others may miss.

use crate::integration::SystemProblem;
use crate::resolution::thresholds::{ENERGY_ROUNDINGS, MIN_COMPARED_DEFECT, MIN_SAMPLE_POINTS};
use crate::run::accuracy::comparison_grid::ComparisonGrid;
use crate::run::accuracy::track::Track;
use crate::run::accuracy::trial_runs::TrialRuns;
use crate::{InputError, Point, Vector};
use contact_geom::numbers::max_or_nan;

impl TrialRuns<'_, '_> {
    /// Whether one of some steps is sampled: the nodes of a smooth motion lie densely, so that the samples only show how fast
    /// the defect falls, and are taken at the same times in all runs. A jump of L that no node shows, in a region too narrow
    /// for them, is seen by the energy, which is known.
    pub(super) fn samples_few_steps(&self, nodes: usize) -> Result<bool, InputError> {
        let SystemProblem { system, structure, t0, start, .. } = &self.request.problem;
        let hints = system.hints();
        // A force at rest may be one at another velocity.
        let moving = Point { v: start.v.map(|v| v + 1.0), ..start.clone() };
        let is_free = || !hints.forced || system.applied_force(*t0, &moving).iter().all(|force| *force == 0.0);
        let has_law = structure.autonomous && structure.has_constant_rate();
        let all = self.samples_all_steps || self.tests_transformation || nodes < MIN_SAMPLE_POINTS / 2;
        Ok(!all && !hints.hamiltonian && has_law && self.is_smooth()? && is_free())
    }

    /// Whether the energy `E = p.v - L` follows its law `E' = L_z E` from each time of the grid to the next one, up to the
    /// requested error or the error of defects that are compared.
    pub(super) fn keeps_energy(&self, track: &Track, grid: &ComparisonGrid, count: usize) -> bool {
        let SystemProblem { system, t0, start, state, .. } = &self.request.problem;
        let (h, rate) = (self.step(count, grid), system.gradient(*t0, start).z);
        // The energy, the size of its terms, and the work `p.v`.
        let energy = |t: f64, q: &Vector, p: &Vector, v: &Vector, z: f64| {
            let (work, l) = (p.dot(v), system.value(t, &Point { q: q.clone(), v: v.clone(), z }));
            (work - l, work.abs() + l.abs() + (rate * z).abs(), work.abs())
        };
        let (mut before, mut steps) = (energy(*t0, &state.q, &state.p, &start.v, state.z), 0);
        // An oscillation has no work at its turning points: the largest so far, which decays as the energy does.
        let (mut size, wanted) = (before.2, max_or_nan(self.wanted, MIN_COMPARED_DEFECT));
        for (i, [q, p]) in track.states.iter().enumerate() {
            let Some((taken, _)) = grid.stop(i, count, *t0, self.request.span) else { break };
            let now = energy(t0 + taken as f64 * h, q, p, &track.velocities[i], track.actions[i]);
            let factor = (rate * (taken - steps) as f64 * h).exp();
            size = max_or_nan(size * factor, now.2);
            let rounding = ENERGY_ROUNDINGS * f64::EPSILON * (taken as f64).sqrt() * max_or_nan(before.1, now.1);
            // Written so that a NaN is a violation.
            let follows = (now.0 - before.0 * factor).abs() <= max_or_nan(wanted * size, rounding);
            if !follows {
                return false;
            }
            (before, steps) = (now, taken);
        }
        true
    }
}
