//! The second derivatives of a step of contact Gauss collocation along two tangents.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use super::{Column, Engine, extrapolate};
use crate::StepError;
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::numbers::registers::Stages;
use crate::sensitivity::SolvedStages;
use crate::sensitivity::linear_stages::StageTangent;
use crate::sensitivity::second_derivatives::{PointTangent, SecondDerivatives};
use crate::sensitivity::stage_derivatives::{end_value, stage_values};
use contact_geom::ChartVector;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::max_abs_or_nan;
use pulp::{Simd, WithSimd};

/// A tangent of a step: a combination of columns after the step, with their stages.
pub(crate) struct CarriedTangent<const N: usize> {
    /// The momentum at the end of the step.
    p: SVector<f64, N>,
    stages: StageTangent<N>,
    /// The derivatives of the parameters, of the time at the start of the run and of the step size.
    theta: Vec<f64>,
    dt0: f64,
    dh: f64,
}

impl<const N: usize> CarriedTangent<N> {
    /// The sum of multiples of columns; `parameters` is the number of parameters of L.
    pub fn combination(columns: &[Column<N>], factors: &[f64], parameters: usize) -> Self {
        let mut sum = CarriedTangent {
            p: SVector::zeros(),
            stages: StageTangent::ZERO,
            theta: vec![0.0; parameters],
            dt0: 0.0,
            dh: 0.0,
        };
        for (column, &factor) in columns.iter().zip(factors).filter(|(_, factor)| **factor != 0.0) {
            sum.p += column.p * factor;
            sum.stages.add_multiple(factor, &column.rates);
            sum.stages.add_values(factor, &column.rates);
            if let Some(theta) = column.parameter.and_then(|index| sum.theta.get_mut(index)) {
                *theta += factor;
            }
            sum.dt0 += factor * column.dt0;
            sum.dh += factor * column.dh;
        }
        sum
    }

    /// The tangent of the point of a stage, at the fraction c of the k-th step.
    fn at_stage(&self, i: usize, k: usize, c: f64) -> PointTangent<'_, N> {
        let at = |x: &[Stages; N]| SVector::<f64, N>::from_fn(|d, _| x[d].0[i]);
        let stages = &self.stages;
        PointTangent {
            x: ChartVector { x: at(&stages.q), y: at(&stages.v), z: stages.z.0[i] },
            rho: stages.r.0[i],
            t: self.dt0 + (k as f64 + c) * self.dh,
            theta: &self.theta,
        }
    }
}

/// The second derivative of the state `(q, p, z)` of a motion along two tangents.
pub(crate) struct SecondColumn<const N: usize> {
    pub q: SVector<f64, N>,
    pub p: SVector<f64, N>,
    pub z: f64,
    rates: StageTangent<N>,
    warm: bool,
}

impl<const N: usize> SecondColumn<N> {
    /// That of the start, whose position and action are variables.
    pub fn new(p: SVector<f64, N>) -> Self {
        SecondColumn { q: SVector::zeros(), p, z: 0.0, rates: StageTangent::ZERO, warm: false }
    }

    /// The largest component.
    pub fn size(&self) -> f64 {
        max_abs_or_nan(self.q.iter().chain(&self.p).copied().chain([self.z]))
    }
}

/// Second derivatives along a pair of tangents over a step, whose columns were carried over it.
pub(crate) struct SecondPush<'e, 'a, const N: usize> {
    pub engine: &'e mut Engine<'a, N>,
    pub of_two: &'e mut SecondDerivatives<N>,
    pub step: &'e SolvedStages<N>,
    pub k: usize,
    pub tangents: [&'e CarriedTangent<N>; 2],
    pub second: &'e mut SecondColumn<N>,
}

impl<const N: usize> SecondPush<'_, '_, N> {
    /// Carries the second derivatives from the start of the step to its end; returns the largest component.
    ///
    /// # Errors
    /// Those of [`Engine::push`].
    pub fn push(self) -> Result<f64, StepError> {
        let arch = self.engine.arch;
        arch.dispatch(self)
    }
}

impl<const N: usize> WithSimd for SecondPush<'_, '_, N> {
    type Output = Result<f64, StepError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let SecondPush { engine, of_two, step, k, tangents: [a, b], second } = self;
        engine.set_second_sources::<S>(of_two, step, k, [a, b], second);
        if second.warm {
            extrapolate::<S, N>(&engine.maps, &mut second.rates, [1.0, 1.0 / engine.at.end_rho]);
        }
        engine.linear.solve::<S>(&engine.maps, &engine.given, &mut second.rates)?;
        let (maps, rho, p1) = (&engine.maps, engine.at.end_rho, &engine.at.end_p);
        let [of_a, of_b] = [a.dh / step.h, b.dh / step.h];
        // The length of a step is linear in the variables.
        let end = |x: &Stages, a: &Stages, b: &Stages| {
            let mut sum = end_value::<S>(maps, x);
            if of_a != 0.0 || of_b != 0.0 {
                sum += of_a * end_value::<S>(maps, b) + of_b * end_value::<S>(maps, a);
            }
            sum
        };
        let scaled =
            |x: &CarriedTangent<N>, fraction: f64| end_value::<S>(maps, &x.stages.r_rate) + fraction * (rho - 1.0);
        let (rates, [x, y]) = (&second.rates, [&a.stages, &b.stages]);
        let (rho_a, rho_b) = (scaled(a, of_a), scaled(b, of_b));
        let rho_ab = end(&rates.r_rate, &x.r_rate, &y.r_rate);
        for d in 0..N {
            second.q[d] += end(&rates.v[d], &x.v[d], &y.v[d]);
            // p_1 = P / rho at the end.
            let p = second.p[d] + end(&rates.p_rate[d], &x.p_rate[d], &y.p_rate[d]);
            second.p[d] = (p - a.p[d] * rho_b - b.p[d] * rho_a - p1[d] * rho_ab) / rho;
        }
        second.z += end(&rates.z_rate, &x.z_rate, &y.z_rate);
        second.warm = true;
        let size = second.size();
        if size.is_finite() { Ok(size) } else { Err(StepError::NonFinite) }
    }
}

impl<const N: usize> Engine<'_, N> {
    /// Sets the terms of the stage equations that are known: the second derivatives of the rates along the tangents, and
    /// the products of rates with derivatives of the step size.
    #[inline(always)]
    fn set_second_sources<S: Simd>(
        &mut self,
        of_two: &mut SecondDerivatives<N>,
        step: &SolvedStages<N>,
        k: usize,
        [a, b]: [&CarriedTangent<N>; 2],
        second: &SecondColumn<N>,
    ) {
        let (given, maps) = (&mut self.given, &self.maps);
        let [of_a, of_b] = [a.dh / step.h, b.dh / step.h];
        let start = |value: f64, a: &Stages, b: &Stages| {
            let mut at = Stages([value; MAX_STAGES]);
            for (factor, rates) in [(of_a, b), (of_b, a)] {
                if factor != 0.0 {
                    let values = stage_values::<S>(maps, rates, 0.0);
                    for i in 0..step.s {
                        at.0[i] += factor * values.0[i];
                    }
                }
            }
            at
        };
        let [x, y] = [&a.stages, &b.stages];
        for d in 0..N {
            given.q[d] = start(second.q[d], &x.v[d], &y.v[d]);
            given.p[d] = start(second.p[d], &x.p_rate[d], &y.p_rate[d]);
        }
        given.z = start(second.z, &x.z_rate, &y.z_rate);
        given.r = start(0.0, &x.r_rate, &y.r_rate);
        given.has_r = true;
        let c = &Coefficients::of(step.s).c;
        for i in 0..step.s {
            let (t, x) = self.at.point(i);
            let [of_a, of_b] = [a, b].map(|tangent| tangent.at_stage(i, k, c[i].0));
            let of = self.system.second_at(of_two, (t, &x, self.at.rho.0[i]), &of_a, &of_b);
            for d in 0..N {
                given.v_source[d].0[i] = of.momentum[d];
                given.p_source[d].0[i] = of.force[d];
            }
            given.z_source.0[i] = of.l;
            given.r_source.0[i] = of.rate;
        }
    }
}
