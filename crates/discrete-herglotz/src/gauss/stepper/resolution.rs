//! Whether the steps of a run resolve the motion.

use crate::gauss::resolution::defect_sample::{Compare, Curve, DefectSample};
use crate::gauss::resolution::sequence::Sequence;
use crate::gauss::routes::StageRoute;
use crate::gauss::stages::parametrization::Physical;
use crate::gauss::stepper::{GaussStepper, Route, with_route};
use crate::integration::{AtState, SuspectInterval, at_state};
use crate::resolution::monitor::{defect, sharper, size, value_rounding};
use crate::resolution::thresholds::{
    COLLOCATION_ROUNDINGS, FEW_STAGES, MAX_STEP_DEFECT, MAX_STEP_DEFECT_OF_FEW_STAGES,
};
use crate::{Stepper, UnresolvedStep, theory::legendre_inverse};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    Lagrangian,
    numbers::{max_abs_or_nan, max_or_nan},
    support::rounding_at_state,
};
use pulp::{Simd, WithSimd};

impl<L: Lagrangian<N>, const N: usize> GaussStepper<'_, L, N> {
    /// The largest defect of the last step over a number of sets of sample points between its nodes. `None` if there is
    /// no solved step.
    pub(crate) fn sample_defect(&self, sets: usize) -> Option<DefectSample> {
        let curve = self.arch.dispatch(CollectStages { run: self })?;
        let at = |set| {
            self.arch.dispatch(Compare { lagrangian: self.lagrangian, transformation: &Physical, curve: &curve, set })
        };
        (0..sets).map(at).reduce(DefectSample::and)
    }

    /// Updates the sequence of mean velocities after a step. For few stages a defect of the sequence above one flags a
    /// step as unresolved; a second difference of the velocities that is larger than all before is recorded as a
    /// suspect interval.
    #[inline(never)]
    pub(crate) fn update_sequence(&mut self) {
        let (end, h) = (self.values(), self.h);
        let q = SVector::from(end.q);
        let Some(Sequence { velocities, q: before, ends }) = self.sequence.as_deref_mut() else { return };
        let [from, last] = *ends;
        *ends = [last, end];
        let latest = (q - *before) / h;
        velocities.rotate_left(1);
        velocities[3] = latest;
        *before = q;
        // The velocities before the first step are extrapolated linearly from those of the first two steps.
        match self.k {
            0 => velocities.fill(latest),
            1 => velocities[1] = velocities[2] * 2.0 - latest,
            _ => {}
        }
        let [a, b, c, d] = &*velocities;
        let sharper = sharper([&(d - c * 2.0 + b), c, &q], h, self.monitor.steps.floor, self.monitor.steps.sharpest);
        let few = self.s <= FEW_STAGES;
        if few && let Some(defect) = defect([a, b, c, d], &q, h, self.monitor.steps.floor) {
            // As for quadrature rules, the defect becomes known one step later.
            self.monitor.steps.note(self.k.saturating_sub(1), defect);
        }
        if let (Some(sharpness), Some(step)) = (sharper, self.k.checked_sub(1).filter(|step| *step > 0)) {
            let t = self.t0 + step as f64 * h;
            let (from, to) = (self.phase(&from), self.phase(&end));
            self.monitor.suspect(sharpness, SuspectInterval { step, steps: 2, t, from, to });
        }
    }

    /// The first step that was flagged as unresolved; if there is none, the last step if its defect sample is too
    /// large.
    pub(crate) fn find_unresolved(&self) -> Option<UnresolvedStep> {
        if self.of_sigma > 1.0 && self.k > 0 {
            return Some(UnresolvedStep { step: 0, defect: self.of_sigma });
        }
        self.monitor.steps.first.or_else(|| {
            let sets = with_route!(&*self.route, run => StageRoute::sample_sets(run));
            let DefectSample { defect, of_momenta, of_action, size, size_z, .. } = self.sample_defect(sets)?;
            let allowed = if self.s > FEW_STAGES { MAX_STEP_DEFECT } else { MAX_STEP_DEFECT_OF_FEW_STAGES };
            // Written so that a NaN counts as a defect.
            if defect <= allowed {
                return None;
            }
            let [of_p, of_z] = self.rounding();
            if of_momenta <= max_or_nan(allowed * size, of_p) && of_action <= max_or_nan(allowed * size_z, of_z) {
                return None;
            }
            Some(UnresolvedStep { step: self.k - 1, defect: defect / allowed })
        })
    }

    /// Whether the system is at rest at the end of a step: the velocity times h is below the round-off of the
    /// positions, and the force is its own round-off.
    #[cold]
    #[inline(never)]
    pub(crate) fn is_at_rest(&self, t: f64) -> bool {
        let state = self.state();
        let Ok(AtState { x, force, rate, .. }) = at_state(self.lagrangian, t, &state, &SVector::zeros()) else {
            return false;
        };
        let rounding = rounding_at_state(self.lagrangian, t, &x, &state).1;
        size(x.v.as_slice()) * self.h.abs() <= self.monitor.steps.floor
            && size((force + state.p * rate).as_slice()) <= COLLOCATION_ROUNDINGS * size(rounding.x.as_slice())
    }

    /// Bounds on the round-off in the defects of the momenta and of the action in the last step, from the round-off of
    /// the forces and of L. For a motion at rest the defects consist of it.
    #[cold]
    #[inline(never)]
    fn rounding(&self) -> [f64; 2] {
        let (t, state) = (self.time(), self.state());
        let near = self.last_velocity().unwrap_or_else(SVector::zeros);
        let Ok(x) = legendre_inverse(self.lagrangian, t, &state, &near) else { return [0.0; 2] };
        let (l, g) = rounding_at_state(self.lagrangian, t, &x, &state);
        // The stages of the integrating factor amplify round-off the more, the more the factor changes in the step.
        let (of, h) = (|part: &SVector<f64, N>| max_abs_or_nan(part.iter().copied()), self.h.abs());
        let carried = COLLOCATION_ROUNDINGS * (1.0 + self.sigma().ln().abs());
        // Zero where the bound is not finite. Subnormal numbers have lost digits, which the smallest normal number
        // bounds.
        [max_or_nan(of(&g.x) * h, of(&g.y)), value_rounding(l, g.x.as_slice(), x.q.as_slice()) * h]
            .map(|once| if (carried * once).is_finite() { carried * once + f64::MIN_POSITIVE } else { 0.0 })
    }
}

/// Collects the stages of the last step as a [`Curve`] for defect samples.
struct CollectStages<'b, 'a, L, const N: usize> {
    run: &'b GaussStepper<'a, L, N>,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for CollectStages<'_, '_, L, N> {
    type Output = Option<Curve<N>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Option<Curve<N>> {
        let GaussStepper { s, h, route, .. } = self.run;
        let step = self.run.last_step()?;
        let mut curve = Curve::new(*s, step.t, *h, &self.run.phase(step.from));
        with_route!(&**route, run => run.collect::<S>(&step, &mut curve));
        Some(curve)
    }
}
