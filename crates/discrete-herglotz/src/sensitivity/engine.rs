//! The tangent of a step and its adjoint, for columns and covectors.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::integration::{QuantityDerivatives, SolvedStages};
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{StageMap, Stages};
use crate::sensitivity::columns::{Column, Covector};
use crate::sensitivity::fixed_stages::FixedStages;
use crate::sensitivity::linear_stages::{
    Inhomogeneity, LinearStages, StageTangent, add_product, product, subtract_product,
};
use crate::sensitivity::parameter_derivatives::{ParameterDerivatives, Quantity};
use crate::sensitivity::stage_derivatives::{StageDerivatives, end_value};
use crate::sensitivity::stage_system::StageSystem;
use crate::sensitivity::step_maps::{Direction, StepMaps};
use crate::{Problem, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::max_or_nan;
use contact_geom::{Parametric, VelocityPoint};
use pulp::{Simd, WithSimd};

/// The tangent of steps of one length in one direction, with its workspace.
pub(crate) struct Engine<'a, const N: usize> {
    system: &'a dyn StageSystem<N>,
    forward: StepMaps,
    maps: StepMaps,
    at: StageDerivatives<N>,
    linear: LinearStages<N>,
    given: Inhomogeneity<N>,
    of_parameters: ParameterDerivatives<N>,
    /// Whether L or the force depend on the time.
    timed: bool,
    /// Whether the maps for constant mass and rate apply.
    condenses: bool,
    /// The map of the actions of the stages forward, for constant rate.
    actions: Option<StageMap>,
    arch: Instructions,
}

impl<'a, const N: usize> Engine<'a, N> {
    pub fn new<L: Parametric<N>>(problem: &Problem<'a, L, N>, s: usize, h: f64, direction: Direction) -> Self {
        let lagrangian = problem.lagrangian;
        let at = StageDerivatives::new(problem);
        let velocity_terms = !at.form.separable || const { L::HINTS.forced };
        let condenses = !velocity_terms && at.form.affine && problem.structure.has_constant_rate();
        Engine {
            system: lagrangian,
            forward: StepMaps::new(s, h, Direction::Forward),
            maps: StepMaps::new(s, h, direction),
            linear: LinearStages::new(direction, !at.form.affine, velocity_terms),
            condenses: condenses && at.form.inverse_mass.is_some(),
            actions: None,
            at,
            given: Inhomogeneity::ZERO,
            of_parameters: ParameterDerivatives::new(lagrangian),
            timed: !problem.structure.autonomous,
            arch: Instructions::new(),
        }
    }

    /// An engine for a shortened step, which is kept in `engine`.
    pub fn of_row<'e, L: Parametric<N>>(
        engine: &'e mut Option<Self>,
        problem: &Problem<'a, L, N>,
        step: &SolvedStages,
        direction: Direction,
    ) -> &'e mut Self {
        let engine = engine.get_or_insert_with(|| Engine::new(problem, step.s, step.h, direction));
        engine.forward = StepMaps::new(step.s, step.h, Direction::Forward);
        engine.maps = StepMaps::new(step.s, step.h, direction);
        engine.linear.forget();
        engine.actions = None;
        engine
    }

    /// Carries columns from the start of a step, the k-th of the run, to its end; returns the largest component of them.
    ///
    /// # Errors
    /// [`StepError::Singular`], [`StepError::NonFinite`], [`StepError::NotConverged`].
    pub fn push(&mut self, step: &SolvedStages, k: usize, columns: &mut [Column<N>]) -> Result<f64, StepError> {
        self.arch.dispatch(Push { engine: self, step: &FixedStages::of(step)?, k, columns })
    }

    /// Carries covectors from the end of a step, the k-th of the run, to its start.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    pub fn pull(&mut self, step: &SolvedStages, k: usize, covectors: &mut [Covector<N>]) -> Result<(), StepError> {
        self.arch.dispatch(Pull { engine: self, step: &FixedStages::of(step)?, k, covectors })
    }

    /// Evaluates the derivatives at the stages of a step.
    #[inline(always)]
    fn prepare(&mut self, step: &FixedStages<'_, N>) -> Result<(), StepError> {
        if self.actions.is_none() && !step.knows_l {
            let (t, x) =
                (step.t, VelocityPoint { q: step.start.q, v: SVector::from_fn(|d, _| step.v[d].0[0]), z: 0.0 });
            self.actions = self.forward.resolvent(-self.system.rate_at(t, &x));
        }
        self.system.evaluate(self.arch, &mut self.at, &self.forward, step, self.actions.as_ref())?;
        if self.condenses
            && !self.linear.is_condensed()
            && let Some(inverse) = &self.at.form.inverse_mass
        {
            self.linear.condense(&self.maps, &self.at, inverse);
        }
        self.linear.set(&self.at);
        Ok(())
    }

    #[inline(always)]
    fn push_column<S: Simd>(
        &mut self,
        step: &FixedStages<'_, N>,
        k: usize,
        column: &mut Column<N>,
    ) -> Result<(), StepError> {
        let s = step.s;
        let fraction = column.dh / step.h;
        self.set_sources(step, k, column);
        let (given, at) = (&mut self.given, &self.at);
        for d in 0..N {
            given.q[d] = Stages([column.q[d]; MAX_STAGES]);
            given.p[d] = Stages([column.p[d]; MAX_STAGES]);
        }
        given.z = Stages([column.z; MAX_STAGES]);
        given.r = Stages::ZERO;
        if fraction != 0.0 {
            given.has_r = true;
            for i in 0..s {
                for d in 0..N {
                    given.q[d].0[i] += fraction * (at.q[d].0[i] - step.start.q[d]);
                    given.p[d].0[i] += fraction * (at.rho.0[i] * at.l_v[d].0[i] - step.start.p[d]);
                }
                given.z.0[i] += fraction * (at.z.0[i] - step.start.z);
                given.r.0[i] = fraction * (at.rho.0[i] - 1.0);
            }
        }
        if column.warm {
            extrapolate::<S, N>(&self.maps, &mut column.rates, [1.0, 1.0 / self.at.end_rho]);
        }
        self.linear.solve::<S>(&self.maps, &self.given, &mut column.rates)?;
        let (rates, maps) = (&column.rates, &self.maps);
        let (rho, scaled) = (self.at.end_rho, end_value::<S>(maps, &rates.r_rate) + fraction * (self.at.end_rho - 1.0));
        for d in 0..N {
            let moved = end_value::<S>(&self.forward, &step.v[d]);
            let pushed = end_value::<S>(&self.forward, &step.force[d]);
            column.q[d] += end_value::<S>(maps, &rates.v[d]) + fraction * moved;
            let p = column.p[d] + end_value::<S>(maps, &rates.p_rate[d]) + fraction * pushed;
            column.p[d] = (p - self.at.end_p[d] * scaled) / rho;
        }
        column.z += end_value::<S>(maps, &rates.z_rate) + fraction * end_value::<S>(&self.forward, &self.at.l);
        column.warm = true;
        Ok(())
    }

    /// Sets the sources of a column: the derivatives of the rates with respect to its parameter and to the time.
    fn set_sources(&mut self, step: &FixedStages<'_, N>, k: usize, column: &Column<N>) {
        let given = &mut self.given;
        given.has_r = false;
        let start = column.dt0 + k as f64 * column.dh;
        let moves = self.timed && (start != 0.0 || column.dh != 0.0);
        if column.parameter.is_none() && !moves {
            given.v_source = [Stages::ZERO; N];
            given.p_source = [Stages::ZERO; N];
            given.z_source = Stages::ZERO;
            given.r_source = Stages::ZERO;
            return;
        }
        given.has_r = true;
        let c = &Coefficients::of(step.s).c;
        for i in 0..step.s {
            let (t, x) = self.at.point(i);
            let mut of = QuantityDerivatives::ZERO;
            if let Some(k) = column.parameter {
                of.add(1.0, &self.system.quantity_at(&mut self.of_parameters, Quantity::Parameter(k), t, &x));
            }
            if moves {
                let factor = start + c[i].0 * column.dh;
                of.add(factor, &self.system.quantity_at(&mut self.of_parameters, Quantity::Time, t, &x));
            }
            let rho = self.at.rho.0[i];
            for d in 0..N {
                given.v_source[d].0[i] = rho * of.gradient.y[d];
                given.p_source[d].0[i] = rho * (of.gradient.x[d] + of.force[d]);
            }
            given.z_source.0[i] = of.l;
            given.r_source.0[i] = rho * of.gradient.z;
        }
    }

    #[inline(always)]
    fn pull_covector<S: Simd>(
        &mut self,
        step: &FixedStages<'_, N>,
        k: usize,
        covector: &mut Covector<N>,
    ) -> Result<(), StepError> {
        let (given, rho) = (&mut self.given, self.at.end_rho);
        let w_q = covector.p / rho;
        let w_z = self.at.end_p.dot(&w_q);
        for d in 0..N {
            given.q[d] = Stages([w_q[d]; MAX_STAGES]);
            given.p[d] = Stages([-covector.q[d]; MAX_STAGES]);
        }
        given.z = Stages([w_z; MAX_STAGES]);
        given.r = Stages([covector.z; MAX_STAGES]);
        given.has_r = covector.z != 0.0;
        if covector.warm {
            extrapolate::<S, N>(&self.maps, &mut covector.rates, [1.0 / rho, 1.0]);
        }
        self.linear.solve::<S>(&self.maps, &self.given, &mut covector.rates)?;
        self.add_derivatives::<S>(step, k, covector);
        let (rates, maps) = (&covector.rates, &self.maps);
        for d in 0..N {
            covector.p[d] = w_q[d] + end_value::<S>(maps, &rates.v[d]);
            covector.q[d] -= end_value::<S>(maps, &rates.p_rate[d]);
        }
        covector.z += end_value::<S>(maps, &rates.r_rate);
        covector.warm = true;
        Ok(())
    }

    /// Adds the derivatives with respect to parameters, time and step size over the step.
    #[inline(always)]
    fn add_derivatives<S: Simd>(&mut self, step: &FixedStages<'_, N>, k: usize, covector: &mut Covector<N>) {
        let (w, at) = (&covector.rates, &self.at);
        // The pairing of the covector with the rates of the motion.
        let mut stretch = product(&w.z, step.rate);
        add_product(&mut stretch, &w.r, &at.l);
        for d in 0..N {
            add_product(&mut stretch, &w.q[d], &step.force[d]);
            subtract_product(&mut stretch, &w.p[d], &at.v[d]);
        }
        covector.step += end_value::<S>(&self.forward, &stretch) / step.h;
        let weights = self.forward.weights;
        for index in 0..covector.parameters.len() {
            covector.parameters[index] += self.derivative_in(Quantity::Parameter(index), &covector.rates, &weights);
        }
        if self.timed {
            let time = self.derivative_in(Quantity::Time, &covector.rates, &weights);
            let mut moved = product(&weights, &self.forward.times);
            for moved in &mut moved.0 {
                *moved /= step.h;
            }
            covector.time += time;
            covector.step += k as f64 * time + self.derivative_in(Quantity::Time, &covector.rates, &moved);
        }
    }

    /// The derivative in a quantity over the step, with weights.
    fn derivative_in(&mut self, quantity: Quantity, w: &StageTangent<N>, weights: &Stages) -> f64 {
        self.system.quantity_along(self.arch, &mut self.of_parameters, quantity, &self.at, (w, weights))
    }
}

/// Columns over a step, compiled for one instruction set.
struct Push<'e, 'a, const N: usize> {
    engine: &'e mut Engine<'a, N>,
    step: &'e FixedStages<'e, N>,
    k: usize,
    columns: &'e mut [Column<N>],
}

impl<const N: usize> WithSimd for Push<'_, '_, N> {
    type Output = Result<f64, StepError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let Push { engine, step, k, columns } = self;
        engine.prepare(step)?;
        let mut largest = 0.0;
        for column in columns {
            engine.push_column::<S>(step, k, column)?;
            largest = max_or_nan(largest, column.size());
        }
        Ok(largest)
    }
}

/// Covectors over a step, compiled for one instruction set.
struct Pull<'e, 'a, const N: usize> {
    engine: &'e mut Engine<'a, N>,
    step: &'e FixedStages<'e, N>,
    k: usize,
    covectors: &'e mut [Covector<N>],
}

impl<const N: usize> WithSimd for Pull<'_, '_, N> {
    type Output = Result<(), StepError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let Pull { engine, step, k, covectors } = self;
        engine.prepare(step)?;
        for covector in covectors {
            engine.pull_covector::<S>(step, k, covector)?;
            covector.largest = max_or_nan(covector.largest, covector.size());
        }
        Ok(())
    }
}

/// Takes the polynomials of the rates over one step as the initial guess of the next one, with the factors of (v, z')
/// and of r'.
#[inline(always)]
fn extrapolate<S: Simd, const N: usize>(maps: &StepMaps, rates: &mut StageTangent<N>, [of_motion, of_r]: [f64; 2]) {
    for d in 0..N {
        extrapolate_rates::<S>(maps, &mut rates.v[d], of_motion);
        extrapolate_rates::<S>(maps, &mut rates.p_rate[d], of_r);
    }
    extrapolate_rates::<S>(maps, &mut rates.z_rate, of_motion);
    extrapolate_rates::<S>(maps, &mut rates.r_rate, of_r);
}

#[inline(always)]
fn extrapolate_rates<S: Simd>(maps: &StepMaps, rates: &mut Stages, factor: f64) {
    let mut next = maps.extrapolated::<S>(rates);
    for x in &mut next.0 {
        *x *= factor;
    }
    *rates = next;
}
