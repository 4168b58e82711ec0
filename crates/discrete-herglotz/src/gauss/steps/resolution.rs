//! Whether the steps of a run resolve the motion.

use crate::UnresolvedStep;
use crate::gauss::curve::Curve;
use crate::gauss::resolution::defect_sample::DefectSample;
use crate::gauss::routes::RouteState;
use crate::gauss::steps::{GaussSteps, copy_state};
use crate::gauss::system::{CollocationSystem, PointRef};
use crate::resolution::monitor::{sharper_of, size, turning, value_rounding};
use crate::resolution::thresholds::{
    COLLOCATION_ROUNDINGS, FEW_STAGES, MAX_STEP_DEFECT, MAX_STEP_DEFECT_OF_FEW_STAGES,
};
use contact_geom::numbers::max_or_nan;

impl GaussSteps {
    /// The largest defect of the last step over a number of sets of sample points between its nodes. `None` if there is
    /// no solved step.
    pub fn sample_defect(&self, system: &dyn CollocationSystem, sets: usize) -> Option<DefectSample> {
        let step = self.last_step()?;
        let mut p = vec![0.0; step.from.y.len()];
        Self::momenta(self.mass.as_ref(), &step.from.y, &mut p);
        let mut curve = Curve::new(self.s, step.t, self.h, &step.from.q, &p, step.from.z);
        self.route.collect(system, &step, &mut curve);
        system.defect_of(self.arch, &curve, false, sets)
    }

    /// Updates the sequence of mean velocities after a step. For few stages a defect of the sequence above one flags a
    /// step as unresolved; a second difference of the velocities that is larger than all before is recorded as a
    /// suspect interval.
    pub(super) fn update_sequence(&mut self) {
        copy_state(&*self.route, &mut self.end);
        let (end, h, monitor) = (&self.end, self.h, &mut self.monitor);
        let Some(sequence) = self.sequence.as_deref_mut() else { return };
        sequence.push(&end.q, self.k, h);
        let [_, b, c, d] = &sequence.velocities;
        let sharper = sharper_of([&sequence.bend, c, &end.q], h, monitor.floor, monitor.sharpest);
        let [before, now] = &sequence.turns;
        if self.s <= FEW_STAGES
            && now.iter().zip(before).fold(0.0, |sum, (a, b)| sum + a * b) < 0.0
            && let Some(defect) = turning([before, now], [b, c, d], &end.q, h, monitor.floor)
        {
            // As for quadrature rules, the defect becomes known one step later.
            monitor.note(self.k.saturating_sub(1), defect);
        }
        if let (Some(sharpness), Some(step)) = (sharper, self.k.checked_sub(1).filter(|step| *step > 0)) {
            monitor.suspect(sharpness);
            let suspect = &mut self.suspect;
            (suspect.is_new, suspect.step, suspect.t) = (true, step, self.t0 + step as f64 * h);
            for (to, of) in [(&mut suspect.from, &sequence.ends[0]), (&mut suspect.to, end)] {
                to.q.copy_from_slice(&of.q);
                Self::momenta(self.mass.as_ref(), &of.y, &mut to.y);
                to.z = of.z;
            }
        }
        sequence.keep(end);
    }

    /// The first step that was flagged as unresolved; if there is none, the last step if its defect sample is too
    /// large.
    pub fn find_unresolved(&self, system: &dyn CollocationSystem) -> Option<UnresolvedStep> {
        if self.of_sigma > 1.0 && self.k > 0 {
            return Some(UnresolvedStep { step: 0, defect: self.of_sigma });
        }
        self.monitor.first.or_else(|| {
            let sample = self.sample_defect(system, self.route.sample_sets())?;
            let DefectSample { defect, of_momenta, of_action, size, size_z, .. } = sample;
            let allowed = if self.s > FEW_STAGES { MAX_STEP_DEFECT } else { MAX_STEP_DEFECT_OF_FEW_STAGES };
            // Written so that a NaN counts as a defect.
            if defect <= allowed {
                return None;
            }
            let [of_p, of_z] = self.rounding(system);
            if of_momenta <= max_or_nan(allowed * size, of_p) && of_action <= max_or_nan(allowed * size_z, of_z) {
                return None;
            }
            Some(UnresolvedStep { step: self.k - 1, defect: defect / allowed })
        })
    }

    /// Whether the system is at rest at the end of a step: the velocity times h is below the round-off of the
    /// positions, and the force is its own round-off.
    #[cold]
    pub(super) fn is_at_rest(&mut self, system: &dyn CollocationSystem, t: f64) -> bool {
        copy_state(&*self.route, &mut self.end);
        let GaussSteps { end, p, v, gradient, near, .. } = self;
        Self::momenta(self.mass.as_ref(), &end.y, p);
        let state = PointRef { q: &end.q, v: p, z: end.z };
        if system.at_state(t, state, near, v, gradient).is_err() {
            return false;
        }
        let rate = gradient.z;
        let pull = gradient.q.iter().zip(&*p).map(|(force, p)| force + p * rate);
        let pull = pull.fold(0.0, |largest, force: f64| max_or_nan(largest, force.abs()));
        system.rounding_at_state(t, PointRef { q: &end.q, v, z: end.z }, p, gradient);
        size(v) * self.h.abs() <= self.monitor.floor && pull <= COLLOCATION_ROUNDINGS * size(&gradient.q)
    }

    /// Bounds on the round-off in the defects of the momenta and of the action in the last step, from the round-off of
    /// the forces and of L. For a motion at rest the defects consist of it.
    #[cold]
    fn rounding(&self, system: &dyn CollocationSystem) -> [f64; 2] {
        let RouteState { q, y, z } = self.route.state();
        let [q, y] = [q, y].map(|of| of.iter().map(|sum| sum.value).collect::<Vec<f64>>());
        let (mut p, mut v, mut g) = (y.clone(), y.clone(), self.gradient.clone());
        Self::momenta(self.mass.as_ref(), &y, &mut p);
        let t = self.time();
        let near = self.route.last_velocity().unwrap_or(&self.near);
        if system.velocity(t, PointRef { q: &q, v: &p, z: z.value }, near, &mut v).is_err() {
            return [0.0; 2];
        }
        let l = system.rounding_at_state(t, PointRef { q: &q, v: &v, z: z.value }, &p, &mut g);
        // The stages of the integrating factor amplify round-off the more, the more the factor changes in the step.
        let h = self.h.abs();
        let carried = COLLOCATION_ROUNDINGS * (1.0 + self.sigma().ln().abs());
        // Zero where the bound is not finite. Subnormal numbers have lost digits, which the smallest normal number
        // bounds.
        [max_or_nan(size(&g.q) * h, size(&g.v)), value_rounding(l, &g.q, &q) * h]
            .map(|once| if (carried * once).is_finite() { carried * once + f64::MIN_POSITIVE } else { 0.0 })
    }

    /// `sigma_d` of the last step; 1 before the first.
    pub fn sigma(&self) -> f64 {
        if self.k == 0 { 1.0 } else { self.route.sigma() }
    }
}
