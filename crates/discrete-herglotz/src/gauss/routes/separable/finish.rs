//! The parts of a condensed step outside of its iteration, which do not depend on the Lagrangian.

use crate::gauss::limits::{MAX_PREDICTOR_ERROR, PREDICTOR_PAUSE};
use crate::gauss::routes::separable::Separable;
use crate::gauss::routes::separable::slope::largest;
use crate::gauss::routes::separable::vectors::Parts;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::numbers::compensated::{Unevaluated, add, finite};
use crate::numbers::lanes::branched;
use pulp::{Simd, WithSimd};

/// The kernel of the end of a solved step.
pub(crate) struct Finish<'a> {
    pub run: &'a mut Separable,
    /// The error of the extrapolated initial guess, if the guess is to be dropped where it is too large.
    pub predictor_error: Option<f64>,
    /// Whether the initial guess was so accurate that the step resolves the motion.
    pub predicted_well: bool,
}

impl WithSimd for Finish<'_> {
    type Output = IterationOutcome;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> IterationOutcome {
        let Finish { run, predictor_error, predicted_well } = self;
        let outcome = run.advance::<S>();
        if outcome != IterationOutcome::Done {
            return outcome;
        }
        let (s, h) = (run.table.s, run.table.h);
        let Parts { rest, x, a, .. } = run.vectors.parts(run.q.len());
        if let Some(error) = predictor_error
            && error > MAX_PREDICTOR_ERROR * largest::<S>(rest, s)
        {
            run.steps_without_predictor = PREDICTOR_PAUSE;
        }
        run.defect = if predicted_well { 0.0 } else { run.tail.defect::<S>(a, None, x, h * h) };
        IterationOutcome::Done
    }
}

impl Separable {
    /// Advances the state by the accelerations.
    #[inline(always)]
    fn advance<S: Simd>(&mut self) -> IterationOutcome {
        let (table, s) = (&self.table, self.table.s);
        let mut dz = Unevaluated::default();
        if self.wants_z {
            dz = table.grow * self.z.value + table.end_v.sum::<S>(&self.values, s);
        }
        let a = self.vectors.parts(self.q.len()).a;
        let [dq, dv] = &mut self.changes;
        for (((dq, dv), a), v) in dq.iter_mut().zip(dv.iter_mut()).zip(a.iter()).zip(&self.v) {
            *dq = table.end_b.sum::<S>(a, s) + table.end_u.times(*v);
            *dv = table.end_v.sum::<S>(a, s) + table.grow.times(*v);
        }
        if branched() {
            return IterationOutcome::Branched;
        }
        // The maximum over lanes may hide a NaN.
        if !finite(dq, dv, dz) {
            return IterationOutcome::NonFinite;
        }
        add(&mut self.q, dq);
        add(&mut self.v, dv);
        self.z.add(dz);
        IterationOutcome::Done
    }
}
