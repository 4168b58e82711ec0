//! Fits by multiple shooting.

use crate::motion::piecewise::PiecewiseModel;
use crate::motion::shooting_model::ShootingModel;
use crate::residuals::Residuals;
use crate::settings::Settings;
use crate::{Fit, FitError, FitStatus, LeastSquares, Model, solve};
use nalgebra::DMatrix;
use std::fmt::{Display, Formatter};

/// A fit of a motion by multiple shooting, for long or chaotic motions, whose end depends on the start so strongly that
/// a fit from an inaccurate start ends in one of many local minima.
///
/// The motion is cut at nodes. The states at the nodes are further unknowns, and the matching defects, the end of each
/// piece less the next node, further residuals with a weight that grows from fit to fit, each from the result of the one
/// before: from 1 (a defect counts as a measured value: the pieces follow the data) to 1e6 (the motion is continuous).
/// The robust loss applies to the data only.
///
/// The covariance is that of the unknowns of the motion under the constraint of continuity: it includes the uncertainty
/// of the nodes.
pub struct MultipleShooting<'a, M> {
    problem: &'a LeastSquares<'a, M>,
    shooting: ShootingModel<'a, M>,
    states: Option<Vec<Vec<f64>>>,
}

/// The result of a fit by multiple shooting.
#[derive(Clone, Debug, PartialEq)]
pub struct ShootingFit {
    /// The fit of the unknowns of the motion; the nodes are eliminated from its Jacobian and its covariance. The counts
    /// of iterations and evaluations are those of all fits together.
    pub fit: Fit,
    /// The states at the nodes, as the numbers of [`PiecewiseModel::state_names`].
    pub nodes: Vec<Vec<f64>>,
    /// The largest matching defect, relative to the size of its component at the nodes.
    pub largest_defect: f64,
}

impl Display for ShootingFit {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.fit)?;
        writeln!(f, "{} nodes, largest matching defect {:.1e}", self.nodes.len(), self.largest_defect)
    }
}

/// The weights of matching defects, one fit each. With the last one a defect is about 1e-12 of a residual.
const DEFECT_WEIGHTS: [f64; 4] = [1.0, 1e2, 1e4, 1e6];

/// The tolerance of the cost of all fits but the last.
const INTERMEDIATE_TOLERANCE: f64 = 1e-6;

impl<M: PiecewiseModel> LeastSquares<'_, M> {
    /// The same fit by multiple shooting, with nodes at these times.
    ///
    /// # Errors
    /// Nodes that do not ascend strictly between the start and the last observation.
    pub fn multiple_shooting<'a>(&'a self, nodes: &[f64]) -> Result<MultipleShooting<'a, M>, FitError> {
        let motion = self.residuals.model;
        let t0 = motion.start_time();
        let t_end = motion.observations().iter().fold(t0, |end, observation| end.max(observation.t));
        let before = [t0].into_iter().chain(nodes.iter().copied());
        // Comparisons with a NaN are false.
        let is_in_order = |(before, t): (f64, &f64)| before < *t && *t < t_end;
        if let Some(index) = before.zip(nodes).position(|pair| !is_in_order(pair)) {
            return Err(FitError::Node { index, t: nodes[index], t0, t_end });
        }
        Ok(MultipleShooting { problem: self, shooting: ShootingModel::new(motion, nodes.to_vec()), states: None })
    }
}

impl<M: PiecewiseModel> MultipleShooting<'_, M> {
    /// Sets the states at the nodes from which the fit starts. Without them those of the motion from the start are
    /// taken, with observed positions, velocities and actions in their place, interpolated linearly.
    ///
    /// # Errors
    /// A wrong number of states, or of numbers of one of them.
    pub fn start_from(self, states: &[Vec<f64>]) -> Result<Self, FitError> {
        let (expected, size) = (self.shooting.nodes.len(), self.shooting.size);
        if states.len() != expected {
            return Err(FitError::Count { what: "states at nodes", found: states.len(), expected });
        }
        if let Some(found) = states.iter().map(Vec::len).find(|found| *found != size) {
            return Err(FitError::Count { what: "numbers of a state at a node", found, expected: size });
        }
        Ok(MultipleShooting { states: Some(states.to_vec()), ..self })
    }

    /// The fit from a start of the unknowns of the motion.
    ///
    /// # Errors
    /// Those of [`LeastSquares::solve`].
    pub fn solve(&self, start: &[f64]) -> Result<ShootingFit, FitError> {
        let LeastSquares { residuals, bounds, settings } = self.problem;
        solve::check(residuals, bounds, start)?;
        let states = match &self.states {
            Some(states) => states.clone(),
            None => self.default_states(start),
        };
        let scales = self.scales(start, &states);
        let mut theta = start.to_vec();
        theta.extend(states.iter().flatten());
        let mut all_bounds = bounds.clone();
        all_bounds.lower.resize(theta.len(), f64::NEG_INFINITY);
        all_bounds.upper.resize(theta.len(), f64::INFINITY);
        let limit = settings.limit(theta.len());
        let (mut iterations, mut evaluations) = (0, 0);
        let mut last = None;
        for (stage, weight) in DEFECT_WEIGHTS.into_iter().enumerate() {
            let is_last = stage + 1 == DEFECT_WEIGHTS.len() || self.shooting.nodes.is_empty();
            let cost_tolerance =
                if is_last { settings.cost_tolerance } else { settings.cost_tolerance.max(INTERMEDIATE_TOLERANCE) };
            let max_evaluations = Some(limit.saturating_sub(evaluations));
            let settings = Settings { cost_tolerance, max_evaluations, ..*settings };
            let fit = solve::solve(&self.with_defects(&scales, weight), &all_bounds, &settings, &theta)?;
            (iterations, evaluations) = (iterations + fit.iterations, evaluations + fit.evaluations);
            let is_at_limit = matches!(fit.status, FitStatus::EvaluationLimit { .. });
            theta.clone_from(&fit.parameters);
            last = Some(fit);
            if is_last || is_at_limit {
                break;
            }
        }
        let mut fit = last.ok_or(FitError::NoStart)?;
        if let FitStatus::EvaluationLimit { limit: of_stage } = &mut fit.status {
            *of_stage = limit;
        }
        Ok(self.result(Fit { iterations, evaluations, ..fit }, &scales))
    }

    /// The states of the motion, or of the data where they are observed. Where velocities are not observed those of the
    /// positions are taken.
    fn default_states(&self, start: &[f64]) -> Vec<Vec<f64>> {
        let ShootingModel { motion, nodes, observations, .. } = &self.shooting;
        let mut states = self.shooting.nodes_of_motion(start);
        // A motion that cannot be computed from the start may well be computed in pieces.
        let last = states.last().cloned().unwrap_or_else(|| motion.start_state(start));
        states.resize(nodes.len(), last);
        // Observed velocities come last, so that they replace the slopes of positions.
        for has_rate in [true, false] {
            for number in 0..self.shooting.size {
                let of = |i: &usize| {
                    let observation = &observations[*i];
                    observation.number == Some(number) && observation.rate.is_some() == has_rate
                };
                let values: Vec<usize> = (0..observations.len()).filter(of).collect();
                let rate = values.iter().find_map(|i| observations[*i].rate);
                for (t, state) in nodes.iter().zip(&mut states) {
                    let Some((value, slope)) = self.interpolated(&values, *t) else { continue };
                    state[number] = value;
                    if let Some(rate) = rate {
                        state[rate] = slope;
                    }
                }
            }
        }
        states
    }

    /// The data with these indices and their slope at a time, by linear interpolation; `None` outside their span.
    fn interpolated(&self, values: &[usize], t: f64) -> Option<(f64, f64)> {
        let Residuals { data, weights, .. } = &self.problem.residuals;
        let known = values.iter().filter(|i| weights[**i] > 0.0);
        let points: Vec<(f64, f64)> = known.map(|i| (self.shooting.observations[*i].t, data[*i])).collect();
        let before = points.iter().filter(|p| p.0 <= t).max_by(|a, b| a.0.total_cmp(&b.0))?;
        let after = points.iter().filter(|p| p.0 > t).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let slope = (after.1 - before.1) / (after.0 - before.0);
        Some((before.1 + slope * (t - before.0), slope))
    }

    /// The size of each number of the states.
    fn scales(&self, start: &[f64], states: &[Vec<f64>]) -> Vec<f64> {
        let mut squares = vec![0.0; self.shooting.size];
        for state in states.iter().chain([&self.shooting.motion.start_state(start)]) {
            for (square, x) in squares.iter_mut().zip(state) {
                *square += x * x;
            }
        }
        let scale = |square: &f64| (square / (states.len() + 1) as f64).sqrt();
        squares.iter().map(scale).map(|s| if s > 0.0 && s.is_finite() { s } else { 1.0 }).collect()
    }

    /// The residuals with defects: a relative defect counts as the same relative deviation of the data.
    fn with_defects(&self, scales: &[f64], weight: f64) -> Residuals<'_, ShootingModel<'_, M>> {
        let Residuals { data, weights, loss, .. } = &self.problem.residuals;
        let known = || data.iter().zip(weights).filter(|(_, w)| **w > 0.0);
        let squares: f64 = known().map(|(y, w)| (y * w) * (y * w)).sum();
        let size = (squares / known().count().max(1) as f64).sqrt();
        let size = if size > 0.0 { size } else { 1.0 };
        let defects = self.shooting.nodes.len() * self.shooting.size;
        let defect_weights = (0..defects).map(|i| weight * size / scales[i % scales.len()]);
        Residuals {
            model: &self.shooting,
            names: self.shooting.parameter_names(),
            data: data.iter().copied().chain((0..defects).map(|_| 0.0)).collect(),
            weights: weights.iter().copied().chain(defect_weights).collect(),
            loss: *loss,
            constraints: defects,
        }
    }

    /// The fit of the unknowns of the motion.
    fn result(&self, fit: Fit, scales: &[f64]) -> ShootingFit {
        let (count, values) = (self.shooting.unknowns, self.shooting.observations.len());
        let largest_defect = fit.values[values..]
            .iter()
            .enumerate()
            .map(|(i, defect)| defect.abs() / scales[i % scales.len()])
            .fold(0.0, contact_geom::numbers::max_or_nan);
        let residuals = fit.residuals.rows(0, values).into_owned();
        let nodes = fit.parameters[count..].chunks(self.shooting.size).map(<[f64]>::to_vec).collect::<Vec<_>>();
        let loss = self.problem.residuals.loss;
        let reduced = Fit {
            names: fit.names[..count].to_vec(),
            parameters: fit.parameters[..count].to_vec(),
            at_bounds: fit.at_bounds[..count].to_vec(),
            cost: residuals.iter().map(|r| loss.cost(*r)).sum(),
            values: fit.values[..values].to_vec(),
            jacobian: self.eliminated(&fit),
            rank: fit.rank.saturating_sub(nodes.len() * self.shooting.size),
            cofactors: fit.cofactors.as_ref().map(|c| c.view((0, 0), (count, count)).into_owned()),
            residuals,
            ..fit
        };
        ShootingFit { fit: reduced, nodes, largest_defect }
    }

    /// The Jacobian of the data with respect to the unknowns of the motion, with nodes that follow them.
    fn eliminated(&self, fit: &Fit) -> DMatrix<f64> {
        let (count, values) = (self.shooting.unknowns, self.shooting.observations.len());
        let size = self.shooting.size;
        let own = |row: usize, rows: usize| fit.jacobian.view((row, 0), (rows, count));
        let mut jacobian = own(0, values).into_owned();
        let mut node: Option<DMatrix<f64>> = None;
        for k in 0..self.shooting.nodes.len() {
            let row = values + k * size;
            // 0 = D (reached' - node'), with the weights D of the defects, which are those of the nodes themselves.
            let mut reached = own(row, size).into_owned();
            if let Some(before) = &node {
                reached += fit.jacobian.view((row, count + (k - 1) * size), (size, size)) * before;
            }
            let place = count + k * size;
            for i in 0..size {
                let weight = -fit.jacobian[(row + i, place + i)];
                reached.row_mut(i).scale_mut(weight.recip());
            }
            jacobian += fit.jacobian.view((0, place), (values, size)) * &reached;
            node = Some(reached);
        }
        jacobian
    }
}
