//! The parts of a condensed step outside of its iteration, which do not depend on the Lagrangian.

use crate::gauss::limits::{MAX_PREDICTOR_ERROR, PREDICTOR_PAUSE};
use crate::gauss::routes::separable::Separable;
use crate::gauss::routes::separable::slope::{largest, store_values};
use crate::gauss::routes::separable::vectors::Parts;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::numbers::compensated::{Unevaluated, add, finite};
use crate::numbers::lanes::{Lanes, branched};
use crate::numbers::registers::{Scaled, Stages, blocks};
use pulp::{Simd, WithSimd};

/// The kernel that extrapolates the initial guess of a step from the solution of the step before.
pub(crate) struct Predict<'a>(pub &'a mut Separable);

impl WithSimd for Predict<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Predict(Separable { table, vectors, q, .. }) = self;
        for rest in vectors.parts(q.len()).rest {
            let before = *rest;
            table.extrapolation.apply(&before, table.s, rest, Lanes::<S>::splat(0.0));
        }
    }
}

/// The kernel that computes the velocities at the stages of a solved step.
pub(crate) struct Velocities<'a> {
    pub run: &'a mut Separable,
    /// Whether the iteration is to end with a secant step.
    pub secant: bool,
}

impl WithSimd for Velocities<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Velocities { run, secant } = self;
        if secant {
            run.end_with_secant::<S>();
        }
        let Separable { table, vectors, velocities, v, .. } = run;
        let a = vectors.parts(v.len()).a;
        for ((velocity, a), v) in velocities.iter_mut().zip(a.iter()).zip(v.iter()) {
            let v = Lanes::<S>::splat(v.value);
            table.d.apply(a, table.s, velocity, Scaled(&table.inverse_rho, v));
        }
    }
}

/// The kernel of the end of a solved step.
pub(crate) struct Finish<'a> {
    pub run: &'a mut Separable,
    /// Whether the iteration is to end with a secant step.
    pub secant: bool,
    /// `L - gamma z` at the stages, if z is advanced.
    pub values: Option<&'a Stages>,
    /// The error of the extrapolated initial guess, if the guess is to be dropped where it is too large.
    pub predictor_error: Option<f64>,
    /// Whether the initial guess was so accurate that the step resolves the motion.
    pub predicted_well: bool,
}

impl WithSimd for Finish<'_> {
    type Output = IterationOutcome;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> IterationOutcome {
        let Finish { run, secant, values, predictor_error, predicted_well } = self;
        if secant {
            run.end_with_secant::<S>();
        }
        let outcome = run.advance::<S>(values);
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
    /// Takes the secant step at the end of an iteration, for one coordinate.
    #[inline(always)]
    fn end_with_secant<S: Simd>(&mut self) {
        let s = self.table.s;
        let Parts { left, rest, x, a, base } = self.vectors.parts(1);
        store_values::<S>(left, s, &base[0], [&mut x[0], &mut rest[0]], &mut self.before, true);
        let kappa = Lanes::<S>::splat(left.kappa);
        for r in 0..blocks::<S>(s) {
            a[0].set(r, rest[0].block::<S>(r) - kappa * x[0].block(r));
        }
    }

    /// Advances the state by the accelerations.
    #[inline(always)]
    fn advance<S: Simd>(&mut self, values: Option<&Stages>) -> IterationOutcome {
        let (table, s) = (&self.table, self.table.s);
        let mut dz = Unevaluated::default();
        if let Some(values) = values {
            dz = table.grow * self.z.value + table.end_v.sum::<S>(values, s);
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
