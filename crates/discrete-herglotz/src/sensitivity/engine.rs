//! The tangent of a step and its adjoint, for columns and covectors.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::integration::SolvedStages;
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{StageMap, Stages};
use crate::sensitivity::columns::{Column, Covector};
use crate::sensitivity::linear_stages::{
    Inhomogeneity, LinearStages, StageTangent, add_product, product, subtract_product,
};
use crate::sensitivity::parametric_system::{Differentiable, Quantities, Quantity};
use crate::sensitivity::stage_derivatives::{StageDerivatives, end_value, stage_values};
use crate::sensitivity::step_maps::{Direction, StepMaps};
use crate::{Point, StepError};
use contact_geom::numbers::max_or_nan;
use pulp::{Simd, WithSimd};
use std::array::from_fn;

/// The tangent of steps of one length in one direction, with its workspace.
pub(crate) struct Engine<'a> {
    problem: Differentiable<'a>,
    forward: StepMaps,
    maps: StepMaps,
    at: StageDerivatives,
    linear: LinearStages,
    given: Inhomogeneity,
    of_parameters: Box<dyn Quantities + 'a>,
    /// Whether L or the force depend on the time.
    timed: bool,
    /// Whether the maps for constant mass and rate apply.
    condenses: bool,
    /// The map of the actions of the stages forward, for constant rate.
    actions: Option<StageMap>,
    arch: Instructions,
    /// Whether the steps are shortened ones or parts, which may have any length.
    is_part: bool,
}

impl<'a> Engine<'a> {
    pub fn new(problem: &Differentiable<'a>, s: usize, h: f64, direction: Direction) -> Self {
        let (n, structure) = (problem.dimension(), &problem.problem.structure);
        let at = StageDerivatives::new(problem);
        let velocity_terms = !at.form.separable || problem.system().has_force();
        let condenses = !velocity_terms && at.form.affine && structure.has_constant_rate();
        Engine {
            forward: StepMaps::new(s, h, Direction::Forward),
            maps: StepMaps::new(s, h, direction),
            linear: LinearStages::new(n, direction, !at.form.affine, velocity_terms),
            condenses: condenses && at.form.inverse_mass.is_some(),
            actions: None,
            at,
            given: Inhomogeneity::zeros(n),
            of_parameters: problem.stages.quantities(),
            timed: !structure.autonomous,
            arch: Instructions::new(),
            is_part: false,
            problem: problem.clone(),
        }
    }

    /// An engine for a shortened step, which is kept in `engine`.
    pub fn of_row<'e>(
        engine: &'e mut Option<Self>,
        problem: &Differentiable<'a>,
        step: &SolvedStages,
        direction: Direction,
    ) -> &'e mut Self {
        let engine = engine.get_or_insert_with(|| Engine::new(problem, step.s, step.h, direction));
        engine.forward = StepMaps::new(step.s, step.h, Direction::Forward);
        engine.maps = StepMaps::new(step.s, step.h, direction);
        engine.is_part = true;
        engine.linear.forget();
        engine.actions = None;
        engine
    }

    /// Carries columns from the start of a step, the k-th of the run, to its end; returns the largest component of them.
    ///
    /// # Errors
    /// [`StepError::Singular`], [`StepError::NonFinite`], [`StepError::NotConverged`].
    pub fn push(&mut self, step: &SolvedStages, k: usize, columns: &mut [Column]) -> Result<f64, StepError> {
        self.check(step)?;
        self.arch.dispatch(Push { engine: self, step, k, columns })
    }

    /// Carries covectors from the end of a step, the k-th of the run, to its start.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    pub fn pull(&mut self, step: &SolvedStages, k: usize, covectors: &mut [Covector]) -> Result<(), StepError> {
        self.check(step)?;
        self.arch.dispatch(Pull { engine: self, step, k, covectors })
    }

    /// # Errors
    /// [`StepError::NonFinite`] for stages with another number of coordinates.
    fn check(&self, step: &SolvedStages) -> Result<(), StepError> {
        let (n, SolvedStages { start, v, force, .. }) = (self.at.q.len(), step);
        let same = [start.q.len(), start.p.len(), v.len(), force.len()] == [n; 4];
        if same { Ok(()) } else { Err(StepError::NonFinite) }
    }

    /// Evaluates the derivatives at the stages of a step.
    #[inline(always)]
    fn prepare(&mut self, step: &SolvedStages) -> Result<(), StepError> {
        if self.actions.is_none() && !step.knows_l {
            let x = Point { q: step.start.q.clone(), v: step.v.iter().map(|v| v.0[0]).collect(), z: 0.0 };
            self.actions = self.forward.resolvent(-self.problem.system().gradient(step.t, &x).z);
        }
        self.problem.stages.evaluate_stages(self.arch, &mut self.at, &self.forward, step, self.actions.as_ref())?;
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
    fn push_column<S: Simd>(&mut self, step: &SolvedStages, k: usize, column: &mut Column) -> Result<(), StepError> {
        let (s, n) = (step.s, self.at.q.len());
        column.rates.reserve(n);
        let fraction = column.dh / step.h;
        self.set_sources(step, k, column);
        let (given, at) = (&mut self.given, &self.at);
        let (given_q, given_p, q, p) = (&mut given.q[..n], &mut given.p[..n], &column.q[..n], &column.p[..n]);
        for d in 0..n {
            given_q[d] = Stages([q[d]; MAX_STAGES]);
            given_p[d] = Stages([p[d]; MAX_STAGES]);
        }
        given.z = Stages([column.z; MAX_STAGES]);
        given.r = Stages::ZERO;
        if fraction != 0.0 {
            given.has_r = true;
            let (at_q, l_v, q0, p0) = (&at.q[..n], &at.l_v[..n], &step.start.q[..n], &step.start.p[..n]);
            if self.is_part {
                // A part may be so short that the state changes by its round-off: the changes are those by the rates.
                let (v, force) = (&at.v[..n], &step.force[..n]);
                let forward = &self.forward;
                for d in 0..n {
                    let of_q = stage_values::<S>(forward, &v[d], 0.0);
                    let of_p = stage_values::<S>(forward, &force[d], 0.0);
                    for i in 0..MAX_STAGES {
                        given_q[d].0[i] = q[d] + fraction * of_q.0[i];
                        given_p[d].0[i] = p[d] + fraction * of_p.0[i];
                    }
                }
                let of_z = stage_values::<S>(forward, &at.l, 0.0);
                let fallen = stage_values::<S>(forward, &step.rate, 0.0);
                for i in 0..MAX_STAGES {
                    given.z.0[i] = column.z + fraction * of_z.0[i];
                    given.r.0[i] = -fraction * fallen.0[i];
                }
            } else {
                for i in 0..s {
                    for d in 0..n {
                        given_q[d].0[i] += fraction * (at_q[d].0[i] - q0[d]);
                        given_p[d].0[i] += fraction * (at.rho.0[i] * l_v[d].0[i] - p0[d]);
                    }
                    given.z.0[i] += fraction * (at.z.0[i] - step.start.z);
                    given.r.0[i] = fraction * (at.rho.0[i] - 1.0);
                }
            }
        }
        if column.warm {
            extrapolate::<S>(&self.maps, self.linear.is_condensed(), &mut column.rates, [1.0, 1.0 / self.at.end_rho]);
        }
        self.linear.solve::<S>(&self.maps, &self.given, &mut column.rates)?;
        let (rates, maps) = (&column.rates, &self.maps);
        let rho = self.at.end_rho;
        let grown = if self.is_part { -end_value::<S>(&self.forward, &step.rate) } else { rho - 1.0 };
        let scaled = end_value::<S>(maps, &rates.r_rate) + fraction * grown;
        let (q, p, end_p) = (&mut column.q[..n], &mut column.p[..n], &self.at.end_p[..n]);
        let (of_q, of_p, v, force) = (&rates.v[..n], &rates.p_rate[..n], &step.v[..n], &step.force[..n]);
        for d in 0..n {
            let moved = end_value::<S>(&self.forward, &v[d]);
            let pushed = end_value::<S>(&self.forward, &force[d]);
            q[d] += end_value::<S>(maps, &of_q[d]) + fraction * moved;
            let end = p[d] + end_value::<S>(maps, &of_p[d]) + fraction * pushed;
            p[d] = (end - end_p[d] * scaled) / rho;
        }
        column.z += end_value::<S>(maps, &rates.z_rate) + fraction * end_value::<S>(&self.forward, &self.at.l);
        column.warm = true;
        Ok(())
    }

    /// Sets the sources of a column: the derivatives of the rates with respect to its parameter and to the time.
    #[inline(always)]
    fn set_sources(&mut self, step: &SolvedStages, k: usize, column: &Column) {
        let start = column.dt0 + k as f64 * column.dh;
        let moves = self.timed && (start != 0.0 || column.dh != 0.0);
        let given = &mut self.given;
        given.has_r = column.parameter.is_some() || moves;
        given.forget_sources();
        if given.has_r {
            self.evaluate_sources(step, column, moves.then_some(start));
        }
    }

    /// Adds the sources that do not vanish; `start` is the derivative of the time at the start of the step, unless the
    /// sources do not depend on the time. Not inlined, since it evaluates the system.
    #[inline(never)]
    fn evaluate_sources(&mut self, step: &SolvedStages, column: &Column, start: Option<f64>) {
        let (arch, at, given, quantities) = (self.arch, &self.at, &mut self.given, &mut self.of_parameters);
        if let Some(k) = column.parameter {
            quantities.add_at_stages(arch, Quantity::Parameter(k), at, &Stages([1.0; MAX_STAGES]), given);
        }
        if let Some(start) = start {
            let c = &Coefficients::of(step.s).c;
            let factors = from_fn(|i| start + c[i.min(step.s - 1)].0 * column.dh);
            quantities.add_at_stages(arch, Quantity::Time, at, &Stages(factors), given);
        }
        let sources = given.v_source.iter_mut().chain(&mut given.p_source).chain([&mut given.r_source]);
        sources.for_each(|source| *source = product(&at.rho, source));
    }

    #[inline(always)]
    fn pull_covector<S: Simd>(
        &mut self,
        step: &SolvedStages,
        k: usize,
        covector: &mut Covector,
    ) -> Result<(), StepError> {
        let (n, given, rho) = (self.at.q.len(), &mut self.given, self.at.end_rho);
        covector.rates.reserve(n);
        let w_q = &covector.p / rho;
        let w_z = self.at.end_p.dot(&w_q);
        let (given_q, given_p, w_q, of_q) = (&mut given.q[..n], &mut given.p[..n], &w_q[..n], &covector.q[..n]);
        for d in 0..n {
            given_q[d] = Stages([w_q[d]; MAX_STAGES]);
            given_p[d] = Stages([-of_q[d]; MAX_STAGES]);
        }
        given.z = Stages([w_z; MAX_STAGES]);
        given.r = Stages([covector.z; MAX_STAGES]);
        given.has_r = covector.z != 0.0;
        if covector.warm {
            extrapolate::<S>(&self.maps, self.linear.is_condensed(), &mut covector.rates, [1.0 / rho, 1.0]);
        }
        self.linear.solve::<S>(&self.maps, &self.given, &mut covector.rates)?;
        self.add_derivatives::<S>(step, k, covector);
        let (rates, maps) = (&covector.rates, &self.maps);
        let (q, p, v, p_rate) = (&mut covector.q[..n], &mut covector.p[..n], &rates.v[..n], &rates.p_rate[..n]);
        for d in 0..n {
            p[d] = w_q[d] + end_value::<S>(maps, &v[d]);
            q[d] -= end_value::<S>(maps, &p_rate[d]);
        }
        covector.z += end_value::<S>(maps, &rates.r_rate);
        covector.warm = true;
        Ok(())
    }

    /// Adds the derivatives with respect to parameters, time and step size over the step.
    #[inline(always)]
    fn add_derivatives<S: Simd>(&mut self, step: &SolvedStages, k: usize, covector: &mut Covector) {
        let (w, at, n) = (&covector.rates, &self.at, self.at.q.len());
        // The pairing of the covector with the rates of the motion.
        let mut stretch = product(&w.z, &step.rate);
        add_product(&mut stretch, &w.r, &at.l);
        let (w_q, w_p, v, force) = (&w.q[..n], &w.p[..n], &at.v[..n], &step.force[..n]);
        for d in 0..n {
            add_product(&mut stretch, &w_q[d], &force[d]);
            subtract_product(&mut stretch, &w_p[d], &v[d]);
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
    #[inline(always)]
    fn derivative_in(&mut self, quantity: Quantity, w: &StageTangent, weights: &Stages) -> f64 {
        self.of_parameters.along(self.arch, quantity, &self.at, (w, weights))
    }
}

/// Columns over a step, compiled for one instruction set.
struct Push<'e, 'a> {
    engine: &'e mut Engine<'a>,
    step: &'e SolvedStages,
    k: usize,
    columns: &'e mut [Column],
}

impl WithSimd for Push<'_, '_> {
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
struct Pull<'e, 'a> {
    engine: &'e mut Engine<'a>,
    step: &'e SolvedStages,
    k: usize,
    covectors: &'e mut [Covector],
}

impl WithSimd for Pull<'_, '_> {
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
/// and of (P', r'): of P' where the equations are condensed, else of the others, from which P' follows.
#[inline(always)]
fn extrapolate<S: Simd>(maps: &StepMaps, condensed: bool, rates: &mut StageTangent, [of_motion, of_r]: [f64; 2]) {
    if condensed {
        for p_rate in &mut rates.p_rate {
            extrapolate_rates::<S>(maps, p_rate, of_r);
        }
        return;
    }
    for v in &mut rates.v {
        extrapolate_rates::<S>(maps, v, of_motion);
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
