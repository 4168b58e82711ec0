//! The tangent of a step and its adjoint, for columns and covectors.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::StepError;
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::integration::depends_on_action;
use crate::numbers::registers::Stages;
use crate::sensitivity::SolvedStages;
use crate::sensitivity::linear_stages::{Inhomogeneity, LinearStages, StageTangent};
use crate::sensitivity::parameter_derivatives::{ParameterDerivatives, Quantity, QuantityDerivatives};
use crate::sensitivity::stage_derivatives::{StageDerivatives, end_value};
use crate::sensitivity::step_maps::{Direction, StepMaps};
use crate::Problem;
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Parametric, PhasePoint};

/// The tangent `(dq, dp, dz)` of a motion along one variable.
pub(crate) struct Column<const N: usize> {
    pub q: SVector<f64, N>,
    pub p: SVector<f64, N>,
    pub z: f64,
    /// The parameter that it is the derivative with respect to, if any.
    pub parameter: Option<usize>,
    /// The derivatives of the time at the start of the run and of the step size.
    pub dt0: f64,
    pub dh: f64,
    rates: StageTangent<N>,
    warm: bool,
}

impl<const N: usize> Column<N> {
    pub fn new(q: SVector<f64, N>, p: SVector<f64, N>, z: f64) -> Self {
        Column { q, p, z, parameter: None, dt0: 0.0, dh: 0.0, rates: StageTangent::ZERO, warm: false }
    }

    /// The column of a parameter.
    pub fn of_parameter(self, index: usize) -> Self {
        Column { parameter: Some(index), ..self }
    }

    /// The column of a variable on which the time at the start and the step size depend with these derivatives.
    pub fn of_times(self, dt0: f64, dh: f64) -> Self {
        Column { dt0, dh, ..self }
    }

    /// The derivative of the time after this number of steps.
    pub fn time_after(&self, steps: usize) -> f64 {
        self.dt0 + steps as f64 * self.dh
    }

    /// The column for a step from the end of this number of steps to a fixed time.
    pub fn for_row(&self, steps: usize) -> Self {
        let dt0 = self.time_after(steps);
        Self::copied(self).of_times(dt0, -dt0)
    }

    /// The column at a fixed time, where the state after this number of steps has these rates.
    pub fn at_fixed_time(&self, steps: usize, rates: &PhasePoint<N>) -> Self {
        let (mut column, dt) = (Self::copied(self), self.time_after(steps));
        column.q -= rates.q * dt;
        column.p -= rates.p * dt;
        column.z -= rates.z * dt;
        column
    }

    /// The same tangent without an initial guess of its rates.
    fn copied(&self) -> Self {
        let Column { q, p, z, parameter, dt0, dh, .. } = *self;
        Column { parameter, dt0, dh, ..Column::new(q, p, z) }
    }

    /// The largest component.
    pub fn size(&self) -> f64 {
        contact_geom::numbers::max_abs_or_nan(self.q.iter().chain(&self.p).copied().chain([self.z]))
    }
}

/// The derivatives `(g_q, g_p, g_z)` of a number in the state, with those in parameters, time and step size so far.
pub(crate) struct Covector<const N: usize> {
    pub q: SVector<f64, N>,
    pub p: SVector<f64, N>,
    pub z: f64,
    pub parameters: Vec<f64>,
    /// The derivatives in the time of the start of the run, for fixed steps, and in the step size.
    pub time: f64,
    pub step: f64,
    rates: StageTangent<N>,
    warm: bool,
}

impl<const N: usize> Covector<N> {
    pub fn new(of_state: &ChartVector<N>, parameters: Vec<f64>) -> Self {
        Covector {
            q: of_state.x,
            p: of_state.y,
            z: of_state.z,
            parameters,
            time: 0.0,
            step: 0.0,
            rates: StageTangent::ZERO,
            warm: false,
        }
    }

    /// Adds a covector at the start of a shortened step from the state after this number of steps to a fixed time.
    pub fn add_row(&mut self, row: &Self, steps: usize) {
        self.add_state(&ChartVector { x: row.q, y: row.p, z: row.z }, &row.parameters);
        // The length of the step decreases as its start moves.
        self.add_time(row.time - row.step, steps);
    }

    /// Adds a covector of the state at a fixed time, which the motion has after this number of steps, with these rates.
    pub fn add_at_fixed_time(&mut self, of_state: &ChartVector<N>, parameters: &[f64], rates: &PhasePoint<N>, steps: usize) {
        self.add_state(of_state, parameters);
        self.add_time(-(of_state.x.dot(&rates.q) + of_state.y.dot(&rates.p) + of_state.z * rates.z), steps);
    }

    fn add_state(&mut self, of_state: &ChartVector<N>, parameters: &[f64]) {
        self.q += of_state.x;
        self.p += of_state.y;
        self.z += of_state.z;
        self.parameters.iter_mut().zip(parameters).for_each(|(sum, of)| *sum += of);
    }

    /// Adds a derivative in the time after this number of steps.
    fn add_time(&mut self, of_time: f64, steps: usize) {
        self.time += of_time;
        self.step += steps as f64 * of_time;
    }

    /// The largest component.
    pub fn size(&self) -> f64 {
        contact_geom::numbers::max_abs_or_nan(self.q.iter().chain(&self.p).copied().chain([self.z]))
    }
}

/// The tangent of steps of one length in one direction, with its workspace.
pub(crate) struct Engine<'a, L, const N: usize> {
    lagrangian: &'a L,
    forward: StepMaps,
    maps: StepMaps,
    at: StageDerivatives<N>,
    linear: LinearStages<N>,
    given: Inhomogeneity<N>,
    of_parameters: ParameterDerivatives<N>,
    /// Whether L or the force depend on the time.
    timed: bool,
}

impl<'a, L: Parametric<N>, const N: usize> Engine<'a, L, N> {
    pub fn new(problem: &Problem<'a, L, N>, s: usize, h: f64, direction: Direction) -> Self {
        let lagrangian = problem.lagrangian;
        let coupled = depends_on_action(lagrangian, &problem.structure);
        Engine {
            lagrangian,
            forward: StepMaps::new(s, h, Direction::Forward),
            maps: StepMaps::new(s, h, direction),
            at: StageDerivatives::new(const { L::HINTS.forced }),
            linear: LinearStages::new(direction, coupled),
            given: Inhomogeneity::ZERO,
            of_parameters: ParameterDerivatives::new(lagrangian),
            timed: !problem.structure.autonomous,
        }
    }

    /// An engine for a shortened step, which is kept in `engine`.
    pub fn of_row<'e>(
        engine: &'e mut Option<Self>,
        problem: &Problem<'a, L, N>,
        step: &SolvedStages<N>,
        direction: Direction,
    ) -> &'e mut Self {
        let engine = engine.get_or_insert_with(|| Engine::new(problem, step.s, step.h, direction));
        engine.forward = StepMaps::new(step.s, step.h, Direction::Forward);
        engine.maps = StepMaps::new(step.s, step.h, direction);
        engine
    }

    /// Evaluates the derivatives at the stages of a step, for the columns or covectors that are carried over it next.
    ///
    /// # Errors
    /// [`StepError::Singular`], [`StepError::NonFinite`].
    pub fn prepare(&mut self, step: &SolvedStages<N>) -> Result<(), StepError> {
        self.at.evaluate(self.lagrangian, &self.forward, step)?;
        self.linear.set(&self.at);
        Ok(())
    }

    /// Carries a column from the start of the prepared step, the k-th of the run, to its end.
    ///
    /// # Errors
    /// Those of the linear stage equations.
    pub fn push(&mut self, step: &SolvedStages<N>, k: usize, column: &mut Column<N>) -> Result<(), StepError> {
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
            extrapolate(&self.maps, &mut column.rates, [1.0, 1.0]);
        }
        self.linear.solve(&self.maps, &self.given, &mut column.rates)?;
        let (rates, maps) = (&column.rates, &self.maps);
        let (rho, scaled) = (self.at.end_rho, end_value(maps, &rates.r_rate) + fraction * (self.at.end_rho - 1.0));
        for d in 0..N {
            let moved = end_value(&self.forward, &step.v[d]);
            let pushed = end_value(&self.forward, &step.force[d]);
            column.q[d] += end_value(maps, &rates.v[d]) + fraction * moved;
            let p = column.p[d] + end_value(maps, &rates.p_rate[d]) + fraction * pushed;
            column.p[d] = (p - self.at.end_p[d] * scaled) / rho;
        }
        column.z += end_value(maps, &rates.z_rate) + fraction * end_value(&self.forward, &step.l);
        column.warm = true;
        Ok(())
    }

    /// Sets the sources of a column: the derivatives of the rates with respect to its parameter and to the time.
    fn set_sources(&mut self, step: &SolvedStages<N>, k: usize, column: &Column<N>) {
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
                of.add(1.0, &self.of_parameters.at(self.lagrangian, Quantity::Parameter(k), t, &x));
            }
            if moves {
                let factor = start + c[i].0 * column.dh;
                of.add(factor, &self.of_parameters.at(self.lagrangian, Quantity::Time, t, &x));
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

    /// Carries a covector from the end of the prepared step, the k-th of the run, to its start.
    ///
    /// # Errors
    /// Those of the linear stage equations.
    pub fn pull(&mut self, step: &SolvedStages<N>, k: usize, covector: &mut Covector<N>) -> Result<(), StepError> {
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
            extrapolate(&self.maps, &mut covector.rates, [1.0 / rho, 1.0]);
        }
        self.linear.solve(&self.maps, &self.given, &mut covector.rates)?;
        self.add_derivatives(step, k, covector);
        let (rates, maps) = (&covector.rates, &self.maps);
        covector.p = SVector::from_fn(|d, _| w_q[d] + end_value(maps, &rates.v[d]));
        covector.q = SVector::from_fn(|d, _| covector.q[d] - end_value(maps, &rates.p_rate[d]));
        covector.z += end_value(maps, &rates.r_rate);
        covector.warm = true;
        Ok(())
    }

    /// Adds the derivatives with respect to parameters, time and step size over the step.
    fn add_derivatives(&mut self, step: &SolvedStages<N>, k: usize, covector: &mut Covector<N>) {
        let g = Coefficients::of(step.s);
        let w = &covector.rates;
        let (mut time, mut stretch) = (0.0, 0.0);
        for i in 0..step.s {
            let (t, x) = self.at.point(i);
            let at = |x: &[Stages; N]| SVector::<f64, N>::from_fn(|d, _| x[d].0[i]);
            let (tangent, w_rho) = (ChartVector { x: at(&w.q), y: at(&w.v), z: w.z.0[i] }, w.r.0[i]);
            let (rho, weight) = (self.at.rho.0[i], self.forward.weights.0[i]);
            for (index, sum) in covector.parameters.iter_mut().enumerate() {
                let quantity = Quantity::Parameter(index);
                let along = self.of_parameters.along(self.lagrangian, quantity, (t, &x, rho), (&tangent, w_rho));
                *sum += weight * along;
            }
            let w_p = at(&w.p);
            let along_motion = tangent.x.dot(&at(&step.force)) - w_p.dot(&x.v) + tangent.z * step.rate.0[i] + w_rho * self.at.l.0[i];
            stretch += g.b[i].0 * along_motion;
            if self.timed {
                let along = self.of_parameters.along(self.lagrangian, Quantity::Time, (t, &x, rho), (&tangent, w_rho));
                time += weight * along;
                stretch += weight * g.c[i].0 * along;
            }
        }
        covector.time += time;
        covector.step += stretch + k as f64 * time;
    }
}

/// Takes the polynomials of the rates over one step as the initial guess of the next one, with the factors of (v, z')
/// and of r'.
#[inline(always)]
fn extrapolate<const N: usize>(maps: &StepMaps, rates: &mut StageTangent<N>, [of_motion, of_r]: [f64; 2]) {
    let apply = |rates: &mut Stages, factor: f64| {
        let next = maps.extrapolated(rates);
        *rates = next.map(|x| factor * x);
    };
    rates.v.iter_mut().for_each(|v| apply(v, of_motion));
    apply(&mut rates.z_rate, of_motion);
    apply(&mut rates.r_rate, of_r);
}
